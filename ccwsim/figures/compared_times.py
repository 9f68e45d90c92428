"""CPU time of a realization by setting."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from ccwsim.figures.setting_marks import setting_colours, thinned
from ccwsim.figures.style import Theme, blank_chart

ROW = 40
"""Pixels of a bar with its room."""


def compared_times_chart(
    names: Sequence[str],
    milliseconds: Sequence[NDArray[np.float64]],
    means: NDArray[np.float64],
    labels: Sequence[str],
    theme: Theme,
) -> go.Figure:
    """Return one bar a setting for the mean, with a dot for each realization.

    Parameters
    ----------
    names : sequence of str
        One a setting.
    milliseconds : sequence of ndarray
        CPU times of the realizations of each setting.
    means : ndarray, shape (n_settings,)
        Their means.
    labels : sequence of str
        What is written at each bar.
    theme : Theme
    """
    rows = list(range(len(names)))
    chart = blank_chart(
        theme, height=64 + ROW * len(rows), x_title="CPU time of a realization (ms)", y_title=""
    )
    colours = setting_colours(theme)
    chart.add_trace(
        go.Bar(
            x=means, y=rows, orientation="h", width=0.6, name="mean",
            marker={
                "color": [thinned(c, 0.35) for c in colours[: len(rows)]],
                "line": {"color": list(colours[: len(rows)]), "width": 1},
            },
            hovertemplate="mean: %{x:.3g} ms<extra></extra>",
        )
    )  # fmt: skip
    for row, name, each in zip(rows, names, milliseconds, strict=True):
        chart.add_trace(
            go.Scatter(
                x=each, y=[row] * len(each), mode="markers", name=name, cliponaxis=False,
                marker={"size": 6, "color": colours[row], "opacity": 0.7},
                hovertemplate=f"{name}: %{{x:.3g}} ms<extra></extra>",
            )
        )  # fmt: skip
    largest = max(float(each.max(initial=1e-9)) for each in milliseconds)
    for row, label, each in zip(rows, labels, milliseconds, strict=True):
        chart.add_annotation(
            x=float(each.max(initial=0)), y=row, text=label, showarrow=False, xanchor="left",
            xshift=8, font={"size": 13, "color": theme.ink},
        )  # fmt: skip
    chart.update_yaxes(
        tickvals=rows, ticktext=list(names), range=[len(rows) - 0.4, -0.6], showline=False,
        ticks="", tickfont={"size": 13, "color": theme.ink},
    )  # fmt: skip
    chart.update_xaxes(range=[0, 1.45 * largest], nticks=5, exponentformat="none")
    return chart.update_layout(hovermode="closest")
