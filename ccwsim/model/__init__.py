"""The nouns: what a simulation starts from and returns. All are immutable."""
