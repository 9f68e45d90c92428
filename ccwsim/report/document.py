"""What a report is made of: sections of text, facts, tables, pictures, charts and judgements."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

Tone = Literal["good", "plain", "bad", "unknown"]


@dataclass(frozen=True)
class Text:
    """A paragraph; `quiet` sets it small, as a remark."""

    words: str
    quiet: bool = False


@dataclass(frozen=True)
class Code:
    """Lines to copy, and what they are."""

    lines: str
    caption: str = ""


@dataclass(frozen=True)
class Facts:
    """Names and values under each other, as (name, value)."""

    rows: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Table:
    """A table; columns of numbers are set to the right.

    Attributes
    ----------
    header : tuple of str
    rows : tuple of tuple of str
        As long as the header.
    caption : str
    """

    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    caption: str = ""


@dataclass(frozen=True, eq=False)
class Picture:
    """A PNG with what is written under it and what it is to those who cannot see it.

    Attributes
    ----------
    png : bytes
    caption, alt : str
    share : float
        Its width among the pictures of its row, 1 being the usual one.
    pixelated : bool
        Whether cells stay sharp when it is enlarged.
    """

    png: bytes
    caption: str
    alt: str
    share: float = 1.0
    pixelated: bool = False


@dataclass(frozen=True, eq=False)
class Chart:
    """A plotly figure that stays interactive, with its title and a line for those who cannot see.

    Attributes
    ----------
    figure : plotly figure
    title, alt : str
    legend : tuple of (str, str)
        What is drawn in which CSS colour, where the chart has no labels of its own.
    """

    figure: Any
    title: str
    alt: str
    legend: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True, eq=False)
class Row:
    """Pictures or charts side by side, and what is written under all of them.

    With `columns` all are of one size, so many beside each other; else they share the width.
    """

    items: tuple[Picture | Chart, ...]
    caption: str = ""
    columns: int = 0


@dataclass(frozen=True)
class Judgement:
    """A statement, what was found, and a word for how the two go together.

    Attributes
    ----------
    claim, found, word : str
    tone : str
        "good", "plain", "bad" or "unknown": the colour of the word.
    """

    claim: str
    found: str
    word: str
    tone: Tone = "plain"


@dataclass(frozen=True)
class Judgements:
    """Judgements as a table under the names of their two columns."""

    rows: tuple[Judgement, ...]
    claimed: str = "Statement"
    found: str = "Found"


Block = Text | Code | Facts | Table | Row | Picture | Chart | Judgements


@dataclass(frozen=True, eq=False)
class Section:
    """A part of the report.

    Attributes
    ----------
    title : str
    blocks : tuple of blocks
    note : str
        A short line under the title.
    gist : str
        What came out, for the table of contents.
    """

    title: str
    blocks: tuple[Block, ...]
    note: str = ""
    gist: str = ""


@dataclass(frozen=True, eq=False)
class Document:
    """A report.

    Attributes
    ----------
    title, subtitle : str
    opening : tuple of blocks
        Before the table of contents.
    sections : tuple of Section
    colophon : Facts
        Versions, machine, seed, date, parameters: what is needed to make it again.
    """

    title: str
    sections: tuple[Section, ...]
    subtitle: str = ""
    opening: tuple[Block, ...] = ()
    colophon: Facts = Facts(())
