"""Test the page Flow in a browser: the live solution, a well by a click, all realizations."""

from __future__ import annotations

from urllib.parse import urlencode

import pytest

from ccwsim import Grid
from ccwsim.sharing.choices import Choices, GuideChoice
from ccwsim.sharing.link import link_of
from tests.browser.hands import SLOW, at_rest, fits_a_phone, settled, soon
from tests.browser.screenshots import fill_with_flow
from tests.browser.served import CHROMIUM

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no {CHROMIUM}"),
]
SMALL = "grid=96x96&data=none&realizations=4"


def test_a_click_places_a_well_and_all_realizations_answer(tab, address):
    tab.goto(f"{address}/flow?{SMALL}")
    fill_with_flow(tab)
    tab.locator(".note", has_text="Brier score").wait_for(timeout=SLOW)
    tab.mouse.move(*spot(tab, "capture", 0.5, 0.5))
    readout = tab.locator(".st-key-map_capture .readout").first
    soon(lambda: equal("P(captured) = " in readout.inner_text(), True))
    k = tab.locator(".st-key-flow_p_90")
    number = k.locator(".panel span").inner_text().split(",")[0].split()[-1]
    k.get_by_role("button", name="Open").click(timeout=SLOW)
    tab.locator(".panel", has_text=f"Realization {number} of 4").wait_for(timeout=SLOW)


def test_controls_are_in_view_after_a_reload_and_after_the_study_column_was_closed(tab, address):
    def sees_controls() -> None:
        tab.wait_for_selector(".st-key-map_heads canvas", timeout=SLOW)
        tab.locator(".st-key-flow_high input").wait_for(timeout=SLOW)
        column = tab.get_by_test_id("stSidebar")
        soon(lambda: equal(column.bounding_box()["x"], 0))

    tab.goto(f"{address}/flow?{SMALL}")
    sees_controls()
    tab.locator(".st-key-flow_high input").fill("12.5")
    tab.locator(".st-key-flow_high input").press("Enter")
    tab.wait_for_function("() => location.search.includes('12.5')", timeout=SLOW)
    tab.reload()
    sees_controls()
    assert tab.locator(".st-key-flow_high input").input_value() == "12.50"
    tab.goto(f"{address}/simulate?{SMALL}")
    tab.locator(".st-key-run").first.wait_for(timeout=SLOW)
    tab.get_by_test_id("stSidebar").hover()
    tab.locator("[data-testid=stSidebarCollapseButton] button").click(timeout=SLOW)
    tab.goto(f"{address}/flow?{SMALL}")
    sees_controls()


def spot(tab, key: str, x: float, y: float) -> tuple[float, float]:
    """Return the pixels of a position on a map, given by shares of its canvas."""
    canvas = tab.locator(f".st-key-map_{key} canvas").first
    canvas.scroll_into_view_if_needed(timeout=SLOW)
    box = settled(tab, canvas.bounding_box, pause=300)
    return box["x"] + x * box["width"], box["y"] + y * box["height"]


def head_at(tab, x: float, y: float) -> str:
    """Return the label of the map of heads at a position."""
    tab.mouse.move(*spot(tab, "heads", x, y))
    said = settled(tab, tab.locator(".st-key-map_heads .readout").first.inner_text, pause=300)
    return said.split(") ")[1].split(" ·")[0]


def well_of(tab) -> str:
    return tab.locator(".note", has_text="Well in").first.inner_text(timeout=SLOW)


def test_a_well_and_a_head_are_dragged_on_the_map_of_heads_and_the_flow_follows(tab, address):
    tab.goto(f"{address}/flow?{SMALL}")
    tab.wait_for_selector(".st-key-map_heads canvas", timeout=SLOW)
    at_rest(tab)
    before = head_at(tab, 0.3, 0.3)
    tab.mouse.click(*spot(tab, "heads", 0.7, 0.7))
    first = settled(tab, lambda: well_of(tab))
    at_rest(tab)
    tab.mouse.move(*spot(tab, "heads", 0.7, 0.7))
    tab.mouse.down()
    for share in (0.65, 0.6, 0.55, 0.5):
        tab.mouse.move(*spot(tab, "heads", share, 0.5), steps=3)
    soon(lambda: not_equal(well_of(tab), first), SLOW)  # while the button is still down
    tab.mouse.move(*spot(tab, "heads", 0.35, 0.35), steps=3)
    tab.mouse.up()
    at_rest(tab)
    soon(lambda: not_equal(head_at(tab, 0.3, 0.3), before), SLOW)
    # the tab of the head in the west, beside the middle of the west side
    box = tab.locator(".st-key-map_heads canvas").first.bounding_box()
    x, y = box["x"] + 70, box["y"] + 1 + (box["height"] - 21) / 2
    tab.mouse.move(x, y)
    tab.mouse.down()
    tab.mouse.move(x, y - 41, steps=4)
    tab.mouse.up()
    field = tab.get_by_role("spinbutton", name="Head at the west side (m)")
    soon(lambda: equal(float(field.input_value()), 1.5), SLOW)


def equal(found: object, wanted: object) -> None:
    assert found == wanted


def not_equal(found: object, other: object) -> None:
    assert found != other


def test_the_page_fits_a_phone(tab, address):
    tab.set_viewport_size({"width": 390, "height": 844})
    tab.goto(f"{address}/flow?{SMALL}")
    tab.wait_for_selector(".st-key-flow_maps canvas", timeout=SLOW)
    fits_a_phone(tab, "Flow · CCWSIM")


def test_the_reason_why_a_model_cannot_be_created_is_on_the_page(chromium, address):
    context = chromium.new_context(viewport={"width": 1440, "height": 900})
    tab = context.new_page()
    outline = ((10.0, 10.0), (80.0, 15.0), (85.0, 80.0), (15.0, 75.0))
    choices = Choices(grid=Grid(96, 96), guides=GuideChoice(active=outline))
    query = urlencode(link_of(choices), doseq=True)
    tab.goto(f"{address}/flow?{query}&data=none&realizations=2")
    tab.wait_for_selector(".st-key-map_heads canvas", timeout=SLOW)
    at_rest(tab)
    tab.locator(".st-key-flow_axis button", has_text="W–E").click(timeout=SLOW)
    tab.locator(".st-key-flow_unsolved", has_text="No head is fixed").wait_for(timeout=SLOW)
    tab.locator(".st-key-flow_downloads button").first.click(timeout=SLOW)
    tab.locator(".st-key-download_models_modflow button").first.click(timeout=SLOW)
    tab.locator("[data-testid=stAlert]", has_text="no head is fixed").wait_for(timeout=SLOW)
    context.close()
