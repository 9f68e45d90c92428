"""Charts (plotly figures) and pictures (PNG bytes) of computed inputs and results.

Functions that return charts take a `Theme` and heights in pixels. `names` are the names of the
facies, and `colours` are the colours of the facies as "#rrggbb".
"""
# ruff: noqa: E402 - the modules below import plotly

from ccwsim.model import check_installed

check_installed("plotly")

from ccwsim.figures.curves import (
    Bundle as Bundle,
    LayerData as LayerData,
    Line as Line,
    curves_chart as curves_chart,
    geobody_sizes_chart as geobody_sizes_chart,
    lines_chart as lines_chart,
    repetition_chart as repetition_chart,
    sparkline as sparkline,
    transiogram_chart as transiogram_chart,
    vertical_proportions_chart as vertical_proportions_chart,
)
from ccwsim.figures.flow import (
    breakthrough_chart as breakthrough_chart,
    conductivity_chart as conductivity_chart,
)
from ccwsim.figures.maps import (
    Dots as Dots,
    contact_sheet as contact_sheet,
    data_map_png as data_map_png,
    data_png as data_png,
    map_png as map_png,
    placement_svg as placement_svg,
    slices_of as slices_of,
    slices_png as slices_png,
    tile_size as tile_size,
)
from ccwsim.figures.proportions import (
    compared_proportions_chart as compared_proportions_chart,
    proportions_chart as proportions_chart,
)
from ccwsim.figures.style import (
    CIVIDIS as CIVIDIS,
    DARK as DARK,
    DASHES as DASHES,
    ENTROPY as ENTROPY,
    FACIES as FACIES,
    LIGHT as LIGHT,
    MARKER_SYMBOLS as MARKER_SYMBOLS,
    VALUE_COLOURS as VALUE_COLOURS,
    Theme as Theme,
    facies_colours as facies_colours,
    figure_json as figure_json,
    mixed as mixed,
    packed_plotly as packed_plotly,
    ramp as ramp,
    steps_of as steps_of,
)
from ccwsim.figures.sweep import sweep_chart as sweep_chart
from ccwsim.figures.times import (
    TimeSeries as TimeSeries,
    compared_times_chart as compared_times_chart,
    times_chart as times_chart,
    timings_chart as timings_chart,
)
from ccwsim.figures.validation import (
    Group as Group,
    Strip as Strip,
    calibration_chart as calibration_chart,
    data_status_chart as data_status_chart,
    divergence_chart as divergence_chart,
    lag_map_chart as lag_map_chart,
    mds_chart as mds_chart,
    mds_title as mds_title,
    strip_chart as strip_chart,
)
