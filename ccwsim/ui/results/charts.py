"""Charts with a menu that saves them, and the curves of an ensemble beside its image."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from html import escape
from typing import Any

import numpy as np
import streamlit as st

from ccwsim import Ensemble
from ccwsim.figures import Bundle, Theme, curves_chart, proportions_chart, times_chart
from ccwsim.metrics import EType, Fit, etype, fit_curve
from ccwsim.metrics.bands import Statistic
from ccwsim.metrics.direction import along_and_across
from ccwsim.metrics.lags import Direction, DirectionName, axes_of
from ccwsim.model import MAX_CURVES, Floats, duration
from ccwsim.report import pictures, verdicts
from ccwsim.report.pictures import bundle_of, layers_bundle, layers_chart
from ccwsim.ui.frontend.component import draw_component
from ccwsim.ui.session import cached, kept_with, session_state
from ccwsim.ui.widgets import button, catch_callback_errors, chart_theme, in_row, panel_title

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
    draw_beside: Callable[[], object] | None = None,
) -> None:
    """Draw title, note, menu and chart. `key` is unique and names the file; `alt` is read aloud.

    `draw_beside` draws an element between title and menu.
    """
    with st.container(key=f"panel_{key}"):
        with in_row(f"title_{key}", "top"):
            panel_title(title, note)
            if draw_beside is not None:
                draw_beside()
            chart_menu(title, key)
        draw(chart, key, alt)


def chart_menu(title: str, key: str) -> None:
    """Draw the menu that saves the chart with the key `key`."""
    content = {"title": title, "chart": f"chart_{key}", "name": key}
    draw_component("chart_menu", f"menu_{key}", content, width="content")


SMALL_SHARES = 4_000_000
"""Maximum number of values (8 bytes each) of an E-type that is cached for all sessions."""
_along_and_across = cached(max_entries=64)(along_and_across)
_e_type, _large_e_type = cached(max_entries=8)(etype), kept_with(etype)
vertical_proportions_bundle = cached(max_entries=64)(layers_bundle)
curve_bundle = cached(max_entries=192)(bundle_of)
histogram_of = cached(max_entries=64)(pictures.histogram_bundle)


@cached(max_entries=192)
def fit_of(
    ensemble: Ensemble, statistic: Statistic, facies: int, direction: Direction
) -> Fit | None:
    """Return the comparison of a curve with crops of the training image."""
    return fit_curve(ensemble, statistic, int(ensemble.training_image.codes[facies]), direction)


def e_type_of(ensemble: Ensemble) -> EType:
    """Return the E-type, computed once: a small one for all sessions, a large one per ensemble."""
    small = ensemble.grid.n_cells * ensemble.training_image.n_facies <= SMALL_SHARES
    return (_e_type if small else _large_e_type)(ensemble)


indicator_of = cached(max_entries=16)(Ensemble.indicator)


def draw_facies_charts(
    ensemble: Ensemble, facies: int, axis: DirectionName = "E-W", of_values: Ensemble | None = None
) -> None:
    """Draw variograms, connectivity and CPU times; `facies` is an index into the codes.

    The curves of a volume are in the direction `axis`, beside the vertical proportions. Variograms
    are those of a continuous variable if `of_values` are realizations of which `ensemble` is the
    indicator.
    """
    if of_values is None:
        variograms = _variograms(ensemble, "variogram", facies)
    else:
        variograms = _variograms(of_values, "values", 0)
    times = partial(_times, ensemble, chart_theme())
    if not ensemble.grid.is_volume:
        drawn = [*variograms, partial(_connectivity_both_ways, ensemble, facies), times]
    else:
        drawn = [
            variograms[axes_of(ensemble.grid.shape).index(axis)],
            partial(_titled_curve, ensemble, "connectivity", facies, axis),
            partial(draw_layers, ensemble, facies),
            times,
        ]
    for draw in drawn:
        draw()


def directions_of_curves(ensemble: Ensemble, facies: int) -> dict[Direction, str]:
    """Return the directions of curves, and the end of their titles: along and across geobodies.

    Without a main direction of the image, in volumes and of values, curves are along the axes.
    """
    image = ensemble.training_image
    follows = not ensemble.is_of_other_images and not image.values
    code = int(image.codes[facies])
    directions = follows and not ensemble.grid.is_volume and _along_and_across(image, code)
    if not directions:
        return dict.fromkeys(axes_of(ensemble.grid.shape), "")
    return dict(zip(directions, (", along", ", across"), strict=True))


def _variograms(ensemble: Ensemble, statistic: Statistic, facies: int) -> list[Callable[[], None]]:
    """Return, per direction, a function that draws the variogram; the γ axes are equal."""
    directions = directions_of_curves(ensemble, facies)
    bundles = [curve_bundle(ensemble, statistic, facies, direction) for direction in directions]
    top = 1.1 * max(float(np.nanmax([b.each.max(), b.reference.max()])) for b in bundles)
    y_range = 0.0, top or 1.0  # there is no variogram along an axis of one cell
    return [
        partial(
            _titled_curve,
            ensemble,
            statistic,
            facies,
            direction,
            relation=relation,
            y_range=y_range,
        )
        for direction, relation in directions.items()
    ]


def _titled_curve(
    ensemble: Ensemble,
    statistic: Statistic,
    facies: int,
    direction: Direction,
    relation: str = "",
    y_range: tuple[float, float] = (0.0, 1.04),
    note: verdicts.Verdict | None = None,
    key: str = "",
    **options: Any,
) -> None:
    image = ensemble.training_image
    name = image.variable if statistic == "values" else image.facies_names[facies]
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
    title, way = verdicts.curve_title(statistic, direction), verdicts.way_name(direction)
    titled_chart(
        title=title + relation,
        note=note,
        chart=_figure_of(make_chart),
        key=key or f"{statistic}_{way[:-1] if way[0].isdigit() else way[0]}",
        alt=f"{title} of {name}",
        draw=draw_light_chart,
        **options,
    )


def _curve_chart(
    ensemble: Ensemble,
    statistic: Statistic,
    facies: int,
    direction: Direction,
    name: str,
    y_range: tuple[float, float],
    theme: Theme,
) -> Any:
    """Return the chart of a curve; the name of the facies is not part of an ensemble's content."""
    return curves_chart(
        curve_bundle(ensemble, statistic, facies, direction),
        theme,
        y_range=y_range,
        y_title=f"{verdicts.SIGNS[statistic]} of {name}",
        judged=judged_curves(fit_of(ensemble, statistic, facies, direction)),
    )


def judged_curves(fit: Fit | None) -> tuple[Floats, ...] | None:
    """Return the lags and the means of crops and pieces that a verdict compares."""
    return None if fit is None or not fit.judged else (fit.at, fit.reference, fit.found)


def _connectivity_both_ways(ensemble: Ensemble, facies: int) -> None:
    """Draw the connectivity along geobodies or, after a click, across.

    The note judges the connectivity in both directions.
    """
    state, relations = session_state(), directions_of_curves(ensemble, facies)
    direction, other = list(relations)[:: -1 if state.shows_across else 1]
    fits = {
        verdicts.way_name(shown): fit_of(ensemble, "connectivity", facies, shown)
        for shown in (direction, other)
    }
    other_way = verdicts.way_name(other)
    _titled_curve(
        ensemble,
        "connectivity",
        facies,
        direction,
        relation=relations[direction],
        note=verdicts.describe_curves(fits, "connectivity"),
        key="connection",
        draw_beside=partial(
            button,
            other_way,
            key="turn_connectivity",
            on_click=catch_callback_errors(setattr),
            args=(state, "shows_across", not state.shows_across),
            help=f"Show connectivity {other_way}{relations[other]}",
            type="tertiary",
        ),
    )


def draw_statistic(
    bundles: Bundle | Mapping[str, Bundle],
    statistic: Statistic,
    direction: Direction,
    name: str,
    *,
    note: str | verdicts.Verdict,
    of_what: str = "",
    **options: Any,
) -> None:
    """Draw the curves of a statistic of the facies `name`; `of_what` ends the text read aloud.

    `options` are passed to `curves_chart`.
    """
    title = verdicts.curve_title(statistic, direction)
    y_title = f"{verdicts.SIGNS[statistic]} of {name}"
    chart = curves_chart(bundles, chart_theme(), y_title=y_title, **options)
    key = f"{statistic}_{direction[0] if isinstance(direction, str) else 'azimuth'}"
    titled_chart(title, note, chart, key, f"{title} of {name}{of_what}")


def draw_layers(ensemble: Ensemble, facies: int, bundle: Bundle | None = None) -> None:
    """Draw the vertical proportion curve of a volume for a facies (an index into the codes)."""
    bundle = bundle or vertical_proportions_bundle(ensemble, facies)
    image, grid = ensemble.training_image, ensemble.grid
    name = image.facies_names[facies]
    note = verdicts.LAYERS_NOT_JUDGED
    if image.shape[0] != grid.nz:
        note = f"training image ({image.shape[0]} layers) scaled to the grid"
    chart = layers_chart(ensemble, facies, bundle, chart_theme()).to_json(validate=False)
    alt = f"Share of {name} in each layer: training image, realizations, hard data"
    titled_chart("Vertical proportions", note, chart, "layers", alt=alt, draw=draw_light_chart)


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
        chart=_figure_of(make_chart),
        key="proportions",
        alt="Facies proportions of the realizations and the image",
        draw=draw_light_chart,
    )


def draw_histogram(ensemble: Ensemble) -> None:
    """Draw the histograms of the values of the realizations and of the training image."""
    image, bundle = ensemble.training_image, histogram_of(ensemble)
    make_chart = partial(
        curves_chart,
        bundle,
        chart_theme(),
        y_title="cells (%)",
        x_title=f"{image.variable} ({image.units})" if image.units else image.variable,
        x_range=(float(bundle.lags[0]), float(bundle.lags[-1])),
        y_range=(0.0, 1.1 * float(max(bundle.reference.max(), bundle.each.max()))),
    )
    titled_chart(
        title="Histogram",
        note="",
        chart=_figure_of(make_chart),
        key="proportions",  # in the place of the chart of facies
        alt=f"Histograms of {image.variable} in the realizations and the image",
        draw=draw_light_chart,
    )


@cached(max_entries=320)
def _figure_of(make_chart: partial[Any]) -> str:
    """Return a chart as JSON, which all sessions share for equal arguments of `make_chart`."""
    return str(make_chart().to_json(validate=False))


def draw_light_chart(figure: str, key: str, alt: str) -> None:
    """Draw a chart, given as JSON, without Plotly, which takes most of the time of a page.

    The component draws lines and dots on axes with ranges; the style determines the height.
    """
    draw_component("chart", f"chart_{key}", {"figure": figure, "alt": alt})


def _times(ensemble: Ensemble, theme: Theme) -> None:
    if ensemble.is_stored:
        panel_title("CPU time", "not run on this machine yet")
        return
    mean = float(ensemble.cpu_seconds.mean())
    titled_chart(
        title="CPU time",
        note=f"{duration(mean)} a realization",
        chart=_figure_of(partial(times_chart, 1000 * ensemble.cpu_seconds, 1000 * mean, theme)),
        key="times",
        alt="CPU time of each realization",
        draw=draw_light_chart,
    )


def draw_curve_key(lines: Iterable[tuple[str, str]]) -> None:
    """Draw the legend of the lines in charts; each line has a CSS border style and a name."""
    entries = "".join(
        f'<span><i style="border-top: {border}"></i>{escape(name)}</span>' for border, name in lines
    )
    st.html(f'<div class="curve-key">{entries}</div>')


def draw_band_key(ensemble: Ensemble) -> None:
    """Draw the legend for the lines of `curves_chart`."""
    many = ensemble.n > MAX_CURVES
    thin_lines = f"each of the first {MAX_CURVES} realizations" if many else "each realization"
    names = ("training image", "median", "5–95 %", thin_lines)
    styles = ((2, "reference"), (2, "ink"), (10, "band"), (1, "each"))
    borders = [f"{width}px solid var(--{colour})" for width, colour in styles]
    judged = ("2px dotted var(--ink)", "means over crops and pieces")
    draw_curve_key([*zip(borders, names, strict=True), judged])
