"""A large ensemble: thousands of realizations are simulated, but only statistics are stored."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
import streamlit as st

from ccwsim import Cancelled, Ensemble
from ccwsim.figures import Bundle, convergence_chart
from ccwsim.jobs.job import Job
from ccwsim.jobs.limits import Demand
from ccwsim.metrics import RunningStatistics, RunningSummary
from ccwsim.metrics.bands import Statistic, curves_of
from ccwsim.metrics.lags import DirectionName, axes_of, max_lag
from ccwsim.model.bounds import MAX_LARGE_ENSEMBLE
from ccwsim.model.numbers import format_bytes, three_digits
from ccwsim.model.study import Study
from ccwsim.model.watch import Cancel
from ccwsim.run.footprint import demand_of
from ccwsim.run.simulation import simulate_study
from ccwsim.system.machine import n_cores
from ccwsim.ui.results.charts import draw_statistic, titled_chart
from ccwsim.ui.session.fragments import follow
from ccwsim.ui.session.state import PageRun, RunState, State
from ccwsim.ui.study.run import failed
from ccwsim.ui.validate.conditioning import draw_e_type_maps
from ccwsim.ui.widgets import fields
from ccwsim.ui.widgets.fields import bound_to, button
from ccwsim.ui.widgets.text import page_text, plain, step_note
from ccwsim.ui.widgets.theme import chart_theme

CELLS_OF_BATCH = 4_000_000  # maximum number of cells in memory at a time; a cell takes one byte
SUMMARY_SECONDS = 1.0  # number of seconds between two summaries of a run
LOW, HIGH = 0.05, 0.95


@dataclass
class LargeEnsembleRun(PageRun[None]):
    """A large ensemble that is running or has ended.

    `facies` is the index of the facies shown in the curves, and `summary` is the latest summary.
    `errors` are the mean standard errors of the E-type after each number of realizations in
    `numbers`. `n_wrong` counts mismatches of data in all realizations; `nbytes` is the size of the
    statistics in bytes.
    """

    study: Study
    n: int
    facies: int
    summary: RunningSummary | None = None
    numbers: list[int] = field(default_factory=list)
    errors: list[float] = field(default_factory=list)
    n_wrong: int = 0
    nbytes: int = 0

    @property
    def n_pieces(self) -> int:
        """Number of realizations to simulate."""
        return self.n

    def demand(self) -> Demand:
        """Return the resources that the run demands; one batch is in memory at a time."""
        return demand_of(self.study, self.n, n_kept=self._n_batch)

    @property
    def _n_batch(self) -> int:
        return min(max(CELLS_OF_BATCH // self.study.grid.n_cells, 1), 4 * n_cores())

    def work(self, job: Job) -> None:
        grid, image = self.study.grid, self.study.training_image
        lags = min(max_lag(direction, grid.shape, image.shape) for direction in ("E-W", "N-S"))
        code = int(image.codes[self.facies])
        running = RunningStatistics(grid.shape, image.codes, [code], max_lag=lags)
        self.nbytes = running.nbytes
        n_batch, summed_at = self._n_batch, 0.0
        while running.n < self.n and not job.is_cancelled():
            self._add_batch(running, min(n_batch, self.n - running.n), job.is_cancelled)
            job.report(running.n / self.n, running.n)
            done = running.n == self.n or (job.is_cancelled() and self.summary is None)
            if running.n and (done or time.monotonic() - summed_at > SUMMARY_SECONDS):
                self.summary = running.summary(LOW, HIGH)
                p = self.summary.etype.probability[self.facies]
                self.numbers.append(running.n)
                self.errors.append(float(100 * np.sqrt(p * (1 - p) / running.n).mean()))
                summed_at = time.monotonic()

    def _add_batch(self, running: RunningStatistics, n: int, cancel: Cancel) -> None:
        try:
            ensemble = simulate_study(self.study, n, cancel=cancel, first_realization=running.n)
        except Cancelled:
            return
        for realization in ensemble:
            running.add(realization)
        self.n_wrong += int(ensemble.n_mismatched.sum())


@dataclass
class LargeEnsembleState(RunState[LargeEnsembleRun]):
    """The state of the section, with the number of realizations."""

    n: int = 1000


def draw_large_ensemble(state: State, ensemble: Ensemble, colours: Sequence[str]) -> None:
    """Draw the controls and the results of the latest large ensemble."""
    page_state = state.page(LargeEnsembleState)
    run = page_state.run
    step_note(page_text("Large ensemble"))
    with st.container(horizontal=True, vertical_alignment="bottom", gap="small", key="long_row"):
        fields.field(
            st.number_input,
            "Realizations",
            key="n_long",
            min_value=10,
            max_value=MAX_LARGE_ENSEMBLE,
            step=100,
            width=180,
            help="Four times as many realizations halve the errors of the probabilities.",
            **bound_to(page_state, "n"),
        )
        if not page_state.going:
            button("Start", key="long_start", type="primary", on_click=start, args=(state,))
    if page_state.message:
        st.warning(plain(page_state.message))
    if run is None:
        return
    draw = partial(_draw_run, run, state, colours)
    image, grid = run.study.training_image, run.study.grid
    if image.digest != ensemble.training_image.digest or grid != ensemble.grid:
        step_note("The latest large ensemble belongs to another study.")
    elif run.job is not None and run.going:
        follow(run.job, draw=draw, keys=("long_progress", "long_stop"), cancel="Stop")
    else:
        draw()


def start(state: State) -> None:
    """Start a large ensemble with the study of the present realizations."""
    page_state = state.page(LargeEnsembleState)
    assert state.ensemble is not None
    study = replace(state.ensemble.study, checked=True)
    n, facies = page_state.n, state.facies
    page_state.start(lambda: LargeEnsembleRun(study, n, facies))


def _draw_run(run: LargeEnsembleRun, state: State, colours: Sequence[str]) -> None:
    if run.error is not None:
        st.error(plain(f"The large ensemble ended early: {failed(run.error)}"))
    if (summary := run.summary) is None:
        return
    step_note(describe_summary(run, summary))
    assert state.ensemble is not None
    draw_e_type_maps(summary.etype, state, state.ensemble, colours, prefix="long_")
    name = run.study.training_image.facies_names[run.facies]
    curves: list[tuple[Statistic, DirectionName]] = [
        *(("variogram", direction) for direction in axes_of(run.study.grid.shape)),
        ("connectivity", "E-W"),
    ]
    columns = st.columns(len(curves) + 1, gap="medium")
    for column, (statistic, direction) in zip(columns, curves, strict=False):
        with column:
            draw_statistic(
                bundle_of_band(run, summary, statistic, direction),
                statistic,
                direction,
                name,
                note=f"{summary.n:,} realizations",
                y_range=None if statistic == "variogram" else (0, 1.04),
                prefix="long_",
            )
    with columns[-1]:
        chart = convergence_chart(run.numbers, run.errors, run.n, chart_theme(), height=196)
        note = f"± {three_digits(run.errors[-1])} % now"
        alt = "Error of the probabilities against the number of realizations"
        titled_chart("Convergence", note, chart, "convergence", alt)


def describe_summary(run: LargeEnsembleRun, summary: RunningSummary) -> str:
    """Describe the statistics of a large ensemble."""
    k, shares, image, n = run.facies, summary.proportions, run.study.training_image, run.n_wrong
    data_text = ""
    if run.study.hard_data.n:
        data_text = f" All {run.study.hard_data.n} data are honoured in every realization."
        if n:
            data_text = f" In total, {n:,} {'datum is' if n == 1 else 'data are'} not honoured."
    return page_text(
        "Summary of a large ensemble",
        n=summary.n,
        name=image.facies_names[k],
        image=100 * image.proportions[k],
        mean=100 * shares.mean[k],
        low=100 * shares.low[k],
        high=100 * shares.high[k],
        data=data_text,
        size=format_bytes(run.nbytes),
    )


def bundle_of_band(
    run: LargeEnsembleRun, summary: RunningSummary, statistic: Statistic, direction: DirectionName
) -> Bundle:
    """Return a bundle with a band but no single curves, for lags up to half the grid's side."""
    image, grid = run.study.training_image, run.study.grid
    code, longest = int(image.codes[run.facies]), max_lag(direction, image.shape, grid.shape)
    lags = summary.lags[summary.lags <= longest]
    reference = curves_of(statistic, image, code, direction, lags)[0]
    bands = summary.variograms if statistic == "variogram" else summary.connectivity
    band, n = bands[code, direction], len(lags)
    return Bundle(
        lags=lags.astype(float),
        reference=reference,
        each=np.empty((0, n)),
        low=band.low[:n],
        median=band.median[:n],
        high=band.high[:n],
    )
