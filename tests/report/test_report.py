"""Test reports: one file that loads nothing, and that no name can break."""

from __future__ import annotations

import json
import re
from html import escape
from io import BytesIO

import numpy as np
import pytest

from ccwsim.figures import LIGHT, Line, lines_chart
from ccwsim.model.errors import CCWSIMError
from ccwsim.report.document import (
    Chart,
    Code,
    Document,
    Facts,
    Judgement,
    Judgements,
    Picture,
    PictureRow,
    Section,
    Table,
    Text,
    packed_plotly,
    report_html,
    surroundings,
    write_report,
)

ODD = "</script><script>alert('\"&1')</script>"
OUTSIDE = re.compile(r"""(?:src|href)\s*=\s*["'](?!data:|#)|@import|url\((?!data:)""", re.I)


def chart(name: str = "a") -> Chart:
    line = Line(name, np.arange(3.0), np.arange(3.0), "#173F6B")
    figure = lines_chart([line], LIGHT, x_title=name, y_title="y")
    return Chart(figure, name, name, ((name, "#173F6B"),))


def document(word: str) -> Document:
    table = Table((word, word), ((word, "1.5"),), word)
    judged = Judgements((Judgement(word, word, word, "good"),), word, word)
    row = PictureRow((Picture(b"png", word, word), chart(word)), word)
    words = Text(word), Text(word, quiet=True), Code(word, word), Facts(((word, word),))
    blocks = (*words, table, judged, row, chart(word))
    two = (Section(word, blocks, word), Section("second", ()))
    return Document(word, two, word, blocks, Facts(((word, word), *surroundings())))


def own_part(page: str) -> str:
    """Return the report without the script of Plotly, which contains many unused addresses."""
    return page.replace(packed_plotly(), "")


def test_every_text_is_escaped_wherever_it_stands():
    page = report_html(document(ODD))
    assert "<script>alert" not in page
    assert page.count("&lt;/script&gt;") > 12
    figures = re.findall(r'<script type="application/json">(.*?)</script>', page, re.S)
    assert [json.loads(f)["data"][0]["name"] for f in figures] == [escape(ODD, quote=False)] * 4


def test_nothing_is_fetched_from_outside():
    page = report_html(document("x"))
    assert not OUTSIDE.findall(own_part(page))
    assert "default-src 'none'" in page
    assert page.count("Plotly.newPlot(place") == 1
    assert len(page) < 3_000_000


def test_a_report_without_charts_carries_no_script():
    page = report_html(Document("small", (Section("one", (Text("words"),)),)))
    assert "<script" not in page
    assert len(page) < 20_000


def test_contents_lead_to_every_section():
    page = report_html(document("x"))
    targets = re.findall(r'href="#([^"]+)"', page)
    assert len(targets) == 2
    assert all(f'id="{target}"' in page for target in targets)


def test_numbers_are_set_to_the_right_and_words_are_not():
    page = report_html(Document("t", (Section("s", (Table(("a", "b"), (("word", "−1.5 %"),)),)),)))
    assert "<td>word</td><td class=number>−1.5 %</td>" in page
    assert "<th>a</th><th class=number>b</th>" in page


def test_a_report_is_written_whole_or_not_at_all(tmp_path):
    file = BytesIO()
    write_report(file, document("x"))
    assert file.getvalue().startswith(b"<!DOCTYPE html>")
    old = tmp_path / "report.html"
    old.write_text("old")
    with pytest.raises(CCWSIMError, match="cannot be written"):
        write_report(tmp_path / "none" / "report.html", document("x"))
    assert [p.name for p in tmp_path.iterdir()] == ["report.html"]
