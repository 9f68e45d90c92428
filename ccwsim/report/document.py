"""Parts of a report, and functions that write a report as one HTML file for offline use."""

import re
from base64 import b64encode
from dataclasses import dataclass
from datetime import datetime
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal, get_args

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

import ccwsim
from ccwsim.figures import figure_json, packed_plotly
from ccwsim.io.atomic import write_bytes
from ccwsim.system.machine import this_machine

Tone = Literal["good", "plain", "bad", "unknown"]
NUMBER = re.compile(r"^[−+\-±<>≤≥×]?\s?[.\d]|^–$")
PACKAGES = ("SciPy", "PyWavelets", "plotly")
REPORT_FOLDER = Path(__file__).parent


@dataclass(frozen=True)
class Text:
    """A paragraph of text, with an address after it; a `quiet` paragraph is in small print."""

    words: str
    quiet: bool = False
    link: str = ""


@dataclass(frozen=True)
class Code:
    """Lines of code to copy, with a caption."""

    lines: str
    caption: str = ""


@dataclass(frozen=True)
class Facts:
    """A list of (name, value) pairs."""

    rows: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Table:
    """A table; every row is as long as the header."""

    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    caption: str = ""

    @property
    def numeric(self) -> list[bool]:
        """For each column, whether all cells are numbers and therefore aligned to the right."""
        columns = zip(*self.rows, strict=True) if self.rows else [()] * len(self.header)
        return [bool(column) and all(map(NUMBER.match, column)) for column in columns]


@dataclass(frozen=True, eq=False)
class Picture:
    """A PNG with caption, alternative text and relative width; `pixelated` keeps cells sharp."""

    png: bytes
    caption: str
    alt: str
    share: float = 1.0
    pixelated: bool = False


@dataclass(frozen=True, eq=False)
class Chart:
    """A plotly figure with title, alternative text and (name, CSS colour) pairs as `legend`."""

    figure: Any
    title: str
    alt: str
    legend: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True, eq=False)
class PictureRow:
    """Pictures or charts side by side, in equal `columns` unless 0, with a caption."""

    items: tuple[Picture | Chart, ...]
    caption: str = ""
    columns: int = 0


@dataclass(frozen=True)
class Judgement:
    """A statement (`claim`), our result (`finding`), and a verdict (`word`) with a tone."""

    claim: str
    finding: str
    word: str
    tone: Tone = "plain"


@dataclass(frozen=True)
class Judgements:
    """A table of judgements; `claimed` and `finding` are the titles of two columns."""

    rows: tuple[Judgement, ...]
    claimed: str = "Statement"
    finding: str = "Found"


Block = Text | Code | Facts | Table | PictureRow | Picture | Chart | Judgements


@dataclass(frozen=True, eq=False)
class Section:
    """A section: title, blocks, note below the title, gist for the contents, page break."""

    title: str
    blocks: tuple[Block, ...]
    note: str = ""
    gist: str = ""
    on_new_page: bool = False


@dataclass(frozen=True, eq=False)
class Document:
    """A report; `opening` precedes the table of contents, `colophon` states how it was made."""

    title: str
    sections: tuple[Section, ...]
    subtitle: str = ""
    opening: tuple[Block, ...] = ()
    colophon: Facts = Facts(())


def surroundings() -> tuple[tuple[str, str], ...]:
    """Return versions of software, machine and date as (name, value) pairs for a colophon."""
    return (
        ("Program", f"ccwsim {ccwsim.__version__}"),
        ("Machine", str(this_machine())),
        ("Libraries", ", ".join(f"{name} {version(name)}" for name in PACKAGES)),
        ("Made on", datetime.now().astimezone().strftime("%Y-%m-%d %H:%M %Z")),
    )


def write_report(path_or_file: Any, document: Document) -> None:
    """Write a report to a path, completely or not at all, or to an open binary file."""
    write_bytes(path_or_file, report_html(document).encode())


def report_html(document: Document) -> str:
    """Return a report as one HTML page with escaped text and embedded images."""
    blocks = [*document.opening, *(b for section in document.sections for b in section.blocks)]
    items = [item for b in blocks for item in (b.items if isinstance(b, PictureRow) else (b,))]
    drawn = any(isinstance(item, Chart) for item in items)
    scripts = {"plotly": packed_plotly(), "script": _own("charts.js")} if drawn else {}
    template = _environment().get_template("report.html.jinja")
    return template.render(document=document, style=_own("style.css"), **scripts)


@cache
def _environment() -> Environment:
    """Return the Jinja environment with filters and tests of block types (`one is table`)."""
    loader = FileSystemLoader(REPORT_FOLDER)
    environment = Environment(autoescape=True, loader=loader, undefined=StrictUndefined)
    environment.keep_trailing_newline = True
    for kind in get_args(Block):
        environment.tests[kind.__name__.lower()] = lambda one, kind=kind: isinstance(one, kind)
    environment.filters["base64"] = lambda png: b64encode(png).decode()
    # a name such as "</script>" must not end the script that contains the figure
    environment.filters["figure"] = lambda f: Markup(figure_json(f).replace("<", "\\u003c"))
    return environment


def _own(name: str) -> Markup:
    return Markup((REPORT_FOLDER / name).read_text("utf-8"))
