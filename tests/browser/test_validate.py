"""Test the page Validate in a browser: charts contain data, and a click shows a realization."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from tests.browser.hands import (
    GLANCE,
    SLOW,
    SOON,
    at_rest,
    fill,
    fits_a_phone,
    run,
    soon,
    to_page,
    until,
    upload,
)
from tests.browser.served import CHROMIUM

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no {CHROMIUM}"),
]

N = 5
CURVES = ("variogram_E", "variogram_N", "connectivity_E", "connectivity_N")

DRAWN = """(key) => {
  const chart = document.querySelector(`.st-key-chart_${key} .js-plotly-plot`);
  if (!chart || !chart._fullData) return null;
  return Object.fromEntries(chart._fullData.map((trace) => [trace.name, trace.z
    ? trace.z.length * trace.z[0].length
    : [...trace.x].filter((v) => v !== null && !Number.isNaN(v)).length]));
}"""
PLACE = """([key, k]) => {
  const chart = document.querySelector(`.st-key-chart_${key} .js-plotly-plot`);
  const { xaxis, yaxis } = chart._fullLayout, trace = chart._fullData[0];
  const box = chart.getBoundingClientRect();
  return [box.x + xaxis._offset + xaxis.l2p(trace.x[k]), box.y + yaxis._offset
    + yaxis.l2p(trace.y[k])];
}"""
INK = """(key) => {
  const canvas = document.querySelector(`.st-key-${key} canvas`)
    || [...document.querySelectorAll(`.st-key-${key} *`)].map((e) => e.shadowRoot)
      .filter((root) => root).map((root) => root.querySelector('canvas')).find((c) => c);
  if (!canvas || !canvas.width) return 0;
  const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
  const colours = new Set();
  for (let k = 0; k < data.length; k += 4)
    colours.add(data[k] << 16 | data[k + 1] << 8 | data[k + 2]);
  return colours.size;
}"""


@pytest.fixture(scope="module")
def judged(desktop, address, request):
    """Yield the page with realizations of channels that honour 400 data."""
    page = desktop.new_page()
    files = published(request)
    if files:
        page.goto(f"{address}/simulate")
        page.wait_for_selector(".st-key-results canvas", timeout=SLOW)
        upload(page, "image", files[0], note=files[0].stem)
        upload(page, "data", files[1], note="397 data")
        to_page(page, "Validate")
    else:
        page.goto(f"{address}/validate")
    page.wait_for_selector(".st-key-chart_mds .js-plotly-plot", timeout=SLOW)
    fill(page, "n_realizations", N)
    run(page)
    page.get_by_text(re.compile(rf"of {N}$")).first.wait_for(timeout=SLOW)
    for key, each in (("mds", 1), *((key, 101) for key in CURVES)):
        there = f"() => ({DRAWN})('{key}')?.realizations === {N * each}"
        page.wait_for_function(there, timeout=SLOW)
    at_rest(page)
    yield page
    page.close()


def published(request) -> tuple[Path, Path] | None:
    """Return the files of the paper's channel image and its 400 data, or None if missing."""
    try:
        folder = request.getfixturevalue("data_dir") / "paper"
    except pytest.skip.Exception:
        return None
    files = folder / "ti_channel_256x256.npy", folder / "hd_channel_400_grid512x512.csv"
    return files if all(file.exists() for file in files) else None


def drawn(page, key: str, timeout: int = SLOW) -> dict[str, int]:
    """Return the number of points of each series of a chart, once the chart is drawn."""
    page.wait_for_function(f"() => ({DRAWN})('{key}')", timeout=timeout)
    return page.evaluate(DRAWN, key)


def show(page, section: str) -> None:
    """Unfold a section by its title, unless it is unfolded, and go to it."""
    from playwright.sync_api import expect

    title = page.get_by_role("button", name=section, exact=True)
    unfolded = "[aria-expanded=true]"
    until(
        lambda: None if title.and_(page.locator(unfolded)).count() else title.click(timeout=SOON),
        lambda wait: expect(title).to_have_attribute("aria-expanded", "true", timeout=wait),
    )
    title.scroll_into_view_if_needed()


def test_a_check_unfolds_its_section_and_the_title_folds_it(judged):
    before = judged.url, judged.evaluate("history.length")
    judged.evaluate("document.querySelector('[data-testid=stMain]').scrollTo(0, 0)")
    title = judged.get_by_role("button", name="Measures", exact=True)
    assert title.get_attribute("aria-expanded") == "false"
    check = judged.locator(".checks").get_by_role("link", name=re.compile("^Measures of")).first
    until(
        lambda: check.click(timeout=SOON),
        lambda wait: judged.locator("table.measures").wait_for(timeout=wait),
    )
    soon(lambda: title.bounding_box()["y"] < 400 or pytest.fail("the section is not in view"))
    assert (judged.url, judged.evaluate("history.length")) == before
    until(
        lambda: title.click(timeout=SOON),
        lambda wait: judged.locator("table.measures").wait_for(state="detached", timeout=wait),
    )


def test_the_figures_of_the_paper_are_on_the_first_screen(judged):
    judged.evaluate("document.querySelector('[data-testid=stMain]').scrollTo(0, 0)")
    for key in CURVES:
        soon(lambda key=key: has_curves(judged, key))
        chart = f".st-key-chart_{key} .js-plotly-plot"  # charts above keep their height at first
        # one more line in the summary moves the section down by a line
        low = f"() => document.querySelector('{chart}').getBoundingClientRect().bottom <= 1150"
        judged.wait_for_function(low, timeout=SLOW)

    def has_points_and_maps() -> None:
        assert drawn(judged, "mds") == {"realizations": N, "shown": 1, "training image": 1}
        for key in ("map_realization", "map_e_type"):
            assert judged.evaluate(INK, key) > 2
            assert judged.locator(f".st-key-{key}").bounding_box()["y"] < 650

    soon(has_points_and_maps)


def has_curves(page, key: str) -> None:
    points = drawn(page, key)
    assert points["training image"] == points["median"] == 101
    assert points["realizations"] == N * 101
    assert points["5–95 %"] == 2 * 101


def test_the_summary_is_said_in_words(judged):
    def is_said() -> None:
        said = judged.locator(".judged").inner_text()
        assert re.search(rf"[Aa]ll (397|400) data honoured in all {N} realizations", said)
        assert re.search(r"\d+\.\d % \(TI 2[67]\.\d %\)", said)
        assert re.search(r"(all \d+|\d+ of \d+) checks (fit|differ)", said)
        assert re.search(r"two realizations differ in \d+ % of the cells", said)

    soon(is_said, SLOW)


def test_a_click_in_the_mds_plot_shows_that_realization(judged):
    judged.evaluate("document.querySelector('[data-testid=stMain]').scrollTo(0, 0)")
    at_rest(judged)
    at = free_point(judged)

    def click() -> None:
        judged.mouse.move(4, 4)
        judged.evaluate("document.querySelector('[data-testid=stMain]').scrollTo(0, 0)")
        x, y = judged.evaluate(PLACE, ["mds", at])
        judged.mouse.move(x, y)
        judged.locator(".st-key-chart_mds .hovertext").first.wait_for(timeout=GLANCE)
        judged.mouse.click(x, y)

    title = judged.locator(".st-key-shown_row", has_text=f"Realization {at + 1} of {N}")
    until(click, lambda wait: title.wait_for(timeout=wait))
    judged.wait_for_function(
        f"() => {{ const c = document.querySelector('.st-key-chart_mds .js-plotly-plot');"
        f" return !!c?._fullData && c._fullData[1].x[0] === c._fullData[0].x[{at}]; }}",
        timeout=SOON,
    )


def free_point(page) -> int:
    """Return a realization that is not shown, and whose point in the plot is not covered."""
    places = np.array([page.evaluate(PLACE, ["mds", k]) for k in range(N)])
    apart = np.linalg.norm(places[:, None] - places[None], axis=2)
    np.fill_diagonal(apart, np.inf)
    nearest = apart.min(axis=1)
    nearest[0] = 0
    return int(nearest.argmax())


FIGURES = {
    "Proportions and geobodies": {
        "proportions": "mud|sand|0|1",
        "gamma": "realizations",
        "n_bodies": "realizations",
        "euler": "realizations",
        "largest": "realizations",
    },
    "Patterns": {"anodi": "between realizations"},
    "Hard data": {"data_status": "mean over realizations"},
    "Any direction": {
        "variogram_azimuth": "realizations",
        "connectivity_azimuth": "median",
        "lags_image": "γ",
        "lags_mean": "γ",
        "lags_apart": "γ",
    },
    "Transiograms": {"transiograms": "→"},
    "Training image": {"repetition": "E–W", "quarters": "training image"},
}
MAPS = {
    "Uncertainty": ("map_probability", "map_most_likely", "map_entropy"),
    "Hard data": ("map_mended",),
    "Copying": ("map_seams", "map_uses"),
}


@pytest.mark.parametrize("section", FIGURES)
def test_every_section_draws_its_figures_when_it_comes_into_view(judged, section):
    show(judged, section)
    for key, series in FIGURES[section].items():
        soon(lambda key=key, series=series: has_series(judged, key, series), SLOW)


def has_series(page, key: str, series: str) -> None:
    points = drawn(page, key)
    there = [n for name, n in points.items() if re.search(series, name)]
    assert there, f"{key}: {sorted(points)}"
    assert max(there) > 1


@pytest.mark.parametrize("section", MAPS)
def test_every_map_has_colours_in_it(judged, section):
    show(judged, section)
    for key in MAPS[section]:
        judged.locator(f".st-key-{key} canvas").first.wait_for(timeout=SLOW)
        judged.wait_for_function(f"() => ({INK})('{key}') > 2", timeout=SOON, polling=200)


def test_a_chart_can_be_taken_home_as_a_picture_and_as_numbers(judged):
    judged.evaluate("document.querySelector('[data-testid=stMain]').scrollTo(0, 0)")
    saved = {kind: taken_home(judged, "variogram_E", kind) for kind in ("PNG", "SVG", "CSV")}
    assert saved["PNG"].startswith(b"\x89PNG")
    assert b"<svg" in saved["SVG"][:200]
    lines = saved["CSV"].decode().splitlines()
    assert lines[0].startswith("series,curve,lag (cells),γ of ")
    assert sum(line.startswith("training image,") for line in lines) == 101
    assert len({line.split(",")[1] for line in lines if line.startswith("realizations,")}) == N


def taken_home(page, key: str, kind: str) -> bytes:
    menu = page.locator(f".st-key-menu_{key}")
    save = menu.get_by_role("button", name=re.compile("^Save"))
    item = menu.get_by_role("menuitem", name=kind)
    until(
        lambda: None if item.is_visible() else save.click(timeout=GLANCE),
        lambda wait: item.wait_for(timeout=wait),
    )
    with page.expect_download(timeout=SLOW) as waiting:
        item.click()
    return Path(waiting.value.path()).read_bytes()


def test_it_opens_cold_on_a_phone_and_in_the_dark(phone, address):
    page = phone
    page.goto(f"{address}/validate")
    page.wait_for_selector(".st-key-chart_connectivity_N .js-plotly-plot", timeout=SLOW)
    fits_a_phone(page, "Validate · CCWSIM")
