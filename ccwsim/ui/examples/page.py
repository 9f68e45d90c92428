"""The page of examples, put together: the lecture plan, and the quiz."""

from __future__ import annotations

import time
from html import escape
from pathlib import Path

import streamlit as st

from ccwsim.model.errors import CCWSIMError
from ccwsim.ui.examples.catalogue import PARTS, Example
from ccwsim.ui.examples.class_link import draw_class_link
from ccwsim.ui.examples.open import (
    COMPARE,
    SIMULATE,
    back_to_own,
    compare_example,
    go_to,
    open_example,
)
from ccwsim.ui.examples.pictures import Picture, expected, picture_worker, pictures_of
from ccwsim.ui.examples.quiz_page import draw_quiz
from ccwsim.ui.examples.state import Examples
from ccwsim.ui.jobs.statistics import Failure
from ccwsim.ui.session.fragments import follow_tasks
from ccwsim.ui.session.state import State
from ccwsim.ui.study.run import PATIENCE
from ccwsim.ui.widgets.fields import button, field
from ccwsim.ui.widgets.steps import step_note
from ccwsim.ui.widgets.theme import chart_theme

STYLE = Path(__file__).with_name("examples.css")
VIEWS = {"studies": "Lecture plan", "quiz": "Quiz: which one is the training image?"}


def draw_examples(state: State) -> None:
    """Draw the studies of the lecture plan, or the quiz."""
    st.html(f"<style>{STYLE.read_text('utf-8')}</style>")
    here = state.page(Examples)
    with st.container(horizontal=True, vertical_alignment="center", key="examples_row"):
        field(
            st.segmented_control, "Examples", key="examples_view", options=list(VIEWS),
            value=here.view, format_func=lambda view: VIEWS[view], label_visibility="collapsed",
            write=lambda view: setattr(here, "view", view or here.view),
        )  # fmt: skip
        draw_class_link(state)
        if here.kept is not None:
            button(
                "Back to my study", key="back_to_own", on_click=back_to_own, args=(state,),
                help="Brings back what you had before the first example, with its results.",
            )  # fmt: skip
    with st.container(key="results"):
        if here.view == "quiz":
            draw_quiz(state)
        else:
            _draw_plan(state)


def _draw_plan(state: State) -> None:
    step_note(
        "Each opens with one click; your own study is kept, and comes back with one. The pictures "
        "are realizations made just now, on a grid of at most 300 × 300 cells."
    )
    deadline = time.monotonic() + PATIENCE
    number, waiting = 0, []
    for part in PARTS:
        st.html(f'<h2 class="part">{escape(part.title)}</h2>')
        with st.container(key=f"cards_{part.examples[0].name}"):
            for row in range(0, len(part.examples), 2):
                for place, example in zip(st.columns(2, gap="large"), part.examples[row : row + 2],
                                          strict=False):  # fmt: skip
                    number += 1
                    with place, st.container(key=f"card_{example.name}"):
                        if not _card(state, number, example, deadline):
                            waiting.append(example)
    if waiting:
        tasks = [pictures_of(example, chart_theme()) for example in waiting]
        follow_tasks(picture_worker(), tasks, time.monotonic())


def _card(state: State, number: int, example: Example, deadline: float) -> bool:
    """Draw an example and return whether its pictures are there, or never will be."""
    bench, statistic = picture_worker(), pictures_of(example, chart_theme())
    bench.ask(statistic)
    found = bench.wait_for(statistic, max(0.0, deadline - time.monotonic()))
    source = f"<span>{escape(example.source)}</span>" if example.source else ""
    st.html(
        f"{pictures_html(example, found)}"
        f'<h3 class="example"><b>{number}</b>{escape(example.title)}{source}</h3>'
        f'<p class="example">{_text(example.text)}</p>'
    )
    if isinstance(found, Failure):
        step_note(f"No pictures: {found.reason}.")
    with st.container(horizontal=True, gap="small", key=f"actions_{example.name}"):
        opened = button(
            "Open", key=f"open_{example.name}", help="Makes it the study and runs it.",
            on_click=_guarded, args=(open_example, state, example),
        )  # fmt: skip
        compared = bool(example.others) and button(
            "Compare", key=f"compare_{example.name}",
            on_click=_guarded, args=(compare_example, state, example),
            help="Its settings side by side, with their figures.",
        )  # fmt: skip
    if opened or compared:
        go_to(COMPARE if compared else SIMULATE)
    return found is not None


def pictures_html(example: Example, found: tuple[Picture, ...] | Failure | None) -> str:
    """Return the pictures of an example, or room for them."""
    room = tuple(Picture("<i></i>", *size) for size in expected(example))
    pictures = found if isinstance(found, tuple) else room
    figures = "".join(
        f'<figure style="--shape: {p.nx} / {p.ny}">{p.content}'
        f"<figcaption>{escape(p.label)}</figcaption></figure>"
        for p in pictures
    )
    busy = "" if found else ' aria-busy="true"'
    columns = " ".join(f"minmax(0, {p.nx}fr)" for p in pictures)  # all have the same scale
    return (
        f'<div class="pictures n{len(pictures)}" style="grid-template-columns: {columns}"{busy}>'
        f"{figures}</div>"
    )


def _guarded(act, state: State, example: Example) -> None:
    try:
        act(state, example)
    except CCWSIMError as error:
        state.message = str(error)


def _text(text: str) -> str:
    """Return a text in HTML, with what stands between backticks as code."""
    parts = escape(text).split("`")
    return "".join(f"<code>{p}</code>" if k % 2 else p for k, p in enumerate(parts))
