"""Test that our components survive the ways in which Streamlit calls them.

Streamlit calls a component again for new data without ending the previous call. If calls follow
quickly, Streamlit may end a call late, or make an older call last and end it at once.
"""

from __future__ import annotations

import csv
from dataclasses import replace
from io import StringIO
from itertools import permutations

import numpy as np
import pytest

from ccwsim import Grid
from ccwsim.figures import LIGHT, times_chart
from ccwsim.ui.frontend.cells import CellMap, map_content
from ccwsim.ui.frontend.component import component_parts
from tests.browser.hands import SOON, soon
from tests.browser.served import CHROMIUM

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no {CHROMIUM}"),
]

BEGIN = """async ([html, js, data]) => {
  const parentElement = document.body.appendChild(document.createElement('div'));
  parentElement.innerHTML = html;
  const url = URL.createObjectURL(new Blob([js], { type: 'text/javascript' }));
  const { default: draw } = await import(url);
  window.told = [];
  const setTriggerValue = (kind, value) => window.told.push(structuredClone([kind, value]));
  window.callWith = (data) => draw({ parentElement, setTriggerValue, data: structuredClone(data) });
  window.call = () => callWith(data);
}"""
FRAMES = "() => new Promise((go) => requestAnimationFrame(() => requestAnimationFrame(go)))"
CALLS = {
    "late end": "() => { const end = call(); call(); end?.(); }",
    "early end": "() => { call()?.(); call(); }",
    "no end": "() => { call(); call(); }",
    "older one last": "() => { call(); call()?.(); }",
}
EMPTY = CellMap(
    np.zeros((8, 16), np.uint8), ["#ffffff"], ["mud"], "a map", point_colours=["#888888"]
)


@pytest.fixture(params=list(CALLS))
def put_up(tab, request):
    """Return a function that shows a component on an empty page, with a given order of calls."""

    def put(name: str, data: dict) -> None:
        begin(tab, name, data)
        tab.evaluate(CALLS[request.param])

    return put


def begin(tab, name: str, data: dict) -> None:
    """Make a page with one component that has not been called yet."""
    html, css, js = component_parts(name)
    if name not in ("editor", "volume"):
        css = ""  # the style of other components would apply to the whole page here
    tab.goto("about:blank")
    tab.set_content("<div class='stApp' style='width: 100%'></div>")
    tab.evaluate(BEGIN, [f"{html}<style>{css}</style>", js, data])


def width(tab, expected: str) -> None:
    tab.wait_for_function(
        f"() => parseInt(document.querySelector('canvas').style.width) {expected}", timeout=SOON
    )


@pytest.mark.parametrize("name", ["map", "editor"])
def test_a_canvas_follows_the_size_of_the_window_and_of_other_maps(tab, put_up, name):
    extra = {"brushes": [], "reads": False, "empty": True, "ack": 0} if name == "editor" else {}
    extra |= {"can_undo": False, "can_redo": False} if name == "editor" else {}
    content = map_content(EMPTY, grid=Grid(8, 16), scale="maps")
    tab.set_viewport_size({"width": 500, "height": 600})
    put_up(name, content | extra)
    width(tab, "> 400")
    one = "() => [...window[Symbol.for('ccwsim-map')].get('maps')].length === 1"
    tab.wait_for_function(one, timeout=SOON)
    tab.set_viewport_size({"width": 300, "height": 600})
    width(tab, "< 300")


@pytest.mark.parametrize("order", list(permutations(range(3))))
def test_the_newest_of_calls_in_any_order_is_shown(tab, order):
    begin(tab, "map", map_content(EMPTY))
    tab.evaluate(
        """async ([order, shown]) => {
          const ends = [];
          for (const k of order) {
            ends.push([k, callWith({ ...shown, alt: `map ${k}` })]);
            await null;
            for (const [j, end] of ends.splice(0, ends.length - 1)) if (j !== 2) end();
          }
          for (const [j, end] of ends) if (j !== 2) end();
        }""",
        [list(order), map_content(EMPTY)],
    )
    assert tab.locator("canvas").get_attribute("aria-label") == "map 2"


def test_a_map_shows_and_says_the_cells_of_its_newest_picture(tab):
    two = {"colours": ["#888888", "#ffcc00"], "labels": ["mud", "sand"]}
    shown = map_content(replace(EMPTY, **two))
    # another picture and, before it is unpacked, the first one under another name
    other = map_content(replace(EMPTY, indices=np.ones((8, 16), np.uint8), **two))
    tab.set_viewport_size({"width": 500, "height": 600})
    begin(tab, "map", shown)
    tab.evaluate("() => { call(); }")
    width(tab, "> 400")
    box = tab.locator("canvas").bounding_box()
    spot = box["x"] + box["width"] / 2 + 1, box["y"] + box["height"] / 2 - 1

    def says(expected: str) -> None:
        assert tab.locator(".readout").inner_text() == expected

    def hovers() -> None:
        tab.mouse.move(*spot)
        says("(8, 4) mud")

    soon(hovers)
    tab.evaluate("([first, second]) => { callWith(first); callWith(second); }",
                 [other, {**other, "name": "again"}])  # fmt: skip
    soon(lambda: says("(8, 4) sand"))
    colour = """() => [...document.querySelector('canvas').getContext('2d')
      .getImageData(40, 40, 1, 1).data]"""
    assert tab.evaluate(colour) == [255, 204, 0, 255]


def test_a_click_and_an_undo_are_told_once(tab, put_up):
    extra = {"brushes": [{"label": "mud", "colour": "#888888"}], "reads": False, "empty": True}
    extra |= {"ack": 0, "can_undo": True, "can_redo": False}
    tab.set_viewport_size({"width": 500, "height": 600})
    put_up("editor", map_content(EMPTY, grid=Grid(8, 16)) | extra)
    width(tab, "> 400")
    tab.locator("canvas").click(position={"x": 100, "y": 100})

    def one_edit() -> None:
        told = tab.evaluate("told")
        assert [kind for kind, _ in told] == ["edits"]
        assert [list(edit) for edit in told[0][1]] == [["seq", "set"]]

    def and_its_undo() -> None:
        assert [len(queue) for _, queue in tab.evaluate("told")] == [1, 2]

    soon(one_edit)
    tab.keyboard.press("Control+z")
    soon(and_its_undo)


@pytest.fixture
def editing(tab):
    """Return a function that shows the editor of a grid of 16 × 8 cells with the given data.

    A datum is [row, column, facies, wrong, help]. The result is a function that returns the middle
    of a cell on the screen.
    """

    def put(*points: list[int]):
        colours = {"mud": "#888888", "sand": "#ffcc00"}
        shown = replace(EMPTY, points=list(points), point_colours=list(colours.values()))
        content = map_content(shown, grid=Grid(8, 16)) | {"reads": False, "empty": True, "ack": 0}
        content |= {"brushes": [{"label": n, "colour": c} for n, c in colours.items()]}
        content |= {"can_undo": False, "can_redo": False}
        tab.set_viewport_size({"width": 500, "height": 600})
        begin(tab, "editor", content)
        tab.evaluate("() => { call(); }")
        width(tab, "> 400")
        box = tab.locator("canvas").bounding_box()
        cell = (box["width"] - 41) / 16  # room for the axis at the left, and a line at the right

        def middle(row: int, column: int) -> tuple[float, float]:
            return box["x"] + 40 + (column + 0.5) * cell, box["y"] + 1 + (8 - row - 0.5) * cell

        return middle

    return put


def drag(tab, *spots: tuple[float, float]) -> None:
    """Press the mouse button at the first spot and move over the others; the button stays down."""
    tab.mouse.move(*spots[0])
    tab.mouse.down()
    for spot in spots[1:]:
        tab.mouse.move(*spot, steps=5)


def sets(tab) -> list:
    """Return the cells of each edit that the page has received."""
    return tab.evaluate("told.length ? told.at(-1)[1].map((edit) => edit.set || edit.do) : []")


def has_sets(tab, *expected: list, since: int = 0) -> None:
    """Check the cells of the received edits, from number `since` on."""

    def has() -> None:
        assert sets(tab)[since:] == list(expected)

    soon(has)


def press_tool(tab, name: str) -> None:
    tab.locator(f"[data-tool={name}]").click()


def is_told(tab, *expected: list) -> None:
    """Check the messages that the page receives, after the first message arrives."""

    def is_so() -> None:
        assert tab.evaluate("told") == list(expected)

    soon(is_so)


ERASED = -1


def test_a_datum_is_dragged_to_another_cell_in_one_edit(tab, editing):
    middle = editing([2, 3, 1, 0, 0], [5, 9, 0, 0, 0])
    drag(tab, middle(2, 3), middle(6, 12))
    assert sets(tab) == []  # until it is dropped
    tab.mouse.up()
    has_sets(tab, [[2, 3, ERASED], [6, 12, 1]])
    drag(tab, middle(6, 12), middle(5, 9))  # onto the other datum, which is replaced
    tab.mouse.up()
    has_sets(tab, [[6, 12, ERASED], [5, 9, 1]], since=1)

    def one_is_left() -> None:
        assert tab.locator(".legend").inner_text().count("1 datum") == 1

    soon(one_is_left)


def test_escape_and_a_drop_beside_the_map_leave_a_datum_where_it_is(tab, editing):
    middle = editing([2, 3, 1, 0, 0])
    drag(tab, middle(2, 3), middle(6, 12))
    tab.keyboard.press("Escape")
    tab.mouse.up()
    drag(tab, middle(2, 3), middle(9, 12))
    tab.mouse.up()
    drag(tab, middle(2, 3), middle(6, 12), middle(2, 3))  # there and back
    tab.mouse.up()
    assert sets(tab) == []


def test_a_click_on_a_datum_sets_its_facies_and_lines_may_begin_there(tab, editing):
    middle = editing([2, 3, 0, 0, 0])
    x, y = middle(2, 3)
    tab.locator(".brushes button", has_text="sand").click()
    drag(tab, (x, y), (x + 2, y + 1))
    tab.mouse.up()
    has_sets(tab, [[2, 3, 1]])
    press_tool(tab, "straight")
    drag(tab, (x, y), middle(2, 6))
    tab.mouse.up()
    has_sets(tab, [[2, 4, 1], [2, 5, 1], [2, 6, 1]], since=1)


def test_each_tool_does_what_its_name_says(tab, editing):
    from playwright.sync_api import expect

    middle = editing()
    tab.locator(".brushes button", has_text="mud").click()
    drag(tab, middle(1, 1), middle(1, 5))
    tab.mouse.up()
    has_sets(tab, [[1, 5, 0]])  # draw: one, where the pointer is released
    press_tool(tab, "freehand")
    drag(tab, middle(3, 1), middle(3, 3), middle(5, 3))
    tab.mouse.up()
    has_sets(tab, [[3, 1, 0], [3, 2, 0], [3, 3, 0], [4, 3, 0], [5, 3, 0]], since=1)
    press_tool(tab, "erase")
    drag(tab, middle(3, 1), middle(3, 2))
    tab.mouse.up()

    def erased() -> None:
        assert [sorted(cells) for cells in sets(tab)[2:]] == [[[3, 1, ERASED], [3, 2, ERASED]]]

    soon(erased)
    press_tool(tab, "pan")
    drag(tab, middle(3, 3), middle(3, 8))
    tab.mouse.up()
    tab.mouse.click(*middle(6, 6))
    assert len(sets(tab)) == 3
    checked = tab.locator("[data-tool][aria-checked=true]")
    expect(checked).to_have_text(["pan"], timeout=SOON)
    tab.locator(".brushes button", has_text="sand").click()  # this also selects the tool draw
    expect(checked).to_have_text(["draw"], timeout=SOON)


def test_one_finger_moves_a_datum_and_two_zoom(tab, editing):
    from playwright.sync_api import expect

    middle = editing([2, 3, 1, 0, 0])
    press_tool(tab, "draw")
    finger = tab.context.new_cdp_session(tab)

    def touch(kind: str, *spots: tuple[float, float]) -> None:
        points = [{"x": x, "y": y, "id": k} for k, (x, y) in enumerate(spots)]
        finger.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    (x, y), (to_x, to_y) = middle(2, 3), middle(6, 12)
    touch("touchStart", (x + 9, y))  # beside the mark, because a finger is imprecise
    for k in (1, 2, 3, 4):
        touch("touchMove", (x + (to_x - x) * k / 4, y + (to_y - y) * k / 4))
    touch("touchEnd")
    has_sets(tab, [[2, 3, ERASED], [6, 12, 1]])

    a, b = middle(6, 12), middle(3, 9)
    touch("touchStart", a)
    touch("touchStart", a, b)
    for k in (1, 2, 3, 4):
        touch("touchMove", a, (b[0] - 12 * k, b[1] + 12 * k))
    touch("touchEnd")
    expect(tab.locator("canvas.near")).to_have_count(1, timeout=SOON)
    assert len(sets(tab)) == 1  # the first finger dropped the datum


def test_an_arrow_key_makes_one_step(tab, put_up):
    put_up("script", {"script": "arrows"})
    tab.keyboard.press("ArrowRight")
    is_told(tab, ["told", 1])


def test_a_switch_of_the_theme_is_told_once(tab, put_up):
    put_up("script", {"script": "theme", "theme": "light"})
    tab.evaluate(
        """() => { document.querySelector('.stApp').style.colorScheme = 'dark';
        document.querySelector('i').dispatchEvent(new Event('transitionend')); }"""
    )
    is_told(tab, ["told", "dark"])


def test_the_menu_of_a_chart_closes_where_somewhere_else_is_clicked(tab, put_up):
    put_up("chart_menu", {"title": "CPU time", "chart": "times", "name": "times"})
    tab.locator(".open").click()
    tab.locator(".choices").wait_for(timeout=SOON)
    tab.mouse.click(400, 400)
    tab.locator(".choices").wait_for(state="hidden", timeout=SOON)


def test_a_part_of_a_page_keeps_its_height_until_the_page_rests(tab, put_up):
    put_up("script", {"script": "steady", "parts": "[class*=st-key-part]"})
    tab.evaluate(
        """() => { const app = document.querySelector('.stApp');
        app.dataset.testScriptState = 'running';
        app.innerHTML = "<div class='st-key-part'><div style='height: 300px'></div></div>"; }"""
    )
    high = "() => document.querySelector('.st-key-part').getBoundingClientRect().height"
    tab.wait_for_function(f"() => ({high})() === 300", timeout=SOON)
    tab.evaluate(FRAMES)  # frames in which the size is measured
    tab.evaluate("() => document.querySelector('.st-key-part').replaceChildren()")
    tab.evaluate(FRAMES)
    assert tab.evaluate(high) == 300
    tab.evaluate(
        "() => { document.querySelector('.stApp').dataset.testScriptState = 'notRunning'; }"
    )
    tab.wait_for_function(f"() => ({high})() === 0", timeout=SOON)


def test_the_csv_of_a_chart_has_no_formulas(tab):
    begin(tab, "chart_menu", {"title": "CPU time", "chart": "times", "name": "times"})
    names = ["=1+1", "+1+1", "-1+1", "@SUM(1)", "\t=1", "sand, =1", "-3.5"]
    tab.evaluate(
        """(names) => {
          document.body.insertAdjacentHTML('beforeend',
            "<div class='st-key-times'><div class='js-plotly-plot'></div></div>");
          Object.assign(document.querySelector('.js-plotly-plot'), {
            _fullLayout: { xaxis: { title: { text: '=x' } }, yaxis: {} },
            _fullData: names.map((name) => ({ name, x: [name, 1e-7], y: [-3.5, NaN] })),
          });
          URL.createObjectURL = (blob) => {
            blob.text().then((text) => { window.saved = text; });
            return '#';
          };
        }""",
        names,
    )
    tab.evaluate("() => call()")
    tab.locator(".open").click()
    tab.locator(".choices [data-kind=csv]").click()
    text = tab.wait_for_function("() => window.saved", timeout=SOON).json_value()
    head, *lines = csv.reader(StringIO(text))
    assert head == ["series", "curve", "'=x", "y"]
    shown = [name if name in ("-3.5", "sand, =1") else f"'{name}" for name in names]
    assert lines[::2] == [[name, "1", name, "-3.5"] for name in shown]
    assert lines[1::2] == [[name, "1", "1e-7", ""] for name in shown]


def test_a_chart_is_drawn_with_its_values_at_the_pointer(tab):
    figure = times_chart(np.array([20.0, 30.0, 40.0]), 30.0, LIGHT).to_json()
    begin(tab, "chart", {"figure": figure, "alt": "Times"})
    style = ".chart { position: relative; height: 190px; } .chart > * { position: absolute; }"
    tab.add_style_tag(content=style)  # as the style of all pages
    tab.evaluate("() => { call(); }")
    dots = tab.locator(".points path")
    dots.nth(1).wait_for(timeout=SOON)
    assert dots.count() == 3
    assert tab.locator("svg[aria-label=Times]").count() == 1
    box = dots.nth(1).bounding_box()
    tab.mouse.move(box["x"] + 3, box["y"] + 3)
    assert tab.locator(".readout").inner_text() == "realization 2: 30 ms"


# Return the texts that a map writes when it is drawn again.
WRITTEN = """async () => {
  const own = CanvasRenderingContext2D.prototype.fillText, found = [];
  CanvasRenderingContext2D.prototype.fillText = function write(text, ...rest) {
    found.push(text);
    return own.call(this, text, ...rest);
  };
  window.dispatchEvent(new CustomEvent('ccwsim-map',
    { detail: { link: 'maps', hover: null, view: { zoom: 1, x: 0, y: 0 } } }));
  CanvasRenderingContext2D.prototype.fillText = own;
  return [...new Set(found)];
}"""


def test_a_map_names_its_wells_unless_names_overlap_or_are_too_many(tab):
    cells = {"A-1": (2, 2), "B 2": (5, 12), "beside B 2": (5, 13), "erased": (0, 3)}
    points = [[*cell, 0, 0] for cell in list(cells.values())[:-1]]
    wells = tuple((name, (cell,)) for name, cell in cells.items())
    shown = map_content(replace(EMPTY, points=points, wells=wells), link="maps")
    tab.set_viewport_size({"width": 500, "height": 600})
    begin(tab, "map", shown)
    tab.evaluate("() => { call(); }")
    width(tab, "> 400")
    assert tab.evaluate(WRITTEN) == ["A-1", "B 2"]
    box = tab.locator("canvas").bounding_box()

    def says(column: float, row: float, expected: str) -> None:
        x, y = (column + 0.5) / 16, 1 - (row + 0.5) / 8
        tab.mouse.move(box["x"] + x * box["width"], box["y"] + y * box["height"])
        assert tab.locator(".readout").inner_text() == expected

    soon(lambda: says(13, 5, "(13, 5) mud · beside B 2"))
    soon(lambda: says(3, 0, "(3, 0) mud"))
    tab.evaluate("(data) => { callWith(data); }", shown | {"max_names": 1})
    assert tab.evaluate(WRITTEN) == []
    soon(lambda: says(2, 2, "(2, 2) mud · A-1"))


def test_a_dragged_well_is_told_one_choice_after_another_and_the_last_one_always(tab):
    sides = {"well": [3, 4], "heads": [1, 0], "axis": "x", "well_colour": "#cc0000"}
    shown = map_content(EMPTY, picks=True) | sides | {"well_label": "well"}
    tab.set_viewport_size({"width": 500, "height": 600})
    begin(tab, "flow", shown)
    tab.evaluate("() => { call(); }")
    width(tab, "> 400")
    box = tab.locator("canvas").bounding_box()
    cell = (box["width"] - 2) / 16

    def spot(row: float, column: float) -> tuple[float, float]:
        return box["x"] + 1 + (column + 0.5) * cell, box["y"] + box["height"] - 1 - (
            row + 0.5
        ) * cell

    def told() -> list:
        return [value for kind, value in tab.evaluate("told") if kind == "chosen"]

    tab.mouse.move(*spot(3, 4))
    tab.mouse.down()
    tab.mouse.move(*spot(5, 8), steps=6)
    tab.mouse.up()
    first = told()[0]["well"]
    assert first != [5, 8]
    assert all(one["well"] == first for one in told())  # the page has not applied the first one
    tab.evaluate("(data) => { callWith(data); }", {**shown, "well": first})
    assert told()[-1]["well"] == [5, 8]
    tab.evaluate("(data) => { callWith(data); }", {**shown, "well": [5, 8]})
    n = len(told())
    tab.mouse.move(box["x"] + 20, box["y"] + box["height"] / 2)  # the tab of the western head
    tab.mouse.down()
    tab.mouse.move(box["x"] + 20, box["y"] + box["height"] / 2 - 17)
    tab.mouse.up()
    assert told()[n] == {"well": [5, 8], "heads": [1.2, 0]}
    tab.evaluate("(data) => { callWith(data); }", {**shown, "well": [5, 8], "heads": [1.2, 0]})
    tab.locator("canvas").focus()
    tab.keyboard.press("Shift+ArrowDown")
    assert told()[-1]["well"] == [0, 8]
    tab.evaluate("(data) => { callWith(data); }", {**shown, "well": [0, 8], "heads": [1.2, 0]})
    tab.mouse.click(*spot(6, 12))
    assert told()[-1]["well"] == [6, 12]


def test_a_line_of_flow_is_drawn_and_undone_with_keys(tab):
    guides = {"strokes": False, "flow": [], "outlines": {}}
    tab.set_viewport_size({"width": 500, "height": 600})
    begin(tab, "guides", map_content(EMPTY) | guides | {"arrows": None, "tool": "line"})
    tab.evaluate("() => { call(); }")
    width(tab, "> 400")
    tab.locator("canvas").focus()
    for key in ("ArrowUp", "Enter", "ArrowDown", "Shift+ArrowRight", "Enter"):
        tab.keyboard.press(key)  # the cursor begins in the middle
    line = [[8.5, 4.5], [15.5, 3.5]]
    is_told(tab, ["drawn", guides | {"flow": [line]}])
    tab.keyboard.press("Control+z")
    is_told(tab, ["drawn", guides | {"flow": [line]}], ["drawn", guides])
