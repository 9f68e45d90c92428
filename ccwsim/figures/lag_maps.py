"""Variogram maps: γ of all lags in the plane, of the image, the realizations, and both compared."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from ccwsim.figures.palette import CIVIDIS
from ccwsim.figures.style import Theme, blank_chart

DIFFERENCE = ("#2C6FB0", "#F4F2ED", "#B5452C")
"""Below zero, zero and above zero of a difference."""


def lag_map_chart(
    lags: NDArray[np.integer],
    values: NDArray[np.float64],
    theme: Theme,
    *,
    name: str,
    largest: float,
    azimuth: float | None = None,
    difference: bool = False,
    height: int = 330,
) -> go.Figure:
    """Return a map of a statistic over all lags, lag 0 in the middle, north at the top.

    Parameters
    ----------
    lags : ndarray of int, shape (m,)
        −m … m, of the rows and the columns.
    values : ndarray, shape (m, m)
    theme : Theme
    name : str
        What the values are, for the hover, such as "γ of sand".
    largest : float
        End of the colours, which start at 0, or at −largest for a difference.
    azimuth : float, optional
        A direction to mark by a line, in degrees from north.
    difference : bool
        Colours that part at zero.
    """
    chart = blank_chart(theme, height=height, x_title="lag E (cells)", y_title="lag N (cells)")
    chart.add_trace(
        go.Heatmap(
            x=lags, y=lags, z=values.astype(np.float32), name=name,
            zmin=-largest if difference else 0.0, zmax=largest,
            colorscale=_scale(DIFFERENCE if difference else CIVIDIS),
            colorbar={
                "thickness": 9, "outlinewidth": 0, "len": 1.0, "nticks": 5, "x": 1.02,
                "tickfont": {"size": 11, "color": theme.quiet},
            },
            hovertemplate=f"%{{x}} E, %{{y}} N: {name} = %{{z:.3g}}<extra></extra>",
        )
    )  # fmt: skip
    if azimuth is not None:
        chart.add_trace(_line(azimuth, float(lags[-1]), theme))
    reach = [float(lags[0]) - 0.5, float(lags[-1]) + 0.5]
    chart.update_xaxes(range=reach, constrain="domain", constraintoward="right", nticks=5)
    chart.update_yaxes(range=reach, scaleanchor="x", constrain="domain", nticks=5)
    return chart.update_layout(hovermode="closest")


def _line(azimuth: float, reach: float, theme: Theme) -> go.Scatter:
    angle = np.deg2rad(azimuth)
    along = reach * np.array([-1.0, 1.0])
    return go.Scatter(
        x=along * np.sin(angle), y=along * np.cos(angle), name="direction", mode="lines",
        line={"color": theme.reference, "width": 2, "dash": "dot"}, hoverinfo="skip",
    )  # fmt: skip


def _scale(colours: tuple[str, ...]) -> list[list[float | str]]:
    return [[k / (len(colours) - 1), colour] for k, colour in enumerate(colours)]
