"""Reproduction of the paper's experiments, and the report of the results."""
