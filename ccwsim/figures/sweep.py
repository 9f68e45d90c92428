"""Settings of a sweep by time and error, with the front that none beats."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from ccwsim.figures.label_room import Box, label_sides
from ccwsim.figures.style import Theme, blank_chart

NARROW = 400.0
"""Pixels that the chart has at least on a usual screen, for which labels are placed."""
SPREAD = 4.0
"""Where the largest is so many times the smallest, an axis is logarithmic."""


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
    across, up = _axis(milliseconds, 0.12), _axis(errors, 0.12)
    chart.update_xaxes(**across)
    chart.update_yaxes(**up)
    room = (NARROW, height - 60.0)
    pixels = np.column_stack([
        _shares(milliseconds, across) * room[0], (1 - _shares(errors, up)) * room[1],
    ])  # fmt: skip
    first = [k for k in (recommended, selected) if k is not None]
    order = [*first, *on_front, *np.argsort(errors).tolist()]
    sides = label_sides(pixels, labels, dict.fromkeys(order), room, _steps(pixels[on_front]))
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
            "opacity": 1, "color": strong,
            "size": [13 if k == recommended else 9 for k in range(n)],
            "symbol": ["diamond" if k == recommended else
                       "circle" if k in front else "circle-open" for k in range(n)],
            "line": {"width": 1.5, "color": strong},
        },
        customdata=said,
        hovertemplate="%{customdata}<br>%{x:.3g} ms, %{y:.3g}: click to see it<extra></extra>",
        selected={"marker": {"opacity": 1}},
        unselected={"marker": {"opacity": 1}},
    )  # fmt: skip


def _axis(values: NDArray[np.float64], margin: float) -> dict[str, Any]:
    """Return an axis that holds the values: logarithmic where they are far apart, else from 0."""
    known = values[np.isfinite(values)]
    low, high = (float(known.min()), float(known.max())) if len(known) else (0.0, 1.0)
    if low <= 0 or high / low < SPREAD:
        return {"range": (0.0, (1 + margin) * high or 1.0), "exponentformat": "none"}
    a, b = np.log10([low, high])
    ends = float(a - margin * (b - a)), float(b + margin * (b - a))
    ticks = [m * 10.0**e for e in range(-9, 9) for m in (1, 2, 5)]
    shown = [t for t in ticks if ends[0] <= np.log10(t) <= ends[1]]
    return {"type": "log", "range": ends, "tickvals": shown,
            "ticktext": [f"{t:.6g}" for t in shown]}  # fmt: skip


def _steps(corners: NDArray[np.float64]) -> list[Box]:
    """Return the front's lines as boxes: from each point on the right, then to the next one."""
    boxes: list[Box] = []
    for (x, y), (right, below) in pairwise(corners.tolist()):
        boxes += [(x, y - 1, right, y + 1), (right - 1, y, right + 1, below)]
    return boxes


def _shares(values: NDArray[np.float64], axis: dict[str, Any]) -> NDArray[np.float64]:
    """Return how far along an axis values lie, 0 to 1."""
    along = np.log10(values) if "type" in axis else values
    return (along - axis["range"][0]) / (axis["range"][1] - axis["range"][0])
