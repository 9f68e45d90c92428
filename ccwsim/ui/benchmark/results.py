"""What was measured, beside what the paper reports."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import streamlit as st

from ccwsim.experiments.timing import Timing
from ccwsim.figures import TimeSeries, timings_chart
from ccwsim.paper import published_times as published
from ccwsim.ui.benchmark.run import TimingRun
from ccwsim.ui.benchmark.settings import NUMBERS, SIDES, settings
from ccwsim.ui.benchmark.state import Benchmark
from ccwsim.ui.benchmark.tables import data_table, grid_table, octave_table
from ccwsim.ui.benchmark.words import (
    Setting,
    by_setting,
    name_of,
    said_growth,
    said_levels,
    setting_of,
)
from ccwsim.ui.results.facies import pretty
from ccwsim.ui.results.titled_chart import titled_chart
from ccwsim.ui.session.state import State
from ccwsim.ui.widgets.steps import panel_title, step_note
from ccwsim.ui.widgets.theme import chart_theme

MICRO = 1e6
TEACHING = (
    "Press Measure: a line for each level will show how the time of one realization grows with "
    "the grid. Straight at slope one, and flat in the time a cell, is linear growth. The red "
    "markers are the paper's times, on another machine."
)


def draw_grids(state: State) -> None:
    """Draw times against the size of the grid, or where they will be."""
    run = state.page(Benchmark).grids
    timings = list(run.timings) if run else []
    sides = sorted({t.grid_shape[0] for t in timings} | {SIDES[0], SIDES[1], SIDES[3], SIDES[-1]})
    left, right = st.columns(2, gap="medium")
    for place, key, title, each, unit in (
        (left, "times_grid", "CPU time of a realization", False, "s"),
        (right, "times_cell", "CPU time a cell", True, "µs"),
    ):
        with place:
            chart = timings_chart(
                measured_series(timings, each), paper_series(each), sides, chart_theme(),
                y_title=f"CPU time {'a cell ' if each else ''}({unit})", unit=unit,
            )  # fmt: skip
            note = "flat is linear" if each else "red: the paper, another machine"
            titled_chart(title, note, chart, key, f"{title} against the cells of the grid")
    if not timings:
        step_note(TEACHING)
        return
    left, right = st.columns(2, gap="medium")
    with left:
        st.html(grid_table(timings, sides))
    with right:
        found = by_setting(timings)
        said = [said_growth(name_of(s, list(found)), own) for s, own in found.items()]
        said.append(said_levels(timings))
        step_note("\n".join(line for line in said if line) or "One size says nothing on growth.")
        step_note(about_run(run))


def draw_data(state: State) -> None:
    """Draw times against the number of data in the layout of Table 2."""
    page_state = state.page(Benchmark)
    own, run = page_state, page_state.data
    if run:
        chosen = list(dict.fromkeys(setting_of(case.parameters) for case in run.cases))
        numbers, side = sorted({case.n_data for case in run.cases}), run.cases[0].grid_shape[0]
        timings = list(run.timings)
    else:
        chosen, numbers, side, timings = asked(state), own.numbers, own.side, []
        numbers = [n for n in NUMBERS if n in numbers]
    panel_title("CPU time of a realization", f"{side} × {side} cells")
    st.html(data_table(timings, chosen, numbers, side))
    step_note(
        "wrong: data that a realization does not honour, here. paper: Table 2, channel training "
        "image, 512 × 512 cells, MATLAB on another machine; compare the last two columns. "
        "Here both methods are this program's own and compiled alike, and both mend the data "
        "until they are honoured, unless the study turns that off."
    )
    if run and timings:
        step_note(about_run(run))
    with st.expander("The published codes in GNU Octave: times, and data they leave wrong"):
        source = published.OCTAVE
        step_note(f"{source.reference}.\n{source.machine}.")
        st.html(octave_table())


def asked(state: State) -> list[Setting]:
    """Return the methods and levels that are chosen now, none where they do not fit."""
    own = state.page(Benchmark)
    if not own.data_levels or not own.data_methods:
        return []
    return [setting_of(p) for p in settings(state, own.data_methods, own.data_levels)]


def measured_series(timings: Sequence[Timing], each: bool) -> list[TimeSeries]:
    """Return a line for each setting: seconds, or microseconds of `each` cell."""
    found = by_setting(timings)
    lines = []
    for setting, own in found.items():
        cells = np.array([t.n_cells for t in own], float)
        values = np.array([t.seconds for t in own])
        values = np.maximum(values, 1e-6) / (cells / MICRO if each else 1.0)
        name = name_of(setting, list(found))
        lines.append(TimeSeries(name, setting[1], cells, values, setting[0] != "ccwsim"))
    return lines


def paper_series(each: bool) -> list[TimeSeries]:
    """Return the paper's times of its largest grid, by level."""
    series = []
    for t in published.FIGURE_13:
        cells = np.array([t.n_cells], float)
        values = np.array([t.cpu_seconds]) / (cells / MICRO if each else 1.0)
        series.append(TimeSeries(f"paper, level {t.level}", t.level or 0, cells, values))
    return series


def about_run(run: TimingRun | None) -> str:
    """Say what was timed."""
    if run is None:
        return ""
    image, p = run.training_image, run.cases[0].parameters
    ny, nx = image.shape
    steered = "" if p.exact_data else "; data only steer, wrong ones are not mended"
    return (
        f"Training image {pretty(image.name)}, {nx} × {ny} cells, {image.n_facies} facies; "
        f"template {p.template_size}, overlap {p.overlap_size}, K {p.n_candidates}; median of "
        f"{run.n_realizations}, turning the training image counts; one thread; seed {run.seed}"
        f"{steered}."
    )
