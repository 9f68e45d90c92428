"""Corrections that the paper does not have: each is ours, and can be left out."""
