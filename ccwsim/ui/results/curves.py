"""Curves of an ensemble and its training image, computed once, and their charts."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from html import escape
from weakref import WeakKeyDictionary

import numpy as np
import streamlit as st
from numpy.typing import NDArray

from ccwsim.figures import Bundle, Theme, curves_chart, proportions_chart, times_chart
from ccwsim.metrics import EType, Fit, connectivity, etype, fit_curve, variogram
from ccwsim.metrics.bands import Statistic
from ccwsim.metrics.lags import max_lag
from ccwsim.metrics.stack import Images, Stack
from ccwsim.model.bounds import MAX_CURVES
from ccwsim.model.ensemble import Ensemble
from ccwsim.report.pictures import bundle_of_curves
from ccwsim.report.verdicts import HOW_JUDGED, describe_curve, way_name
from ccwsim.ui.results.charts import titled_chart
from ccwsim.ui.widgets.facts import seconds
from ccwsim.ui.widgets.text import panel_title, step_note
from ccwsim.ui.widgets.theme import chart_theme

SMALL_SHARES = 4_000_000
"""Shares of facies, eight bytes each, of an E-type that is kept when its ensemble is gone."""
WAYS = ("E-W", "N-S")
Floats = NDArray[np.float64]
_large: WeakKeyDictionary[Ensemble, EType] = WeakKeyDictionary()


def variogram_bundle(ensemble: Ensemble, facies: int, direction: str) -> Bundle:
    """Return indicator variograms of a facies (a place in the codes) along "E-W" or "N-S"."""

    code = int(ensemble.training_image.codes[facies])

    def curve(images: Images, lags: int) -> Floats:
        return variogram(images, code, direction, lags).gamma

    key = ("variogram", ensemble.digest, ensemble.training_image.digest, facies, direction)
    return _bundle(key, ensemble, direction, curve)


def connectivity_bundle(ensemble: Ensemble, facies: int, direction: str) -> Bundle:
    """Return the connectivity function of a facies along "E-W" or "N-S", 8 neighbours."""

    code = int(ensemble.training_image.codes[facies])

    def curve(images: Images, lags: int) -> Floats:
        return connectivity(images, code, direction, lags).tau

    key = ("connection", ensemble.digest, ensemble.training_image.digest, facies, direction)
    return _bundle(key, ensemble, direction, curve)


@st.cache_resource(max_entries=64, show_spinner=False)
def _bundle(
    key: tuple,
    _ensemble: Ensemble,
    _direction: str,
    _curve: Callable[[Images, int], Floats],
) -> Bundle:
    image = _ensemble.training_image
    lags = max_lag(_direction, image.shape, _ensemble.grid.shape)
    of_image = (key[0], image.digest, *key[3:], lags)
    reference = _of_image(of_image, lambda: _curve(image, lags).reshape(-1))
    each = _curve(Stack(_ensemble.indices[:MAX_CURVES], image.codes), lags)
    return bundle_of_curves(np.arange(len(reference), dtype=float), reference, each)


@st.cache_resource(max_entries=64, show_spinner=False)
def _of_image(key: tuple, _curve: Callable[[], Floats]) -> Floats:
    """Return the image's own curve, which is the same for all its ensembles."""
    return _curve()


def fit_of(ensemble: Ensemble, statistic: Statistic, facies: int, direction: str) -> Fit | None:
    """Return how a curve compares with crops of the training image, computed once."""
    image = ensemble.training_image
    code = int(image.codes[facies])
    key = (ensemble.digest, image.digest, statistic, facies, direction)
    return _fit(key, lambda: fit_curve(ensemble, statistic, code, direction))


@st.cache_resource(max_entries=256, show_spinner=False)
def _fit(key: tuple, _work: Callable[[], Fit | None]) -> Fit | None:
    return _work()


def e_type_of(ensemble: Ensemble) -> EType:
    """Return what an ensemble says about each cell, computed once.

    Small ones are shared by all sessions; a large one goes with its ensemble.
    """
    if ensemble.grid.ny * ensemble.grid.nx * ensemble.training_image.n_facies <= SMALL_SHARES:
        return _e_type(ensemble.digest, ensemble)
    if ensemble not in _large:
        _large[ensemble] = etype(ensemble)
    return _large[ensemble]


@st.cache_resource(max_entries=8, show_spinner=False)
def _e_type(digest: str, _ensemble: Ensemble) -> EType:
    return etype(_ensemble)


def draw_curves(ensemble: Ensemble, facies: int, colours: Sequence[str] | None = None) -> None:
    """Draw four charts of a facies (a place in the codes) side by side.

    Where `colours` of the facies are given, a fifth one shows their proportions.
    """
    theme = chart_theme()
    name = ensemble.training_image.facies_names[facies]
    draw_band_key(ensemble)
    variograms = [variogram_bundle(ensemble, facies, way) for way in WAYS]
    top = 1.1 * max(float(np.nanmax([b.each.max(), b.reference.max()])) for b in variograms)
    top = top or 1.0  # of one cell there is no variogram
    with st.container(key="charts"):
        places = st.columns(5 if colours else 4, gap="medium")
    for place, way, bundle in zip(places, WAYS, variograms, strict=False):
        with place:
            note = describe_curve(fit_of(ensemble, "variogram", facies, way), "variogram")
            chart = curves_chart(bundle, theme, y_title=f"γ of {name}", y_range=(0, top))
            key, alt = f"variogram_{way[0]}", f"Indicator variogram {way_name(way)} of {name}"
            titled_chart(f"Variogram {way_name(way)}", note, chart, key, alt)
    with places[2]:
        bundle = connectivity_bundle(ensemble, facies, "E-W")
        note = _describe_connectivity(ensemble, facies)
        chart = curves_chart(bundle, theme, y_title=f"τ of {name}", y_range=(0, 1.04))
        alt = f"Connectivity function E–W of {name}"
        titled_chart("Connectivity E–W", note, chart, "connection", alt)
    with places[3]:
        _times(ensemble, theme)
    if colours:
        with places[4]:
            draw_proportions(ensemble, colours)
    step_note(HOW_JUDGED)


def _describe_connectivity(ensemble: Ensemble, facies: int) -> str:
    """Say how a facies is connected E–W, and N–S where that fails: it has no chart here."""
    along, across = (fit_of(ensemble, "connectivity", facies, way) for way in WAYS)
    said = describe_curve(along, "connectivity")
    if across is None or across.fits:
        return said
    return f"{said}; N–S {describe_curve(across, 'connectivity')}"


def draw_proportions(ensemble: Ensemble, colours: Sequence[str]) -> None:
    """Draw the facies proportions of the realizations against those of the training image."""
    image = ensemble.training_image
    chart = proportions_chart(
        image.facies_names, image.proportions, ensemble.proportions, colours, chart_theme()
    )
    alt = "Facies proportions of the realizations and the image"
    titled_chart("Proportions", "", chart, "proportions", alt)


def _times(ensemble: Ensemble, theme: Theme) -> None:
    if ensemble.is_stored:
        panel_title("CPU time", "not run on this machine yet")
        return
    mean = float(ensemble.cpu_seconds.mean())
    note = f"{seconds(mean)} a realization"
    chart = times_chart(1000 * ensemble.cpu_seconds, 1000 * mean, theme)
    titled_chart("CPU time", note, chart, "times", "CPU time of each realization")


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
    styles = ((2, "reference"), (2, "ink"), (10, "band"), (1, "each"))
    borders = (f"{width}px solid var(--{colour})" for width, colour in styles)
    draw_curve_key(zip(borders, names, strict=True))
