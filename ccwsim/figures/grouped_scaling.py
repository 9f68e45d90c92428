"""The MDS plot of several ensembles: how they lie around the training image and one another."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from ccwsim.figures.scaling import blank_plane
from ccwsim.figures.style import Theme

SYMBOLS = ("circle", "square", "triangle-up", "cross", "x", "star")


def grouped_scaling_chart(
    positions: NDArray[np.float64],
    owner: NDArray[np.integer],
    names: Sequence[str],
    colours: Sequence[str],
    explained: NDArray[np.float64],
    theme: Theme,
    *,
    height: int = 420,
) -> go.Figure:
    """Return the training image as a red diamond and the realizations in their group's colour.

    Parameters
    ----------
    positions : ndarray, shape (1 + n, 2)
        Of the training image, then of the realizations.
    owner : ndarray of int, shape (1 + n,)
        Place in `names` of each; −1 for the training image.
    names, colours : sequence of str
        One a group.
    explained : ndarray, shape (2,)
        Share of the spread that each axis shows.
    theme : Theme
    """
    chart = blank_plane(explained, theme, height)
    for k, (name, colour) in enumerate(zip(names, colours, strict=True)):
        own = positions[owner == k]
        chart.add_trace(
            go.Scatter(
                x=own[:, 0], y=own[:, 1], mode="markers", name=name, opacity=0.7,
                marker={"size": 8, "color": colour, "symbol": SYMBOLS[k % len(SYMBOLS)]},
                hovertemplate=f"{name}<extra></extra>",
            )
        )  # fmt: skip
    image = positions[owner == -1]
    chart.add_trace(
        go.Scatter(
            x=image[:, 0], y=image[:, 1], mode="markers", name="training image",
            marker={"size": 15, "color": theme.reference, "symbol": "diamond",
                    "line": {"width": 1.5, "color": theme.paper}},
            hovertemplate="training image<extra></extra>",
        )
    )  # fmt: skip
    reach = 1.12 * max(float(np.abs(positions).max()), 1e-9)
    chart.update_xaxes(range=[-reach, reach], nticks=5)
    chart.update_yaxes(range=[-reach, reach], scaleanchor="x")
    return chart.update_layout(hovermode="closest")
