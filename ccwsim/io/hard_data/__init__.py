"""Hard data: points in files, cells of a grid, and what is wrong with them."""
