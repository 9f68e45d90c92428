"""Charts of CPU time by realization, by setting, and by number of grid cells."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import plotly.graph_objects as go

from ccwsim.figures import style
from ccwsim.model import Floats

BAR_HEIGHT = 40  # height in pixels of a bar including the space above and below the bar
LEVEL_SYMBOLS = ("x", "circle", "square", "diamond", "triangle-up", "star", "pentagon")
"""Symbols of measured and published times, by wavelet level."""
LABEL_GAP = 15  # minimum distance between two labels in pixels
EMPTY_DECADES = 4.0  # decades shown below the published times while no time has been measured


def times_chart(
    milliseconds: Floats, mean: float, theme: style.Theme, *, height: int = 196
) -> go.Figure:
    """Return a chart with the CPU time of each realization as a dot, and the mean as a line."""
    n, ends = len(milliseconds), [0.5, len(milliseconds) + 0.5]
    numbers, size = np.arange(1, n + 1), 7 if n <= 30 else 4
    top = 1.15 * float(milliseconds.max(initial=mean)) or 1.0
    return style.blank_chart(
        theme,
        height=height,
        traces=[
            style.line("mean", ends, [mean, mean], theme.quiet, 1, dash="dot"),
            style.dots(
                "realization",
                numbers,
                milliseconds,
                theme.ink,
                size,
                hovertemplate="realization %{x}: %{y:.3r} ms<extra></extra>",
            ),
        ],
        x={"range": ends, "nticks": min(n + 1, 6), "tickformat": "d"},
        y={"exponentformat": "none", "range": [0, top]},
        x_title="realization",
        y_title="CPU time (ms)",
    )


def compared_times_chart(
    settings: Mapping[str, Floats], means: Floats, labels: Sequence[str], theme: style.Theme
) -> go.Figure:
    """Return a chart with a bar for the mean time (ms) of each setting, a dot per realization."""
    n, x_title = len(settings), "CPU time of a realization (ms)"
    chart = style.blank_chart(theme, height=64 + BAR_HEIGHT * n, x_title=x_title, y_title="")
    colours = theme.settings[:n]
    bars = go.Bar(x=means, y=list(range(n)), orientation="h", width=0.6, name="mean")
    bars.update(
        marker_color=[style.with_opacity(colour, 0.35) for colour in colours],
        marker_line={"color": list(colours), "width": 1},
        hovertemplate="mean: %{x:.3r} ms<extra></extra>",
    )
    chart.add_trace(bars)
    for row, (name, each) in enumerate(settings.items()):
        trace = style.dots(name, each, [row] * len(each), colours[row], 6, cliponaxis=False)
        trace.update(
            marker_opacity=0.7, hovertemplate=f"{trace.name}: %{{x:.3g}} ms<extra></extra>"
        )
        chart.add_trace(trace)
        chart.add_annotation(
            text=style.written(labels[row]),
            showarrow=False,
            font={"size": 13, "color": theme.ink},
            x=float(each.max(initial=0)),
            y=row,
            xanchor="left",
            xshift=8,
        )
    chart.update_yaxes(**style.rows_axis(theme, style.as_written(settings), (n - 0.4, -0.6)))
    largest = max(float(each.max(initial=1e-9)) for each in settings.values())
    chart.update_xaxes(range=[0, 1.45 * largest], nticks=5, exponentformat="none")
    return chart


@dataclass(frozen=True)
class TimeSeries:
    """CPU times of one setting for several sizes: of the grid or of another quantity."""

    name: str
    level: int  # wavelet level, which determines the marker
    sizes: Floats  # shape (n,): number of cells, or another positive number
    values: Floats  # shape (n,): seconds for each size

    @property
    def symbol(self) -> str:
        """Symbol of the markers for the wavelet level of this series."""
        return LEVEL_SYMBOLS[min(self.level, len(LEVEL_SYMBOLS) - 1)]


def timings_chart(
    measured: Sequence[TimeSeries],
    published: Sequence[TimeSeries],
    ticks: Mapping[int, str],
    theme: style.Theme,
    *,
    x_title: str,
) -> go.Figure:
    """Return a log-log chart of measured times (lines) and published times (open red markers).

    A slope of one means that the time is proportional to the size. `ticks` maps sizes to tick
    labels.
    """
    height = 340
    chart = style.blank_chart(theme, height=height, x_title=x_title, y_title="CPU time (s)")
    for series in measured:
        trace = style.line(series.name, series.sizes, series.values, theme.ink, 1.5)
        trace.update(mode="lines+markers", marker={"symbol": series.symbol, "size": 8})
        chart.add_trace(_hovered(trace, x_title))
    for series in published:
        trace = style.dots(series.name, series.sizes, series.values, theme.reference, 11)
        trace.update(marker={"symbol": f"{series.symbol}-open", "line": {"width": 2}})
        chart.add_trace(_hovered(trace.update(cliponaxis=False), x_title))
    chart.update_xaxes(
        type="log",
        range=np.log10([min(ticks) * 0.7, max(ticks) * 1.5]).tolist(),
        tickangle=0,
        tickmode="array",
        tickvals=list(ticks),
        ticktext=style.as_written(ticks.values()),
    )
    values = [v for series in (*measured, *published) for v in series.values]
    low, high = (np.log10(f(values)) for f in (min, max)) if values else (-2.0, 1.0)
    low = min(low, high - EMPTY_DECADES) if not measured else low
    room = 0.12 * (high - low) + 0.12
    y_range = [low - room, high + 2 * room]
    chart.update_yaxes(type="log", range=y_range, dtick=1, exponentformat="none")
    _label_lines(chart, measured, theme, (height - 60) / (high - low + 3 * room))
    if published:
        _label_published(chart, published, theme)
    return chart


def _hovered(trace: Any, x_title: str) -> Any:
    hover = f"{trace.name}, %{{x:,.0f}} {style.written(x_title)}: %{{y:.3g}} s<extra></extra>"
    return trace.update(hoverinfo=None, hovertemplate=hover)


def _label_lines(
    chart: go.Figure, measured: Sequence[TimeSeries], theme: style.Theme, pixels: float
) -> None:
    """Write the name of each line at its end; move a name down if it overlaps another name."""
    lowest = np.inf
    for series in sorted(measured, key=lambda series: -series.values[-1]):
        end = float(np.log10(series.values[-1])) * pixels
        lowest = min(end, lowest - LABEL_GAP)
        place = {"xanchor": "left", "xshift": 9, "yshift": lowest - end}
        _label(chart, series, series.name, theme.ink, **place)


def _label_published(chart: go.Figure, published: Sequence[TimeSeries], theme: style.Theme) -> None:
    """Label the slowest marker from above; give the other, nearly equal markers one label below."""
    top, *others = sorted(published, key=lambda series: -series.values[-1])
    colour = theme.reference
    _label(chart, top, top.name, colour, xanchor="right", xshift=24, yshift=16)
    if others:
        named = ", ".join(str(level) for level in sorted(series.level for series in others))
        text = f"level{'s' if len(others) > 1 else ''} {named}"
        _label(chart, others[-1], text, colour, xanchor="right", xshift=24, yshift=-16)


def _label(chart: go.Figure, series: TimeSeries, text: str, colour: str, **place: object) -> None:
    x, y = float(np.log10(series.sizes[-1])), float(np.log10(series.values[-1]))
    font = {"size": 13, "color": colour}
    chart.add_annotation(x=x, y=y, text=style.written(text), showarrow=False, font=font, **place)
