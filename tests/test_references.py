"""Test that the page of references lists each publication that the code cites."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
CITED = re.compile(r"([A-Z]\w+)(?: et al\.| and [A-Z]\w+)?,? \(?(1[89]\d\d|20[0-2]\d)\b\)?")
"""A name and a year, such as "Pollock 1988" and "Matheron et al. (1987)"."""
MONTHS = {"January", "April", "May", "June", "July", "August", "September", "October", "November"}


def test_each_cited_publication_is_in_the_references():
    listed = (ROOT / "docs/references.md").read_text("utf-8")
    entries = [" ".join(entry.split()) for entry in listed.split("\n- ")]
    cited = {
        (name, year)
        for path in (ROOT / "ccwsim").rglob("*.py")
        for name, year in CITED.findall(path.read_text("utf-8"))
        if name not in MONTHS
    }
    missing = {
        (name, year)
        for name, year in cited
        if not any(name in entry and f"({year})" in entry for entry in entries)
    }
    assert len(cited) > 5
    assert not missing
