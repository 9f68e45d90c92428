"""What a comparison found, in sentences."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ccwsim.experiments.comparison import ComparedCurves, Comparison, PairRatio
from ccwsim.ui.widgets.facts import three_digits

AS_FAST = 1.05
"""Up to this ratio of CPU times two settings count as equally fast."""
SAME = 0.02
"""Ratios of varieties and distances that are nearer to 1 are called equal."""
SURE = 2.0
"""Standard errors that a difference must exceed to be called one."""


def sentences(found: Comparison) -> list[str]:
    """Return one sentence on each setting against the first one, and one on the data."""
    said = [against_first(found, k) for k in range(1, len(found.names))]
    return [*said, *_on_data(found)]


def against_first(found: Comparison, k: int) -> str:
    """Say how setting `k` compares with the first one in speed, likeness and variety."""
    name, first = found.names[k], found.names[0]
    text = f"{name} is {faster(found.cpu_seconds[k] / found.cpu_seconds[0])} {first}"
    if found.anodi is None:
        return f"{text}."
    return f"{text} and {_farther(found, k)}{_varied(found, k)}."


def faster(ratio: float) -> str:
    """Say a ratio of CPU times.

    Examples
    --------
    >>> faster(0.25), faster(2.0), faster(1.01)
    ('4 times faster than', '2 times slower than', 'as fast as')
    """
    if 1 / AS_FAST < ratio < AS_FAST:
        return "as fast as"
    return f"{three_digits(max(ratio, 1 / ratio))} times {'slower' if ratio > 1 else 'faster'} than"


def differs(a: NDArray[np.float64], b: NDArray[np.float64]) -> bool:
    """Return whether the means of two samples differ by more than their scatter explains.

    Examples
    --------
    >>> differs(np.array([1.0, 1.1, 0.9]), np.array([2.0, 2.1, 1.9]))
    True
    """
    if len(a) < 2 or len(b) < 2:
        return False
    error = np.sqrt(a.var(ddof=1) / len(a) + b.var(ddof=1) / len(b))
    return bool(abs(a.mean() - b.mean()) > SURE * error)


def _farther(found: Comparison, k: int) -> str:
    gap = float(found.distance[k] - found.distance[0])
    if not differs(found.distances[k], found.distances[0]):
        return "as near to the training image, within the scatter"
    way = "farther from" if gap > 0 else "nearer to"
    return f"{abs(gap):.2g} bits {way} the training image ({abs(gap) / found.distance[0]:.0%})"


def _varied(found: Comparison, k: int) -> str:
    ratio = found.variety[k] / found.variety[0] if found.variety[0] else np.nan
    if not np.isfinite(ratio):
        return ""
    if abs(ratio - 1) < SAME:
        return "; as varied"
    return f"; {abs(ratio - 1):.0%} {'more' if ratio > 1 else 'less'} varied"


def _on_data(found: Comparison) -> list[str]:
    n = found.ensembles[0].hard_data.n
    if not n:
        return []
    wrong = {
        name: float(e.n_mismatched.mean())
        for name, e in zip(found.names, found.ensembles, strict=True)
    }
    broken = [f"{name} leaves {three_digits(w)}" for name, w in wrong.items() if w]
    if not broken:
        return [f"All {n} data are honoured by all settings."]
    rest = "" if len(broken) == len(wrong) else "; the others honour all"
    return [f"Of {n} data {', '.join(broken)} wrong in the mean{rest}."]


def said_ratio(row: PairRatio) -> str:
    """Say a row of the table of ratios.

    Examples
    --------
    >>> said_ratio(PairRatio("B", "A", 1.1, 0.9, 1.22))
    'B against A: more varied, nearer to the training image; better'
    """
    if not np.isfinite(row.ratio):
        return f"{row.name} and {row.other}: one realization says nothing of variety"
    varied = _graded(row.between, "less varied", "as varied", "more varied")
    near = _graded(row.within, "nearer to", "as near to", "farther from")
    verdict = _graded(row.ratio, "worse", "as good", "better")
    return f"{row.name} against {row.other}: {varied}, {near} the training image; {verdict}"


def _graded(ratio: float, below: str, same: str, above: str) -> str:
    if abs(ratio - 1) < SAME:
        return same
    return above if ratio > 1 else below


def nearest(curves: ComparedCurves, names: tuple[str, ...], tolerance: float) -> str:
    """Say which settings' curves come nearest to the training image's.

    Parameters
    ----------
    curves : ComparedCurves
    names : tuple of str
    tolerance : float
        Mean distances that differ by less count as equal.
    """
    gaps = curves.gaps
    if np.isnan(gaps).any():
        return ""
    best = [n for n, gap in zip(names, gaps, strict=True) if gap <= gaps.min() + tolerance]
    if len(best) == len(names):
        return "all alike"
    return f"{' and '.join(best)} nearest to the training image"
