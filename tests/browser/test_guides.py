"""Test that guides drawn or chosen in a browser guide the realizations at once."""

from __future__ import annotations

import re
from typing import Any

import pytest

from tests.browser.hands import (
    GLANCE,
    SLOW,
    SOON,
    at_rest,
    choose,
    fill,
    run,
    settled,
    soon,
    to_page,
    until,
)
from tests.browser.served import CHROMIUM

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no {CHROMIUM}"),
]

STUDY = "data=none&grid=128x128&realizations=12"


@pytest.fixture
def page(tab, address):
    tab.goto(f"{address}/simulate?{STUDY}")
    current(tab)
    return tab


def current(page: Any) -> None:
    """Wait until the results belong to the study."""
    page.wait_for_selector("i.results-current", state="attached", timeout=SLOW)
    at_rest(page)


def unfold(page: Any) -> None:
    """Open the frame of the guides."""
    box = page.locator(".st-key-guides_probabilities").first
    until(
        lambda: (
            None if box.is_visible() else page.locator(".st-key-guides summary").click(timeout=SOON)
        ),
        lambda wait: box.wait_for(timeout=wait),
    )


def spot(page: Any, key: str, x: float, y: float, left: int = 1, bottom: int = 1) -> Any:
    """Return the pixels of a position on a map, given by shares from the south-west corner."""
    canvas = page.locator(f".st-key-{key} canvas").first
    canvas.scroll_into_view_if_needed(timeout=SLOW)
    box = settled(page, canvas.bounding_box, pause=200)
    wide, high = box["width"] - left - 1, box["height"] - 1 - bottom
    return box["x"] + left + x * wide, box["y"] + 1 + (1 - y) * high


def drag(page: Any, *shares: tuple[float, float]) -> None:
    """Draw on the map of the guides, and wait for the run."""
    old, spots = page.url, [spot(page, "guide_board", *share) for share in shares]
    page.mouse.move(*spots[0])
    page.mouse.down()
    for place in spots[1:]:
        page.mouse.move(*place, steps=5)
    page.mouse.up()
    changed(page, old)
    current(page)


def changed(page: Any, old: str) -> None:
    """Wait until the address differs from an old one."""
    page.wait_for_url(lambda url: url != old, timeout=SLOW)


def read(page: Any, key: str, x: float, y: float, **edges: int) -> str:
    """Return the label of a map for the cell at a position."""
    page.mouse.move(*spot(page, key, x, y, **edges))
    return settled(page, page.locator(f".st-key-{key} .readout").first.inner_text, pause=200)


def tool(page: Any, name: str) -> None:
    from playwright.sync_api import expect

    button = page.locator(f".st-key-guide_board [data-tool={name}]")
    until(
        lambda: button.click(timeout=SOON),
        lambda wait: expect(button).to_have_attribute("aria-checked", "true", timeout=wait),
    )


def probability(page: Any, x: float, y: float) -> float:
    return float(read(page, "map_e_type", x, y).split("=")[1])


@pytest.mark.parametrize("width", [1280, 1440])
def test_the_chart_of_proportions_fits_beside_four_maps(tab, address, width):
    tab.set_viewport_size({"width": width, "height": 900})
    tab.goto(f"{address}/simulate?data=none&realizations=2&guides=gradient_90_0.05_0.6")
    current(tab)
    tab.wait_for_function(
        """() => {
          const chart = document.querySelector('.st-key-chart_proportions .js-plotly-plot');
          const [frame, drawn] = [chart, chart?.querySelector('svg')].map((e) => e?.clientWidth);
          return drawn && drawn <= frame;
        }""",
        timeout=SLOW,
    )
    columns = [each.bounding_box() for each in tab.locator(".st-key-maps .stColumn").all()]
    assert len(columns) == 4
    assert len({column["y"] for column in columns}) == 1  # beside each other


def test_a_brush_draws_probabilities_that_realizations_follow(page):
    unfold(page)
    choose(page, "guides_probabilities", "drawn on the map")
    drag(page, (0.25, 0.2), (0.25, 0.5), (0.25, 0.8))
    assert "guides=stroke_0.8_" in page.url
    assert page.get_by_text("Given probability of sand").count() == 1
    drawn = read(page, "map_given", 0.25, 0.5)
    assert "given P(sand) = 0.8" in drawn
    along = [probability(page, 0.25, y) for y in (0.3, 0.4, 0.5, 0.6, 0.7)]
    away = [probability(page, 0.75, y) for y in (0.3, 0.4, 0.5, 0.6, 0.7)]
    assert sum(along) > sum(away) + 1
    board = page.locator(".st-key-guide_board")
    stroke = page.url
    board.locator("[data-step=undo]").click(timeout=SLOW)
    changed(page, stroke)
    assert "stroke_0.8" not in page.url
    board.locator("[data-step=redo]").click(timeout=SLOW)
    page.wait_for_url(stroke, timeout=SLOW)
    current(page)
    to_page(page, "Validate")
    page.get_by_text("share of sand given and simulated").first.wait_for(timeout=SLOW)


def test_an_outline_makes_cells_inactive(page):
    unfold(page)
    choose(page, "guides_active", "inside an outline")
    frame = settled(page, lambda: re.search("polygon[_0-9.]*", page.url) and page.url)
    drag(page, (0.9, 0.9), (0.97, 0.8))  # a corner
    corners = [float(k) for k in page.url.split("polygon_")[1].split("&")[0].split("_")]
    assert len(corners) == 8
    assert corners[4:6] == [pytest.approx(0.97 * 128, abs=3), pytest.approx(0.8 * 128, abs=3)]
    assert page.url != frame
    drag(page, (0.3, 0.3), (0.7, 0.3), (0.7, 0.7), (0.3, 0.7))  # a new outline
    assert "inactive" in read(page, "map_realization", 0.1, 0.1, left=40, bottom=20)
    assert re.search("mud|sand", read(page, "map_realization", 0.5, 0.5, left=40, bottom=20))
    assert "inactive" in read(page, "map_e_type", 0.9, 0.5)
    canvas = page.locator(".st-key-guide_board canvas")
    canvas.focus()
    old = page.url
    page.keyboard.press("ArrowLeft")
    page.keyboard.press("Enter")  # moves the nearest corner
    changed(page, old)


def test_a_direction_turns_the_trend_of_an_image(tab, address):
    tab.goto(f"{address}/simulate?ti=delta&data=none&grid=128x128&realizations=8")
    current(tab)
    unfold(tab)
    choose(tab, "guides_auxiliary", "position along a direction")
    fill(tab, "guides_auxiliary_image", 90)
    fill(tab, "guides_auxiliary_grid", 0)
    run(tab)
    assert "guides=along_90.0_0.0" in tab.url
    assert "variable" in read(tab, "guide_board", 0.5, 0.9)
    south, north = (read(tab, "guide_board", 0.5, y).split(":")[1] for y in (0.1, 0.9))
    assert float(south) < 0.2
    assert float(north) > 0.8
    choose(tab, "e_type", "probability of mouth bar")
    ys = (0.02, 0.1, 0.2, 0.8, 0.9, 0.98)
    bars = [max(probability(tab, x, y) for x in (0.2, 0.4, 0.6, 0.8)) for y in ys]
    assert max(bars[3:]) > max(bars[:3])


def test_a_second_image_fills_a_drawn_zone_along_a_drawn_line(page):
    from playwright.sync_api import expect

    unfold(page)
    box = page.locator(".st-key-guides_other input").first
    wall = page.get_by_role("option", name="stone wall", exact=True)

    def add() -> None:
        if "image_" not in page.url:
            box.click(timeout=GLANCE)
            wall.click(timeout=GLANCE)

    at_rest(page)
    until(add, lambda wait: page.wait_for_url("**image_stone_wall**", timeout=wait))
    choose(page, "guides_zones", "inside outlines")
    page.wait_for_url("**zone_**", timeout=SLOW)
    current(page)
    tool(page, "zone1")
    drag(page, (0.05, 0.55), (0.95, 0.55), (0.95, 0.97), (0.05, 0.97))  # a new outline in the north
    assert "stone wall" in read(page, "guide_board", 0.5, 0.8)
    assert "channels" in read(page, "guide_board", 0.5, 0.3)
    choose(page, "guides_angle", "along drawn lines")
    page.wait_for_url("**line_**", timeout=SLOW)
    tool(page, "line")
    drag(page, (0.1, 0.1), (0.3, 0.15), (0.6, 0.4))
    azimuth = page.url.split("flow_")[1].split("~")[0]
    line = page.url.split("line_")[1].split("~")[0].split("_")
    assert 80 < float(azimuth) < 100  # at first, the direction of the channels
    assert len(line) >= 4
    assert page.get_by_text(re.compile("Arrows show where azimuth")).count() == 1
    to_page(page, "Validate")
    row = page.locator(".st-key-section_uncertainty table tr", has_text="1 stone wall")
    page.locator("#uncertainty").scroll_into_view_if_needed(timeout=SLOW)
    row.wait_for(timeout=SLOW)
    assert "channels" in row.inner_text()
    expect(page.get_by_text("Difference from the given angles")).to_have_count(1, timeout=SLOW)


def test_guides_are_drawn_on_a_phone(phone, address):
    phone.goto(f"{address}/simulate?{STUDY}&guides=polygon_20_20_100_20_100_100_20_100")
    phone.wait_for_selector(".st-key-results canvas", timeout=SLOW)
    opener = phone.locator("[data-testid=stExpandSidebarButton]").first
    board = phone.locator(".st-key-guide_board canvas")

    def inside() -> None:
        box = board.bounding_box()
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= 390

    until(
        lambda: opener.click(timeout=SOON) if opener.is_visible() else None,
        lambda wait: soon(inside, wait),
    )
    tool(phone, "outline")
