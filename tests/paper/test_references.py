"""Test that references to the paper name existing sections, equations, figures and tables."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

from ccwsim.paper.reproduction import EXPERIMENTS
from ccwsim.ui.how_it_works.words import PAPER

ROOT = Path(__file__).parents[2]
SECTIONS = {
    "2": "earlier work: image quilting, the minimum error boundary cut, CCSIM, MS-CCSIM",
    "2.1": "earlier work: CCSIM, MS-CCSIM",
    "3.1": "DWT and its inverse",
    "3.2": "correlation on approximation coefficients",
    "4.1": "grid, raster path, three overlaps",
    "4.2": "DWT of TI and overlap, Haar",
    "4.3": "CCW",
    "4.4": "candidates, draw, inverse DWT, paste; conditional",
    "5.1": "unconditional, channel",
    "5.2": "data sampled from an unconditional realization; E-type",
    "5.3": "variograms, probability of connection",
    "5.4": "against MS-CCSIM: channel, stone wall",
    "5.5": "ANODI, MDS",
    "5.6": "CPU time",
    "5.7": "dense data",
    "5.8": "multi-facies",
    "5.9": "nonstationary",
    "6": "outlook",
}
FIGURES = {
    1: "3.1",
    2: "3.1",
    3: "4.1 4.3 4.4",
    4: "4.2",
    5: "4.4",
    6: "5.1",
    7: "5.2",
    8: "5.2",
    9: "5.3",
    10: "5.4",
    11: "5.4",
    12: "5.5",
    13: "5.6",
    14: "5.7",
    15: "5.7",
    16: "5.8",
    17: "5.9",
}
"""Sections that contain each figure."""
TABLES = {1: "5.5", 2: "5.6"}
LINES = {
    1: "loop over realizations",
    2: "DWT of the TI",
    3: "origin and direction of the path",
    4: "loop over locations",
    5: "first patch",
    6: "first patch",
    8: "overlap",
    9: "DWT of the overlap",
    10: "CCW",
    11: "K best candidates",
    12: "draw",
    13: "inverse DWT",
    14: "paste",
}
"""Lines of Algorithm 1."""
STEPS = {
    "path": ("4.1", (3, 4)),
    "first patch": ("", (5, 6)),
    "single cells": ("2.1", ()),
    "overlap": ("4.2", (8, 9)),
    "scores": ("4.3", (10,)),
    "candidates": ("4.4", (11,)),
    "data": ("4.4", ()),
    "draw": ("4.4", (12,)),
    "inverse": ("3.1 4.4", (13,)),
    "cut": ("2 4.4", (14,)),
    "image": ("3.1 4.2", (2,)),
}
NUMBERS = r"\s+((?:\d+(?:\.\d+)?)(?:\s*(?:,|and|to|or|–)\s*\d+(?:\.\d+)?)*)"
PATTERNS = {
    "section": re.compile(r"\b[Ss]ections?" + NUMBERS),
    "figure": re.compile(r"\b(?:Figs?\.|[Ff]igures?)" + NUMBERS),
    "table": re.compile(r"\bTables?" + NUMBERS),
    "line": re.compile(r"\b[Ll]ines?" + NUMBERS),
    "algorithm": re.compile(r"\bAlgorithm" + NUMBERS),
    "equation": re.compile(r"\b(?:Eqs?\.|[Ee]quations?)\s*\(?" + NUMBERS[3:]),
}
KNOWN = {"section": SECTIONS, "figure": FIGURES, "table": TABLES, "line": LINES}
KNOWN |= {"algorithm": {1: ""}, "equation": {}}
"""The numbering of equations is unknown, so no equation may be named."""


def named(kind: str, text: str) -> list[str]:
    """Return the references in a text, including all numbers of a range."""
    found = []
    for match in PATTERNS[kind].finditer(text):
        numbers = re.findall(r"\d+(?:\.\d+)?", match[1])
        if re.search(r"to|–", match[1]) and kind != "section":
            numbers = [str(n) for n in range(int(numbers[0]), int(numbers[-1]) + 1)]
            numbers = [n for n in numbers if n != "7" or kind != "line"]
        found += numbers
    return found


def wrong(text: str) -> list[str]:
    """Return the references in a text that do not exist in the paper."""
    text = re.sub(r"\s*\n\s*(?:#\s*|\"\s*f?\")?|\"\s*\n\s*f?\"", " ", text)
    bad = []
    for kind, known in KNOWN.items():
        if kind == "line" and "Algorithm 1" not in text:
            continue
        have = set(map(str, known))
        text_of_kind = text
        if kind == "line":  # lines of files are not lines of Algorithm 1
            text_of_kind = " ".join(re.findall(r"Algorithm 1,? (?:\()?lines? [^;·.)\"]*", text))
        bad += [f"{kind} {n}" for n in named(kind, text_of_kind) if n not in have]
    return bad


def files() -> list[Path]:
    """Return the texts that may contain references to the paper."""
    folders = [ROOT / name for name in ("ccwsim", "pages", "docs", "benchmarks")]
    found = [p for f in folders for p in f.rglob("*") if p.suffix in (".py", ".md", ".toml")]
    return [*found, ROOT / "README.md", ROOT / "app.py", ROOT / "CONTRIBUTING.md"]


def test_every_reference_names_what_the_paper_has():
    bad = {str(p.relative_to(ROOT)): wrong(p.read_text("utf-8")) for p in files()}
    assert {p: found for p, found in bad.items() if found} == {}


def test_wrong_references_are_found():
    text = 'Section 5.10, Fig. 18 and "Table 3"; section 4.5 · Algorithm 1, lines 7 and 15; Eq. (3)'
    told = wrong(text)
    assert told[:3] == ["section 5.10", "section 4.5", "figure 18"]
    assert {"table 3", "line 7", "line 15", "equation 3"} <= set(told)
    assert wrong("sections 3.1 and 4.2, Figs. 6 to 17; Algorithm 1, lines 4 to 14") == []


def test_each_step_of_how_it_works_names_its_section_and_line():
    assert set(STEPS) | {"paste"} == set(PAPER)
    for step, (sections, lines) in STEPS.items():
        assert " ".join(named("section", PAPER[step])) == sections, step
        assert tuple(map(int, named("line", PAPER[step]))) == lines, step


def test_data_are_not_in_algorithm_1_and_figure_5_is_the_inverse_transform():
    assert "Fig" not in PAPER["data"]
    assert "Algorithm" not in PAPER["data"]
    assert named("figure", PAPER["inverse"]) == ["5"]
    method = (ROOT / "docs" / "method.md").read_text("utf-8")
    rows = {row.split("|")[1].strip(): row for row in method.splitlines() if row.count("|") == 6}
    assert named("figure", rows["inverse DWT"]) == ["5"]
    assert named("figure", rows["hard data, virtual template"]) == []


def test_experiments_say_what_the_figures_show():
    said = {e.place: e.shows for e in EXPERIMENTS}
    assert "probability of connection (E–W)" in said["Section 5.3, Fig. 9"]
    assert "three simulations with 4000" in said["Section 5.7, Fig. 14"]


@pytest.mark.parametrize("text", [*PAPER.values(), *(e.place for e in EXPERIMENTS)])
def test_figures_and_tables_belong_to_their_section(text):
    sections = set(named("section", text))
    owners = [FIGURES[int(n)] for n in named("figure", text)]
    owners += [TABLES[int(n)] for n in named("table", text)]
    for owner in owners:
        assert sections & set(owner.split()), (text, owner)


def test_examples_name_the_section_of_their_figure():
    catalogue = tomllib.loads((ROOT / "ccwsim/ui/examples/catalogue.toml").read_text("utf-8"))
    sources = [e["source"] for p in catalogue["part"] for e in p["example"] if "source" in e]
    assert len(sources) > 8
    for source in sources:
        test_figures_and_tables_belong_to_their_section(source)


def test_what_is_not_in_the_paper_is_named():
    text = (ROOT / "docs" / "method.md").read_text("utf-8").split("## Not in the paper")[1]
    for own in (
        "Refinement",
        "Data weights",
        "Limit on candidates near data",
        "Local re-simulation",
    ):
        assert own in text
    catalogue = tomllib.loads((ROOT / "ccwsim/ui/examples/catalogue.toml").read_text("utf-8"))
    for example in (e for part in catalogue["part"] for e in part["example"] if "source" in e):
        for own in ("location weight", "local re-simulation"):
            if own in " ".join(example["text"].split()):
                assert f"{own} is not in the paper" in example["source"]


def test_the_weights_in_the_docs_are_those_of_the_engine():
    from ccwsim.engine.stages.conditioning import DENSE, MAX_DATA, SPARSE

    text = " ".join((ROOT / "docs" / "method.md").read_text("utf-8").split())
    assert f"{SPARSE.missed} wrong cells of the overlap. The weight is {SPARSE.held} cells" in text
    assert f"{DENSE.missed}, {DENSE.held} and {DENSE.ahead}" in text
    assert f"within {SPARSE.slack} wrong cells of the best ({DENSE.slack} in a split" in text
    assert f"more than {MAX_DATA} data per patch" in text
