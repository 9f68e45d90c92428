"""What a file of a training image leaves open, asked in place."""

from __future__ import annotations

from collections.abc import Callable
from math import isqrt
from typing import Any

import streamlit as st

from ccwsim.io import FileSummary, inspect
from ccwsim.model.choices import Answers, Upload
from ccwsim.model.errors import CCWSIMError
from ccwsim.ui.session.resolve import opened
from ccwsim.ui.widgets.fields import field

AS_IS, THRESHOLD, CLASSES = "are the facies", "cut at a threshold", "in classes of equal size"
COLOURS = "in so many main colours"
MAX_LISTED = 300
"""Slices that are listed to choose from; of more a number is asked."""
UPS = {None: "as the format has it", True: "the south", False: "the north"}

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


def ask_image(upload: Upload, answers: Answers, write: Write) -> None:
    """Ask what the file of a training image leaves open; `write` is called with the answers."""
    summary = summary_of(upload)
    if summary is None:
        return
    ask_variable(summary, answers, write)
    if summary.asks_shape:
        _ask_shape(summary, answers, write)
    ask_slice(summary, answers, write)
    ask_up(answers, write)
    ask_values(summary, answers, write)


def ask_variable(summary: FileSummary, answers: Answers, write: Write) -> None:
    """Ask which variable of several is the facies."""
    names = [variable.name for variable in summary.variables]
    if len(names) > 1:
        field(
            st.selectbox, "Which variable is the facies?", key="ask_variable",
            value=dict(answers).get("variable"), options=names, placeholder="choose one",
            write=lambda name: write(answered(answers, variable=name)),
        )  # fmt: skip


def _ask_shape(summary: FileSummary, answers: Answers, write: Write) -> None:
    n = summary.variables[0].shape[0]
    shape = dict(answers).get("shape")
    small = [k for k in range(1, isqrt(n) + 1) if n % k == 0]
    sizes = sorted({*small, *(n // k for k in small)})
    field(
        st.selectbox, f"The file has {n:,} values: how many cells E–W?", key="ask_columns",
        value=shape[1] if shape else None, options=sizes, placeholder="choose one",
        format_func=lambda nx: f"{nx} (and {n // nx} N–S)",
        write=lambda nx: write(answered(answers, shape=(n // nx, nx))),
    )  # fmt: skip


def ask_slice(summary: FileSummary, answers: Answers, write: Write) -> None:
    """Ask which slice of a 3-D grid is meant."""
    if summary.n_slices > MAX_LISTED:
        chosen = dict(answers).get("slice_index")
        field(
            st.number_input, f"Which of {summary.n_slices} slices, from the bottom?",
            key="ask_slice", value=None if chosen is None else chosen + 1, min_value=1,
            max_value=summary.n_slices, placeholder="choose one",
            write=lambda k: write(answered(answers, slice_index=None if k is None else int(k) - 1)),
        )  # fmt: skip
    elif summary.n_slices > 1:
        field(
            st.selectbox, "Which slice, from the bottom?", key="ask_slice",
            value=dict(answers).get("slice_index"), options=list(range(summary.n_slices)),
            format_func=lambda k: f"{k + 1} of {summary.n_slices}", placeholder="choose one",
            write=lambda k: write(answered(answers, slice_index=int(k))),
        )  # fmt: skip


def ask_up(answers: Answers, write: Write) -> None:
    """Ask which end of the file is the north."""
    choices = list(UPS)
    place = choices.index(dict(answers).get("up"))
    field(
        st.selectbox, "The first row of the file is", key="ask_up", value=place,
        options=list(range(len(choices))), format_func=lambda k: UPS[choices[k]],
        write=lambda k: write(answered(answers, up=choices[k])),
    )  # fmt: skip


def ask_values(summary: FileSummary, answers: Answers, write: Write) -> None:
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
    field(
        st.selectbox, "Its colours" if summary.is_picture else "Its values", key="ask_values",
        value=way, options=ways, write=lambda new: write(answered(answers, **start[new])),
        help=f"Values from {variable.minimum:g} to {variable.maximum:g}. A continuous variable "
        "needs a threshold or classes.",
    )  # fmt: skip
    if way == THRESHOLD:
        field(
            st.number_input, "Threshold: at or above is 1, below is 0", key="ask_threshold",
            value=float(known["threshold"]), format="%g",
            write=lambda v: write(answered(answers, threshold=float(v))),
        )  # fmt: skip
    elif way != AS_IS:
        field(
            st.number_input, "How many", key="ask_classes", value=int(known["classes"]),
            min_value=2, max_value=32, write=lambda n: write(answered(answers, classes=int(n))),
        )  # fmt: skip
