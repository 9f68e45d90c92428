"""Test a tuner: own picture and 100 data, the advised values, and a setting chosen of three.

From the first screen, a user needs at most twelve clicks. The browser counts every press of the
pointer, including those that are repeated; a file that is chosen counts as a click.
"""

from __future__ import annotations

import re

import numpy as np
import pytest
from PIL import Image

from ccwsim import datasets
from tests.browser.hands import GLANCE, SLOW, at_rest, until
from tests.browser.served import CHROMIUM
from tests.browser.test_import import bring_wells

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no {CHROMIUM}"),
]
MAX_CLICKS = 12
COUNT = """addEventListener('pointerdown', (event) => {
  if (event.isTrusted) sessionStorage.pressed = Number(sessionStorage.pressed || 0) + 1;
}, true)"""
IMAGE = datasets.load("dunes").indices == 0
LABEL = re.compile(r"T (\d+) · OR (\d+) · level (\d+)")
NAMES = ("template_size", "overlap_size", "wavelet_level")


@pytest.fixture
def files(tmp_path):
    """Return a black and white picture of 256 × 256 cells, and a table of 100 of its cells."""
    picture, table = tmp_path / "facies.png", tmp_path / "points.csv"
    Image.fromarray(np.where(IMAGE, 255, 0).astype(np.uint8)[::-1]).save(picture)
    cells = np.random.default_rng(6).choice(IMAGE.size, 100, replace=False)
    rows, columns = np.unravel_index(cells, IMAGE.shape)
    points = zip(columns, rows, IMAGE[rows, columns], strict=True)
    lines = [f"{x + 0.5},{y + 0.5},{int(code)}" for x, y, code in points]
    table.write_text("\n".join(["x,y,facies", *lines]))
    return picture, table


def test_own_picture_and_data_get_a_setting_in_few_clicks(film, files):
    from playwright.sync_api import expect

    picture, table = files
    page, steps = film.page, ["picture", "table"]  # files that are chosen

    def click(name: str, button, seen) -> None:
        steps.append(name)
        film.press(button, seen)
        film.take(name)

    page.add_init_script(COUNT)
    film.open()
    page.wait_for_selector(".st-key-map_e_type canvas", timeout=SLOW)
    chooser = page.locator(".st-key-import_image_file")
    click("bring-a-picture", page.get_by_role("button", name="Bring a picture"), chooser)
    chooser.locator("input[type=file]").set_input_files(picture, timeout=SLOW)
    film.see("256 × 256 cells, 2 facies")
    advised = page.locator(".st-key-use_advice button").locator("visible=true")
    film.see(advised)
    film.take("advised-values")
    size = page.locator(".st-key-import_advice .size b").nth(1).inner_text()
    steps.append("use-these-values")
    at_rest(page)
    until(
        lambda: advised.first.click(timeout=GLANCE) if advised.count() else None,
        lambda wait: expect(advised).to_have_count(0, timeout=wait),
    )
    bring_wells(page, table)
    steps.append("hard-data")
    answer = page.locator(".st-key-name_likeliest button")
    confirmed = page.get_by_text("100 data of points.csv are in the study")
    click("facies", answer, confirmed)  # the numbers of a picture are no codes
    film.take("data")
    honoured = page.locator(".facts", has_text="100 of 100 data honoured")
    click("simulate", page.get_by_role("button", name="Simulate", exact=True), honoured)
    if film.width < 600:
        column = page.locator(".st-key-template_size")
        click("steps", page.locator("[data-testid=stExpandSidebarButton]"), column)
    offer = page.locator(".st-key-good_settings button").locator("visible=true")
    find = page.locator(".st-key-find_settings button")
    click("find-good-settings", find, page.locator("[role=dialog]"))
    offer.first.wait_for(timeout=SLOW)
    film.take("offer")
    assert 1 <= offer.count() <= 3
    assert f"Advised: T {size}" in page.locator("[role=dialog]").inner_text()
    chosen = LABEL.search(offer.last.inner_text())
    assert chosen
    steps.append("a-setting")
    at_rest(page)
    until(
        lambda: offer.last.click(timeout=GLANCE) if offer.count() else None,
        lambda wait: expect(offer).to_have_count(0, timeout=wait),
    )
    for key, value in zip(NAMES, chosen.groups(), strict=True):
        page.wait_for_function(
            "([key, value]) => [...document.querySelectorAll(`.st-key-${key} input`)]"
            ".some((input) => input.value === value)",
            arg=[key, value],
            timeout=SLOW,
        )
    film.take("chosen")
    n_clicks = len(files) + page.evaluate("Number(sessionStorage.pressed)")
    assert len(steps) <= n_clicks <= MAX_CLICKS
