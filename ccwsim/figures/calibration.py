"""Calibration: how often what has a probability p came true."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from ccwsim.figures.style import Theme, blank_chart

LARGEST_DOT = 22


def calibration_chart(
    forecast: NDArray[np.float64],
    observed: NDArray[np.float64],
    count: NDArray[np.integer],
    theme: Theme,
    *,
    height: int = 320,
) -> go.Figure:
    """Return observed shares over forecast probabilities; a larger dot stands for more cells.

    Parameters
    ----------
    forecast, observed : ndarray, shape (n_bins,)
        Mean probability in a bin, and the share that came true; NaN for an empty bin.
    count : ndarray of int, shape (n_bins,)
        Cells in each bin.
    theme : Theme
    """
    chart = blank_chart(
        theme, height=height, x_title="probability in the realizations (%)",
        y_title="came true (%)",
    )  # fmt: skip
    chart.add_trace(
        go.Scatter(
            x=[0, 100], y=[0, 100], name="perfect", mode="lines", hoverinfo="skip",
            line={"color": theme.reference, "width": 2},
        )
    )  # fmt: skip
    area = np.sqrt(count / max(int(count.max(initial=0)), 1))
    chart.add_trace(
        go.Scatter(
            x=100 * forecast, y=100 * observed, name="realizations", mode="lines+markers",
            line={"color": theme.ink, "width": 1.5},
            marker={"size": np.maximum(LARGEST_DOT * area, 5), "color": theme.ink},
            customdata=count, connectgaps=True,
            hovertemplate="%{x:.0f} % foreseen, %{y:.0f} % came true, "
            "%{customdata} cells<extra></extra>",
        )
    )  # fmt: skip
    chart.update_xaxes(range=[-4, 104])
    chart.update_yaxes(range=[-4, 104])
    return chart.update_layout(hovermode="closest")
