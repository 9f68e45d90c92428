"""How well an ensemble honours given probabilities of facies, and what the image cannot give."""

import numpy as np
from numpy.typing import NDArray

from ccwsim import Ensemble, Grid, Parameters, Secondary, TrainingImage
from ccwsim.engine.prepared_image import PreparedImage
from ccwsim.engine.raster import SLACK, make_plan
from ccwsim.engine.stages.similarity import box_sums, summed_up
from ccwsim.metrics.etype import facies_counts
from ccwsim.metrics.reference import Calibration, pooled_calibration
from ccwsim.model.errors import refused
from ccwsim.model.missing import UNKNOWN
from ccwsim.model.study import Study

NOTED = 0.05  # noted difference between an asked proportion and the nearest one of a piece
FEW, MANY = 5, 0.2  # fewer locations are noted if more than the share MANY of patches have them
N_PATCHES = 200  # maximum number of patches that are examined


def reliability(ensemble: Ensemble, facies: int | None = None, n_bins: int = 10) -> Calibration:
    """Return the share of each facies in the cells for which similar probabilities were given.

    In the result, `forecast` is the mean given probability of a bin and `observed` the share of the
    facies in all realizations. A reliable ensemble has equal numbers. By default, all facies are
    pooled; bins have equal width. Raises `CCWSIMError` if the ensemble was simulated without
    probabilities.

    Examples
    --------
    >>> from ccwsim import Grid, HardData, Secondary, simulate
    >>> stripes = np.tile([[0], [0], [1], [1]], (16, 64))
    >>> p, half = Parameters(16, 4, 1), Secondary(probabilities={1: 0.5})
    >>> e = simulate(stripes, (40, 50), p, secondary=half, n_realizations=4)
    >>> bool(abs(reliability(e, 1, 2).observed[1] - 0.5) < 0.05)
    True
    """
    given = ensemble.secondary.probabilities if ensemble.secondary else None
    if given is None:
        raise refused("no_probabilities")
    image, active = ensemble.training_image, ensemble.active
    which = range(image.n_facies) if facies is None else [image.index_of(facies)]
    scored = ~np.isnan(given[0]) if active is None else ~np.isnan(given[0]) & active
    shares = facies_counts(ensemble) / ensemble.n
    chances = np.concatenate([given[k][scored] for k in which])
    return pooled_calibration(chances, np.concatenate([shares[k][scored] for k in which]), n_bins)


def warn_of_probabilities(
    secondary: Secondary, image: TrainingImage, parameters: Parameters
) -> list[str]:
    """Return a sentence for each facies of which the probabilities ask more than the image has.

    The mean probability of each piece of the grid of the size of a template is compared with the
    largest and the smallest proportion in such a piece of the training image. `secondary` is
    `Study.secondary`. Another sentence says that few locations of the image fit the guides.

    Examples
    --------
    >>> from ccwsim import Grid
    >>> from ccwsim.model.study import Study
    >>> stripes = TrainingImage(np.tile([[0], [0], [1], [1]], (16, 64)))
    >>> study = Study(stripes, Grid(40, 50), Parameters(16, 4, 1),
    ...               secondary=Secondary(probabilities={1: 0.97}))
    >>> warn_of_probabilities(study.secondary, stripes, study.parameters)[1]
    'no piece of the image has more than 50 % facies 1: the map asks for 97 %'
    """
    notes = _warn_of_few_locations(secondary, image, parameters) if secondary.guides else []
    if secondary.probabilities is None:
        return notes
    template, given = parameters.along(image.shape).template, secondary.probabilities
    for k, name in enumerate(image.facies_names):
        there = _means(image.indices == k, image.indices != UNKNOWN, template)
        known = ~np.isnan(given[k])
        known &= True if secondary.active is None else secondary.active
        asked = _means(np.where(known, given[k], 0.0), known, template)
        for more, has, wants in (
            ("more", there.max(), asked.max()),
            ("less", there.min(), asked.min()),
        ):
            if (wants - has) * (1 if more == "more" else -1) >= NOTED:
                notes.append(
                    f"no piece of the image has {more} than {has:.0%} {name}: the map asks for "
                    f"{wants:.0%}".replace("%", " %")
                )
    return notes


def _warn_of_few_locations(
    secondary: Secondary, image: TrainingImage, parameters: Parameters
) -> list[str]:
    """Return a sentence if the guides alone leave few locations for many patches of a path."""
    maps = [each.grid for each in secondary.auxiliary]
    shape = (maps if secondary.probabilities is None else secondary.probabilities)[0].shape
    study = Study(image, Grid.of(shape), parameters, secondary=secondary)
    template = parameters.along(shape).template
    inputs = make_plan(study, template, PreparedImage(study), np.random.default_rng(0)).inputs
    guide, places = inputs.guide, inputs.oriented.places
    assert guide is not None
    patches = range(0, len(guide.factors), -(-len(guide.factors) // N_PATCHES))
    n_few = 0
    for number in patches:
        costs = np.zeros(places)
        for plane, part in np.argwhere(guide.factors[number]):
            first = guide.starts[number, part]
            box = tuple(slice(k, k + n) for k, n in zip(first, places, strict=True))
            costs += guide.factors[number, plane, part] * guide.values[plane][box]
        slack = SLACK * inputs.search.cell_cost
        n_few += np.count_nonzero(costs <= costs.min() + slack) < FEW
    share = 100 * n_few // len(patches)
    note = (
        f"fewer than {FEW} locations of the image fit the guides in {share} % of the patches, so "
        "pieces are repeated: reduce the weight, or use a larger image"
    )
    return [note] if share > 100 * MANY else []


def _means(values: NDArray, known: NDArray[np.bool_], size: tuple[int, ...]) -> NDArray[np.float64]:
    """Return the means of all completely known pieces of a size, or of all known values."""
    volume = known.reshape((1, *known.shape)[-3:])
    cells = tuple(min(n, t) for n, t in zip(volume.shape, size, strict=True))
    sums = [
        box_sums(summed_up(np.rint(1e6 * each).astype(np.int64)), cells, (0, 0, 0), cells)  # type: ignore[arg-type]
        for each in (np.where(volume, values.reshape(volume.shape), 0.0), volume.astype(float))
    ]
    whole = sums[1] == 1_000_000 * np.prod(cells)
    if not whole.any():
        return np.array([values[known].mean()], np.float64)
    return np.true_divide(sums[0][whole], sums[1][whole])
