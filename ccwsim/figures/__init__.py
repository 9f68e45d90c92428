"""Charts (plotly figures) and pictures (PNG bytes) of nouns and results; nothing is computed."""

from ccwsim.figures.calibration import calibration_chart
from ccwsim.figures.convergence import convergence_chart
from ccwsim.figures.curves import Bundle, curves_chart
from ccwsim.figures.divergences import divergence_chart
from ccwsim.figures.lag_maps import lag_map_chart
from ccwsim.figures.met_by import met_by_chart
from ccwsim.figures.palette import CIVIDIS, ENTROPY, FACIES, facies_colours, ramp
from ccwsim.figures.proportions import proportions_chart, proportions_height
from ccwsim.figures.rasters import contact_sheet, data_png, index_png, map_png, tile_size
from ccwsim.figures.repetition import repetition_chart
from ccwsim.figures.scaling import scaling_chart
from ccwsim.figures.strips import Strip, strip_chart
from ccwsim.figures.style import DARK, LIGHT, Theme, theme_named
from ccwsim.figures.times import times_chart
from ccwsim.figures.transitions import transiogram_chart

__all__ = [
    "CIVIDIS",
    "DARK",
    "ENTROPY",
    "FACIES",
    "LIGHT",
    "Bundle",
    "Strip",
    "Theme",
    "calibration_chart",
    "contact_sheet",
    "convergence_chart",
    "curves_chart",
    "data_png",
    "divergence_chart",
    "facies_colours",
    "index_png",
    "lag_map_chart",
    "map_png",
    "met_by_chart",
    "proportions_chart",
    "proportions_height",
    "ramp",
    "repetition_chart",
    "scaling_chart",
    "strip_chart",
    "theme_named",
    "tile_size",
    "times_chart",
    "transiogram_chart",
]
