"""What the page works out: each statistic with its key and its work."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ccwsim.figures import Bundle
from ccwsim.metrics import (
    Anodi,
    Calibration,
    Copying,
    Diagnosis,
    EType,
    Geobodies,
    ReferenceScores,
    anodi,
    calibration,
    connectivity,
    copying,
    diagnose,
    geobody_statistics,
    score_reference,
    transiograms,
    variogram,
    variogram_map,
)
from ccwsim.metrics.lags import Direction, lag_offsets
from ccwsim.model.bounds import MAX_CURVES, MAX_LAG
from ccwsim.model.ensemble import Ensemble
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.training_image import TrainingImage
from ccwsim.run.simulation import simulate
from ccwsim.ui.jobs.statistics import Fraction, Task
from ccwsim.ui.results.bundles import bundle_of, e_type_of

MAX_MAP_LAG = 50
MAX_COMPARED = 200
"""ANODI compares all pairs of the first so many realizations."""
DENSE_LAGS, STRIDE = 10, 4
"""Transiograms take every lag up to here, and every fourth beyond."""


@dataclass(frozen=True, eq=False)
class LagMaps:
    """Variogram maps: of the training image and the mean over realizations."""

    lags: NDArray[np.integer]
    reference: NDArray[np.float64]
    mean: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class GeobodiesCompared:
    """Geobodies of the realizations, of the training image, and cells of both."""

    each: Geobodies
    reference: Geobodies
    n_cells: int
    n_cells_reference: int


def study_key(ensemble: Ensemble) -> tuple:
    """Return what all statistics of an ensemble depend on."""
    return ensemble.digest, ensemble.training_image.digest, ensemble.grid.shape


def max_lag(ensemble: Ensemble, direction: Direction) -> int:
    """Return the largest lag to draw: half of what the image and the grid both have, or 100."""
    sides = zip(ensemble.training_image.shape, ensemble.grid.shape, strict=True)
    rows, columns = (min(pair) for pair in sides)
    side = {"E-W": columns, "N-S": rows}.get(str(direction), min(rows, columns))
    return max(1, min(MAX_LAG, side // 2))


def steps_along(direction: Direction, n_lags: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return the lags along a direction that reach different cells, and how far those are.

    Examples
    --------
    >>> steps_along(45.0, 4)
    (array([0, 1, 3, 4]), array([0.        , 1.41421356, 2.82842712, 4.24264069]))
    """
    offsets = lag_offsets(direction, np.arange(n_lags + 1))
    _, first = np.unique(offsets, axis=0, return_index=True)
    lags = np.sort(first)
    return lags, np.hypot(*offsets[lags].T.astype(float))


def curves(ensemble: Ensemble, statistic: str, facies: int, direction: Direction) -> Task[Bundle]:
    """Return "variogram" or "connectivity" of a facies along a direction, as a bundle."""
    lags, distances = steps_along(direction, max_lag(ensemble, direction))

    def curve(images: NDArray[np.integer], progress: Fraction | None = None) -> NDArray:
        if statistic == "variogram":
            return variogram(images, facies, direction, lags, progress).gamma
        return connectivity(images, facies, direction, lags, progress=progress).tau

    def work(progress: Fraction) -> Bundle:
        each = curve(ensemble.indices[:MAX_CURVES], progress)
        reference = curve(ensemble.training_image.indices)[0]
        return bundle_of(distances, reference, each)

    return Task((statistic, *study_key(ensemble), facies, direction), work)


def lag_maps(ensemble: Ensemble, facies: int) -> Task[LagMaps]:
    """Return variogram maps of a facies."""
    sides = (*ensemble.training_image.shape, *ensemble.grid.shape)
    reach = max(1, min(MAX_MAP_LAG, min(sides) // 2))

    def work(progress: Fraction) -> LagMaps:
        each = variogram_map(ensemble.indices[:MAX_CURVES], facies, reach, progress)
        reference = variogram_map(ensemble.training_image.indices, facies, reach)
        return LagMaps(each.lags, reference.gamma[0], each.gamma.mean(axis=0))

    return Task(("lag maps", *study_key(ensemble), facies), work)


def transitions(ensemble: Ensemble, direction: Direction) -> Task[dict[tuple[int, int], Bundle]]:
    """Return the transiograms of all pairs of facies along a direction."""
    n = ensemble.training_image.n_facies
    n_lags = max_lag(ensemble, direction)
    sparse = range(DENSE_LAGS + STRIDE, n_lags + 1, STRIDE)
    lags = np.array([*range(min(n_lags, DENSE_LAGS) + 1), *sparse])

    def work(progress: Fraction) -> dict[tuple[int, int], Bundle]:
        each = transiograms(ensemble.indices[:MAX_CURVES], n, direction, lags, progress)
        image = transiograms(ensemble.training_image.indices, n, direction, lags).probability[0]
        return {
            (tail, head): bundle_of(
                lags.astype(float), image[tail, head], each.probability[:, tail, head]
            )
            for tail in range(n)
            for head in range(n)
        }

    return Task(("transitions", *study_key(ensemble), direction), work)


def geobodies(ensemble: Ensemble, facies: int) -> Task[GeobodiesCompared]:
    """Return the geobodies of a facies."""
    image = ensemble.training_image

    def work(progress: Fraction) -> GeobodiesCompared:
        return GeobodiesCompared(
            geobody_statistics(ensemble.indices, facies, progress=progress),
            geobody_statistics(image.indices, facies),
            ensemble.grid.ny * ensemble.grid.nx,
            image.indices.size,
        )

    return Task(("geobodies", *study_key(ensemble), facies), work)


def proportions(ensemble: Ensemble) -> Task[NDArray[np.float64]]:
    """Return the facies proportions of each realization."""
    return Task(("proportions", *study_key(ensemble)), lambda progress: ensemble.proportions)


def patterns(ensemble: Ensemble) -> Task[Anodi]:
    """Return ANODI of the realizations against the training image."""
    image = ensemble.training_image

    def work(progress: Fraction) -> Anodi:
        return anodi(
            ensemble.indices[:MAX_COMPARED], image.indices, image.n_facies, progress=progress
        )

    return Task(("patterns", *study_key(ensemble)), work)


def e_type(ensemble: Ensemble) -> Task[EType]:
    """Return probability, most likely facies and entropy of each cell."""
    return Task(("e-type", *study_key(ensemble)), lambda progress: e_type_of(ensemble))


def reference_scores(
    ensemble: Ensemble, reference: TrainingImage
) -> Task[tuple[ReferenceScores, Calibration]]:
    """Return the scores of the probabilities in the cells without data."""

    def work(progress: Fraction) -> tuple[ReferenceScores, Calibration]:
        found = e_type_of(ensemble)
        true = np.searchsorted(ensemble.training_image.codes, reference.array)
        scored = np.ones(ensemble.grid.shape, bool)
        rows, columns = ensemble.hard_data.cells.T
        scored[rows, columns] = False
        scores = score_reference(found.probability, true, ensemble.n, scored)
        return scores, calibration(found.probability, true, scored=scored)

    key = ("reference", *study_key(ensemble), ensemble.hard_data.digest, reference.digest)
    return Task(key, work)


def diagnosis(image: TrainingImage) -> Task[Diagnosis]:
    """Return what a training image is like; it calls facies by the names of this user."""
    return Task(("diagnosis", image.digest, image.facies_names), lambda progress: diagnose(image))


def copied(ensemble: Ensemble, r: int) -> Task[Copying]:
    """Return what realization r copied, simulated again where its sources were not kept."""

    def work(progress: Fraction) -> Copying:
        return copying(sources_of(ensemble, r), ensemble.training_image.shape)

    run = ensemble.parameters.digest, ensemble.hard_data.digest, ensemble.seed
    key = ("copying", *study_key(ensemble), *run, int(ensemble.numbers[r]))
    return Task((*key, ensemble.sources is None), work)


def sources_of(ensemble: Ensemble, r: int) -> NDArray[np.int32]:
    """Return the flat index in the training image of each cell of realization r.

    An error is raised where the same run does not give the same realization, because it was edited
    since.
    """
    if ensemble.sources is not None:
        return ensemble.sources[r]
    study = (ensemble.training_image, ensemble.grid, ensemble.parameters, ensemble.hard_data)
    number = int(ensemble.numbers[r])
    again = simulate(*study, 1, ensemble.seed, first_realization=number, keep_sources=True)
    if again.sources is None or not np.array_equal(again.indices[0], ensemble.indices[r]):
        raise CCWSIMError(
            "data were edited since this realization was simulated, and cells around them "
            "simulated again, so its sources are not known; run the study again to see them"
        )
    return again.sources[0]
