"""Many realizations: where they are simulated and where they are kept."""
