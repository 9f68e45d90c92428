"""Bundled training images and hard data.

Seeded generators (tools/datasets in the source repository) made all images and data, which are
therefore reproducible and free to use. All functions that take a name raise `CCWSIMError` if the
name is unknown or a file is missing.
"""

from ccwsim.datasets.catalogue import (
    BUNDLED_DATA as BUNDLED_DATA,
    BUNDLED_IMAGES as BUNDLED_IMAGES,
    BUNDLED_MEASUREMENTS as BUNDLED_MEASUREMENTS,
    BUNDLED_WELLS as BUNDLED_WELLS,
    describe as describe,
    describe_hard_data as describe_hard_data,
    hard_data_grid_shape as hard_data_grid_shape,
    hard_data_names as hard_data_names,
    hard_data_training_image as hard_data_training_image,
    load as load,
    load_hard_data as load_hard_data,
    load_reference_field as load_reference_field,
    names as names,
    volume_names as volume_names,
)
