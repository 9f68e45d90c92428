"""Test that data placed by hand in a browser are exactly the data of the simulation."""

from __future__ import annotations

import re
from dataclasses import dataclass
from io import BytesIO
from math import floor
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

from ccwsim import Grid, read_hard_data
from tests.browser.hands import GLANCE, SLOW, SOON, at_rest, settled, soon, to_page, until
from tests.browser.served import CHROMIUM

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no {CHROMIUM}"),
]

LEFT, TOP, BOTTOM = 40, 1, 20
"""Pixels beside the cells of a map with axes."""
LARGEST = 48
"""Maximum size of a cell in pixels, at which zooming ends."""
MUD, SAND = 0, 1
ROW_HEIGHT = 35
"""Height of a row of the table in pixels."""
BACKGROUND = "(e) => getComputedStyle(e).backgroundColor"


@pytest.fixture
def page(tab):
    return tab


@dataclass
class Editor:
    """The canvas on the page, and its zoom factor around the middle."""

    page: Any
    nx: int
    ny: int
    zoom: float = 1.0

    @property
    def canvas(self):
        return self.page.locator(".st-key-editor canvas")

    def box(self) -> dict[str, float] | None:
        """Return the box of the canvas once its cells are square, as on the grid of the study."""
        box = self.canvas.bounding_box()
        if box is None:
            return None
        wide, high = (box["width"] - LEFT - 1) / self.nx, (box["height"] - TOP - BOTTOM) / self.ny
        return box if wide == pytest.approx(high, rel=0.02) else None

    def frame(self) -> tuple[float, float, float]:
        """Return the south-west corner of the map, and the pixels of a cell at zoom 1."""
        box = settled(self.page, self.box, pause=100)
        cell = (box["width"] - LEFT - 1) / self.nx
        return box["x"] + LEFT, box["y"] + TOP + cell * self.ny, cell

    def spots(self, *shares: tuple[float, float]) -> list[tuple[int, int]]:
        """Return the pixels of points, given by shares of the canvas from the south-west."""
        west, south, cell = self.frame()
        return [
            (round(west + x * cell * self.nx), round(south - y * cell * self.ny)) for x, y in shares
        ]

    def spot(self, share_x: float, share_y: float) -> tuple[int, int]:
        """Return the pixels of one point."""
        return self.spots((share_x, share_y))[0]

    def cells(self, spots: list[tuple[int, int]]) -> list[tuple[int, int]]:
        """Return the rows and columns under pixels, computed from the layout of the page."""
        frame = self.frame()
        return [self._cell(spot, *frame) for spot in spots]

    def cell(self, spot: tuple[int, int]) -> tuple[int, int]:
        """Return the row and column under a pixel."""
        return self.cells([spot])[0]

    def _cell(
        self, spot: tuple[int, int], west: float, south: float, cell: float
    ) -> tuple[int, int]:
        half_x, half_y = cell * self.nx / 2, cell * self.ny / 2
        column = self.nx / 2 + (spot[0] - west - half_x) / (cell * self.zoom)
        row = self.ny / 2 + (south - spot[1] - half_y) / (cell * self.zoom)
        return floor(row), floor(column)

    def brush(self, name: str) -> None:
        self.check(self.page.locator(".st-key-editor .brushes button", has_text=name))

    def tool(self, name: str) -> None:
        self.check(self.page.locator(f'.st-key-editor [data-tool="{name}"]'))

    def check(self, button) -> None:
        from playwright.sync_api import expect

        until(
            lambda: button.click(timeout=SOON),
            lambda wait: expect(button).to_have_attribute("aria-checked", "true", timeout=wait),
        )

    def click(self, spot: tuple[int, int]) -> None:
        self.page.mouse.click(*spot)

    def drag(self, *spots: tuple[int, int]) -> None:
        self.page.mouse.move(*spots[0])
        self.page.mouse.down()
        for spot in spots[1:]:
            self.page.mouse.move(*spot, steps=7)
        self.page.mouse.up()

    def zoom_in(self, times: int) -> None:
        for _ in range(times):
            self.page.locator('.st-key-editor [data-do="in"]').click()
        self.zoom = min(self.zoom * 1.6**times, LARGEST / self.frame()[2])

    def honours(self, n: int) -> None:
        """Wait until a run honours all n data and the table contains the data."""
        from playwright.sync_api import expect

        title = "1 datum" if n == 1 else f"{n} data"  # the number of data in the study
        expect(self.page.locator(".st-key-table_row .panel")).to_have_text(title, timeout=SLOW)
        words = f"{n} of {n} data honoured" if n else "no hard data"
        expect(self.page.locator(".facts")).to_contain_text(words, timeout=SLOW)
        self.page.wait_for_selector("i.results-current", state="attached", timeout=SLOW)
        at_rest(self.page)

    def data(self) -> dict[tuple[int, int], int]:
        """Return the data in the exported CSV file."""
        menu = self.page.locator(".st-key-export_menu button").first
        file = self.page.get_by_role("button", name=re.compile("^CSV"))
        until(
            lambda: None if file.is_visible() else menu.click(timeout=GLANCE),
            lambda wait: file.wait_for(timeout=wait),
        )
        with self.page.expect_download(timeout=SLOW) as waiting:
            file.click()
        self.page.keyboard.press("Escape")
        content = BytesIO(Path(waiting.value.path()).read_bytes())
        content.name = "hard_data.csv"
        data = read_hard_data(content, Grid(self.ny, self.nx))
        cells = [tuple(cell) for cell in data.cells.tolist()]
        return dict(zip(cells, data.facies.tolist(), strict=True))

    def holds(self, data: dict[tuple[int, int], int]) -> None:
        """Check that the study has these data, even if their number is unchanged."""

        def same() -> None:
            self.honours(len(data))
            assert self.data() == data

        soon(same, SLOW)


def idle(page):
    """Wait until the page has been redrawn after the last action."""
    at_rest(page)
    # an element that is being replaced is gone
    replaced = "[data-stale=true], .st-key-clear ~ .st-key-clear"
    page.wait_for_function(f"() => !document.querySelector('{replaced}')", timeout=SLOW)


def opened(page, address, nx, ny) -> Editor:
    """Return the editor of a study without data, with two realizations."""
    page.goto(f"{address}/simulate?data=none&grid={nx}x{ny}&realizations=2")
    page.wait_for_selector(".st-key-results .st-key-map_e_type canvas", timeout=SLOW)
    idle(page)
    to_page(page, "Hard data")
    editor = Editor(page, nx, ny)
    ready(editor)
    return editor


def ready(editor: Editor) -> None:
    """Wait until the canvas shows the grid of the study and its realizations."""
    from playwright.sync_api import expect

    expect(editor.page.locator(".st-key-editor")).to_be_visible(timeout=SLOW)
    expect(editor.page.locator(".brushes", has_text="as shown")).to_be_visible(timeout=SLOW)
    editor.honours(0)
    settled(editor.page, editor.box)
    idle(editor.page)


def straight(cells: set[tuple[int, int]], a: tuple[int, int], b: tuple[int, int]) -> bool:
    """Return whether cells form a line from a to b: one cell per step, at most half a cell off."""
    high, wide = b[0] - a[0], b[1] - a[1]
    n = max(abs(high), abs(wide))
    steps = [
        (max(abs(row - a[0]), abs(column - a[1])), row, column) for row, column in cells
    ]  # fmt: skip
    off = [
        max(abs(a[0] + high * k / n - row), abs(a[1] + wide * k / n - column))
        for k, row, column in steps
    ]
    return sorted(k for k, _, _ in steps) == list(range(n + 1)) and max(off) <= 0.5


def length(a: tuple[int, int], b: tuple[int, int]) -> int:
    """Return the number of cells of a line from a to b."""
    return max(abs(b[0] - a[0]), abs(b[1] - a[1])) + 1


@pytest.mark.parametrize(
    ("nx", "ny", "zooms"),
    [
        (100, 80, 0),
        (400, 300, 5),
        (1000, 1000, 0),  # cells smaller than pixels
    ],
)
def test_exactly_the_cells_that_are_clicked_and_dragged(page, address, nx, ny, zooms):
    editor = opened(page, address, nx, ny)
    editor.zoom_in(zooms)
    spots = first, second, third = editor.spots((0.2, 0.3), (0.7, 0.8), (0.6, 0.15))
    known = dict(zip(editor.cells(spots), (SAND, MUD, SAND), strict=True))
    assert len(known) == 3
    editor.brush("sand")
    editor.click(first)
    editor.click(third)
    editor.brush("mud")
    editor.click(second)
    editor.holds(known)

    editor.click(first)
    known[editor.cell(first)] = MUD
    editor.tool("erase")
    editor.click(third)
    del known[editor.cell(third)]
    editor.holds(known)

    start, end = editor.spots((0.3, 0.5), (0.5, 0.62))
    editor.brush("sand")
    editor.tool("straight")
    editor.drag(start, end)
    ends = editor.cells([start, end])
    editor.honours(2 + length(*ends))
    drawn = editor.data()
    cells = set(drawn) - set(known)
    assert straight(cells, *ends)
    assert all(drawn[cell] == SAND for cell in cells)
    assert {cell: drawn[cell] for cell in known} == known

    editor.canvas.focus()
    page.keyboard.press("Control+z")
    editor.holds(known)
    page.locator('.st-key-editor [data-step="redo"]').click()
    editor.holds(drawn)


def test_quick_edits_are_all_taken_and_an_eraser_wipes_a_path(page, address):
    editor = opened(page, address, 100, 80)
    editor.brush("sand")
    spots = editor.spots(*((0.1 + 0.06 * k, 0.2 + 0.04 * (k % 3)) for k in range(12)))
    cells = editor.cells(spots)  # before the clicks can move the page
    for spot in spots:
        editor.click(spot)
    editor.holds(dict.fromkeys(cells, SAND))
    for _ in range(5):
        page.keyboard.press("Control+z")
    editor.holds(dict.fromkeys(cells[:7], SAND))
    spots = editor.spots(*((0.1 + 0.06 * k, 0.2 + 0.04 * (k % 3)) for k in range(4)))
    editor.tool("erase")
    editor.drag(*spots)
    editor.holds(dict.fromkeys(cells[4:7], SAND))


def test_a_datum_is_dragged_as_one_edit_that_can_be_undone(page, address):
    editor = opened(page, address, 100, 80)
    editor.brush("sand")
    first, second, third = editor.spots((0.2, 0.3), (0.7, 0.8), (0.5, 0.5))
    editor.click(first)
    editor.click(third)
    editor.honours(2)
    editor.brush("mud")  # the datum keeps its own facies
    editor.drag(first, second)
    editor.holds({editor.cell(second): SAND, editor.cell(third): SAND})
    editor.drag(second, third)
    editor.honours(1)
    for spots in ((second, third), (first, third)):
        page.locator('.st-key-editor [data-step="undo"]').click()
        editor.holds({editor.cell(spot): SAND for spot in spots})


def test_keys_alone_place_change_and_erase(page, address):
    editor = opened(page, address, 100, 80)
    editor.canvas.focus()
    for key in ("ArrowUp", "ArrowUp", "Shift+ArrowRight", "2", "Enter", "ArrowDown", "1", "Space"):
        page.keyboard.press(key)
    editor.holds({(41, 60): SAND, (40, 60): MUD})
    editor.canvas.focus()
    page.keyboard.press("Delete")
    editor.holds({(41, 60): SAND})


def test_rows_pasted_over_and_below_the_table_are_data(page, address):
    from playwright.sync_api import expect

    editor = opened(page, address, 100, 80)
    spot = editor.spot(0.52, 0.53)
    cell = editor.cell(spot)  # as the page is while it is clicked
    editor.click(spot)
    editor.honours(1)
    rows = "10.5\t20.5\t1\n11.2\t20.9\t0\n"
    page.evaluate("text => navigator.clipboard.writeText(text)", rows)
    title = page.locator(".st-key-table_row .panel")

    def paste() -> None:
        at_rest(page)
        if title.inner_text() != "2 data":
            table = page.locator(".st-key-editing [data-testid=stDataFrame]").bounding_box()
            page.mouse.click(table["x"] + 80, table["y"] + 52)
            at_rest(page)
            page.keyboard.press("Control+v")

    until(paste, lambda wait: expect(title).to_have_text("2 data", timeout=wait))
    editor.holds({(20, 10): 1, (20, 11): 0})
    page.locator('.st-key-editor [data-step="undo"]').click()
    editor.holds({cell: SAND})


def row_colours(page, n: int) -> list[tuple[int, int, int]]:
    """Return the colour at the right end of each of the first n rows of the table."""
    table = page.locator(".st-key-editing [data-testid=stDataFrame]")
    table.scroll_into_view_if_needed()
    picture = Image.open(BytesIO(table.screenshot())).convert("RGB")
    right = picture.width - 14
    return [picture.getpixel((right, ROW_HEIGHT * k + ROW_HEIGHT // 2)) for k in range(1, n + 1)]


def test_rows_of_the_table_have_the_colours_of_their_facies(page, address):
    editor = opened(page, address, 100, 80)
    for name, share in (("sand", 0.3), ("mud", 0.6)):
        editor.brush(name)
        editor.click(editor.spot(share, 0.41))
    editor.honours(2)
    swatches = page.locator(".st-key-editor .brushes .swatch")
    mud, sand = (
        tuple(int(part) for part in re.findall(r"\d+", swatch.evaluate(BACKGROUND)))
        for swatch in swatches.all()
    )
    see_rows(page, sand, mud)
    until(lambda: set_facies(page, 0, "0"), lambda wait: see_rows(page, mud, mud, within=wait))
    until(lambda: set_facies(page, 1, "1"), lambda wait: see_rows(page, mud, sand, within=wait))

    def has_both() -> None:
        editor.honours(2)
        assert sorted(editor.data().values()) == [MUD, SAND]

    soon(has_both, SLOW)


def set_facies(page, row: int, value: str) -> None:
    """Type a facies into a cell of the table, whose editor opens some time after the first key."""

    def write() -> None:
        at_rest(page)
        page.keyboard.press("Escape")
        table = page.locator(".st-key-editing [data-testid=stDataFrame]").bounding_box()
        x, y = table["x"] + table["width"] - 60, table["y"] + (row + 1.5) * ROW_HEIGHT
        page.mouse.click(x, y)
        page.keyboard.type(value)

    until(write, lambda wait: page.locator("#portal input").wait_for(timeout=wait))
    page.keyboard.press("Enter")


def see_rows(page, *colours: tuple[int, ...], within: float = SOON) -> None:
    """Wait until the first rows of the table have these colours."""

    def have() -> None:
        assert row_colours(page, len(colours)) == list(colours)

    soon(have, within)


def test_wheel_pan_and_hover_keep_cells_exact(page, address):
    editor = opened(page, address, 1000, 1000)
    spot = editor.spot(0.31, 0.62)
    editor.brush("sand")
    editor.tool("pan")
    editor.canvas.focus()
    page.mouse.move(*spot)
    for _ in range(4):
        page.mouse.wheel(0, -300)
    page.mouse.down()
    page.mouse.move(spot[0] + 60, spot[1] - 40, steps=6)
    page.mouse.up()
    editor.honours(0)
    there = editor.spot(0.5, 0.5)
    page.mouse.move(*there)
    readout = page.locator(".st-key-editor .readout")
    column, row = map(int, re.findall(r"\d+", settled(page, readout.inner_text))[:2])
    editor.tool("draw")
    editor.click(there)
    editor.holds({(row, column): SAND})
    assert (row, column) != editor.cell(there)


def test_on_a_phone_a_tap_places_and_a_finger_draws_a_line(chromium, address):
    from playwright.sync_api import expect

    context = chromium.new_context(
        viewport={"width": 390, "height": 844}, has_touch=True, is_mobile=True,
        device_scale_factor=2, accept_downloads=True,
    )  # fmt: skip
    page = context.new_page()
    page.goto(f"{address}/data")
    page.wait_for_selector(".facts", timeout=SLOW)
    page.wait_for_selector(".st-key-map_e_type canvas", timeout=SLOW)
    narrow = "() => document.scrollingElement.scrollWidth <= 390"
    page.wait_for_function(narrow, timeout=SOON)
    idle(page)
    clear = page.locator(".st-key-clear").get_by_role("button", name="Clear")
    title = page.locator(".st-key-table_row .panel")
    until(
        lambda: clear.tap(timeout=SOON) if clear.is_enabled() else None,
        lambda wait: expect(title).to_have_text("0 data", timeout=wait),
    )
    editor = Editor(page, 512, 512)
    editor.honours(0)
    editor.brush("sand")
    spot = editor.spot(0.4, 0.45)
    known = {editor.cell(spot): SAND}
    page.touchscreen.tap(*spot)
    editor.honours(1)
    assert editor.cell(spot) in known, "the map moved under the finger"
    editor.holds(known)
    beside = editor.spot(0.7, 0.3)
    moved = {editor.cell(beside): SAND}
    finger = context.new_cdp_session(page)
    stroke(finger, spot, beside)
    editor.holds(moved)
    page.locator('.st-key-editor [data-tool="straight"]').tap()
    start, end = editor.spot(0.2, 0.7), editor.spot(0.6, 0.8)
    ends = editor.cell(start), editor.cell(end)
    stroke(finger, start, end)
    editor.honours(1 + length(*ends))
    drawn = editor.data()
    assert straight(set(drawn) - set(moved), *ends)
    assert set(drawn.values()) == {SAND}
    assert moved.keys() <= drawn.keys()
    context.close()


def stroke(session, start, end):
    """Move one finger along a straight line on the touch screen."""
    touch(session, "touchStart", start)
    for k in range(1, 6):
        touch(session, "touchMove", [a + (b - a) * k // 5 for a, b in zip(start, end, strict=True)])
    touch(session, "touchEnd")


def touch(session, kind, *spots):
    points = [{"x": spot[0], "y": spot[1]} for spot in spots]
    session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
