"""A setting's letter in its colour, on the page as in the charts."""

from __future__ import annotations

from html import escape

import streamlit as st

from ccwsim.figures import DARK, DASHES, LIGHT, SYMBOLS, setting_colours
from ccwsim.ui.compare.state import LETTERS

LINES = dict(zip(DASHES, ("solid", "dashed", "dotted", "dashed"), strict=True))
"""How CSS says a dash; it has no dash-dot."""
GLYPHS = dict(zip(SYMBOLS, "●■▲✚", strict=True))
"""How text says a symbol."""


def colour_of(letter: str) -> str:
    """Return the colour of a setting as a style sheet says it, for both themes."""
    light, dark = (setting_colours(theme)[LETTERS.index(letter)] for theme in (LIGHT, DARK))
    return f"light-dark({light}, {dark})"


def draw_name(letter: str, note: str) -> None:
    """Write the letter of a setting in its colour, and what it is."""
    st.html(
        f'<div class="setting" style="--own: {colour_of(letter)}"><b>{letter}</b>'
        f'<span title="{escape(note)}">{escape(note)}</span></div>'
    )


def draw_curve_key(letters: tuple[str, ...]) -> None:
    """Write what the lines of the charts are."""
    entries = [("2px solid var(--reference)", "training image")]
    entries += [
        (f"2px {LINES[dash]} {colour_of(letter)}", f"{letter}, median and 5–95 %")
        for letter, dash in zip(letters, DASHES, strict=False)
    ]
    lines = "".join(
        f'<span><i style="border-top: {line}"></i>{text}</span>' for line, text in entries
    )
    st.html(f'<div class="curve-key">{lines}</div>')


def draw_point_key(letters: tuple[str, ...]) -> None:
    """Write what the points of the charts are."""
    entries = "".join(
        f'<span><em style="color: {colour_of(letter)}">{GLYPHS[symbol]}</em>{letter}</span>'
        for letter, symbol in zip(letters, SYMBOLS, strict=False)
    )
    st.html(f'<div class="curve-key points">{entries}</div>')
