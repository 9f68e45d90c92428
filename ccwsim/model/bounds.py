"""Bounds of user input, shared by core, widgets, links, projects and command line.

If a page accepts less than the core, this module lists both bounds.
"""

MAX_SEED = 2**31 - 1
"""Maximum seed in widgets and links, exact in the browser and in 32-bit integers."""

# Training image and grid
MAX_FACIES = 254
"""Maximum number of facies: kernels use bytes, and 255 marks cells that are not simulated yet."""
MAX_GRID_SIDE = 2**31 - 1
"""Maximum number of cells along a side of a grid: row and column indices have 32 bits."""
MAX_GRID_SIDE_OFFERED = 10_000
"""Maximum number of cells along a side in pages and links; no screen shows a larger map."""

# Parameters
MIN_TEMPLATE, MAX_TEMPLATE = 4, 1024
"""Limits of template sides in cells: smaller patches contain no pattern, few images are larger."""
MAX_OVERLAP = MAX_TEMPLATE // 2
"""Maximum overlap in cells: overlaps on opposite sides of a patch must not intersect."""
MAX_LEVEL = 6
"""Maximum wavelet level; then, one coefficient covers 64 × 64 cells, more than most templates."""
MAX_CANDIDATES = 10**6
"""Maximum number of candidates K, about the number of locations in a TI of 1000 × 1000 cells."""
MAX_CANDIDATES_OFFERED = 10_000
"""Maximum number of candidates K on a page; with a larger K, the choice is nearly random."""
MAX_CO_TEMPLATE = 4
"""Maximum look-ahead for data, in template sizes; more distant data hardly influence a patch."""
MAX_TEMPLATE_VARIATION = 0.5
"""Maximum relative variation of the template size; the overlap must fit the smallest template."""
MAX_LOCATION_WEIGHT = 10.0
"""Maximum location weight; at this weight, distant locations are hardly ever chosen."""

MAX_AUXILIARY_WEIGHT = 10.0  # maximum weight of an auxiliary variable
MAX_IMAGES = 8  # maximum number of training images of a study
MAX_DEGREES, MAX_DIP = 360.0, 80.0  # maximum absolute angle and dip of images
MIN_SCALE, MAX_SCALE = 0.2, 5.0  # range of the factor by which images are enlarged
MAX_SOFT_WEIGHT = 5.0  # maximum strength of probabilities; at this strength, overlaps hardly count

PARAMETER_BOUNDS: dict[str, tuple[float, float]] = {
    "template_size": (MIN_TEMPLATE, MAX_TEMPLATE),
    "overlap_size": (1, MAX_OVERLAP),
    "wavelet_level": (0, MAX_LEVEL),
    "n_candidates": (1, MAX_CANDIDATES),
    "co_template": (1, MAX_CO_TEMPLATE),
    "search_fraction": (0.0, 1.0),
    "template_variation": (0.0, MAX_TEMPLATE_VARIATION),
    "location_weight": (0.0, MAX_LOCATION_WEIGHT),
}
"""Range of each numerical parameter; a search fraction must also be larger than 0."""

# Realizations; their cost differs between pages
MAX_REALIZATIONS = 1000
"""Maximum number of realizations on a page or in a link, all stored in memory and plotted."""
MAX_REALIZATIONS_OF_PROJECT = 1_000_000
"""Maximum number of realizations in a project file, for scripts."""
MIN_SETTINGS, MAX_SETTINGS = 2, 4
"""Smallest and largest number of compared settings."""
MAX_REALIZATIONS_COMPARED = 100
"""Maximum number of realizations of each setting on the page Compare."""
MAX_REALIZATIONS_TIMED = 100
"""Maximum number of realizations of each timed case on the page Benchmark."""
MAX_REALIZATIONS_OF_SWEEP = 50
"""Maximum number of realizations for each setting of a sweep; a sweep has up to 64 settings."""

# World coordinates
MIN_FLOAT, MAX_FLOAT = 5e-324, 1.8e308
"""Range of 64-bit floating-point numbers, for cell sizes and origins."""

MAX_CRS_LETTERS = 8000
"""Maximum length of a coordinate system; definitions in WKT have up to about 5000 letters."""

# Hard data
MAX_SAMPLED = 100_000
"""Maximum number of data sampled from a reference field; uploaded data have the same limit."""
MAX_SAMPLING_STEP = 10_000
"""Maximum distance in cells between sampled data: the largest side of a grid on a page."""
MAX_LINK_DATA = 200
"""Maximum number of hand-placed data in a link, because mail programs cut longer addresses."""
MAX_LINK_VALUES = 200
"""Maximum number of values that are read from a link; a study has one for most of its settings."""
MAX_LINK_LETTERS = 20_000
"""Maximum number of letters that are read from a link; packed hard data take up to 8000."""
MAX_WRITTEN_DATA = 40
"""Maximum number of data listed in a script; a script with more data reads the project file."""

# Flow
MIN_CONDUCTIVITY, MAX_CONDUCTIVITY = 1e-14, 1e3
"""Range of hydraulic conductivities on a page, from dense clay in m/s to gravel in m/d."""
MIN_MAGNITUDE, MAX_MAGNITUDE = 1e-30, 1e30  # range of properties, cell sizes, heads and rates
MAX_CONTRAST = 1e12  # maximum ratio of two values of a property; larger ratios are mixed units

# Statistics
MAX_LAG = 100
"""Maximum lag in cells of variograms and connectivity; small images have lags up to half a side."""
MAX_CURVES = 100
"""Maximum number of realizations plotted as curves; more curves would hide each other."""
