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
from ccwsim.io.flow_models import flopy_as_zip as flopy_as_zip
from ccwsim.io.flow_models import grdecl_as_zip as grdecl_as_zip
from ccwsim.io.flow_models import millidarcy as millidarcy
from ccwsim.io.flow_models import to_flopy as to_flopy
from ccwsim.io.flow_models import write_grdecl as write_grdecl
from ccwsim.io.formats.pictures import DEFAULT_COLOURS as DEFAULT_COLOURS
from ccwsim.io.hard_data.columns import PointColumns as PointColumns
from ccwsim.io.hard_data.columns import WellColumns as WellColumns
from ccwsim.io.hard_data.files import hard_data_as_bytes as hard_data_as_bytes
from ccwsim.io.hard_data.files import import_hard_data as import_hard_data
from ccwsim.io.hard_data.files import read_hard_data as read_hard_data
from ccwsim.io.hard_data.files import write_hard_data as write_hard_data
from ccwsim.io.hard_data.placing import Conversion as Conversion
from ccwsim.io.hard_data.placing import HardDataImport as HardDataImport
from ccwsim.io.hard_data.placing import PlacedPoints as PlacedPoints
from ccwsim.io.hard_data.placing import fit_grid as fit_grid
from ccwsim.io.hard_data.placing import place_points as place_points
from ccwsim.io.hard_data.placing import resolve_points as resolve_points
from ccwsim.io.hard_data.points import ImportedPoints as ImportedPoints
from ccwsim.io.hard_data.points import PointsPreview as PointsPreview
from ccwsim.io.hard_data.points import preview_points as preview_points
from ccwsim.io.hard_data.points import read_points as read_points
from ccwsim.io.hard_data.wells import import_wells as import_wells
from ccwsim.io.hard_data.wells import preview_wells as preview_wells
from ccwsim.io.hard_data.wells import read_well_points as read_well_points
from ccwsim.io.hard_data.wells import read_wells as read_wells
from ccwsim.io.limits import limited as limited
from ccwsim.io.limits import upload_limits as upload_limits
from ccwsim.io.maps import MAP_FORMATS as MAP_FORMATS
from ccwsim.io.maps import maps_as_bytes as maps_as_bytes
from ccwsim.io.maps import write_maps as write_maps
from ccwsim.io.opening import FileSummary as FileSummary
from ccwsim.io.opening import VariableSummary as VariableSummary
from ccwsim.io.opening import inspect as inspect
from ccwsim.io.realizations import REALIZATION_FORMATS as REALIZATION_FORMATS
from ccwsim.io.realizations import parameters_from_json as parameters_from_json
from ccwsim.io.realizations import parameters_to_json as parameters_to_json
from ccwsim.io.realizations import read_realizations as read_realizations
from ccwsim.io.realizations import realizations_as_bytes as realizations_as_bytes
from ccwsim.io.realizations import write_realizations as write_realizations
from ccwsim.io.secondary import angles_along as angles_along
from ccwsim.io.secondary import read_active as read_active
from ccwsim.io.secondary import read_lines as read_lines
from ccwsim.io.secondary import read_probabilities as read_probabilities
from ccwsim.io.secondary import read_values as read_values
from ccwsim.io.training_images import guess_answers as guess_answers
from ccwsim.io.training_images import read_colours as read_colours
from ccwsim.io.training_images import read_geometry as read_geometry
from ccwsim.io.training_images import read_grid as read_grid
from ccwsim.io.training_images import read_training_image as read_training_image
from ccwsim.io.training_images import training_image_as_bytes as training_image_as_bytes
from ccwsim.io.training_images import write_training_image as write_training_image
from ccwsim.model.classes import class_edges as class_edges
from ccwsim.model.classes import classify as classify
