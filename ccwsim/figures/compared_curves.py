"""Curves of several settings against the training image: a median and a band each."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go

from ccwsim.experiments.comparison import ComparedCurves
from ccwsim.figures.setting_marks import DASHES, setting_colours, thinned
from ccwsim.figures.style import Theme, blank_chart

BAND = 0.13
"""Opacity of a band: four of them still show each other."""


def compared_curves_chart(
    curves: ComparedCurves,
    names: Sequence[str],
    theme: Theme,
    *,
    y_title: str,
    y_range: tuple[float, float] | None = None,
    height: int = 220,
) -> go.Figure:
    """Return bands below, medians above them, and the training image in red on top.

    Parameters
    ----------
    curves : ComparedCurves
    names : sequence of str
        One a setting.
    theme : Theme
    y_title : str
    y_range : pair of float, optional
        Give the same one to panels that are compared.
    """
    chart = blank_chart(theme, height=height, x_title="lag (cells)", y_title=y_title)
    colours = setting_colours(theme)
    there_and_back = np.concatenate([curves.lags, curves.lags[::-1]])
    for name, band, colour in zip(names, curves.bands, colours, strict=False):
        chart.add_trace(
            go.Scatter(
                x=there_and_back, y=np.concatenate([band.high, band.low[::-1]]),
                name=f"{name}, 5–95 %", mode="lines", line={"width": 0}, hoverinfo="skip",
                fill="toself", fillcolor=thinned(colour, BAND),
            )
        )  # fmt: skip
    for name, band, colour, dash in zip(names, curves.bands, colours, DASHES, strict=False):
        chart.add_trace(
            go.Scatter(
                x=curves.lags, y=band.median, name=name, mode="lines",
                line={"color": colour, "width": 2, "dash": dash}, hovertemplate="%{y:.3g}",
            )
        )  # fmt: skip
    chart.add_trace(
        go.Scatter(
            x=curves.lags, y=curves.reference, name="training image", mode="lines",
            line={"color": theme.reference, "width": 2}, hovertemplate="%{y:.3g}",
        )
    )  # fmt: skip
    chart.update_xaxes(range=[0, max(float(curves.lags[-1]), 1.0)])
    if y_range is not None:
        chart.update_yaxes(range=list(y_range))
    return chart
