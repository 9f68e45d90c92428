"""The simulation of one realization: Algorithm 1 of the paper, its stages and its trace."""
