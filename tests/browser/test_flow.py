"""Test the page Flow in a browser: the live solution, a well by a click, all realizations."""

from __future__ import annotations

import pytest

from tests.browser.hands import SLOW, fits_a_phone
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
    k = tab.locator(".st-key-flow_p_90")
    number = k.locator(".panel span").inner_text().split(",")[0].split()[-1]
    k.get_by_role("button", name="Open").click(timeout=SLOW)
    tab.locator(".panel", has_text=f"Realization {number} of 4").wait_for(timeout=SLOW)


def test_the_page_fits_a_phone(tab, address):
    tab.set_viewport_size({"width": 390, "height": 844})
    tab.goto(f"{address}/flow?{SMALL}")
    tab.wait_for_selector(".st-key-flow_maps canvas", timeout=SLOW)
    fits_a_phone(tab, "Flow · CCWSIM")
