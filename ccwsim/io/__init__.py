"""Read and write files: training images, hard data, realizations, parameters."""

from ccwsim.io.flow_models import (
    flopy_as_zip,
    grdecl_files,
    millidarcy,
    to_flopy,
    write_grdecl,
    zipped,
)
from ccwsim.io.formats.pictures import DEFAULT_COLOURS
from ccwsim.io.hard_data.columns import PointColumns, WellColumns
from ccwsim.io.hard_data.files import (
    hard_data_as_bytes,
    import_hard_data,
    read_hard_data,
    write_hard_data,
)
from ccwsim.io.hard_data.placing import (
    Conversion,
    HardDataImport,
    PlacedPoints,
    fit_grid,
    place_points,
    resolve_points,
)
from ccwsim.io.hard_data.points import (
    ImportedPoints,
    PointsPreview,
    preview_points,
    read_points,
)
from ccwsim.io.hard_data.wells import import_wells, preview_wells, read_well_points, read_wells
from ccwsim.io.limits import limited, upload_limits
from ccwsim.io.maps import MAP_FORMATS, can_write, maps_as_bytes, write_maps
from ccwsim.io.opening import FileSummary, VariableSummary, inspect
from ccwsim.io.realizations import (
    FORMATS,
    parameters_from_json,
    parameters_to_json,
    read_realizations,
    realizations_as_bytes,
    write_realizations,
)
from ccwsim.io.secondary import read_active, read_probabilities, read_values
from ccwsim.io.training_images import (
    guess_answers,
    read_colours,
    read_geometry,
    read_grid,
    read_training_image,
    training_image_as_bytes,
    write_training_image,
)
from ccwsim.model.classes import class_edges, classify

__all__ = [
    "DEFAULT_COLOURS",
    "FORMATS",
    "MAP_FORMATS",
    "Conversion",
    "FileSummary",
    "HardDataImport",
    "ImportedPoints",
    "PlacedPoints",
    "PointColumns",
    "PointsPreview",
    "VariableSummary",
    "WellColumns",
    "can_write",
    "class_edges",
    "classify",
    "fit_grid",
    "flopy_as_zip",
    "grdecl_files",
    "guess_answers",
    "hard_data_as_bytes",
    "import_hard_data",
    "import_wells",
    "inspect",
    "limited",
    "maps_as_bytes",
    "millidarcy",
    "parameters_from_json",
    "parameters_to_json",
    "place_points",
    "preview_points",
    "preview_wells",
    "read_active",
    "read_colours",
    "read_geometry",
    "read_grid",
    "read_hard_data",
    "read_points",
    "read_probabilities",
    "read_realizations",
    "read_training_image",
    "read_values",
    "read_well_points",
    "read_wells",
    "realizations_as_bytes",
    "resolve_points",
    "to_flopy",
    "training_image_as_bytes",
    "upload_limits",
    "write_grdecl",
    "write_hard_data",
    "write_maps",
    "write_realizations",
    "write_training_image",
    "zipped",
]
