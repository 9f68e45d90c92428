"""Test the page Benchmark in a browser: a short run gives a chart, a long run can be cancelled."""

from __future__ import annotations

import csv
from io import StringIO
from pathlib import Path

import pytest

from tests.browser.hands import GLANCE, SLOW, at_rest, choose, fill, soon, until
from tests.browser.served import CHROMIUM

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no {CHROMIUM}"),
]

DRAWN = """(key) => {
  const chart = document.querySelector(`.st-key-chart_${key} .js-plotly-plot`);
  if (!chart || !chart._fullData) return null;
  return Object.fromEntries(chart._fullData.map((trace) => [trace.name, trace.x.length]));
}"""


@pytest.fixture(scope="module")
def page(desktop, address):
    page = desktop.new_page()
    page.goto(f"{address}/benchmark")
    page.wait_for_selector(".st-key-chart_times_cell .js-plotly-plot", timeout=SLOW)
    yield page
    page.close()


def plan(page, largest: int, n: int, words: str) -> None:
    """Set up a run and wait until the page describes it."""
    choose(page, "largest", f"{largest} × {largest}")
    fill(page, "grids_realizations", n)
    page.locator(".note", has_text=words).first.wait_for(timeout=SLOW)


def test_the_smallest_run_becomes_a_figure_beside_the_paper(page):
    plan(page, 512, 1, "6 settings × 1 realization on one thread: about")

    def shows_the_paper() -> None:
        assert set(page.evaluate(DRAWN, "times_grid")) == {f"paper, level {k}" for k in (1, 2, 3)}

    soon(shows_the_paper)
    button = page.locator(".st-key-measure_grids").get_by_role("button", name="Measure")
    cancel = page.locator(".st-key-cancel_grids").get_by_role("button", name="Cancel")
    ended = page.locator(".note", has_text="Level 3:")
    begun = cancel.or_(ended).first
    until(
        lambda: None if begun.count() else button.click(timeout=GLANCE),
        lambda wait: begun.wait_for(timeout=wait),
    )
    level_1 = f"() => ({DRAWN})('times_grid')?.['level 1'] > 0"
    page.wait_for_function(level_1, timeout=SLOW)
    ended.wait_for(timeout=SLOW)
    for key in ("times_grid", "times_cell"):
        for k in (1, 2, 3):
            two = f"() => ({DRAWN})('{key}')?.['level {k}'] === 2"
            page.wait_for_function(two, timeout=SLOW)
    assert page.locator("[data-testid=stException], [data-testid=stAlert]").count() == 0


def test_the_times_can_be_taken_home(page):
    save = page.locator(".st-key-download_times").get_by_role("button")
    save.wait_for(timeout=SLOW)
    at_rest(page)
    with page.expect_download(timeout=SLOW) as waiting:
        save.click()
    rows = list(csv.DictReader(StringIO(Path(waiting.value.path()).read_text("utf-8"))))
    assert len(rows) >= 6
    assert {row["nx"] for row in rows} == {"256", "512"}


def test_a_long_run_can_be_stopped(page):
    plan(page, 3000, 100, "15 settings × 100 realizations")
    button = page.locator(".st-key-measure_grids").get_by_role("button", name="Measure")
    cancel = page.locator(".st-key-cancel_grids").get_by_role("button", name="Cancel")
    until(
        lambda: None if cancel.count() else button.click(timeout=GLANCE),
        lambda wait: cancel.wait_for(timeout=wait),
    )
    stopped = page.get_by_text("Stopped after")
    until(
        lambda: cancel.click(timeout=GLANCE) if cancel.count() else None,
        lambda wait: stopped.wait_for(timeout=wait),
    )
    page.locator(".st-key-measure_data").get_by_role("button", disabled=False).wait_for(
        timeout=SLOW
    )
