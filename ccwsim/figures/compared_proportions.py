"""Facies proportions of several settings against the training image's."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from ccwsim.figures.setting_marks import SYMBOLS, setting_colours
from ccwsim.figures.style import Theme, blank_chart

LINE = 18
"""Pixels of a line of dots."""


def compared_proportions_chart(
    facies: Sequence[str],
    reference: NDArray[np.float64],
    names: Sequence[str],
    each: Sequence[NDArray[np.float64]],
    theme: Theme,
) -> go.Figure:
    """Return a block of lines a facies, in it one line of dots a setting, and a red stroke.

    Parameters
    ----------
    facies : sequence of str
    reference : ndarray, shape (n_facies,)
        Shares of cells in the training image, 0 to 1.
    names : sequence of str
        Of the settings.
    each : sequence of ndarray, shape (n, n_facies)
        Shares of cells in the realizations of each setting.
    theme : Theme
    """
    n, block = len(facies), len(names) + 1
    chart = blank_chart(
        theme, height=64 + LINE * n * block, x_title="share of cells (%)", y_title=""
    )
    starts = np.arange(n) * block
    for k, (name, shares) in enumerate(zip(names, each, strict=True)):
        chart.add_trace(
            go.Scatter(
                x=100 * shares.ravel(), y=np.tile(starts + k, len(shares)), mode="markers",
                name=name, cliponaxis=False,
                marker={
                    "size": 8, "color": setting_colours(theme)[k], "opacity": 0.7,
                    "symbol": SYMBOLS[k],
                },
                hovertemplate=f"{name}: %{{x:.1f}} %<extra></extra>",
            )
        )  # fmt: skip
    ends = starts + len(names) - 1
    chart.add_trace(
        go.Scatter(
            x=np.column_stack([100 * reference] * 2 + [np.full(n, np.nan)]).ravel(),
            y=np.column_stack([starts - 0.5, ends + 0.5, np.full(n, np.nan)]).ravel(),
            mode="lines", name="training image", cliponaxis=False,
            line={"width": 2.5, "color": theme.reference},
            hovertemplate="training image: %{x:.1f} %<extra></extra>",
        )
    )  # fmt: skip
    chart.update_yaxes(
        tickvals=(starts + ends) / 2, ticktext=list(facies), range=[n * block - 1, -1],
        showline=False, ticks="", tickfont={"size": 13, "color": theme.ink},
    )  # fmt: skip
    largest = 100 * min(1.0, 1.12 * max(float(reference.max()), *(float(s.max()) for s in each)))
    chart.update_xaxes(range=[-0.04 * largest, largest])
    return chart.update_layout(hovermode="closest")
