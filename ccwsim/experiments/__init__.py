"""Many settings simulated alike: timing, sweeps and comparisons."""
