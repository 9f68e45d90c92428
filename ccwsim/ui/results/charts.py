"""Charts with a menu that saves them, and the curves of an ensemble beside its image."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from html import escape
from typing import Any

import numpy as np
import streamlit as st
from numpy.typing import NDArray

from ccwsim import Ensemble, TrainingImage
from ccwsim.figures import Bundle, Theme, curves_chart, proportions_chart, times_chart
from ccwsim.metrics import EType, Fit, etype, fit_curve
from ccwsim.metrics.bands import Statistic, curves_of
from ccwsim.metrics.lags import DirectionName, axes_of, max_lag
from ccwsim.metrics.stack import Stack
from ccwsim.model.bounds import MAX_CURVES
from ccwsim.model.numbers import duration
from ccwsim.report import verdicts
from ccwsim.report.pictures import bundle_of_curves, layers_bundle, layers_chart
from ccwsim.ui.frontend.component import draw_component
from ccwsim.ui.session.cached import cached, kept_with
from ccwsim.ui.widgets.errors import catch_callback_errors
from ccwsim.ui.widgets.text import panel_title, step_note
from ccwsim.ui.widgets.theme import chart_theme

SAVE_BUTTON: dict[str, Any] = {"displaylogo": False, "modeBarButtons": [["toImage"]]}
"""Configuration of plotly with a hidden button; the menu that saves a chart presses this button."""


def draw_caption(text: str) -> None:
    """Add a caption that is hidden on the screen; saved charts and the printed page show it."""
    st.html(f'<p class="chart-caption">{escape(text)}</p>')


def draw_chart(chart: Any, key: str, alt: str, **select: Any) -> None:
    """Draw a plotly figure that already has a style; `select` has options for clicks."""
    st.plotly_chart(chart, key=f"chart_{key}", theme=None, alt=alt, config=SAVE_BUTTON, **select)


def draw_clickable_chart(
    chart: Any, key: str, alt: str, choose: Callable[[int], None], *, n_series: int = 1
) -> None:
    """Draw a chart; `choose` is called with the index of a clicked point of the first series."""

    def clicked() -> None:
        points = st.session_state[f"chart_{key}"].selection.points
        numbers = [p["point_index"] for p in points if p.get("curve_number", n_series) < n_series]
        if numbers:
            choose(int(numbers[0]))

    draw_chart(chart, key, alt, on_select=catch_callback_errors(clicked), selection_mode="points")


def titled_chart(
    title: str,
    note: str | verdicts.Verdict,
    chart: Any,
    key: str,
    alt: str,
    draw: Callable[[Any, str, str], None] = draw_chart,
) -> None:
    """Draw title, note, menu and chart. `key` is unique and names the file; `alt` is read aloud."""
    with st.container(key=f"panel_{key}"):
        with st.container(horizontal=True, gap="small", key=f"title_{key}"):
            panel_title(title, note)
            chart_menu(title, key)
        draw(chart, key, alt)


def chart_menu(title: str, key: str) -> None:
    """Draw the menu that saves the chart with the key `key`."""
    content = {"title": title, "chart": f"chart_{key}", "name": key}
    draw_component("chart_menu", f"menu_{key}", content, width="content")


SMALL_SHARES = 4_000_000
"""Maximum number of values (8 bytes each) of an E-type that is cached for all sessions."""
KINDS: dict[Statistic, tuple[str, str]] = {
    "variogram": ("Indicator variogram", "variogram"),
    "connectivity": ("Connectivity function", "connection"),
}
"""Description of a statistic for screen readers, and beginning of the keys of its charts."""
_e_type, _large_e_type = cached(max_entries=8)(etype), kept_with(etype)
vertical_proportions_bundle = cached(max_entries=64)(layers_bundle)


@cached(max_entries=192)
def curve_bundle(
    ensemble: Ensemble, statistic: Statistic, facies: int, direction: DirectionName
) -> Bundle:
    """Return a curve of a facies, given by its index, for the image and the realizations."""
    image = ensemble.training_image
    code, lags = int(image.codes[facies]), max_lag(direction, image.shape, ensemble.grid.shape)
    reference = _curve_of_image(image, statistic, code, direction, lags)
    stack = Stack(ensemble.indices[:MAX_CURVES], image.codes)
    curves = curves_of(statistic, stack, code, direction, lags)
    return bundle_of_curves(np.arange(len(reference), dtype=float), reference, curves)


@cached(max_entries=64)
def _curve_of_image(
    image: TrainingImage, statistic: Statistic, code: int, direction: DirectionName, lags: int
) -> NDArray[np.float64]:
    """Return a curve of the training image; ensembles with this training image share the curve."""
    return curves_of(statistic, image, code, direction, lags)[0]


@cached(max_entries=192)
def fit_of(
    ensemble: Ensemble, statistic: Statistic, facies: int, direction: DirectionName
) -> Fit | None:
    """Return the comparison of a curve with crops of the training image."""
    return fit_curve(ensemble, statistic, int(ensemble.training_image.codes[facies]), direction)


def e_type_of(ensemble: Ensemble) -> EType:
    """Return the E-type, computed once: a small one for all sessions, a large one per ensemble."""
    small = ensemble.grid.n_cells * ensemble.training_image.n_facies <= SMALL_SHARES
    return (_e_type if small else _large_e_type)(ensemble)


def draw_curves(ensemble: Ensemble, facies: int, colours: Sequence[str] | None = None) -> None:
    """Draw the charts of a facies, given by its index, and proportions if `colours` are given."""
    draw_band_key(ensemble)
    variograms = _variograms(ensemble, facies)
    times = partial(_times, ensemble, chart_theme())
    shares = [partial(draw_proportions, ensemble, colours)] if colours else []
    if ensemble.grid.nz is None:
        rows = [[*variograms, partial(_connectivity_both_ways, ensemble, facies), times, *shares]]
    else:
        layers = partial(draw_layers, ensemble, facies)
        connectivity = [
            partial(_titled_curve, ensemble, "connectivity", facies, direction)
            for direction in axes_of(ensemble.grid.shape)
        ]
        rows = [[*variograms, layers, *shares], [*connectivity, times]]
    draw_rows(rows)


def draw_rows(rows: Sequence[Sequence[Callable[[], None]]]) -> None:
    """Draw rows of charts in equal columns, and explain how the curves are judged."""
    with st.container(key="charts"):
        places = [st.columns(len(rows[0]), gap="medium") for _ in rows]
    for row, columns in zip(rows, places, strict=True):
        for draw, place in zip(row, columns, strict=False):
            with place:
                draw()
    step_note(verdicts.HOW_JUDGED)


def _variograms(ensemble: Ensemble, facies: int) -> list[Callable[[], None]]:
    """Return, per axis, a function that draws the variogram; the γ axes are equal."""
    directions = axes_of(ensemble.grid.shape)
    bundles = [curve_bundle(ensemble, "variogram", facies, direction) for direction in directions]
    top = 1.1 * max(float(np.nanmax([b.each.max(), b.reference.max()])) for b in bundles)
    y_range = 0.0, top or 1.0  # there is no variogram along an axis of one cell
    return [
        partial(_titled_curve, ensemble, "variogram", facies, direction, y_range=y_range)
        for direction in directions
    ]


def _titled_curve(
    ensemble: Ensemble,
    statistic: Statistic,
    facies: int,
    direction: DirectionName,
    y_range: tuple[float, float] = (0.0, 1.04),
    note: verdicts.Verdict | None = None,
    key: str = "",
) -> None:
    name = ensemble.training_image.facies_names[facies]
    kind, prefix = KINDS[statistic]
    if note is None:
        note = verdicts.describe_curve(fit_of(ensemble, statistic, facies, direction), statistic)
    make_chart = partial(
        _curve_chart,
        ensemble,
        statistic,
        facies,
        direction,
        name=name,
        y_range=y_range,
        theme=chart_theme(),
    )
    titled_chart(
        title=verdicts.curve_title(statistic, direction),
        note=note,
        chart=make_chart,
        key=key or f"{prefix}_{direction[0]}",
        alt=f"{kind} {verdicts.way_name(direction)} of {name}",
        draw=_draw_once,
    )


def _curve_chart(
    ensemble: Ensemble,
    statistic: Statistic,
    facies: int,
    direction: DirectionName,
    name: str,
    y_range: tuple[float, float],
    theme: Theme,
) -> Any:
    """Return the chart of a curve; the name of the facies is not part of an ensemble's content."""
    judged = judged_curves(fit_of(ensemble, statistic, facies, direction))
    bundle = curve_bundle(ensemble, statistic, facies, direction)
    return curves_chart(
        bundle,
        theme,
        y_range=y_range,
        y_title=f"{verdicts.SIGNS[statistic]} of {name}",
        judged=judged,
    )


def judged_curves(fit: Fit | None) -> tuple[NDArray[np.float64], ...] | None:
    """Return the lags and the means of crops and pieces that a verdict compares."""
    return None if fit is None or not fit.judged else (fit.at, fit.reference, fit.found)


def _connectivity_both_ways(ensemble: Ensemble, facies: int) -> None:
    """Draw the connectivity E–W; a note mentions connectivity N–S if it is outside the band."""
    fits = [fit_of(ensemble, "connectivity", facies, direction) for direction in ("E-W", "N-S")]
    verdict, north_south = (verdicts.describe_curve(fit, "connectivity") for fit in fits)
    if north_south.good is False:
        words = f"{'' if verdict.good else f'E–W {verdict.words}; '}N–S {north_south.words}"
        numbers = f"E–W {verdict.numbers}; N–S {north_south.numbers}"
        verdict = verdicts.Verdict(words, numbers, good=False)
    _titled_curve(ensemble, "connectivity", facies, "E-W", note=verdict, key="connection")


def draw_statistic(
    bundles: Bundle | Mapping[str, Bundle],
    statistic: Statistic,
    direction: DirectionName,
    name: str,
    *,
    note: str | verdicts.Verdict,
    y_range: tuple[float, float] | None,
    prefix: str = "",
    of_what: str = "",
    height: int = 196,
) -> None:
    """Draw the curves of a statistic of the facies `name`; `of_what` ends the text read aloud."""
    title = verdicts.curve_title(statistic, direction)
    y_title = f"{verdicts.SIGNS[statistic]} of {name}"
    chart = curves_chart(bundles, chart_theme(), y_title=y_title, y_range=y_range, height=height)
    key, alt = f"{prefix}{statistic}_{direction[0]}", f"{title} of {name}{of_what}"
    titled_chart(title, note, chart, key, alt)


def draw_layers(
    ensemble: Ensemble, facies: int, bundle: Bundle | None = None, height: int = 196
) -> None:
    """Draw the vertical proportion curve of a volume for a facies (an index into the codes)."""
    bundle = bundle or vertical_proportions_bundle(ensemble, facies)
    image, grid = ensemble.training_image, ensemble.grid
    name = image.facies_names[facies]
    note = verdicts.LAYERS_NOT_JUDGED
    if image.shape[0] != grid.nz:
        note = f"training image ({image.shape[0]} layers) scaled to the grid"
    chart = layers_chart(ensemble, facies, bundle, chart_theme(), height=height)
    alt = f"Share of {name} in each layer: training image, realizations, hard data"
    titled_chart("Vertical proportions", note, chart, "layers", alt)


def draw_proportions(ensemble: Ensemble, colours: Sequence[str]) -> None:
    """Draw the facies proportions of the realizations and of the training image."""
    names = ensemble.training_image.facies_names  # names are not part of an ensemble's content
    make_chart = partial(
        proportions_chart,
        names,
        ensemble.image_proportions,
        ensemble.proportions,
        tuple(colours),
        theme=chart_theme(),
    )
    titled_chart(
        title="Proportions",
        note="",
        chart=make_chart,
        key="proportions",
        alt="Facies proportions of the realizations and the image",
        draw=_draw_once,
    )


@cached(max_entries=320)
def _draw_once(make_chart: partial[Any], key: str, alt: str) -> None:
    """Draw a chart; for equal arguments of `make_chart`, all sessions share Streamlit's message."""
    draw_chart(make_chart(), key, alt)


def _times(ensemble: Ensemble, theme: Theme) -> None:
    if ensemble.is_stored:
        panel_title("CPU time", "not run on this machine yet")
        return
    mean = float(ensemble.cpu_seconds.mean())
    titled_chart(
        title="CPU time",
        note=f"{duration(mean)} a realization",
        chart=partial(times_chart, 1000 * ensemble.cpu_seconds, 1000 * mean, theme),
        key="times",
        alt="CPU time of each realization",
        draw=_draw_once,
    )


def draw_curve_key(lines: Iterable[tuple[str, str]]) -> None:
    """Draw the legend of the lines in charts; each line has a CSS border style and a name."""
    entries = "".join(
        f'<span><i style="border-top: {border}"></i>{escape(name)}</span>' for border, name in lines
    )
    st.html(f'<div class="curve-key">{entries}</div>')


def draw_band_key(ensemble: Ensemble) -> None:
    """Draw the legend for the lines of `curves_chart`."""
    thin_lines = "each realization"
    if ensemble.n > MAX_CURVES:
        thin_lines = f"each of the first {MAX_CURVES} realizations"
    names = ("training image", "median", "5–95 %", thin_lines)
    styles = ((2, "reference"), (2, "ink"), (10, "band"), (1, "each"))
    borders = [f"{width}px solid var(--{colour})" for width, colour in styles]
    judged = ("2px dotted var(--ink)", "means over crops and pieces")
    draw_curve_key([*zip(borders, names, strict=True), judged])
