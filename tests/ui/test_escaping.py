"""Test that texts of users are shown literally: tags and Markdown have no effect on any page."""

from __future__ import annotations

import json
import re
from html.parser import HTMLParser
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest

import ccwsim
from ccwsim.figures import LIGHT, proportions_chart
from ccwsim.report.document import (
    Chart,
    Code,
    Document,
    Facts,
    Judgement,
    Judgements,
    Picture,
    Section,
    Table,
    Text,
    report_html,
)
from ccwsim.ui.widgets.text import plain
from tests.ui.sessions import Session

EVIL = "<img src=x onerror=alert(1)>**b** $x$ :red[r] ![i](//e.vil) </script> `c` [l](//e.vil) &lt;"
SMALL = "grid=64x48&data=none&template=16&overlap=4&realizations=3&seed=4"
PAGES = sorted(path.stem for path in (Path(__file__).parents[2] / "pages").glob("*.py"))
RAW = ("**b**", "$x$", ":red[", "![i]", "[l](")
"""Texts that Markdown would interpret."""


class Tags(HTMLParser):
    """HTML parser that collects tags containing hostile text."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.bad: list[str] = []
        self.feed(html)

    def handle_starttag(self, tag, attrs):
        if any(name == "onerror" for name, _ in attrs) or ("src", "x") in attrs:
            self.bad.append(self.get_starttag_text() or tag)


def strings(message):
    """Return all texts of an element as a dictionary, by the name of the field."""
    for field, value in message.ListFields():
        if field.type == field.TYPE_MESSAGE:
            for one in value if field.is_repeated else (value,):
                yield from strings(one)
        elif field.type == field.TYPE_STRING:
            for one in value if field.is_repeated else (value,):
                yield field.name, one


def looks_bad(element) -> list[str]:
    """Return the texts of an element that a browser would interpret as markup."""
    kind = element.WhichOneof("type")
    if kind in ("html", "bidi_component", "code"):
        return Tags(element.html.body).bad if kind == "html" else []
    if kind == "plotly_chart":  # Plotly interprets some tags in texts
        return [kind] if "<img" in element.plotly_chart.spec.replace("\\u003c", "<") else []
    found = []
    for name, text in strings(element):
        # options of lists, values of boxes and descriptions of pictures are never markup
        markup = name in ("body", "label", "help", "text", "caption")
        if markup and kind not in ("text_input",) and any(raw in text for raw in RAW):
            found.append(f"{kind}.{name}: {text}")
    return found


def all_bad(session: Session) -> list[str]:
    return [bad for element in session.elements.values() for bad in looks_bad(element)]


def image_file() -> bytes:
    """Return an SGeMS file of a grid whose variable has a hostile name, with mixed line ends."""
    generator = np.random.default_rng(8)
    array = 5 * np.kron(generator.random((16, 16)) < np.linspace(0.02, 0.98, 16), np.ones((6, 6)))
    values = "\n".join(str(int(v)) for v in array.ravel())
    return f"96 96 1 1 1 1 0 0 0\n1\n{EVIL}\n{values}\n".encode()


@pytest.fixture(scope="module")
def session(address):
    """Return a session in which all names are hostile."""
    with Session(address, "simulate", SMALL) as one:
        one.open().upload("image_file", f"{EVIL}.sgems", image_file())
        assert "96 × 96, 2 facies" in "".join(one.words())
        one.open("import")
        one.change(image_name_0=EVIL[:40], image_name_5=EVIL[31:71])
        assert all_bad(one) == []
        one.open("simulate")
        one.click("run")
        yield one


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES)
def test_no_page_takes_a_name_for_markup(session, page):
    session.open(page, settle=page != "examples")  # pictures of bundled images have no other names
    assert session.elements
    assert all_bad(session) == []
    assert session.errors == []


@pytest.mark.slow
def test_a_broken_file_of_an_evil_name_is_told_of_in_its_own_words(session):
    session.open("simulate").upload("image_file", f"{EVIL}.csv", b"\x00\x01")
    told = [text for text in session.alerts() if "keeps its present image" in text]
    assert told
    assert all_bad(session) == []
    session.upload("data_file", f"{EVIL}.csv", b"nothing, of\nuse, here\n")
    assert all_bad(session) == []
    assert session.errors == []


@pytest.mark.parametrize("query", [
    f"ti={EVIL}", f"seed={EVIL}", f"grid={EVIL}", f"points={EVIL}", f"name={EVIL}",
    "colour=0-%23fff;background:url(//e.vil)", f"colour={EVIL}", f"tt={EVIL}",
])  # fmt: skip
def test_an_evil_address_is_told_of_in_its_own_words(address, query):
    with Session(address, "simulate", f"{query}&{SMALL}") as one:
        one.open()
        assert all_bad(one) == []
        assert one.errors == []
        assert "e.vil" not in "".join(style for style in one.styles())


@pytest.mark.parametrize(
    "text",
    [EVIL, "- a", "1. one", "# title", "> said", "a\n===", ":+1:", "http://e.vil", "a@e.vil"],
)
def test_plain_words_keep_every_sign(text):
    kept = plain(text).replace("\u2060", "")
    assert "".join(kept.split("\\")) == text.replace("\\", "")


@pytest.mark.parametrize("address", ["http://e.vil/x", "HTTPS://e.vil", "www.e.vil", "a.b@e.vil"])
def test_addresses_are_not_links(address):
    """Test that no address has a form that Markdown turns into a link."""
    shown = plain(f"{address}, ({address}) _{address}_").replace("\\", "")
    assert not re.search(r"https?://|www\.|[-.\w+]@", shown, re.IGNORECASE)


def document() -> Document:
    image = ccwsim.TrainingImage([[0, 5]], name=EVIL, facies_names=(EVIL, EVIL))
    each = np.full((2, 2), 0.5)
    chart = proportions_chart(image.facies_names, image.proportions, each, ["#000"] * 2,
                              LIGHT)  # fmt: skip
    return Document(
        EVIL, subtitle=EVIL, opening=(Text(EVIL), Text(EVIL, quiet=True)),
        sections=(
            Section(EVIL, (
                Text(EVIL), Code(EVIL, EVIL), Facts(((EVIL, EVIL),)),
                Table((EVIL, "n"), ((EVIL, "1"),), EVIL),
                Picture(b"", EVIL, EVIL), Chart(chart, EVIL, EVIL, ((EVIL, EVIL),)),
                Judgements((Judgement(EVIL, EVIL, EVIL, "good"),), EVIL, EVIL),
            ), note=EVIL, gist=EVIL),
            Section("two", ()),
        ),
        colophon=Facts(((EVIL, EVIL),)),
    )  # fmt: skip


def test_a_report_takes_no_word_for_markup():
    page = report_html(document())
    assert Tags(page).bad == []
    assert page.count("</script>") == page.count("<script")
    scripts = page.split('<script type="application/json">')[1:]
    figure = json.loads(scripts[0].split("</script>")[0])
    assert "<img" not in json.dumps(figure)
    assert "&lt;img" in json.dumps(figure)
    assert "default-src 'none'" in page


def test_files_that_are_written_carry_names_as_they_are(tmp_path):
    image = ccwsim.TrainingImage([[0, 5], [5, 0]], name=EVIL, facies_names=(EVIL, "b"))
    file = BytesIO()
    ccwsim.io.write_training_image(file, image, format="sgems")
    again = ccwsim.read_training_image(BytesIO(file.getvalue()))
    assert np.array_equal(again.array, image.array)
