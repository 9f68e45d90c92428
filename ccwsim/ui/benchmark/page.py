"""The page Benchmark: CPU time against one quantity of the study, beside the paper's times."""

from collections.abc import Callable
from dataclasses import dataclass, field as dataclass_field
from typing import Any

import streamlit as st

from ccwsim import CCWSIMError
from ccwsim.experiments import plan, timing
from ccwsim.experiments.trials import Trial, TrialResult
from ccwsim.figures import TimeSeries, timings_chart
from ccwsim.jobs.job import Job, server_queue
from ccwsim.jobs.limits import Demand
from ccwsim.model import MAX_REALIZATIONS_TIMED, describe_shape, duration, fitted, levels, plural
from ccwsim.paper.times import measured_series, paper_series
from ccwsim.system.machine import this_machine
from ccwsim.ui.results.charts import draw_caption, titled_chart
from ccwsim.ui.results.maps import pretty
from ccwsim.ui.session import RunState, State, image_of
from ccwsim.ui.study.trials import TrialsRun, describe_work, draw_run_news, trials_of
from ccwsim.ui.widgets import (
    bound_to,
    button,
    chart_theme,
    draw_style,
    field,
    in_row,
    numbers_table,
    options_of,
    page_text,
    scrolled,
    step_note,
)

QUANTITIES = {
    "n_cells": "cells of the grid",
    "n_data": "hard data",
    "template_size": "template T",
    "n_candidates": "candidates K",
}
OFFERED = {
    "n_cells": (256, 512, 1000, 2000, 3000, 5000),
    "n_data": (500, 1000, 2000, 4000),
    "template_size": (16, 24, 32, 48, 64, 96),
    "n_candidates": (1, 5, 20, 50, 100),
}
"""Values of each quantity, or sides of square grids; those of the paper are included."""
SIDES_OF_LAYERS = (48, 64, 100, 160, 256)
"""Sides of the layers of timed volumes, which have as many layers as the study's grid."""
N_CHOSEN = 3  # number of values that are measured unless the user chooses others
COARSEST = 3  # largest level that is timed
PAPER_NOTES = {
    "n_cells": "red: Fig. 13 of the paper, another machine",
    "n_data": "red: Table 2 of the paper (512 × 512 cells), another machine",
}


@dataclass(kw_only=True)
class TimingRun(TrialsRun[TrialResult, None]):
    """Trials timed against `varied`; `disturbed` is whether other sessions computed as well."""

    varied: str = "n_cells"
    disturbed: bool = False

    def n_kept(self, trial: Trial) -> int:
        return max(timing.CELLS_AT_ONCE // trial.grid.n_cells, 1)

    def demand(self) -> Demand:
        """Return the resources that the largest trial needs; one trial runs at a time."""
        n_bytes = max((demand.n_bytes for demand in self.demands(n_workers=1)), default=0)
        n_cells = sum(trial.grid.n_cells for trial in self.trials) * self.n_realizations
        return Demand(n_cells, max(trial.n_data for trial in self.trials), n_bytes)

    def work(self, job: Job) -> None:
        def report(fraction: float, n_done: int) -> None:
            self.disturbed = self.disturbed or server_queue().n_active > 1
            job.report(fraction, n_done)

        for timed in timing.time_trials(self.trials, self.n_realizations, report, job.is_cancelled):
            self.rows.append(timed)

    def describe(self) -> str:
        """Describe the inputs that are equal in all trials, and the machine."""
        image, grid = self.training_image, self.grid
        where = "" if self.varied == "n_cells" else f", grid {describe_shape(grid.shape)}"
        same = ("method", "template_size", "overlap_size", "n_candidates")
        setting = plan.label(self.settings[0], [name for name in same if name != self.varied])
        n = plural(self.n_realizations, "realization")
        return (
            f"{pretty(image.name)}, {describe_shape(image.shape)} cells{where}; {setting}; median "
            f"of {n} on one thread, including preparation of the training image; "
            f"seed {self.first.seed}; {this_machine()}."
        )


@dataclass
class Benchmark(RunState[TimingRun]):
    """The state of the page; `values` are the chosen ones among each tuple of offered values."""

    varied: str = "n_cells"
    values: dict[tuple[int, ...], list[int]] = dataclass_field(default_factory=dict)
    levels: list[int] = dataclass_field(default_factory=lambda: [1, 2, 3])
    n_realizations: int = 3


def offered_values(state: State) -> tuple[int, ...]:
    """Return the values of the varied quantity that the page offers."""
    varied = state.page(Benchmark).varied
    is_volume = state.grid.is_volume
    return SIDES_OF_LAYERS if varied == "n_cells" and is_volume else OFFERED[varied]


def chosen_values(state: State) -> list[int]:
    """Return the chosen values of the varied quantity, in increasing order."""
    offered = offered_values(state)
    return sorted(state.page(Benchmark).values.get(offered, offered[:N_CHOSEN]))


def timed_trials(state: State) -> list[Trial]:
    """Return the trials of the planned measurement; raise `CCWSIMError` if a choice is missing."""
    choices, page_state = state.choices, state.page(Benchmark)
    image, shape, seed = image_of(choices.image), choices.grid.shape, choices.seed
    varied, values = page_state.varied, chosen_values(state)
    if not values or not page_state.levels:
        raise CCWSIMError("Choose at least one value and one level.")
    ranges: dict[str, list[int]] = {"wavelet_level": sorted(page_state.levels)}
    if varied in plan.RANGED:
        ranges[varied] = values
    base = fitted(choices.parameters, image.shape)
    settings = plan.plan_sweep(base, ranges, image.shape).fitting
    if varied in plan.RANGED:
        return trials_of(choices, settings)
    if varied == "n_data":
        return timing.data_trials(image, shape, values, settings, seed)
    shapes = ((*shape[:-2], side, side) for side in values)
    return [t for shape in shapes for t in timing.data_trials(image, shape, [0], settings, seed)]


def start_timing(state: State) -> None:
    """Start the planned measurement; if it cannot start, earlier results remain on the page."""
    page_state = state.page(Benchmark)
    page_state.start(
        lambda: TimingRun(
            trials=timed_trials(state),
            n_realizations=page_state.n_realizations,
            varied=page_state.varied,
        )
    )


def draw_benchmark(state: State) -> None:
    """Draw the controls of a measurement and, below, its chart and table."""
    page_state = state.page(Benchmark)
    draw_style("benchmark/benchmark.css")
    st.html(f'<p class="facts machine">This machine: {this_machine()}</p>')
    step_note(page_text("What can be compared"))
    with in_row("controls_benchmark", "bottom", gap="medium"):
        _draw_controls(state)
    step_note(_describe_plan(state))
    run = page_state.run
    message = page_state.message or (run.describe_end() if run is not None else "")
    draw_run_news(run, message=message, keys=("benchmark_progress", "benchmark_cancel"))
    with st.container(key="results"):
        _draw_times(state)


def _draw_controls(state: State) -> None:
    page_state, offered = state.page(Benchmark), offered_values(state)
    field(
        st.selectbox,
        "CPU time against",
        key="benchmark_varied",
        **options_of(QUANTITIES),
        **bound_to(page_state, "varied", width=190),
    )

    def choose(values: list[int]) -> None:
        page_state.values[offered] = list(values)

    is_side = page_state.varied == "n_cells"
    _draw_pills("Sides" if is_side else "Values", offered, chosen_values(state), choose)
    possible = [k for k in levels(state.image.shape) if k <= COARSEST]
    write = bound_to(page_state, "levels")["write"]
    shown = [k for k in page_state.levels if k in possible]
    _draw_pills("Levels", possible, shown, write, help=page_text("Timed levels"))
    field(
        st.number_input,
        "Realizations each",
        key="benchmark_realizations",
        min_value=1,
        max_value=MAX_REALIZATIONS_TIMED,
        width=140,
        help="The median time is shown. More realizations give a steadier median and take longer.",
        **bound_to(page_state, "n_realizations"),
    )
    button(
        "Measure",
        key="measure",
        on_click=start_timing,
        args=(state,),
        type="primary",
        disabled=page_state.going,
    )


def _draw_pills(
    label: str,
    options: Any,
    value: list[int],
    write: Callable[[list[int]], None],
    **more: Any,
) -> None:
    # the key contains the options, so that a widget with new options gets a new state
    field(
        st.pills,
        label,
        key=f"timed_{label.lower()}_{'_'.join(map(str, options))}",
        value=value,
        write=write,
        options=options,
        selection_mode="multi",
        width="content",
        **more,
    )


def _describe_plan(state: State) -> str:
    """Describe the planned measurement, or name a missing choice."""
    page_state = state.page(Benchmark)
    try:
        trials = timed_trials(state)
    except CCWSIMError as error:
        return str(error)
    run, n = page_state.run, page_state.n_realizations
    is_same = run is not None and run.training_image.digest == trials[0].training_image.digest
    seconds = timing.expected_seconds(trials, n, list(run.rows) if run and is_same else ())
    return describe_work(len(trials), n, seconds)


def _draw_times(state: State) -> None:
    """Draw a chart and a table of times; before the first run, only those of the paper."""
    run = state.page(Benchmark).run
    varied = state.page(Benchmark).varied if run is None else run.varied
    grid = state.grid if run is None else run.grid
    p = state.choices.parameters if run is None else run.settings[0]
    measured = [] if run is None else measured_series(list(run.rows), varied)
    published = [] if grid.is_volume else paper_series(varied, p.method)
    if run is None:
        step_note(page_text("Before the first measurement"))
    elif run.disturbed:
        step_note(page_text("Disturbed measurement"))
    series = [*measured, *published]
    if not series:
        return
    sizes = sorted({int(size) for each in series for size in each.sizes})
    square = varied == "n_cells" and not grid.is_volume
    ticks = {size: f"{round(size**0.5)}²" if square else f"{size:,}" for size in sizes}
    description = "" if run is None else run.describe()
    draw_caption(description)
    left, right = st.columns(2, gap="medium")
    with left:
        title, x_title = "CPU time of a realization", QUANTITIES[varied]
        chart = timings_chart(measured, published, ticks, chart_theme(), x_title=x_title)
        note = PAPER_NOTES[varied] if published else ""
        titled_chart(title, note, chart, "benchmark", f"{title} against {x_title}")
    with right:
        st.html(times_table(series, ticks))
        step_note(describe_growth(measured, varied))
        step_note(description)


def times_table(series: list[TimeSeries], ticks: dict[int, str]) -> str:
    """Return an HTML table with a row for each size and a column for each series."""
    columns = [dict(zip(each.sizes, each.values, strict=True)) for each in series]
    rows = [
        [name, *(duration(times[size]) if size in times else "–" for times in columns)]
        for size, name in ticks.items()
    ]
    head = ["", *(each.name for each in series)]
    return scrolled(numbers_table(rows, head, "times"), "CPU times")


def describe_growth(measured: list[TimeSeries], varied: str) -> str:
    """Return how time grows with the varied quantity; empty without a line of two sizes."""
    powers = ", ".join(
        f"{timing.growth(each.sizes, each.values):.2f} ({each.name})"
        for each in measured
        if len(each.sizes) > 1
    )
    return f"Growth with {QUANTITIES[varied]}, as a power: {powers}; 1 is linear." if powers else ""
