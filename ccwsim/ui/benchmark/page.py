"""The page Benchmark: two measurements, each with its controls above its results."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
import streamlit as st

from ccwsim.experiments.trials import TrialResult
from ccwsim.figures import TimeSeries, timings_chart
from ccwsim.model.arrays import describe_shape
from ccwsim.model.bounds import MAX_REALIZATIONS_TIMED
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.numbers import format_bytes
from ccwsim.paper import published_times as published
from ccwsim.paper.times import paper_series
from ccwsim.system.machine import this_machine
from ccwsim.ui.benchmark import findings, measurement
from ccwsim.ui.benchmark.measurement import SIDES, Benchmark, Kind
from ccwsim.ui.results.charts import draw_caption, titled_chart
from ccwsim.ui.session.file_names import image_part
from ccwsim.ui.session.fragments import follow
from ccwsim.ui.session.state import State
from ccwsim.ui.study.trials import describe_work
from ccwsim.ui.widgets.errors import if_possible
from ccwsim.ui.widgets.fields import bound_to, button, download, field, options_of
from ccwsim.ui.widgets.text import page_text, panel_title, plain, step_note
from ccwsim.ui.widgets.theme import chart_theme, draw_style

MIN_BYTES_TOLD = 50e6  # minimum memory use, in bytes, that the description of a run mentions
MICRO = 1e6
SMALLEST_TIME = 1e-6  # in seconds or in microseconds per cell, for logarithmic axes


def draw_benchmark(state: State) -> None:
    """Draw the two measurements of the page."""
    page_state = state.page(Benchmark)
    draw_style("benchmark/benchmark.css")
    with st.container(horizontal=True, vertical_alignment="center", key="machine_row"):
        st.html(f'<p class="facts machine">This machine: {this_machine()}</p>')
        runs = [run for run in page_state.runs if run.rows]
        if runs and not page_state.running:
            content = partial(findings.timings_csv, runs, str(this_machine()))
            images = sorted({image_part(run.main.training_image) for run in runs})
            name = f"{'_'.join(images)}_times.csv"
            download("Download CSV", content, name, key="download_times")
    step_note(page_text("What can be compared"))
    for part in (page_state.grids, page_state.data):
        if part.message:
            st.error(plain(part.message))
    for kind, (title, place, draw_sizes) in PARTS.items():
        st.html(f'<h2 class="part">{title} <span>as in {place}</span></h2>')
        with st.container(
            horizontal=True, vertical_alignment="bottom", gap="medium", key=f"controls_{kind}"
        ):
            draw_sizes(state)
            _draw_choices(state, kind)
            _draw_start(state, kind)
        _draw_part(state, kind)


def _draw_largest(state: State) -> None:
    page_state, nz = state.page(Benchmark), measurement.layers_of(state)
    if nz is None:
        sides = measurement.side_options(this_machine().free_bytes)
        page_state.largest = min(page_state.largest, sides[-1])
        _draw_side(state, "Largest grid", "largest", sides, page_text("Timed grids"), width=150)
        return
    first, *sides = measurement.VOLUME_SIDES
    tip = f"Volumes of {nz} layers from {first} × {first} to this size."
    _draw_side(state, "Largest grid", "largest_volume", sides, tip, width=170)
    field(
        st.checkbox,
        "Maps beside",
        key="maps",
        help="Also measure maps of the image's middle layer, with as many cells as the volumes.",
        **bound_to(page_state, "maps"),
    )


def _draw_numbers(state: State) -> None:
    page_state, nz = state.page(Benchmark), measurement.layers_of(state)
    if nz is None:
        name, sides, width = "side", measurement.DATA_SIDES, 130
        tip = "The paper's Table 2 uses 512 × 512 cells."
    else:
        name, sides, width = "side_volume", measurement.DATA_SIDES_VOLUME, 170
        tip = "Size of the volume with the data. The paper has no times for volumes."
    _draw_side(state, "Grid", name, sides, tip, width=width, key=f"data_{name}")
    _draw_pills(
        page_state,
        "numbers",
        "Hard data",
        measurement.number_options(getattr(page_state, name), nz),
        format_func=lambda n: str(n or "none"),
        help="Data are sampled from an unconditional realization at random cells.",
    )


def _draw_side(
    state: State, label: str, name: str, sides: Sequence[int], tip: str, width: int, key: str = ""
) -> None:
    """Draw the field of the attribute `name`, the side of a square map or of square layers."""
    nz = measurement.layers_of(state)
    names = {side: describe_shape(measurement.shape_of(side, nz)) for side in sides}
    field(
        st.selectbox,
        label,
        key=key or name,
        **bound_to(state.page(Benchmark), name, width=width, help=tip),
        **options_of(names),
    )


def _draw_choices(state: State, kind: Kind) -> None:
    page_state, which = state.page(Benchmark), kind.removesuffix("s")
    methods, levels = measurement.TIMED_METHODS, measurement.level_options(state)
    _draw_pills(page_state, f"{which}_methods", "Methods", methods, format_func=str.upper)
    _draw_pills(page_state, f"{which}_levels", "Levels", levels, help=page_text("Timed levels"))


def _draw_pills(
    page_state: Benchmark, name: str, label: str, offered: Sequence[Any], **options: Any
) -> None:
    """Draw pills for a list of choices; selected values that are unavailable are not shown."""
    chosen = [value for value in getattr(page_state, name) if value in offered]
    field(
        st.pills,
        label,
        key=name,
        options=offered,
        selection_mode="multi",
        width="content",
        **bound_to(page_state, name, value=chosen),
        **options,
    )


def _draw_start(state: State, kind: Kind) -> None:
    page_state = state.page(Benchmark)
    field(
        st.number_input,
        "Realizations each",
        key=f"{kind}_realizations",
        min_value=1,
        max_value=MAX_REALIZATIONS_TIMED,
        width=140,
        help="The median time is shown. More realizations give a steadier median and take longer.",
        **bound_to(page_state, "n_realizations"),
    )
    button(
        "Measure",
        key=f"measure_{kind}",
        on_click=measurement.start_timing,
        args=(state, kind),
        type="primary",
        disabled=page_state.running is not None,
    )


def _describe_plan(state: State, kind: Kind) -> str:
    """Describe the planned run, or name a missing choice."""
    page_state = state.page(Benchmark)
    try:
        trials = measurement.trials_of(state, kind)
    except CCWSIMError as error:
        return str(error)
    seconds = measurement.expected(state, trials)
    text = describe_work(len(trials), page_state.n_realizations, seconds)
    n_bytes = max(trial.grid.n_cells for trial in trials) * measurement.BYTES_PER_CELL
    if n_bytes > MIN_BYTES_TOLD:
        text += f" Up to {format_bytes(n_bytes)} of memory."
    if page_state.running not in (None, page_state.of(kind).run):
        text += " Another measurement is running; two at once would slow each other down."
    return text


def _draw_part(state: State, kind: Kind) -> None:
    """Draw a measurement with a description; update the drawing while the measurement runs."""
    step_note(_describe_plan(state, kind))
    run = state.page(Benchmark).of(kind).run

    def draw() -> None:
        if run and run.disturbed:
            step_note(page_text("Disturbed measurement"))
        draw_results = _draw_grids if kind == "grids" else _draw_data
        draw_results(state)

    with st.container(key=f"part_{kind}"):
        if run and run.job and run.going:
            keys = (f"progress_{kind}", f"cancel_{kind}")
            follow(run.job, label=run.label, draw=draw, keys=keys)
            return
        if run and (end := run.describe_end()):
            st.warning(plain(end))
        draw()


def _draw_grids(state: State) -> None:
    """Draw times against grid size, or outlines before the first run."""
    run = state.page(Benchmark).grids.run
    timings = list(run.rows) if run else []
    ticks = ticks_of(timings, measurement.layers_of(state) is not None)
    draw_caption(findings.describe_run(run))
    left, right = st.columns(2, gap="medium")
    with left:
        note = "red: the paper, another machine" if has_paper(timings) else "maps dashed"
        _draw_chart(timings, ticks, "CPU time of a realization", note, per_cell=False)
    with right:
        _draw_chart(timings, ticks, "CPU time a cell", "flat: linear growth", per_cell=True)
    if not timings:
        step_note(page_text("Before the first measurement"))
        return
    left, right = st.columns(2, gap="medium")
    with left:
        st.html(findings.grid_table(timings))
    with right:
        step_note("\n".join(findings.growth_lines(timings)) or "Growth needs at least two sizes.")
        step_note(findings.describe_run(run))


def _draw_chart(
    timings: Sequence[TrialResult], ticks: dict[int, str], title: str, note: str, per_cell: bool
) -> None:
    paper = paper_series(per_cell) if has_paper(timings) else []
    unit, key = ("µs", "times_cell") if per_cell else ("s", "times_grid")
    chart = timings_chart(
        measured_series(timings, per_cell),
        paper,
        ticks,
        chart_theme(),
        y_title=f"CPU time {'a cell ' if per_cell else ''}({unit})",
        unit=unit,
    )
    titled_chart(title, note, chart, key, f"{title} against the number of cells of the grid")


def has_paper(timings: Sequence[TrialResult]) -> bool:
    """Return whether the paper's times can be shown; the paper has times only for maps."""
    return all(t.trial.grid.n_dimensions == 2 for t in timings)


def ticks_of(timings: Sequence[TrialResult], volumes: bool) -> dict[int, str]:
    """Return the ticks of the axis of cell numbers: sizes of square grids or powers of ten."""
    if has_paper(timings) and not (volumes and not timings):
        sides = {t.trial.grid.nx for t in timings} | {SIDES[0], SIDES[1], SIDES[3], SIDES[-1]}
        return {side**2: f"{side}²" for side in sorted(sides)}
    numbers = [t.trial.grid.n_cells for t in timings] or [10**5, 10**7]
    low, high = int(np.log10(min(numbers))), int(np.ceil(np.log10(max(numbers))))
    return {10**k: f"{10**k:,}" for k in range(low, high + 1)}


def _draw_data(state: State) -> None:
    """Draw the times by number of data, in the layout of Table 2."""
    run = state.page(Benchmark).data.run
    planned = if_possible(lambda: measurement.trials_of(state, "data")) if run is None else None
    trials = run.trials if run is not None else planned or []
    timings = list(run.rows) if run is not None else []
    shape = run.grid.shape if run is not None else measurement.shape_of_data(state)
    panel_title("CPU time of a realization", f"{describe_shape(shape)} cells")
    st.html(findings.data_table(timings, trials))
    step_note(page_text("Table 2"))
    if timings:
        step_note(findings.describe_run(run))
    with st.expander("The published codes in GNU Octave: times, and data not honoured"):
        step_note(f"{published.OCTAVE.reference}.\n{published.OCTAVE.machine}.")
        st.html(findings.octave_table())


def measured_series(timings: Sequence[TrialResult], per_cell: bool) -> list[TimeSeries]:
    """Return one line per setting, in seconds or in microseconds per cell."""
    groups, lines = findings.by_setting(timings), []
    for setting, group in groups.items():
        values = [MICRO * t.seconds_per_cell if per_cell else t.seconds for t in group]
        beside_volumes = not setting[2] and not has_paper(timings)
        lines.append(
            TimeSeries(
                findings.name_of(setting, list(groups)),
                setting[1],
                cells=np.array([t.trial.grid.n_cells for t in group], float),
                values=np.maximum(values, SMALLEST_TIME),
                dashed=setting[0] != "ccwsim" or beside_volumes,
            )
        )
    return lines


PARTS: dict[Kind, tuple[str, str, Callable[[State], None]]] = {
    "grids": ("CPU time and the size of the grid", "Fig. 13", _draw_largest),
    "data": ("CPU time and the number of data", "Table 2", _draw_numbers),
}
"""Title, place in the paper, and controls of the sizes of each measurement."""
