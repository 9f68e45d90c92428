"""Write the bundled files again: ``python -m ccwsim.datasets``."""

import numpy as np

from ccwsim import datasets
from ccwsim.datasets import files
from ccwsim.model.grid import Grid


def write_assets() -> None:
    """Draw every bundled training image and hard data set and write it to the assets folder."""
    for name in datasets.names():
        files.write_image(files.image_path(name), datasets.generate(name).array.astype(np.uint8))
    for name in datasets.hard_data_names():
        grid = Grid(*datasets.hard_data_grid_shape(name))
        data = datasets.generate_hard_data(name)
        files.write_hard_data(files.hard_data_path(name), data, grid)


if __name__ == "__main__":
    write_assets()
    print(f"wrote training images and hard data to {files.ASSETS}")
