"""Widgets that show a value of the state and write the user's change back into it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import streamlit as st

from ccwsim.parameters import parameter_table

PARAMETERS = {row["name"]: row for row in parameter_table()}


def field(
    widget: Callable[..., Any],
    label: str,
    *,
    key: str,
    value: Any,
    write: Callable[[Any], None],
    **options: Any,
) -> Any:
    """Draw a widget whose value lives in the state, so that it survives page changes.

    Parameters
    ----------
    widget : callable
        A Streamlit widget such as `st.number_input`.
    label, key : str
    value : object
        What the state says now.
    write : callable
        Called with the new value when the user changes it, before the page is drawn again.
    options
        Passed on to the widget.
    """
    if key in st.session_state and st.session_state[key] != value:
        st.session_state[key] = value
    else:
        # A value that is only set through the session would be lost in a menu that is still
        # closed, and setting it in every run would undo what the user types meanwhile.
        options |= starting_at(widget, value, options)

    def changed() -> None:
        new = st.session_state[key]
        if new is not None:
            write(new)

    return widget(label, key=key, on_change=changed, **options)


def starting_at(widget: Callable[..., Any], value: Any, options: dict[str, Any]) -> dict[str, Any]:
    """Return the argument that makes a widget start with a value: its name differs by widget.

    Examples
    --------
    >>> starting_at(st.selectbox, "b", {"options": ["a", "b"]})
    {'index': 1}
    """
    kind = getattr(widget, "__name__", "")
    if kind in ("selectbox", "radio"):
        choices = list(options["options"])
        return {"index": choices.index(value) if value in choices else None}
    return {"default" if kind in ("segmented_control", "pills") else "value": value}


def help_of(name: str) -> str:
    """Return the help of a parameter: meaning, what is allowed, and its other names."""
    row = PARAMETERS[name]
    symbols = [f"{row['symbol']} in the paper"] if row["symbol"] else []
    symbols += [f"`{row['matlab']}` in the authors' code"] if row["matlab"] else []
    tail = f" Also: {', '.join(symbols)}." if symbols else ""
    return f"{row['meaning']} Allowed: {row['allowed']}.{tail}"
