"""Test the page Benchmark in a browser: a short run gives a chart, a long run can be cancelled."""

from __future__ import annotations

import pytest

from tests.browser.hands import GLANCE, SLOW, choose, fill, soon, until
from tests.browser.served import CHROMIUM

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no {CHROMIUM}"),
]

DRAWN = """() => {
  const chart = document.querySelector('.st-key-chart_benchmark .js-plotly-plot');
  if (!chart || !chart._fullData) return {};
  return Object.fromEntries(chart._fullData.map((trace) => [trace.name, trace.x.length]));
}"""


@pytest.fixture(scope="module")
def page(desktop, address):
    page = desktop.new_page()
    page.goto(f"{address}/benchmark")
    page.wait_for_selector(".st-key-chart_benchmark .js-plotly-plot", timeout=SLOW)
    yield page
    page.close()


def plan(page, n: int, words: str) -> None:
    """Set the number of realizations and wait until the page describes the run."""
    fill(page, "benchmark_realizations", n)
    page.locator(".note", has_text=words).first.wait_for(timeout=SLOW)


def press_measure(page) -> None:
    """Start the measurement; the run has begun when it can be cancelled or has ended."""
    button = page.locator(".st-key-measure").get_by_role("button", name="Measure")
    cancel = page.locator(".st-key-benchmark_cancel").get_by_role("button", name="Cancel")
    begun = cancel.or_(page.locator(".note", has_text="median of")).first
    until(
        lambda: None if begun.count() else button.click(timeout=GLANCE),
        lambda wait: begun.wait_for(timeout=wait),
    )


def test_the_first_run_becomes_a_figure_beside_the_paper(page):
    plan(page, 1, "9 settings × 1 realization on one thread: about")

    def shows_the_paper() -> None:
        assert set(page.evaluate(DRAWN)) == {f"paper, level {k}" for k in (1, 2, 3)}

    soon(shows_the_paper)
    press_measure(page)
    for k in (1, 2, 3):
        page.wait_for_function(f"() => ({DRAWN})()['level {k}'] === 3", timeout=SLOW)
    page.locator(".note", has_text="(level 3); 1 is linear").wait_for(timeout=SLOW)
    assert page.locator("[data-testid=stException], [data-testid=stAlert]").count() == 0


def test_a_long_run_can_be_stopped(page):
    choose(page, "benchmark_varied", "candidates K")
    plan(page, 100, "9 settings × 100 realizations")
    button = page.locator(".st-key-measure").get_by_role("button", name="Measure")
    cancel = page.locator(".st-key-benchmark_cancel").get_by_role("button", name="Cancel")
    until(
        lambda: None if cancel.count() else button.click(timeout=GLANCE),
        lambda wait: cancel.wait_for(timeout=wait),
    )
    stopped = page.get_by_text("Stopped after")
    until(
        lambda: cancel.click(timeout=GLANCE) if cancel.count() else None,
        lambda wait: stopped.wait_for(timeout=wait),
    )
    page.locator(".st-key-measure").get_by_role("button", disabled=False).wait_for(timeout=SLOW)
