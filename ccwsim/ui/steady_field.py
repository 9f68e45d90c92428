"""A widget whose value lives in the state, on a page that is drawn again while it is used."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import streamlit as st


def steady_field(
    widget: Callable[..., Any],
    label: str,
    *,
    key: str,
    value: Any,
    write: Callable[[Any], None],
    **options: Any,
) -> Any:
    """Draw a widget as `field` does, but touch it only where the state says something else.

    A widget that is set in every run loses what is being typed or dragged whenever the page is
    drawn again, as it is here while statistics arrive. Not for a widget in a closed menu.

    Parameters
    ----------
    widget, label, key, value, write, options
        As in `field`.
    """
    if st.session_state.get(key) != value:
        st.session_state[key] = value

    def changed() -> None:
        new = st.session_state[key]
        if new is not None:
            write(new)

    return widget(label, key=key, on_change=changed, **options)
