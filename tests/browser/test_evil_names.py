"""Test in a browser that names from a project are shown literally: no script, link or markup."""

from __future__ import annotations

import numpy as np
import pytest

from ccwsim import Grid, HardData, Parameters, Project, TrainingImage
from ccwsim.model.study import Study
from ccwsim.sharing.project import project_as_bytes
from tests.browser.hands import SLOW, at_rest, menu, soon, to_page
from tests.browser.served import CHROMIUM

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no {CHROMIUM}"),
]
NAMES = (
    "<img src=x onerror=alert(1)>",
    "**b** [l](http://e.vil) `c` $x$ :red[r]",
    "http://e.vil www.e.vil a@e.vil",
)
IMAGE = "www.e.vil a@e.vil <b>"
MARKUP = """() => {
  const selector = 'a[href*="e.vil"], [src*="e.vil"], [onerror], .katex';
  return [...document.querySelectorAll(selector)].map((element) => element.outerHTML);
}"""


def evil_project() -> bytes:
    """Return a project of a small study, whose image and facies have hostile names."""
    array = np.kron(np.random.default_rng(1).integers(0, 3, (10, 12)), np.ones((6, 6), int))
    image = TrainingImage(array, name=IMAGE, facies_names=NAMES)
    data = HardData([[3, 4], [20, 30], [40, 60]], [0, 1, 2])
    return project_as_bytes(Project(Study(image, Grid(48, 64), Parameters(16, 4, 1), data), 2))


def test_names_of_a_project_are_shown_as_they_are(tab, address):
    dialogs: list[str] = []
    tab.on("dialog", lambda dialog: (dialogs.append(dialog.message), dialog.dismiss()))
    tab.goto(f"{address}/simulate?grid=48x48&data=none&template=16&overlap=4&realizations=1")
    tab.wait_for_selector(".st-key-map_realization canvas", timeout=SLOW)
    at_rest(tab)
    file = {"name": "www.e.vil.ccwsim", "mimeType": "", "buffer": evil_project()}
    tab.locator(".st-key-open button").first.click(timeout=SLOW)
    tab.locator(".st-key-share_open input[type=file]").set_input_files(file, timeout=SLOW)
    tab.locator(".chart-caption", has_text=IMAGE).first.wait_for(state="attached", timeout=SLOW)
    tab.keyboard.press("Escape")
    menu(tab, "image_row")
    tab.get_by_text("From your file").first.wait_for(timeout=SLOW)
    assert tab.evaluate(MARKUP) == []
    tab.keyboard.press("Escape")
    to_page(tab, "Flow")

    def labelled() -> None:
        labels = tab.locator("[data-testid=stWidgetLabel]").all_inner_texts()
        shown = [label.replace("\u2060", "").strip() for label in labels]
        for name in NAMES:
            assert f"Porosity of {name}" in shown

    soon(labelled, SLOW)
    assert tab.evaluate(MARKUP) == []
    assert dialogs == []
