"""How an estimate settles as realizations arrive."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go

from ccwsim.figures.style import Theme, blank_chart


def convergence_chart(
    numbers: Sequence[int],
    errors: Sequence[float],
    n_asked: int,
    theme: Theme,
    *,
    height: int = 230,
) -> go.Figure:
    """Return the error of an estimate over the number of realizations, both on log axes.

    Parameters
    ----------
    numbers : sequence of int
        Realizations so far.
    errors : sequence of float
        The standard error then, in percentage points.
    n_asked : int
        Where the axis ends.
    theme : Theme
    """
    chart = blank_chart(
        theme, height=height, x_title="realizations", y_title="error of a probability (%)"
    )
    chart.add_trace(
        go.Scatter(
            x=list(numbers), y=list(errors), name="standard error", mode="lines+markers",
            line={"color": theme.ink, "width": 1.5}, marker={"size": 5},
            hovertemplate="± %{y:.2g} %",
        )
    )  # fmt: skip
    ends = np.log10([max(min(numbers, default=1), 1) * 0.9, max(n_asked, 2) * 1.1])
    chart.update_xaxes(type="log", range=ends.tolist(), dtick=1)
    chart.update_yaxes(type="log", nticks=4)
    return chart
