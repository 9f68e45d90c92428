"""Test the page Compare in a browser: its numbers are correct, and Simulate accepts a setting."""

from __future__ import annotations

import csv
import re
from io import StringIO
from pathlib import Path

import pytest

from ccwsim import Parameters, datasets
from ccwsim.experiments.comparison import compare
from ccwsim.ui.compare.findings import sentences
from tests.browser.hands import GLANCE, SLOW, SOON, choose, fill, follow, soon, to_page, until
from tests.browser.served import CHROMIUM

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no {CHROMIUM}"),
]

N = 4
SETTINGS = {
    "A": Parameters(),
    "B": Parameters(method="ccsim"),
    "C": Parameters(wavelet_level=1, n_candidates=5),
}
SERIES = """(key) => {
  const chart = document.querySelector(`.st-key-chart_${key} .js-plotly-plot`);
  return chart && chart._fullData
    ? Object.fromEntries(chart._fullData.map((t) => [t.name, { x: [...t.x], y: [...t.y] }]))
    : null;
}"""
PLACE = """([key, series, k]) => {
  const chart = document.querySelector(`.st-key-chart_${key} .js-plotly-plot`);
  chart.scrollIntoView({ block: 'center' });
  const { xaxis, yaxis } = chart._fullLayout, trace = chart._fullData[series];
  const box = chart.getBoundingClientRect();
  return [box.x + xaxis._offset + xaxis.l2p(trace.x[k]), box.y + yaxis._offset
    + yaxis.l2p(trace.y[k])];
}"""
IDLE = "[data-test-script-state=notRunning]"


@pytest.fixture(scope="module")
def core():
    """Return the comparison that the library computes; this also compiles the kernels."""
    return compare(datasets.load("channels"), (160, 160), SETTINGS, None, N, seed=0)


@pytest.fixture
def page(tab):
    return tab


def see(locator, wait: float = SLOW):
    from playwright.sync_api import expect

    expect(locator.first).to_be_visible(timeout=wait)


def compared(page, address: str) -> None:
    """Open the page, choose the settings and compare them."""
    page.goto(f"{address}/compare?grid=160x160&data=none")
    see(page.locator(".st-key-chart_compared_mds .js-plotly-plot"))
    choose(page, "C_wavelet_level", "1")
    see(page.locator(".st-key-setting_C .setting", has_text="level 1"))
    fill(page, "C_n_candidates", 5)
    see(page.locator(".st-key-setting_C .setting", has_text="level 1, K 5"))
    fill(page, "n_compared", N)
    see(page.locator(".st-key-outdated", has_text="Out of date"))
    button = page.locator(".st-key-compare").get_by_role("button", name="Compare")
    shown = page.get_by_text(f"Realization 1 of {N}")
    begun = page.locator(".st-key-progress").or_(shown)
    until(
        lambda: None if begun.count() else button.click(timeout=SOON),
        lambda wait: see(begun, wait),
    )
    see(shown)
    see(page.locator(".st-key-results .setting", has_text="level 1, K 5"))
    page.wait_for_function(f"() => ({SERIES})('compared_mds')?.C?.x.length === {N}", timeout=SLOW)
    see(page.locator("table.ratios"))
    page.wait_for_selector(IDLE, timeout=SLOW)


def test_three_settings_are_compared_and_one_is_used(page, address, core):
    from playwright.sync_api import expect

    compared(page, address)

    settings = saved(page, "Settings")
    assert [row["setting"] for row in settings] == list(SETTINGS)
    for k, row in enumerate(settings):
        assert float(row["distance_to_image_bits"]) == pytest.approx(core.distance[k], rel=1e-4)
        assert float(row["variety_bits"]) == pytest.approx(core.variety[k], rel=1e-4)
    soon(lambda: ratios_are_those_of(page, core))
    expect(page.locator(".summary p")).to_have_count(len(sentences(core)), timeout=SOON)
    page.wait_for_function(f"() => ({SERIES})('variogram_E')", timeout=SLOW)
    soon(lambda: curves_are_those_of(page, core))

    clicked_point_shows_its_realization(page)
    use = page.locator(".st-key-use_C").get_by_role("button")
    follow(page, use, "simulate")
    expect(page.locator(".st-key-n_candidates input")).to_have_value("5", timeout=SLOW)
    expect(page.locator(".st-key-wavelet_level input")).to_have_value("1", timeout=SLOW)
    to_page(page, "Compare")
    see(page.locator(".st-key-outdated", has_text="Out of date"))
    see(page.locator(".st-key-setting_C .setting", has_text="level 2, K 20"))


def ratios_are_those_of(page, core) -> None:
    lines = page.locator("table.ratios tr").all_inner_texts()[1:]
    assert len(lines) == len(core.ratios)
    for line, ratio in zip(lines, core.ratios, strict=True):
        words = line.split("\t")
        assert words[0].strip() == f"{ratio.name} : {ratio.other}"
        assert [float(w) for w in words[1:4]] == pytest.approx(
            [ratio.between, ratio.within, ratio.ratio], abs=0.006
        )


def curves_are_those_of(page, core) -> None:
    drawn = page.evaluate(SERIES, "variogram_E")
    curves = core.curves[1, "variogram", "E-W"]
    assert {"training image", *SETTINGS} <= set(drawn)
    assert drawn["training image"]["y"] == pytest.approx(curves.reference.tolist())
    for k, name in enumerate(SETTINGS):
        assert drawn[name]["y"] == pytest.approx(curves.bands[k].median.tolist())


def clicked_point_shows_its_realization(page) -> None:
    """Click the point of setting B that is farthest from all other points."""
    points = page.evaluate(SERIES, "compared_mds")
    places = [
        (x, y) for name in ("A", "B", "C", "training image")
        for x, y in zip(points[name]["x"], points[name]["y"], strict=True)
    ]  # fmt: skip

    def alone(k: int) -> float:
        x, y = points["B"]["x"][k], points["B"]["y"][k]
        return sorted((x - a) ** 2 + (y - b) ** 2 for a, b in places)[1]

    k = max(range(1, N), key=alone)

    def click() -> None:
        page.mouse.move(4, 4)
        page.evaluate(PLACE, ["compared_mds", 1, k])  # first scroll to the chart
        x, y = page.evaluate(PLACE, ["compared_mds", 1, k])
        page.mouse.move(x, y)
        see(page.locator(".st-key-chart_compared_mds .hovertext"), GLANCE)
        page.mouse.click(x, y)

    until(click, lambda wait: see(page.get_by_text(f"Realization {k + 1} of {N}"), wait))
    page.wait_for_selector(IDLE, timeout=SLOW)


def saved(page, label: str) -> list[dict[str, str]]:
    menu = page.locator(".st-key-downloads").get_by_role("button", name="Download")
    file = page.get_by_role("button", name=re.compile(label))
    until(
        lambda: None if file.is_visible() else menu.click(timeout=GLANCE),
        lambda wait: see(file, wait),
    )
    with page.expect_download(timeout=SLOW) as waiting:
        file.click()
    page.keyboard.press("Escape")
    return list(csv.DictReader(StringIO(Path(waiting.value.path()).read_text("utf-8"))))


def test_on_a_phone_the_menu_is_one_line(phone, address):
    page = phone
    page.goto(f"{address}/compare?grid=1500x1500")  # long enough to be stopped
    see(page.locator(".st-key-setting_A"))

    def is_one_line() -> None:
        assert page.locator(".st-key-menu").bounding_box()["height"] < 60
        assert page.evaluate("document.scrollingElement.scrollWidth") <= 390
        names = page.locator(".st-key-menu").locator("a, button").locator("visible=true")
        words = [text.split("\n")[0] for text in names.all_inner_texts()]  # without the icon
        assert words == ["Simulate", "Data", "Check", "Menu"]
        right = "(all) => Math.max(...all.map((e) => e.getBoundingClientRect().right))"
        assert names.evaluate_all(right) < 390

    soon(is_one_line)
    cancel = page.locator(".st-key-progress").get_by_role("button", name="Cancel")
    see(cancel)
    stopped = page.locator("[data-testid=stAlert]", has_text="Stopped")
    until(
        lambda: cancel.click(timeout=GLANCE) if cancel.count() else None,
        lambda wait: see(stopped, wait),
    )
