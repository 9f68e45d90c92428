"""The steps of Algorithm 1, one file each; `ccwsim.run.simulation` knows their order."""
