"""Test the layout of pages: nothing is cut off or covered, and related elements share a line.

Boxes are measured as the browser draws them.
"""

from __future__ import annotations

from dataclasses import replace
from urllib.parse import urlencode

import numpy as np
import pytest

from ccwsim import Grid, HardData, Parameters
from ccwsim.sharing.choices import Choices, DataChoice
from ccwsim.sharing.link import link_of
from tests.browser.hands import GLANCE, SLOW, SOON, at_rest, fill, run, soon, until
from tests.browser.served import CHROMIUM

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no {CHROMIUM}"),
]

SMALL = Choices(
    data=DataChoice(),
    grid=Grid(96, 96),
    parameters=Parameters(template_size=16, overlap_size=4),
    n_realizations=3,
)
NARROW = {"width": 1024, "height": 768}
BOX = """(e) => { const { x, y, width, height, right, bottom } = e.getBoundingClientRect();
  return { x, y, width, height, right, bottom }; }"""
DEEP = """const deep = (selector, root = document) =>
  [...root.querySelectorAll('*')].flatMap((e) => [...(e.matches(selector) ? [e] : []),
    ...(e.shadowRoot ? deep(selector, e.shadowRoot) : [])]);"""
COVERED = (
    """() => { """
    + DEEP
    + """
  const over = (a, b) => a.x < b.right && b.x < a.right && a.y < b.bottom && b.y < a.bottom;
  const shown = (e) => e.getClientRects().length && getComputedStyle(e).visibility !== 'hidden';
  const box = (e) => e.getBoundingClientRect();
  const tools = deep('.tools').filter(shown);
  const bars = deep('.modebar').filter(shown);
  return { tools: tools.length, covered: [
    ...tools.filter((t) => deep('canvas').some((c) => over(box(t), box(c)))),
    ...bars.filter((b) => over(box(b), box(b.closest('.js-plotly-plot')))),
  ].map((e) => e.className) }; }"""
)
CUT = """() => [...document.querySelectorAll('.js-plotly-plot, .chart')].flatMap((chart) => {
  const room = chart.closest('.stColumn, [class*=st-key-panel_]').getBoundingClientRect();
  const own = chart.querySelector('.main-svg').getBoundingClientRect();
  const marks = [...chart.querySelectorAll('.xtick text, .ytick text, .xtitle, .points path')];
  const out = marks.filter((mark) => {
    const box = mark.getBoundingClientRect();
    return box.width && (box.right > own.right + 1 || box.left < own.left - 1);
  });
  const cut = own.right > room.right + 1 || out.length;
  return cut ? [chart.closest('[class*=st-key-chart_]').className] : [];
})"""
WRITTEN = """() => {
  window.written = [];
  const plain = CanvasRenderingContext2D.prototype.fillText;
  CanvasRenderingContext2D.prototype.fillText = function (text, x, y) {
    const { width } = this.measureText(text);
    const left = { right: x - width, center: x - width / 2 }[this.textAlign] ?? x;
    const map = this.canvas.closest?.('.map');
    if (map) window.written.push({ text, left, right: left + width, wide: this.canvas.clientWidth,
      axis: this.textAlign === 'right' ? 'y' : 'x' });
    return plain.call(this, text, x, y);
  };
}"""
DISCS = """() => {
  window.discs = [];
  const plain = CanvasRenderingContext2D.prototype.arc;
  CanvasRenderingContext2D.prototype.arc = function (x, y, radius, ...more) {
    window.discs.push({ x, y, radius, colour: this.fillStyle });
    return plain.call(this, x, y, radius, ...more);
  };
}"""
DIMMEST = """() => {
  window.dimmest = 1;
  const look = () => {
    for (const e of document.querySelectorAll('.stSidebar [data-testid=stElementContainer]')) {
      const fades = e.getAnimations().some((one) => one.transitionProperty === 'opacity');
      window.dimmest = Math.min(window.dimmest, getComputedStyle(e).opacity, fades ? 0 : 1);
    }
    requestAnimationFrame(look);
  };
  look();
}"""
SHIMMERING = """() => document.getAnimations().filter((one) => one.animationName)
  .filter((one) => one.effect.target.matches('[data-testid=stSkeleton]')).length"""
HEIGHTS = """() => {
  window.heights = {};
  const look = () => requestAnimationFrame(() => setTimeout(() => {
    for (const e of document.querySelectorAll('[class*=st-key-section_]')) {
      const name = [...e.classList].find((c) => c.startsWith('st-key-section_'));
      (window.heights[name] ??= []).push(e.getBoundingClientRect().height);
    }
    look();
  }));
  look();
}"""


def opened(page, address: str, path: str, choices: Choices = SMALL) -> None:
    """Open a page with the maps of a study, and wait until the page is at rest."""
    page.goto(f"{address}/{path}?{urlencode(link_of(choices), doseq=True)}")
    page.wait_for_selector(".st-key-map_e_type canvas", timeout=SLOW)
    page.wait_for_function(
        "() => !document.querySelector('.st-key-progress, .ghost')", timeout=SLOW
    )
    at_rest(page)


def box(page, selector: str) -> dict[str, float]:
    found = page.locator(selector).locator("visible=true").first
    found.wait_for(timeout=SLOW)
    return found.evaluate(BOX)


def test_at_1024_pixels_no_page_leaves_the_menu_and_no_chart_is_cut(tab, address):
    tab.set_viewport_size(NARROW)
    opened(tab, address, "simulate")
    tab.wait_for_selector(".st-key-chart_times .xtick text", timeout=SLOW)

    def no_page_is_left_out() -> None:
        share = box(tab, ".st-key-share")
        links = tab.locator(".st-key-menu").locator("a, button").locator("visible=true").all()
        assert links
        for link in links:
            at = link.evaluate(BOX)
            assert at["right"] <= share["x"] or at["y"] >= share["bottom"]
            middle = [at["x"] + at["width"] / 2, at["y"] + at["height"] / 2]
            on_top = "([x, y]) => document.elementFromPoint(x, y)?.closest('a, button')?.innerText"
            assert tab.evaluate(on_top, middle) == link.inner_text()

    soon(no_page_is_left_out)
    tab.wait_for_function(f"() => ({CUT})().length === 0", timeout=SOON)
    titles = "[...document.querySelectorAll('.panel')]"
    fit = f"() => {titles}.every((e) => e.scrollWidth <= e.clientWidth + 1)"
    tab.wait_for_function(fit, timeout=SOON)


def test_at_1024_pixels_the_table_of_data_has_its_column_of_facies(tab, address):
    tab.set_viewport_size(NARROW)
    placed = DataChoice("placed", placed=HardData([[3, 4], [60, 70]], [1, 0]))
    opened(tab, address, "data", replace(SMALL, data=placed))
    tab.wait_for_selector("[data-testid=stDataFrame] canvas", timeout=SLOW)
    table = "document.querySelector('.dvn-scroller')"
    fits = f"() => {table}.scrollWidth <= {table}.clientWidth + 1"
    tab.wait_for_function(fits, timeout=SOON)


@pytest.mark.parametrize("path", ["simulate", "data"])
def test_coordinates_are_written_whole(tab, address, path):
    tab.add_init_script(f"({WRITTEN})()")
    grid = Grid(96, 96, cell_size=(25.0, 25.0), origin=(436000.0, 4505000.0))
    opened(tab, address, path, replace(SMALL, grid=grid))

    def whole() -> None:
        numbers = tab.evaluate("window.written")
        north = {one["text"] for one in numbers if one["axis"] == "y"}
        assert {"4505000", "4506000", "4507000"} <= north
        assert all(one["left"] >= 0 and one["right"] <= one["wide"] + 0.5 for one in numbers)

    soon(whole)


@pytest.mark.parametrize("path", ["simulate", "validate", "data"])
def test_two_maps_have_one_top_and_one_size_and_no_tool_covers_them(tab, address, path):
    opened(tab, address, path)
    left = ".st-key-editor canvas" if path == "data" else ".st-key-map_realization canvas"
    below, beside = (0, 0) if path == "validate" else (19, 39)  # space for coordinates

    def alike() -> None:
        first, second = box(tab, left), box(tab, ".st-key-map_e_type canvas")
        assert first["y"] == pytest.approx(second["y"], abs=0.6)
        assert first["height"] - below == pytest.approx(second["height"], abs=1)
        assert first["width"] - beside == pytest.approx(second["width"], abs=1)

    def cover_nothing() -> None:
        tab.locator(".st-key-map_e_type canvas").hover()
        found = tab.evaluate(COVERED)
        assert found["tools"] >= 2
        assert found["covered"] == []

    def end_together() -> None:
        first, second = box(tab, left), box(tab, ".st-key-map_e_type canvas")
        assert second["y"] > first["bottom"]
        assert second["right"] == pytest.approx(first["right"], abs=1)

    soon(alike)
    soon(cover_nothing)
    tab.set_viewport_size(NARROW)
    soon(alike)
    tab.set_viewport_size({"width": 390, "height": 844})
    soon(end_together)


@pytest.mark.parametrize("path", ["simulate", "validate", "data"])
def test_maps_of_a_wide_grid_are_below_each_other(tab, address, path):
    opened(tab, address, path, replace(SMALL, grid=Grid(100, 300)))
    left = ".st-key-editor canvas" if path == "data" else ".st-key-map_realization canvas"

    def below() -> None:
        first, second = box(tab, left), box(tab, ".st-key-map_e_type canvas")
        page = box(tab, ".st-key-results" if path == "simulate" else ".st-key-maps")
        share = 0.45 if path == "simulate" else 0.6  # its charts are at the right
        assert first["width"] > share * page["width"]
        assert second["y"] > first["bottom"]
        assert second["width"] == pytest.approx(first["width"], rel=0.08)

    soon(below)


def test_nothing_scrolls_through_the_logo(tab, address):
    opened(tab, address, "validate")

    def at_the_top() -> None:
        for part in ("[data-testid=stHeaderLogo]", ".st-key-menu"):
            assert box(tab, part)["y"] < 40

    soon(at_the_top)
    tab.evaluate("document.querySelector('[data-testid=stMain]').scrollTop = 700")
    # the element beside the logo belongs to the menu, not to a chart below the menu
    under = "() => [4, 300, 700].map((x) => document.elementFromPoint(x, 46)"
    under += ".closest('.st-key-maps, .st-key-charts, [class*=st-key-section_]') === null)"
    tab.wait_for_function(f"() => ({under})().every(Boolean)", timeout=SOON)
    soon(at_the_top)


@pytest.mark.parametrize("path", ["benchmark", "paper"])
def test_controls_and_their_labels_are_on_two_lines(tab, address, path):
    tab.goto(f"{address}/{path}")
    tab.wait_for_selector("[class*=st-key-controls_] button", timeout=SLOW)
    at_rest(tab)
    middles = """() => [...document.querySelectorAll('[class*=st-key-controls_]')].map((row) => {
      const box = (e) => e.getBoundingClientRect();
      const middle = (e) => Math.round(box(e).y + box(e).height / 2);
      const all = (what) => [...new Set([...row.querySelectorAll(what)].map(middle))].sort();
      return [all('[data-testid=stWidgetLabel] p'), all('.stNumberInput > div, .stSelectbox > div,'
        + '[role=toolbar], [role=radiogroup], [data-testid=stBaseButton-primary]')]; })"""

    def on_two_lines() -> None:
        rows = tab.evaluate(middles)
        assert rows
        for labels, controls in rows:
            assert labels
            assert controls
            assert max(labels) - min(labels) <= 1
            assert max(controls) - min(controls) <= 1

    soon(on_two_lines)


def test_marks_of_a_line_of_data_leave_each_other_room(tab, address):
    columns = np.arange(20, 180)
    line = HardData(np.column_stack([np.full(160, 90), columns]), columns // 40 % 2)
    study = replace(SMALL, data=DataChoice("placed", placed=line), grid=Grid(200, 200))
    tab.add_init_script(f"({DISCS})()")
    opened(tab, address, "data", study)

    def have_room() -> None:
        discs = tab.evaluate("window.discs")[-3 * line.n :]
        assert len(discs) == 3 * line.n
        outlines, fills = discs[: line.n], discs[-line.n :]
        step = abs(fills[1]["x"] - fills[0]["x"])
        assert {one["colour"] for one in outlines} == {"#14181d"}  # below all that is filled
        assert "#14181d" not in {one["colour"] for one in fills}
        assert max(one["radius"] for one in outlines) <= max(step, 2.2) + 1e-6

    soon(have_room)


def test_the_study_is_not_dimmed_while_it_runs(tab, address):
    opened(tab, address, "simulate")
    fill(tab, "n_realizations", 40)
    fill(tab, "grid_nx", 512)
    fill(tab, "grid_ny", 512)
    tab.evaluate(DIMMEST)
    run(tab)
    tab.locator(".panel", has_text="of 40").first.wait_for(timeout=SLOW)
    at_rest(tab)
    assert tab.evaluate("window.dimmest") == 1


def test_a_project_is_opened_beside_share(tab, address):
    opened(tab, address, "simulate")

    def stand_together() -> None:
        share, beside = box(tab, ".st-key-share button"), box(tab, ".st-key-open button")
        assert share["y"] == pytest.approx(beside["y"], abs=0.6)
        assert share["right"] <= beside["x"] <= share["right"] + 24

    soon(stand_together)
    given = tab.locator(".st-key-share_open input[type=file]")
    until(
        lambda: None if given.count() else tab.locator(".st-key-open button").click(timeout=GLANCE),
        lambda wait: given.wait_for(state="attached", timeout=wait),
    )
    tab.keyboard.press("Escape")


def test_what_is_said_of_the_connection_leaves_the_menu_free(tab, address):
    sockets = []

    def connect(socket) -> None:
        sockets.append(socket)
        socket.connect_to_server()

    tab.route_web_socket("**/_stcore/stream", connect)
    opened(tab, address, "simulate")
    tab.route("**/_stcore/**", lambda route: route.abort())  # the server cannot be reached again
    sockets[0].close(code=1011, reason="lost")

    def below_the_menu() -> None:
        status = box(tab, "[data-testid=stStatusWidget]")
        assert status["y"] > box(tab, ".st-key-share")["bottom"] + 100

    soon(below_the_menu)


def test_no_section_gets_low_while_statistics_come(tab, address):
    study = replace(SMALL, grid=Grid(128, 128), n_realizations=10, seed=31)
    opened(tab, address, "validate", study)
    tab.wait_for_selector(".st-key-section_image", timeout=SLOW)
    tab.evaluate(HEIGHTS)
    for name in tab.locator("h2.fold").evaluate_all("titles => titles.map((title) => title.id)"):
        title = tab.locator(f"h2#{name} a")
        title.click(timeout=SLOW)
        tab.locator(f"h2#{name} a[aria-expanded=true]").wait_for(timeout=SLOW)
    tab.wait_for_function("() => !document.querySelector('.working')", timeout=SLOW)
    at_rest(tab)
    for name, heights in tab.evaluate("window.heights").items():
        assert min(heights) >= min(heights[0], heights[-1]) - 2, (name, sorted(set(heights)))


def test_a_study_column_with_nothing_in_it_takes_no_room(tab, address):
    tab.goto(f"{address}/simulate?{urlencode(link_of(SMALL))}")
    tab.wait_for_selector(".st-key-results .st-key-map_e_type canvas", timeout=SLOW)
    at_rest(tab)
    main = tab.locator(".stMain")

    def room_for_it() -> None:
        assert main.bounding_box()["x"] > 300

    def room_for_nothing() -> None:
        assert main.bounding_box()["x"] == 0
        logo = tab.locator(".stSidebar .stLogo").bounding_box()
        first = tab.locator(".st-key-menu a").first.bounding_box()
        assert logo["x"] + logo["width"] < first["x"]

    soon(room_for_it)
    tab.evaluate(
        "document.querySelector('[data-testid=stSidebarUserContent] .stVerticalBlock')"
        ".replaceChildren()"
    )
    soon(room_for_nothing)


def test_placeholders_of_charts_are_still(tab, address):
    held = []
    tab.route("**/PlotlyChart*", lambda route: held.append(route))
    with tab.expect_request("**/PlotlyChart*", timeout=SLOW):
        tab.goto(f"{address}/validate?{urlencode(link_of(SMALL), doseq=True)}")
    at_rest(tab)
    assert tab.locator("[data-testid=stSkeleton]").count()

    def still() -> None:
        assert not tab.evaluate(SHIMMERING)

    soon(still)  # the style of pages arrives after the first placeholders
    held[0].continue_()
    tab.wait_for_selector(".js-plotly-plot", timeout=SLOW)


def test_no_dot_is_drawn_before_the_first_fact_of_a_line(tab, address):
    opened(tab, address, "validate")
    tab.wait_for_selector(".facts.judged .fact", timeout=SLOW)
    shown = """() => { const row = document.querySelector('.facts.judged').getBoundingClientRect();
      return [...document.querySelectorAll('.facts.judged .fact')].map((fact) => {
        const left = fact.getBoundingClientRect().x + parseFloat(
          getComputedStyle(fact, '::before').left);
        return [fact.getBoundingClientRect().y, left >= row.x]; }); }"""

    def only_between() -> None:
        rows = tab.evaluate(shown)
        lines = sorted({y for y, _ in rows})
        assert len(rows) > len(lines) > 1
        for y in lines:
            first, *others = [dot for at, dot in rows if at == y]
            assert not first
            assert all(others)

    tab.set_viewport_size({"width": 1300, "height": 900})
    soon(only_between, SLOW)  # findings come with the statistics


def test_downloads_end_at_the_right_edge_and_leave_room_for_the_facts(tab, address):
    opened(tab, address, "simulate")

    def beside() -> None:
        row, facts = box(tab, ".st-key-facts_row"), box(tab, ".st-key-facts_row .facts")
        table, button = (
            box(tab, f".st-key-{key} [data-testid=stPopoverButton]")
            for key in ("facts_table", "downloads")
        )
        assert button["right"] == pytest.approx(row["right"], abs=2)
        assert facts["width"] + table["width"] + button["width"] > 0.9 * row["width"]
        assert width < 1440 or facts["height"] <= 32

    for width in (1440, 1024):
        tab.set_viewport_size({"width": width, "height": 900})
        soon(beside)
