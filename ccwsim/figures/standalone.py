"""Charts outside the dashboard: a figure as text, and the script that draws it offline."""

from __future__ import annotations

from functools import cache

import plotly.graph_objects as go
from plotly.offline import get_plotlyjs


def figure_json(figure: go.Figure) -> str:
    """Return a figure as JSON that plotly's script draws, without plotly's own template.

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
    """Return plotly's own script, to be written into a page once.

    Examples
    --------
    >>> len(plotly_script()) > 1_000_000
    True
    """
    return get_plotlyjs()
