"""Corrections that are not in the paper; each can be turned off."""
