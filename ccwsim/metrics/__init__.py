"""Validation of realizations against the training image, the data and a reference field.

Arguments shared by several functions are explained only here:

- `images`: an `Ensemble`, a `TrainingImage`, or an array of facies codes, shape (ny, nx),
  (n, ny, nx) or, for volumes, (n, nz, ny, nx).
- `image`, `training_image`: a single image; an array has shape (ny, nx) or (nz, ny, nx).
- `codes`: all facies codes, needed if some do not occur in an array. The default is the codes of
  the training image or, for an array, the codes that occur.
- `facies`: the code of one facies.
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

from ccwsim.metrics.anodi import Anodi, Scaling, anodi, classical_scaling, metric_scaling
from ccwsim.metrics.bands import Band, RunningCurves, RunningStatistics, RunningSummary, band
from ccwsim.metrics.checks import Check, check_ensemble
from ccwsim.metrics.coarsening import coarsened
from ccwsim.metrics.connectivity import (
    Connectivity,
    Geobodies,
    connected_geobodies,
    connectivity,
    geobody_statistics,
)
from ccwsim.metrics.copying import Copying, copying
from ccwsim.metrics.data_fit import DataFit, ImageRank, fit_data, rank_images
from ccwsim.metrics.diagnosis import (
    Advice,
    Diagnosis,
    Granulometry,
    Spacing,
    diagnose,
    feature_spacing,
    granulometry,
    templates_that_fit,
    warn_of_level,
)
from ccwsim.metrics.etype import (
    EType,
    entropy,
    etype,
    etype_of_counts,
    facies_counts,
    proportion_quantiles,
    proportions,
    vertical_proportions,
)
from ccwsim.metrics.flow_fit import FlowFit, fit_flow
from ccwsim.metrics.lags import STEPS, VERTICAL, Direction, axes_of
from ccwsim.metrics.measures import MEASURES, Measure, Measured, measure
from ccwsim.metrics.patterns import (
    PatternHistogram,
    divergences,
    js_divergence,
    pattern_distance,
    pattern_histogram,
    pyramid_histograms,
    unseen_patterns,
)
from ccwsim.metrics.quality import Quality, differing_share, judge
from ccwsim.metrics.reference import (
    Calibration,
    DataMatch,
    LeaveOut,
    ReferenceScores,
    calibration,
    data_match,
    leave_out,
    score_reference,
)
from ccwsim.metrics.reference_band import (
    Fit,
    ReferenceBand,
    crop_shape,
    fit_curve,
    fit_geobodies,
    fit_patterns,
    fit_proportions,
)
from ccwsim.metrics.soft_data import reliability, warn_of_probabilities
from ccwsim.metrics.stationarity import QUARTERS, Stationarity, stationarity
from ccwsim.metrics.variograms import (
    Transiograms,
    Variogram,
    VariogramMap,
    transiograms,
    transition_map,
    variogram,
    variogram_map,
)

__all__ = [
    "MEASURES",
    "QUARTERS",
    "STEPS",
    "VERTICAL",
    "Advice",
    "Anodi",
    "Band",
    "Calibration",
    "Check",
    "Connectivity",
    "Copying",
    "DataFit",
    "DataMatch",
    "Diagnosis",
    "Direction",
    "EType",
    "Fit",
    "FlowFit",
    "Geobodies",
    "Granulometry",
    "ImageRank",
    "LeaveOut",
    "Measure",
    "Measured",
    "PatternHistogram",
    "Quality",
    "ReferenceBand",
    "ReferenceScores",
    "RunningCurves",
    "RunningStatistics",
    "RunningSummary",
    "Scaling",
    "Spacing",
    "Stationarity",
    "Transiograms",
    "Variogram",
    "VariogramMap",
    "anodi",
    "axes_of",
    "band",
    "calibration",
    "check_ensemble",
    "classical_scaling",
    "coarsened",
    "connected_geobodies",
    "connectivity",
    "copying",
    "crop_shape",
    "data_match",
    "diagnose",
    "differing_share",
    "divergences",
    "entropy",
    "etype",
    "etype_of_counts",
    "facies_counts",
    "feature_spacing",
    "fit_curve",
    "fit_data",
    "fit_flow",
    "fit_geobodies",
    "fit_patterns",
    "fit_proportions",
    "geobody_statistics",
    "granulometry",
    "js_divergence",
    "judge",
    "leave_out",
    "measure",
    "metric_scaling",
    "pattern_distance",
    "pattern_histogram",
    "proportion_quantiles",
    "proportions",
    "pyramid_histograms",
    "rank_images",
    "reliability",
    "score_reference",
    "stationarity",
    "templates_that_fit",
    "transiograms",
    "transition_map",
    "unseen_patterns",
    "variogram",
    "variogram_map",
    "vertical_proportions",
    "warn_of_level",
    "warn_of_probabilities",
]
