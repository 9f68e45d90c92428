"""Charts and sparklines of the curves of ensembles, training images and methods."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from ccwsim.figures.style import (
    DASHES,
    Theme,
    as_written,
    blank_chart,
    dots,
    line,
    with_opacity,
    written,
)
from ccwsim.model import Array, ArrayLike, Floats, Integers

BAND_OPACITY = 0.13  # opacity of the bands of settings; low enough to see four overlapping bands
UNIFIED = "x unified"  # hovering shows the values of all curves at a lag
ROW_HEIGHT = 172  # height in pixels of a row of transiograms
MAX_DISC = 6  # maximum diameter in pixels of the discs that show the hard data of a layer
SPARKLINE_SIDE, SPARKLINE_MARGIN = 100, 4  # side and margin of a sparkline in SVG units


@dataclass(frozen=True, eq=False)
class Bundle:
    """One statistic along one direction, for the training image and each realization."""

    lags: Floats  # shape (m,): distances in cells
    reference: Floats  # shape (m,): the training image's curve
    each: Floats  # shape (n, m): one curve for each realization; n may be 0
    low: Floats  # shape (m,): the 5 % quantile over the realizations
    median: Floats  # shape (m,)
    high: Floats  # shape (m,): the 95 % quantile


@dataclass(frozen=True, eq=False)
class Line:
    """One line of a chart."""

    name: str
    x: Array
    y: Array
    colour: str
    dash: str = "solid"  # "solid", "dash" or "dot"; "none" draws points only
    points: bool = False  # whether each value is marked by a point


@dataclass(frozen=True, eq=False)
class LayerData:
    """Elevation, share of one facies and number of hard data for each layer with hard data."""

    at: Floats
    share: Floats
    count: Integers


def curves_chart(
    bundles: Bundle | Mapping[str, Bundle],
    theme: Theme,
    *,
    y_title: str,
    y_range: tuple[float, float] | None = None,
    x_title: str = "lag (cells)",
    x_range: tuple[float, float] | None = None,
    height: int = 196,
    judged: tuple[Floats, ...] | None = None,
) -> go.Figure:
    """Return a chart of curves of an ensemble or several settings; the training image is red.

    The chart of one ensemble has grey realizations, a grey band and a dark median. The chart of up
    to four named settings has a band and a median for each setting. Charts to be compared need the
    same `y_range`. The default of `x_range` is from 0 to the last lag. `judged` contains lags, and
    means of crops and of pieces, which a verdict compares; both means are dotted.
    """
    if isinstance(bundles, Bundle):
        first = bundles
        traces = [_band(first, "5–95 %", theme.band), _threads(first, theme)]
        traces.append(_median(first, "median", theme.ink, 1.5))
    else:
        first = next(iter(bundles.values()))
        marked = list(zip(bundles.items(), theme.settings, DASHES, strict=False))
        traces = [
            _band(bundle, f"{name}, 5–95 %", with_opacity(colour, BAND_OPACITY))
            for (name, bundle), colour, _ in marked
        ]
        traces += [
            _median(bundle, name, colour, 2.0, dash) for (name, bundle), colour, dash in marked
        ]
    image = line(
        "training image", first.lags, first.reference, theme.reference, 2, hovertemplate="%{y:.3g}"
    )
    traces.append(image)
    if judged is not None:
        judged_lags, *means = judged
        marked = ("crops of the TI", theme.reference), ("pieces", theme.ink)
        for (name, colour), values in zip(marked, means, strict=True):
            traces.append(
                line(name, judged_lags, values, colour, 1.5, dash="dot", hovertemplate="%{y:.3g}")
            )
    return blank_chart(
        theme,
        height=height,
        traces=traces,
        x_title=x_title,
        y_title=y_title,
        x={"range": list(x_range or (0, max(float(first.lags[-1]), 1.0)))},
        y={"range": y_range and list(y_range)},
        hovermode=UNIFIED,
    )


def lines_chart(
    lines: Sequence[Line],
    theme: Theme,
    *,
    x_title: str,
    y_title: str,
    y_range: tuple[float, float] | None = None,
    height: int = 230,
) -> go.Figure:
    """Return a chart of lines with the colour, dash and points of each line."""
    chart = blank_chart(theme, height=height, x_title=x_title, y_title=y_title, hovermode=UNIFIED)
    for curve in lines:
        only_points = curve.dash == "none"
        drawn = line(
            curve.name,
            curve.x,
            curve.y,
            curve.colour,
            1.8,
            mode="markers" if only_points else "lines+markers" if curve.points else "lines",
            dash="solid" if only_points else curve.dash,
            hovertemplate=f"{written(curve.name)}: %{{y:.3g}}<extra></extra>",
        )
        symbol = "diamond" if only_points else "circle"
        drawn.update(marker={"color": curve.colour, "size": 8, "symbol": symbol})
        chart.add_trace(drawn)
    return chart.update_yaxes(range=y_range)


def transiogram_chart(
    bundles: Mapping[tuple[int, int], Bundle],
    tails: Sequence[int],
    heads: Sequence[int],
    names: Sequence[str],
    theme: Theme,
) -> go.Figure:
    """Return a chart of transiograms P(head at x + h | tail at x), with a row for each tail."""
    names = as_written(names)
    rows = len(tails)
    chart = make_subplots(
        rows,
        len(heads),
        subplot_titles=[f"{names[tail]} → {names[head]}" for tail in tails for head in heads],
        shared_xaxes=True,
        shared_yaxes=True,
        horizontal_spacing=0.03,
        vertical_spacing=0.28 / (rows + 1),
    )
    height = 40 + ROW_HEIGHT * rows
    blank = blank_chart(theme, height=height, x_title="", y_title="", hovermode=UNIFIED)
    layout = blank.layout.to_plotly_json()
    axes = {axis: layout.pop(axis) for axis in ("xaxis", "yaxis")}
    chart.update_layout(**layout, margin_t=28)
    chart.update_xaxes(**axes["xaxis"])
    chart.update_yaxes(**axes["yaxis"])
    for row, tail in enumerate(tails, 1):
        for column, head in enumerate(heads, 1):
            pair = f"{names[tail]} → {names[head]}"
            drawn = cast(Any, curves_chart(bundles[tail, head], theme, y_title=""))
            for trace in drawn.data:
                chart.add_trace(trace.update(name=f"{pair}, {trace.name}"), row, column)
    longest = max(float(bundle.lags[-1]) for bundle in bundles.values())
    chart.update_xaxes(range=[0, longest], title_text="")
    chart.update_xaxes(title_text="lag (cells)", row=rows)
    chart.update_yaxes(range=[0, 1.03], nticks=4, title_text="")
    chart.update_yaxes(title_text="probability", col=1)
    return chart.update_annotations(font={"size": 13, "color": theme.ink})


def vertical_proportions_chart(
    bundle: Bundle,
    theme: Theme,
    *,
    x_title: str,
    reference_at: Floats | None = None,
    data: LayerData | None = None,
    y_title: str = "elevation",
    height: int = 196,
) -> go.Figure:
    """Return a chart of the share of a facies in each layer; the training image is red.

    The lags of `bundle` are the elevations of the realizations' layers, and the values are shares
    from 0 to 1. If the training image has other layers, `reference_at` gives the elevations of
    these layers. Each disc shows the hard data of a layer; more data give a larger disc.
    """
    chart = blank_chart(theme, height=height, x_title=x_title, y_title=y_title)
    shares = ("reference", "each", "low", "median", "high")
    percent = replace(bundle, **{name: 100 * getattr(bundle, name) for name in shares})
    position = f"{written(y_title)} %{{y:.4g}}: %{{x:.1f}} %"
    median = _median(percent, "median", theme.ink, 1.5)
    traces = [_band(percent, "5–95 %", theme.band), _threads(percent, theme), median]
    for trace in traces:
        trace.update(x=trace.y, y=trace.x)
    median.update(hovertemplate=f"median, {position}<extra></extra>")
    elevations = bundle.lags if reference_at is None else reference_at
    hover = f"training image, {position}<extra></extra>"
    traces.append(
        line(
            "training image", percent.reference, elevations, theme.reference, 2, hovertemplate=hover
        )
    )
    if data is not None and len(data.at):
        sizes = MAX_DISC * np.sqrt(data.count / data.count.max())
        marks = dots("hard data", 100 * data.share, data.at, theme.paper, sizes)
        marks.update(marker={"line": {"width": 1.2, "color": theme.ink}}, customdata=data.count)
        hover = f"%{{customdata}} hard data, {position}<extra></extra>"
        traces.append(marks.update(hovertemplate=hover, cliponaxis=False))
    chart.add_traces(traces)
    step = float(bundle.lags[1] - bundle.lags[0]) if len(bundle.lags) > 1 else 1.0
    chart.update_yaxes(range=[bundle.lags[0] - step / 2, bundle.lags[-1] + step / 2])
    ends = [percent.each, percent.reference, 100 * data.share if data is not None else 0.0]
    largest = max(float(np.max(values, initial=0.0)) for values in ends)
    chart.update_xaxes(range=[0, min(1.08 * largest, 100.0) or 100.0], nticks=5)
    return chart


def geobody_sizes_chart(bundle: Bundle, theme: Theme, *, y_title: str) -> go.Figure:
    """Return a chart of the share of a facies in geobodies of at least n cells (the lags)."""
    chart = curves_chart(
        bundle, theme, y_title=y_title, x_title="cells or more", y_range=(0, 1.04), height=230
    )
    ends = [0.0, float(np.log10(max(bundle.lags[-1], 10.0)))]
    return chart.update_xaxes(type="log", range=ends, dtick=1, exponentformat="SI")


def repetition_chart(
    lags: Integers,
    east_west: Floats,
    north_south: Floats,
    marks: Mapping[str, int],
    theme: Theme,
) -> go.Figure:
    """Return a chart of the autocorrelation of a training image, with marked lengths.

    The correlation is 1 at lag 0, about 0 for independent cells, and peaks at the distance
    between repeated features. `marks` maps names to lengths in cells, such as {"T 32": 32}.
    """
    chart = blank_chart(
        theme, height=250, x_title="lag (cells)", y_title="correlation", hovermode=UNIFIED
    )
    for name, values, dash in (("E–W", east_west, "solid"), ("N–S", north_south, "dash")):
        chart.add_trace(
            line(name, lags, values, theme.reference, 2, dash=dash, hovertemplate="%{y:.2f}")
        )
    chart.add_hline(y=0, line={"color": theme.hairline, "width": 1})
    for name, length in marks.items():
        label = {"text": written(name), "font": {"size": 12, "color": theme.ink}}
        style = {"color": theme.ink, "width": 1, "dash": "dot"}
        chart.add_vline(x=length, line=style, annotation=label)
    low = min(float(np.min(east_west)), float(np.min(north_south)), 0.0)
    chart.update_yaxes(range=[1.1 * low - 0.05, 1.05])
    farthest = max([float(lags[-1]), *(1.08 * float(length) for length in marks.values())])
    chart.update_xaxes(range=[0, farthest])
    return chart


def sparkline(curves: ArrayLike, reference: ArrayLike, theme: Theme) -> bytes:
    """Return a square SVG picture of curves with common lags; the y axis starts at zero.

    The realizations' `curves` have shape (n, n_lags); `reference` is the training image's curve.
    """
    every = [*np.asarray(curves, float), np.asarray(reference, float)]
    top = max(float(np.nanmax(curve)) for curve in every) or 1.0
    thin = f'stroke="{theme.each}" stroke-width="0.8"'
    thick = f'stroke="{theme.reference}" stroke-width="1.6"'
    lines = [_polyline(curve, top, thin) for curve in every[:-1]]
    lines.append(_polyline(every[-1], top, thick))
    view_box = f"0 0 {SPARKLINE_SIDE} {SPARKLINE_SIDE}"
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{view_box}" fill="none">'
        f"{''.join(lines)}</svg>"
    ).encode()


def _polyline(curve: np.ndarray, top: float, stroke: str) -> str:
    room = SPARKLINE_SIDE - 2 * SPARKLINE_MARGIN
    x = SPARKLINE_MARGIN + room * np.arange(len(curve)) / max(len(curve) - 1, 1)
    y = SPARKLINE_SIDE - SPARKLINE_MARGIN - room * curve / top
    finite = np.isfinite(y)
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x[finite], y[finite], strict=True))
    return f'<polyline points="{points}" {stroke}/>'


def _median(bundle: Bundle, name: str, colour: str, width: float, dash: str | None = None) -> Any:
    hover = "%{y:.3g}"
    return line(name, bundle.lags, bundle.median, colour, width, dash=dash, hovertemplate=hover)


def _band(bundle: Bundle, name: str, colour: str) -> Any:
    x = np.concatenate([bundle.lags, bundle.lags[::-1]])
    y = np.concatenate([bundle.high, bundle.low[::-1]])
    return line(name, x, y, colour, 0, fill="toself", fillcolor=colour)


def _threads(bundle: Bundle, theme: Theme) -> Any:
    """Return all realizations as one trace with gaps, because many traces would be slow."""
    n = len(bundle.each)
    # float32 is exact for integer lags and needs half the memory
    x = np.tile(np.append(bundle.lags, np.nan).astype(np.float32), n)
    y = np.hstack([bundle.each, np.full((n, 1), np.nan)]).ravel()
    return line("realizations", x, y, theme.each, 0.8)
