"""The nouns: inputs and results of a simulation. All are immutable."""
