"""The page Compare: two to four settings with the same training image, data and seeds."""

from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from html import escape
from itertools import product
from typing import Any

import numpy as np
import streamlit as st

from ccwsim import CCWSIMError, Ensemble, Parameters, datasets, figures
from ccwsim.experiments.comparison import STATISTICS, Comparison
from ccwsim.jobs.job import FIRST_RESULT_SECONDS
from ccwsim.jobs.limits import Demand, limits_of_environment
from ccwsim.metrics.lags import axes_of
from ccwsim.model import (
    MAX_REALIZATIONS_COMPARED,
    MAX_SETTINGS,
    MIN_SETTINGS,
    describe_shape,
    duration,
    plural,
    three_digits,
)
from ccwsim.report.settings import describe_inputs, describe_parameters, describe_setting
from ccwsim.report.verdicts import describe_curves, describe_scaling
from ccwsim.sharing.choices import Beside, EMap, ImageChoice, Upload
from ccwsim.ui.compare import findings, settings
from ccwsim.ui.compare.settings import (
    LETTERS,
    TWO_POINT,
    ComparePageState,
    ComparisonRun,
)
from ccwsim.ui.frontend.cells import draw_cells
from ccwsim.ui.results import charts, maps
from ccwsim.ui.session import State, data_of, error_boundary, grid_part, image_of, study_of
from ccwsim.ui.study.changes import image_name
from ccwsim.ui.study.image_questions import image_of_file
from ccwsim.ui.study.image_step import image_uploader
from ccwsim.ui.study.study_column import parameter_field, size_fields, variant_field
from ccwsim.ui.study.trials import draw_run_news, use_button
from ccwsim.ui.widgets import (
    PARAMETER_ROWS,
    bound_to,
    button,
    chart_theme,
    download,
    draw_style,
    field,
    in_row,
    options_of,
    page_text,
    pair,
    panel_title,
    plain,
    problem_in,
    scrolled,
    step_note,
)

SHOWN_AT_ONCE = {
    *("variant", "method", "wavelet_level", "template_size", "overlap_size"),
    *("n_candidates", "search_fraction", "refine"),
}
"""Parameters of a setting that are shown on the page, outside the setting's menu."""
MIN_IMAGE_SHARE = 0.8
"""Minimum ratio of the width of the training image's column to the width of a setting's column."""
MAPS: dict[str, Any] = {"scale": "compared", "body": False}
MAX_HEIGHTS = {2: 460, 3: 300}  # maximum height in pixels of maps (2) and of slices of volumes (3)
NO_CURVES = np.empty((0, 0))
BORDERS = dict(zip(figures.DASHES, ("solid", "dashed", "dotted", "dashed"), strict=True))
"""CSS border style for each line style of charts; CSS has no dash-dot."""
GLYPHS = dict(zip(figures.MARKER_SYMBOLS, "●■▲✚", strict=True))
"""Text character for each marker symbol of charts."""


def draw_page(state: State) -> None:
    """Draw the settings and the latest comparison; run a comparison if there is none."""
    draw_style("compare/compare.css")
    page_state = state.page(ComparePageState)
    problem = comparison_problem(state)
    if page_state.run is None and not page_state.message and not problem:
        settings.start_comparison(state)
    run = page_state.run
    busy = run is not None and run.going and not run.wait(FIRST_RESULT_SECONDS)
    if not busy and page_state.shown_run is run:
        page_state.earlier = None  # free its realizations
    _draw_settings(state)
    _draw_run_row(state, problem)
    shown_run, outdated = page_state.shown_run, ""
    if not problem and shown_run is not None and shown_run.key != settings.key_of(state):
        outdated = "the settings or the study have changed. Compare again."
    ended = "" if busy or run is None else run.describe_end()
    if ended and shown_run is page_state.earlier is not None:
        ended += " The earlier comparison is still shown."
    draw_run_news(
        run if busy else None,
        outdated="" if busy else outdated,
        problem=problem,
        message=page_state.message or ended,
        dim=shown_run is page_state.earlier is not None,
    )
    with st.container(key="results"):
        _draw_results(state, busy)


def comparison_problem(state: State) -> str:
    """Return the reason why the settings cannot be compared, or an empty text."""

    def check() -> None:
        choices, tried = state.choices, settings.compared_settings(state)
        for parameters in tried:
            study_of(replace(choices, parameters=parameters))
        n = len(settings.setting_names(tried, state.compare.beside))
        if n > MAX_SETTINGS:
            most = MAX_SETTINGS - 1
            raise CCWSIMError(f"At most {most} settings fit beside {TWO_POINT}. Remove a setting.")
        n += settings.second_trial(state) is not None
        n_cells = choices.grid.n_cells * n * settings.n_per_setting(state)
        limits_of_environment().check(Demand(n_cells, data_of(choices).n))

    return problem_in(check)


def _draw_settings(state: State) -> None:
    """Draw one column per setting, with common parameters and a menu of further parameters."""
    present = settings.compared_settings(state)
    with st.container(key="settings"):
        columns = st.columns(len(present), gap="medium", wrap=False)
    for k, (letter, column, p) in enumerate(zip(LETTERS, columns, present, strict=False)):
        note = describe_setting(p, present[0]) if k else "the study’s own"
        with column, st.container(key=f"setting_{letter}"):
            draw_name(k, letter, "identical to A" if note == "the same" else note)
            _draw_parameters(state, k, p)
            _draw_actions(state, k, len(present))


def _draw_parameters(state: State, k: int, p: Parameters) -> None:
    shape, prefix = state.image.shape, f"{LETTERS[k]}_"
    change = partial(settings.change_setting, state, k)

    variant_field(p, shape, change, prefix)
    left, right = pair()
    with left:
        parameter_field(p, "method", change, prefix)
    with right:
        parameter_field(p, "n_candidates", change, prefix, st.number_input)
    free = size_fields(p, shape, change, prefix)
    with in_row(f"last_{LETTERS[k]}"):
        parameter_field(p, "refine", change, prefix)
        with st.popover("More", key=f"more_{LETTERS[k]}"):
            with free or nullcontext():
                parameter_field(p, "search_fraction", change, prefix, st.number_input)
            for name in PARAMETER_ROWS:
                if name not in SHOWN_AT_ONCE:
                    parameter_field(p, name, change, prefix)


def _draw_actions(state: State, k: int, n: int) -> None:
    letter = LETTERS[k]
    with in_row(f"actions_{letter}", "top"):
        help_ = "Use this setting in the study and open Simulate."
        if k:
            help_ = "Swap this setting with the study's setting (A) and open Simulate."
        use_button(
            "Use these",
            f"use_{letter}",
            on_click=settings.swap_setting,
            args=(state, k),
            help=help_,
        )
        with st.popover("Copy from", key=f"copy_{letter}"):
            for j, other in enumerate(LETTERS[:n]):
                if j != k:
                    button(
                        f"Setting {other}",
                        key=f"copy_{letter}_from_{other}",
                        on_click=settings.copy_setting,
                        args=(state, k, j),
                        width="stretch",
                    )
        if k:
            button(
                "Remove",
                key=f"remove_{letter}",
                on_click=settings.remove_setting,
                args=(state, k),
                disabled=n == MIN_SETTINGS,
                help="Two settings are needed." if n == MIN_SETTINGS else None,
            )
        elif n < MAX_SETTINGS:
            button("Add a setting", key="add_setting", on_click=settings.add_setting, args=(state,))


def _draw_run_row(state: State, problem: str) -> None:
    """Draw the number of realizations, the start button and the downloads."""
    page_state = state.page(ComparePageState)
    with in_row("compare_row", "bottom"):
        field(
            st.number_input,
            "Realizations of each",
            key="n_compared",
            min_value=1,
            max_value=MAX_REALIZATIONS_COMPARED,
            width=140,
            help="With more realizations, smaller differences are significant.",
            **bound_to(
                state.compare, "n", state.change_compare, value=settings.n_per_setting(state)
            ),
        )
        _draw_beside(state)
        button(
            "Compare",
            key="compare",
            on_click=settings.start_comparison,
            args=(state,),
            type="primary",
            disabled=bool(problem),
            help=problem or None,
        )
        kept = page_state.kept_run
        if kept is not None and (comparison := kept.latest_result) is not None:
            with st.popover("Download", key="downloads"):
                prefix = f"{grid_part(kept.training_image, kept.grid)}_seed{kept.first.seed}"
                for label, name, csv_of in (
                    ("Settings and their results, CSV", "settings", findings.settings_csv),
                    ("Every realization, CSV", "compared_realizations", findings.comparison_csv),
                    ("ANODI ratios, CSV", "anodi_ratios", findings.ratios_csv),
                ):
                    download(
                        label,
                        partial(csv_of, comparison),
                        f"{prefix}_{name}.csv",
                        key=f"download_{name}",
                        width="stretch",
                    )
        if not problem:
            inputs = describe_inputs(study_of(state.choices))
            step_note(f"Inputs of all settings: {inputs}, seed {state.choices.seed}.")


def _draw_beside(state: State) -> None:
    """Draw the choice of a two-point simulation or of a second image with the same facies."""
    beside, is_volume = state.compare.beside, state.grid.is_volume
    bundled = datasets.volume_names() if is_volume else datasets.names()
    study_image = state.choices.image
    choices = [
        choice
        for choice in map(ImageChoice, bundled)
        if choice != study_image
        and np.array_equal(image_of(choice).codes, image_of(study_image).codes)
    ]
    if isinstance(beside, ImageChoice):
        choices.append(beside)
    names: dict[Beside, str] = {
        "": "nothing",
        TWO_POINT: "two-point simulation",
        **{choice: f"image {image_name(choice)}" for choice in choices},
    }
    field(
        st.selectbox,
        "Beside the settings",
        key="beside",
        width=220,
        **bound_to(state.compare, "beside", state.change_compare),
        **options_of(names),
    )

    def take(upload: Upload) -> None:
        state.change_compare(beside=image_of_file(upload, volume=is_volume))

    with st.popover("Own image", key="beside_menu"):
        image_uploader("A second training image with the same facies", "beside_file", take)


@st.fragment
def _draw_results(state: State, busy: bool) -> None:
    """Draw the latest results, partial if a run was `busy` when the page was drawn."""
    page_state = state.page(ComparePageState)
    with error_boundary():
        if page_state.going != busy:  # a fragment of the page has started another job
            st.rerun()
        run = page_state.shown_run
        if run is None or (comparison := run.latest_result) is None:
            tried = settings.compared_settings(state)
            grid, n = state.grid, len(settings.setting_names(tried, state.compare.beside))
            with st.container(key="maps"):
                columns = st.columns(n, gap="medium")
            for column in columns:
                with column:
                    text = "One realization of each setting, simulated with the same random numbers"
                    maps.ghost_panel(text, f"aspect-ratio: {grid.nx} / {grid.ny}")
        else:
            _draw_comparison(state, run, comparison)


def _draw_comparison(state: State, run: ComparisonRun, comparison: Comparison) -> None:
    page_state = state.page(ComparePageState)
    page_state.shown = min(page_state.shown, comparison.first.n - 1)
    state.choose_facies(comparison.first.training_image)
    notes = "; ".join(f"{name}: {note}" for name, note in _notes(run).items())
    inputs, n = describe_inputs(comparison.first), plural(run.n_realizations, "realization")
    charts.draw_caption(f"{inputs}; {notes}; {n} each, seed {run.first.seed}")
    with st.container(key="said"):  # always drawn, so that elements below do not move
        if len(comparison.names) == len(run.names) or not page_state.going:
            left, right = st.columns(2, gap="medium")
            with left:
                lines = "".join(f"<p>{escape(text)}</p>" for text in findings.sentences(comparison))
                st.html(f'<div class="summary">{lines}</div>')
            with right:
                st.html(scrolled(findings.figures_table(comparison), "Settings in numbers"))
    draw_maps(state, run, comparison)
    if run.second_ensemble is not None:
        _draw_two_images(state, comparison.first, run.second_ensemble, run.colours)
    with st.container(key="curves"):
        draw_compared_curves(state, comparison)
    with st.container(key="patterns"):
        draw_compared_patterns(state, comparison)


def _notes(run: ComparisonRun) -> dict[str, str]:
    """Return the study's setting, the differences of other settings, and "not CCWSIM", by name."""
    study_setting, *others = run.settings
    descriptions = [
        describe_parameters(study_setting),
        *(describe_setting(p, study_setting) for p in others),
        "not CCWSIM",
    ]
    return dict(zip(run.names, descriptions, strict=False))


def draw_name(k: int, name: str, note: str) -> None:
    """Draw the name of setting `k` in the setting's colour, followed by the text `note`."""
    text = escape(note)
    html = f'<b>{name}</b><span title="{text}">{text}</span>'
    st.html(f'<div class="setting" style="--own: {findings.setting_colour(k)}">{html}</div>')


def draw_maps(state: State, run: ComparisonRun, comparison: Comparison) -> None:
    """Draw one column for the training image and one per setting, with the E-type below."""
    page_state = state.page(ComparePageState)
    image, grid, n = comparison.first.training_image, run.grid, comparison.first.n
    colours = run.colours

    def write(option: int | EMap) -> None:
        maps.choose_statistic(state, option)
        settings.want_curves(state)

    with in_row("shown_row"):
        panel_title(f"Realization {page_state.shown + 1} of {n}")
        maps.step_buttons("shown", page_state, n, " of all settings")
        st.html('<div class="panel below">E-type below</div>', width="content")
        maps.e_type_field(state, image, write, n)
    share = min(max(image.shape[-1] / grid.nx, MIN_IMAGE_SHARE), 1.0)
    options: dict[str, Any] = MAPS | {"max_height": MAX_HEIGHTS[grid.n_dimensions]}
    with st.container(key="maps"):
        first, *others = st.columns([share] + [1.0] * len(run.names), gap="medium")
    with first:
        panel_title("Training image")
        cell_map = maps.map_of_image(image, colours)
        link = "grid" if grid.is_volume else "image"
        draw_cells(cell_map, "image", name="training_image", link=link, leads=False, **options)
        _draw_times_and_proportions(comparison)
    notes = _notes(run)
    for k, (column, name) in enumerate(zip(others, run.names, strict=True)):
        with column:
            draw_name(k, name, notes[name])
            if k < len(comparison.ensembles):
                ensemble, r = comparison.ensembles[k], page_state.shown
                alt, file = f"{name}, realization {r + 1}", f"{name}_realization_{r + 1}"
                cell_map = maps.realization_map(state, ensemble, colours, r, alt)
                e_type_map = maps.uncertainty_map(state, ensemble, colours)
                draw_cells(cell_map, name, name=file, link="grid", **options)
                draw_cells(
                    e_type_map, f"e_type_{name}", name=f"{name}_e_type", link="grid", **options
                )
            else:
                maps.ghost_panel("", f"aspect-ratio: {grid.nx} / {grid.ny}")


def _draw_two_images(
    state: State, first: Ensemble, second: Ensemble, colours: Sequence[str]
) -> None:
    """Draw setting A with the second training image, and the uncertainty with both images."""
    image, r = second.training_image, state.page(ComparePageState).shown
    name = maps.pretty(image.name)
    alt = f"{name}, realization {r + 1}"
    panels = {
        f"Second image: {name}": maps.map_of_image(image, colours),
        f"A with {name}": maps.realization_map(state, second, colours, r, alt),
        f"E-type with {name}": maps.uncertainty_map(state, second, colours),
        "E-type of both images": maps.uncertainty_map(
            state, settings.both_images(first, second), colours
        ),
    }
    with st.container(key="two_images"):
        columns = st.columns(len(panels), gap="medium")
    for k, (column, (title, cell_map)) in enumerate(zip(columns, panels.items(), strict=True)):
        with column:
            panel_title(title)
            draw_cells(
                cell_map,
                f"two_images_{k}",
                link="grid" if k or first.grid.is_volume else "",
                name=f"two_images_{k + 1}",
                max_height=MAX_HEIGHTS[first.grid.n_dimensions],
                body=False,
            )
    step_note(page_text("E-type of both images"))


def _draw_times_and_proportions(comparison: Comparison) -> None:
    """Draw CPU times and proportions below the training image."""
    image, theme = comparison.first.training_image, chart_theme()
    times = figures.compared_times_chart(
        {name: 1000 * e.cpu_seconds for name, e in comparison.by_name.items()},
        1000 * comparison.cpu_seconds,
        [duration(mean) for mean in comparison.cpu_seconds],
        theme,
    )
    alt = "CPU time of a realization by setting"
    charts.titled_chart("CPU time", "", times, "compared_times", alt)
    shares = {name: e.proportions for name, e in comparison.by_name.items()}
    chart = figures.compared_proportions_chart(image.facies_names, image.proportions, shares, theme)
    alt = "Facies proportions of the realizations by setting, and of the training image"
    charts.titled_chart("Proportions", "", chart, "compared_proportions", alt)


def draw_compared_curves(state: State, comparison: Comparison) -> None:
    """Draw the curves of the chosen facies or, until curves are computed, a note."""
    facies = state.facies
    name = comparison.first.training_image.facies_names[facies]
    if not settings.has_curves(comparison, facies):
        if not state.page(ComparePageState).going:
            button(
                f"Compute the curves of {plain(name)}",
                key="want_curves",
                on_click=settings.want_curves,
                args=(state,),
            )
        else:
            st.html('<div class="unseen curves"></div>')
        return
    pairs = enumerate(zip(comparison.names, figures.DASHES, strict=False))
    charts.draw_curve_key(
        [
            ("2px solid var(--reference)", "training image"),
            *(
                (f"2px {BORDERS[dash]} {findings.setting_colour(k)}", f"{name}, median and 5–95 %")
                for k, (name, dash) in pairs
            ),
        ]
    )
    code = settings.compared_code(comparison, facies)
    directions = axes_of(comparison.first.grid.shape)
    variograms = [comparison.curves[code, "variogram", direction] for direction in directions]
    values = [
        *(curves.reference.max() for curves in variograms),
        *(band.high.max() for curves in variograms for band in curves.bands),
    ]
    top = 1.08 * float(np.nanmax(values)) or 0.5  # the same scale along all axes
    with st.container(key="charts"):
        in_rows = [2 * len(directions)] if len(directions) == 2 else [len(directions)] * 2
        columns = [place for n in in_rows for place in st.columns(n, gap="medium")]
    for column, (statistic, direction) in zip(
        columns, product(STATISTICS, directions), strict=True
    ):
        curves = comparison.curves[code, statistic, direction]
        bundles = {
            letter: figures.Bundle(
                lags=curves.lags.astype(float),
                reference=curves.reference,
                each=NO_CURVES,
                low=band.low,
                median=band.median,
                high=band.high,
            )
            for letter, band in zip(comparison.names, curves.bands, strict=True)
        }
        fits = dict(zip(comparison.names, curves.fits, strict=True))
        with column:
            charts.draw_statistic(
                bundles,
                statistic,
                direction,
                name,
                note=describe_curves(fits, statistic),
                y_range=(0, top) if statistic == "variogram" else (0, 1.04),
                height=220,
                of_what=": training image and the band of each setting",
            )


def draw_compared_patterns(state: State, comparison: Comparison) -> None:
    """Draw the MDS plot and the ANODI ratios; if there are none, write the reason."""
    if comparison.anodi is None:
        if comparison.problem:
            step_note(f"Patterns are not compared: {comparison.problem}.")
        elif state.page(ComparePageState).going:
            st.html('<div class="unseen patterns"></div>')
        else:
            step_note("Patterns are not compared, because the comparison was stopped early.")
        return
    left, right = st.columns([1.0, 1.15], gap="large")
    with left:
        _draw_mds(state, comparison)
    with right:
        panel_title("ANODI ratios", "each setting against the settings before it")
        st.html(scrolled(findings.ratio_table(comparison), "ANODI ratios"))
        weights = ", ".join(three_digits(w) for w in comparison.anodi.weights)
        image, side = comparison.first.training_image, comparison.anodi.pattern_size
        size = describe_shape((side,) * image.n_dimensions)
        step_note(page_text("ANODI ratios", weights=weights, size=size))


def _draw_mds(state: State, comparison: Comparison) -> None:
    assert comparison.anodi is not None
    assert comparison.scaling is not None
    page_state, n, names = state.page(ComparePageState), comparison.first.n, comparison.names

    def choose(k: int) -> None:
        page_state.shown = min(max(k, 0), n - 1)

    def draw(chart: Any, key: str, alt: str) -> None:
        entries = "".join(
            f'<span><em style="color: {findings.setting_colour(k)}">{glyph}</em>{name}</span>'
            for k, (name, glyph) in enumerate(zip(names, GLYPHS.values(), strict=False))
        )
        st.html(f'<div class="curve-key points">{entries}</div>')
        charts.draw_clickable_chart(chart, key, alt, choose, n_series=len(names))

    theme, positions = chart_theme(), comparison.scaling.positions
    groups = [
        figures.Group(
            name,
            positions[comparison.anodi.owner == k],
            theme.settings[k],
            symbol=figures.MARKER_SYMBOLS[k],
            labels=[f"{name}, realization {r + 1}" for r in range(n)],
            ringed=page_state.shown,
        )
        for k, name in enumerate(names)
    ]
    chart = figures.mds_chart(positions[0], groups, theme)
    alt = "MDS plot: realizations of all settings and the training image"
    stress = comparison.scaling.stress
    note = describe_scaling(stress, "click a point to see it")
    charts.titled_chart(figures.mds_title(stress), note, chart, "compared_mds", alt, draw=draw)
