"""Bundled training images and hard data.

Seeded generators (tools/datasets in the source repository) made all images and data, which are
therefore reproducible and free to use. All functions that take a name raise `CCWSIMError` if the
name is unknown or a file is missing.
"""

from ccwsim.datasets.catalogue import BUNDLED_DATA as BUNDLED_DATA
from ccwsim.datasets.catalogue import BUNDLED_IMAGES as BUNDLED_IMAGES
from ccwsim.datasets.catalogue import BUNDLED_WELLS as BUNDLED_WELLS
from ccwsim.datasets.catalogue import describe as describe
from ccwsim.datasets.catalogue import describe_hard_data as describe_hard_data
from ccwsim.datasets.catalogue import hard_data_grid_shape as hard_data_grid_shape
from ccwsim.datasets.catalogue import hard_data_names as hard_data_names
from ccwsim.datasets.catalogue import hard_data_training_image as hard_data_training_image
from ccwsim.datasets.catalogue import load as load
from ccwsim.datasets.catalogue import load_hard_data as load_hard_data
from ccwsim.datasets.catalogue import load_reference_field as load_reference_field
from ccwsim.datasets.catalogue import names as names
from ccwsim.datasets.catalogue import volume_names as volume_names
