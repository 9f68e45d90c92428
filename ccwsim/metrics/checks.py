"""All comparisons of an ensemble with crops of its training image."""

from dataclasses import replace
from itertools import product
from typing import NamedTuple

import numpy as np

from ccwsim import Ensemble
from ccwsim.metrics import reference_band
from ccwsim.metrics.bands import STATISTICS
from ccwsim.metrics.lags import DirectionName, axes_of
from ccwsim.metrics.measures import fit_measures, measures_of
from ccwsim.metrics.stack import Fraction, Watch

MAX_CHECKED = 8  # maximum number of checked facies; if there are more, the most frequent ones


class Check(NamedTuple):
    """A comparison of realizations with crops of their training image."""

    kind: str
    """"proportions", "patterns", "variogram", "connectivity", "geobodies" or "measures"."""
    facies: int | None
    """Index of the facies; None if the check comprises all facies."""
    direction: DirectionName | None
    """Direction of a curve, otherwise None."""
    fit: reference_band.Fit
    """The comparison; it is not judged if the map of probabilities asks for another amount."""
    against: str = "TI"
    """Reference: "TI", or "given map" for proportions that are compared with probabilities."""


def check_ensemble(ensemble: Ensemble, progress: Fraction | None = None) -> list[Check]:
    """Compare an ensemble with crops of its training image in all facies and directions.

    Checks that cannot be judged are left out, so the list is empty if the training image or the
    grid is too small for crops. If given probabilities ask for other proportions than those of the
    training image, only the proportions are judged. If there are two facies, variograms are
    compared only for the second facies, because both are equal. Only some checks are independent,
    so the share of good ensembles in which any check differs was measured (see the page on measures
    in the documentation).

    Examples
    --------
    >>> from ccwsim import datasets, simulate
    >>> checks = check_ensemble(simulate(datasets.load("channels"), (128, 128), n_realizations=4))
    >>> len(checks), [check.kind for check in checks if not check.fit.fits]
    (13, [])
    """
    image, directions = ensemble.training_image, axes_of(ensemble.grid.shape)
    of_facies, of_image = (
        [m for m in measures_of(image) if m.checked == what] for what in ("facies", "image")
    )
    facies = sorted(np.argsort(-image.proportions, kind="stable")[:MAX_CHECKED].tolist())
    shares = reference_band.fit_proportions(ensemble)
    against = "given map" if ensemble.has_probabilities else "TI"
    if shares is not None and reference_band.asks_other_amount(ensemble):
        unknown = replace(shares, tolerance=np.full_like(shares.tolerance, np.nan))
        unjudged = ("patterns", *STATISTICS, "geobodies", "measures")
        return [
            Check("proportions", None, None, shares, against),
            *(Check(kind, None, None, unknown) for kind in unjudged),
        ]
    compared: list[tuple[str, int | None, DirectionName | None, reference_band.Fit | None]] = [
        ("proportions", None, None, shares),
        ("patterns", None, None, reference_band.fit_patterns(ensemble)),
        ("measures", None, None, fit_measures(ensemble, int(image.codes[0]), of_image)),
    ]
    watch = Watch.of_share(progress)
    for done, k in enumerate(facies):
        code = int(image.codes[k])
        for statistic, way in product(STATISTICS, directions):
            if statistic == "variogram" and image.n_facies == 2 and k == 0:
                continue
            compared.append(
                (statistic, k, way, reference_band.fit_curve(ensemble, statistic, code, way))
            )
        compared.append(("geobodies", k, None, reference_band.fit_geobodies(ensemble, code)))
        compared.append(("measures", k, None, fit_measures(ensemble, code, of_facies)))
        watch.tell((done + 1) / len(facies))
    return [
        Check(kind, k, way, fit, against if kind == "proportions" else "TI")
        for kind, k, way, fit in compared
        if fit is not None and fit.judged
    ]
