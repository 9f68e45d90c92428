"""The theme, light or dark, that the browser shows."""

from dataclasses import fields
from pathlib import Path

import streamlit as st

from ccwsim.figures import DARK, LIGHT, Theme

FOLDER = Path(__file__).parents[1]


def theme_name() -> str:
    """Return "dark" or "light", the theme that the browser shows."""
    return "dark" if st.context.theme.type == "dark" else "light"


def own_colours() -> str:
    """Return CSS variables for the dashboard's colours in the light and the dark theme."""
    pairs = " ".join(
        f"--{colour.name}: light-dark({getattr(LIGHT, colour.name)}, {getattr(DARK, colour.name)});"
        for colour in fields(Theme)
        if isinstance(getattr(LIGHT, colour.name), str)
    )
    return f":root {{ color-scheme: {theme_name()}; {pairs} }}"


def chart_theme() -> Theme:
    """Return the colours of charts in the theme that the browser shows."""
    return DARK if theme_name() == "dark" else LIGHT


def draw_style(sheet: str, rules: str = "") -> None:
    """Write a style sheet of the folder `ui`, after rules that depend on the state of the page."""
    st.html(f"<style>{rules}\n{(FOLDER / sheet).read_text('utf-8')}</style>")
