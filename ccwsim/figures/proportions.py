"""Facies proportions: the training image's, and the realizations' spread."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from ccwsim.figures.names import as_written
from ccwsim.figures.style import Theme, blank_chart


def proportions_height(n_facies: int) -> int:
    """Return how high the chart is, in pixels."""
    return 76 + 30 * n_facies


def proportions_chart(
    names: Sequence[str],
    reference: NDArray[np.float64],
    each: NDArray[np.float64],
    colours: Sequence[str],
    theme: Theme,
) -> go.Figure:
    """Return one row a facies: a dot a realization, and a red stroke for the training image.

    Parameters
    ----------
    names : sequence of str
        Facies names.
    reference : ndarray, shape (n_facies,)
        Shares of cells in the training image, 0 to 1.
    each : ndarray, shape (n, n_facies)
        Shares of cells in each realization.
    colours : sequence of str
        One "#rrggbb" a facies.
    theme : Theme
    """
    names = as_written(names)
    chart = blank_chart(
        theme, height=proportions_height(len(names)), x_title="share of cells (%)", y_title=""
    ).update_layout(hovermode="closest")
    for k, name in enumerate(names):
        chart.add_trace(
            go.Scatter(
                x=100 * each[:, k], y=[k] * len(each), mode="markers", cliponaxis=False, name=name,
                marker={
                    "size": 11, "color": colours[k], "opacity": 0.75,
                    "line": {"width": 0.8, "color": theme.quiet},
                },
                hovertemplate=f"{name}: %{{x:.1f}} %<extra></extra>",
            )
        )  # fmt: skip
    chart.add_trace(
        go.Scatter(
            x=100 * reference, y=np.arange(len(names)), mode="markers",
            name="training image", cliponaxis=False,
            marker={
                "symbol": "line-ns", "size": 20, "line": {"width": 2.5, "color": theme.reference},
            },
            hovertemplate="training image: %{x:.1f} %<extra></extra>",
        )
    )  # fmt: skip
    chart.update_yaxes(
        tickvals=list(range(len(names))), ticktext=list(names),
        range=[len(names) - 0.4, -0.6], showline=False, ticks="",
        tickfont={"size": 13, "color": theme.ink},
    )  # fmt: skip
    largest = 100 * min(1.0, 1.15 * float(max(reference.max(), each.max())))
    chart.update_xaxes(range=[-0.08 * largest, largest])
    return chart
