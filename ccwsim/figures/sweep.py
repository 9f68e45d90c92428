"""Chart of the times and errors of the settings of a sweep, with the Pareto front."""

from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import ArrayLike

from ccwsim.figures.style import CLEAR, Theme, as_written, blank_chart, dots, line, log_axis
from ccwsim.model import Floats

LETTER_WIDTH, LINE_HEIGHT, POINT_GAP = 6.6, 15.0, 9.0
"""Letter width at font size 12, line height, and gap between a point and its label, in pixels."""
LabelBox = tuple[float, float, float, float]
LABEL_POSITIONS = {
    "middle right": (1, 0),
    "top center": (0, -1),
    "bottom center": (0, 1),
    "middle left": (-1, 0),
    "top right": (1, -1),
    "bottom right": (1, 1),
    "top left": (-1, -1),
    "bottom left": (-1, 1),
}
NARROW = 400.0  # assumed width of a chart in pixels when labels are placed, the smallest usual one
# minimum ratio of the largest to the smallest value for which an axis is logarithmic
MIN_LOGARITHMIC_RATIO = 4.0


def sweep_chart(
    milliseconds: Floats,
    errors: Floats,
    labels: Sequence[str],
    theme: Theme,
    *,
    front: Iterable[int],
    selected: int | None,
    recommended: int | None,
    y_title: str,
    spreads: Floats | None = None,
    height: int = 380,
) -> go.Figure:
    """Return a chart with a dot for each setting, and with the Pareto front as a stepped line.

    CPU times, errors and spreads have shape (n,); NaN values are not drawn. A spread, drawn as a
    bar, is the variation of an error between realizations. Labels are beside the dots if there is
    room. `front` are the indices of the settings on the front, fastest first. The setting
    `selected` is ringed, and the setting `recommended` is a diamond.
    """
    on_front = [int(k) for k in front]
    bar = np.zeros(len(errors)) if spreads is None else np.nan_to_num(spreads)
    across, up = _axis(milliseconds, 0.12), _axis(np.append(errors, errors + bar), 0.12)
    chart = blank_chart(
        theme,
        height=height,
        x_title="CPU time of a realization (ms)",
        y_title=y_title,
        x=across,
        y=up,
    )
    room = (NARROW, height - 60.0)
    x, y = _shares(milliseconds, across) * room[0], (1 - _shares(errors, up)) * room[1]
    pixels = np.column_stack([x, y])
    first = [k for k in (recommended, selected) if k is not None]
    order = dict.fromkeys([*first, *on_front, *np.argsort(errors).tolist()])
    sides = label_sides(pixels, labels, order, room, _steps(pixels[on_front]))
    n = len(labels)
    colours = [theme.ink if k in (*on_front, recommended) else theme.quiet for k in range(n)]
    symbols = ["circle" if k in on_front else "circle-open" for k in range(n)]
    sizes, hover = [9] * n, as_written(labels)
    if recommended is not None:
        symbols[recommended], sizes[recommended] = "diamond", 13
        hover[recommended] += " · recommended"
    settings = dots("settings", milliseconds, errors, colours, sizes)
    same = {"marker": {"opacity": 1}}  # do not change the look of selected dots
    settings.update(
        mode="markers+text",
        text=[label if side else "" for label, side in zip(hover, sides, strict=True)],
        textposition=[side or "top center" for side in sides],
        textfont={"size": 12, "color": colours},
        marker={"opacity": 1, "symbol": symbols, "line": {"width": 1.5, "color": colours}},
        customdata=hover,
        hovertemplate="%{customdata}<br>%{x:.3r} ms, %{y:.3g}: click to see it<extra></extra>",
        selected=same,
        unselected=same,
    )
    bars = {"array": bar, "width": 0, "thickness": 1, "color": theme.quiet}
    chart.add_trace(settings.update(error_y=bars) if bar.any() else settings)
    if on_front:
        steps = line("front", milliseconds[on_front], errors[on_front], theme.quiet, 1)
        chart.add_trace(steps.update(line_shape="hv"))
    if selected is not None:
        ring = dots("selected", milliseconds[[selected]], errors[[selected]], CLEAR, 21)
        chart.add_trace(ring.update(marker_line={"width": 2, "color": theme.ink}, hoverinfo="skip"))
    return chart


def _axis(values: Floats, margin: float) -> dict[str, Any]:
    """Return a logarithmic axis if values differ by a large factor, otherwise a linear axis."""
    finite = values[np.isfinite(values)]
    low, high = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 1.0)
    if low <= 0 or high / low < MIN_LOGARITHMIC_RATIO:
        return {"range": [0.0, (1 + margin) * high or 1.0], "exponentformat": "none"}
    a, b = np.log10([low, high])
    return log_axis(float(a - margin * (b - a)), float(b + margin * (b - a)))


def _steps(corners: Floats) -> list[LabelBox]:
    """Return the lines of the front as boxes; from each point, a line runs right and then down."""
    boxes: list[LabelBox] = []
    for (x, y), (right, below) in pairwise(corners.tolist()):
        boxes += [(x, y - 1, right, y + 1), (right - 1, y, right + 1, below)]
    return boxes


def _shares(values: Floats, axis: dict[str, Any]) -> Floats:
    """Return the positions of values along an axis, from 0 to 1."""
    along = np.log10(values) if "type" in axis else values
    return (along - axis["range"][0]) / (axis["range"][1] - axis["range"][0])


def label_sides(
    points: ArrayLike,
    texts: Sequence[str],
    order: Iterable[int],
    room: tuple[float, float],
    blocked: Iterable[LabelBox] = (),
) -> list[str | None]:
    """For each label, return a free side of its point, or None if no side is free."""
    centres = np.asarray(points, dtype=float).reshape(-1, 2)
    taken: list[LabelBox] = [(x - 6, y - 6, x + 6, y + 6) for x, y in centres.tolist()]
    taken += blocked
    sides: list[str | None] = [None] * len(centres)
    for k in order:
        x, y = centres[k]
        if not np.isfinite((x, y)).all():
            continue
        for side, (right, down) in LABEL_POSITIONS.items():
            box = _box(x, y, len(texts[k]) * LETTER_WIDTH, right, down)
            inside = box[0] >= 0 and box[1] >= 0 and box[2] <= room[0] and box[3] <= room[1]
            if inside and not any(
                box[0] < b[2] and b[0] < box[2] and box[1] < b[3] and b[1] < box[3]
                for b in (other for other in taken if other is not taken[k])
            ):
                sides[k] = side
                taken.append(box)
                break
    return sides


def _box(x: float, y: float, width: float, right: int, down: int) -> LabelBox:
    """Return the left, top, right and bottom of a label beside a point."""
    middle = x + right * (POINT_GAP + width / 2)
    line = y + down * (POINT_GAP + LINE_HEIGHT / 2)
    return middle - width / 2, line - LINE_HEIGHT / 2, middle + width / 2, line + LINE_HEIGHT / 2
