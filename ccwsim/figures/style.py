"""Style of all charts (typeface, thin lines, transparent background) in a light and a dark theme.

The module also defines the colours and symbols of compared settings, and converts charts to JSON.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from html import escape
from typing import Any

import plotly.graph_objects as go
from numpy.typing import ArrayLike
from plotly.offline import get_plotlyjs

from ccwsim.figures.palette import DIFFERENCE, DIFFERENCE_ON_INK

FONT = '"Source Sans", "Source Sans 3", "Source Sans Pro", "Segoe UI", sans-serif'
CLEAR = "rgba(0,0,0,0)"
ON_PAPER = ("#1B1F24", "#0072B2", "#00805C", "#9A5CB4")
ON_INK = ("#ECE9E2", "#56B4E9", "#2FC39B", "#D39BE6")
DASHES = ("solid", "dash", "dot", "dashdot")
SYMBOLS = ("circle", "square", "triangle-up", "cross")
"""Colours (in two themes), dashes and symbols of four compared settings."""


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


LIGHT = Theme(
    ink="#1B1F24",
    quiet="#5B646E",
    hairline="#DCD9D2",
    paper="#FBFAF7",
    reference="#C8321F",
    each="rgba(60, 68, 78, 0.30)",
    band="rgba(60, 68, 78, 0.13)",
)
DARK = Theme(
    ink="#ECE9E2",
    quiet="#A3A9B1",
    hairline="#333A43",
    paper="#12161B",
    reference="#FF7A5C",
    each="rgba(214, 218, 224, 0.26)",
    band="rgba(214, 218, 224, 0.13)",
)


def theme_named(name: str | None) -> Theme:
    """Return the dark theme for "dark" and the light theme for other names."""
    return DARK if name == "dark" else LIGHT


def setting_colours(theme: Theme) -> tuple[str, ...]:
    """Return the colours "#rrggbb" of four compared settings.

    Examples
    --------
    >>> setting_colours(DARK)[1]
    '#56B4E9'
    """
    return ON_INK if theme == DARK else ON_PAPER


def difference_colours(theme: Theme) -> tuple[str, str, str]:
    """Return the colours of negative, zero (background colour) and positive differences.

    Examples
    --------
    >>> difference_colours(LIGHT) == DIFFERENCE
    True
    """
    return DIFFERENCE_ON_INK if theme == DARK else DIFFERENCE


def written(text: str) -> str:
    """Return a text for a chart, with HTML tags, HTML entities and %{...} escaped.

    Examples
    --------
    >>> written("sand"), written("<b>mud"), written("%{x}")
    ('sand', '&lt;b&gt;mud', '%&#123;x}')
    """
    return escape(text, quote=False).replace("%{", "%&#123;")


def as_written(texts: Iterable[str]) -> list[str]:
    """Return texts for a chart, each escaped by `written`.

    Examples
    --------
    >>> as_written(["sand", "<b>mud"])
    ['sand', '&lt;b&gt;mud']
    """
    return [written(text) for text in texts]


def blank_chart(theme: Theme, *, height: int, x_title: str, y_title: str) -> go.Figure:
    """Return an empty chart with a transparent background; titles are shown as written."""
    axis = {
        "showgrid": False,
        "zeroline": False,
        "linecolor": theme.quiet,
        "linewidth": 1,
        "ticks": "outside",
        "ticklen": 4,
        "tickcolor": theme.quiet,
        "tickfont": {"size": 12, "color": theme.quiet},
        "title": {"font": {"size": 12, "color": theme.quiet}, "standoff": 6},
        "fixedrange": True,
        "automargin": True,
    }
    label = {"bgcolor": theme.paper, "bordercolor": theme.hairline, "font": {"size": 13}}
    layout = {
        "height": height,
        "margin": {"l": 8, "r": 12, "t": 8, "b": 8},
        "paper_bgcolor": CLEAR,
        "plot_bgcolor": CLEAR,
        "font": {"family": FONT, "size": 13, "color": theme.ink},
        "showlegend": False,
        "modebar": {"bgcolor": CLEAR, "color": theme.quiet, "activecolor": theme.ink},
        "hovermode": "x unified",
        "hoverlabel": label,
        "xaxis": {**axis, "title": {**axis["title"], "text": written(x_title)}},
        "yaxis": {**axis, "nticks": 5, "title": {**axis["title"], "text": written(y_title)}},
    }
    # skip plotly's validation, which would take ten times as long as the chart itself
    return go.Figure(layout=layout, _validate=False)


def line(name: str, x: ArrayLike, y: ArrayLike, colour: str, width: float, **more: Any) -> Any:
    """Return a plotly trace of a line without hover text; `more` is passed to plotly.

    The name of the trace is escaped.
    """
    more = {"mode": "lines", "hoverinfo": "skip", **more}
    if "hovertemplate" in more:
        del more["hoverinfo"]
    style = {"color": colour, "width": width, "dash": more.pop("dash", None)}
    return go.Scatter(name=written(name), x=x, y=y, line=style, **more)


def dots(name: str, x: ArrayLike, y: ArrayLike, colour: Any, size: Any, **more: Any) -> Any:
    """Return a plotly trace of points with an escaped name; `more` is passed to plotly."""
    return go.Scatter(
        name=written(name),
        x=x,
        y=y,
        mode="markers",
        marker_color=colour,
        marker_size=size,
        **more,
    )


def name_rows(
    chart: go.Figure, theme: Theme, names: Sequence[str], ends: tuple[float, float], at: Any = None
) -> None:
    """Write the names of the rows of a chart on its y axis, without an axis line."""
    chart.update_yaxes(
        tickvals=list(range(len(names))) if at is None else at,
        ticktext=list(names),
        range=ends,
        showline=False,
        ticks="",
        tickfont={"size": 13, "color": theme.ink},
    )


def figure_json(figure: go.Figure) -> str:
    """Return a figure as JSON for plotly's JavaScript library, without plotly's template.

    Examples
    --------
    >>> figure_json(go.Figure())
    '{"data":[],"layout":{}}'
    """
    bare = go.Figure(figure).update_layout(template="none")
    bare.layout.template = None
    return str(bare.to_json())


@cache
def plotly_script() -> str:
    """Return plotly's JavaScript library, which a page must contain once.

    Examples
    --------
    >>> len(plotly_script()) > 1_000_000
    True
    """
    return get_plotlyjs()
