"""Which settings are worth having, and which one to take."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ccwsim.errors import CCWSIMError
from ccwsim.metrics.advice import MIN_ACROSS, templates_that_fit
from ccwsim.sweep.running import Sweep

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
    >>> from ccwsim.sweep import sweep
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
    good = among[patterns[among] <= limit]
    known = good[~np.isnan(tau[good])]
    if len(known):
        good = known[tau[known] <= tau[known].min() + TAU_TOLERANCE]
    index = int(good[np.argmin(sweep.times[good])])
    return Recommendation(index, _reason(sweep, index, int(best), too_large))


def _n_templates(sweep: Sweep, k: int) -> int:
    return templates_that_fit(sweep.image_shape, sweep.rows[k].parameters.template_size)


def _reason(sweep: Sweep, index: int, best: int, too_large: int) -> str:
    patterns, times, n = sweep.errors("patterns"), 1000 * sweep.times, len(sweep.rows)
    own, smallest = patterns[index], patterns[best]
    if n == 1:
        said = "The only setting that is finished."
    elif index == best:
        said = (
            f"Its patterns are nearest to the training image's ({own:.2g} bits), and no setting "
            f"that comes as near is faster than its {times[index]:.3g} ms."
        )
    else:
        said = (
            f"Its patterns are as near to the training image's as the best can be told from it "
            f"({own:.2g} against {smallest:.2g} bits), in {times[index]:.3g} instead of "
            f"{times[best]:.3g} ms."
        )
    if sweep.rows[index].quality.n_mismatched:
        said += " It does not honour all data; no setting does."
    if too_large:
        said += (
            f" Fewer than {MIN_ACROSS**2} templates of {too_large} other "
            f"{'setting' if too_large == 1 else 'settings'} fit the training image, which they "
            "would repeat."
        )
    return said
