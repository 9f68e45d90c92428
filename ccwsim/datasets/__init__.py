"""Training images and hard data that come with the program.

Seeded generators (tools/datasets in the source repository) draw all of them, so they are free to
use and reproducible.
"""

from ccwsim.datasets.catalogue import (
    all_hard_data_names,
    all_image_names,
    describe,
    describe_hard_data,
    hard_data_grid_shape,
    hard_data_names,
    hard_data_training_image,
    load,
    load_hard_data,
    load_reference_field,
    load_wells,
    names,
    volume_names,
    wells_names,
)

__all__ = [
    "all_hard_data_names",
    "all_image_names",
    "describe",
    "describe_hard_data",
    "hard_data_grid_shape",
    "hard_data_names",
    "hard_data_training_image",
    "load",
    "load_hard_data",
    "load_reference_field",
    "load_wells",
    "names",
    "volume_names",
    "wells_names",
]
