"""Charts of the facies proportions of realizations and of the training image."""

from collections.abc import Mapping, Sequence

import numpy as np
import plotly.graph_objects as go

from ccwsim.figures.style import (
    MARKER_SYMBOLS,
    Theme,
    as_written,
    blank_chart,
    dots,
    line,
    rows_axis,
)
from ccwsim.model import Floats

LINE = 18  # height in pixels of a line of dots


def proportions_chart(
    names: Sequence[str], reference: Floats, each: Floats, colours: Sequence[str], theme: Theme
) -> go.Figure:
    """Return a chart with a row for each facies: dots for realizations, a red stroke for the image.

    Shares of cells are from 0 to 1. `reference`, shape (n_facies,), are the training image's
    shares; `each`, shape (n, n_facies), are the shares of each realization.
    """
    edge = {"opacity": 0.75, "line": {"width": 0.8, "color": theme.quiet}}
    traces = [
        dots(
            names[k],
            100 * each[:, k],
            [k] * len(each),
            colours[k],
            11,
            hovertemplate=f"{name}: %{{x:.1f}} %<extra></extra>",
            marker=edge,
            cliponaxis=False,
        )
        for k, name in enumerate(as_written(names))
    ]
    traces.append(
        dots(
            "training image",
            100 * reference,
            np.arange(len(names)),
            None,
            20,
            hovertemplate="training image: %{x:.1f} %<extra></extra>",
            marker={"symbol": "line-ns", "line": {"width": 2.5, "color": theme.reference}},
            cliponaxis=False,
        )
    )
    largest = 100 * min(1.0, 1.15 * float(max(reference.max(), each.max())))
    x, y = {"range": [-0.08 * largest, largest]}, (len(names) - 0.4, -0.6)
    return blank_chart(
        theme,
        y_title="",
        traces=traces,
        x=x,
        y=rows_axis(theme, as_written(names), y),
        height=76 + 30 * len(names),
        x_title="cells (%)",
    )


def compared_proportions_chart(
    names: Sequence[str], reference: Floats, settings: Mapping[str, Floats], theme: Theme
) -> go.Figure:
    """Return a chart with a block for each facies, and in it a line of dots for each setting.

    Dots show differences from the training image, and the red stroke at 0 is the training image.
    `settings` maps the name of each setting to its realizations' shares, shape (n, n_facies).
    """
    n, block = len(names), len(settings) + 1
    height = 64 + LINE * n * block
    chart = blank_chart(theme, height=height, x_title="difference (% of cells)", y_title="")
    starts = np.arange(n) * block
    for k, (name, shares) in enumerate(settings.items()):
        x, y = 100 * (shares - reference).ravel(), np.tile(starts + k, len(shares))
        trace = dots(name, x, y, theme.settings[k], 8, cliponaxis=False)
        trace.update(
            marker={"opacity": 0.7, "symbol": MARKER_SYMBOLS[k]}, customdata=100 * shares.ravel()
        )
        chart.add_trace(
            trace.update(hovertemplate=f"{trace.name}: %{{customdata:.1f}} %<extra></extra>")
        )
    chart.add_trace(line("training image", [0, 0], [-0.7, n * block - 1.3], theme.reference, 2.5))
    labels = [
        f"{f}<br>{100 * share:.1f} %" for f, share in zip(as_written(names), reference, strict=True)
    ]
    middle = starts + (len(settings) - 1) / 2
    chart.update_yaxes(**rows_axis(theme, labels, (n * block - 1, -1), middle))
    off = [float(np.abs(shares - reference).max()) for shares in settings.values()]
    reach = 115 * max([*off, 0.002])
    chart.update_xaxes(range=[-reach, reach], nticks=5)
    return chart
