"""The page of the paper, put together."""

from __future__ import annotations

from datetime import date
from pathlib import Path

import streamlit as st

from ccwsim.model.bounds import MAX_SEED
from ccwsim.model.errors import CCWSIMError
from ccwsim.paper import EXPERIMENTS
from ccwsim.ui.paper.run import PaperRun, PaperState, server_inputs
from ccwsim.ui.paper.words import (
    DURATIONS,
    INTRODUCTION,
    ended_text,
    progress_label,
    said_inputs,
    verdict_list,
)
from ccwsim.ui.session.fragments import follow
from ccwsim.ui.session.state import State
from ccwsim.ui.widgets.fields import button, field
from ccwsim.ui.widgets.literal import plain
from ccwsim.ui.widgets.steps import step_note

STYLE = Path(__file__).with_name("paper.css")
EXTENTS = {False: "Full", True: "Quick"}


def draw_paper(state: State) -> None:
    """Draw what will be done, the controls, and the experiments with their verdicts."""
    page_state = state.page(PaperState)
    st.html(f"<style>{STYLE.read_text('utf-8')}</style>")
    st.html('<h2 class="part">The paper’s experiments, run again</h2>')
    step_note(INTRODUCTION)
    inputs, problem = server_inputs()
    step_note(said_inputs(inputs))
    if problem:
        st.warning(plain(problem))
    run = page_state.run
    if run is None or not run.going:
        _controls(state)
    if page_state.message:
        st.warning(plain(page_state.message))
    with st.container(key="results"):
        if run is not None and run.going:
            _follow(run)
        else:
            _ended(run)


def start(state: State) -> None:
    """Start a run; there is never more than one of a session."""
    page_state = state.page(PaperState)
    if page_state.run is not None and page_state.run.going:
        return
    inputs, _ = server_inputs()
    page_state.message = ""
    try:
        page_state.run = PaperRun(inputs, page_state.quick, page_state.seed).start()
    except CCWSIMError as error:
        page_state.message = str(error)


def _controls(state: State) -> None:
    paper = state.page(PaperState)
    with st.container(horizontal=True, vertical_alignment="bottom", gap="small", key="paper_row"):
        field(
            st.segmented_control, "Extent", key="paper_extent", options=[False, True],
            value=paper.quick, format_func=lambda quick: EXTENTS[quick],
            write=lambda quick: setattr(paper, "quick", bool(quick)),
            help="Quick shows that everything works, with few realizations on small grids; its "
            "verdicts are not results.",
        )  # fmt: skip
        field(
            st.number_input, "Seed", key="paper_seed", value=paper.seed, min_value=0,
            max_value=MAX_SEED, step=1, width=120,
            help="The same seed gives the same realizations.",
            write=lambda seed: setattr(paper, "seed", int(seed)),
        )  # fmt: skip
        button(
            "Run the experiments" if paper.run is None else "Run again", key="paper_start",
            type="primary", on_click=start, args=(state,),
        )  # fmt: skip
        duration = f"{len(EXPERIMENTS)} experiments, {DURATIONS[paper.quick]}."
        st.html(f'<span class="takes">{duration}</span>')


def _follow(run: PaperRun) -> None:
    assert run.job is not None
    follow(
        run.job,
        label=lambda: progress_label(run),
        draw=lambda: st.html(verdict_list(run.finished)),
        keys=("progress", "paper_cancel"),
    )


def _ended(run: PaperRun | None) -> None:
    if run is not None:
        with st.container(horizontal=True, vertical_alignment="center", key="paper_end"):
            words = ended_text(run)
            if run.job is not None and run.job.error is not None:
                st.error(plain(words))
            else:
                st.html(f'<p class="facts ran">{words}</p>')
            if run.report:
                st.download_button(
                    f"Download the report ({len(run.report) / 1e6:.0f} MB)", run.report,
                    file_name=f"ccwsim-paper-{date.today()}.html", mime="text/html",
                    key="download_paper", on_click="ignore", type="primary",
                )  # fmt: skip
    st.html(verdict_list(run.finished if run is not None else []))
