"""Transiograms: one small chart a pair of facies, tails in rows and heads in columns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, cast

import plotly.graph_objects as go
from plotly.subplots import make_subplots

from ccwsim.figures.curves import Bundle, curves_chart
from ccwsim.figures.names import as_written
from ccwsim.figures.style import Theme, blank_chart

ROW_HEIGHT = 172


def transiogram_chart(
    bundles: Mapping[tuple[int, int], Bundle],
    tails: Sequence[int],
    heads: Sequence[int],
    names: Sequence[str],
    theme: Theme,
) -> go.Figure:
    """Return P(head at x + h | tail at x) of the realizations against the training image.

    Parameters
    ----------
    bundles : mapping
        By (tail, head), places in `names`.
    tails, heads : sequence of int
        Which facies have a row and a column.
    names : sequence of str
        Of all facies.
    theme : Theme
    """
    names = as_written(names)
    titles = [f"{names[tail]} → {names[head]}" for tail in tails for head in heads]
    chart = make_subplots(
        len(tails), len(heads), subplot_titles=titles, shared_xaxes=True, shared_yaxes=True,
        horizontal_spacing=0.03, vertical_spacing=0.28 / (len(tails) + 1),
    )  # fmt: skip
    blank = blank_chart(theme, height=40 + ROW_HEIGHT * len(tails), x_title="", y_title="").layout
    axes = {"xaxis", "yaxis"}
    layout = {k: v for k, v in blank.to_plotly_json().items() if k not in axes}
    chart.update_layout(**layout, margin_t=28)
    for axis, update in (("xaxis", chart.update_xaxes), ("yaxis", chart.update_yaxes)):
        update(**blank[axis].to_plotly_json())
    for row, tail in enumerate(tails, 1):
        for column, head in enumerate(heads, 1):
            pair = f"{names[tail]} → {names[head]}"
            drawn = cast(Any, curves_chart(bundles[tail, head], theme, y_title=""))
            for trace in drawn.data:
                chart.add_trace(trace.update(name=f"{pair}, {trace.name}"), row, column)
    longest = max(float(bundle.lags[-1]) for bundle in bundles.values())
    chart.update_xaxes(range=[0, longest], title_text="")
    chart.update_xaxes(title_text="lag (cells)", row=len(tails))
    chart.update_yaxes(range=[0, 1.03], nticks=4, title_text="")
    chart.update_yaxes(title_text="probability", col=1)
    return chart.update_annotations(font={"size": 13, "color": theme.ink})
