"""A chart of curves, small enough to stand beside a map: the training image is in front."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ccwsim.figures.style import Theme

SIDE = 100
MARGIN = 4


def sparkline(curves: ArrayLike, reference: ArrayLike, theme: Theme) -> bytes:
    """Return a square SVG picture of curves over equal lags, from zero to the largest value of all.

    Parameters
    ----------
    curves : array_like, shape (n, n_lags)
        One a realization.
    reference : array_like, shape (n_lags,)
        That of the training image.
    theme : Theme

    Examples
    --------
    >>> from ccwsim.figures.style import LIGHT
    >>> svg = sparkline([[0, 1], [0, 2]], [0, 1.5], LIGHT)
    >>> svg.count(b"<polyline")
    3
    """
    every = [*np.asarray(curves, float), np.asarray(reference, float)]
    top = max(float(np.nanmax(curve)) for curve in every) or 1.0
    thin = f'stroke="{theme.each}" stroke-width="0.8"'
    thick = f'stroke="{theme.reference}" stroke-width="1.6"'
    lines = [_line(curve, top, thin) for curve in every[:-1]] + [_line(every[-1], top, thick)]
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {SIDE} {SIDE}" fill="none">'
        f"{''.join(lines)}</svg>"
    ).encode()


def _line(curve: np.ndarray, top: float, stroke: str) -> str:
    room = SIDE - 2 * MARGIN
    x = MARGIN + room * np.arange(len(curve)) / max(len(curve) - 1, 1)
    y = SIDE - MARGIN - room * curve / top
    known = np.isfinite(y)
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x[known], y[known], strict=True))
    return f'<polyline points="{points}" {stroke}/>'
