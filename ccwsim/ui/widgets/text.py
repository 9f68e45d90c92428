"""Text on a page: headings, notes, tables, literal text, and texts of Markdown files."""

import re
from collections.abc import Iterable, Sequence
from functools import cache
from html import escape
from pathlib import Path
from typing import Any

import streamlit as st
from streamlit.delta_generator import DeltaGenerator

import ccwsim
from ccwsim.model import read_toml
from ccwsim.report.verdicts import Verdict

TEXTS_FILE = Path(__file__).parents[1] / "texts.md"
LINK = re.compile(r"\[([^\]]+)\]\((?:\.\./)?([\w/-]+\.md)(?:#[\w-]+)?\)")
PICTURE_PATTERN = re.compile(r"^!\[[^\]]*\]\([^)]*\)\n+", re.MULTILINE)
INSIDE = re.compile(r"[\\`*\[\]<$~|]|(?<!\w)_|_(?!\w)|:(?=[\w/+-])|&(?=#|\w+;)")
"""Characters that have a special meaning in Markdown anywhere in a line."""
IN_ADDRESS = re.compile(r"(?i)(?<=http)(?=s?:)|(?<=www)(?=\.)|(?=@)")
"""Positions in web and mail addresses, which become links even if characters are escaped."""
AT_START = re.compile(r"(?m)^(\s*)([-+#>=])")
NUMBERED = re.compile(r"(?m)^(\s*\d+)([.)])")


def plain(words: str) -> str:
    """Return text with escaped Markdown characters, so that a page shows the text literally.

    Word joiners, which have no width, divide addresses, so that addresses do not become links.
    """
    escaped = INSIDE.sub(lambda match: "\\" + match[0], IN_ADDRESS.sub("\u2060", words))
    return NUMBERED.sub(r"\1\\\2", AT_START.sub(r"\1\\\2", escaped))


def step_title(number: int, title: str) -> None:
    """Write the heading of a step."""
    st.html(f'<div class="step"><b>{number}</b>{escape(title)}</div>')


def pair() -> list[DeltaGenerator]:
    """Return two columns that stay side by side even on phones."""
    return list(st.columns(2, gap="small", wrap=False))


def in_row(key: str | None = None, align: Any = "center", gap: Any = "small") -> DeltaGenerator:
    """Return a container whose elements are side by side."""
    return st.container(horizontal=True, vertical_alignment=align, gap=gap, key=key)


@cache
def _texts() -> dict[str, str]:
    _, *parts = re.split(r"(?m)^## (.+)\n", TEXTS_FILE.read_text("utf-8"))
    return {
        title: " ".join(text.split()) for title, text in zip(parts[::2], parts[1::2], strict=True)
    }


def page_text(title: str, **values: object) -> str:
    """Return a text of `texts.md`, which contains longer texts of pages, with `values` in it."""
    return _texts()[title].format(**values)


@cache
def page_labels(table: str) -> dict[str, Any]:
    """Return the labels in a table of `labels.toml`, by name."""
    return read_toml("ui/labels.toml")[table]


def step_note(text: str) -> None:
    """Write one or two short lines of literal text."""
    lines = "<br>".join(escape(line) for line in text.splitlines())
    st.html(f'<div class="note">{lines}</div>')


SIGN_OF = {True: "✓ ", False: "⚑ ", None: ""}  # sign before a verdict that is good, bad, or none


def panel_title(text: str, note: str | Verdict = "") -> None:
    """Write the title of a panel, with a note or a verdict."""
    verdict = note if isinstance(note, Verdict) else Verdict(note, good=None)
    st.html(f'<div class="panel">{escape(text)}{verdict_html(verdict)}</div>', width="content")


def verdict_html(verdict: Verdict, kind: str = "") -> str:
    """Return the words of a verdict with a sign; the numbers appear on hover."""
    title = f' title="{escape(verdict.numbers)}"' if verdict.numbers else ""
    names = " ".join(name for name in (kind, "odd" if verdict.good is False else "") if name)
    kinds = f' class="{names}"' if names else ""
    return f"<span{kinds}{title}>{SIGN_OF[verdict.good]}{escape(verdict.words)}</span>"


def scrolled(content: str, name: str) -> str:
    """Return HTML in a frame that scrolls sideways, also by keyboard; `name` is read aloud."""
    label = escape(name)
    return f'<div class="wide" tabindex="0" role="group" aria-label="{label}">{content}</div>'


def numbers_table(rows: Iterable[Sequence[str]], head: Sequence[str] = (), kind: str = "") -> str:
    """Return a table as HTML; cells are HTML, and the first cell of a row is the row's name."""
    lines = ["".join(f"<th>{text}</th>" for text in head)] if head else []
    lines += [f"<th>{name}</th>" + "".join(f"<td>{c}</td>" for c in cells) for name, *cells in rows]
    body = "".join(f"<tr>{line}</tr>" for line in lines)
    return f'<table class="{f"numbers {kind}".strip()}">{body}</table>'


@cache
def documents() -> Path | None:
    """Return the folder of the documentation, beside or inside the package; None if missing."""
    package = Path(ccwsim.__file__).parent
    folders = (package / "docs", package.parent / "docs")
    return next((folder for folder in folders if (folder / "how-to").is_dir()), None)


@cache
def how_tos() -> dict[str, str]:
    """Return the texts of all how-tos and of the definitions of measures, by title."""
    docs = documents()
    if docs is None:  # package metadata are missing
        return {}
    texts = {}
    for path in (*sorted((docs / "how-to").glob("*.md")), docs / "measures.md"):
        title, _, text = path.read_text("utf-8").partition("\n")
        texts[title.removeprefix("# ")] = on_a_page(text.strip())
    return texts


def on_a_page(text: str) -> str:
    """Return a document without links and pictures."""

    def named(link: re.Match[str]) -> str:
        words, path = link.groups()
        is_here = path == "measures.md" or not link[0].partition("](")[2].startswith("../")
        return words if is_here else f"{words} (docs/{path})"

    return re.sub(r"(?m)^## ", "### ", LINK.sub(named, PICTURE_PATTERN.sub("", text)))
