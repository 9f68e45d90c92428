"""Which settings are worth having, and which one to take."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ccwsim.experiments.sweep.running import Sweep
from ccwsim.metrics.advice import MIN_ACROSS, templates_that_fit
from ccwsim.model.errors import CCWSIMError

PATTERN_TOLERANCE = 0.1
"""Pattern distances within this share of the smallest count as equally good."""
TAU_TOLERANCE = 0.03
"""Errors of connection within this of the smallest count as equally good."""


@dataclass(frozen=True)
class Recommendation:
    """A setting to take.

    Attributes
    ----------
    index : int
        Which row of the sweep.
    reason : str
        Why, in words.
    """

    index: int
    reason: str


def pareto_front(times: ArrayLike, errors: ArrayLike) -> NDArray[np.int64]:
    """Return which points no other beats: none is as good in both and better in one.

    Parameters
    ----------
    times, errors : array_like, shape (n,)
        Less is better; a point with NaN is never on the front.

    Returns
    -------
    ndarray of int
        Sorted by time.

    Raises
    ------
    CCWSIMError
        Where there are not as many times as errors.

    Examples
    --------
    >>> pareto_front([1.0, 2.0, 3.0], [5.0, 6.0, 4.0])
    array([0, 2])
    """
    t, e = np.asarray(times, dtype=float), np.asarray(errors, dtype=float)
    if t.shape != e.shape or t.ndim != 1:
        raise CCWSIMError(f"{t.size} times and {e.size} errors: one of each a setting is needed")
    front: list[int] = []
    best = np.inf
    for k in np.lexsort((e, t)):
        if np.isnan(t[k]) or np.isnan(e[k]):
            continue
        twin = bool(front) and t[front[-1]] == t[k] and e[front[-1]] == e[k]
        if e[k] < best or twin:
            front.append(int(k))
            best = e[k]
    return np.array(front, np.int64)


def recommended(sweep: Sweep) -> Recommendation:
    """Return the fastest of the settings that are as good as the best, as far as can be told.

    Settings that miss the fewest data come first, and of these the ones whose template fits the
    training image often enough not to repeat it. Of those whose pattern distance lies within a
    tenth of the smallest, or within its standard error, and then of those whose connection is as
    good as the best of them within 0.03, the fastest is taken.

    Raises
    ------
    CCWSIMError
        Where no setting is finished.

    Examples
    --------
    >>> from ccwsim import Parameters, TrainingImage
    >>> from ccwsim.experiments.sweep import sweep
    >>> noise = TrainingImage(np.random.default_rng(0).integers(0, 2, (64, 64)))
    >>> recommended(sweep(noise, (40, 40), [Parameters(8, 2, 1)], n_realizations=2)).index
    0
    """
    if not sweep.rows:
        raise CCWSIMError("no setting is finished yet: let the sweep go on")
    wrong = np.array([row.quality.n_mismatched for row in sweep.rows])
    among = np.flatnonzero(wrong == wrong.min())
    varied_enough = [k for k in among.tolist() if _n_templates(sweep, k) >= MIN_ACROSS**2]
    too_large = len(among) - len(varied_enough) if varied_enough else 0
    among = np.array(varied_enough or among)
    patterns, tau = sweep.errors("patterns"), sweep.errors("connection")
    best = among[np.argmin(patterns[among])]
    quality = sweep.rows[best].quality
    doubt = np.nan_to_num(quality.pattern_spread) / quality.n**0.5
    limit = patterns[best] + max(PATTERN_TOLERANCE * patterns[best], doubt)
    good = near = among[patterns[among] <= limit]
    known = near[~np.isnan(tau[near])]
    if len(known):
        good = known[tau[known] <= tau[known].min() + TAU_TOLERANCE]
    index = int(good[np.argmin(sweep.times[good])])
    return Recommendation(index, _reason(sweep, index, int(best), near.tolist(), too_large))


def _n_templates(sweep: Sweep, k: int) -> int:
    return templates_that_fit(sweep.image_shape, sweep.rows[k].parameters.template_size)


def _reason(sweep: Sweep, index: int, best: int, near: list[int], too_large: int) -> str:
    patterns, tau, times = sweep.errors("patterns"), sweep.errors("connection"), 1000 * sweep.times
    faster = [k for k in near if times[k] < times[index]]
    against = f"{patterns[index]:.3g} against {patterns[best]:.3g} bits"
    if len(sweep.rows) == 1:
        said = "The only setting that is finished."
    elif index == best:
        said = f"Its patterns are the nearest to the training image's, {patterns[best]:.3g} bits"
        said += "." if faster else f", and none as near is faster than its {times[index]:.3g} ms."
    else:
        said = f"Its patterns are as near to the training image's as the best ({against})"
        quicker = times[index] < times[best]
        said += f", in {times[index]:.3g} instead of {times[best]:.3g} ms." if quicker else "."
    if faster:
        said += (
            f" Of those that are as near it is the fastest that is connected right: τ is off by "
            f"{tau[index]:.2g}, with faster ones by {tau[faster].min():.2g} or more."
        )
    if sweep.rows[index].quality.n_mismatched:
        said += " It does not honour all data; no setting does."
    if too_large:
        many = "setting has a template" if too_large == 1 else "settings have templates"
        said += (
            f" {too_large} other {many} so large that fewer than {MIN_ACROSS**2} fit the training "
            "image: pieces of it would be seen again and again."
        )
    return said
