"""How a training image repeats itself, against the size of the template."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from ccwsim.figures.style import Theme, blank_chart


def repetition_chart(
    lags: NDArray[np.integer],
    east_west: NDArray[np.float64],
    north_south: NDArray[np.float64],
    marks: dict[str, int],
    theme: Theme,
    *,
    height: int = 250,
) -> go.Figure:
    """Return the correlation of the facies with themselves, with lengths in cells marked.

    Parameters
    ----------
    lags : ndarray of int, shape (m,)
    east_west, north_south : ndarray, shape (m,)
        1 at lag 0, about 0 where cells are independent; a peak is the distance from feature to
        feature.
    marks : dict
        Lengths to mark, such as {"T 32": 32}.
    theme : Theme
    """
    chart = blank_chart(theme, height=height, x_title="lag (cells)", y_title="correlation")
    for name, values, dash in (("E–W", east_west, "solid"), ("N–S", north_south, "dash")):
        chart.add_trace(
            go.Scatter(
                x=lags, y=values, name=name, mode="lines", hovertemplate="%{y:.2f}",
                line={"color": theme.reference, "width": 2, "dash": dash},
            )
        )  # fmt: skip
    chart.add_hline(y=0, line={"color": theme.hairline, "width": 1})
    for name, length in marks.items():
        chart.add_vline(
            x=length, line={"color": theme.ink, "width": 1, "dash": "dot"},
            annotation={"text": name, "font": {"size": 12, "color": theme.ink}},
        )  # fmt: skip
    low = min(float(np.min(east_west)), float(np.min(north_south)), 0.0)
    chart.update_yaxes(range=[1.1 * low - 0.05, 1.05])
    chart.update_xaxes(range=[0, max(float(lags[-1]), *(float(v) * 1.08 for v in marks.values()))])
    return chart
