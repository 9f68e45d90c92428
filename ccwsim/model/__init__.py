"""The inputs and results of a simulation; all objects are immutable.

Other folders import from this package, not from its modules.
"""

from ccwsim.model.active_cells import (
    active_windows,
    even_corners,
    smallest_box,
    window_shape,
    windows_at,
)
from ccwsim.model.arrays import (
    CELL_AXES,
    MAX_INT,
    WORLD_AXES,
    Array,
    ArrayLike,
    Bytes,
    Float32s,
    Floats,
    Int16s,
    Int32s,
    Integers,
    Ints,
    LazyStack,
    Mask,
    Shape,
    UInt32s,
    UInt64s,
    as_array,
    as_floats,
    as_integers,
    as_seed,
    check_callable,
    check_choice,
    check_int,
    check_number,
    check_type,
    codes_of,
    describe_shape,
    digest,
    frozen,
    is_integer,
    is_table,
    is_top_first,
    labelled_axes,
    listing,
    oriented_values,
    ratio,
    readonly,
    window_at,
)
from ccwsim.model.assets import read_toml
from ccwsim.model.bounds import (
    MAX_AUXILIARY_WEIGHT,
    MAX_CANDIDATES,
    MAX_CANDIDATES_OFFERED,
    MAX_CONDUCTIVITY,
    MAX_CONTRAST,
    MAX_CURVES,
    MAX_DEGREES,
    MAX_FACIES,
    MAX_GRID_SIDE_OFFERED,
    MAX_IMAGES,
    MAX_LAG,
    MAX_LINK_DATA,
    MAX_LINK_LETTERS,
    MAX_LINK_VALUES,
    MAX_MAGNITUDE,
    MAX_REALIZATIONS,
    MAX_REALIZATIONS_COMPARED,
    MAX_REALIZATIONS_OF_SWEEP,
    MAX_REALIZATIONS_TIMED,
    MAX_SAMPLED,
    MAX_SAMPLING_STEP,
    MAX_SCALE,
    MAX_SEED,
    MAX_SETTINGS,
    MAX_SOFT_WEIGHT,
    MAX_TEMPLATE,
    MAX_WRITTEN_DATA,
    MIN_CONDUCTIVITY,
    MIN_SCALE,
    MIN_SETTINGS,
    MIN_TEMPLATE,
)
from ccwsim.model.classes import (
    MAX_CODES,
    Classes,
    Merge,
    are_codes,
    asks_for_codes,
    class_edges,
    classify,
    merge_facies,
)
from ccwsim.model.ensemble import FORCED, WRONG, Ensemble, codes_with_nan, concatenate
from ccwsim.model.errors import Cancelled, CCWSIMError, refused, shown, warn
from ccwsim.model.extras import check_installed, is_installed, needs
from ccwsim.model.facies_match import (
    FaciesMatch,
    FaciesNames,
    code_or_name,
    describe_codes,
    facies_label,
    match_facies,
)
from ccwsim.model.facies_property import (
    Cells,
    FaciesValues,
    FromValues,
    PropertyValues,
    cell_values,
    cells_of,
    check_magnitudes,
    describe_rocks,
    values_by_facies,
)
from ccwsim.model.grid import Grid, describe_cell, fault_of_crs
from ccwsim.model.hard_data import HardData
from ccwsim.model.missing import CUSTOMARY_CODES, UNKNOWN, known_values, unknown_note
from ccwsim.model.numbers import (
    coordinate,
    duration,
    format_bytes,
    minus,
    plural,
    three_digits,
    with_power,
)
from ccwsim.model.parameters import (
    METHODS,
    PARAMETER_CHOICES,
    PER_AXIS,
    Method,
    Parameters,
    describe_weight,
    fitted,
    parameter_table,
)
from ccwsim.model.published import VARIANT_SETTINGS, WITHOUT_ADDITIONS, Variant
from ccwsim.model.secondary import (
    Auxiliary,
    Secondary,
    active_codes,
    cells_in_polygon,
    maps_by_code,
    match_of_image,
    match_of_probabilities,
    note_on_radians,
    recoded_image,
)
from ccwsim.model.sizes import (
    Triple,
    in_layers,
    largest_sides,
    legal_sizes,
    levels,
    overlap_sizes,
    per_axis,
    template_sizes,
)
from ccwsim.model.study import Study
from ccwsim.model.training_image import N_RANKS, TrainingImage, index_of
from ccwsim.model.watch import UNWATCHED, Cancel, Fraction, Progress, Watch
