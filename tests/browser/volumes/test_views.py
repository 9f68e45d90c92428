"""Test the view of a volume in a browser: the contents of its slices, and user actions on it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from ccwsim import Grid
from ccwsim.ui.frontend.cells import CellMap, number_map, volume_content
from ccwsim.ui.frontend.component import component_parts
from tests.browser.hands import SOON, settled, soon
from tests.browser.served import CHROMIUM
from tests.browser.test_components import BEGIN, CALLS, FRAMES, begin

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no {CHROMIUM}"),
]

NZ, NY, NX = 8, 10, 12
COLOURS = ["#102040", "#f0a010", "#20a060", "#c03020"]
NAMES = ["mud", "silt", "sand", "gravel"]
CELLS = np.random.default_rng(3).integers(0, 4, (NZ, NY, NX)).astype(np.uint8)
VOLUME = CellMap(CELLS, COLOURS, NAMES, "Realization 1", point_colours=COLOURS)
SIZE = {"width": 1000, "height": 1200}

AT = """(n = 0) => {
  const view = document.querySelectorAll('.volume')[n];
  return ['x', 'y', 'z'].map((axis) => +view.querySelector(`[data-panel=${axis}] input`).value);
}"""
# Return the colour in the middle of each cell of a slice without axes, lowest row first.
MIDDLES = """([axis, wide, high]) => {
  const canvas = document.querySelector(`[data-panel=${axis}] canvas`);
  const pen = canvas.getContext('2d');
  const [w, h] = [(canvas.width - 2) / wide, (canvas.height - 2) / high];
  return Array.from({ length: high }, (_, j) => Array.from({ length: wide }, (_, i) => {
    const spot = [1 + (i + 0.5) * w, canvas.height - 1 - (j + 0.5) * h].map(Math.floor);
    const pixel = pen.getImageData(...spot, 1, 1).data;
    return '#' + [...pixel.slice(0, 3)].map((c) => c.toString(16).padStart(2, '0')).join('');
  }));
}"""
# Return the number of pixels of the body with a hue, in any light, without surroundings.
DRAWN = """(colour) => {
  const canvas = document.querySelector('[data-panel=body] canvas');
  const pixels = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
  const own = [1, 3, 5].map((k) => parseInt(colour.slice(k, k + 2), 16));
  let count = 0;
  for (let k = 0; k < pixels.length; k += 4) {
    const light = Math.max(...own.map((c, i) => pixels[k + i] / Math.max(c, 1)));
    const fits = own.every((c, i) => Math.abs(pixels[k + i] - light * c) < 6);
    count += pixels[k + 3] > 250 && light > 0.2 && light <= 1.01 && fits;
  }
  return count;
}"""


def show(tab, cells: CellMap = VOLUME, key: str = "volume", how: str = "no end", **options) -> None:
    """Show a view on an empty page, with the calls that Streamlit may make."""
    tab.set_viewport_size(SIZE)
    begin(tab, "volume", volume_content(cells, key, **options))
    tab.evaluate(CALLS[how])
    drawn(tab)


def add(tab, cells: CellMap = VOLUME, key: str = "other", **options) -> None:
    """Show another view on the same page."""
    html, _, js = component_parts("volume")
    tab.evaluate(BEGIN, [html, js, volume_content(cells, key, **options)])
    tab.evaluate("() => { call(); }")
    drawn(tab)


def drawn(tab) -> None:
    """Wait until all views are drawn."""
    every = "() => [...document.querySelectorAll('.volume')].every((view) => view.dataset.took)"
    tab.wait_for_function(every, timeout=SOON)
    tab.evaluate(FRAMES)


def at(tab, *expected: int, view: int = 0) -> None:
    """Check that the sliders of a view show the position (x, y, z) of the cursor."""

    def there() -> None:
        assert tab.evaluate(AT, view) == list(expected)

    soon(there)


def canvas(tab, axis: str, view: int = 0) -> Any:
    return tab.locator(".volume").nth(view).locator(f"[data-panel={axis}] canvas")


def spot(tab, axis: str, right: int, up: int) -> tuple[float, float]:
    """Return the position on the screen of the middle of a cell."""
    wide, high = {"z": (NX, NY), "y": (NX, NZ), "x": (NY, NZ)}[axis]
    box = canvas(tab, axis).bounding_box()
    w, h = (box["width"] - 2) / wide, (box["height"] - 2) / high
    return box["x"] + 1 + (right + 0.5) * w, box["y"] + box["height"] - 1 - (up + 0.5) * h


def shows(tab, axis: str, cells: np.ndarray, hairs: tuple[int, int]) -> None:
    """Check that a slice has the colours of these cells, lowest row first, beside the hairs."""
    high, wide = cells.shape
    expected = np.array(COLOURS)[cells]
    seen_here = np.ones(cells.shape, bool)
    seen_here[hairs[1]] = seen_here[:, hairs[0]] = False

    def alike() -> None:
        found = np.array(tab.evaluate(MIDDLES, [axis, wide, high]))
        np.testing.assert_array_equal(found[seen_here], expected[seen_here])

    soon(alike)


def holds(condition: Callable[[], object]) -> None:
    """Check that a condition holds, now or in a moment."""

    def is_so() -> None:
        assert condition()

    soon(is_so)


# Record the texts on each canvas in the next drawing, by the axis of the panel.
WRITTEN = """async () => {
  const own = CanvasRenderingContext2D.prototype.fillText, found = {};
  CanvasRenderingContext2D.prototype.fillText = function write(text, ...rest) {
    (found[this.canvas.closest('[data-panel]').dataset.panel] ??= []).push(text);
    return own.call(this, text, ...rest);
  };
  for (let n = 0; n < 2; n++) {
    document.querySelector('[data-do=data]').click();
    await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
  }
  CanvasRenderingContext2D.prototype.fillText = own;
  return found;
}"""


# Record the colours of lines on the body in the next drawing, from the top of a well to its bottom.
STROKED = """async () => {
  const own = CanvasRenderingContext2D.prototype.stroke, found = [];
  CanvasRenderingContext2D.prototype.stroke = function stroke(...rest) {
    const isBody = this.canvas.closest('[data-panel=body]');
    if (isBody && this.lineWidth === 2.5) found.push(this.strokeStyle);
    return own.call(this, ...rest);
  };
  for (let n = 0; n < 2; n++) {
    document.querySelector('[data-do=data]').click();
    await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
  }
  CanvasRenderingContext2D.prototype.stroke = own;
  return found;
}"""


def test_wells_have_the_colours_of_their_data(tab):
    facies = [3, 1, 1, 2, 2, 2, 0, 0]  # from the lowest layer to the highest
    points = [[z, 4, 9 - z, k, 0] for z, k in enumerate(facies)]
    well = tuple((z, 4, 9 - z) for z in range(NZ))
    show(tab, replace(VOLUME, points=points, wells=(("B-2", well),)))
    holds(lambda: tab.evaluate(STROKED) == [COLOURS[k] for k in (0, 2, 1, 3)])
    share = number_map(np.zeros((NZ, NY, NX)), "P =", "E-type", point_colours=COLOURS)
    show(tab, replace(share, points=[[z, 1, 2, 3, 0] for z in range(NZ)]))
    holds(lambda: tab.evaluate(STROKED) == [COLOURS[3]])


def test_a_deviated_well_has_one_name_in_each_view_and_under_the_pointer(tab):
    deviated = [[z, 4, 9 - z] for z in range(NZ)]
    upright = [[z, 1, 2] for z in range(NZ)]
    alone = [[z, 8, 10] for z in range(NZ)]
    points = [[*cell, 1, 0] for cell in (*deviated, *upright, *alone)]
    wells = tuple((name, tuple(map(tuple, w))) for name, w in (("B-2", deviated), ("A-1", upright)))
    show(tab, replace(VOLUME, points=points, wells=wells), cursor=(2, 4, 6))
    at(tab, 6, 4, 2)
    written = tab.evaluate(WRITTEN)
    assert [text for text in written["body"] if "-" in text] == ["B-2", "A-1"]
    assert sorted(text for text in written["z"] if "-" in text) == ["A-1", "B-2"]
    assert [text for text in written["y"] if "-" in text] == ["B-2"]
    assert [text for text in written["x"] if "-" in text] == ["B-2"]  # its datum in this column
    tab.mouse.move(*spot(tab, "y", 9, 0))
    tab.locator(".readout").get_by_text("· B-2").wait_for(timeout=SOON)


def all_slices_show(tab, cells: np.ndarray, x: int, y: int, z: int) -> None:
    shows(tab, "z", cells[z], (x, y))
    shows(tab, "y", cells[:, y], (x, z))
    shows(tab, "x", cells[:, :, x], (y, z))


@pytest.mark.parametrize("how", list(CALLS))
def test_slices_show_each_cell_at_its_place_with_layer_0_at_the_bottom(tab, how):
    show(tab, how=how)
    at(tab, 6, 5, 4)
    all_slices_show(tab, CELLS, 6, 5, 4)
    tab.mouse.click(*spot(tab, "z", 2, 9))
    at(tab, 2, 9, 4)
    all_slices_show(tab, CELLS, 2, 9, 4)


def test_clicks_drags_wheel_keys_and_sliders_move_the_cursor(tab):
    show(tab)
    tab.mouse.click(*spot(tab, "y", 3, 0))  # the lowest row of a section
    at(tab, 3, 5, 0)
    tab.mouse.click(*spot(tab, "x", 8, 7))
    at(tab, 3, 8, 7)
    tab.mouse.move(*spot(tab, "z", 1, 1))
    tab.mouse.down()
    tab.mouse.move(*spot(tab, "z", 10, 6), steps=4)
    tab.mouse.up()
    at(tab, 10, 6, 7)
    tab.mouse.wheel(0, 120)  # the map has the focus
    at(tab, 10, 6, 6)
    canvas(tab, "y").focus()
    tab.keyboard.press("ArrowUp")
    at(tab, 10, 7, 6)
    tab.keyboard.press("ArrowLeft")
    tab.keyboard.press("ArrowDown")
    at(tab, 10, 5, 6)
    tab.keyboard.press("Home")
    at(tab, 10, 0, 6)
    tab.keyboard.press("PageUp")  # stops at the last row
    at(tab, 10, NY - 1, 6)
    tab.get_by_role("slider", name="Column of the section along y (x)").fill("4")
    at(tab, 4, NY - 1, 6)
    all_slices_show(tab, CELLS, 4, NY - 1, 6)


def test_the_wheel_scrolls_the_page_where_no_slice_has_the_focus(tab):
    show(tab)
    tab.evaluate("() => { document.body.style.height = '4000px'; }")
    tab.mouse.move(*spot(tab, "z", 1, 1))
    tab.mouse.wheel(0, 120)
    tab.wait_for_function("() => document.scrollingElement.scrollTop > 50", timeout=SOON)
    at(tab, 6, 5, 4)


def test_a_finger_moves_the_cursor(tab):
    show(tab)
    finger = tab.context.new_cdp_session(tab)
    x, y = spot(tab, "z", 2, 3)
    finger.send(
        "Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": [{"x": x, "y": y}]}
    )
    finger.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    at(tab, 2, 3, 4)


def test_the_cell_under_the_pointer_is_named(tab):
    show(tab)
    tab.mouse.move(*spot(tab, "x", 7, 2))
    name = NAMES[CELLS[2, 7, 6]]
    readout = tab.locator(".readout")
    readout.get_by_text(f"(6, 7, 2) {name}", exact=True).wait_for(timeout=SOON)
    other = volume_content(replace(VOLUME, indices=(CELLS + 1) % 4), "volume")
    tab.evaluate("(data) => { callWith(data); }", other)  # also for the next realization
    name = NAMES[(CELLS[2, 7, 6] + 1) % 4]
    readout.get_by_text(f"(6, 7, 2) {name}", exact=True).wait_for(timeout=SOON)
    tab.mouse.move(1, 1)

    def empty() -> None:
        assert not readout.inner_text()

    soon(empty)


def test_a_click_tells_the_page_only_where_it_asks_for_cells(tab):
    requests: list[str] = []
    show(tab)
    tab.on("request", lambda request: requests.append(request.url))
    tab.mouse.click(*spot(tab, "z", 2, 9))
    tab.get_by_role("slider", name="Layer of the map (z)").fill("1")
    canvas(tab, "x").focus()
    tab.keyboard.press("ArrowUp")
    at(tab, 3, 9, 1)
    assert tab.evaluate("told") == []
    assert requests == []
    begin(tab, "volume", volume_content(VOLUME, "volume") | {"picks": True})
    tab.evaluate("() => { call(); }")
    drawn(tab)
    tab.mouse.click(*spot(tab, "y", 3, 7))

    def told() -> None:
        assert edits(tab) == [{"axis": "y", "cells": [[7, 5, 3]]}]

    soon(told)


def edits(tab) -> list[dict[str, Any]]:
    """Return the last edits that the page received, without their increasing numbers."""
    told = tab.evaluate("told")
    assert {kind for kind, _ in told} <= {"edits"}
    last = told[-1][1] if told else []
    numbers = [edit.pop("seq") for edit in last]
    assert numbers == sorted({*numbers})
    return last


def test_ctrl_z_undoes_on_a_volume_that_takes_edits(tab):
    show(tab)
    tab.keyboard.press("Control+z")
    assert edits(tab) == []
    content = volume_content(VOLUME, "volume")
    begin(tab, "volume", content | {"picks": True, "ack": 0, "can_undo": False, "can_redo": False})
    tab.evaluate("() => { call(); }")
    drawn(tab)
    tab.keyboard.press("Control+z")
    assert edits(tab) == []  # there is nothing to undo
    for cell in ((2, 9), (3, 4)):
        tab.mouse.click(*spot(tab, "z", *cell))
    tab.get_by_role("slider", name="Layer of the map (z)").focus()
    tab.keyboard.press("Control+z")

    def one_after_the_other() -> None:
        told = edits(tab)
        assert [edit.get("axis") for edit in told] == ["z", "z", None]
        assert [cells[-1][1:] for edit in told[:2] for cells in [edit["cells"]]] == [[9, 2], [4, 3]]
        assert told[2] == {"do": "undo"}

    soon(one_after_the_other)
    ack = tab.evaluate("told.at(-1)[1][1].seq")
    taken = {"picks": True, "ack": ack, "can_undo": True, "can_redo": True}
    tab.evaluate("(data) => { callWith(data); }", content | taken)
    tab.keyboard.press("Control+y")

    def what_is_not_taken_yet() -> None:
        assert edits(tab) == [{"do": "undo"}, {"do": "redo"}]

    soon(what_is_not_taken_yet)
    tab.evaluate("document.body.append(document.createElement('textarea'))")
    tab.locator("textarea").focus()
    n = len(tab.evaluate("told"))
    tab.keyboard.press("Control+z")  # undoes only the text
    assert len(edits(tab)) == 2
    assert len(tab.evaluate("told")) <= n + 1  # edits may have been sent again


def test_views_of_one_link_move_together_and_others_do_not(tab):
    show(tab, link="grid")
    smaller = replace(VOLUME, indices=CELLS[:4])
    add(tab, smaller, "smaller", link="grid", body=False)
    add(tab, key="alone")
    tab.mouse.click(*spot(tab, "y", 1, 6))
    at(tab, 1, 5, 6)
    at(tab, 1, 5, 3, view=1)  # the highest layer of the well
    at(tab, 6, 5, 4, view=2)
    tab.locator(".exaggeration").nth(1).select_option("2")

    def all_that_are_linked() -> None:
        values = [tab.locator(".exaggeration").nth(k).input_value() for k in range(3)]
        assert values == ["2", "2", "1"]

    soon(all_that_are_linked)


def test_exaggeration_makes_sections_higher_and_leaves_the_map(tab):
    show(tab)
    before = {axis: canvas(tab, axis).bounding_box() for axis in "zyx"}
    tab.locator(".exaggeration").select_option("2")

    def higher() -> None:
        now = {axis: canvas(tab, axis).bounding_box() for axis in "zyx"}
        assert now["z"] == before["z"]
        for axis in "yx":
            assert now[axis]["width"] == before[axis]["width"]
            assert now[axis]["height"] == pytest.approx(2 * before[axis]["height"] - 2, abs=1)

    soon(higher)


def test_cells_that_are_low_for_their_width_begin_exaggerated(tab):
    show(tab, grid=Grid(NY, NX, (25.0, 25.0, 0.5), nz=NZ))
    assert int(tab.locator(".exaggeration").input_value()) >= 10
    assert canvas(tab, "y").bounding_box()["height"] > 60


def test_cursor_and_mode_stay_for_the_next_realization_and_a_view_drawn_anew(tab):
    show(tab)
    tab.mouse.click(*spot(tab, "z", 2, 9))
    tab.locator(".mode").select_option("2")
    other = np.roll(CELLS, 1, axis=0)
    tab.evaluate("() => { document.querySelector('.volume').parentElement.remove(); }")
    add(tab, replace(VOLUME, indices=other), key="volume")
    at(tab, 2, 9, 4)
    all_slices_show(tab, other, 2, 9, 4)
    assert tab.locator(".mode").input_value() == "2"


def test_data_are_drawn_in_the_slices_that_they_lie_in(tab):
    nothing = CellMap(
        np.zeros((NZ, NY, NX), np.uint8), ["#ffffff"], ["mud"], "", point_colours=COLOURS
    )
    well = [[z, 2, 3, z % 4, 0] for z in range(2, NZ)]
    show(tab, replace(nothing, points=[*well, [4, 8, 9, 3, 1]]))

    def has(axis: str, column: int, row: int, colour: str) -> None:
        wide, high = {"z": (NX, NY), "y": (NX, NZ), "x": (NY, NZ)}[axis]
        assert tab.evaluate(MIDDLES, [axis, wide, high])[row][column] == colour

    soon(lambda: has("z", 3, 2, COLOURS[0]))  # of layer 4
    soon(lambda: has("z", 9, 8, COLOURS[3]))
    tab.mouse.click(*spot(tab, "z", 1, 2))
    for z in range(2, NZ):
        soon(lambda z=z: has("y", 3, z, COLOURS[z % 4]) if z != 4 else None)
    soon(lambda: has("y", 3, 0, "#ffffff"))
    tab.get_by_role("slider", name="Row of the section along x (y)").fill("6")
    tab.get_by_role("slider", name="Layer of the map (z)").fill("6")
    soon(lambda: has("z", 9, 8, "#ffffff"))
    tab.get_by_role("slider", name="Layer of the map (z)").fill("1")
    soon(lambda: has("z", 3, 2, "#14181d"))  # the well passes near this layer
    tab.locator("[data-do=data]").click()
    soon(lambda: has("z", 3, 2, "#ffffff"))


def test_a_block_is_cut_out_at_the_cursor_and_a_facies_stands_alone(tab):
    indices = np.zeros((NZ, NY, NX), np.uint8)
    indices[3:6, 4:7, 5:8] = 2  # inside the volume, visible only in a cut
    show(tab, replace(VOLUME, indices=indices, point_colours=()))

    def count(facies: int) -> int:
        return tab.evaluate(DRAWN, COLOURS[facies])

    holds(lambda: count(2))
    assert count(0) > 20 * count(2)
    tab.get_by_role("slider", name="Layer of the map (z)").fill(str(NZ - 1))  # nothing is cut out

    def closed() -> None:
        assert count(0) > 1000
        assert not count(2)

    soon(closed)
    tab.locator(".mode").select_option("2")

    def alone() -> None:
        assert count(2) > 100
        assert count(0) < 20

    soon(alone)
    tab.locator(".mode").select_option("1")  # a facies without cells

    def none() -> None:
        assert not count(1) + count(2)

    soon(none)


def test_a_threshold_leaves_the_cells_from_a_value_on(tab):
    shares = np.broadcast_to(np.linspace(0, 1, NX), (NZ, NY, NX))
    show(tab, number_map(shares, "P(sand) =", "Probability"))
    tab.locator(".mode").select_option("from")
    slider = tab.get_by_role("slider", name="Lowest value shown in the volume")
    drawn_cells = """() => { const c = document.querySelector('[data-panel=body] canvas');
      const p = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
      return p.filter((a, k) => k % 4 === 3 && a > 250).length; }"""
    slider.fill("100")
    half = settled(tab, lambda: tab.evaluate(drawn_cells))
    slider.fill("0")
    holds(lambda: tab.evaluate(drawn_cells) > 1.3 * half)
    slider.fill("190")
    holds(lambda: 0 < tab.evaluate(drawn_cells) < half / 1.3)
    assert tab.locator(".sliders output").inner_text() == "P(sand) = 0.95"


def test_the_body_turns_zooms_and_is_reset(tab):
    show(tab)
    body = canvas(tab, "body")
    picture = "() => document.querySelector('[data-panel=body] canvas').toDataURL()"
    label = "() => document.querySelector('[data-panel=body] canvas').getAttribute('aria-label')"
    first = tab.evaluate(picture)
    x, y = (lambda box: (box["x"] + box["width"] / 2, box["y"] + 80))(body.bounding_box())
    tab.mouse.move(x, y)
    tab.mouse.down()
    tab.mouse.move(x - 160, y, steps=4)
    tab.mouse.up()
    tab.wait_for_function(f"() => ({label})().includes('the northeast')", timeout=SOON)
    turned = tab.evaluate(picture)
    assert turned != first
    tab.mouse.wheel(0, -200)
    holds(lambda: tab.evaluate(picture) != turned)
    tab.keyboard.press("0")
    holds(lambda: tab.evaluate(picture) == first)
    tab.keyboard.press("ArrowLeft")
    holds(lambda: tab.evaluate(picture) != first)
    body.dblclick()
    holds(lambda: tab.evaluate(picture) == first)


LOOK = """(n) => document.querySelectorAll('[data-panel=body] canvas')[n]
  .getAttribute('aria-label')"""


def test_volumes_of_one_link_have_one_camera_and_one_choice_of_view(tab):
    show(tab, link="grid")
    add(tab, replace(VOLUME, indices=CELLS[:4]), "image", link="grid")
    shares = np.broadcast_to(np.linspace(0, 1, NX), (NZ, NY, NX))
    add(tab, number_map(shares, "P(sand) =", "Probability"), "e_type", link="grid")
    add(tab, key="alone")
    canvas(tab, "body").focus()
    for _ in range(7):
        tab.keyboard.press("ArrowLeft")

    def turned() -> None:
        sides = [tab.evaluate(LOOK, k).split(" seen from ")[1] for k in range(4)]
        assert len({*sides[:3]}) == 1
        assert sides[3] != sides[0]

    soon(turned)
    modes = tab.locator(".mode")
    for mode in ("block y", "2"):
        modes.nth(1).select_option(mode)
        holds(lambda mode=mode: [modes.nth(k).input_value() for k in (0, 1)] == [mode, mode])
    # a view without this choice keeps its own
    assert [modes.nth(k).input_value() for k in (2, 3)] == ["block y", "block"]


@pytest.mark.parametrize(("axis", "n"), [("x", NX), ("y", NY), ("z", NZ)])
def test_a_block_is_cut_across_each_axis_at_the_slice(tab, axis, n):
    indices = np.zeros((NZ, NY, NX), np.uint8)
    place = {"x": np.s_[:, :, 3], "y": np.s_[:, 7, :], "z": np.s_[3, :, :]}[axis]
    indices[place] = 2
    indices[[0, -1]] = indices[:, [0, -1]] = 0
    indices[:, :, [0, -1]] = 0  # the plane is hidden on all sides
    show(tab, replace(VOLUME, indices=indices, point_colours=()))
    tab.locator(".mode").select_option(f"block {axis}")
    cut = tab.get_by_role("slider", name=f"Place of the cut across {axis}")
    held = 7 if axis == "y" else 3
    cut.fill(str(n // 2 - 1 if n // 2 - 1 != held else n // 2))
    holds(lambda: not tab.evaluate(DRAWN, COLOURS[2]))
    cut.fill(str(held))
    holds(lambda: tab.evaluate(DRAWN, COLOURS[2]) > 500)
    middle = {"x": NX // 2, "y": NY // 2, "z": NZ // 2}
    at(tab, *(middle | {axis: held}).values())
    assert tab.locator(".sliders output").inner_text() == str(held)


def test_several_facies_are_shown_with_their_opacities(tab):
    indices = np.zeros((NZ, NY, NX), np.uint8)
    indices[3:6, 4:7, 5:8] = 2
    show(tab, replace(VOLUME, indices=indices, point_colours=()))
    tab.locator(".mode").select_option("several")
    inner = tab.get_by_role("slider", name="Opacity of sand")
    outer = tab.get_by_role("slider", name="Opacity of mud")
    outer.fill("0")
    holds(lambda: tab.evaluate(DRAWN, COLOURS[2]) > 100)
    assert tab.evaluate(DRAWN, COLOURS[0]) < 20
    outer.fill("100")
    holds(lambda: tab.evaluate(DRAWN, COLOURS[0]) > 1000)
    assert not tab.evaluate(DRAWN, COLOURS[2])
    opaque = """() => { const c = document.querySelector('[data-panel=body] canvas');
      const p = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
      return p.filter((a, k) => k % 4 === 3 && a > 250).length; }"""
    whole = tab.evaluate(opaque)
    outer.fill("20")
    holds(lambda: 0 < tab.evaluate(opaque) < whole / 3)  # through mud, the body of sand is seen
    inner.fill("0")
    holds(lambda: tab.evaluate(opaque) < 2000)


def test_a_view_fills_the_screen_and_returns(tab):
    show(tab)
    before = canvas(tab, "body").bounding_box()["width"]
    button = tab.locator("[data-do=full]")
    button.click()
    holds(lambda: tab.evaluate("() => document.fullscreenElement !== null"))
    button.click()
    holds(lambda: tab.evaluate("() => document.fullscreenElement === null"))
    holds(lambda: canvas(tab, "body").bounding_box()["width"] == before)


def test_nothing_is_drawn_at_rest(tab):
    show(tab)
    tab.wait_for_timeout(500)
    tab.evaluate(
        """() => { window.frames_asked = 0; const ask = window.requestAnimationFrame;
        window.requestAnimationFrame = (f) => { window.frames_asked++; return ask(f); }; }"""
    )
    tab.wait_for_timeout(500)
    assert tab.evaluate("frames_asked") == 0
    canvas(tab, "z").focus()
    tab.keyboard.press("ArrowUp")
    holds(lambda: tab.evaluate("frames_asked") > 0)


def test_without_webgl2_the_slices_remain(tab):
    tab.set_viewport_size(SIZE)
    begin(tab, "volume", volume_content(VOLUME, "volume"))
    tab.evaluate(
        """() => { for (const kind of [OffscreenCanvas, HTMLCanvasElement]) {
          const own = kind.prototype.getContext;
          kind.prototype.getContext = function (name, ...more) {
            return name.startsWith('webgl') ? null : own.call(this, name, ...more); };
        } call(); }"""
    )
    drawn(tab)
    tab.get_by_text("this browser has no WebGL2").wait_for(timeout=SOON)
    assert canvas(tab, "body").is_hidden()
    tab.mouse.click(*spot(tab, "z", 2, 9))
    at(tab, 2, 9, 4)
    all_slices_show(tab, CELLS, 2, 9, 4)


def test_a_volume_is_drawn_once_webgl2_is_back(tab):
    tab.set_viewport_size(SIZE)
    begin(tab, "volume", volume_content(VOLUME, "volume"))
    tab.evaluate(
        """() => { const own = OffscreenCanvas.prototype.getContext;
          OffscreenCanvas.prototype.getContext = function (name, ...more) {
            return window.refused || !name.startsWith('webgl') ? own.call(this, name, ...more)
              : (window.refused = true, null); };
          call(); }"""
    )
    drawn(tab)
    canvas(tab, "body").wait_for(timeout=SOON)
    assert tab.evaluate("refused")
    assert tab.get_by_text("this browser has no WebGL2").is_hidden()


@pytest.mark.parametrize(("width", "columns"), [(1000, 2), (390, 1)])
def test_a_phone_has_one_column(tab, width, columns):
    show(tab, grid=Grid(NY, NX, (25.0, 25.0, 5.0), (500_000.0, 4_100_000.0, -1500.0), nz=NZ))
    tab.set_viewport_size({"width": width, "height": 844})

    def fits() -> None:
        boxes = [canvas(tab, axis).bounding_box() for axis in ("z", "body", "y", "x")]
        assert len({round(box["x"]) for box in boxes}) == columns
        assert all(box["x"] + box["width"] <= width for box in boxes)
        assert tab.evaluate("document.scrollingElement.scrollWidth") <= width

    soon(fits)


def test_a_picture_of_the_view_is_saved(tab):
    show(tab, name="realization_1")
    with tab.expect_download(timeout=SOON) as saved:
        tab.locator("[data-do=save]").click()
    assert saved.value.suggested_filename == "realization_1.png"


def test_a_reader_with_a_screen_reader_is_not_kept_out(tab):
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="no axe")
    show(tab)
    found = axe.Axe().run(tab, context=".volume", options={"resultTypes": ["violations"]})
    assert [violation["id"] for violation in found.response["violations"]] == []
    assert canvas(tab, "z").get_attribute("aria-label") == "Realization 1, layer 4"


def test_a_line_is_drawn_in_its_colours_where_no_cell_hides_it_and_in_the_slices_it_crosses(tab):
    pink, green = "#ff20ff", "#20ff20"
    line = [[4.5, 7.5, 0.0, 0], [4.5, 7.5, 6.0, 0], [4.5, 7.5, 12.0, 1]]
    crossed = replace(VOLUME, lines=[line], line_colours=[pink, green])
    count = {}
    for mode, opacities in (("several", [0.0] * 4), ("several", [1.0] * 4)):
        show(tab, crossed, f"with {opacities[0]}", mode=mode, opacities=opacities)
        count[opacities[0]] = [tab.evaluate(DRAWN, colour) for colour in (pink, green)]
    assert all(free > hidden for free, hidden in zip(count[0.0], count[1.0], strict=True))
    assert min(count[0.0]) > 20
    layer = np.array(tab.evaluate(MIDDLES, ["z", NX, NY]))
    assert {*layer[7, :5], *layer[7, 8:]} == {pink, green}
    tab.get_by_role("slider", name="Layer of the map (z)").fill("1")
    soon(lambda: pink_is_gone(tab, pink))


def pink_is_gone(tab, pink: str) -> None:
    assert pink not in np.array(tab.evaluate(MIDDLES, ["z", NX, NY]))
