"""Test that a change of the theme recolours all elements of the dashboard, including charts."""

from __future__ import annotations

import pytest

from tests.browser.hands import SLOW, at_rest
from tests.browser.served import CHROMIUM

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no {CHROMIUM}"),
]

AXIS = ".st-key-chart_times .xtick text"
BRIGHT = """([selector, bright]) => {
  const found = document.querySelector(selector);
  if (!found) return false;
  const style = getComputedStyle(found);
  const [r, g, b] = (found.closest('svg') ? style.fill : style.color).match(/\\d+/g).map(Number);
  return (r + g + b > 384) === bright;
}"""


def shows(page, selector: str, bright: bool) -> None:
    """Wait until the text of the first element that matches a selector is bright or dark."""
    page.wait_for_function(BRIGHT, arg=[selector, bright], timeout=SLOW)


def test_a_switch_of_the_theme_repaints_style_and_charts(tab, address):
    page = tab
    page.emulate_media(color_scheme="light")
    page.goto(f"{address}/simulate?grid=64x48&data=none&template=16&overlap=4&realizations=3")
    page.wait_for_selector(AXIS, timeout=SLOW)
    at_rest(page)
    label = ".st-key-n_realizations [data-testid=stWidgetLabel] p"
    for theme in ("light", "dark", "light"):
        page.emulate_media(color_scheme=theme)
        shows(page, label, theme == "dark")
        shows(page, AXIS, theme == "dark")
        at_rest(page)
