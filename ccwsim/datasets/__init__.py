"""Training images and hard data that come with the program.

All of them were drawn by seeded generators (tools/datasets in the source repository), so they are
reproducible and free to use.
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
