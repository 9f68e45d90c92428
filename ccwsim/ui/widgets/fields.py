"""Widgets that show a value of the state and write the user's change back into it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import streamlit as st

from ccwsim.model.parameters import parameter_table
from ccwsim.ui.widgets.errors import catch_callback_errors

MAX_VERSIONS = 16
PARAMETERS = {row["name"]: row for row in parameter_table()}


def button(
    label: str, *, on_click: Callable[..., Any], key: str | None = None, **options: Any
) -> bool:
    """Draw a button; an error in `on_click` is said when the page is drawn."""
    return st.button(label, key=key, on_click=catch_callback_errors(on_click), **options)


def file_uploader(label: str, *, on_change: Callable[..., Any], key: str, **options: Any) -> Any:
    """Draw a file uploader; an error in `on_change` is said when the page is drawn."""
    return st.file_uploader(label, key=key, on_change=catch_callback_errors(on_change), **options)


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
    version = _version(key, value)
    name = key + " " * version

    def changed() -> None:
        new = st.session_state[name]
        replaced = _versions()[key][0] != version
        chosen = new if isinstance(new, list) else [new]
        offered = options.get("options", chosen)
        if not replaced and new is not None and all(one in offered for one in chosen):
            write(new)

    return widget(
        label,
        key=name,
        on_change=catch_callback_errors(changed),
        **starting_at(widget, value, options),
    )


def _version(key: str, value: Any) -> int:
    """Return how often, of late, the state went its own way under a widget.

    A widget that is given another value goes on sending the old one until the browser has drawn
    the new: the program cannot tell this from a change by the user, who would lose what replaced
    it. So the widget is replaced by a new one, and what the old one still says falls on deaf ears.
    Spaces at the end of a key make it another key, and the same name in the page's style.
    """
    version, start = _versions().get(key, (0, value))
    if st.session_state.get(key + " " * version, start) != value:
        version, start = (version + 1) % MAX_VERSIONS, value
    _versions()[key] = version, start
    return version


def _versions() -> dict[str, tuple[int, Any]]:
    """Return the version of each widget, and the value that it started with."""
    return st.session_state.setdefault("field_versions", {})


def starting_at(widget: Callable[..., Any], value: Any, options: dict[str, Any]) -> dict[str, Any]:
    """Return options with the one that makes a widget start with a value: its name differs.

    Examples
    --------
    >>> starting_at(st.selectbox, "b", {"options": ["a", "b"]})
    {'options': ['a', 'b'], 'index': 1}
    """
    kind = getattr(widget, "__name__", "")
    if kind in ("selectbox", "radio"):
        choices = list(options["options"])
        return options | {"index": choices.index(value) if value in choices else None}
    return options | {"default" if kind in ("segmented_control", "pills") else "value": value}


def help_of(name: str) -> str:
    """Return the help of a parameter: meaning, what is allowed, and its other names."""
    row = PARAMETERS[name]
    symbols = [f"{row['symbol']} in the paper"] if row["symbol"] else []
    symbols += [f"`{row['matlab']}` in the authors' code"] if row["matlab"] else []
    tail = f" Also: {', '.join(symbols)}." if symbols else ""
    return f"{row['meaning']} Allowed: {row['allowed']}.{tail}"


def bound_to(owner: object, name: str) -> dict[str, Any]:
    """Return value and write of a field that shows, and changes, an attribute of `owner`.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> page_state = SimpleNamespace(n=3)
    >>> bound_to(page_state, "n")["write"](4)
    >>> page_state.n
    4
    """
    return {"value": getattr(owner, name), "write": lambda value: setattr(owner, name, value)}
