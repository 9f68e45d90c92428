"""Test the paper about the program: length, citations, numbers and figures."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import numpy as np
import pytest
import yaml
from PIL import Image

from paper.figures import FIGURES
from tests.test_documents import anchors_of

ROOT = Path(__file__).parents[1]
PAPER = ROOT / "paper"
TEXT = (PAPER / "paper.md").read_text("utf-8")
_, HEAD, BODY = TEXT.split("---\n", 2)
BODY = re.sub(r"<!--.*?-->", "", BODY, flags=re.DOTALL)
NUMBER = re.compile(r"(?<![\w.])(?:\.\d+|\d+(?: \d{3})*(?:\.\d+)?)")

COMPARED, QUALITY, SPEED = "docs/compared.md", "docs/quality.md", "docs/speed.md"
FLOW, METHOD = "docs/tutorials/flow.md", "docs/method.md"
CONFIRMED = "| largest bias of a proportion, points | 1.41 | 0.27 | 0.28 | 1.87 | 0.47 | 0.47 |"
LARGE = "| 10 000² | 2 | 2.54 | 0.025 | 0.392 | 525 |"
SOURCES = [
    ("512 × 512 cells takes about 0.01 s", SPEED, "| 512² | 1 | 0.00929 |"),
    ("5.6, 6.5 and 13.3 % of 397 hard data", COMPARED, "| 397 | 0 | 5.6, 6.5, 13.3 % |"),
    ("levels 1, 2 and 3", COMPARED, "published CCWSIM, level 1, 2, 3"),
    ("image of the method's paper, of 256 × 256 cells", COMPARED, "channel image of 256 × 256"),
    ("with its 397 data on 512 × 512 cells", COMPARED, "The grid has 512 × 512 cells"),
    ("patterns of 4 × 4 cells", COMPARED, "divergence of 4 × 4 patterns"),
    ("is 0.47 instead of 1.87 points", QUALITY, CONFIRMED),
    ("10 000 × 10 000 cells takes 2.54 s and 525 MB at level 2", SPEED, LARGE),
    ("170 lines of NumPy", METHOD, "in 170 lines of NumPy and PyWavelets"),
    ("needs 300,000 instead of 540 days", FLOW, "E 0.565, 540 days two-point sand 0.26"),
    ("needs 300,000 instead of 540 days", FLOW, "E 0.003, 300,000 days"),
    ("1.7 times as many dead ends as the image", QUALITY, "1.7 times as many dead ends"),
    ("balls, the rarest facies of one volume, lose 8.1 %", QUALITY, "lose most: 8.1 % on average"),
    ("about 13 s on two idle cores", SPEED, "| 12.6, 13.4 |"),
    ("with 60 wells", "paper/figures.py", "channels_60_wells"),
    ("100 realizations", "paper/figures.py", "n_realizations=100"),
]  # fmt: skip
"""For each phrase of the paper with numbers: the document and its text that has these numbers."""


def joined(text: str) -> str:
    """Return a text with single spaces between its words."""
    return " ".join(text.split())


def prose() -> str:
    """Return the paper's text without code, tables, links to figures and citations."""
    text = re.sub(r"(?ms)^```.*?^```", "", BODY)
    text = re.sub(r"(?m)^\|.*$", "", text)
    text = re.sub(r"\[?@\w+\]?|`[^`]*`|\\\w+\{[^}]*\}|\]\([^)]*\)", " ", text)
    return joined(text)


def test_the_paper_is_short_enough_and_has_its_sections():
    assert len(BODY.split()) <= 1200
    sections = re.findall(r"(?m)^# (.*)$", BODY)
    for needed in ("Summary", "Statement of need", "State of the field", "References"):
        assert needed in sections
    assert len(anchors_of(PAPER / "paper.md")) == len(sections)


def test_the_head_names_authors_and_the_bibliography():
    head = yaml.safe_load(HEAD)
    assert [author["name"] for author in head["authors"]] == ["The CCWSIM developers"]
    places = {place["index"] for place in head["affiliations"]}
    assert all(author["affiliation"] in places for author in head["authors"])
    assert (PAPER / head["bibliography"]).is_file()
    assert {"title", "tags", "date"} <= head.keys()


def test_each_citation_is_in_the_bibliography_and_the_references():
    bibliography = (PAPER / "paper.bib").read_text("utf-8")
    entries = dict(re.findall(r"(?ms)^@\w+\{(\w+),\n(.*?)^\}$", bibliography))
    cited = set(re.findall(r"@(\w+)", BODY))
    assert cited == entries.keys()
    references = joined((ROOT / "docs/references.md").read_text("utf-8"))
    for key, entry in entries.items():
        fields = dict(re.findall(r"(\w+) = \{(.*)\}", entry))
        assert key.endswith(fields["year"])
        assert fields["author"].split(",")[0] in references
        assert f"({fields['year']})" in references
        assert fields.get("doi", fields.get("url", "nowhere")) in references


@pytest.mark.parametrize(("phrase", "document", "source"), SOURCES, ids=lambda text: text[:40])
def test_a_number_of_the_paper_is_that_of_the_documents(phrase, document, source):
    assert phrase in prose()
    assert joined(source) in joined((ROOT / document).read_text("utf-8"))


def test_each_number_of_the_paper_has_a_source():
    rest = prose()
    for phrase, _, _ in SOURCES:
        rest = rest.replace(phrase, "")
    assert not NUMBER.findall(rest)


def test_the_table_of_times_is_that_of_the_documents():
    rows = [line for line in BODY.splitlines() if line.startswith("|")]
    assert len(rows) == 7
    documented = (ROOT / COMPARED).read_text("utf-8").splitlines()
    assert all(row in documented for row in rows)


def test_the_paper_is_in_the_source_archive_but_not_in_the_wheel():
    targets = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["hatch"]["build"]
    wheel, archive = targets["targets"]["wheel"], targets["targets"]["sdist"]
    assert "/paper" in archive["include"]
    assert wheel["packages"] == ["ccwsim"]
    assert not [name for name in wheel["force-include"] if name.startswith("paper")]


def test_the_figures_exist_and_are_small():
    shown = re.findall(r"!\[.*?\]\((.*?)\)", BODY)
    assert sorted(shown) == sorted(FIGURES) == sorted(path.name for path in PAPER.glob("*.png"))
    assert all((PAPER / name).stat().st_size <= 200_000 for name in shown)


@pytest.mark.slow
@pytest.mark.parametrize("name", FIGURES)
def test_a_figure_is_drawn_again_pixel_by_pixel(name):
    """Test all but the titles, whose letters depend on the version of Pillow's font."""
    stored = np.asarray(Image.open(PAPER / name).convert("RGB"))
    drawn = np.asarray(FIGURES[name]().convert("RGB"))
    assert stored.shape == drawn.shape
    np.testing.assert_array_equal(stored[50:], drawn[50:])


def test_the_script_of_the_paper_runs():
    names: dict = {}
    (script,) = re.findall(r"(?ms)^```python\n(.*?)^```", BODY)
    exec(script, names)
    assert names["sand"].shape == (512, 512)
