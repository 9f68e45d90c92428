"""Test that guides drawn or chosen in a browser guide the realizations at once."""

from __future__ import annotations

import json
import re
from typing import Any
from urllib.parse import parse_qs, urlsplit

import pytest

from tests.browser.hands import (
    GLANCE,
    SLOW,
    SOON,
    at_rest,
    choose,
    fill,
    follow,
    settled,
    soon,
    to_page,
    until,
)
from tests.browser.pictures import guides
from tests.browser.served import CHROMIUM
from tests.browser.test_validate import show

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no {CHROMIUM}"),
]

STUDY = "data=none&grid=128x128&realizations=12"
GRADIENT = guides(probabilities={"start": 0.05, "end": 0.6})
"""Guides in an address: the probability grows from west to east."""


def in_address(page: Any) -> dict[str, Any]:
    """Return the guides in the address of a page."""
    (text,) = parse_qs(urlsplit(page.url).query).get("guides", ["{}"])
    return json.loads(text)


@pytest.fixture
def page(tab, address):
    tab.goto(f"{address}/guides?{STUDY}")
    current(tab)
    return tab


def current(page: Any) -> None:
    """Wait until the results belong to the study."""
    page.wait_for_selector("i.results-current", state="attached", timeout=SLOW)
    at_rest(page)


def to_task(page: Any, title: str) -> None:
    """Choose a task of the page Guides."""
    from playwright.sync_api import expect

    button = page.locator(".st-key-guides_task").get_by_role("radio", name=title).first
    at_rest(page)
    until(
        lambda: button.click(timeout=SOON),
        lambda wait: expect(button).to_have_attribute("aria-checked", "true", timeout=wait),
    )
    at_rest(page)


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
def test_three_maps_are_beside_each_other_and_proportions_fit(tab, address, width):
    tab.set_viewport_size({"width": width, "height": 900})
    tab.goto(f"{address}/simulate?data=none&realizations=2&{GRADIENT}")
    current(tab)
    maps = [f".st-key-map_{name} canvas" for name in ("realization", "e_type", "given")]

    def beside_each_other() -> None:
        boxes = [tab.locator(canvas).bounding_box() for canvas in maps]
        assert len({round(box["y"]) for box in boxes}) == 1
        assert all(box["width"] >= 250 for box in boxes)
        chart = tab.locator(".st-key-chart_proportions svg").first.bounding_box()
        frame = tab.locator(".st-key-panel_proportions").bounding_box()
        assert 0 < chart["width"] <= frame["width"]

    soon(beside_each_other)


def test_a_brush_draws_probabilities_that_realizations_follow(page):
    to_task(page, "What is likely where")
    choose(page, "guides_probabilities", "drawn on the map")
    drag(page, (0.25, 0.2), (0.25, 0.5), (0.25, 0.8))
    (stroke,) = in_address(page)["probabilities"]
    assert stroke["value"] == 0.8
    assert page.get_by_text("Given probability of sand").count() == 1
    drawn = read(page, "guide_board", 0.25, 0.5)
    assert "P(sand) = 0.8" in drawn
    along = [probability(page, 0.25, y) for y in (0.3, 0.4, 0.5, 0.6, 0.7)]
    away = [probability(page, 0.75, y) for y in (0.3, 0.4, 0.5, 0.6, 0.7)]
    assert sum(along) > sum(away) + 1
    board = page.locator(".st-key-guide_board")
    drawn_address = page.url
    board.locator("[data-step=undo]").click(timeout=SLOW)
    changed(page, drawn_address)
    assert not in_address(page)["probabilities"]
    board.locator("[data-step=redo]").click(timeout=SLOW)
    page.wait_for_url(drawn_address, timeout=SLOW)
    current(page)
    to_page(page, "Validate")
    show(page, "Uncertainty")
    page.get_by_text("share of sand given and simulated").first.wait_for(timeout=SLOW)


def test_an_outline_makes_cells_inactive(page):
    to_task(page, "Where is the model")
    choose(page, "guides_active", "inside an outline")
    frame = settled(page, lambda: in_address(page).get("active") and page.url)
    drag(page, (0.9, 0.9), (0.97, 0.8))  # a corner
    corners = in_address(page)["active"]
    assert len(corners) == 4
    assert corners[2] == [pytest.approx(0.97 * 128, abs=3), pytest.approx(0.8 * 128, abs=3)]
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
    tab.goto(f"{address}/guides?ti=delta&data=none&grid=128x128&realizations=8")
    current(tab)
    to_task(tab, "What is likely where")
    choose(tab, "guides_auxiliary", "position along a direction")
    fill(tab, "guides_auxiliary_image", 90)
    fill(tab, "guides_auxiliary_grid", 0)

    def turned() -> None:
        assert in_address(tab)["auxiliary"] == {"image": 90.0}

    soon(turned, SLOW)
    current(tab)
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

    to_task(page, "A second image")
    box = page.locator(".st-key-guides_other input").first
    wall = page.get_by_role("option", name="stone wall", exact=True)

    def add() -> None:
        if "images" not in in_address(page):
            box.click(timeout=GLANCE)
            wall.click(timeout=GLANCE)

    at_rest(page)
    until(add, lambda wait: page.wait_for_url("**stone_wall**", timeout=wait))
    to_task(page, "Different areas")
    choose(page, "guides_zones", "inside outlines")
    page.wait_for_url("**zones**", timeout=SLOW)
    current(page)
    tool(page, "zone1")
    drag(page, (0.05, 0.55), (0.95, 0.55), (0.95, 0.97), (0.05, 0.97))  # a new outline in the north
    assert "stone wall" in read(page, "guide_board", 0.5, 0.8)
    assert "channels" in read(page, "guide_board", 0.5, 0.3)
    to_task(page, "Which way do bodies run")
    choose(page, "guides_angle", "along drawn lines")
    page.wait_for_url("**angle**", timeout=SLOW)
    tool(page, "line")
    drag(page, (0.1, 0.1), (0.3, 0.15), (0.6, 0.4))
    guides_drawn = in_address(page)
    assert 80 < guides_drawn["flow_azimuth"] < 100  # at first, the direction of the channels
    assert len(guides_drawn["angle"][-1]) >= 2
    assert page.get_by_text(re.compile("Arrows show where azimuth")).count() == 1
    to_page(page, "Validate")
    row = page.locator(".st-key-section_uncertainty table tr", has_text="1 stone wall")
    show(page, "Uncertainty")
    row.wait_for(timeout=SLOW)
    assert "channels" in row.inner_text()
    expect(page.get_by_text("Difference from the given angles")).to_have_count(1, timeout=SLOW)


def test_guides_are_drawn_on_a_phone(phone, address):
    outline = guides(active=[[20, 20], [100, 20], [100, 100], [20, 100]])
    phone.goto(f"{address}/guides?{STUDY}&{outline}")
    phone.wait_for_selector(".st-key-results canvas", timeout=SLOW)
    board = phone.locator(".st-key-guide_board canvas")

    def inside() -> None:
        box = board.bounding_box()
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= 390

    soon(inside)
    tool(phone, "outline")


@pytest.mark.parametrize("height", [700, 1000])
def test_the_map_is_as_high_as_the_window_allows(tab, address, height):
    tab.set_viewport_size({"width": 1440, "height": height})
    tab.goto(f"{address}/guides?{STUDY}")
    current(tab)
    board = tab.locator(".st-key-guide_board canvas")
    box = settled(tab, board.bounding_box, pause=200)
    assert 0.6 * height < box["height"]
    assert box["y"] + box["height"] < height


def test_the_study_column_names_the_guides_and_opens_their_page(tab, address):
    tab.goto(f"{address}/simulate?{STUDY}&{GRADIENT}")
    current(tab)
    line = tab.locator(".st-key-guides").first
    assert "probabilities with weight 1" in line.inner_text()
    assert line.bounding_box()["height"] < 64
    follow(tab, line.get_by_role("link", name="Guides"), "guides")
    current(tab)
    assert in_address(tab)["probabilities"] == {"start": 0.05, "end": 0.6}
    tab.locator(".st-key-guides_none button").click(timeout=SLOW)
    tab.wait_for_url(lambda url: "guides=" not in url, timeout=SLOW)
