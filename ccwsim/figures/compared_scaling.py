"""The MDS plot of several settings: all realizations and the training image in one plane."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from ccwsim.figures.scaling import blank_plane
from ccwsim.figures.setting_marks import SYMBOLS, setting_colours
from ccwsim.figures.style import Theme
from ccwsim.metrics import Scaling


def compared_scaling_chart(
    scaling: Scaling,
    owner: NDArray[np.integer],
    names: Sequence[str],
    shown: int,
    theme: Theme,
    *,
    height: int = 400,
) -> go.Figure:
    """Return one series of points a setting, the shown ones ringed, and the image in red.

    Parameters
    ----------
    scaling : Scaling
        Positions of the training image (first) and of the realizations.
    owner : ndarray of int
        Which setting each position belongs to; −1 for the training image.
    names : sequence of str
        Of the settings; series k of the chart is setting k.
    shown : int
        Which realization of each setting is ringed, counted from 0.
    theme : Theme
    """
    chart = blank_plane(scaling.explained, theme, height)
    rings = []
    for k, name in enumerate(names):
        own = scaling.positions[owner == k]
        chart.add_trace(_points(own, name, setting_colours(theme)[k], 9, SYMBOLS[k]))
        rings.append(own[shown : shown + 1])
        chart.data[-1].update(
            text=[f"{name}, realization {r + 1}" for r in range(len(own))], opacity=0.75,
            hovertemplate="%{text}: click to see it<extra></extra>",
        )  # fmt: skip
    ring = _points(np.concatenate(rings), "shown", "rgba(0,0,0,0)", 18, "circle")
    chart.add_trace(ring.update(marker_line={"width": 2, "color": theme.ink}, hoverinfo="skip"))
    image = _points(scaling.positions[:1], "training image", theme.reference, 15, "diamond")
    below = scaling.positions[0, 1] > 0
    chart.add_trace(
        image.update(
            mode="markers+text", text=["training image"],
            textposition="bottom center" if below else "top center",
            textfont={"size": 13, "color": theme.reference},
            hovertemplate="training image<extra></extra>",
        )
    )  # fmt: skip
    reach = 1.12 * max(float(np.abs(scaling.positions).max()), 1e-9)
    chart.update_xaxes(range=[-reach, reach], nticks=5)
    chart.update_yaxes(range=[-reach, reach], scaleanchor="x")
    return chart.update_layout(hovermode="closest")


def _points(
    positions: NDArray[np.float64], name: str, colour: str, size: int, symbol: str
) -> go.Scatter:
    return go.Scatter(
        x=positions[:, 0], y=positions[:, 1], name=name, mode="markers",
        marker={"size": size, "color": colour, "symbol": symbol},
        selected={"marker": {"opacity": 1}},
        unselected={"marker": {"opacity": 1}, "textfont": {"color": colour}},
    )  # fmt: skip
