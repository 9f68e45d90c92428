"""Validation of realizations against the training image, the data and a reference field.

Arguments shared by several functions are explained only here:

- `images`: an `Ensemble`, a `TrainingImage`, or an array of facies codes, shape (ny, nx),
  (n, ny, nx) or, for volumes, (n, nz, ny, nx).
- `image`, `training_image`: a single image; an array has shape (ny, nx) or (nz, ny, nx).
- `codes`: all facies codes, needed if some do not occur in an array. The default is the codes of
  the training image or, for an array, the codes that occur.
- `facies`: the code of one facies; where it has a default, the last one or all of them.
- `probability`: an `EType`, or probabilities of shape (n_facies, ny, nx) or (n_facies, nz, ny, nx).
- `hard_data`, `data`, `study`, `parameters`, `seed`, `cancel`: as of `ccwsim.simulate`.
- `direction`: "E-W", "N-S", "NE-SW", "NW-SE", an azimuth in degrees clockwise from north, or one
  step as (rows, columns); in volumes also "vertical" or one step as (layers, rows, columns).
- `lags`: the largest lag, or a list of lags, in steps of the direction. The default is 0 … 100, or
  as far as lags fit the image. Maps of lags reach 50 cells, or as far as they fit.
- `neighbours`: the number of neighbours of a cell: 4 (sides) or 8 (sides and corners) in maps; 6
  (sides), 18 (sides and edges) or 26 (sides, edges, corners) in volumes. The default is 8 or 26.
- `size`: side of patterns in cells; by default 4 in maps and 3 in volumes.
- `factors`: coarsening factors; a factor f reduces the resolution to 1 / f (see `coarsened`).
- `progress`: a function called with the share of the work done, from 0 to 1.

Results have one row per image, and facies are sorted by code. Functions raise `CCWSIMError` for
arrays of a wrong shape or type, unknown codes and directions, and lags or patterns that are larger
than the images.
"""

from ccwsim.metrics.anodi import Anodi as Anodi
from ccwsim.metrics.anodi import Scaling as Scaling
from ccwsim.metrics.anodi import anodi as anodi
from ccwsim.metrics.anodi import classical_scaling as classical_scaling
from ccwsim.metrics.anodi import metric_scaling as metric_scaling
from ccwsim.metrics.bands import Band as Band
from ccwsim.metrics.bands import RunningCurves as RunningCurves
from ccwsim.metrics.bands import RunningStatistics as RunningStatistics
from ccwsim.metrics.bands import RunningSummary as RunningSummary
from ccwsim.metrics.bands import band as band
from ccwsim.metrics.checks import Check as Check
from ccwsim.metrics.checks import check_ensemble as check_ensemble
from ccwsim.metrics.coarsening import coarsened as coarsened
from ccwsim.metrics.connectivity import Connectivity as Connectivity
from ccwsim.metrics.connectivity import Geobodies as Geobodies
from ccwsim.metrics.connectivity import connected_geobodies as connected_geobodies
from ccwsim.metrics.connectivity import connectivity as connectivity
from ccwsim.metrics.connectivity import geobody_statistics as geobody_statistics
from ccwsim.metrics.copying import Copying as Copying
from ccwsim.metrics.copying import copying as copying
from ccwsim.metrics.data_fit import DataFit as DataFit
from ccwsim.metrics.data_fit import ImageRank as ImageRank
from ccwsim.metrics.data_fit import fit_data as fit_data
from ccwsim.metrics.data_fit import rank_images as rank_images
from ccwsim.metrics.diagnosis import Advice as Advice
from ccwsim.metrics.diagnosis import Diagnosis as Diagnosis
from ccwsim.metrics.diagnosis import Granulometry as Granulometry
from ccwsim.metrics.diagnosis import Spacing as Spacing
from ccwsim.metrics.diagnosis import default_parameters as default_parameters
from ccwsim.metrics.diagnosis import diagnose as diagnose
from ccwsim.metrics.diagnosis import feature_spacing as feature_spacing
from ccwsim.metrics.diagnosis import granulometry as granulometry
from ccwsim.metrics.diagnosis import templates_that_fit as templates_that_fit
from ccwsim.metrics.diagnosis import warn_of_edges as warn_of_edges
from ccwsim.metrics.diagnosis import warn_of_level as warn_of_level
from ccwsim.metrics.direction import direction_error as direction_error
from ccwsim.metrics.direction import local_direction as local_direction
from ccwsim.metrics.direction import main_direction as main_direction
from ccwsim.metrics.etype import EType as EType
from ccwsim.metrics.etype import entropy as entropy
from ccwsim.metrics.etype import etype as etype
from ccwsim.metrics.etype import etype_of_counts as etype_of_counts
from ccwsim.metrics.etype import facies_counts as facies_counts
from ccwsim.metrics.etype import proportion_quantiles as proportion_quantiles
from ccwsim.metrics.etype import proportions as proportions
from ccwsim.metrics.etype import vertical_proportions as vertical_proportions
from ccwsim.metrics.flow_fit import FlowFit as FlowFit
from ccwsim.metrics.flow_fit import fit_flow as fit_flow
from ccwsim.metrics.lags import DIRECTION_STEPS as DIRECTION_STEPS
from ccwsim.metrics.lags import VERTICAL as VERTICAL
from ccwsim.metrics.lags import Direction as Direction
from ccwsim.metrics.lags import axes_of as axes_of
from ccwsim.metrics.measures import MEASURES as MEASURES
from ccwsim.metrics.measures import Measure as Measure
from ccwsim.metrics.measures import Measured as Measured
from ccwsim.metrics.measures import measure as measure
from ccwsim.metrics.patterns import PatternHistogram as PatternHistogram
from ccwsim.metrics.patterns import divergences as divergences
from ccwsim.metrics.patterns import js_divergence as js_divergence
from ccwsim.metrics.patterns import pattern_distance as pattern_distance
from ccwsim.metrics.patterns import pattern_histogram as pattern_histogram
from ccwsim.metrics.patterns import pyramid_histograms as pyramid_histograms
from ccwsim.metrics.patterns import unseen_patterns as unseen_patterns
from ccwsim.metrics.quality import Quality as Quality
from ccwsim.metrics.quality import differing_share as differing_share
from ccwsim.metrics.quality import judge as judge
from ccwsim.metrics.reference import Calibration as Calibration
from ccwsim.metrics.reference import DataMatch as DataMatch
from ccwsim.metrics.reference import LeaveOut as LeaveOut
from ccwsim.metrics.reference import ReferenceScores as ReferenceScores
from ccwsim.metrics.reference import calibration as calibration
from ccwsim.metrics.reference import data_match as data_match
from ccwsim.metrics.reference import leave_out as leave_out
from ccwsim.metrics.reference import score_reference as score_reference
from ccwsim.metrics.reference_band import Fit as Fit
from ccwsim.metrics.reference_band import ReferenceBand as ReferenceBand
from ccwsim.metrics.reference_band import crop_shape as crop_shape
from ccwsim.metrics.reference_band import fit_curve as fit_curve
from ccwsim.metrics.reference_band import fit_geobodies as fit_geobodies
from ccwsim.metrics.reference_band import fit_patterns as fit_patterns
from ccwsim.metrics.reference_band import fit_proportions as fit_proportions
from ccwsim.metrics.soft_data import reliability as reliability
from ccwsim.metrics.soft_data import warn_of_probabilities as warn_of_probabilities
from ccwsim.metrics.soft_data import warn_of_reliability as warn_of_reliability
from ccwsim.metrics.stationarity import QUARTERS as QUARTERS
from ccwsim.metrics.stationarity import Stationarity as Stationarity
from ccwsim.metrics.stationarity import stationarity as stationarity
from ccwsim.metrics.variograms import Transiograms as Transiograms
from ccwsim.metrics.variograms import Variogram as Variogram
from ccwsim.metrics.variograms import VariogramMap as VariogramMap
from ccwsim.metrics.variograms import transiograms as transiograms
from ccwsim.metrics.variograms import transition_map as transition_map
from ccwsim.metrics.variograms import variogram as variogram
from ccwsim.metrics.variograms import variogram_map as variogram_map
