"""How the hard data came to be honoured."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from ccwsim.figures.style import Theme, blank_chart


def data_status_chart(
    names: Sequence[str], shares: NDArray[np.float64], theme: Theme, *, height: int = 230
) -> go.Figure:
    """Return one bar a way of honouring: mean share of the data over the realizations.

    Parameters
    ----------
    names : sequence of str
        Such as "raster" and "mended, 8 cells"; the last one is drawn in the colour of a warning.
    shares : ndarray, shape (n_realizations, n_names)
        Shares of the data, from 0 to 1.
    theme : Theme
    """
    chart = blank_chart(theme, height=height, x_title="share of the data (%)", y_title="")
    means = 100 * shares.mean(axis=0)
    colours = [theme.ink] + [theme.quiet] * (len(names) - 2) + [theme.reference]
    chart.add_trace(
        go.Bar(
            x=means, y=list(names), orientation="h", name="mean over realizations",
            marker={"color": colours[-len(names) :]}, width=0.6,
            text=[f"{mean:.3g} %" for mean in means], textposition="outside", cliponaxis=False,
            textfont={"size": 12, "color": theme.ink},
            hovertemplate="%{y}: %{x:.3g} % of the data<extra></extra>",
        )
    )  # fmt: skip
    chart.update_xaxes(range=[0, 118], tickvals=[0, 25, 50, 75, 100])
    chart.update_yaxes(
        autorange="reversed",
        tickmode="array",
        tickvals=list(names),
        showline=False,
        ticks="outside",
        tickcolor="rgba(0,0,0,0)",  # keeps the names off the bars
        ticklen=6,
        tickfont={"size": 13, "color": theme.ink},
    )
    return chart.update_layout(hovermode="closest")
