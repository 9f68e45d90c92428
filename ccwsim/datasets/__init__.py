"""Training images and hard data that come with the program.

Every one is drawn by a seeded generator of this package, so all of them are free to use, can be
made again, and can be made at other sizes and with other seeds.
"""

from ccwsim.datasets.images import describe, generate, load, names
from ccwsim.datasets.surveys import (
    describe_hard_data,
    generate_hard_data,
    generate_truth,
    hard_data_grid_shape,
    hard_data_names,
    hard_data_training_image,
    load_hard_data,
)

__all__ = [
    "describe",
    "describe_hard_data",
    "generate",
    "generate_hard_data",
    "generate_truth",
    "hard_data_grid_shape",
    "hard_data_names",
    "hard_data_training_image",
    "load",
    "load_hard_data",
    "names",
]
