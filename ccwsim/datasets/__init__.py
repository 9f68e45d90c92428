"""Bundled training images and hard data.

Seeded generators (tools/datasets in the source repository) made all images and data, which are
therefore reproducible and free to use. All functions that take a name raise `CCWSIMError` if the
name is unknown or a file is missing.
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
