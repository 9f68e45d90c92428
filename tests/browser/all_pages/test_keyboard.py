"""Test that a study can be set up, run and viewed with only the keyboard, with visible focus."""

from __future__ import annotations

import re
from typing import Any

import pytest

from tests.browser.hands import SLOW, SOON, at_rest, until
from tests.browser.served import CHROMIUM

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no {CHROMIUM}"),
]

MAX_STOPS = 120
FOCUSED = """() => {
  let here = document.activeElement;
  while (here.shadowRoot && here.shadowRoot.activeElement) here = here.shadowRoot.activeElement;
  return here;
}"""
NAME = "(e) => [e.tagName, e.getAttribute('aria-label') || e.innerText || ''].join(' ').trim()"
RINGED = """(e) => [e, e.closest('label')].some((at) => {
  if (!at) return false;
  const style = getComputedStyle(at);
  const outlined = style.outlineStyle !== 'none' && parseFloat(style.outlineWidth) > 0;
  return outlined || style.boxShadow !== 'none';
})"""


def tab_to(page, name: str) -> Any:
    """Press Tab until an element with a given name has the focus; return the element."""
    met = []
    for _ in range(MAX_STOPS):
        page.keyboard.press("Tab")
        here = page.evaluate_handle(FOCUSED)
        met.append(here.evaluate(NAME))
        if re.fullmatch(name, met[-1], re.DOTALL):
            return here
    raise AssertionError(f"Tab never came to {name}, but to {met}")


def see_focus_on(page, name: str) -> None:
    """Press Tab until an element with a given name has the focus; check that this is visible."""
    page.wait_for_function(RINGED, arg=tab_to(page, name), timeout=SOON)


def test_a_study_is_run_and_a_realization_chosen_with_the_keyboard(tab, address):
    from playwright.sync_api import expect

    page = tab
    page.set_viewport_size({"width": 1440, "height": 1000})
    page.goto(f"{address}/simulate?grid=64x48&data=none&template=16&overlap=4&realizations=5")
    page.wait_for_selector(".st-key-gallery button", timeout=SLOW)
    page.wait_for_selector(".st-key-chart_times .xtick text", timeout=SLOW)
    at_rest(page)

    tab_to(page, "INPUT How many")
    page.keyboard.press("Control+A")
    page.keyboard.type("3")
    page.keyboard.press("Enter")
    at_rest(page)
    see_focus_on(page, "BUTTON Run")
    page.keyboard.press("Enter")
    expect(page.locator(".facts", has_text="3 realizations in").first).to_be_visible(timeout=SLOW)
    expect(page.locator(".st-key-gallery button")).to_have_count(3, timeout=SLOW)
    at_rest(page)

    see_focus_on(page, "A Simulate")
    see_focus_on(page, "CANVAS Realization 1")
    see_focus_on(page, "BUTTON Realization 1")
    shown = page.locator(".panel", has_text="Realization 2 of 3").first
    until(
        lambda: None if shown.count() else page.keyboard.press("ArrowRight"),
        lambda wait: expect(shown).to_be_visible(timeout=wait),
    )


def test_the_menu_leads_on_with_the_keyboard(phone, address):
    from playwright.sync_api import expect

    page = phone
    page.goto(f"{address}/paper")
    page.wait_for_selector(".st-key-paper_start button", timeout=SLOW)
    at_rest(page)
    see_focus_on(page, "BUTTON Menu.*")
    page.keyboard.press("Enter")
    see_focus_on(page, "A Examples")
    page.keyboard.press("Enter")
    expect(page.locator(".st-key-examples_row")).to_be_visible(timeout=SLOW)
