"""Experiments: timing, parameter sweeps and comparisons of settings."""
