"""Test that saved charts have a title and a caption that names the study."""

from __future__ import annotations

import re
from html import unescape
from pathlib import Path

import pytest

from tests.browser.hands import GLANCE, SLOW, until
from tests.browser.served import CHROMIUM

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no {CHROMIUM}"),
]
STUDY = "?seed=7&realizations=3&data=none&grid=64x48&template=16&overlap=4"


def saved(page, key: str, kind: str) -> Path:
    """Save a chart with the menu beside its title."""
    menu = page.locator(f".st-key-menu_{key}")
    choice = menu.locator(f"[data-kind={kind}]")
    until(
        lambda: None if choice.is_visible() else menu.locator(".open").click(timeout=GLANCE),
        lambda wait: choice.wait_for(timeout=wait),
    )
    with page.expect_download(timeout=SLOW) as waiting:
        choice.click()
    return Path(waiting.value.path())


def words_of(svg: Path) -> str:
    """Return the words of an SVG, whose lines are separate elements."""
    texts = re.findall(r"<tspan[^>]*>([^<]*)</tspan>", svg.read_text("utf-8"))
    return " ".join(unescape(" ".join(texts)).split())


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("simulate", "K 20; 3 realizations, seed 7"),
        ("compare", "B: CCSIM; C: overlap 8, level 3; 12 realizations each, seed 7"),
    ],
)
def test_a_saved_chart_says_what_it_is_of(tab, address, name, said):
    tab.goto(f"{address}/{name}{STUDY}")
    plot = tab.locator(".st-key-chart_variogram_E .main-svg").first
    plot.wait_for(timeout=SLOW)
    tab.wait_for_selector("[data-test-script-state=notRunning]", timeout=SLOW)
    height = plot.bounding_box()["height"]
    svg = saved(tab, "variogram_E", "svg")
    words = words_of(svg)
    assert re.match("Variogram E–W(, along)? channels, no hard data, grid 64 × 48;", words)
    assert "CCWSIM, level 2, template 16, overlap 4" in words
    assert said in words
    sizes = re.search(r'width="([\d.]+)" height="([\d.]+)"', svg.read_text("utf-8"))
    assert sizes is not None
    assert float(sizes[2]) > height
    assert plot.bounding_box()["height"] == height  # the chart on the page is as before
    assert saved(tab, "variogram_E", "png").read_bytes().startswith(b"\x89PNG")
    assert not tab.locator(".chart-caption").is_visible()
