"""Settings of a sweep by time and error, with the front that none beats."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from ccwsim.figures.label_room import label_sides
from ccwsim.figures.style import Theme, blank_chart

NARROW = 400.0
"""Pixels that the chart has at least on a usual screen, for which labels are placed."""
SPREAD = 6.0
"""From so many times the shortest on, times are drawn on a logarithmic axis."""


def sweep_chart(
    milliseconds: NDArray[np.float64],
    errors: NDArray[np.float64],
    labels: Sequence[str],
    theme: Theme,
    *,
    front: Iterable[int],
    selected: int | None,
    recommended: int | None,
    y_title: str,
    height: int = 380,
) -> go.Figure:
    """Return a dot a setting, the Pareto front as steps, and two dots marked.

    Parameters
    ----------
    milliseconds, errors : ndarray, shape (n,)
        CPU time of a realization, and how far it is off; NaN is not drawn.
    labels : sequence of str
        What the settings are called; written beside the dots where there is room.
    theme : Theme
    front : iterable of int
        Settings on the front, by time.
    selected, recommended : int or None
        The setting that is ringed, and the one drawn as a diamond.
    y_title : str
        What the error is.
    """
    on_front = [int(k) for k in front]
    chart = blank_chart(
        theme, height=height, x_title="CPU time of a realization (ms)", y_title=y_title
    )
    ranges = _scale(chart, milliseconds, errors)
    first = [k for k in (recommended, selected) if k is not None]
    order = [*first, *on_front, *np.argsort(errors).tolist()]
    sides = label_sides(
        _pixels(milliseconds, errors, ranges, height), labels, dict.fromkeys(order),
        (NARROW, height - 60),
    )  # fmt: skip
    chart.add_trace(_dots(milliseconds, errors, labels, sides, on_front, recommended, theme))
    if on_front:
        chart.add_trace(
            go.Scatter(
                x=milliseconds[on_front], y=errors[on_front], mode="lines", name="front",
                line={"shape": "hv", "width": 1, "color": theme.quiet}, hoverinfo="skip",
            )
        )  # fmt: skip
    if selected is not None:
        chart.add_trace(
            go.Scatter(
                x=milliseconds[[selected]], y=errors[[selected]], mode="markers", name="selected",
                hoverinfo="skip",
                marker={"size": 21, "color": "rgba(0,0,0,0)",
                        "line": {"width": 2, "color": theme.ink}},
            )
        )  # fmt: skip
    return chart.update_layout(hovermode="closest")


def _dots(
    x: NDArray[np.float64], y: NDArray[np.float64], labels: Sequence[str],
    sides: Sequence[str | None], front: list[int], recommended: int | None, theme: Theme,
) -> go.Scatter:  # fmt: skip
    n = len(x)
    strong = [theme.ink if k in front or k == recommended else theme.quiet for k in range(n)]
    said = [f"{label} · recommended" if k == recommended else label
            for k, label in enumerate(labels)]  # fmt: skip
    return go.Scatter(
        x=x, y=y, name="settings", mode="markers+text",
        text=[label if side else "" for label, side in zip(labels, sides, strict=True)],
        textposition=[side or "top center" for side in sides],
        textfont={"size": 12, "color": strong},
        marker={
            "size": [13 if k == recommended else 9 for k in range(n)], "color": strong,
            "symbol": ["diamond" if k == recommended else
                       "circle" if k in front else "circle-open" for k in range(n)],
            "line": {"width": 1.5, "color": strong},
        },
        customdata=said,
        hovertemplate="%{customdata}<br>%{x:.3g} ms, %{y:.3g}: click to see it<extra></extra>",
        selected={"marker": {"opacity": 1}},
        unselected={"marker": {"opacity": 1}},
    )  # fmt: skip


def _scale(
    chart: go.Figure, x: NDArray[np.float64], y: NDArray[np.float64]
) -> tuple[bool, tuple[float, float], tuple[float, float]]:
    """Give the axes their ranges; return whether the first is logarithmic, and both ranges."""
    low, high = float(x.min()), float(x.max())
    logarithmic = low > 0 and high / low >= SPREAD
    if logarithmic:
        a, b = np.log10([low, high])
        pad = 0.12 * (b - a)
        across = (float(a - pad), float(b + pad))
        ticks = [m * 10.0**e for e in range(-4, 8) for m in (1, 2, 5)]
        shown = [t for t in ticks if across[0] <= np.log10(t) <= across[1]]
        chart.update_xaxes(type="log", tickvals=shown, ticktext=[f"{t:g}" for t in shown])
    else:
        across = (0.0, 1.25 * high or 1.0)
    top = float(np.nanmax(y)) if np.isfinite(y).any() else 1.0
    up = (0.0, 1.12 * top or 1.0)
    chart.update_xaxes(range=across)
    chart.update_yaxes(range=up, exponentformat="none")
    return logarithmic, across, up


def _pixels(
    x: NDArray[np.float64], y: NDArray[np.float64], ranges: tuple, height: int
) -> NDArray[np.float64]:
    logarithmic, across, up = ranges
    along = np.log10(x) if logarithmic else x
    return np.column_stack([
        (along - across[0]) / (across[1] - across[0]) * NARROW,
        (up[1] - y) / (up[1] - up[0]) * (height - 60),
    ])  # fmt: skip
