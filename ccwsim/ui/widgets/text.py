"""Text on a page: headings, notes, wide tables and literal text."""

from __future__ import annotations

import re
from html import escape

import streamlit as st
from streamlit.delta_generator import DeltaGenerator

INSIDE = re.compile(r"[\\`*\[\]<$~|@]|(?<!\w)_|_(?!\w)|:(?=[\w/+-])|&(?=#|\w+;)|(?<=www)\.")
"""Characters that have a special meaning in Markdown anywhere in a line."""
AT_START = re.compile(r"(?m)^(\s*)([-+#>=])")
NUMBERED = re.compile(r"(?m)^(\s*\d+)([.)])")


def plain(words: str) -> str:
    """Return text with escaped Markdown characters, so that a page shows the text literally.

    Examples
    --------
    >>> print(plain("**a** :red[b] $c$ <img src=x>, template_size: 3"))
    \\*\\*a\\*\\* \\:red\\[b\\] \\$c\\$ \\<img src=x>, template_size: 3
    """
    escaped = INSIDE.sub(lambda match: "\\" + match[0], words)
    return NUMBERED.sub(r"\1\\\2", AT_START.sub(r"\1\\\2", escaped))


def step_title(number: int, title: str) -> None:
    """Write the heading of a step."""
    st.html(f'<div class="step"><b>{number}</b>{escape(title)}</div>')


def pair() -> list[DeltaGenerator]:
    """Return two columns that are side by side on phones too."""
    return list(st.columns(2, gap="small", wrap=False))


def step_note(text: str) -> None:
    """Write one or two short lines of literal text."""
    lines = "<br>".join(escape(line) for line in text.splitlines())
    st.html(f'<div class="note">{lines}</div>')


def panel_title(text: str, note: str = "") -> None:
    """Write the title of a panel."""
    st.html(f'<div class="panel">{escape(text)}<span>{escape(note)}</span></div>', width="content")


def scrolled(content: str, name: str) -> str:
    """Return HTML in a frame that scrolls sideways, also by keyboard; `label` names the frame."""
    label = escape(name)
    return f'<div class="wide" tabindex="0" role="group" aria-label="{label}">{content}</div>'
