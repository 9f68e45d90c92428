"""ANODI by resolution: how far realizations lie from each other and from the training image."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from ccwsim.figures.style import Theme, blank_chart


def divergence_chart(
    factors: Sequence[int],
    between: NDArray[np.float64],
    within: NDArray[np.float64],
    theme: Theme,
    *,
    height: int = 230,
) -> go.Figure:
    """Return between and within as dots joined by a line, one row a resolution.

    Parameters
    ----------
    factors : sequence of int
        Resolution is 1 / factor.
    between, within : ndarray, shape (n_factors,)
        Mean Jensen–Shannon divergence in bits; NaN where there is none.
    theme : Theme
    """
    rows = list(range(len(factors)))
    chart = blank_chart(
        theme, height=height, x_title="Jensen–Shannon divergence (bits)", y_title=""
    )
    for row, a, b in zip(rows, between, within, strict=True):
        chart.add_trace(
            go.Scatter(
                x=[a, b], y=[row, row], mode="lines", hoverinfo="skip", name=f"span {row + 1}",
                line={"width": 1, "color": theme.quiet},
            )
        )  # fmt: skip
    for name, values, colour, symbol, side in (
        ("between realizations", between, theme.ink, "circle", "top left"),
        ("to the training image", within, theme.reference, "diamond", "bottom left"),
    ):
        chart.add_trace(
            go.Scatter(
                x=values, y=rows, mode="markers+text", name=name,
                text=["" for _ in rows[1:]] + [name], textposition=side,
                textfont={"size": 12, "color": colour},
                marker={"size": 13, "color": colour, "symbol": symbol},
                hovertemplate=f"{name}: %{{x:.3g}} bits<extra></extra>",
            )
        )  # fmt: skip
    words = ["full resolution" if f == 1 else f"1 / {f} resolution" for f in factors]
    chart.update_yaxes(
        tickvals=rows, ticktext=words, range=[len(rows) - 0.5, -0.5], showline=False, ticks="",
        tickfont={"size": 13, "color": theme.ink},
    )  # fmt: skip
    values = np.concatenate([between, within])
    top = float(np.nanmax(values)) if (~np.isnan(values)).any() else 1.0
    chart.update_xaxes(range=[0, 1.12 * top or 1.0])
    return chart.update_layout(hovermode="closest")
