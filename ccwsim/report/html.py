"""A report as one HTML file that needs nothing else: no network, no other file."""

from __future__ import annotations

from base64 import b64encode
from functools import cache
from pathlib import Path
from typing import Any, get_args

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from ccwsim.figures import figure_json, plotly_script
from ccwsim.io.atomic import write_bytes
from ccwsim.report import document as kinds
from ccwsim.report.document import Chart, Document, Row

FOLDER = Path(__file__).parent


def write_report(path_or_file: Any, document: Document) -> None:
    """Write a report to a path, whole or not at all, or to an open binary file.

    Raises
    ------
    CCWSIMError
        For a path that cannot be written.
    """
    write_bytes(path_or_file, report_html(document).encode())


def report_html(document: Document) -> str:
    """Return a report as one HTML page; all text is escaped, images are part of it.

    Examples
    --------
    >>> from ccwsim.report import Section, Text
    >>> page = report_html(Document("A & B", (Section("One", (Text("1 < 2"),)),)))
    >>> "A &amp; B" in page, "1 &lt; 2" in page, 'id="section-1"' in page
    (True, True, True)
    """
    blocks = [*document.opening, *(b for section in document.sections for b in section.blocks)]
    items = [item for b in blocks for item in (b.items if isinstance(b, Row) else (b,))]
    drawn = any(isinstance(item, Chart) for item in items)
    scripts = [Markup(plotly_script()), _own("charts.js")] if drawn else []
    template = _environment().get_template("report.html.jinja")
    return template.render(document=document, style=_own("style.css"), scripts=scripts)


@cache
def _environment() -> Environment:
    """A test in the template for each kind of block, such as `one is table`, and two filters."""
    loader = FileSystemLoader(FOLDER)
    environment = Environment(autoescape=True, loader=loader, undefined=StrictUndefined)
    environment.keep_trailing_newline = True
    for kind in get_args(kinds.Block):
        environment.tests[kind.__name__.lower()] = lambda one, kind=kind: isinstance(one, kind)
    environment.filters["base64"] = lambda png: b64encode(png).decode()
    environment.filters["figure"] = _figure
    return environment


def _figure(figure: Any) -> Markup:
    # a name like "</script>" must not end the script that carries the figure
    return Markup(figure_json(figure).replace("<", "\\u003c"))


def _own(name: str) -> Markup:
    return Markup((FOLDER / name).read_text("utf-8"))
