"""The steps of Algorithm 1, one file each; `ccwsim.engine.tiles` has their order."""
