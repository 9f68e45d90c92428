"""The page Sweep: cost and quality of many settings, and a recommended setting."""

from collections.abc import Callable, Sequence
from functools import partial
from html import escape
from typing import Any

import numpy as np
import streamlit as st

from ccwsim import Grid, Parameters
from ccwsim.experiments import sweep
from ccwsim.experiments.plan import ALONG_Z, RANGED, label, value_of, varied
from ccwsim.experiments.sweep import Sweep, SweepRow
from ccwsim.figures import sweep_chart, tile_size
from ccwsim.io.formats.csv_table import records_as_csv
from ccwsim.model import MAX_REALIZATIONS_OF_SWEEP, minus, plural, three_digits
from ccwsim.report.settings import describe_inputs
from ccwsim.ui.frontend.cells import draw_cells, facies_map
from ccwsim.ui.frontend.component import draw_tiles, run_script
from ccwsim.ui.results.charts import chart_menu, draw_caption, draw_clickable_chart
from ccwsim.ui.results.maps import ghost_panel, step_buttons, with_data
from ccwsim.ui.session import State, error_boundary, grid_part, page_link
from ccwsim.ui.study.study_column import set_parameters, variant_field
from ccwsim.ui.study.trials import (
    TILE_PIXELS,
    SweepRun,
    advice_on,
    draw_run_news,
    indices_of,
    setting_tile,
    study_key,
    use_button,
)
from ccwsim.ui.sweep import planning
from ccwsim.ui.sweep.planning import SweepState
from ccwsim.ui.widgets import (
    PARAMETER_ROWS,
    bound_to,
    button,
    chart_theme,
    download,
    draw_style,
    field,
    if_possible,
    in_row,
    numbers_table,
    page_labels,
    page_text,
    panel_title,
    plain,
    step_note,
    step_title,
)

SWEEP_CHART_HEIGHT = 392
SWEEP_WIDTHS = (1.1, 0.95, 0.82)
"""Relative widths of three columns: chart, setting shown large, and numbers of the setting."""
ERROR_LABELS = page_labels("errors_of_sweep")
"""Name and axis title of each error that the chart can show against CPU time."""
HEADS = page_labels("columns_of_sweep")
"""Names of a setting's numbers, by CSV column; only volumes have the column "vertical"."""
PATTERN_COLUMNS = ("pattern_full", "pattern_half", "pattern_third")
CURVE_DIRECTIONS = ("EW", "NS", "vertical")
USE_HELP = "Uses this setting in the study and opens Simulate."
TILES = "sweep_tiles"


def draw_page(state: State) -> None:
    """Draw ranges on the left and results on the right."""
    draw_style("sweep/sweep.css")
    with st.sidebar:
        run_script("column", "sweep_column")
        _draw_controls(state)
    run, outdated = state.page(SweepState).run, ""
    if run is not None and not is_current_sweep(run, state):
        outdated = "the study's training image, data or grid has changed. Sweep again."
    draw_run_news(
        run,
        outdated=outdated,
        message=run.describe_end() if run is not None else "",
        redraw_seconds=planning.REDRAW_SECONDS,
        keys=("sweep_progress", "sweep_cancel"),
    )
    with st.container(key="results"):
        if run is not None:
            _draw_results(state)
        if run is None or not (run.going or run.latest_result.rows):
            _draw_outlines()
            with st.container(key="first_row"):
                _sweep_button(state, "sweep_first")
            if not planning.sweep_problem(state):
                plan = planning.plan_of(state).fitting
                panel_title("Settings", "to be tried; a realization of each will appear here")
                draw_settings(_to_come(plan, varied(plan)), state.grid)
    with st.container(key="run_bar"):
        _sweep_button(state, "sweep_below")


def _draw_controls(state: State) -> None:
    """Draw the three steps of a sweep."""
    step_title(1, "Study")
    step_note(planning.describe_study(state))
    page_link("pages/simulate.py", "Change on Simulate")
    step_title(2, "Ranges")
    own, shape = state.choices.parameters, state.image.shape
    variant_field(own, shape, partial(set_parameters, state))
    ranges = planning.ranges_of(state)
    for name, values in planning.values_on_offer(state.choices).items():
        with st.container(key=f"range_{name}"):
            _draw_range(state, name, values, ranges[name])
    if state.sweep.ranges:
        reset = partial(state.change_sweep, ranges=())
        button("Back to the suggested ranges", key="ranges_back", on_click=reset)
    step_note(advice_on(state.image, own))
    step_title(3, "Realizations")
    field(
        st.number_input,
        "Of each setting",
        key="n_swept",
        min_value=1,
        max_value=MAX_REALIZATIONS_OF_SWEEP,
        help="More realizations reveal smaller differences, and take proportionally longer.",
        **bound_to(state.sweep, "n_realizations", state.change_sweep),
    )
    problem = planning.sweep_problem(state) or state.page(SweepState).message
    if problem:
        st.warning(plain(problem))
    else:
        step_note(planning.describe_plan(state, planning.plan_of(state)))
    _sweep_button(state, "sweep")


def _draw_range(state: State, name: str, values: list[Any], chosen: list[Any]) -> None:
    def write(new: list[Any]) -> None:
        ranges = dict(state.sweep.ranges) | {name: tuple(new)}
        state.change_sweep(ranges=tuple(ranges.items()))

    # the key contains the values, so that a widget with new values gets a new state
    field(
        st.pills,
        planning.RANGE_LABELS[name],
        key=f"range_{name}_{'_'.join(map(str, values))}",
        value=chosen,
        write=write,
        options=values,
        format_func=str.upper if name == "method" else str,
        selection_mode="multi",
        width="stretch",
        help=PARAMETER_ROWS[name.removesuffix(ALONG_Z)]["meaning"],
    )


def _sweep_button(state: State, key: str) -> None:
    """Draw the button that starts the sweep; if no sweep can start, write the reason."""
    problem, going = planning.sweep_problem(state), state.page(SweepState).going
    n = 0 if problem else len(planning.plan_of(state))
    text = f"Try {n} settings" if n > 1 else "Try this setting" if n else "Try settings"
    button(
        text,
        key=key,
        on_click=planning.start_sweep,
        args=(state,),
        type="primary",
        width="stretch",
        disabled=bool(problem) or going,
        help="A sweep is running." if going else problem or None,
    )


@st.fragment
def _draw_results(state: State) -> None:
    """Draw the results of the finished settings; choosing a setting redraws only the results."""
    with error_boundary():
        run = state.page(SweepState).run
        assert run is not None
        results = run.latest_result
        if results.rows:
            _draw_rows(state, run, results)
        elif run.going:
            panel_title("Settings", "settings appear as soon as they are finished")
            draw_settings(_to_come(run.settings, varied(run.settings), "to come"), run.grid)


def _draw_rows(state: State, run: SweepRun, results: Sweep) -> None:
    tried = run.settings if run.going else [row.parameters for row in results.rows]
    choice, chosen = sweep.recommended(results), state.page(SweepState).chosen
    k = choice.index if chosen is None else min(chosen, len(results.rows) - 1)
    names, marked = varied(tried), (k, choice.index)
    best = results.rows[choice.index].parameters
    draw_caption(
        f"{describe_inputs(run.first)}; {plural(len(results.rows), 'setting')}, recommended: "
        f"{label(best, names)}; {plural(run.n_realizations, 'realization')} each, "
        f"seed {run.first.seed}"
    )
    with in_row("choice", gap="medium"):
        so_far = " so far" if run.going or results.stopped else ""
        title = f"<b>Recommended{so_far}: {escape(label(best, names))}</b>"
        st.html(f'<p class="facts choice">{title} {escape(choice.reason)}</p>')
        use_button(
            "Use this one",
            "use_recommended",
            on_click=planning.use_swept_setting,
            args=(state, best),
            help=USE_HELP,
        )
    with st.container(key="maps"):
        left, middle, right = st.columns(SWEEP_WIDTHS, gap="medium")
    with left:
        _draw_chart(state, run, results, names, marked)
    with middle:
        draw_large_realization(state, run, k)
    with right:
        draw_setting_numbers(state, run, k)
    with in_row("tiles_row"):
        of_what = "a layer of one realization" if run.grid.is_volume else "one realization"
        panel_title("Settings", f"{of_what} of each setting; click a setting to see it large")
        name = f"{grid_part(run.training_image, run.grid)}_seed{run.first.seed}_sweep.csv"
        content = partial(sweep_csv, results, choice.index)
        download("Table, CSV", content, name, key="sweep_csv", width="content")
    tiles = [setting_tile(run, j, names, choice.index) for j in range(len(results.rows))]
    if run.going:
        tiles += _to_come(run.settings[len(tiles) :], names, "to come")
    draw_settings(tiles, run.grid, k, lambda number: choose_setting(state, number))
    if not run.going:
        draw_sweep_table(results)


def _draw_chart(
    state: State, run: SweepRun, results: Sweep, names: list[str], marked: tuple[int, int]
) -> None:
    """Draw errors against CPU time; a click on a point shows the setting large."""
    kinds = [kind for kind in ERROR_LABELS if kind != "mended" or run.first.hard_data.n]
    kind = state.sweep.error if state.sweep.error in kinds else "patterns"
    with st.container(key="panel_sweep"):
        with in_row("title_sweep", "top"):
            field(
                st.selectbox,
                "Error",
                key="sweep_error",
                options=kinds,
                format_func=lambda key: ERROR_LABELS[key][0],
                label_visibility="collapsed",
                width=220,
                **bound_to(state.sweep, "error", state.change_sweep, value=kind),
            )
            chart_menu("Time against error", "sweep")
        errors = results.errors(kind)
        chart = sweep_chart(
            1000 * results.times,
            errors,
            [label(row.parameters, names) for row in results.rows],
            chart_theme(),
            front=sweep.pareto_front(results.times, errors),
            selected=marked[0],
            recommended=marked[1],
            y_title=ERROR_LABELS[kind][1],
            spreads=results.spreads(kind),
            height=SWEEP_CHART_HEIGHT,
        )
        alt = "Settings by CPU time and error; a line joins the Pareto front"
        draw_clickable_chart(chart, "sweep", alt, lambda k: choose_setting(state, k))


def _draw_outlines() -> None:
    """Draw outlines in place of results before the first sweep."""
    outlines = {
        "Time against error": page_text("Time against error"),
        "One setting": "A click on a setting shows a large realization with the hard data",
        "Its numbers": "Patterns, connectivity, proportions, copying, data, CPU time, and best "
        "values",
    }
    with st.container(key="maps"):
        columns = st.columns(SWEEP_WIDTHS, gap="medium")
    for column, (title, text) in zip(columns, outlines.items(), strict=True):
        with column:
            ghost_panel(text, f"height: {SWEEP_CHART_HEIGHT}px", title)


def choose_setting(state: State, number: int) -> None:
    """Select the setting that the page shows large."""
    page_state = state.page(SweepState)
    run = page_state.run
    if run is not None and 0 <= number < len(run.latest_result.rows):
        page_state.chosen, page_state.shown = number, 0


def is_current_sweep(run: SweepRun, state: State) -> bool:
    """Return whether a sweep belongs to the current study."""
    return run.key == if_possible(lambda: study_key(state.choices))


def draw_large_realization(state: State, run: SweepRun, k: int) -> None:
    """Draw a large picture of a realization of a setting, with buttons for other realizations."""
    page_state = state.page(SweepState)
    row, image = run.latest_result.rows[k], run.training_image
    n = len(row.realizations)
    r = page_state.shown = min(page_state.shown, n - 1)
    with in_row("shown_row"):
        panel_title(f"Realization {r + 1} of {run.n_realizations}")
        step_buttons("swept", page_state, n, f"; only the first {n} are stored")
    alt = f"Realization {r + 1} of {label(row.parameters, RANGED)}"
    realization = row.realizations[r]
    cell_map = facies_map(indices_of(realization, image), image, run.colours, alt)
    cell_map = with_data(state, cell_map, run.first.hard_data, image, realization)
    grid, max_height = (run.grid, 300) if run.grid.is_volume else (None, 392)
    draw_cells(cell_map, "swept", grid=grid, name="setting", max_height=max_height, body=False)


def draw_setting_numbers(state: State, run: SweepRun, k: int) -> None:
    """Draw the numbers of a setting, the best values, and the button that uses the setting."""
    rows = run.latest_result.rows
    panel_title("Its numbers")
    names = [name for name in RANGED if name != "search_fraction" or name in varied(run.settings)]
    st.html(f'<p class="setting">{escape(label(rows[k].parameters, names))}</p>')
    lines = [
        (escape(name), value, best) for name, value, best in setting_numbers(rows[k], rows, run)
    ]
    st.html(numbers_table(lines, ("", "here", "best")))
    use_button(
        "Use this setting",
        "use_setting",
        on_click=planning.use_swept_setting,
        args=(state, rows[k].parameters),
        help=USE_HELP,
        type="primary",
    )


def setting_numbers(
    row: SweepRow, rows: tuple[SweepRow, ...], run: SweepRun
) -> list[tuple[str, str, str]]:
    """Return rows (name, value ± spread between realizations, best value among all settings)."""
    image, here, n = run.training_image, _numbers(row), run.first.hard_data.n
    worst = image.names_by_code[row.quality.proportion_facies]
    table = [_numbers(other) for other in rows]

    def line(
        name: str,
        column: str,
        spread: str = "",
        scale: float = 1,
        best: Callable[[list[float]], float] = min,
    ) -> tuple[str, str, str]:
        values = [scale * numbers[column] for numbers in table]
        defined = [value for value in values if not np.isnan(value)]
        text = three_digits(scale * here[column])
        if spread and not np.isnan(here[spread]):
            text += f" ± {two(scale * here[spread])}"
        return name, minus(text), minus(three_digits(best(defined))) if defined else "–"

    lines = [line("Patterns, mean (bits)", "patterns", "pattern_spread")]
    lines += [line(f"… {column.removeprefix('pattern_')}", column) for column in PATTERN_COLUMNS]
    for direction, axis in zip(CURVE_DIRECTIONS, ("E–W", "N–S", "vertical"), strict=True):
        if (error := f"tau_error_{direction}") in here:
            name = f"τ {axis} of {image.facies_names[run.facies]}, error"
            lines.append(line(name, error, f"tau_spread_{direction}"))
    lines.append(
        line(
            f"{worst}, relative to TI (%)",
            "proportion_error",
            "proportion_spread",
            scale=100,
            best=lambda values: min(values, key=abs),
        )
    )
    lines.append(line("Largest copy (cells)", "largest_copied", "copied_spread"))
    if row.quality.n > 1:
        lines.append(line("Differing cells (%)", "differing", scale=100, best=max))
    if n:
        lines.append(line(f"Re-simulated, of {n}", "corrected"))
        lines.append(line("Data not honoured", "not_honoured"))
    return [*lines, line("CPU time (ms)", "cpu_ms")]


def _numbers(row: SweepRow) -> dict[str, Any]:
    """Return the numbers of the table, and two sums that only the shown setting has."""
    q = row.quality
    sums = {"patterns": q.pattern_distance, "corrected": q.n_resimulated + q.n_forced}
    return row_numbers(row) | sums


def two(spread: float) -> str:
    """Return a standard deviation as text with two digits and without powers of ten."""
    return f"{spread:.2g}" if spread < 100 else f"{spread:.0f}"


def _to_come(
    settings: Sequence[Parameters], names: list[str], note: str = ""
) -> list[dict[str, Any]]:
    """Return outlines for the settings that have not been tried yet."""
    return [
        {"label": text, "note": note, "name": f"Setting {text}", "disabled": True}
        for text in (label(p, names) for p in settings)
    ]


def draw_settings(
    tiles: list[dict[str, Any]],
    grid: Grid,
    shown: int = -1,
    choose: Callable[[int], None] = lambda _: None,
) -> None:
    """Draw the tiles of settings; `choose` is called with the number of a clicked setting."""
    width, height = tile_size(grid.shape[-2:], TILE_PIXELS)
    draw_tiles(
        TILES,
        "Settings; arrow keys choose",
        tiles,
        lambda k: choose(int(k)),
        kind="settings",
        shown=shown,
        arrows="choose",
        width=width,
        height=height,
    )


def draw_sweep_table(results: Sweep) -> None:
    """Draw a table with all numbers of the finished settings."""
    with st.expander("All numbers", key="sweep_table"):
        rows = [row_numbers(row) for row in results.rows]
        table = {
            HEADS.get(name) or RANGED.get(name) or name: [row[name] for row in rows]
            for name in rows[0]
        }
        number = st.column_config.NumberColumn
        formats = {
            head: number(format="%.4f" if name.startswith("pattern") else "%.3g")
            for name, head in HEADS.items()
        }
        st.dataframe(table, hide_index=True, column_config=formats)


def row_numbers(row: SweepRow) -> dict[str, Any]:
    """Return the parameters and all numbers of a setting, by name."""
    q = row.quality
    values = {name: value_of(row.parameters, name) for name in RANGED}
    directions = CURVE_DIRECTIONS[: len(q.tau_errors)]
    return {
        **{name: value for name, value in values.items() if value is not None},
        **dict(zip(PATTERN_COLUMNS, q.pattern_distances, strict=True)),
        **{
            f"tau_error_{direction}": error
            for direction, error in zip(directions, q.tau_errors, strict=True)
        },
        "proportion_error": q.proportion_error,
        "proportion_facies": q.proportion_facies,
        "largest_copied": q.largest_copied,
        "pattern_spread": q.pattern_spread,
        **{
            f"tau_spread_{direction}": spread
            for direction, spread in zip(directions, q.tau_spreads, strict=True)
        },
        "proportion_spread": q.proportion_spread,
        "copied_spread": q.copied_spread,
        "differing": q.differing,
        "mended": q.n_resimulated,
        "forced": q.n_forced,
        "not_honoured": q.n_mismatched,
        "cpu_ms": 1000 * q.cpu_seconds,
    }


def sweep_csv(results: Sweep, best: int) -> bytes:
    """Return CSV with a line per setting: parameters, numbers, Pareto front, recommendation."""
    front = set(sweep.pareto_front(results.times, results.errors()).tolist())
    return records_as_csv(
        [
            row_numbers(row) | {"on_front": int(k in front), "recommended": int(k == best)}
            for k, row in enumerate(results.rows)
        ]
    )
