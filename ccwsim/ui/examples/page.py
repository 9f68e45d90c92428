"""The page Examples: the studies of the lecture plan, the quiz, and the link for a class."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from html import escape
from pathlib import Path
from urllib.parse import urlencode

import streamlit as st

from ccwsim.model.choices import Choices
from ccwsim.model.errors import CCWSIMError
from ccwsim.sharing import left_out, link_of
from ccwsim.ui.examples.catalogue import PARTS, Example
from ccwsim.ui.examples.opened import (
    BACK_HELP,
    COMPARE,
    SIMULATE,
    Examples,
    back_to_own,
    compare_example,
    go_to,
    open_example,
)
from ccwsim.ui.examples.pictures import Picture, expected, picture_worker, pictures_of
from ccwsim.ui.examples.quiz import draw_quiz
from ccwsim.ui.jobs.statistics import Failure
from ccwsim.ui.session.address import CLASS
from ccwsim.ui.session.fragments import follow_tasks
from ccwsim.ui.session.state import State
from ccwsim.ui.study.run import PATIENCE
from ccwsim.ui.widgets.fields import bound_to, button, field
from ccwsim.ui.widgets.steps import step_note
from ccwsim.ui.widgets.theme import chart_theme

STYLE = Path(__file__).with_name("examples.css")
VIEWS = {"studies": "Lecture plan", "quiz": "Quiz: which one is the training image?"}


def draw_examples(state: State) -> None:
    """Draw the studies of the lecture plan, or the quiz."""
    st.html(f"<style>{STYLE.read_text('utf-8')}</style>")
    page_state = state.page(Examples)
    views = {"options": list(VIEWS), "format_func": lambda view: VIEWS[view]}
    views |= {"key": "examples_view", "label_visibility": "collapsed"}
    with st.container(horizontal=True, vertical_alignment="center", key="examples_row"):
        field(st.segmented_control, "Examples", **bound_to(page_state, "view"), **views)
        _draw_class_link(state.choices)
        if page_state.kept is not None:
            back = {"on_click": back_to_own, "args": (state,), "help": BACK_HELP}
            button("Back to my study", key="back_to_own", **back)
    with st.container(key="results"):
        if page_state.view == "quiz":
            draw_quiz(state)
        else:
            _draw_plan(state)


def _draw_class_link(choices: Choices) -> None:
    """Draw the menu that gives the link of the study for a class."""
    with st.popover("Link for a class", key="class_menu"):
        step_note(
            "Whoever opens this link gets your present study with a seed of their own, drawn once "
            "and shown. Put the pictures side by side: what all have in common is the image's and "
            "the data's, what differs is uncertainty."
        )
        st.code(class_link(choices, st.context.url or ""), language=None, wrap_lines=True)
        missing = left_out(choices)
        if missing:
            step_note(f"The link cannot carry {' and '.join(missing)}.")


def class_link(choices: Choices, page: str) -> str:
    """Return the address that opens a study on Simulate, with another seed for everyone.

    `page` is the address of a page of the dashboard.

    Examples
    --------
    >>> class_link(Choices(n_realizations=4, seed=7), "http://lab:8501/examples")
    'http://lab:8501/simulate?realizations=4&class=1'
    """
    found = link_of(replace(choices, seed=0)) | {CLASS: ["1"]}
    start = page.split("?")[0].rpartition("/")[0]
    return f"{start}/simulate?{urlencode(found, doseq=True)}"


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
            for first in range(0, len(part.examples), 2):
                row = part.examples[first : first + 2]
                for place, example in zip(st.columns(2, gap="large"), row, strict=False):
                    number += 1
                    with place, st.container(key=f"card_{example.name}"):
                        if not _draw_card(state, number, example, deadline):
                            waiting.append(example)
    if waiting:
        tasks = [pictures_of(example, chart_theme()) for example in waiting]
        follow_tasks(picture_worker(), tasks, time.monotonic())


def _draw_card(state: State, number: int, example: Example, deadline: float) -> bool:
    """Draw an example and return whether its pictures are there, or never will be."""
    worker, task = picture_worker(), pictures_of(example, chart_theme())
    worker.ask(task)
    found = worker.wait_for(task, max(0.0, deadline - time.monotonic()))
    source = f"<span>{escape(example.source)}</span>" if example.source else ""
    st.html(
        f"{pictures_html(example, found)}"
        f'<h3 class="example"><b>{number}</b>{escape(example.title)}{source}</h3>'
        f'<p class="example">{_html(example.text)}</p>'
    )
    if isinstance(found, Failure):
        step_note(f"No pictures: {found.reason}.")

    def action(label: str, key: str, act: Callable, note: str) -> bool:
        return button(label, key=key, on_click=_try, args=(act, state, example), help=note)

    with st.container(horizontal=True, gap="small", key=f"actions_{example.name}"):
        note = "Makes it the study and runs it."
        is_opened = action("Open", f"open_{example.name}", open_example, note)
        note = "Its settings side by side, with their figures."
        compare = "Compare", f"compare_{example.name}", compare_example
        is_compared = bool(example.others) and action(*compare, note)
    if is_opened or is_compared:
        go_to(COMPARE if is_compared else SIMULATE)
    return found is not None


def _try(act: Callable, state: State, example: Example) -> None:
    try:
        act(state, example)
    except CCWSIMError as error:
        state.message = str(error)


def _html(text: str) -> str:
    """Return a text in HTML, with what stands between backticks as code."""
    parts = escape(text).split("`")
    return "".join(f"<code>{p}</code>" if k % 2 else p for k, p in enumerate(parts))


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
