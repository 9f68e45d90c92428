"""MDS plot of realizations and training image as points; nearby points have similar patterns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from ccwsim.figures.style import CLEAR, Theme, as_written, blank_chart, dots

EDGE = 0.4
"""Maximum |x| of a point whose name is centred; centred names of points farther out do not fit."""


@dataclass(frozen=True, eq=False)
class Group:
    """Realizations that have the same marker and colour in an MDS plot."""

    name: str
    positions: NDArray[np.float64]  # shape (n, 2)
    colour: str
    symbol: str = "circle"  # plotly's name of the marker symbol
    labels: Sequence[str] = ()  # hover text of each point; by default the name of the group
    ringed: int | None = None  # index of the realization that is shown elsewhere on the page


def label_side(place: NDArray[np.float64]) -> str:
    """Return the side of a point on which the point's name fits into a plot with axes from −1 to 1.

    Examples
    --------
    >>> label_side(np.array([0.9, -0.2])), label_side(np.array([0.0, 0.5]))
    ('top left', 'bottom center')
    """
    x, y = place.tolist()
    across = "left" if x > EDGE else "right" if x < -EDGE else "center"
    return f"{'bottom' if y > 0 else 'top'} {across}"


def mds_chart(
    image: NDArray[np.float64],
    groups: Sequence[Group],
    theme: Theme,
    *,
    height: int = 400,
) -> go.Figure:
    """Return an MDS plot of groups of realizations, with the training image in red.

    `image` is the position of the training image, shape (2,).

    Examples
    --------
    >>> from ccwsim.figures import LIGHT
    >>> group = Group("A", np.array([[1.0, 2.0], [3.0, 4.0]]), "#173F6B", ringed=1)
    >>> chart = mds_chart(np.zeros(2), [group], LIGHT)
    >>> [trace.name for trace in chart.data]
    ['A', 'shown', 'training image']
    """
    chart = blank_chart(theme, height=height, x_title="axis 1", y_title="axis 2")
    opacity = 0.62 if len(groups) == 1 else 0.75
    for group in groups:
        trace = _points(group.positions, group.name, group.colour, 9, group.symbol)
        hover = "%{text}: click to see it" if group.labels else trace.name
        text = as_written(group.labels) or None
        trace.update(text=text, hovertemplate=f"{hover}<extra></extra>", opacity=opacity)
        chart.add_trace(trace)
    ringed = [group.positions[group.ringed] for group in groups if group.ringed is not None]
    if ringed:
        ring = _points(np.array(ringed), "shown", CLEAR, 18, "circle")
        chart.add_trace(ring.update(marker_line={"width": 2, "color": theme.ink}, hoverinfo="skip"))
    name = "training image"
    trace = _points(image[None], name, theme.reference, 15, "diamond")
    everywhere = np.concatenate([image[None], *(group.positions for group in groups)])
    reach = 1.12 * max(float(np.abs(everywhere).max()), 1e-9)
    trace.update(mode="markers+text", text=[name], textposition=label_side(image / reach))
    trace.update(textfont={"size": 13, "color": theme.reference})
    chart.add_trace(trace.update(hovertemplate=f"{name}<extra></extra>"))
    chart.update_xaxes(range=[-reach, reach], nticks=5)
    chart.update_yaxes(range=[-reach, reach], scaleanchor="x")
    return chart.update_layout(hovermode="closest")


def mds_title(stress: float) -> str:
    """Return the title of an MDS plot with its stress (Kruskal's stress-1).

    Examples
    --------
    >>> mds_title(0.104)
    'MDS plot: stress 0.10'
    """
    return f"MDS plot: stress {stress:.2f}"


def _points(positions: NDArray[np.float64], name: str, colour: str, size: int, symbol: str) -> Any:
    """Return a trace of points whose look does not change when they are selected."""
    x, y = positions.T
    trace = dots(name, x, y, colour, size, marker_symbol=symbol)
    same = {"marker": {"opacity": 1}}
    return trace.update(selected=same, unselected={**same, "textfont": {"color": colour}})
