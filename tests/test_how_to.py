"""Test the how-to pages: names of controls exist on the screen, and pictures are small."""

from __future__ import annotations

import ast
import re
import tomllib
from functools import cache
from html import unescape
from io import BytesIO
from pathlib import Path

import pytest
from PIL import Image

from ccwsim.model.parameters import parameter_table
from ccwsim.ui.page import OFF_MENU, PAGES
from tests.browser.pictures import MAX_BYTES, PICTURES, WIDTH, few_colours

ROOT = Path(__file__).parents[1]
HOW_TOS = sorted((ROOT / "docs/how-to").glob("*.md"))
PICTURED = ROOT / "docs/images/how-to"
ANY = "…"
"""Placeholder for inserted values in a text."""


@cache
def tree_of(path: Path) -> ast.Module:
    return ast.parse(path.read_text("utf-8"))


@cache
def literals(path: Path) -> frozenset[str]:
    """Return all texts of a module, including formatted ones."""
    texts = set()
    for node in ast.walk(tree_of(path)):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            texts.add(node.value)
        elif isinstance(node, ast.JoinedStr):
            parts = (p.value if isinstance(p, ast.Constant) else ANY for p in node.values)
            texts.add("".join(map(str, parts)))
    return frozenset(texts)


@cache
def modules_used(path: Path) -> frozenset[Path]:
    """Return the modules of the program that a file imports."""
    modules = set()
    for node in ast.walk(tree_of(path)):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("ccwsim"):
            whole = ROOT.joinpath(*str(node.module).split("."))
            named = (whole / alias.name for alias in node.names)
            tried = (whole / "__init__.py", *(at.with_suffix(".py") for at in (whole, *named)))
            modules |= {module for module in tried if module.is_file()}
    return frozenset(modules)


def modules_of(start: Path) -> set[Path]:
    """Return a file and all modules of the program that it imports, directly or indirectly."""
    modules, to_look_at = {start}, [start]
    while to_look_at:
        new = modules_used(to_look_at.pop()) - modules
        modules |= new
        to_look_at += new
    return modules


def module_of(page: Path) -> Path:
    """Return the file of the page that a how-to describes; for *Share*, the frame of all pages."""
    files = {label: ROOT / path for label, path in (*PAGES, *OFF_MENU)}
    title = page.read_text("utf-8").partition("\n")[0].removeprefix("# ")
    return files.get(title, ROOT / "ccwsim/ui/page.py")


@cache
def texts_of(start: Path, folder: str) -> frozenset[str]:
    """Return the texts of a page: of its modules in a folder, of components and of parameters."""
    texts = [row["name"].replace("_", " ").capitalize() for row in parameter_table()]
    for path in modules_of(start):
        if path == start or path.is_relative_to(ROOT / folder):
            texts += literals(path)
    texts += re.findall(r'"([^"]+)"', (ROOT / "ccwsim/ui/labels.toml").read_text("utf-8"))
    texts += tomllib.loads((ROOT / "ccwsim/model/errors.toml").read_text("utf-8")).values()
    for path in (ROOT / "ccwsim/ui/frontend").glob("*/*.html"):
        texts += re.findall(r">([^<>]+)<", path.read_text("utf-8"))
    cleaned = (re.sub(r"<[^>]*>", " ", unescape(text)) for text in texts)
    return frozenset(" ".join(text.split()) for text in cleaned)


def on_screen(page: Path, folder: str) -> frozenset[str]:
    """Return the texts of the page of a how-to and of pages to which the how-to links."""
    linked = re.findall(r"\]\(([\w-]+\.md)", page.read_text("utf-8"))
    pages = {page, *(page.parent / name for name in linked)}
    return frozenset().union(*(texts_of(module_of(one), folder) for one in pages))


def emphasised(path: Path, stars: str) -> list[str]:
    """Return the names that a page sets in bold (two stars) or italics (one)."""
    text = re.sub(r"`[^`]*`", "", path.read_text("utf-8"))
    star = re.escape(stars)
    names = re.findall(rf"(?<!\*){star}([^*]+?){star}(?!\*)", text)
    return [" ".join(name.split()) for name in names]


def is_label(name: str, texts: frozenset[str]) -> bool:
    """Return whether a name is a text, or a formatted text with other texts inserted."""
    formats = (text for text in texts if ANY in text and text.strip(ANY))
    patterns = (re.escape(text).replace(re.escape(ANY), "(.+)") for text in formats)
    matches = (re.fullmatch(pattern, name) for pattern in patterns)
    return name in texts or any(match and texts.issuperset(match.groups()) for match in matches)


@pytest.mark.slow
@pytest.mark.parametrize("page", HOW_TOS, ids=lambda page: page.stem)
def test_what_is_bold_is_a_control_of_the_dashboard(page):
    texts = on_screen(page, "ccwsim/ui") | on_screen(page, "ccwsim/report")
    missing = {name for name in emphasised(page, "**") if not is_label(name, texts)}
    assert missing <= {"bold"}
    assert emphasised(page, "**")


@pytest.mark.slow
@pytest.mark.parametrize("page", HOW_TOS, ids=lambda page: page.stem)
def test_what_is_italic_can_be_read_on_the_screen(page):
    texts = on_screen(page, "ccwsim")

    def can_be_read(name: str) -> bool:
        whole = re.compile(rf"(?<!\w){re.escape(name)}(?!\w)", re.IGNORECASE)
        return any(whole.search(text) for text in texts)

    missing = {name for name in emphasised(page, "*") if not can_be_read(name)}
    assert missing <= {"italic"}


@pytest.mark.parametrize("page", HOW_TOS, ids=lambda page: page.stem)
def test_a_page_is_short_and_in_the_usual_order(page):
    text = page.read_text("utf-8")
    assert 40 <= len(text.splitlines()) <= 90
    heads = re.findall(r"^## (.*)$", text, re.MULTILINE)
    assert heads[-2:] == ["What the figures mean", "What can go wrong"]
    assert "](../" in text.partition("## What the figures mean")[2]
    assert f"](../images/how-to/{page.stem}.png)" in text


def test_each_picture_is_small_and_is_in_a_page():
    shown = {
        name
        for page in HOW_TOS
        for name in re.findall(r"how-to/([\w-]+)\.png", page.read_text("utf-8"))
    }
    assert shown == set(PICTURES) == {path.stem for path in PICTURED.iterdir()}
    for path in PICTURED.iterdir():
        assert path.stat().st_size <= MAX_BYTES
        with Image.open(path) as picture:
            assert picture.mode == "P"
            assert picture.width <= WIDTH


def test_a_picture_of_many_colours_becomes_small():
    out = BytesIO()
    Image.radial_gradient("L").convert("RGB").resize((1500, 300)).save(out, "PNG")
    content = few_colours(out.getvalue(), 60_000)
    assert len(content) <= 60_000
    with Image.open(BytesIO(content)) as picture:
        assert picture.size == (WIDTH, 256)
