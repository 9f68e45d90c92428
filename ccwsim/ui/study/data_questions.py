"""What hard data leave open: variable, collisions, places outside, unknown facies."""

from __future__ import annotations

import streamlit as st

from ccwsim.model.choices import Answers, DataChoice
from ccwsim.ui.study.questions import (
    Write,
    answered,
    ask_slice,
    ask_up,
    ask_values,
    ask_variable,
    summary_of,
)
from ccwsim.ui.widgets.fields import field

COLLISIONS = {
    None: "stop and say so",
    "majority": "keep the facies of most",
    "nearest": "keep the datum nearest to the centre",
    "drop": "leave all of them out",
}
DROPS = {None: "stop and say so", "drop": "leave them out"}


def ask_data(choice: DataChoice, write: Write) -> None:
    """Ask what hard data leave open; `write` is called with the answers."""
    answers = choice.answers
    if choice.source == "file" and choice.upload is not None:
        summary = summary_of(choice.upload)
        if summary is None:
            return
        if not summary.is_table:
            ask_variable(summary, answers, write)
            ask_slice(summary, answers, write)
            ask_up(answers, write)
        if any(variable.continuous for variable in summary.variables[-1:]):
            ask_values(summary, answers, write)
        _ask_settling("on_collision", "Two facies in one cell", COLLISIONS, answers, write)
    _ask_settling("on_outside", "Data outside the grid", DROPS, answers, write)
    _ask_settling("on_unknown", "Facies that the image does not have", DROPS, answers, write)


def _ask_settling(
    name: str, label: str, ways: dict[str | None, str], answers: Answers, write: Write
) -> None:
    choices = list(ways)
    field(
        st.selectbox, label, key=f"ask_{name}", value=choices.index(dict(answers).get(name)),
        options=list(range(len(choices))), format_func=lambda k: ways[choices[k]],
        write=lambda k: write(answered(answers, **{name: choices[k]})),
    )  # fmt: skip
