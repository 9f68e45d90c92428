"""Test that maps, thumbnails and charts of Simulate are visible without scrolling."""

from __future__ import annotations

from dataclasses import replace
from urllib.parse import urlencode

import pytest

from ccwsim import Grid, Parameters
from ccwsim.sharing.choices import Choices, DataChoice, Gradient, GuideChoice, ImageChoice
from ccwsim.sharing.link import link_of
from tests.browser.hands import SLOW, at_rest, fill, run, soon
from tests.browser.served import CHROMIUM

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no {CHROMIUM}"),
]

SIZES = [(1440, 900), (1440, 760), (1920, 1080), (1280, 720), (1024, 768)]
NARROW = 1200  # below this width, two of the four charts are on the first screen
SMALL = Choices(data=DataChoice(), parameters=Parameters(16, 4), n_realizations=3)
STUDIES = {
    "square": replace(SMALL, grid=Grid(96, 96)),
    "wide": replace(SMALL, grid=Grid(60, 160)),
    "tall": replace(SMALL, grid=Grid(160, 80)),
    "guided": replace(
        SMALL, grid=Grid(96, 96), guides=GuideChoice(probabilities=Gradient(90.0, 0.15, 0.45))
    ),
    "facies": replace(SMALL, grid=Grid(96, 96), image=ImageChoice("barchans")),
    "world": replace(
        SMALL, grid=Grid(96, 96, cell_size=(25.0, 25.0), origin=(436000.0, 4505000.0))
    ),
    "volume": replace(
        SMALL,
        grid=Grid(48, 48, nz=16),
        image=ImageChoice("stacked_lenses"),
        parameters=Parameters((8, 16, 16), (4, 8, 8), (1, 1, 1)),
    ),
}
BOXES = """() => {
  const deep = (root) => [...root.querySelectorAll('canvas'),
    ...[...root.querySelectorAll('*')].flatMap((e) => (e.shadowRoot ? deep(e.shadowRoot) : []))];
  const box = (e) => { const { left, top, right, bottom } = e.getBoundingClientRect();
    return [left, top, right, bottom].map(Math.round); };
  const shown = (e) => e.offsetWidth > 0;
  const of = (key) => [...document.querySelectorAll(key)];
  const canvases = (key) => of(key).flatMap(deep).filter(shown).map(box);
  return {
    realization: canvases('.st-key-map_realization, .st-key-volume_realization'),
    e_type: canvases('.st-key-map_e_type, .st-key-volume_e_type'),
    legends: of('.st-key-area_realization, .st-key-area_e_type').map((area) => {
      const all = [...area.querySelectorAll('*')].map((e) => e.shadowRoot?.querySelector('.below'));
      return box(all.find(Boolean)); }),
    gallery: of('.st-key-gallery').map(box),
    charts: of('.st-key-charts .chart .main-svg:first-child').map(box),
    run: of('.stSidebar .st-key-run button').map(box),
    letters: of('.st-key-charts .chart text').map((e) => parseFloat(
      getComputedStyle(e).fontSize)),
  }; }"""
TOPS = """() => {
  window.tops = new Set();
  const top = (key) => Math.round(document.querySelector(key)?.getBoundingClientRect().top ?? -1);
  const look = () => {
    window.tops.add(['.st-key-map_realization', '.st-key-gallery', '.st-key-chart_times']
      .map(top).join(' '));
    requestAnimationFrame(look);
  };
  look();
}"""


def opened(tab, address: str, choices: Choices) -> None:
    """Open Simulate with a study, and wait until its charts are drawn."""
    tab.goto(f"{address}/simulate?{urlencode(link_of(choices), doseq=True)}")
    tab.wait_for_selector(".st-key-chart_times .main-svg", timeout=SLOW)
    tab.wait_for_function("() => !document.querySelector('.st-key-progress, .ghost')", timeout=SLOW)
    at_rest(tab)


def check_visible(tab, width: int, height: int, *, square: bool) -> None:
    """Check that everything that belongs to the first screen is inside the window."""
    boxes = tab.evaluate(BOXES)
    charts = boxes["charts"]
    assert len(charts) == 4
    first = charts if width >= NARROW else charts[:2]
    parts = [*boxes["realization"], *boxes["e_type"], *boxes["gallery"], *first, *boxes["run"]]
    assert boxes["realization"]
    assert boxes["e_type"]
    assert len(boxes["gallery"]) == len(boxes["run"]) == 1
    for left, top, right, bottom in parts:
        assert left >= 0
        assert top >= 0
        assert right <= width + 1
        assert bottom <= height + 1
        assert right > left
        assert bottom > top
    for below_map, _ in zip(boxes["legends"], range(2), strict=True):  # nothing covers a legend
        assert below_map[3] <= boxes["gallery"][0][1] or below_map[2] <= boxes["gallery"][0][0]
    assert min(boxes["letters"]) >= 11
    for left, top, right, bottom in [*boxes["realization"], *boxes["e_type"]] if square else ():
        assert right - left >= 250
        assert bottom - top >= 250
    for left, top, right, bottom in charts:  # no chart is too small to be read
        assert right - left >= 180
        assert bottom - top >= 95


@pytest.mark.parametrize("name", STUDIES)
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_maps_and_charts_fit_into_the_window(tab, address, name, scheme):
    tab.emulate_media(color_scheme=scheme)
    opened(tab, address, STUDIES[name])
    for width, height in SIZES:
        tab.set_viewport_size({"width": width, "height": height})
        square = name not in {"wide", "tall", "volume"}
        soon(lambda w=width, h=height, s=square: check_visible(tab, w, h, square=s))


def test_the_first_screen_of_a_new_user_fits_too(chromium, address):
    context = chromium.new_context(viewport={"width": 1440, "height": 900})
    tab = context.new_page()
    tab.goto(address)
    tab.wait_for_selector(".st-key-welcome", timeout=SLOW)
    tab.wait_for_selector(".st-key-chart_times .main-svg", timeout=SLOW)
    at_rest(tab)
    for width, height in SIZES:
        tab.set_viewport_size({"width": width, "height": height})
        soon(lambda w=width, h=height: check_visible(tab, w, h, square=True))
    context.close()


def test_the_realization_is_the_largest_map(tab, address):
    for choices in (STUDIES["square"], replace(SMALL, grid=Grid(60, 160))):
        opened(tab, address, choices)
        areas = """() => ['image', 'realization'].map((name) => {
          const { shadowRoot } = [...document.querySelectorAll(`.st-key-map_${name} *`)]
            .find((e) => e.shadowRoot);
          const box = shadowRoot.querySelector('canvas').getBoundingClientRect();
          return box.width * box.height; })"""

        def larger(areas=areas) -> None:
            image, realization = tab.evaluate(areas)
            assert realization > image

        soon(larger)


def test_nothing_moves_in_a_run_or_when_results_are_out_of_date(tab, address):
    opened(tab, address, replace(SMALL, grid=Grid(256, 256)))
    tab.evaluate(TOPS)
    fill(tab, "n_realizations", 60)
    run(tab)
    tab.locator(".panel", has_text="of 60").first.wait_for(timeout=SLOW)
    at_rest(tab)
    assert len(tab.evaluate("[...window.tops]")) == 1


def test_on_a_phone_charts_have_the_whole_width_below_the_maps(tab, address):
    tab.set_viewport_size({"width": 390, "height": 844})
    for name in ("square", "volume"):
        opened(tab, address, STUDIES[name])

        def in_one_column() -> None:
            boxes = tab.evaluate(BOXES)
            charts = boxes["charts"]
            assert len(charts) == 4
            assert all(left >= 0 and right <= 390 for left, _, right, _ in charts)
            assert all(right - left > 340 for left, _, right, _ in charts)
            bottoms = [[box[3] for box in boxes[part]] for part in ("realization", "e_type")]
            order = [max(bottoms[0]), max(bottoms[1]), boxes["gallery"][0][3]]
            order += [bottom for *_, bottom in charts]
            assert order == sorted(order)

        soon(in_one_column)


WRITTEN = """() => {
  window.written = [];
  const plain = CanvasRenderingContext2D.prototype.fillText;
  CanvasRenderingContext2D.prototype.fillText = function (text, ...place) {
    if (this.canvas.closest?.('.map')) window.written.push(text);
    return plain.call(this, text, ...place);
  };
}"""


@pytest.mark.parametrize(("name", "bar"), [("square", "cells"), ("world", "")])
def test_a_map_fills_the_screen_on_a_click_with_a_scale_bar(tab, address, name, bar):
    tab.add_init_script(f"({WRITTEN})()")
    opened(tab, address, STUDIES[name])
    canvas = tab.locator(".st-key-map_realization canvas")
    before = canvas.bounding_box()
    numbers = set(tab.evaluate("window.written"))
    tab.locator(".st-key-map_realization [data-do=full]").click()

    def whole_screen() -> None:
        now = canvas.bounding_box()
        assert now["height"] > 1.5 * before["height"]
        assert now["height"] < 900
        lengths = {"1", "2", "5"}
        bars = [text for text in tab.evaluate("window.written") if text.strip("0 cels") in lengths]
        assert any(text.endswith(bar) for text in bars if text not in numbers)

    soon(whole_screen)
    tab.evaluate("document.exitFullscreen()")

    def as_before() -> None:
        assert canvas.bounding_box() == before

    soon(as_before)


def test_the_read_out_has_world_coordinates_row_and_column(tab, address):
    opened(tab, address, STUDIES["world"])
    for part in ("realization", "e_type"):
        canvas = tab.locator(f".st-key-map_{part} canvas")
        box = canvas.bounding_box()
        text = tab.locator(f".st-key-map_{part} .readout")

        def read_out(canvas=canvas, box=box, text=text) -> None:
            canvas.hover(position={"x": box["width"] - 4, "y": 4})  # the north-east cell
            assert "(438387.5, 4507387.5) row 95, column 95" in text.inner_text()

        soon(read_out)


def test_borders_of_active_cells_are_drawn_on_all_maps_of_results(tab, address):
    outline = ((20.0, 20.0), (70.0, 20.0), (70.0, 70.0), (20.0, 70.0))
    choices = replace(SMALL, grid=Grid(96, 96), guides=GuideChoice(active=outline))
    lines = """() => {
      window.lines = new Map();
      const plain = CanvasRenderingContext2D.prototype.lineTo;
      CanvasRenderingContext2D.prototype.lineTo = function (...place) {
        const key = this.canvas.getRootNode().host?.closest('[class*=st-key-map_]')?.className;
        if (key) window.lines.set(key, (window.lines.get(key) ?? 0) + 1);
        return plain.call(this, ...place);
      };
    }"""
    tab.add_init_script(f"({lines})()")
    opened(tab, address, choices)
    drawn = dict(tab.evaluate("[...window.lines]"))
    for part in ("realization", "e_type"):
        (n,) = (n for key, n in drawn.items() if f"st-key-map_{part}" in key)
        assert n >= 8  # each of four sides is drawn with a halo


def test_the_address_of_the_server_alone_keeps_the_study_of_a_link(tab, address):
    tab.goto(f"{address}/?{urlencode(link_of(STUDIES['square']), doseq=True)}")
    tab.wait_for_selector(".st-key-chart_times .main-svg", timeout=SLOW)

    def as_linked() -> None:
        assert tab.locator(".st-key-grid_nx input").input_value() == "96"
        assert "grid=96x96" in tab.url

    soon(as_linked)
