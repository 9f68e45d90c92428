"""Simulate one realization by Algorithm 1 of the paper, and trace the algorithm step by step."""
