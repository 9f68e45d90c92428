"""Many realizations: their executors, their storage, and the memory they take."""
