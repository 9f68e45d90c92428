"""Open an example as the study, describe the example on the page, restore the user's study."""

import re
from dataclasses import dataclass, replace
from html import escape

import streamlit as st

from ccwsim.ui.compare.settings import start_comparison
from ccwsim.ui.examples.catalogue import (
    EXAMPLES,
    N_COMPARED,
    Example,
    example_named,
    next_example,
)
from ccwsim.ui.imports.page import Imports
from ccwsim.ui.session import State, go_to
from ccwsim.ui.study.image_step import IMPORT_PAGE
from ccwsim.ui.study.run import start_run, stop_run
from ccwsim.ui.widgets import button, in_row, page_text

SIMULATE, COMPARE = "pages/simulate.py", "pages/compare.py"
TAKEN = "The study is this example now."
BACK_HELP = "Restores your study from before the first example, with its results."


@dataclass
class Examples:
    """The state of the page.

    `opened` is the name of the open example, or empty if no example is open. `kept` is the study,
    with its comparison, before the first example was opened.
    """

    view: str = "studies"  # a key of the page's `VIEWS`
    opened: str = ""
    kept: State | None = None


def open_example(state: State, example: Example) -> None:
    """Use an example as the study, run it, and keep the user's study for later."""
    _take(state, example)
    start_run(state)


def compare_example(state: State, example: Example) -> None:
    """Use an example as the study, and compare its settings."""
    _take(state, example)
    state.change_compare(others=example.others, n=N_COMPARED)
    start_comparison(state)


def _take(state: State, example: Example) -> None:
    page_state = state.page(Examples)
    if page_state.kept is None:
        page_state.kept = replace(state, job=None)
    page_state.opened = example.name
    state.choices = example.choices
    if state.own_seed is not None:
        state.change(seed=state.own_seed)
    state.image_draft = state.data_draft = state.reference = None
    state.shown, state.facies_image, state.message = 0, "", ""


def back_to_own(state: State) -> None:
    """Restore the user's study with its results."""
    kept = state.page(Examples).kept
    keep_example(state)
    if kept is None:
        return
    stop_run(state)
    state.choices, state.ensemble_choices = kept.choices, kept.ensemble_choices
    state.ensemble, state.reference, state.message = kept.ensemble, kept.reference, ""
    state.image_draft = state.data_draft = None
    state.compare = kept.compare


def keep_example(state: State) -> None:
    """Continue with the example as the user's study."""
    page_state = state.page(Examples)
    page_state.kept, page_state.opened = None, ""


def draw_opened(state: State, *, compared: bool = False) -> None:
    """Draw a line about the open example or, without an example, about the user's seed in a class.

    For a new user, the line introduces the program. `compared` is whether the page is Compare.
    """
    example = example_named(state.page(Examples).opened)
    with st.container(key="opened"):  # always drawn, so that Streamlit keeps the elements below
        if example is not None:
            _draw_example(state, example, compared)
        elif state.own_seed is not None and not compared:
            own_seed, seed = state.own_seed, state.choices.seed
            changed = "" if own_seed == seed else f" The study uses {seed} now."
            text = f"<b>Your own seed in this class is {own_seed}.</b>{changed}"
            st.html(f'<p class="opened">{text}</p>')
        elif state.welcome and not compared:
            _draw_welcome(state)


def _draw_welcome(state: State) -> None:
    """Describe the program, and offer three ways to begin."""
    st.html(f'<p class="opened">{page_text("Welcome")}</p>')
    with in_row("welcome", "top"):
        for label, subject in (("Bring a picture", "image"), ("Bring wells", "data")):
            attribute = state.page(Imports), "subject", subject
            if button(label, key=f"bring_{subject}", on_click=setattr, args=attribute):
                go_to(IMPORT_PAGE)
        button("Look at this one", key="look", on_click=setattr, args=(state, "welcome", False))


def task_html(example: Example) -> str:
    """Return the task of an example as HTML, with an answer that unfolds on a click."""
    return (
        f'<details class="example"><summary>{as_html(example.task)} <u>Answer</u></summary>'
        f"{as_html(example.text)}</details>"
    )


def as_html(text: str) -> str:
    """Return a text as HTML: code between backticks, emphasis between asterisks."""
    text = re.sub("`([^`]*)`", r"<code>\1</code>", escape(text))
    return re.sub(r"\*([^*]*)\*", r"<em>\1</em>", text)


def _draw_example(state: State, example: Example, compared: bool) -> None:
    seed = "" if state.own_seed is None else f" Your own seed is {state.own_seed}."
    title = f"Example {EXAMPLES.index(example) + 1}: {escape(example.title)}."
    st.html(f'<div class="opened"><b>{title}</b>{seed} {task_html(example)}</div>')

    def action(label: str, key: str, act, *args, note: str) -> bool:
        return button(label, key=key, on_click=act, args=(state, *args), help=note)

    following = next_example(example.name)
    with in_row("opened_actions", "top"):
        if following is not None and (not compared or following.others):
            act = compare_example if compared else open_example
            action("Next example", "next_example", act, following, note=following.title)
        if example.others and not compared:
            act, note = compare_example, "Compares the example's setting (A) with other settings."
            if action("Compare its settings", "compare_opened", act, example, note=note):
                go_to(COMPARE, TAKEN)
        action("Back to my study", "back_from_example", back_to_own, note=BACK_HELP)
        note = "Keeps this example as your study and discards your earlier study."
        action("Keep this one", "keep_example", keep_example, note=note)
