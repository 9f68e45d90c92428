"""Test Live in a browser: after quick changes the last picture stays, and a click goes back."""

from __future__ import annotations

import re

import numpy as np
import pytest

from ccwsim import Parameters, datasets, simulate
from tests.browser.hands import (
    GLANCE,
    SLOW,
    SOON,
    at_rest,
    choose,
    close_menu,
    fill,
    menu,
    settled,
    soon,
    switch_on,
    until,
)
from tests.browser.served import CHROMIUM

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no {CHROMIUM}"),
]

SIDE, N = 96, 6
LAST_SEED = 15
WATCH = """
() => {
  window.seen = [];
  window.canvas = (key) => {
    const own = document.querySelector(`.st-key-${key}`);
    const host = own && [...own.querySelectorAll('*')].find((element) => element.shadowRoot);
    return own && (host ? host.shadowRoot : own).querySelector('canvas');
  };
  for (const key of ['map_realization', 'map_e_type', 'map_image'])
    window.canvas(key).made = 'before';
  new MutationObserver(() => {
    for (const facts of document.querySelectorAll('.facts'))
      if (facts.innerText !== window.seen.at(-1)) window.seen.push(facts.innerText);
    if (!window.canvas('map_realization')) window.seen.push('BLANK');
  }).observe(document.body, {subtree: true, childList: true, characterData: true});
}
"""
KEPT = """
() => ['map_realization', 'map_e_type', 'map_image'].every(
  (key) => window.canvas(key).made === 'before')
"""
PICTURE = "() => window.canvas('map_realization').toDataURL()"
SOUTH = """() => {
  const canvas = window.canvas('map_realization'), south = new OffscreenCanvas(canvas.width, 99);
  const pen = south.getContext('2d');
  pen.drawImage(canvas, 0, 198 - canvas.height);
  return pen.getImageData(0, 0, canvas.width, 99).data.join();
}"""
"""Cells in the south of the realization, below the text with its number."""


def own(seed: int, level: int = 2):
    return simulate(
        datasets.load("channels"), (SIDE, SIDE), Parameters(wavelet_level=level),
        n_realizations=N, seed=seed,
    )  # fmt: skip


@pytest.fixture(scope="module")
def page(desktop, address):
    """Yield the page of a small study with results, with Live on."""
    page = desktop.new_page()
    page.goto(f"{address}/simulate?data=none&grid={SIDE}x{SIDE}&realizations={N}")
    page.wait_for_selector(".st-key-map_e_type canvas", timeout=SLOW)
    switch_on(page, "live")
    complete(page)
    yield page
    page.close()


def complete(page) -> None:
    """Wait until all realizations are shown and the page is at rest."""
    from playwright.sync_api import expect

    now = page.locator(".facts", has_text=re.compile(f"no hard data.*{N} realizations in"))
    expect(now.first).to_be_visible(timeout=SLOW)
    expect(page.locator(".st-key-progress")).to_have_count(0, timeout=SLOW)
    at_rest(page)


def downloaded(page, level: int = 2) -> np.ndarray:
    """Return the downloaded realizations of a level; the page may first offer the previous file."""
    found: list[np.ndarray] = []
    opens = page.locator(".st-key-facts_row").get_by_role("button", name="Download")
    file = page.locator(".st-key-download_realizations_npz button").first

    def ask() -> None:
        until(
            lambda: None if file.is_visible() else opens.click(timeout=GLANCE),
            lambda wait: file.wait_for(timeout=wait),
        )
        with page.expect_download(timeout=SLOW) as waiting:
            file.click(timeout=GLANCE)
        assert waiting.value.suggested_filename.endswith(f"_L{level}_seed{LAST_SEED}.npz")
        found.append(np.load(waiting.value.path())["realizations"])

    soon(ask, SLOW)
    page.keyboard.press("Escape")
    return found[-1]


def type_quickly(page, seeds) -> None:
    """Type several seeds quickly, without waiting for results."""
    box = page.locator(".st-key-seed input")
    for seed in seeds:
        box.fill(str(seed))
        box.press("Enter")
        page.wait_for_timeout(60)


def test_five_quick_changes_end_in_the_picture_of_the_last(page):
    from playwright.sync_api import expect

    page.evaluate(WATCH)
    until(
        lambda: type_quickly(page, range(LAST_SEED - 4, LAST_SEED + 1)),
        lambda wait: expect(page.locator(".st-key-seed input")).to_have_value(
            str(LAST_SEED), timeout=wait
        ),
    )
    complete(page)
    expected = own(LAST_SEED)
    strip = page.locator(".st-key-history button")
    expect(strip.first).to_have_attribute("aria-label", re.compile(f"→ {LAST_SEED}"), timeout=SLOW)
    complete(page)
    assert np.array_equal(downloaded(page), expected.realizations)
    # no result of an older run follows: picture and facts do not change
    picture = settled(page, lambda: page.evaluate(PICTURE))
    facts = settled(page, page.locator(".facts").first.inner_text)
    page.wait_for_timeout(1500)
    at_rest(page)
    assert page.evaluate(PICTURE) == picture
    assert page.locator(".facts").first.inner_text() == facts
    assert "BLANK" not in page.evaluate("window.seen")
    assert page.evaluate(KEPT), "a map was made anew, which flickers"


def test_a_click_in_the_history_brings_study_and_results_back(page):
    from playwright.sync_api import expect

    strip = page.locator(".st-key-history button")
    before, south = downloaded(page), page.evaluate(SOUTH)
    choose(page, "wavelet_level", "1")
    changed = strip.filter(has_text="level 2 → 1")
    changed.first.wait_for(timeout=SLOW)
    complete(page)
    assert np.array_equal(downloaded(page, level=1), own(LAST_SEED, level=1).realizations)
    the_map_before_is_shown_while_a_key_is_held(page, south)
    first, second = strip.nth(0), strip.nth(1)
    expect(first).to_have_attribute("aria-current", "true", timeout=SLOW)

    def with_the_keyboard_alone() -> None:
        first.focus()
        page.keyboard.press("ArrowRight")
        page.keyboard.press("Enter")

    until(
        with_the_keyboard_alone,
        lambda wait: expect(second).to_have_attribute("aria-current", "true", timeout=wait),
    )
    complete(page)
    expect(page.locator(".st-key-wavelet_level input")).to_have_value("2", timeout=SLOW)
    assert np.array_equal(downloaded(page), before)
    # and forward with the mouse
    until(
        lambda: first.click(),
        lambda wait: expect(first).to_have_attribute("aria-current", "true", timeout=wait),
    )
    complete(page)
    expect(page.locator(".st-key-wavelet_level input")).to_have_value("1", timeout=SLOW)


def the_map_before_is_shown_while_a_key_is_held(page, before: str) -> None:
    def shows(held: bool) -> None:
        assert (page.evaluate(SOUTH) == before) == held

    soon(lambda: shows(False))
    page.evaluate("window.canvas('map_realization').focus()")
    page.keyboard.down("b")
    soon(lambda: shows(True))
    page.keyboard.up("b")
    soon(lambda: shows(False))


def test_on_a_phone_the_history_scrolls_in_its_own_row(page):
    size = page.viewport_size
    page.set_viewport_size({"width": 390, "height": 844})
    strip = page.locator(".st-key-history button")
    strip.first.scroll_into_view_if_needed(timeout=SLOW)

    def starts_in_view() -> None:
        assert page.evaluate("document.scrollingElement.scrollWidth") <= 390
        assert strip.first.bounding_box()["x"] >= 0

    def brings_the_last_into_view() -> None:
        strip.last.focus()
        assert 0 <= strip.last.bounding_box()["x"] <= 390 - 40

    soon(starts_in_view)
    soon(brings_the_last_into_view)
    page.set_viewport_size(size)


def test_a_source_of_data_that_is_chosen_while_live_stays(desktop, address):
    page = desktop.new_page()
    page.goto(f"{address}/simulate")
    page.wait_for_selector(".st-key-map_e_type canvas", timeout=SLOW)
    switch_on(page, "live")
    menu(page, "data_row")  # the menu also draws the list of surveys, with its present value
    choose(page, "data_source", "none")
    close_menu(page)
    fill(page, "grid_nx", SIDE)

    def stays() -> None:
        assert f"grid={SIDE}x" in page.url
        assert "data=none" in page.url
        assert "none: unconditional" in page.locator(".st-key-data_row").inner_text()

    soon(stays)
    page.close()


def test_a_slider_changes_the_study_when_it_is_released(tab, address):
    tab.goto(f"{address}/simulate?realizations=2&data=none&grid=64x64")
    tab.wait_for_selector(".st-key-charts", timeout=SLOW)
    slider = tab.locator(".st-key-n_candidates_slider [data-testid=stSliderThumbValue]").first
    slider.evaluate("e => e.scrollIntoView({ block: 'center' })")  # above the last step
    box = slider.bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] + 6  # the thumb below its value
    tab.mouse.move(x, y)
    tab.mouse.down()
    tab.mouse.move(x + 20, y, steps=5)
    tab.wait_for_timeout(1500)
    assert not re.search(r"[?&]candidates=", tab.url)
    tab.mouse.up()
    tab.wait_for_url(re.compile(r"[?&]candidates="), timeout=SOON)
