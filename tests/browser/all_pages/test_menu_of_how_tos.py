"""Test that the how-to of a page fits a phone and stays open when results arrive."""

from __future__ import annotations

import pytest

from tests.browser.hands import SLOW, SOON, choose, soon, until
from tests.browser.screenshots import fill_with_maps
from tests.browser.served import CHROMIUM

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no {CHROMIUM}"),
]

LARGE = "grid=512x512&data=none&realizations=100"


def test_a_how_to_fits_a_phone_and_stays_while_realizations_come(phone, address):
    phone.goto(f"{address}/simulate?{LARGE}")
    fill_with_maps(phone)
    text = phone.locator(".st-key-how_to_text")
    ask = phone.get_by_role("button", name="How to", exact=False).locator("visible=true").first
    until(
        lambda: None if text.count() else ask.click(timeout=SOON),
        lambda wait: text.get_by_text("Set up and run a study").wait_for(timeout=wait),
    )
    box = text.bounding_box()
    assert box["x"] >= 0
    assert box["x"] + box["width"] <= 390
    assert phone.evaluate("document.scrollingElement.scrollWidth") <= 390
    phone.wait_for_selector(".st-key-progress", state="detached", timeout=SLOW)
    assert text.is_visible()

    choose(phone, "how_to_Simulate", "Measures")

    def table_scrolls_no_page() -> None:
        assert "Brier score" in text.inner_text()
        assert phone.evaluate("document.scrollingElement.scrollWidth") <= 390

    soon(table_scrolls_no_page)
