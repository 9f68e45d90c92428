"""Take an example into the study, and bring the reader's own study back."""

from __future__ import annotations

from dataclasses import replace

import streamlit as st
from streamlit.errors import StreamlitAPIException

from ccwsim.ui.compare.run import start_comparison
from ccwsim.ui.compare.settings import Comparing
from ccwsim.ui.examples.catalogue import EXAMPLES, Example
from ccwsim.ui.examples.state import Examples, Kept
from ccwsim.ui.session.state import State
from ccwsim.ui.study.run import start_run

SIMULATE, COMPARE, PAGE = "pages/simulate.py", "pages/compare.py", "pages/examples.py"
N_COMPARED = 8


def example_named(name: str) -> Example | None:
    """Return the example of a name, None where there is none."""
    return next((example for example in EXAMPLES if example.name == name), None)


def open_example(state: State, example: Example) -> None:
    """Make an example the study and run it; the reader's own study is put aside."""
    _take(state, example)
    start_run(state)


def compare_example(state: State, example: Example) -> None:
    """Make an example the study, and compare its settings."""
    page_state = state.page(Comparing)
    _take(state, example)
    page_state.others = list(example.others)
    page_state.n = N_COMPARED
    start_comparison(state)


def next_example(name: str) -> Example | None:
    """Return the one that comes after an example in the lecture, None after the last."""
    names = [example.name for example in EXAMPLES]
    place = names.index(name) + 1 if name in names else len(names)
    return EXAMPLES[place] if place < len(names) else None


def back_to_own(state: State) -> None:
    """Bring the reader's own study back as it was, with its results."""
    page_state = state.page(Comparing)
    here = state.page(Examples)
    kept, here.kept, here.opened = here.kept, None, ""
    if kept is None:
        return
    if state.job is not None:
        state.job.cancel()
        state.job = None
    state.choices, state.ensemble, state.ran = kept.choices, kept.ensemble, kept.ran
    state.reference, state.message = kept.reference, ""
    state.image_draft = state.data_draft = None
    page_state.others, page_state.n = list(kept.others), kept.n_compared


def keep_example(state: State) -> None:
    """Go on with the example as the reader's own study."""
    page_state = state.page(Examples)
    page_state.kept, page_state.opened = None, ""


def _take(state: State, example: Example) -> None:
    page_state = state.page(Comparing)
    here = state.page(Examples)
    if here.kept is None:
        others = tuple(page_state.others)
        here.kept = Kept(
            state.choices,
            state.ensemble,
            state.ran,
            state.reference,
            others,
            page_state.n,
        )
    here.opened = example.name
    state.choices = (
        example.choices if state.own_seed is None else replace(example.choices, seed=state.own_seed)
    )
    state.image_draft = state.data_draft = state.reference = None
    state.shown, state.facies, state.message = 0, 1, ""


def go_to(path: str) -> None:
    """Go to a page; a page that is run alone knows no others and says what was done."""
    try:
        st.switch_page(path)
    except (StreamlitAPIException, KeyError):
        st.info("The study is this example now.")
