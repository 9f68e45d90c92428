"""The column of steps 1 to 5 that sets up a study."""
