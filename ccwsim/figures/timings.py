"""CPU time against the cells of the grid, on log axes: straight at slope one where it is linear."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from ccwsim.figures.style import Theme, blank_chart

SYMBOLS = ("x", "circle", "square", "diamond", "triangle-up", "star", "pentagon")
"""Of the markers, by level: the same for what was measured and what was published."""
LABEL_GAP = 15
"""Pixels between two labels."""
EMPTY_DECADES = 4.0
"""Shown below what was published where nothing is measured yet."""


@dataclass(frozen=True)
class TimeSeries:
    """Times of one setting.

    Attributes
    ----------
    name : str
    level : int
        Decides the marker.
    cells, values : ndarray, shape (n,)
        Cells of the grid, and the time of each.
    dashed : bool
        Whether its line is dashed, to tell two methods apart.
    """

    name: str
    level: int
    cells: NDArray[np.float64]
    values: NDArray[np.float64]
    dashed: bool = False


def timings_chart(
    measured: Sequence[TimeSeries],
    published: Sequence[TimeSeries],
    sides: Sequence[int],
    theme: Theme,
    *,
    y_title: str,
    unit: str,
    height: int = 340,
) -> go.Figure:
    """Return measured times as lines, and published ones as open red markers.

    Parameters
    ----------
    measured, published : sequence of TimeSeries
    sides : sequence of int
        Of the square grids that are named on the axis.
    theme : Theme
    y_title : str
        What is shown, with its unit.
    unit : str
        For the hover.
    """
    chart = blank_chart(theme, height=height, x_title="cells of the grid", y_title=y_title)
    for series in measured:
        chart.add_trace(_line(series, theme, unit))
    for series in published:
        chart.add_trace(_open_markers(series, theme, unit))
    ends = np.log10([min(sides) ** 2 * 0.7, max(sides) ** 2 * 1.5]).tolist()
    chart.update_xaxes(
        type="log", range=ends, tickmode="array", tickvals=[side**2 for side in sides],
        ticktext=[f"{side}²" for side in sides], tickangle=0,
    )  # fmt: skip
    values = [v for series in (*measured, *published) for v in series.values]
    low, high = (np.log10(f(values)) for f in (min, max)) if values else (-2.0, 1.0)
    low = min(low, high - EMPTY_DECADES) if not measured else low
    room = 0.12 * (high - low) + 0.12
    chart.update_yaxes(type="log", range=[low - room, high + 2 * room], dtick=1,
                       exponentformat="none")  # fmt: skip
    _label_lines(chart, measured, theme, (height - 60) / (high - low + 3 * room))
    if published:
        _label_published(chart, published, theme)
    return chart.update_layout(hovermode="closest")


def _line(series: TimeSeries, theme: Theme, unit: str) -> go.Scatter:
    return go.Scatter(
        x=series.cells, y=series.values, name=series.name, mode="lines+markers",
        line={"color": theme.ink, "width": 1.5, "dash": "dash" if series.dashed else "solid"},
        marker={"symbol": _symbol(series), "size": 8},
        hovertemplate=f"{series.name}, %{{x:,.0f}} cells: %{{y:.3g}} {unit}<extra></extra>",
    )  # fmt: skip


def _open_markers(series: TimeSeries, theme: Theme, unit: str) -> go.Scatter:
    return go.Scatter(
        x=series.cells, y=series.values, name=series.name, mode="markers", cliponaxis=False,
        marker={"symbol": f"{_symbol(series)}-open", "size": 11, "color": theme.reference,
                "line": {"width": 2}},
        hovertemplate=f"{series.name}, %{{x:,.0f}} cells: %{{y:.3g}} {unit}<extra></extra>",
    )  # fmt: skip


def _symbol(series: TimeSeries) -> str:
    return SYMBOLS[min(series.level, len(SYMBOLS) - 1)]


def _label_lines(
    chart: go.Figure, measured: Sequence[TimeSeries], theme: Theme, pixels: float
) -> None:
    """Name each line at its end; names that would meet are moved apart, from the top down."""
    lowest = np.inf
    for series in sorted(measured, key=lambda series: -series.values[-1]):
        own = float(np.log10(series.values[-1])) * pixels
        at = min(own, lowest - LABEL_GAP)
        lowest = at
        _label(chart, series, series.name, theme.ink, xanchor="left", xshift=9, yshift=at - own)


def _label_published(chart: go.Figure, published: Sequence[TimeSeries], theme: Theme) -> None:
    """Name the slowest above its marker, and the others, which nearly meet, below theirs."""
    top, *others = sorted(published, key=lambda series: -series.values[-1])
    place = {"xanchor": "right", "xshift": 24}
    _label(chart, top, top.name, theme.reference, yshift=16, **place)
    if others:
        named = ", ".join(str(level) for level in sorted(series.level for series in others))
        text = f"level{'s' if len(others) > 1 else ''} {named}"
        _label(chart, others[-1], text, theme.reference, yshift=-16, **place)


def _label(chart: go.Figure, series: TimeSeries, text: str, colour: str, **place: object) -> None:
    chart.add_annotation(
        x=float(np.log10(series.cells[-1])), y=float(np.log10(series.values[-1])), text=text,
        showarrow=False, font={"size": 13, "color": colour}, **place,
    )  # fmt: skip
