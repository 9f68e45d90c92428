"""Questions about a file as data, and the function that draws them."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import streamlit as st

from ccwsim import Grid
from ccwsim.ui.session import State, resolve
from ccwsim.ui.widgets import button, field as draw_field, in_row, options_of, step_note

WriteAnswer = Callable[..., None]
"""A function write(name=value) that stores answers to questions; None removes an answer."""


@dataclass(frozen=True)
class Question:
    """A question about a file; the answer is one of `options` or, without options, a number."""

    key: str  # key of the widget, and name of the answer unless `answers` returns others
    text: str
    value: Any = None  # present answer or guess; None if the question is open
    options: Mapping[Any, str] | None = None  # labels by answer; one of the answers may be None
    answers: Callable[[Any], Mapping[str, Any]] | None = None  # answers by name, from a value
    widget: Callable[..., Any] | None = None  # by default a menu, or a field for a number
    look: Mapping[str, Any] = field(default_factory=dict)  # options of the widget


FormItem = Question | str | tuple["FormItem", ...] | Callable[[WriteAnswer], object]
"""A question, a note, items side by side, or a function that draws something else."""


def ask(items: Iterable[FormItem], write: WriteAnswer, part: str = "") -> None:
    """Draw questions; `write` is called with the answers by name.

    `part` begins the keys of questions, if the page asks about several files.
    """
    for item in items:
        if isinstance(item, str):
            step_note(item)
        elif isinstance(item, Question):
            _ask(item, write, part)
        elif isinstance(item, tuple):
            with in_row(align="top"):
                ask(item, write, part)
        else:
            item(write)


def _ask(question: Question, write: WriteAnswer, part: str) -> None:
    """Draw a question; options are drawn by number if one is None, which no widget can return."""
    value, labels = question.value, question.options or {}
    numbered = list(labels) if None in labels else None
    if numbered is not None:
        value, labels = numbered.index(value), dict(enumerate(labels.values()))

    def take(chosen: Any) -> None:
        new = chosen if numbered is None else numbered[chosen]
        write(**(question.answers(new) if question.answers else {question.key: new}))

    widget = question.widget or (st.selectbox if labels else st.number_input)
    look = {} if question.widget else {"placeholder": "choose one"}
    look |= {**question.look, **(options_of(labels) if labels else {})}
    key = f"ask_{part}{question.key}"
    draw_field(widget, question.text, key=key, value=value, write=take, **look)


def answer_button(label: str, key: str, **answers: Any) -> FormItem:
    """Return a button of a form, which gives answers by name."""
    return lambda write: button(label, key=key, on_click=partial(write, **answers))


KEEP_LABELS = {
    "image_draft": "Keep the image as it was",
    "data_draft": "Keep the data as they were",
    "guides_draft": "Keep the guides as they were",
}


def keep_button(state: State, draft: str, key: str, label: str = "") -> None:
    """Draw a button that discards an image, data or guides that wait for answers, if any wait."""
    if getattr(state, draft) is not None:
        discard = (state, draft, None)
        button(label or KEEP_LABELS[draft], key=key, on_click=setattr, args=discard)


def draw_fitted(state: State) -> None:
    """Say why the grid was fitted, with a button that restores the grid before."""
    if state.fitted is not None and state.fitted[1] == state.grid:
        reason, _, before = state.fitted
        with in_row():
            step_note(reason)
            button("Undo", key="grid_undo", on_click=state.change, kwargs={"grid": before})


def draw_fits(state: State, grids: Mapping[str, Grid], part: str) -> None:
    """Draw buttons that use grids, by what they fit."""
    for name, grid in grids.items():
        look = {"key": f"{part}{name}", "disabled": grid == state.grid}
        args = f"The grid fits {name}.", grid
        button(f"Fit to {name}", on_click=state.fit_grid, args=args, **look)
        st.caption(f"{resolve.described(grid)}.")


def same(names: Iterable[str]) -> dict[str, str]:
    """Return options whose labels are their values."""
    return {name: name for name in names}


def tabs(
    key: str,
    text: str,
    value: Any,
    options: Mapping[Any, str],
    answers: Callable[[Any], Mapping[str, Any]],
    **look: Any,
) -> Question:
    """Return a question whose options are side by side."""
    return Question(
        key=key,
        text=text,
        value=value,
        options=options,
        answers=answers,
        widget=st.segmented_control,
        look=look,
    )
