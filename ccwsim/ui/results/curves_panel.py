"""The row of charts: variograms, connectivity and CPU time, each titled by what it shows."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

import numpy as np
import streamlit as st

from ccwsim.figures import Bundle, Theme, curves_chart, proportions_chart, times_chart
from ccwsim.model.bounds import MAX_CURVES
from ccwsim.model.ensemble import Ensemble
from ccwsim.ui.results.bundles import alike_up_to, connection_bundle, variogram_bundle
from ccwsim.ui.results.charts import draw_chart
from ccwsim.ui.widgets.facts import seconds
from ccwsim.ui.widgets.steps import panel_title
from ccwsim.ui.widgets.theme import chart_theme

FEW = 4
"""Up to so many cells two curves are not yet called alike."""


def draw_curves(ensemble: Ensemble, facies: int, colours: Sequence[str] | None = None) -> None:
    """Draw four charts of a facies (a place in the codes) side by side.

    Where `colours` of the facies are given, a fifth one shows their proportions.
    """
    theme = chart_theme()
    name = ensemble.training_image.facies_names[facies]
    draw_band_key(ensemble)
    variograms = [variogram_bundle(ensemble, facies, way) for way in ("E-W", "N-S")]
    top = 1.1 * max(float(np.nanmax([b.each.max(), b.reference.max()])) for b in variograms)
    with st.container(key="charts"):
        places = st.columns(5 if colours else 4, gap="medium")
    for place, way, bundle in zip(places, ("E–W", "N–S"), variograms, strict=False):
        with place:
            panel_title(f"Variogram {way}", describe_fit(bundle, "variogram", 0.05 * top))
            chart = curves_chart(bundle, theme, y_title=f"γ of {name}", y_range=(0, top))
            draw_chart(chart, f"variogram_{way[0]}", f"Indicator variogram {way} of {name}")
    with places[2]:
        bundle = connection_bundle(ensemble, facies, "E-W")
        panel_title("Connectivity E–W", describe_fit(bundle, "connectivity", 0.02))
        chart = curves_chart(bundle, theme, y_title=f"τ of {name}", y_range=(0, 1.04))
        draw_chart(chart, "connection", f"Connectivity function E–W of {name}")
    with places[3]:
        _times(ensemble, theme)
    if colours:
        with places[4]:
            draw_proportions(ensemble, colours)


def draw_proportions(ensemble: Ensemble, colours: Sequence[str]) -> None:
    """Draw the facies proportions of the realizations against those of the training image."""
    image = ensemble.training_image
    panel_title("Proportions")
    chart = proportions_chart(
        image.facies_names, image.proportions, ensemble.proportions, colours, chart_theme()
    )
    draw_chart(chart, "proportions", "Facies proportions of the realizations and the image")


def describe_fit(bundle: Bundle, what: str, tolerance: float) -> str:
    """Say how the realizations' curves compare with the training image's; `what` names these.

    `tolerance` is that of `alike_up_to`.
    """
    lag = alike_up_to(bundle, tolerance)
    if lag >= bundle.lags[-1]:
        return f"matches the training image's {what}"
    if lag >= FEW:
        return f"matches the training image's {what} up to {lag} cells"
    above = np.nanmean(bundle.median - bundle.reference) > 0
    return f"{'above' if above else 'below'} the training image's {what}"


def _times(ensemble: Ensemble, theme: Theme) -> None:
    if ensemble.is_stored:
        panel_title("CPU time", "not run on this machine yet")
        return
    mean = float(ensemble.cpu_seconds.mean())
    panel_title("CPU time", f"{seconds(mean)} a realization")
    chart = times_chart(1000 * ensemble.cpu_seconds, 1000 * mean, theme)
    draw_chart(chart, "times", "CPU time of each realization")


def draw_curve_key(lines: Iterable[tuple[str, str]]) -> None:
    """Write what the lines of charts are: each as a border in CSS, and its name."""
    entries = "".join(
        f'<span><i style="border-top: {border}"></i>{escape(name)}</span>' for border, name in lines
    )
    st.html(f'<div class="curve-key">{entries}</div>')


def draw_band_key(ensemble: Ensemble) -> None:
    """Write what the lines of `curves_chart` are."""
    each = "each realization"
    if ensemble.n > MAX_CURVES:
        each = f"each of the first {MAX_CURVES} realizations"
    names = ("training image", "median", "5–95 %", each)
    looks = ((2, "reference"), (2, "ink"), (10, "band"), (1, "each"))
    borders = (f"{width}px solid var(--{colour})" for width, colour in looks)
    draw_curve_key(zip(borders, names, strict=True))
