"""Curves of an ensemble against the training image: bundle, band, median, and the TI on top."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from ccwsim.figures.style import Theme, blank_chart

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Bundle:
    """One statistic along a direction, of the training image and of each realization.

    Attributes
    ----------
    lags : ndarray, shape (m,)
        Distances in cells.
    reference : ndarray, shape (m,)
        The training image's curve.
    each : ndarray, shape (n, m)
        One curve a realization.
    low, median, high : ndarray, shape (m,)
        The 5 %, 50 % and 95 % quantiles over the realizations.
    """

    lags: Floats
    reference: Floats
    each: Floats
    low: Floats
    median: Floats
    high: Floats


def curves_chart(
    bundle: Bundle,
    theme: Theme,
    *,
    y_title: str,
    y_range: tuple[float, float] | None = None,
    x_title: str = "lag (cells)",
    height: int = 196,
) -> go.Figure:
    """Return the chart of a bundle: realizations grey, band, median dark, TI red on top.

    Parameters
    ----------
    bundle : Bundle
    theme : Theme
    y_title, x_title : str
        What the axes measure, with the unit.
    y_range : pair of float, optional
        Give the same one to panels that are compared.
    """
    chart = blank_chart(theme, height=height, x_title=x_title, y_title=y_title)
    chart.add_trace(_band(bundle, theme))
    chart.add_trace(_threads(bundle, theme))
    for name, values, colour, width in (
        ("median", bundle.median, theme.ink, 1.5),
        ("training image", bundle.reference, theme.reference, 2.0),
    ):
        chart.add_trace(
            go.Scatter(
                x=bundle.lags, y=values, name=name, mode="lines",
                line={"color": colour, "width": width},
                hovertemplate="%{y:.3g}",
            )
        )  # fmt: skip
    chart.update_xaxes(range=[0, float(bundle.lags[-1])])
    if y_range is not None:
        chart.update_yaxes(range=list(y_range))
    return chart


def _band(bundle: Bundle, theme: Theme) -> go.Scatter:
    return go.Scatter(
        x=np.concatenate([bundle.lags, bundle.lags[::-1]]),
        y=np.concatenate([bundle.high, bundle.low[::-1]]),
        name="5–95 %",
        fill="toself",
        fillcolor=theme.band,
        line={"width": 0},
        mode="lines",
        hoverinfo="skip",
    )


def _threads(bundle: Bundle, theme: Theme) -> go.Scatter:
    """All realizations as one trace with gaps: one trace each would be slow beyond fifty."""
    n = len(bundle.each)
    gap = np.full((n, 1), np.nan)
    return go.Scatter(
        x=np.tile(np.append(bundle.lags, np.nan).astype(np.float32), n),  # whole numbers: exact
        y=np.hstack([bundle.each, gap]).ravel(),
        name="realizations",
        mode="lines",
        line={"color": theme.each, "width": 0.8},
        hoverinfo="skip",
    )
