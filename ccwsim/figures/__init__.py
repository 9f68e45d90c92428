"""Charts (plotly figures) and pictures (PNG bytes) of nouns and results; nothing is computed."""

from ccwsim.figures.calibration import calibration_chart
from ccwsim.figures.compared_curves import compared_curves_chart
from ccwsim.figures.compared_proportions import compared_proportions_chart
from ccwsim.figures.compared_scaling import compared_scaling_chart
from ccwsim.figures.compared_times import compared_times_chart
from ccwsim.figures.convergence import convergence_chart
from ccwsim.figures.curves import Bundle, curves_chart
from ccwsim.figures.data_maps import Dots, data_map_png, share_png
from ccwsim.figures.data_status import data_status_chart
from ccwsim.figures.divergences import divergence_chart
from ccwsim.figures.grouped_scaling import grouped_scaling_chart
from ccwsim.figures.lag_maps import lag_map_chart
from ccwsim.figures.lines import Line, lines_chart
from ccwsim.figures.palette import CIVIDIS, ENTROPY, FACIES, facies_colours, ramp
from ccwsim.figures.proportions import proportions_chart, proportions_height
from ccwsim.figures.rasters import contact_sheet, data_png, index_png, map_png, tile_size
from ccwsim.figures.repetition import repetition_chart
from ccwsim.figures.scaling import scaling_chart
from ccwsim.figures.setting_marks import DASHES, setting_colours
from ccwsim.figures.sparkline import sparkline
from ccwsim.figures.standalone import figure_json, plotly_script
from ccwsim.figures.strips import Strip, strip_chart
from ccwsim.figures.style import DARK, LIGHT, Theme, theme_named
from ccwsim.figures.sweep import sweep_chart
from ccwsim.figures.times import times_chart
from ccwsim.figures.timings import TimeSeries, timings_chart
from ccwsim.figures.transitions import transiogram_chart

__all__ = [
    "CIVIDIS",
    "DARK",
    "DASHES",
    "ENTROPY",
    "FACIES",
    "LIGHT",
    "Bundle",
    "Dots",
    "Line",
    "Strip",
    "Theme",
    "TimeSeries",
    "calibration_chart",
    "compared_curves_chart",
    "compared_proportions_chart",
    "compared_scaling_chart",
    "compared_times_chart",
    "contact_sheet",
    "convergence_chart",
    "curves_chart",
    "data_map_png",
    "data_png",
    "data_status_chart",
    "divergence_chart",
    "facies_colours",
    "figure_json",
    "grouped_scaling_chart",
    "index_png",
    "lag_map_chart",
    "lines_chart",
    "map_png",
    "plotly_script",
    "proportions_chart",
    "proportions_height",
    "ramp",
    "repetition_chart",
    "scaling_chart",
    "setting_colours",
    "share_png",
    "sparkline",
    "strip_chart",
    "sweep_chart",
    "theme_named",
    "tile_size",
    "times_chart",
    "timings_chart",
    "transiogram_chart",
]
