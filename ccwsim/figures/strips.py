"""One number a realization, as dots along a line, and the training image's as a red stroke."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from ccwsim.figures.style import Theme, blank_chart


@dataclass(frozen=True, eq=False)
class Strip:
    """A statistic of each realization and of the training image.

    Attributes
    ----------
    title : str
        What it is, with the unit.
    each : ndarray, shape (n,)
        NaN where a realization has none.
    reference : float
        The training image's, NaN where it has none.
    """

    title: str
    each: NDArray[np.float64]
    reference: float


def strip_chart(strip: Strip, theme: Theme, *, colour: str, height: int = 116) -> go.Figure:
    """Return the dots of a strip, spread a little so that each can be pointed at.

    Parameters
    ----------
    strip : Strip
    theme : Theme
    colour : str
        Of the dots, as the facies has it on the maps.
    """
    chart = blank_chart(theme, height=height, x_title=strip.title, y_title="")
    n = len(strip.each)
    spread = (np.arange(n) * 0.618034) % 1.0 - 0.5
    chart.add_trace(
        go.Scatter(
            x=strip.each, y=spread, name="realizations", mode="markers",
            marker={
                "size": 9, "color": colour, "opacity": 0.75,
                "line": {"width": 0.8, "color": theme.quiet},
            },
            text=[f"realization {k + 1}" for k in range(n)],
            hovertemplate="%{text}: %{x:.3g}<extra></extra>",
        )
    )  # fmt: skip
    known = not np.isnan(strip.reference)
    chart.add_trace(
        go.Scatter(
            x=[strip.reference] * 2 if known else [], y=[-0.8, 0.8] if known else [],
            name="training image", mode="lines", line={"width": 3, "color": theme.reference},
            hovertemplate="training image: %{x:.3g}<extra></extra>",
        )
    )  # fmt: skip
    chart.update_yaxes(range=[-1, 1], showline=False, ticks="", showticklabels=False)
    chart.update_xaxes(range=_range([*strip.each.tolist(), strip.reference]), nticks=6)
    return chart.update_layout(hovermode="closest")


def _range(values: Sequence[float]) -> list[float]:
    there = [v for v in values if not np.isnan(v)] or [0.0]
    room = 0.12 * (max(there) - min(there)) or max(abs(there[0]) * 0.1, 0.5)
    low = min(there) - room
    return [max(low, 0.0) if min(there) >= 0 else low, max(there) + room]
