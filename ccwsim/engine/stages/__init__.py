"""The steps of Algorithm 1, one file each; `ccwsim.engine.tiles` calls them in their order."""
