"""Charts of flow through realizations: effective conductivity and breakthrough."""

from collections.abc import Mapping

import numpy as np
import plotly.graph_objects as go

from ccwsim.figures.style import Theme, blank_chart, line, log_axis, written
from ccwsim.model import Floats, with_power

N_BINS = 16


def conductivity_chart(
    each: Floats, marks: Mapping[str, tuple[float, str]], theme: Theme, *, unit: str, height: int
) -> go.Figure:
    """Return a histogram of the effective conductivity of realizations, on a logarithmic axis.

    `marks` maps the name of each vertical line, such as a bound, to its value and colour.

    Examples
    --------
    >>> from ccwsim.figures import LIGHT
    >>> marks = {"image": (2.0, "#C8321F")}
    >>> options = {"unit": "m/s", "height": 230}
    >>> [t.name for t in conductivity_chart(np.ones(3), marks, LIGHT, **options).data]
    ['realizations', 'image']
    """
    chart = blank_chart(
        theme, height=height, x_title=f"effective K ({unit})", y_title="realizations"
    )
    low, high = np.log10(each.min()) - 0.02, np.log10(each.max()) + 0.02
    counts, edges = np.histogram(np.log10(each), N_BINS, (low, high))
    bars = go.Bar(
        x=10 ** ((edges[1:] + edges[:-1]) / 2), y=counts, width=np.diff(10**edges),
        name="realizations", marker_color=theme.quiet,
        hovertext=[with_power(k) for k in 10 ** ((edges[1:] + edges[:-1]) / 2)],
        hovertemplate="%{hovertext}: %{y} realizations<extra></extra>",
    )  # fmt: skip
    chart.add_trace(bars)
    top = 2.0 * counts.max()  # leaves room for the names of lines above the bars
    for name, (value, colour) in marks.items():
        hover = f"{written(name)}: {with_power(value)}<extra></extra>"
        chart.add_trace(line(name, [value] * 2, [0, top], colour, 2, hovertemplate=hover))
        chart.add_annotation(
            x=np.log10(value), y=top, text=written(name), showarrow=False, textangle=-90,
            xanchor="right", yanchor="top", font={"size": 12, "color": colour},
        )  # fmt: skip
    values = np.log10([*(value for value, _ in marks.values()), *each])
    margin = 0.06 * np.ptp(values) + 0.02
    chart.update_xaxes(log_axis(values.min() - margin, values.max() + margin))
    chart.update_yaxes(range=[0, top], tick0=0, dtick=max(1, int(counts.max()) // 3))
    return chart


def breakthrough_chart(
    days: Floats, shown: int, theme: Theme, *, height: int, accent: str
) -> go.Figure:
    """Return a chart of the share of arrived particles against time, by realization.

    `days` are sorted travel times, shape (n, m), inf for particles that do not arrive. The curve
    of realization `shown` is drawn in the colour `accent`.

    Examples
    --------
    >>> from ccwsim.figures import LIGHT
    >>> times = np.array([[1.0, 2.0], [3.0, np.inf]])
    >>> chart = breakthrough_chart(times, 1, LIGHT, height=230, accent="#C8321F")
    >>> [trace.name for trace in chart.data]
    ['realizations', 'realization 2']
    """
    chart = blank_chart(theme, height=height, x_title="travel time (days)", y_title="arrived (%)")
    shares = 100 * (np.arange(days.shape[1]) + 0.5) / days.shape[1]
    arrivals = np.where(np.isfinite(days), days, np.nan)
    x = np.hstack([arrivals, np.full((len(days), 1), np.nan)]).ravel()
    chart.add_trace(line("realizations", x, np.tile([*shares, np.nan], len(days)), theme.each, 1))
    if 0 <= shown < len(days):
        hover = "%{text} days: %{y:.0f} % arrived<extra></extra>"
        name, of_shown = f"realization {shown + 1}", arrivals[shown]
        texts = list(map(with_power, of_shown))
        chart.add_trace(line(name, of_shown, shares, accent, 2, text=texts, hovertemplate=hover))
    arrived = np.log10(days[np.isfinite(days) & (days > 0)])
    if len(arrived):
        chart.update_xaxes(log_axis(arrived.min() - 0.05, arrived.max() + 0.05))
    chart.update_yaxes(range=[0, 100])
    return chart
