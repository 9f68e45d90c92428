"""Test the page Sweep in a browser: run, cancel, view the results, and use a setting."""

from __future__ import annotations

import re

import pytest

from tests.browser.hands import (
    GLANCE,
    SLOW,
    SOON,
    at_rest,
    fill,
    fits_a_phone,
    follow,
    to_page,
    until,
)
from tests.browser.served import CHROMIUM

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no {CHROMIUM}"),
]

TILES = ".st-key-sweep_tiles button"
PLACES = """() => {
  const chart = document.querySelector('.st-key-chart_sweep .js-plotly-plot');
  const { xaxis, yaxis } = chart._fullLayout, trace = chart._fullData[0];
  const box = chart.getBoundingClientRect();
  return [...trace.x].map((x, k) => [box.x + xaxis._offset + xaxis.d2p(x),
    box.y + yaxis._offset + yaxis.d2p(trace.y[k])]);
}"""


@pytest.fixture
def page(tab, address):
    tab.goto(f"{address}/sweep")
    tab.locator(".st-key-sweep_first").get_by_role("button").wait_for(timeout=SLOW)
    return tab


def press(page, name: str, value: str, then: str) -> None:
    """Switch a value of a range on or off, and wait for the new text `then` of the button."""
    pill = page.locator(f".st-key-range_{name}").get_by_role("button", name=value, exact=True)
    button = page.locator(".st-key-sweep").get_by_role("button", name=then, exact=True)
    at_rest(page)
    until(
        lambda: None if button.count() else pill.click(),
        lambda wait: button.wait_for(timeout=wait),
    )


def twelve_settings(page, n: str) -> None:
    press(page, "overlap_size", "5", "Try 17 settings")
    press(page, "overlap_size", "12", "Try 9 settings")
    press(page, "wavelet_level", "0", "Try 6 settings")
    press(page, "template_size", "16", "Try 8 settings")
    press(page, "template_size", "24", "Try 10 settings")
    press(page, "template_size", "40", "Try 12 settings")
    fill(page, "n_swept", n)
    page.locator(".note", has_text=f"12 settings × {n} realizations").wait_for(timeout=SLOW)


def setting(page) -> str:
    return page.locator(".setting").first.inner_text()


def shows(page, label: str, timeout: int = SLOW) -> None:
    """Wait until the setting of a tile is shown large."""
    parts = label.split(" · ")
    page.wait_for_function(
        "(parts) => { const p = document.querySelector('.setting');"
        " return p && parts.every((part) => p.innerText.split(' · ').includes(part)); }",
        arg=parts, timeout=timeout,
    )  # fmt: skip


def label_of(page, k: int) -> str:
    return page.locator(TILES).nth(k).locator(".label").inner_text()


def test_a_sweep_is_stopped_half_way_and_one_setting_is_taken(page):
    from playwright.sync_api import expect

    twelve_settings(page, "12")
    start = page.locator(".st-key-sweep").get_by_role("button")
    progress = page.locator(".st-key-sweep_progress")
    until(
        lambda: None if progress.count() else start.click(timeout=SOON),
        lambda wait: progress.wait_for(timeout=wait),
    )
    page.wait_for_function("() => !document.querySelector('.st-key-sweep_first')", timeout=SLOW)
    page.locator(f"{TILES}:not([disabled])").nth(3).wait_for(timeout=2 * SLOW)
    expect(page.locator(TILES)).to_have_count(12, timeout=SOON)
    ended = page.get_by_text(re.compile(r"Stopped after \d+ of 12 settings; these are shown"))
    cancel = page.locator(".st-key-sweep_cancel").get_by_role("button")
    until(
        lambda: cancel.click(timeout=2000) if cancel.count() else None,
        lambda wait: ended.wait_for(timeout=2 * wait),
    )
    at_rest(page)
    n = int(re.findall(r"\d+", ended.inner_text())[0])
    assert 4 <= n < 12
    page.wait_for_function(f"() => !document.querySelector('{TILES}[disabled]')", timeout=SLOW)
    expect(page.locator(TILES)).to_have_count(n, timeout=SOON)
    page.locator(".choice", has_text="Recommended so far").first.wait_for(timeout=SOON)

    look_through(page, n)
    take(page, n)


def look_through(page, n: int) -> None:
    """Click a tile, then a point of the chart."""
    shown = setting(page)
    labels = [label_of(page, k) for k in range(n)]
    other = next(k for k in range(n) if not is_of(labels[k], shown))
    until(
        lambda: page.locator(TILES).nth(other).click(),
        lambda wait: shows(page, labels[other], wait),
    )
    at_rest(page)
    chart = "() => document.querySelector('.st-key-chart_sweep .js-plotly-plot')?._fullData"
    page.wait_for_function(chart, timeout=SLOW)
    alone = farthest(page.evaluate(PLACES), other)

    def click() -> None:
        page.mouse.move(4, 4)
        x, y = page.evaluate(PLACES)[alone]
        page.mouse.move(x, y)
        page.locator(".st-key-chart_sweep .hovertext").first.wait_for(timeout=GLANCE)
        page.mouse.click(x, y)

    until(click, lambda wait: shows(page, labels[alone], wait))


def is_of(label: str, shown: str) -> bool:
    return all(part in shown.split(" · ") for part in label.split(" · "))


def farthest(places: list[list[float]], but: int) -> int:
    """Return the point that is farthest from all other points."""

    def room(k: int) -> float:
        return min(
            (x - places[k][0]) ** 2 + (y - places[k][1]) ** 2
            for j, (x, y) in enumerate(places) if j != k
        )  # fmt: skip

    return max((k for k in range(len(places)) if k != but), key=room)


def take(page, n: int) -> None:
    """Use the large setting for the study, check Simulate, and return to the sweep."""
    from playwright.sync_api import expect

    found = re.search(r"T (\d+) · OR (\d+) · level (\d+) · K (\d+)", setting(page))
    assert found
    values = dict(
        zip(("template_size", "overlap_size", "wavelet_level", "n_candidates"), found.groups(),
            strict=True)
    )  # fmt: skip
    at_rest(page)
    follow(page, page.locator(".st-key-use_setting").get_by_role("button"), "simulate")
    page.locator(".st-key-template_size").first.wait_for(timeout=SLOW)
    for key, value in values.items():
        page.wait_for_function(
            "([key, value]) => [...document.querySelectorAll(`.st-key-${key} input`)]"
            ".some((input) => input.value === value)",
            arg=[key, value], timeout=SLOW,
        )  # fmt: skip
    to_page(page, "Sweep")
    expect(page.locator(TILES)).to_have_count(n, timeout=SLOW)


def test_it_opens_cold_on_a_phone_and_in_the_dark(phone, address):
    page = phone
    page.goto(f"{address}/sweep")
    page.locator(".st-key-sweep_below").get_by_role("button").wait_for(timeout=SLOW)
    fits_a_phone(page, "Sweep · CCWSIM")
