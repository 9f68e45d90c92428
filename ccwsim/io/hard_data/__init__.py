"""Read hard data from files, place them in cells of a grid, and report problems."""
