"""Test that the documents are correct: scripts, outputs, tables, links."""

from __future__ import annotations

import itertools
import json
import pkgutil
import re
import subprocess
import sys
import unicodedata
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import ccwsim
from ccwsim import (
    CCWSIMError,
    Grid,
    Parameters,
    TrainingImage,
    read_hard_data,
    read_training_image,
    simulate,
)
from ccwsim.metrics import measures
from ccwsim.model.parameters import parameter_table
from tests.test_layers import LAYERS
from tools import tutorials

ROOT = Path(__file__).parents[1]


def names_of(document: str) -> dict[str, Any]:
    """Run all scripts of a document in one namespace, and return the namespace."""
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


def test_the_figures_of_the_readme_are_those_of_the_comparison():
    text = (ROOT / "docs/compared.md").read_text("utf-8")
    rows = [line for line in text.splitlines() if line.startswith("|")]
    figures = set(re.findall(r"[\d.]+", " ".join(rows)))
    readme = (ROOT / "README.md").read_text("utf-8")
    measured = re.findall(r"(?m)^\| \[.*?\]\(docs/compared.md#.*?\) (\|.*)$", readme)
    assert len(measured) == 3
    for row in measured:
        printed = re.findall(r"[\d.]+", re.sub(r"\(.*?\)", "", row))
        assert printed
        assert set(printed) <= figures


@pytest.mark.slow
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
    assert {key[0] for key in names["comparison"].curves} == {names["sand"]}
    assert len(names["swept"].rows) == len(names["tried"].fitting) == 4
    assert "finished" in capsys.readouterr().out


LONG = ("dense-data", "paper")
"""Tutorials that take a long time."""
TUTORIALS = [
    pytest.param(page.stem, marks=[pytest.mark.slow] * (page.stem in LONG))
    for page in sorted(tutorials.PAGES.glob("*.md"))
]


@pytest.mark.slow
@pytest.mark.parametrize("name", TUTORIALS)
def test_a_tutorial_prints_and_shows_what_it_says(name, tmp_path, monkeypatch):
    if name == "ensembles":
        pytest.importorskip("distributed")
    monkeypatch.chdir(tmp_path)
    text = (tutorials.PAGES / f"{name}.md").read_text("utf-8")
    names: dict[str, Any] = {}
    blocks = [*tutorials.BLOCK.finditer(text)]
    assert len(blocks) == text.count("```python") > 1
    for block in blocks:
        shown = tutorials.run(block["code"], names, charts=False)
        assert shown.text == (block["text"] or "")
        if shown.picture:
            assert block["words"] == shown.words
            stored = tutorials.PICTURES / Path(block["picture"]).name
            np.testing.assert_array_equal(
                tutorials.pixels(stored.read_bytes()), tutorials.pixels(shown.picture)
            )


def test_pictures_of_tutorials_are_those_that_are_shown():
    text = "".join(page.read_text("utf-8") for page in tutorials.PAGES.glob("*.md"))
    shown = set(re.findall(r"\]\(../images/tutorials/(.*?)\)", text))
    assert shown == {file.name for file in tutorials.PICTURES.iterdir()}
    assert max(file.stat().st_size for file in tutorials.PICTURES.iterdir()) < 100_000


def test_a_tutorial_is_a_notebook_whose_cells_are_its_blocks():
    text = (tutorials.PAGES / "first-study.md").read_text("utf-8")
    cells = json.loads(tutorials.notebook(text))["cells"]
    code = [cell for cell in cells if cell["cell_type"] == "code"]
    assert "\n".join(cell["source"] for cell in code) + "\n" == "".join(
        block["code"] for block in tutorials.BLOCK.finditer(text)
    )
    assert code[0]["outputs"][0]["text"].startswith("(256, 256)")
    assert not any("```" in cell["source"] for cell in cells)


def test_the_script_of_the_first_page_honours_its_data(capsys):
    assert names_of("docs/index.md")["e"].n_mismatched.tolist() == [0, 0, 0, 0]


def test_the_worked_examples_of_extending_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = (ROOT / "docs/extending.md").read_text("utf-8")
    for name, code in re.findall(r'```python title="(.*?)"\n(.*?)```', text, re.DOTALL):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(code, "utf-8")
    names = names_of("docs/extending.md")
    of, entries = names["of"], names["entries"]
    monkeypatch.setattr(measures, "MEASURES", (*measures.MEASURES, entries))
    image = of.training_image
    p = Parameters((4, 4, 4), (1, 1, 1), (0, 0, 0))
    cells = np.tile(image.array, (1, 8, 8))
    comparison = measures.measure(simulate(TrainingImage(cells), (8, 6, 6), p, seed=0), 1)
    assert entries in comparison.measures
    with pytest.raises(CCWSIMError, match=r"a\.pgm states 2 rows of 3, but 5 values"):
        names["read_pgm"](names["pgm"][:-2], "a.pgm")


def test_the_picture_of_the_layers_has_all_folders_in_their_order():
    drawn = re.findall(r'class="n">(.*?)<', (ROOT / "docs/images/layers.svg").read_text("utf-8"))
    at = {name: k for k, names in enumerate(drawn) for name in names.split(", ")}
    folders = [(name.split("/")[0], k) for k, names in enumerate(LAYERS) for name in names]
    assert at.keys() == {folder for folder, _ in folders}
    for lower, k in folders:
        assert all(at[lower] >= at[higher] for higher, m in folders if m > k)


def test_the_table_of_folders_for_contributors_is_in_the_order_of_the_layers():
    text = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
    rows = re.findall(r"(?m)^\| (`ccwsim/.*?) \|", text)
    listed = [re.findall(r"ccwsim/(\w+)", row) for row in rows]
    layers = [{name.split("/")[0] for name in names} for names in LAYERS]
    level = {name: k for k, names in reversed([*enumerate(layers)]) for name in names}
    assert sorted(name for names in listed for name in names) == sorted(level)
    levels = [{level[name] for name in names} for names in listed]
    assert all(max(above) < min(below) for above, below in itertools.pairwise(levels))


def test_the_files_of_the_page_on_formats_are_read(tmp_path):
    text = (ROOT / "docs/formats.md").read_text("utf-8")
    grids, points, table, raster = "grid.sgems", "points.dat", "table.csv", "grid.asc"
    matrix, reservoir = "matrix.csv", "grid.grdecl"
    examples = re.findall(r"```text\n(.*?)```", text, re.DOTALL)
    for name, content in zip(
        (grids, reservoir, table, points, raster, matrix), examples, strict=True
    ):
        (tmp_path / name).write_text(content)
    expected = [[0, 0, 1, 1], [0, 1, 1, 0]]
    for name in (grids, reservoir, raster, matrix):
        assert read_training_image(tmp_path / name).array.tolist() == expected
    image = TrainingImage(expected, facies_names=("mud", "sand"))
    for name in (table, points):
        data = read_hard_data(tmp_path / name, Grid(20, 30), image)
        assert data.triples == ((2, 10, 1), (9, 20, 0))


def test_the_scripts_of_the_page_on_formats_run():
    assert names_of("docs/formats.md")["again"].n == 3


def test_the_page_of_parameters_is_their_table():
    text = (ROOT / "docs/parameters.md").read_text("utf-8")
    names = ("symbol", "allowed", "default", "meaning")
    for row in parameter_table():
        line = " | ".join([f"`{row['name']}`", *(row[name] for name in names)])
        assert f"| {line} |" in text, row["name"]
    assert text.count("\n| `") == len(parameter_table())


def test_the_reference_contains_all_public_names():
    pages = (ROOT / "docs/api").glob("*.md")
    listed = [
        name for page in pages for name in re.findall(r"(?m)^::: (\S+)$", page.read_text("utf-8"))
    ]
    assert len(listed) == len(set(listed))
    assert all(pkgutil.resolve_name(re.sub(r"\.(\w+)$", r":\1", name)) for name in listed)
    public = [*ccwsim.__all__, *ccwsim._FOLDERS, "experiments.comparison.compare"]
    public += ["experiments.sweep.sweep", "model.study.Study", "engine.trace.Trace"]
    public.remove("experiments")  # its modules are listed
    assert {f"ccwsim.{name}" for name in public} <= set(listed)


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
    anchors: set[str] = set()
    for head in re.findall(r"(?m)^#+ +(.*?)\s*$", text):
        words = unicodedata.normalize("NFKD", head).encode("ascii", "ignore").decode()
        name = re.sub(r"[-\s]+", "-", re.sub(r"[^\w\s-]", "", words).strip().lower())
        same = sum(1 for other in anchors if re.fullmatch(rf"{re.escape(name)}(_\d+)?", other))
        anchors.add(f"{name}_{same}" if same else name)
    return anchors


def broken_links(document: Path) -> list[str]:
    """Return the links and pictures of a document whose file or heading does not exist."""
    broken = []
    for link in re.findall(r"\]\(<?([^)>\s]+)>?[^)]*\)", prose_of(document)):
        if re.match(r"[a-z]+:", link):  # a link to another site
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
    """Collector of the URLs that a browser fetches for a page."""

    def __init__(self) -> None:
        super().__init__()
        self.urls: list[str] = []

    def handle_starttag(self, tag, attrs):
        values = dict(attrs)
        fetched = values.get("src") or (values.get("href") if tag == "link" else None)
        if fetched:
            self.urls.append(fetched)


@pytest.mark.slow
def test_the_site_is_built_without_a_warning_and_fetches_nothing_from_elsewhere(tmp_path):
    pytest.importorskip("mkdocs", reason="mkdocs is not installed")
    site = tmp_path / "site"
    build = [sys.executable, "-m", "mkdocs", "build", "--strict", "-d", str(site)]
    done = subprocess.run(build, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    pages = [*site.rglob("*.html")]
    assert len(pages) > 15
    for page in tutorials.PAGES.glob("*.md"):
        assert (site / "tutorials" / f"{page.stem}.ipynb").is_file()
        html = (site / "tutorials" / page.stem / "index.html").read_text("utf-8")
        assert f'href="../{page.stem}.ipynb"' in html
    for page in pages:
        parser = Fetched()
        parser.feed(page.read_text("utf-8"))
        outside = [url for url in parser.urls if re.match(r"(https?:)?//", url)]
        assert not outside, page
    for style in site.rglob("*.css"):
        assert not re.search(r"""(url\(|@import )["']?(https?:)?//""", style.read_text("utf-8")), (
            style
        )
