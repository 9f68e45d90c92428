"""CPU time of each realization."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from ccwsim.figures.style import Theme, blank_chart


def times_chart(
    milliseconds: NDArray[np.float64], mean: float, theme: Theme, *, height: int = 196
) -> go.Figure:
    """Return the CPU time of each realization as a dot, and their mean as a line.

    Parameters
    ----------
    milliseconds : ndarray, shape (n,)
        CPU milliseconds of each realization.
    mean : float
        Their mean.
    theme : Theme
    """
    n = len(milliseconds)
    chart = blank_chart(
        theme, height=height, x_title="realization", y_title="CPU time (ms)"
    ).update_layout(hovermode="closest")
    chart.add_trace(
        go.Scatter(
            x=[0.5, n + 0.5], y=[mean, mean], mode="lines", name="mean",
            line={"color": theme.quiet, "width": 1, "dash": "dot"}, hoverinfo="skip",
        )
    )  # fmt: skip
    chart.add_trace(
        go.Scatter(
            x=np.arange(1, n + 1), y=milliseconds, mode="markers", name="realization",
            marker={"color": theme.ink, "size": 7 if n <= 30 else 4},
            hovertemplate="realization %{x}: %{y:.3g} ms<extra></extra>",
        )
    )  # fmt: skip
    chart.update_xaxes(range=[0.5, n + 0.5], nticks=min(n + 1, 6), tickformat="d")
    chart.update_yaxes(
        exponentformat="none", range=[0, 1.15 * float(milliseconds.max(initial=mean)) or 1.0]
    )
    return chart
