"""The steps of Algorithm 1, one file per step; `ccwsim.engine.tiles` calls the steps in order."""
