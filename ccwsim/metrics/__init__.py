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
- `progress`: a function called with the share of the work done, from 0 to 1, or True for a bar.

Results have one row per image, and facies are sorted by code. Functions raise `CCWSIMError` for
arrays of a wrong shape or type, unknown codes and directions, and lags or patterns that are larger
than the images.
"""

from ccwsim.metrics.anodi import (
    Anodi as Anodi,
    Scaling as Scaling,
    anodi as anodi,
    classical_scaling as classical_scaling,
    metric_scaling as metric_scaling,
)
from ccwsim.metrics.bands import (
    Band as Band,
    band as band,
)
from ccwsim.metrics.checks import Check as Check, check_ensemble as check_ensemble
from ccwsim.metrics.coarsening import coarsened as coarsened
from ccwsim.metrics.connectivity import (
    Connectivity as Connectivity,
    Geobodies as Geobodies,
    connected_geobodies as connected_geobodies,
    connectivity as connectivity,
    geobody_statistics as geobody_statistics,
)
from ccwsim.metrics.copying import Copying as Copying, copying as copying
from ccwsim.metrics.data_fit import (
    DataFit as DataFit,
    ImageRank as ImageRank,
    fit_data as fit_data,
    rank_images as rank_images,
    rank_variants as rank_variants,
)
from ccwsim.metrics.diagnosis import (
    Advice as Advice,
    Diagnosis as Diagnosis,
    Granulometry as Granulometry,
    Spacing as Spacing,
    default_parameters as default_parameters,
    diagnose as diagnose,
    feature_spacing as feature_spacing,
    granulometry as granulometry,
    recommended_parameters as recommended_parameters,
    templates_that_fit as templates_that_fit,
    warn_of_edges as warn_of_edges,
    warn_of_level as warn_of_level,
)
from ccwsim.metrics.direction import (
    direction_error as direction_error,
    local_direction as local_direction,
    main_direction as main_direction,
)
from ccwsim.metrics.etype import (
    EType as EType,
    entropy as entropy,
    etype as etype,
    etype_of_counts as etype_of_counts,
    facies_counts as facies_counts,
    proportions as proportions,
    vertical_proportions as vertical_proportions,
)
from ccwsim.metrics.flow_fit import FlowFit as FlowFit, fit_flow as fit_flow
from ccwsim.metrics.joins import fit_joins as fit_joins
from ccwsim.metrics.lags import (
    DIRECTION_STEPS as DIRECTION_STEPS,
    VERTICAL as VERTICAL,
    Direction as Direction,
    axes_of as axes_of,
)
from ccwsim.metrics.measures import (
    MEASURES as MEASURES,
    Measure as Measure,
    Measured as Measured,
    measure as measure,
)
from ccwsim.metrics.patterns import (
    PatternHistogram as PatternHistogram,
    divergences as divergences,
    js_divergence as js_divergence,
    pattern_distance as pattern_distance,
    pattern_histogram as pattern_histogram,
    pyramid_histograms as pyramid_histograms,
    unseen_patterns as unseen_patterns,
)
from ccwsim.metrics.quality import (
    Quality as Quality,
    differing_share as differing_share,
    judge as judge,
)
from ccwsim.metrics.reference import (
    Calibration as Calibration,
    DataMatch as DataMatch,
    LeaveOut as LeaveOut,
    ReferenceScores as ReferenceScores,
    calibration as calibration,
    data_match as data_match,
    leave_out as leave_out,
    score_reference as score_reference,
)
from ccwsim.metrics.reference_band import (
    Fit as Fit,
    ReferenceBand as ReferenceBand,
    crop_shape as crop_shape,
    fit_curve as fit_curve,
    fit_geobodies as fit_geobodies,
    fit_patterns as fit_patterns,
    fit_proportions as fit_proportions,
)
from ccwsim.metrics.soft_data import (
    reliability as reliability,
    warn_of_probabilities as warn_of_probabilities,
    warn_of_reliability as warn_of_reliability,
)
from ccwsim.metrics.stationarity import (
    QUARTERS as QUARTERS,
    Stationarity as Stationarity,
    stationarity as stationarity,
)
from ccwsim.metrics.variograms import (
    Transiograms as Transiograms,
    Variogram as Variogram,
    VariogramMap as VariogramMap,
    transiograms as transiograms,
    variogram as variogram,
    variogram_map as variogram_map,
    variogram_of_values as variogram_of_values,
)
