"""Read and write files: training images, hard data, realizations, parameters.

Arguments shared by several functions are explained only here:

- `path_or_file`: a path or a binary file. The format of a file is detected from its content, not
  from its name. A path is written completely or not at all.
- `format`: the format to write; by default the ending of the path. A file object needs it.
- `grid`: a `Grid`, or (rows, columns) or (layers, rows, columns) of cells of size 1 from (0, 0).
- `training_image`: defines the known facies and their names.
- `grid_shape`: shape of the simulation grid, (ny, nx) or (nz, ny, nx).
- `colours`: the colours of a PNG, one `#rrggbb` per facies.
- `columns`: names of columns, which are guessed by default.
- `n_rows`: the number of rows to show, at least 1.

Row 0 of an array is in the south, and layer 0 at the bottom. Functions raise `CCWSIMError`, with
line numbers if there are any, for files that cannot be read or written, and data that do not fit.
"""

from ccwsim.io.atomic import can_write as can_write
from ccwsim.io.flow_models import (
    flopy_as_zip as flopy_as_zip,
    grdecl_as_zip as grdecl_as_zip,
    millidarcy as millidarcy,
    to_flopy as to_flopy,
    write_grdecl as write_grdecl,
)
from ccwsim.io.formats.pictures import DEFAULT_COLOURS as DEFAULT_COLOURS
from ccwsim.io.hard_data.columns import PointColumns as PointColumns, WellColumns as WellColumns
from ccwsim.io.hard_data.files import (
    hard_data_as_bytes as hard_data_as_bytes,
    import_hard_data as import_hard_data,
    read_hard_data as read_hard_data,
    write_hard_data as write_hard_data,
)
from ccwsim.io.hard_data.placing import (
    Conversion as Conversion,
    HardDataImport as HardDataImport,
    PlacedPoints as PlacedPoints,
    fit_grid as fit_grid,
    place_points as place_points,
    resolve_points as resolve_points,
)
from ccwsim.io.hard_data.points import (
    ImportedPoints as ImportedPoints,
    PointsPreview as PointsPreview,
    preview_points as preview_points,
    read_points as read_points,
)
from ccwsim.io.hard_data.wells import (
    import_wells as import_wells,
    preview_wells as preview_wells,
    read_well_points as read_well_points,
    read_wells as read_wells,
)
from ccwsim.io.limits import limited as limited, upload_limits as upload_limits
from ccwsim.io.maps import (
    MAP_FORMATS as MAP_FORMATS,
    maps_as_bytes as maps_as_bytes,
    write_maps as write_maps,
)
from ccwsim.io.opening import (
    FileSummary as FileSummary,
    VariableSummary as VariableSummary,
    inspect as inspect,
)
from ccwsim.io.realizations import (
    REALIZATION_FORMATS as REALIZATION_FORMATS,
    parameters_from_json as parameters_from_json,
    parameters_to_json as parameters_to_json,
    read_realizations as read_realizations,
    realizations_as_bytes as realizations_as_bytes,
    write_realizations as write_realizations,
)
from ccwsim.io.secondary import (
    angles_along as angles_along,
    read_active as read_active,
    read_lines as read_lines,
    read_probabilities as read_probabilities,
    read_values as read_values,
)
from ccwsim.io.training_images import (
    guess_answers as guess_answers,
    read_colours as read_colours,
    read_geometry as read_geometry,
    read_grid as read_grid,
    read_training_image as read_training_image,
    training_image_as_bytes as training_image_as_bytes,
    write_training_image as write_training_image,
)
from ccwsim.model import class_edges as class_edges, classify as classify
