"""A report as one HTML file that needs nothing else: no network, no other file."""

from __future__ import annotations

import re
from base64 import b64encode
from collections.abc import Iterable
from functools import partial
from html import escape
from pathlib import Path
from typing import Any

from ccwsim.figures import figure_json, plotly_script
from ccwsim.io.atomic import write_bytes
from ccwsim.report.document import (
    Block,
    Chart,
    Code,
    Document,
    Facts,
    Judgement,
    Judgements,
    Picture,
    Row,
    Section,
    Table,
    Text,
)

HERE = Path(__file__).parent
NUMBER = re.compile(r"^[−+\-±<>≤≥×]?\s?[.\d]|^–$")
POLICY = (
    "default-src 'none'; img-src data: blob:; style-src 'unsafe-inline'; script-src 'unsafe-inline'"
)
"""What the browser lets the file do: nothing is fetched from anywhere."""


def write_report(path_or_file: Any, document: Document) -> None:
    """Write a report to a path, whole or not at all, or to an open binary file.

    Raises
    ------
    CCWSIMError
        For a place that cannot be written.
    """
    write_bytes(path_or_file, report_html(document).encode())


def report_html(document: Document) -> str:
    """Return a report as one HTML page; all text is escaped, images are part of it.

    Examples
    --------
    >>> page = report_html(Document("A & B", (Section("One", (Text("1 < 2"),)),)))
    >>> "A &amp; B" in page, "1 &lt; 2" in page, 'id="section-1"' in page
    (True, True, True)
    """
    sections = [_section(k, section) for k, section in enumerate(document.sections, start=1)]
    body = [_heading(document), *map(_block, document.opening), _contents(document), *sections]
    if document.colophon.rows:
        body.append(
            '<section id="colophon"><h2>How this report was made</h2>'
            f"{_facts(document.colophon)}</section>"
        )
    scripts = ""
    if has_charts(document):
        own = (HERE / "charts.js").read_text("utf-8")
        scripts = f"<script>{plotly_script()}</script>\n<script>{own}</script>"
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(document.title)}</title>"
        f"<style>{(HERE / 'style.css').read_text('utf-8')}</style></head>\n"
        f"<body><main>\n{_joined(body)}\n</main>\n{scripts}</body></html>\n"
    )


def has_charts(document: Document) -> bool:
    """Return whether there is anything that needs the charts' script.

    Examples
    --------
    >>> has_charts(Document("no charts", ()))
    False
    """
    blocks = [*document.opening, *(b for section in document.sections for b in section.blocks)]
    inside = [item for b in blocks for item in (b.items if isinstance(b, Row) else (b,))]
    return any(isinstance(item, Chart) for item in inside)


def _heading(document: Document) -> str:
    under = f'<p class="subtitle">{escape(document.subtitle)}</p>' if document.subtitle else ""
    return f"<header><h1>{escape(document.title)}</h1>{under}</header>"


def _contents(document: Document) -> str:
    lines = [
        f'<tr><td>{k}</td><td><a href="#section-{k}">{escape(section.title)}</a></td>'
        f"<td>{escape(section.note)}</td><td>{escape(section.gist)}</td></tr>"
        for k, section in enumerate(document.sections, start=1)
    ]
    if len(lines) < 2:
        return ""
    return f"<nav><h2>Contents</h2><table><tbody>{''.join(lines)}</tbody></table></nav>"


def _section(number: int, section: Section) -> str:
    note = f'<p class="note">{escape(section.note)}</p>' if section.note else ""
    return (
        f'<section id="section-{number}"><h2>{number}. {escape(section.title)}</h2>{note}\n'
        f"{_joined(map(_block, section.blocks))}</section>"
    )


def _block(block: Block) -> str:
    if isinstance(block, Text):
        return f"<p{' class=quiet' if block.quiet else ''}>{escape(block.words)}</p>"
    if isinstance(block, Code):
        caption = f'<p class="caption">{escape(block.caption)}</p>' if block.caption else ""
        return f"{caption}<pre>{escape(block.lines)}</pre>"
    if isinstance(block, Facts):
        return _facts(block)
    if isinstance(block, Table):
        return _table(block)
    if isinstance(block, Judgements):
        return _judgements(block)
    row = block if isinstance(block, Row) else Row((block,))
    under = f'<p class="caption">{escape(row.caption)}</p>' if row.caption else ""
    even = f' even" style="--columns: {row.columns}' if row.columns else ""
    return f'<div class="row{even}">{_joined(map(_item, row.items))}</div>{under}'


def _item(item: Picture | Chart) -> str:
    return _picture(item) if isinstance(item, Picture) else _chart(item)


def _facts(facts: Facts) -> str:
    rows = "".join(f"<dt>{escape(n)}</dt><dd>{escape(v)}</dd>" for n, v in facts.rows)
    return f"<dl>{rows}</dl>"


def _table(table: Table) -> str:
    columns = zip(*table.rows, strict=True) if table.rows else [()] * len(table.header)
    numeric = [bool(column) and all(map(NUMBER.match, column)) for column in columns]
    head = "".join(map(partial(_cell, "th"), table.header, numeric))
    rows = "".join(
        f"<tr>{''.join(map(partial(_cell, 'td'), row, numeric))}</tr>" for row in table.rows
    )
    caption = f'<p class="caption">{escape(table.caption)}</p>' if table.caption else ""
    return (
        f'{caption}<div class="wide"><table><thead><tr>{head}</tr></thead>'
        f"<tbody>{rows}</tbody></table></div>"
    )


def _cell(tag: str, text: str, numeric: bool) -> str:
    return f"<{tag}{' class=number' if numeric else ''}>{escape(text)}</{tag}>"


def _judgements(block: Judgements) -> str:
    before = ["", *(row.claim for row in block.rows)]
    rows = "".join(map(_judgement, block.rows, before))
    return (
        f'<div class="wide"><table class="judged"><thead><tr><th>{escape(block.claimed)}</th>'
        f"<th>{escape(block.found)}</th><th></th></tr></thead><tbody>{rows}</tbody></table></div>"
    )


def _judgement(row: Judgement, before: str) -> str:
    """Return one row; a claim that is the one above is not said again."""
    again, claim = (" class=again", "") if row.claim == before else ("", escape(row.claim))
    return (
        f"<tr{again}><td>{claim}</td><td>{escape(row.found)}</td>"
        f'<td><b class="word {escape(row.tone)}">{escape(row.word)}</b></td></tr>'
    )


def _picture(picture: Picture) -> str:
    kind = " class=pixelated" if picture.pixelated else ""
    return (
        f'<figure style="flex-grow: {picture.share:g}; flex-basis: {180 * picture.share:.0f}px">'
        f'<img{kind} src="data:image/png;base64,{b64encode(picture.png).decode()}" '
        f'alt="{escape(picture.alt)}"><figcaption>{escape(picture.caption)}</figcaption></figure>'
    )


def _chart(chart: Chart) -> str:
    # a name like "</script>" must not end the script that carries the figure
    content = figure_json(chart.figure).replace("<", "\\u003c")
    legend = "".join(
        f'<span><i style="background: {escape(colour)}"></i>{escape(name)}</span>'
        for name, colour in chart.legend
    )
    return (
        f'<figure class="chart"><h3>{escape(chart.title)}</h3>'
        f'<div class="legend">{legend}</div>'
        f'<div class="plot" role="img" aria-label="{escape(chart.alt)}">'
        f'<script type="application/json">{content}</script></div></figure>'
    )


def _joined(parts: Iterable[str]) -> str:
    return "\n".join(part for part in parts if part)
