"""Style of all charts in a light and a dark theme, with the colours of facies and of settings."""

import colorsys
import re
import zlib
from base64 import b64encode
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from html import escape
from types import MappingProxyType
from typing import Any

import numpy as np
import plotly.colors
import plotly.graph_objects as go
from numpy.typing import ArrayLike
from plotly.offline import get_plotlyjs

from ccwsim import CCWSIMError, HardData, TrainingImage
from ccwsim.model import UNKNOWN, Bytes, Floats, read_toml, with_power

FACIES = ("#173F6B", "#F0AD2E", "#3A9E7E", "#A63A26", "#A78BD0", "#D5D8DC")
"""Default facies colours: deep blue, amber, green, brick, violet and grey. They are distinct for
the three common types of colour blindness and, except green and violet, in grey-scale print."""
GOLDEN_ANGLE = 0.381966
# ticks per decade of a logarithmic axis; the first that give three ticks or more are used
LOG_STEPS = [
    *([1], [1, 3], [1, 2, 5]),
    *(np.arange(1, 10, step) for step in (1, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01)),
]
HEX = re.compile(r"#[0-9a-fA-F]{6}")
CIVIDIS = tuple(plotly.colors.sequential.Cividis)  # the cividis ramp, used for probabilities
N_STEPS = 200
"""Number of colour steps of a map of numbers; shares of 200 realizations are not rounded."""
VALUE_COLOURS = tuple(plotly.colors.sequential.Viridis)  # for values of a continuous variable
ENTROPY = ("#F3EEF8", "#C9B4DE", "#8E6BB5", "#5B3788", "#33145C")
"""Colours of the one-hue ramp for entropy; cells without uncertainty are pale."""
FONT = '"Source Sans", "Source Sans 3", "Source Sans Pro", "Segoe UI", sans-serif'
CLEAR = "rgba(0,0,0,0)"
DASHES = ("solid", "dash", "dot", "dashdot")
MARKER_SYMBOLS = (
    "circle",
    "square",
    "triangle-up",
    "cross",
)  # like `DASHES`, of four compared settings


@dataclass(frozen=True)
class Theme:
    """Colours of the parts of a chart; facies colours do not depend on the theme."""

    ink: str
    quiet: str
    hairline: str
    paper: str
    reference: str
    each: str
    band: str
    settings: tuple[str, ...]  # four compared settings
    difference: tuple[str, str, str]  # negative, zero and positive differences


_LOOK = read_toml("figures/look.toml")
_LISTS = ("settings", "difference")
LIGHT, DARK = (
    Theme(**_LOOK[name] | {part: tuple(_LOOK[name][part]) for part in _LISTS})
    for name in ("light", "dark")
)


def facies_colours(
    training_image: TrainingImage, chosen: Mapping[int, str] | None = None
) -> list[str]:
    """Return the colour of each facies, or of each class of values, in the order of the codes.

    `chosen` maps facies codes to the user's colours. Raises `CCWSIMError` for a colour that is not
    written as "#rrggbb".
    """
    chosen = chosen or {}
    codes = training_image.codes.tolist()
    usual = [default_colour(k) for k in range(len(codes))]
    if training_image.values:  # the colour of the median of a class on the scale of values
        low, high = training_image.sorted_values[[0, -1]].tolist()
        medians = np.array(training_image.class_medians)
        steps, scale = steps_of(medians, (low, high), VALUE_COLOURS)
        usual = [scale[step] for step in steps.tolist()]
    colours = [chosen.get(code, colour) for code, colour in zip(codes, usual, strict=True)]
    for colour in colours:
        if not HEX.fullmatch(colour):
            raise CCWSIMError(f'colour "{colour}" must be written as #rrggbb, like #173F6B')
    return colours


def default_colour(index: int) -> str:
    """Return the default colour of facies `index`; from the seventh facies on, the hue rotates."""
    if index < len(FACIES):
        return FACIES[index]
    hue = (index * GOLDEN_ANGLE) % 1.0
    rgb = colorsys.hls_to_rgb(hue, (0.35, 0.65, 0.5)[index % 3], 0.55)
    return "#" + "".join(f"{round(255 * c):02X}" for c in rgb)


def bytes_of(colours: Sequence[str]) -> list[tuple[int, int, int]]:
    """Convert colours "#rrggbb" to (red, green, blue) with values from 0 to 255."""
    return [(int(c[1:3], 16), int(c[3:5], 16), int(c[5:7], 16)) for c in colours]


def with_opacity(colour: str, opacity: float) -> str:
    """Return a colour "#rrggbb" with an opacity."""
    red, green, blue = bytes_of([colour])[0]
    return f"rgba({red}, {green}, {blue}, {opacity:g})"


def ramp(steps: Sequence[str], n: int) -> list[str]:
    """Return `n` evenly spaced colours of the colour ramp that interpolates the colours `steps`."""
    rgb = bytes_of(steps)
    colours = []
    for k in range(n):
        position = k / max(n - 1, 1) * (len(rgb) - 1)
        low = min(int(position), len(rgb) - 2)
        share = position - low
        mixed = [round(a + share * (b - a)) for a, b in zip(rgb[low], rgb[low + 1], strict=True)]
        colours.append("#" + "".join(f"{c:02X}" for c in mixed))
    return colours


def steps_of(
    numbers: Floats,
    limits: tuple[float, float] = (0.0, 1.0),
    colours: tuple[str, ...] = CIVIDIS,
) -> tuple[Bytes, list[str]]:
    """Convert numbers between limits, or NaN, to indices of the colours of a ramp; return both."""
    low, high = limits
    valid = ~np.isnan(numbers)  # inactive cells have no colour
    shares = np.clip((numbers[valid] - low) / ((high - low) or 1.0), 0.0, 1.0)
    steps = np.full(numbers.shape, UNKNOWN, np.uint8)
    steps[valid] = np.rint(shares * N_STEPS)
    return steps, _cached_ramp(colours, N_STEPS + 1)


_cached_ramp = cache(ramp)


def value_limits(image: TrainingImage, data: HardData) -> tuple[float, float]:
    """Return the smallest and the largest value of an image of a continuous variable and data."""
    values = np.append(image.sorted_values[[0, -1]], data.values.get(image.variable, ()))
    return float(values.min()), float(values.max())


def value_steps(values: Floats, image: TrainingImage, data: HardData) -> tuple[Bytes, list[str]]:
    """Return indices of the colours of values of a continuous variable, and the colours."""
    return steps_of(values, value_limits(image, data), VALUE_COLOURS)


def written(text: str) -> str:
    """Return a text for a chart, with HTML tags, HTML entities and %{...} escaped."""
    return escape(text, quote=False).replace("%{", "%&#123;")


def as_written(texts: Iterable[str]) -> list[str]:
    """Return texts for a chart, each escaped by `written`."""
    return [written(text) for text in texts]


def blank_chart(
    theme: Theme,
    *,
    height: int,
    x_title: str,
    y_title: str,
    traces: Sequence[Any] = (),
    x: Mapping[str, Any] = MappingProxyType({}),
    y: Mapping[str, Any] = MappingProxyType({}),
    **more: Any,
) -> go.Figure:
    """Return a chart with a transparent background; HTML tags in titles are escaped.

    `traces`, options `x` and `y` of the axes and `more` of the layout are not validated.
    """
    quiet = {"size": 12, "color": theme.quiet}
    axis = {**_LOOK["axis"], "linecolor": theme.quiet, "tickcolor": theme.quiet, "tickfont": quiet}
    titles = ({"text": written(t), "font": quiet, "standoff": 6} for t in (x_title, y_title))
    x_axis, y_axis = ({**axis, "title": title} for title in titles)
    layout = {
        **_LOOK["chart"],
        "height": height,
        "margin": {"l": 8, "r": 12, "t": 8, "b": 8},
        "font": {"family": FONT, "size": 13, "color": theme.ink},
        "modebar": {"bgcolor": CLEAR, "color": theme.quiet, "activecolor": theme.ink},
        "hoverlabel": {"font": {"size": 13}, "bgcolor": theme.paper, "bordercolor": theme.hairline},
        "xaxis": {**x_axis, **x},
        "yaxis": {**y_axis, "nticks": 5, **y},
        **more,
    }
    # skip plotly's validation, which would take ten times as long as the chart itself
    return go.Figure(list(traces), layout, _validate=False)


def log_axis(start: float, end: float) -> dict[str, Any]:
    """Return a logarithmic axis from 10^start to 10^end; each tick has its whole number.

    There is no tick at the very end, where a number would be cut off.
    """
    low, high = 10.0**start, 10.0 ** (end - 0.04 * (end - start))
    decades = 10.0 ** np.arange(np.floor(start), np.ceil(end) + 1)
    each = (np.outer(decades, steps).ravel() for steps in LOG_STEPS)
    shown = [ticks[(ticks >= low) & (ticks <= high)].tolist() for ticks in each]
    ticks = next((ticks for ticks in shown if len(ticks) > 2), shown[-1])
    return {
        "type": "log",
        "range": [start, end],
        "tickvals": ticks,
        "ticktext": [with_power(tick, 6) for tick in ticks],
    }


def line(name: str, x: ArrayLike, y: ArrayLike, colour: str, width: float, **more: Any) -> Any:
    """Return a plotly line with an escaped name, without hover text; `more` is passed to plotly."""
    more = {"mode": "lines", "hoverinfo": "skip", **more}
    if "hovertemplate" in more:
        del more["hoverinfo"]
    style = {"color": colour, "width": width}
    if dash := more.pop("dash", None):
        style["dash"] = dash
    return _scatter(name=written(name), x=x, y=y, line=style, **more)


def dots(name: str, x: ArrayLike, y: ArrayLike, colour: Any, size: Any, **more: Any) -> Any:
    """Return a plotly trace of points with an escaped name; `more` is passed to plotly."""
    marker = {"size": size, **more.pop("marker", {})}
    if colour is not None:
        marker["color"] = colour
    return _scatter(name=written(name), x=x, y=y, mode="markers", marker=marker, **more)


def _scatter(**options: Any) -> Any:
    """Return a trace; only later changes of the trace are validated."""
    trace = go.Scatter(_validate=False, **options)
    trace._validate = True
    return trace


def rows_axis(
    theme: Theme, names: Sequence[str], ends: tuple[float, float], positions: Any = None
) -> dict[str, Any]:
    """Return the options of a y axis with the names of rows, without an axis line."""
    return {
        "tickvals": list(range(len(names))) if positions is None else positions,
        "ticktext": list(names),
        "range": list(ends),
        "showline": False,
        "ticks": "",
        "tickfont": {"size": 13, "color": theme.ink},
    }


def figure_json(figure: go.Figure) -> str:
    """Return a figure as JSON for plotly's JavaScript library, without plotly's template."""
    bare = go.Figure(figure).update_layout(template="none")
    bare.layout.template = None
    return str(bare.to_json())


@cache
def packed_plotly() -> str:
    """Return plotly's JavaScript library, compressed from 5 to 2 MB and encoded in base64."""
    return b64encode(zlib.compress(get_plotlyjs().encode(), 9)).decode()


def mixed(colour: str, ground: str, share: float) -> str:
    """Return a colour mixed with a share of another colour."""
    return ramp([colour, ground], 101)[round(100 * share)]
