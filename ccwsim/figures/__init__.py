"""Charts (plotly figures) and pictures (PNG bytes) of computed inputs and results.

Functions that return charts take a `Theme` and heights in pixels. `names` are the names of the
facies, and `colours` are the colours of the facies as "#rrggbb".
"""
# ruff: noqa: E402 - the modules below import plotly

from ccwsim.model.extras import check_installed

check_installed("plotly")

from ccwsim.figures.curves import Bundle as Bundle
from ccwsim.figures.curves import LayerData as LayerData
from ccwsim.figures.curves import Line as Line
from ccwsim.figures.curves import curves_chart as curves_chart
from ccwsim.figures.curves import geobody_sizes_chart as geobody_sizes_chart
from ccwsim.figures.curves import lines_chart as lines_chart
from ccwsim.figures.curves import repetition_chart as repetition_chart
from ccwsim.figures.curves import sparkline as sparkline
from ccwsim.figures.curves import transiogram_chart as transiogram_chart
from ccwsim.figures.curves import vertical_proportions_chart as vertical_proportions_chart
from ccwsim.figures.flow import breakthrough_chart as breakthrough_chart
from ccwsim.figures.flow import conductivity_chart as conductivity_chart
from ccwsim.figures.maps import Dots as Dots
from ccwsim.figures.maps import contact_sheet as contact_sheet
from ccwsim.figures.maps import data_map_png as data_map_png
from ccwsim.figures.maps import data_png as data_png
from ccwsim.figures.maps import map_png as map_png
from ccwsim.figures.maps import placement_svg as placement_svg
from ccwsim.figures.maps import slices_of as slices_of
from ccwsim.figures.maps import slices_png as slices_png
from ccwsim.figures.maps import steps_of as steps_of
from ccwsim.figures.maps import tile_size as tile_size
from ccwsim.figures.proportions import compared_proportions_chart as compared_proportions_chart
from ccwsim.figures.proportions import proportions_chart as proportions_chart
from ccwsim.figures.proportions import proportions_height as proportions_height
from ccwsim.figures.style import CIVIDIS as CIVIDIS
from ccwsim.figures.style import DARK as DARK
from ccwsim.figures.style import DASHES as DASHES
from ccwsim.figures.style import ENTROPY as ENTROPY
from ccwsim.figures.style import FACIES as FACIES
from ccwsim.figures.style import LIGHT as LIGHT
from ccwsim.figures.style import MARKER_SYMBOLS as MARKER_SYMBOLS
from ccwsim.figures.style import Theme as Theme
from ccwsim.figures.style import facies_colours as facies_colours
from ccwsim.figures.style import figure_json as figure_json
from ccwsim.figures.style import mixed as mixed
from ccwsim.figures.style import plotly_script as plotly_script
from ccwsim.figures.style import ramp as ramp
from ccwsim.figures.sweep import sweep_chart as sweep_chart
from ccwsim.figures.times import TimeSeries as TimeSeries
from ccwsim.figures.times import compared_times_chart as compared_times_chart
from ccwsim.figures.times import times_chart as times_chart
from ccwsim.figures.times import timings_chart as timings_chart
from ccwsim.figures.validation import Group as Group
from ccwsim.figures.validation import Strip as Strip
from ccwsim.figures.validation import calibration_chart as calibration_chart
from ccwsim.figures.validation import convergence_chart as convergence_chart
from ccwsim.figures.validation import data_status_chart as data_status_chart
from ccwsim.figures.validation import divergence_chart as divergence_chart
from ccwsim.figures.validation import lag_map_chart as lag_map_chart
from ccwsim.figures.validation import mds_chart as mds_chart
from ccwsim.figures.validation import mds_title as mds_title
from ccwsim.figures.validation import strip_chart as strip_chart
