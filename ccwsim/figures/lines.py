"""Lines of several methods in one chart, each in its own colour and dash."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from ccwsim.figures.style import Theme, blank_chart


@dataclass(frozen=True, eq=False)
class Line:
    """One line.

    Attributes
    ----------
    name : str
    x, y : ndarray
    colour : str
    dash : str
        "solid", "dash" or "dot"; "none" draws the points alone.
    points : bool
        Whether each value is marked.
    """

    name: str
    x: NDArray
    y: NDArray
    colour: str
    dash: str = "solid"
    points: bool = False


def lines_chart(
    lines: Sequence[Line],
    theme: Theme,
    *,
    x_title: str,
    y_title: str,
    y_range: tuple[float, float] | None = None,
    logarithmic: bool = False,
    height: int = 230,
) -> go.Figure:
    """Return the chart of some lines.

    Examples
    --------
    >>> from ccwsim.figures.style import LIGHT
    >>> line = Line("a", np.arange(3), np.arange(3), "#173F6B")
    >>> chart = lines_chart([line], LIGHT, x_title="x", y_title="y", y_range=(0, 2))
    >>> chart.data[0].name
    'a'
    """
    chart = blank_chart(theme, height=height, x_title=x_title, y_title=y_title)
    for line in lines:
        mode = "markers" if line.dash == "none" else "lines+markers" if line.points else "lines"
        chart.add_trace(
            go.Scatter(
                x=line.x, y=line.y, name=line.name, mode=mode,
                line={"color": line.colour, "width": 1.8,
                      "dash": "solid" if line.dash == "none" else line.dash},
                marker={"color": line.colour, "size": 8,
                        "symbol": "diamond" if line.dash == "none" else "circle"},
                hovertemplate=f"{line.name}: %{{y:.3g}}<extra></extra>",
            )
        )  # fmt: skip
    if logarithmic:
        chart.update_xaxes(type="log", dtick=1)
        chart.update_yaxes(type="log", dtick=1)
    if y_range is not None:
        chart.update_yaxes(range=[np.log10(v) for v in y_range] if logarithmic else list(y_range))
    return chart
