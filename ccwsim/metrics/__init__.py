"""Validation of realizations against the training image, the data and a hidden truth."""

from ccwsim.metrics.advice import Advice, templates_that_fit
from ccwsim.metrics.anodi import Anodi, anodi
from ccwsim.metrics.bands import Band, band
from ccwsim.metrics.coarsening import coarsened
from ccwsim.metrics.connectivity import Connectivity, connected_bodies, connectivity
from ccwsim.metrics.copying import Reuse, reuse
from ccwsim.metrics.data_match import DataMatch, data_match
from ccwsim.metrics.diagnosis import Diagnosis, diagnose
from ccwsim.metrics.directions import STEPS, Direction
from ccwsim.metrics.divergence import divergences, js_divergence, pattern_distance
from ccwsim.metrics.etype import EType, entropy, etype, etype_of_counts, facies_counts
from ccwsim.metrics.geobodies import Bodies, body_statistics
from ccwsim.metrics.granulometry import Granulometry, granulometry
from ccwsim.metrics.patterns import PatternHistogram, pattern_histogram, pyramid_histograms
from ccwsim.metrics.proportions import proportion_quantiles, proportions
from ccwsim.metrics.quality import Quality, judge
from ccwsim.metrics.reference import Calibration, TruthScores, calibration, score_truth
from ccwsim.metrics.running_curves import RunningCurves
from ccwsim.metrics.scaling import Scaling, classical_scaling
from ccwsim.metrics.spacing import Spacing, feature_spacing
from ccwsim.metrics.stationarity import QUARTERS, Stationarity, stationarity
from ccwsim.metrics.streaming import RunningStatistics, RunningSummary
from ccwsim.metrics.transiograms import Transiograms, transiograms, transition_map
from ccwsim.metrics.variograms import Variogram, VariogramMap, variogram, variogram_map

__all__ = [
    "QUARTERS",
    "STEPS",
    "Advice",
    "Anodi",
    "Band",
    "Bodies",
    "Calibration",
    "Connectivity",
    "DataMatch",
    "Diagnosis",
    "Direction",
    "EType",
    "Granulometry",
    "PatternHistogram",
    "Quality",
    "Reuse",
    "RunningCurves",
    "RunningStatistics",
    "RunningSummary",
    "Scaling",
    "Spacing",
    "Stationarity",
    "Transiograms",
    "TruthScores",
    "Variogram",
    "VariogramMap",
    "anodi",
    "band",
    "body_statistics",
    "calibration",
    "classical_scaling",
    "coarsened",
    "connected_bodies",
    "connectivity",
    "data_match",
    "diagnose",
    "divergences",
    "entropy",
    "etype",
    "etype_of_counts",
    "facies_counts",
    "feature_spacing",
    "granulometry",
    "js_divergence",
    "judge",
    "pattern_distance",
    "pattern_histogram",
    "proportion_quantiles",
    "proportions",
    "pyramid_histograms",
    "reuse",
    "score_truth",
    "stationarity",
    "templates_that_fit",
    "transiograms",
    "transition_map",
    "variogram",
    "variogram_map",
]
