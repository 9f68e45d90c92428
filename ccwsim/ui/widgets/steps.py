"""Headings: of the numbered steps of the study, with notes under them, and of panels."""

from __future__ import annotations

from html import escape

import streamlit as st
from streamlit.delta_generator import DeltaGenerator


def step_title(number: int, title: str) -> None:
    """Write the heading of a step."""
    st.html(f'<div class="step"><b>{number}</b>{escape(title)}</div>')


def pair() -> list[DeltaGenerator]:
    """Return two places side by side, on a phone too."""
    return list(st.columns(2, gap="small", wrap=False))


def step_note(text: str) -> None:
    """Write what is chosen, in one or two short lines; names from files are taken literally."""
    lines = "<br>".join(escape(line) for line in text.splitlines())
    st.html(f'<div class="note">{lines}</div>')


def panel_title(text: str, note: str = "") -> None:
    """Write the title of a panel."""
    st.html(f'<div class="panel">{escape(text)}<span>{escape(note)}</span></div>', width="content")
