"""What stands above the results while an example is open: what to look at, and the way back."""

from __future__ import annotations

from html import escape

import streamlit as st

from ccwsim.ui.examples.catalogue import EXAMPLES, Example
from ccwsim.ui.examples.open import (
    COMPARE,
    back_to_own,
    compare_example,
    example_named,
    go_to,
    keep_example,
    next_example,
    open_example,
)
from ccwsim.ui.examples.state import Examples
from ccwsim.ui.session.state import State
from ccwsim.ui.widgets.fields import button


def draw_opened(state: State, *, compared: bool = False) -> None:
    """Draw a line on the example that is open, or on the seed of a class; else nothing.

    Parameters
    ----------
    state : State
    compared : bool
        Whether this is the page that compares settings.
    """
    here = state.page(Examples)
    example = example_named(here.opened)
    with st.container(key="opened"):  # always there, so that what is below is never made anew
        if example is not None:
            _draw_example(state, example, compared)
        elif state.own_seed is not None and not compared:
            _draw_seed(state.own_seed, state.choices.seed)


def _draw_example(state: State, example: Example, compared: bool) -> None:
    own = state.own_seed
    seed = "" if own is None else f" Your own seed is {own}."
    st.html(
        f'<p class="opened"><b>Example {EXAMPLES.index(example) + 1}: {escape(example.title)}.</b> '
        f"{escape(example.text.replace('`', ''))}{seed}</p>"
    )
    following = next_example(example.name)
    with st.container(horizontal=True, gap="small", key="opened_actions"):
        if following is not None and (not compared or following.others):
            act = compare_example if compared else open_example
            button(
                "Next example", key="next_example", on_click=act, args=(state, following),
                help=following.title,
            )  # fmt: skip
        if example.others and not compared:
            pressed = button(
                "Compare its settings", key="compare_opened",
                on_click=compare_example, args=(state, example),
                help="This is A; the others beside it.",
            )  # fmt: skip
            if pressed:
                go_to(COMPARE)
        button(
            "Back to my study", key="back_from_example", on_click=back_to_own,
            args=(state,),
            help="Brings back what you had before the first example, with its results.",
        )  # fmt: skip
        button(
            "Keep this one", key="keep_example", on_click=keep_example, args=(state,),
            help="Goes on with this study as your own; the earlier one is let go.",
        )  # fmt: skip


def _draw_seed(own: int, now: int) -> None:
    changed = "" if own == now else f" The study has {now} now."
    st.html(f'<p class="opened"><b>Your own seed in this class is {own}.</b>{changed}</p>')
