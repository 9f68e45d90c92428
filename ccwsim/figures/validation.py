"""Charts that judge realizations: calibration, data, divergences, lag maps, convergence, MDS."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import plotly.graph_objects as go

from ccwsim.figures.style import (
    CIVIDIS,
    CLEAR,
    Theme,
    as_written,
    blank_chart,
    dots,
    line,
    rows_axis,
    written,
)
from ccwsim.model import Floats, Integers

MAX_DOT, MIN_DOT = 22, 5  # largest and smallest diameter in pixels of the dots of a calibration
MAX_CENTRED_X = 0.4  # largest |x| of a point whose name is centred; farther out it does not fit


@dataclass(frozen=True, eq=False)
class Strip:
    """One statistic of each realization and of the training image; undefined values are NaN."""

    title: str  # name and unit of the statistic
    each: Floats  # shape (n,)
    reference: float


def strip_chart(strip: Strip, theme: Theme, *, colour: str) -> go.Figure:
    """Return a chart with a dot for each realization, and a red stroke for the training image."""
    chart = blank_chart(theme, height=116, x_title=strip.title, y_title="")
    n = len(strip.each)
    spread = (np.arange(n) * 0.618034) % 1.0 - 0.5  # scatter the dots to avoid overlaps
    each = dots("realizations", strip.each, spread, colour, 9)
    each.update(marker={"opacity": 0.75, "line": {"width": 0.8, "color": theme.quiet}})
    each.update(text=[f"realization {k + 1}" for k in range(n)])
    chart.add_trace(each.update(hovertemplate="%{text}: %{x:.3g}<extra></extra>"))
    x, y = ([strip.reference] * 2, [-0.8, 0.8]) if not np.isnan(strip.reference) else ([], [])
    hover = "training image: %{x:.3g}<extra></extra>"
    chart.add_trace(line("training image", x, y, theme.reference, 3, hovertemplate=hover))
    chart.update_yaxes(range=[-1, 1], showline=False, ticks="", showticklabels=False)
    chart.update_xaxes(range=_around([*strip.each.tolist(), strip.reference]), nticks=6)
    return chart


def calibration_chart(
    forecast: Floats,
    observed: Floats,
    count: Integers,
    theme: Theme,
    *,
    guided: bool = False,
) -> go.Figure:
    """Return a chart of observed shares against predictions; larger dots have more cells.

    With `guided`, the predictions are probabilities that guided the realizations.
    """
    x_title, y_title = "probability in the realizations", "came true"
    if guided:
        x_title, y_title = "given probability", "share in the realizations"
    chart = blank_chart(theme, height=320, x_title=f"{x_title} (%)", y_title=f"{y_title} (%)")
    chart.add_trace(line("perfect", [0, 100], [0, 100], theme.reference, 2))
    sizes = MAX_DOT * np.sqrt(count / max(int(count.max(initial=0)), 1))
    hover = f"{x_title} %{{x:.0f}} %, {y_title} %{{y:.0f}} %, %{{customdata}} cells<extra></extra>"
    trace = line(
        "realizations", 100 * forecast, 100 * observed, theme.ink, 1.5, hovertemplate=hover
    )
    marker = {"size": np.maximum(sizes, MIN_DOT), "color": theme.ink}
    trace.update(mode="lines+markers", marker=marker, customdata=count, connectgaps=True)
    chart.add_trace(trace)
    chart.update_xaxes(range=[-4, 104])
    chart.update_yaxes(range=[-4, 104])
    return chart


def data_status_chart(
    names: Sequence[str], shares: Floats, theme: Theme, *, height: int = 230
) -> go.Figure:
    """Return a bar chart of the mean share of hard data by data status.

    Examples of `names` are "raster" and "re-simulated, 8 cells"; the bar of the last name has a
    warning colour. `shares`, shape (n_realizations, n_names), are from 0 to 1.
    """
    chart = blank_chart(theme, height=height, x_title="share of the data (%)", y_title="")
    rows, means = as_written(names), 100 * shares.mean(axis=0)
    colours = [theme.ink] + [theme.quiet] * (len(names) - 2) + [theme.reference]
    bars = go.Bar(x=means, y=rows, orientation="h", name="mean over realizations", width=0.6)
    bars.update(
        marker_color=colours[-len(names) :],
        text=[f"{mean:.3g} %" for mean in means],
        textposition="outside",
        textfont={"size": 12, "color": theme.ink},
        cliponaxis=False,
        hovertemplate="%{y}: %{x:.3g} % of the data<extra></extra>",
    )
    chart.add_trace(bars)
    chart.update_xaxes(range=[0, 118], tickvals=[0, 25, 50, 75, 100])
    chart.update_yaxes(autorange="reversed", tickmode="array", tickvals=rows)
    chart.update_yaxes(showline=False, tickfont={"size": 13, "color": theme.ink})
    chart.update_yaxes(ticks="outside", tickcolor=CLEAR, ticklen=6)  # a gap
    return chart


def divergence_chart(
    factors: Sequence[int], between: Floats, within: Floats, theme: Theme
) -> go.Figure:
    """Return a chart of the ANODI divergences (bits) at each resolution 1 / factor."""
    chart = blank_chart(theme, height=230, x_title="Jensen–Shannon divergence (bits)", y_title="")
    rows = list(range(len(factors)))
    for row, a, b in zip(rows, between, within, strict=True):
        chart.add_trace(line(f"span {row + 1}", [a, b], [row, row], theme.quiet, 1))
    for name, values, colour, symbol, side in (
        ("between realizations", between, theme.ink, "circle", "top left"),
        ("to the training image", within, theme.reference, "diamond", "bottom left"),
    ):
        trace = dots(name, values, rows, colour, 13, marker_symbol=symbol)
        trace.update(mode="markers+text", text=["" for _ in rows[1:]] + [name], textposition=side)
        trace.update(hovertemplate=f"{name}: %{{x:.3g}} bits<extra></extra>")
        chart.add_trace(trace.update(textfont={"size": 12, "color": colour}))
    names = ["full resolution" if f == 1 else f"1 / {f} resolution" for f in factors]
    chart.update_yaxes(**rows_axis(theme, names, (len(rows) - 0.5, -0.5)))
    values = np.concatenate([between, within])
    top = float(np.nanmax(values)) if (~np.isnan(values)).any() else 1.0
    chart.update_xaxes(range=[0, 1.12 * top or 1.0])
    return chart


def lag_map_chart(
    lags: Integers,
    values: Floats,
    theme: Theme,
    *,
    name: str,
    largest: float,
    azimuth: float | None = None,
    difference: bool = False,
) -> go.Figure:
    """Return a map of a statistic over all lags, with lag 0 in the middle and north at the top.

    `lags` are the integers from −m to m, for both rows and columns. Hover texts show `name`, such
    as "γ of sand". The colour scale is from 0 to `largest`, or from −`largest` to `largest` for a
    difference. A line marks `azimuth`, in degrees from north.
    """
    chart = blank_chart(theme, height=330, x_title="lag E (cells)", y_title="lag N (cells)")
    heat = go.Heatmap(x=lags, y=lags, z=values.astype(np.float32), name=written(name))
    colours = theme.difference if difference else CIVIDIS
    heat.update(
        zmin=-largest if difference else 0.0,
        zmax=largest,
        colorscale=[[k / (len(colours) - 1), colour] for k, colour in enumerate(colours)],
        colorbar={"thickness": 9, "outlinewidth": 0, "len": 1.0, "nticks": 5, "x": 1.02},
        colorbar_tickfont={"size": 11, "color": theme.quiet},
        hovertemplate=f"%{{x}} E, %{{y}} N: {heat.name} = %{{z:.3g}}<extra></extra>",
    )
    chart.add_trace(heat)
    if azimuth is not None:
        angle, along = np.deg2rad(azimuth), float(lags[-1]) * np.array([-1.0, 1.0])
        x, y = along * np.sin(angle), along * np.cos(angle)
        chart.add_trace(line("direction", x, y, theme.reference, 2, dash="dot"))
    reach = [float(lags[0]) - 0.5, float(lags[-1]) + 0.5]
    chart.update_xaxes(range=reach, constrain="domain", constraintoward="right", nticks=5)
    chart.update_yaxes(range=reach, scaleanchor="x", constrain="domain", nticks=5)
    return chart


def _around(values: Sequence[float]) -> list[float]:
    """Return an axis range that contains all values, with a margin that does not reach below 0."""
    defined = [v for v in values if not np.isnan(v)] or [0.0]
    room = 0.12 * (max(defined) - min(defined)) or max(abs(defined[0]) * 0.1, 0.5)
    low = min(defined) - room
    return [max(low, 0.0) if min(defined) >= 0 else low, max(defined) + room]


@dataclass(frozen=True, eq=False)
class Group:
    """Realizations that have the same marker and colour in an MDS plot."""

    name: str
    positions: Floats  # shape (n, 2)
    colour: str
    symbol: str = "circle"  # plotly's name of the marker symbol
    labels: Sequence[str] = ()  # hover text of each point; by default the name of the group
    ringed: int | None = None  # index of the realization that is shown elsewhere on the page


def label_side(place: Floats, others: Floats) -> str:
    """Return the side of a point on which its name fits into a plot with axes from −1 to 1.

    The name is above or below the point, where fewer of the `others`, shape (n, 2), are.
    """
    x, y = place.tolist()
    across = "left" if x > MAX_CENTRED_X else "right" if x < -MAX_CENTRED_X else "center"
    right, up = (others - place).T
    near = (abs(right) < 2 * MAX_CENTRED_X) & (abs(up) < MAX_CENTRED_X / 2)
    above, below = np.count_nonzero(near & (up > 0)), np.count_nonzero(near & (up < 0))
    return f"{'bottom' if (below, -y) < (above, 0) else 'top'} {across}"


def mds_chart(
    image: Floats, groups: Sequence[Group], theme: Theme, *, height: int = 400
) -> go.Figure:
    """Return an MDS plot of groups of realizations, with the training image (2,) in red."""
    chart = blank_chart(theme, height=height, x_title="axis 1", y_title="axis 2")
    opacity = 0.62 if len(groups) == 1 else 0.75
    for group in groups:
        trace = _points(group.positions, group.name, group.colour, 9, group.symbol)
        hover = "%{text}: click to see it" if group.labels else trace.name
        text = as_written(group.labels) or None
        trace.update(text=text, hovertemplate=f"{hover}<extra></extra>", opacity=opacity)
        chart.add_trace(trace)
    ringed = [group.positions[group.ringed] for group in groups if group.ringed is not None]
    if ringed:
        ring = _points(np.array(ringed), "shown", CLEAR, 18, "circle")
        chart.add_trace(ring.update(marker_line={"width": 2, "color": theme.ink}, hoverinfo="skip"))
    name = "training image"
    trace = _points(image[None], name, theme.reference, 15, "diamond")
    others = np.concatenate([group.positions for group in groups])
    reach = 1.12 * max(float(np.abs([image, *others]).max()), 1e-9)
    trace.update(
        mode="markers+text", text=[name], textposition=label_side(image / reach, others / reach)
    )
    trace.update(textfont={"size": 13, "color": theme.reference})
    chart.add_trace(trace.update(hovertemplate=f"{name}<extra></extra>"))
    chart.update_xaxes(range=[-reach, reach], nticks=5)
    chart.update_yaxes(range=[-reach, reach], scaleanchor="x")
    return chart


def mds_title(stress: float) -> str:
    """Return the title of an MDS plot with its stress (Kruskal's stress-1)."""
    return f"MDS plot: stress {stress:.2f}"


def _points(positions: Floats, name: str, colour: str, size: int, symbol: str) -> Any:
    """Return a trace of points whose look does not change when they are selected."""
    x, y = positions.T
    trace = dots(name, x, y, colour, size, marker_symbol=symbol)
    same = {"marker": {"opacity": 1}}
    return trace.update(selected=same, unselected={**same, "textfont": {"color": colour}})
