"""The steps of Algorithm 1, one file for each step; `ccwsim.engine.tiles` calls the steps in
order."""
