"""The scripts in the documents run as they stand, one after another."""

from __future__ import annotations

import re
import subprocess
import sys
import unicodedata
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ccwsim import Grid, TrainingImage, read_hard_data, read_training_image
from ccwsim.model.parameters import parameter_table

ROOT = Path(__file__).parents[1]


def names_of(document: str) -> dict[str, Any]:
    """Run all scripts of a document in one namespace, and return what they named."""
    names: dict[str, Any] = {}
    for script in re.findall(
        r"```python\n(.*?)```", (ROOT / document).read_text("utf-8"), re.DOTALL
    ):
        exec(script, names)
    return names


def test_the_scripts_of_the_readme_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = names_of("README.md")
    assert names["e"].n_mismatched.tolist() == [0] * 10
    with np.load(tmp_path / "out.npz") as written:
        assert written["realizations"].shape == (10, 512, 512)
    assert names["gamma"].shape == (10, 61)
    assert names["later"].n_mismatched.tolist() == [0] * 10
    assert names["next_ten"].numbers.tolist() == list(range(10, 20))


def test_the_scripts_of_volumes_run():
    names = names_of("docs/volumes.md")
    assert names["e"].n_mismatched.tolist() == [0, 0]
    assert names["data"].n == 7 + 21 + 12
    assert names["few"].n_mismatched.tolist() == [0]


def test_the_scripts_of_the_library_run(capsys):
    names = names_of("docs/library.md")
    assert names["gamma"].shape == (6, 41)
    assert 0 < names["changed"] < 0.05
    assert len(names["many"]) <= 20
    assert {key[0] for key in names["found"].curves} == {names["sand"]}
    assert len(names["swept"].rows) == len(names["tried"].fitting) == 4
    assert "finished" in capsys.readouterr().out


@pytest.mark.parametrize("name", ["first-study", "wells", "judge", "settings"])
def test_the_scripts_of_a_tutorial_run(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert names_of(f"docs/tutorials/{name}.md")
    assert capsys.readouterr().out
    assert not list(tmp_path.iterdir())


def test_the_script_of_the_first_page_honours_its_data(capsys):
    assert names_of("docs/index.md")["e"].n_mismatched.tolist() == [0, 0, 0, 0]


def test_the_files_of_the_page_on_formats_are_read(tmp_path):
    text = (ROOT / "docs/formats.md").read_text("utf-8")
    grids, points, table, raster = "grid.sgems", "points.dat", "table.csv", "grid.asc"
    examples = re.findall(r"```text\n(.*?)```", text, re.DOTALL)
    for name, content in zip((grids, table, points, raster), examples, strict=True):
        (tmp_path / name).write_text(content)
    expected = [[0, 0, 1, 1], [0, 1, 1, 0]]
    for name in (grids, raster):
        assert read_training_image(tmp_path / name).array.tolist() == expected
    image = TrainingImage(expected, facies_names=("mud", "sand"))
    for name in (table, points):
        data = read_hard_data(tmp_path / name, Grid(20, 30), image)
        assert data.triples == ((2, 10, 1), (9, 20, 0))


def test_the_page_of_parameters_is_their_table():
    text = (ROOT / "docs/parameters.md").read_text("utf-8")
    names = ("symbol", "allowed", "default", "meaning")
    for row in parameter_table():
        line = " | ".join([f"`{row['name']}`", *(row[name] for name in names)])
        assert f"| {line} |" in text, row["name"]
    assert text.count("\n| `") == len(parameter_table())


DOCUMENTS = [
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")),
    *sorted((ROOT / "docs").rglob("*.md")),
]


def prose_of(document: Path) -> str:
    """Return a document without its code."""
    text = re.sub(r"(?ms)^```.*?^```", "", document.read_text("utf-8"))
    return re.sub(r"`[^`\n]*`", "", text)


def anchors_of(document: Path) -> set[str]:
    """Return the anchors of the headings of a document, as the site names them."""
    text = re.sub(r"(?ms)^```.*?^```", "", document.read_text("utf-8"))
    found: set[str] = set()
    for head in re.findall(r"(?m)^#+ +(.*?)\s*$", text):
        words = unicodedata.normalize("NFKD", head).encode("ascii", "ignore").decode()
        name = re.sub(r"[-\s]+", "-", re.sub(r"[^\w\s-]", "", words).strip().lower())
        same = sum(1 for other in found if re.fullmatch(rf"{re.escape(name)}(_\d+)?", other))
        found.add(f"{name}_{same}" if same else name)
    return found


def broken_links(document: Path) -> list[str]:
    """Return the links and pictures of a document that lead to no file, or to no heading."""
    broken = []
    for link in re.findall(r"\]\(<?([^)>\s]+)>?[^)]*\)", prose_of(document)):
        if re.match(r"[a-z]+:", link):  # elsewhere
            continue
        path, _, anchor = link.partition("#")
        target = document.parent / path if path else document
        if not target.exists() or (anchor and anchor not in anchors_of(target)):
            broken.append(link)
    return broken


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_links_lead_to_files_and_headings_that_exist(document):
    assert not broken_links(document)


def test_a_link_that_leads_nowhere_is_found(tmp_path):
    (tmp_path / "there.md").write_text("# Two words, `code`\n## Again\n## Again\n")
    good = "[a](there.md) ![b](there.md) [c](there.md#two-words-code) [d](there.md#again_1) [e](#f)"
    bad = "[x](gone.md) ![y](gone.png) [z](there.md#gone) [w](#gone)"
    (tmp_path / "from.md").write_text(f"# F\n{good} {bad} `[n](code.md)` <https://a.b>\n")
    assert broken_links(tmp_path / "from.md") == ["gone.md", "gone.png", "there.md#gone", "#gone"]


class Fetched(HTMLParser):
    """What a page has a browser fetch."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []

    def handle_starttag(self, tag, attrs):
        own = dict(attrs)
        fetched = own.get("src") or (own.get("href") if tag == "link" else None)
        if fetched:
            self.found.append(fetched)


@pytest.mark.slow
def test_the_site_is_built_without_a_warning_and_fetches_nothing_from_elsewhere(tmp_path):
    pytest.importorskip("mkdocs", reason="mkdocs is not installed")
    site = tmp_path / "site"
    build = [sys.executable, "-m", "mkdocs", "build", "--strict", "-d", str(site)]
    done = subprocess.run(build, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    pages = [*site.rglob("*.html")]
    assert len(pages) > 15
    for page in pages:
        parser = Fetched()
        parser.feed(page.read_text("utf-8"))
        outside = [url for url in parser.found if re.match(r"(https?:)?//", url)]
        assert not outside, page
