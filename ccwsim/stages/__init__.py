"""The steps of Algorithm 1, one file each; `ccwsim.simulation` knows their order."""
