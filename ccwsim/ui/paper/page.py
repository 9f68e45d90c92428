"""The page Paper: introduction, controls, and the paper's experiments with verdicts."""

import dataclasses
import os
from collections.abc import Sequence
from datetime import date
from html import escape

import streamlit as st

from ccwsim import CCWSIMError
from ccwsim.jobs.job import Job
from ccwsim.jobs.limits import Demand
from ccwsim.model import MAX_SEED, duration, format_bytes
from ccwsim.paper import reproduction
from ccwsim.paper.experiment import FILES_VARIABLE, FULL, QUICK, PaperInputs, inputs_in
from ccwsim.paper.reproduction import EXPERIMENTS, Finished, Reproduction
from ccwsim.report.document import report_html
from ccwsim.system.log import reason
from ccwsim.ui.session import PageRun, RunState, State, compilation_to_come, follow
from ccwsim.ui.study.run import SAME_SEED
from ccwsim.ui.widgets import (
    bound_to,
    button,
    download,
    draw_style,
    field,
    in_row,
    options_of,
    page_text,
    plain,
    step_note,
)

EXTENTS = {False: "Full", True: "Quick"}
EXPERIMENT_BYTES_PER_CELL = 8
"""Bytes of memory per simulated cell that an experiment needs, with statistics and pictures."""


@dataclasses.dataclass
class PaperRun(PageRun[Reproduction]):
    """A run of all experiments, with the finished ones and, at the end, the report as HTML."""

    inputs: PaperInputs
    quick: bool
    seed: int
    finished: list[Finished] = dataclasses.field(default_factory=list)
    report: bytes = b""
    unit = "experiments"

    @property
    def n_pieces(self) -> int:
        """Number of experiments."""
        return len(EXPERIMENTS)

    def demand(self) -> Demand:
        """Return the resources of the largest experiment, because experiments run one at a time."""
        x = QUICK if self.quick else FULL
        many, few = x.side(512) ** 2 * x.n_many, x.largest_side**2 * x.n_few
        n_cells = max(many, few, max(x.timed_sides) ** 2 * x.n_timed)
        return Demand(n_cells, 0, EXPERIMENT_BYTES_PER_CELL * n_cells)

    def work(self, job: Job[Reproduction]) -> Reproduction:
        extent, on_finished = QUICK if self.quick else FULL, self.finished.append
        reproduced = reproduction.reproduce(
            self.inputs,
            extent,
            self.seed,
            progress=job.report,
            cancel=job.is_cancelled,
            experiments=EXPERIMENTS,
            on_finished=on_finished,
        )
        if reproduced.finished:
            self.report = report_html(reproduction.document_of(reproduced)).encode()
        return reproduced


@dataclasses.dataclass
class PaperState(RunState[PaperRun]):
    """The state of the page, with the extent and the seed of the next run."""

    quick: bool = False
    seed: int = 0


def server_inputs() -> tuple[PaperInputs, str]:
    """Return the authors' inputs on the server, and a text about any problem with their folder."""
    folder = os.environ.get(FILES_VARIABLE)
    try:
        return inputs_in(folder or None), ""
    except CCWSIMError as error:
        problem = f"{FILES_VARIABLE} on the server: {error}. The bundled images are used."
        return PaperInputs(), problem


def draw_paper(state: State) -> None:
    """Draw introduction, controls, and the experiments with their verdicts."""
    page_state = state.page(PaperState)
    draw_style("paper/paper.css")
    st.html('<h2 class="part">The paper’s experiments, run again</h2>')
    step_note(page_text("The paper's experiments"))
    inputs, problem = server_inputs()
    step_note(describe_source(inputs))
    if problem:
        st.warning(plain(problem))
    run = page_state.run
    if not page_state.going:
        _controls(state)
    if page_state.message:
        st.warning(plain(page_state.message))
    with st.container(key="results"):
        if run is not None and run.job is not None and run.going:
            follow(
                run.job,
                label=lambda: progress_label(run),
                draw=lambda: st.html(verdict_list(run.finished)),
                keys=("progress", "paper_cancel"),
            )
            return
        if run is not None:
            _draw_end(run)
        st.html(verdict_list(run.finished if run is not None else []))


def start_experiments(state: State) -> None:
    """Start a run; a session has at most one run at a time."""
    page_state = state.page(PaperState)
    if page_state.going:
        return
    inputs, _ = server_inputs()
    page_state.start(lambda: PaperRun(inputs, page_state.quick, page_state.seed))


def _controls(state: State) -> None:
    page_state = state.page(PaperState)
    with in_row("controls_paper", "bottom"):
        field(
            st.segmented_control,
            "Extent",
            key="paper_extent",
            help=page_text("Quick runs"),
            **bound_to(page_state, "quick"),
            **options_of(EXTENTS),
        )
        field(
            st.number_input,
            "Seed",
            key="paper_seed",
            min_value=0,
            max_value=MAX_SEED,
            step=1,
            width=120,
            help=SAME_SEED,
            **bound_to(page_state, "seed"),
        )
        button(
            "Run the experiments" if page_state.run is None else "Run again",
            key="paper_start",
            on_click=start_experiments,
            args=(state,),
            type="primary",
        )
        seconds = reproduction.usual_seconds(QUICK if page_state.quick else FULL)
        takes = (
            f"{len(EXPERIMENTS)} experiments, about {duration(seconds, rough=True)} on two cores."
        )
        st.html(f'<span class="takes">{takes}{compilation_to_come()}</span>')


def _draw_end(run: PaperRun) -> None:
    with in_row("paper_end"):
        words = ended_text(run)
        if run.error is not None:
            st.error(plain(words))
        else:
            st.html(f'<p class="facts ran">{words}</p>')
        if run.report:
            label = f"Download the report ({format_bytes(len(run.report))})"
            name = f"ccwsim-paper-{date.today()}.html"
            download(label, run.report, name, key="download_paper", type="primary")


def describe_source(inputs: PaperInputs) -> str:
    """Describe the source of the experiments' images and data."""
    if inputs.folder is None:
        return "On the bundled training images and data, in place of the authors’."
    return "On the authors’ training images and data, which this server has."


def progress_label(run: PaperRun) -> str:
    """Return the number of finished experiments and the title of the running experiment."""
    n = len(run.finished)
    if n >= len(EXPERIMENTS):
        return "Writing the report …"
    return f"{n} of {len(EXPERIMENTS)} experiments · now {EXPERIMENTS[n].title}"


def ended_text(run: PaperRun) -> str:
    """Describe how a run ended; empty during the run."""
    if run.error is not None:
        return f"The run ended early: {reason(run.error)}"
    if run.result is None:
        return ""
    stopped = "Stopped. " if run.result.stopped else ""
    return f"{stopped}{reproduction.reproduction_summary(run.result)}"


def verdict_list(finished: Sequence[Finished]) -> str:
    """Return all experiments as an HTML list; finished experiments unfold, others are dimmed."""
    items = []
    for k, experiment in enumerate(EXPERIMENTS):
        line = f"<b>{k + 1}</b><i>{escape(experiment.title)}</i><em>{escape(experiment.place)}</em>"
        if k >= len(finished):
            items.append(f'<div class="coming">{line}</div>')
            continue
        inside = _judged(finished[k])
        items.append(
            f"<details><summary>{line}<u>{_verdict(finished[k])}</u></summary>{inside}</details>"
        )
    return f'<div class="verdicts">{"".join(items)}</div>'


def _judged(finished: Finished) -> str:
    if finished.outcome is None:
        return ""
    rows = "".join(
        f"<tr><td>{escape(j.claim)}</td><td>{escape(j.finding)}</td>"
        f'<td class="{j.tone}">{escape(j.word)}</td></tr>'
        for j in finished.outcome.judgements
    )
    return f"<table><tr><th>The paper says</th><th>Found here</th><th></th></tr>{rows}</table>"


def _verdict(finished: Finished) -> str:
    if finished.outcome is None:
        return f'<span class="bad">{escape(reproduction.verdict_of(finished))}</span>'
    tones = {j.word: j.tone for j in finished.outcome.judgements}
    return ", ".join(
        f'<span class="{tones[part.split(" × ")[-1]]}">{escape(part)}</span>'
        for part in reproduction.verdict_of(finished).split(", ")
    )
