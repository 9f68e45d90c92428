"""Test that the folder of each component is complete, and that a page draws the component."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from ccwsim.ui.frontend.component import ENTRY, FRONTEND_FOLDER, SCRIPTS_BELOW, component_parts

PARTS = {".js", ".html", ".css"}
NAMES = sorted(
    path.parent.name for path in FRONTEND_FOLDER.glob("*/*.js") if path.stem == path.parent.name
)
SOURCES = [path.read_text("utf-8") for path in FRONTEND_FOLDER.parent.rglob("*.py")]


def folders() -> list[Path]:
    return [
        path for path in FRONTEND_FOLDER.iterdir() if path.is_dir() and path.name != "__pycache__"
    ]


def test_every_folder_is_a_component_or_shared():
    assert {path.name for path in folders()} == {*NAMES, "shared"}


@pytest.mark.parametrize("name", NAMES)
def test_the_folder_of_a_component_is_complete(name):
    html, css, js = component_parts(name)
    assert re.search(r"<(div|canvas)", html)
    assert js.count(ENTRY) == 1
    assert css.count("{") == css.count("}")
    for module in SCRIPTS_BELOW.get(name, ()):
        assert (FRONTEND_FOLDER / f"{module}.js").exists()


@pytest.mark.parametrize("name", NAMES)
def test_every_component_is_drawn(name):
    assert any(f'draw_component("{name}"' in source for source in SOURCES)


def test_whatever_is_drawn_or_built_on_is_there():
    drawn = {name for source in SOURCES for name in re.findall(r'draw_component\("(\w+)"', source)}
    assert drawn == set(NAMES)
    assert SCRIPTS_BELOW.keys() <= set(NAMES)
    used = {module for modules in SCRIPTS_BELOW.values() for module in modules}
    files = {path for folder in folders() for path in folder.iterdir() if path.suffix in PARTS}
    known = {f"{name}/{name}" for name in NAMES} | used | {"shared/calls"}
    assert {str(path.relative_to(FRONTEND_FOLDER).with_suffix("")) for path in files} == known


def test_every_script_is_run_and_there_are_no_others():
    _, _, js = component_parts("script")
    listed = re.search(r"const SCRIPTS = \{ (.*) \};", js)
    run = {name for source in SOURCES for name in re.findall(r'run_script\("(\w+)"', source)}
    assert listed
    assert run == set(listed[1].split(", "))
