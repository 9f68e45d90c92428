"""ANODI: variety of the realizations against their distance from the training image."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import streamlit as st

from ccwsim.figures import divergence_chart
from ccwsim.metrics import Anodi
from ccwsim.ui.results.titled_chart import titled_chart
from ccwsim.ui.session.state import State
from ccwsim.ui.validate.panel import panel
from ccwsim.ui.validate.statistics import patterns
from ccwsim.ui.widgets.facts import three_digits
from ccwsim.ui.widgets.steps import step_note
from ccwsim.ui.widgets.theme import chart_theme


def draw_patterns(state: State, colours: Sequence[str]) -> None:
    """Draw between and within by resolution, with their ratio."""
    ensemble = state.ensemble
    assert ensemble is not None
    panel(state, "anodi", patterns(ensemble), _draw)


def mean_ratio(found: Anodi) -> float:
    """Return Σ w · between / within over resolutions; NaN for a single realization."""
    return float(found.weights @ found.ratio[0])


def _draw(found: Anodi) -> None:
    left, right = st.columns([1.6, 1.0], gap="large")
    with left:
        ratio = mean_ratio(found)
        note = "" if np.isnan(ratio) else f"between / within = {three_digits(ratio)}"
        chart = divergence_chart(found.factors, found.between[0], found.within[0], chart_theme())
        titled_chart(
            "Distance of patterns", note, chart, "anodi",
            "Divergence between realizations, and from the training image, by resolution",
        )  # fmt: skip
    with right:
        st.html(table_of(found))
        size = found.pattern_size
        step_note(
            f"ANODI (Tan et al. 2014) on exact histograms of all {size} × {size} patterns. "
            "Between: realizations from each other (discs), more is more varied. Within: from the "
            "training image (diamonds), less is more like it. A larger ratio is better."
        )


def table_of(found: Anodi) -> str:
    """Return between, within and ratio by resolution as an HTML table."""

    def cell(value: float) -> str:
        return f"<td>{'–' if np.isnan(value) else three_digits(value)}</td>"

    rows = "".join(
        f"<tr><th>{'full' if factor == 1 else f'1 / {factor}'}</th>"
        f"{cell(found.between[0, g])}{cell(found.within[0, g])}{cell(found.ratio[0, g])}</tr>"
        for g, factor in enumerate(found.factors)
    )
    head = "<tr><th>resolution</th><th>between</th><th>within</th><th>ratio</th></tr>"
    return f'<table class="numbers">{head}{rows}</table>'
