"""Test that every page offers its how-to, and shows the how-to over the page."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import get_args

import pytest
from streamlit.testing.v1 import AppTest
from streamlit.testing.v1.element_tree import Selectbox

from ccwsim.engine.trace.patch import Fate
from ccwsim.model.grid import Grid
from ccwsim.model.parameters import Parameters
from ccwsim.sharing.choices import Choices, DataChoice
from ccwsim.ui.page import OFF_MENU, PAGES
from ccwsim.ui.session.state import State
from ccwsim.ui.widgets.text import TEXTS_FILE, how_tos
from tests.some import some
from tests.ui.widgets import named, opened

TITLES = {Path(path).stem: title for title, path in (*PAGES, *OFF_MENU)}
SMALL = Choices(
    data=DataChoice(),
    grid=Grid(48, 64),
    parameters=Parameters(template_size=16, overlap_size=4),
    n_realizations=2,
)


def menu_of(name: str, title: str) -> tuple[AppTest, Selectbox]:
    """Return a page with the menu of how-tos open, and the choice of a how-to."""
    app = opened(name, State(choices=SMALL)).run()
    assert not app.exception
    assert f"how_to_{title}" not in [box.key for box in app.selectbox]
    app.session_state["how_to"] = True
    return app, named(app.run().selectbox, f"how_to_{title}")


def reads(app: AppTest, title: str) -> bool:
    assert not app.exception
    return how_tos()[title] in [text.value for text in app.markdown]


@pytest.mark.parametrize("name", some(TITLES, always=["simulate", "import", "paper"]))
def test_a_page_opens_its_own_how_to(name):
    title = TITLES[name]
    app, choice = menu_of(name, title)
    assert choice.value == title
    assert reads(app, title)


def test_another_how_to_is_read_from_there():
    app, choice = menu_of("paper", "Paper")
    assert reads(choice.set_value("Measures").run(), "Measures")
    assert not reads(app, "Paper")


def test_a_how_to_on_a_page_has_no_pictures_and_no_links_that_lead_nowhere():
    assert {*TITLES.values(), "Share and open", "Measures"} == set(how_tos())
    for text in how_tos().values():
        assert len(text.splitlines()) > 20
        assert not re.search(r"!\[|\]\(", text)


def test_an_installation_without_documents_offers_none(monkeypatch):
    monkeypatch.setattr("ccwsim.ui.page.how_tos", dict)
    app = opened("paper", State(choices=SMALL))
    app.session_state["how_to"] = True
    app.run()
    assert not app.exception
    assert not [box.key for box in app.selectbox]


def test_every_table_of_labels_is_used_by_a_page():
    modules = "".join(path.read_text("utf-8") for path in TEXTS_FILE.parent.rglob("*.py"))
    used = {*re.findall(r'page_labels\("([^"]+)"', modules), "cell_size", "origin"}
    assert used == tomllib.loads(TEXTS_FILE.with_name("labels.toml").read_text("utf-8")).keys()


def test_every_longer_text_is_shown_by_a_page():
    used = set()
    for path in TEXTS_FILE.parent.rglob("*.py"):
        used |= set(re.findall(r'page_text\(\s*f?"([^"]+)"', path.read_text("utf-8")))
    used -= {"Import of {kind}", "Fate of a location: {location.fate}", "Window: {outcome}"}
    used |= {f"Window: {outcome}" for outcome in ("forced", "none", "isolated", "patch")}
    used |= {"Import of points", "Import of tables of wells"}
    used |= {f"Fate of a location: {fate}" for fate in get_args(Fate)}
    titles = re.findall(r"(?m)^## (.+)$", TEXTS_FILE.read_text("utf-8"))
    assert sorted(titles) == sorted(used)
