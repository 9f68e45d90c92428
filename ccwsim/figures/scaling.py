"""The MDS plot: realizations and the training image as points whose distances mean something."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from ccwsim.figures.style import Theme, blank_chart


def scaling_chart(
    positions: NDArray[np.float64],
    explained: NDArray[np.float64],
    shown: int,
    theme: Theme,
    *,
    numbers: NDArray[np.integer],
    height: int = 360,
) -> go.Figure:
    """Return the training image as a red diamond and each realization as a dot with its number.

    Parameters
    ----------
    positions : ndarray, shape (1 + n, 2)
        Of the training image, then of the realizations.
    explained : ndarray, shape (2,)
        Share of the spread that each axis shows.
    shown : int
        Which realization is ringed, counted from 0.
    theme : Theme
    numbers : ndarray of int, shape (n,)
        What the realizations are called.
    """
    chart = blank_plane(explained, theme, height)
    x, y = positions.T
    chart.add_trace(
        _points(x[1:], y[1:], "realizations", theme.ink, 9, "circle").update(
            text=[f"realization {number}" for number in numbers],
            hovertemplate="%{text}: click to see it<extra></extra>",
            opacity=0.62,
        )
    )
    if shown < len(numbers):
        ring = _points(x[[shown + 1]], y[[shown + 1]], "shown", "rgba(0,0,0,0)", 17, "circle")
        ring.update(marker_line={"width": 2, "color": theme.ink}, hoverinfo="skip")
        chart.add_trace(ring)
    image = _points(x[[0]], y[[0]], "training image", theme.reference, 15, "diamond")
    image.update(
        mode="markers+text", text=["training image"], textposition=_inside(y[0]),
        textfont={"size": 13, "color": theme.reference},
        hovertemplate="training image<extra></extra>",
    )  # fmt: skip
    chart.add_trace(image)
    reach = 1.12 * max(float(np.abs(positions).max()), 1e-9)
    chart.update_xaxes(range=[-reach, reach], nticks=5)
    chart.update_yaxes(range=[-reach, reach], scaleanchor="x")
    return chart.update_layout(hovermode="closest")


def _inside(y: float) -> str:
    return "bottom center" if y > 0 else "top center"


def _points(
    x: NDArray[np.float64], y: NDArray[np.float64], name: str, colour: str, size: int, symbol: str
) -> go.Scatter:
    return go.Scatter(
        x=x, y=y, name=name, mode="markers",
        marker={"size": size, "color": colour, "symbol": symbol},
        selected={"marker": {"opacity": 1}},
        unselected={"marker": {"opacity": 1}, "textfont": {"color": colour}},
    )  # fmt: skip


def blank_plane(explained: NDArray[np.float64], theme: Theme, height: int) -> go.Figure:
    """Return an empty MDS plot, whose axes say which share of the spread they show."""
    titles = [
        f"axis {k + 1} ({100 * share:.0f} % of the spread)" for k, share in enumerate(explained)
    ]
    return blank_chart(theme, height=height, x_title=titles[0], y_title=titles[1])
