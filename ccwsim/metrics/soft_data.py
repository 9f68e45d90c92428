"""Match of an ensemble with given probabilities of facies, and limits that the image sets."""

import numpy as np

from ccwsim import Ensemble, Grid, Parameters, Secondary, TrainingImage
from ccwsim.engine.corrections.guidance import guide_terms
from ccwsim.engine.prepared_image import PreparedImage
from ccwsim.engine.raster import CANDIDATE_SLACK, make_plan
from ccwsim.engine.stages.path import Box
from ccwsim.engine.stages.similarity import box_sums, summed_up
from ccwsim.metrics.direction import MAX_SPREAD, main_direction
from ccwsim.metrics.etype import facies_counts
from ccwsim.metrics.reference import Calibration, pooled_calibration
from ccwsim.model import (
    UNKNOWN,
    Array,
    Floats,
    Mask,
    Study,
    listing,
    minus,
    note_on_radians,
    refused,
    window_at,
)

NOTED = 0.05  # minimum noted difference between a requested and the nearest possible proportion
MIN_BIN_SHARE = 0.02  # bins of probability with a smaller share of the cells are not noted
MIN_FITTING_LOCATIONS, MAX_POOR_SHARE = 5, 0.2
"""Fewer than this number of locations are noted if more than this share of patches have so few."""
N_PATCHES = 200  # maximum number of patches that are examined


def reliability(
    ensemble: Ensemble, facies: int | str | None = None, n_bins: int = 10
) -> Calibration:
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
    probabilities = ensemble.study.secondary_or_empty.probabilities
    if probabilities is None:
        raise refused("no_probabilities")
    image = ensemble.training_image
    which = range(image.n_facies) if facies is None else [image.index_of(facies)]
    scored = ~np.isnan(probabilities[0]) & ensemble.study.active_mask
    shares = facies_counts(ensemble) / ensemble.n
    chances = np.concatenate([probabilities[k][scored] for k in which])
    return pooled_calibration(chances, np.concatenate([shares[k][scored] for k in which]), n_bins)


def warn_of_reliability(table: Calibration, name: str) -> str | None:
    """Return a sentence on the largest difference in a bin of `reliability`; None if it is small.

    Bins with less than 2 % of the cells do not count. `name` is the name of the facies.

    Examples
    --------
    >>> count, given = np.array([300, 100]), np.array([0.25, 0.75])
    >>> table = Calibration(np.empty(3), given, given - [0.0, 0.12], count, 0.03)
    >>> warn_of_reliability(table, "sand")
    'sand is given with 75 % but simulated with 63 % (−12 points) in 25 % of the cells'
    """
    share = table.count / table.count.sum()
    off = np.where(share >= MIN_BIN_SHARE, table.observed - table.forecast, 0.0)
    worst = int(np.argmax(np.abs(off)))
    if abs(off[worst]) < NOTED:
        return None
    forecast, simulated, share_of_cells = (
        100 * each[worst] for each in (table.forecast, table.observed, share)
    )
    points = minus(f"{100 * off[worst]:+.0f} points")
    return (
        f"{name} is given with {forecast:.0f} % but simulated with {simulated:.0f} % ({points}) in "
        f"{share_of_cells:.0f} % of the cells"
    )


def warn_of_probabilities(
    secondary: Secondary, image: TrainingImage, parameters: Parameters
) -> list[str]:
    """Return a sentence for each facies whose probabilities ask for more than the image has.

    The mean probability in each template-sized piece of the grid is compared with the largest and
    the smallest proportion in a template-sized piece of the training image. `secondary` is
    `Study.secondary`. Other sentences say that few locations of the image fit the guides, or that
    the image has no main direction that could follow angles.

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
    if secondary.angle is not None:
        notes += filter(None, [note_on_radians(secondary.angle)])
        main, spread = main_direction(image)
        note = (
            f"the image has no main direction that follows angles: its directions differ from "
            f"{main:.0f}° by {spread:.0f}° on average (45° if no direction prevails)"
        )
        notes += [note] if spread > MAX_SPREAD else []
    if secondary.probabilities is None:
        return notes
    template, probabilities = parameters.along(image.shape).template, secondary.probabilities
    per_share = [p / max(q, 1e-300) for p, q in zip(probabilities, image.proportions, strict=True)]
    alike = [sum(np.allclose(k, other, equal_nan=True) for other in per_share) for k in per_share]
    if 1 < max(alike) < image.n_facies:
        rest = listing(name for name, n in zip(image.facies_names, alike, strict=True) if n > 1)
        notes.append(f"{rest} share the rest of the probabilities, as in the training image")
    for k, name in enumerate(image.facies_names):
        available = _means_of_pieces(image.indices == k, image.indices != UNKNOWN, template)
        valid = ~np.isnan(probabilities[k])
        valid &= True if secondary.active is None else secondary.active
        asked = _means_of_pieces(np.where(valid, probabilities[k], 0.0), valid, template)
        for more, has, wants in (
            ("more", available.max(), asked.max()),
            ("less", available.min(), asked.min()),
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
    """Return a sentence if the guides leave only few locations for many patches of a path."""
    maps = [each.grid for each in secondary.auxiliary]
    shape = (maps if secondary.probabilities is None else secondary.probabilities)[0].shape
    study = Study(image, Grid.of(shape), parameters, secondary=secondary)
    template = parameters.along(shape).template
    inputs = make_plan(PreparedImage(study), template, np.random.default_rng(0)).inputs
    guide, places = inputs.guide, inputs.oriented.places
    assert guide is not None
    patches = inputs.patches[:: -(-len(inputs.patches) // N_PATCHES)]
    n_few, slack = 0, CANDIDATE_SLACK * inputs.search.cell_cost
    for patch in patches[:, :7].tolist():
        box = Box._make([*patch, *inputs.search.overlap])
        n, _ = guide_terms.__wrapped__(guide, box)  # not compiled, as there are few patches
        costs = np.zeros(places)
        for first, factor in zip(guide.offsets[:n], guide.terms[:n], strict=True):
            k, *corner = np.unravel_index(first, guide.values.shape)
            costs += factor * guide.values[k][window_at(corner, places)]
        n_few += np.count_nonzero(costs <= costs.min() + slack) < MIN_FITTING_LOCATIONS
    share = 100 * n_few // len(patches)
    note = (
        f"fewer than {MIN_FITTING_LOCATIONS} locations of the image fit the guides in "
        f"{share} % of the patches, so pieces are repeated: reduce the weight, or use a larger "
        "image"
    )
    return [note] if share > 100 * MAX_POOR_SHARE else []


def _means_of_pieces(values: Array, valid: Mask, size: tuple[int, ...]) -> Floats:
    """Return the means of all pieces without unknown cells; if there are none, the overall mean."""
    volume = valid.reshape((1, *valid.shape)[-3:])
    sides = tuple(min(n, t) for n, t in zip(volume.shape, size, strict=True))
    sums = [
        box_sums(summed_up(np.rint(1e6 * each).astype(np.int64)), sides)  # type: ignore[arg-type]
        for each in (np.where(volume, values.reshape(volume.shape), 0.0), volume.astype(float))
    ]
    whole = sums[1] == 1_000_000 * np.prod(sides)
    if not whole.any():
        return np.array([values[valid].mean()], np.float64)
    return np.true_divide(sums[0][whole], sums[1][whole])
