"""What files of hard data leave open, asked in place."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import streamlit as st

from ccwsim.io import FileSummary, inspect
from ccwsim.model.choices import Answers, DataChoice, Upload
from ccwsim.model.errors import CCWSIMError
from ccwsim.ui.session.resolve import opened
from ccwsim.ui.widgets.fields import field, options_of

AS_IS, THRESHOLD, CLASSES = "are the facies", "cut at a threshold", "in classes of equal size"
COLOURS = "in so many main colours"
MAX_LISTED = 300
"""Slices that are listed to choose from; of more a number is asked."""
UPS = {None: "as the format has it", True: "the south", False: "the north"}
COLLISIONS = {
    None: "stop and say so",
    "majority": "keep the facies of most",
    "nearest": "keep the datum nearest to the centre",
    "drop": "leave all of them out",
}
DROPS = {None: "stop and say so", "drop": "leave them out"}
OPEN: dict[str, Any] = {"placeholder": "choose one"}
Write = Callable[[Answers], None]


@st.cache_resource(max_entries=8, show_spinner=False)
def _summary(digest: str, _upload: Upload) -> FileSummary:
    with opened(_upload) as file:
        return inspect(file)


def summary_of(upload: Upload) -> FileSummary | None:
    """Return a first look at an upload, None where it cannot be opened at all."""
    try:
        return _summary(upload.digest, upload)
    except CCWSIMError:
        return None


def answered(answers: Answers, **new: Any) -> Answers:
    """Return answers with some changed; None takes an answer back.

    Examples
    --------
    >>> answered((("up", True),), classes=3, up=None)
    (('classes', 3),)
    """
    merged = {**dict(answers), **new}
    return tuple(sorted((name, value) for name, value in merged.items() if value is not None))


def ask_data(choice: DataChoice, write: Write) -> None:
    """Ask what hard data leave open; `write` is called with the answers."""
    answers = choice.answers
    if choice.source == "file" and choice.upload is not None:
        summary = summary_of(choice.upload)
        if summary is None:
            return
        if not summary.is_table:
            _ask_variable(summary, answers, write)
            _ask_slice(summary, answers, write)
            _ask_way("up", "The first row of the file is", UPS, answers, write)
        if any(variable.continuous for variable in summary.variables[-1:]):
            _ask_values(summary, answers, write)
        _ask_way("on_collision", "Two facies in one cell", COLLISIONS, answers, write)
    _ask_way("on_outside", "Data outside the grid", DROPS, answers, write)
    _ask_way("on_unknown", "Facies that the image does not have", DROPS, answers, write)


def _ask_way(name: str, label: str, ways: dict[Any, str], answers: Answers, write: Write) -> None:
    """Ask for one of a few ways; None, which a widget cannot give back, is among them."""
    choices = list(ways)

    def choose(k: int) -> None:
        write(answered(answers, **{name: choices[k]}))

    value = choices.index(dict(answers).get(name))
    offered = options_of(dict(enumerate(ways.values())))
    field(st.selectbox, label, key=f"ask_{name}", value=value, write=choose, **offered)


def _ask_variable(summary: FileSummary, answers: Answers, write: Write) -> None:
    names = [variable.name for variable in summary.variables]
    if len(names) > 1:

        def choose(name: str) -> None:
            write(answered(answers, variable=name))

        chosen = {"value": dict(answers).get("variable"), "write": choose, "options": names}
        field(st.selectbox, "Which variable is the facies?", key="ask_variable", **chosen, **OPEN)


def _ask_slice(summary: FileSummary, answers: Answers, write: Write) -> None:
    n, known = summary.n_slices, dict(answers).get("slice_index")

    def choose(number: int) -> None:  # from 1 on
        write(answered(answers, slice_index=number - 1))

    value = None if known is None else known + 1
    chosen: dict[str, Any] = {"key": "ask_slice", "value": value, "write": choose}
    if n > MAX_LISTED:
        label = f"Which of {n} slices, from the bottom?"
        field(st.number_input, label, **chosen, min_value=1, max_value=n, **OPEN)
    elif n > 1:
        offered = options_of({k: f"{k} of {n}" for k in range(1, n + 1)})
        field(st.selectbox, "Which slice, from the bottom?", **chosen, **offered, **OPEN)


def _ask_values(summary: FileSummary, answers: Answers, write: Write) -> None:
    """Ask how values become facies: as they are, by a threshold, or in classes."""
    known = dict(answers)
    names = [v for v in summary.variables if v.name == known.get("variable")]
    variable = (names or list(summary.variables))[0]
    ways = [AS_IS, THRESHOLD, COLOURS if summary.is_picture else CLASSES]
    way = THRESHOLD if "threshold" in known else ways[2] if "classes" in known else AS_IS
    middle = float(f"{(variable.minimum + variable.maximum) / 2:.4g}")
    start = {
        AS_IS: {"threshold": None, "classes": None},
        THRESHOLD: {"threshold": middle, "classes": None},
        ways[2]: {"threshold": None, "classes": 2},
    }

    def answer(**new: Any) -> None:
        write(answered(answers, **new))

    label = "Its colours" if summary.is_picture else "Its values"
    chosen = {"value": way, "write": lambda new: answer(**start[new]), "options": ways}
    chosen["help"] = (
        f"Values from {variable.minimum:g} to {variable.maximum:g}. A continuous variable needs a "
        "threshold or classes."
    )
    field(st.selectbox, label, key="ask_values", **chosen)
    if way == THRESHOLD:
        label = "Threshold: at or above is 1, below is 0"
        value = {"value": float(known["threshold"]), "write": lambda v: answer(threshold=v)}
        field(st.number_input, label, key="ask_threshold", format="%g", **value)
    elif way != AS_IS:
        value = {"value": int(known["classes"]), "write": lambda n: answer(classes=n)}
        field(st.number_input, "How many", key="ask_classes", min_value=2, max_value=32, **value)
