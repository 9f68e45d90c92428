"""Charts (plotly figures) and pictures (PNG bytes) of computed inputs and results.

Functions that return charts take a `Theme` and heights in pixels. `names` are the names of the
facies, and `colours` are the colours of the facies as "#rrggbb".
"""

from ccwsim.figures.curves import (
    Bundle,
    LayerData,
    Line,
    curves_chart,
    geobody_sizes_chart,
    lines_chart,
    repetition_chart,
    sparkline,
    transiogram_chart,
    vertical_proportions_chart,
)
from ccwsim.figures.maps import (
    Dots,
    contact_sheet,
    data_map_png,
    data_png,
    index_png,
    map_png,
    placement_svg,
    share_png,
    steps_of,
    tile_size,
)
from ccwsim.figures.mds import Group, mds_chart, mds_title
from ccwsim.figures.palette import CIVIDIS, DIFFERENCE, ENTROPY, FACIES, facies_colours, ramp
from ccwsim.figures.proportions import (
    compared_proportions_chart,
    proportions_chart,
    proportions_height,
)
from ccwsim.figures.slices import VolumeSlice, slices_of, slices_png
from ccwsim.figures.style import (
    DARK,
    DASHES,
    LIGHT,
    SYMBOLS,
    Theme,
    difference_colours,
    figure_json,
    plotly_script,
    setting_colours,
    theme_named,
)
from ccwsim.figures.sweep import sweep_chart
from ccwsim.figures.times import TimeSeries, compared_times_chart, times_chart, timings_chart
from ccwsim.figures.validation import (
    Strip,
    calibration_chart,
    convergence_chart,
    data_status_chart,
    divergence_chart,
    lag_map_chart,
    strip_chart,
)

__all__ = [
    "CIVIDIS",
    "DARK",
    "DASHES",
    "DIFFERENCE",
    "ENTROPY",
    "FACIES",
    "LIGHT",
    "SYMBOLS",
    "Bundle",
    "Dots",
    "Group",
    "LayerData",
    "Line",
    "Strip",
    "Theme",
    "TimeSeries",
    "VolumeSlice",
    "calibration_chart",
    "compared_proportions_chart",
    "compared_times_chart",
    "contact_sheet",
    "convergence_chart",
    "curves_chart",
    "data_map_png",
    "data_png",
    "data_status_chart",
    "difference_colours",
    "divergence_chart",
    "facies_colours",
    "figure_json",
    "geobody_sizes_chart",
    "index_png",
    "lag_map_chart",
    "lines_chart",
    "map_png",
    "mds_chart",
    "mds_title",
    "placement_svg",
    "plotly_script",
    "proportions_chart",
    "proportions_height",
    "ramp",
    "repetition_chart",
    "setting_colours",
    "share_png",
    "slices_of",
    "slices_png",
    "sparkline",
    "steps_of",
    "strip_chart",
    "sweep_chart",
    "theme_named",
    "tile_size",
    "times_chart",
    "timings_chart",
    "transiogram_chart",
    "vertical_proportions_chart",
]
