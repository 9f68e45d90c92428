"""Questions about a file as data, and the function that draws them."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import streamlit as st

from ccwsim.ui.widgets.fields import field as draw_field
from ccwsim.ui.widgets.fields import options_of
from ccwsim.ui.widgets.text import step_note

Write = Callable[..., None]
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


Item = Question | str | tuple["Item", ...] | Callable[[Write], object]
"""A question, a note, items side by side, or a function that draws something else."""


def ask(items: Iterable[Item], write: Write) -> None:
    """Draw questions; `write` is called with the answers by name."""
    for item in items:
        if isinstance(item, str):
            step_note(item)
        elif isinstance(item, Question):
            _ask(item, write)
        elif isinstance(item, tuple):
            with st.container(horizontal=True, gap="small"):
                ask(item, write)
        else:
            item(write)


def _ask(question: Question, write: Write) -> None:
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
    draw_field(widget, question.text, key=f"ask_{question.key}", value=value, write=take, **look)


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
