"""How charts look: one type, hairlines, transparent ground, for paper and for ink."""

from __future__ import annotations

from dataclasses import dataclass

import plotly.graph_objects as go

FONT = '"Source Sans", "Source Sans 3", "Source Sans Pro", "Segoe UI", sans-serif'


@dataclass(frozen=True)
class Theme:
    """Colours of a chart's own parts; facies colours are the same in every theme."""

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
    """Return the theme "dark", or else the light one."""
    return DARK if name == "dark" else LIGHT


def blank_chart(theme: Theme, *, height: int, x_title: str, y_title: str) -> go.Figure:
    """Return an empty chart: axes with their units, and a ground that shows the page."""
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
    layout = {
        "height": height,
        "margin": {"l": 8, "r": 12, "t": 8, "b": 8},
        "paper_bgcolor": "rgba(0,0,0,0)",
        "plot_bgcolor": "rgba(0,0,0,0)",
        "font": {"family": FONT, "size": 13, "color": theme.ink},
        "showlegend": False,
        "modebar": {"bgcolor": "rgba(0,0,0,0)", "color": theme.quiet, "activecolor": theme.ink},
        "hovermode": "x unified",
        "hoverlabel": {
            "bgcolor": theme.paper, "bordercolor": theme.hairline, "font": {"size": 13},
        },
        "xaxis": {**axis, "title": {**axis["title"], "text": x_title}},
        "yaxis": {**axis, "nticks": 5, "title": {**axis["title"], "text": y_title}},
    }  # fmt: skip
    # plotly takes ten times as long to look over a layout as to make a chart of it
    return go.Figure(layout=layout, _validate=False)
