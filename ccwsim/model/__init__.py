"""The inputs and results of a simulation; all objects are immutable."""
