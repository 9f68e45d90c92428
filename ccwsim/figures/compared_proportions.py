"""How far the facies proportions of several settings are from the training image's."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from ccwsim.figures.names import as_written
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
    """Return a block of lines a facies, in it one line of dots a setting.

    Dots are differences from the training image, which is the red stroke at 0: shares themselves
    would lie on each other.

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
    facies = as_written(facies)
    n, block = len(facies), len(names) + 1
    chart = blank_chart(
        theme,
        height=64 + LINE * n * block,
        x_title="difference (% of cells)",
        y_title="",
    )
    starts = np.arange(n) * block
    for k, (name, shares) in enumerate(zip(names, each, strict=True)):
        chart.add_trace(
            go.Scatter(
                x=100 * (shares - reference).ravel(), y=np.tile(starts + k, len(shares)),
                mode="markers", name=name, cliponaxis=False,
                marker={
                    "size": 8, "color": setting_colours(theme)[k], "opacity": 0.7,
                    "symbol": SYMBOLS[k],
                },
                customdata=100 * shares.ravel(),
                hovertemplate=f"{name}: %{{customdata:.1f}} %<extra></extra>",
            )
        )  # fmt: skip
    chart.add_trace(
        go.Scatter(
            x=[0, 0], y=[-0.7, n * block - 1.3], mode="lines", name="training image",
            line={"width": 2.5, "color": theme.reference}, hoverinfo="skip",
        )
    )  # fmt: skip
    words = [f"{f}<br>{100 * share:.1f} %" for f, share in zip(facies, reference, strict=True)]
    chart.update_yaxes(
        tickvals=starts + (len(names) - 1) / 2, ticktext=words, range=[n * block - 1, -1],
        showline=False, ticks="", tickfont={"size": 13, "color": theme.ink},
    )  # fmt: skip
    reach = 115 * max(*(float(np.abs(shares - reference).max()) for shares in each), 0.002)
    chart.update_xaxes(range=[-reach, reach], nticks=5)
    return chart.update_layout(hovermode="closest")
