"""Variograms and connection of all settings against the training image."""

from __future__ import annotations

import numpy as np
import streamlit as st

from ccwsim.experiments.comparison import DIRECTIONS, STATISTICS, Comparison
from ccwsim.figures import Bundle, curves_chart
from ccwsim.ui.compare.name import draw_curve_key
from ccwsim.ui.compare.run import has_curves, want_curves
from ccwsim.ui.compare.state import Comparing
from ccwsim.ui.compare.words import nearest
from ccwsim.ui.results.titled_chart import titled_chart
from ccwsim.ui.session.state import State
from ccwsim.ui.widgets.fields import button
from ccwsim.ui.widgets.literal import plain
from ccwsim.ui.widgets.theme import chart_theme

SIGNS = {"variogram": ("Variogram", "γ"), "connection": ("Connection", "τ")}
NO_CURVES = np.empty((0, 0))
SAME_TAU = 0.01
SAME_GAMMA = 0.02
"""Gaps that differ by less are alike: in probability, and as a share of the largest γ."""


def draw_curves(state: State, found: Comparison) -> None:
    """Draw four charts of the chosen facies, or say that they are still worked out."""
    facies = state.facies
    image = found.ensembles[0].training_image
    if not has_curves(found, facies):
        if state.page(Comparing).job is None:
            button(
                f"Work out the curves of {plain(image.facies_names[facies])}", key="want_curves",
                on_click=want_curves, args=(state,),
            )  # fmt: skip
        else:
            st.html('<div class="unseen curves"></div>')
        return
    draw_curve_key(found.names)
    top = _top(found, facies)
    with st.container(key="charts"):
        places = st.columns(4, gap="medium")
    wanted = [(s, d) for s in STATISTICS for d in DIRECTIONS]
    for place, (statistic, direction) in zip(places, wanted, strict=True):
        with place:
            _chart(found, facies, statistic, direction, top)


def _chart(found: Comparison, facies: int, statistic: str, direction: str, top: float) -> None:
    curves = found.curves[facies, statistic, direction]
    name = found.ensembles[0].training_image.facies_names[facies]
    title, sign = SIGNS[statistic]
    connected = statistic == "connection"
    bundles = {
        setting: Bundle(curves.lags, curves.reference, NO_CURVES, band.low, band.median, band.high)
        for setting, band in zip(found.names, curves.bands, strict=True)
    }
    y_title, y_range = f"{sign} of {name}", (0, 1.04) if connected else (0, top)
    chart = curves_chart(bundles, chart_theme(), y_title=y_title, y_range=y_range, height=220)
    note = nearest(curves, found.names, SAME_TAU if connected else SAME_GAMMA * top)
    where = direction.replace("-", "–")
    word = f"{statistic}_{direction[0]}"
    alt = f"{title} {where} of {name}: training image and the band of each setting"
    titled_chart(f"{title} {where}", note, chart, word, alt)


def _top(found: Comparison, facies: int) -> float:
    """Return the end of the axis of γ, the same for both directions."""
    curves = [found.curves[facies, "variogram", d] for d in DIRECTIONS]
    values = [c.reference.max() for c in curves] + [b.high.max() for c in curves for b in c.bands]
    return 1.08 * float(np.nanmax(values)) or 0.5
