"""Test wrong files wherever the dashboard takes one: the message, the study kept, the right file.

All files are made here. Each wrong file is of a kind that users bring: of another coordinate
system, off the grid, damaged, without numbers, in parts, or with values that mean nothing.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from ccwsim import Grid
from ccwsim.io import maps_as_bytes
from tests.browser.films.test_catchment import geojson
from tests.browser.hands import GLANCE, SLOW, SOON, at_rest, follow, menu, soon, to_page, until
from tests.browser.served import CHROMIUM
from tests.browser.test_guides import to_task
from tests.browser.test_share import open_share, taken
from tests.small_images import facies_at_edges

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytest.importorskip("rasterio")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no {CHROMIUM}"),
]
CODES = facies_at_edges()
GRID = Grid(*CODES.shape, (25.0, 25.0), (844000.0, 6521500.0), crs="EPSG:2154")
ELSEWHERE = Grid(*CODES.shape, (25.0, 25.0), (844000.0, 6521500.0), crs="EPSG:32632")
BESIDE = Grid(*CODES.shape, (25.0, 25.0), (849000.0, 6521500.0), crs="EPSG:2154")
WEST = np.arange(GRID.nx) < 60
INSIDE = np.tile(WEST, (GRID.ny, 1))
BASINS = 1 + np.arange(GRID.n_cells).reshape(GRID.shape) // (GRID.n_cells // 3)


class Wrong(NamedTuple):
    """A wrong file: its name, its content, and the message, in which cause and cure are named."""

    name: str
    content: bytes
    message: str


def tif(values: Any, grid: Grid = GRID, name: str = "v") -> bytes:
    return maps_as_bytes({name: np.asarray(values, float)}, grid, "tif")


def sgems(values: Any, name: str) -> bytes:
    """Return a grid as text, which has no place."""
    numbers = "\n".join(f"{value:g}" for value in np.ravel(values))
    return f"{GRID.nx} {GRID.ny} 1\n1\n{name}\n{numbers}\n".encode()


def table(*rows: tuple[Any, ...]) -> bytes:
    return "\n".join(",".join(map(str, row)) for row in [("x", "y", "facies"), *rows]).encode()


def wells(n: int = 30) -> bytes:
    """Return a table of data with the facies of the image, at places in the west."""
    cells = np.random.default_rng(4).choice(np.flatnonzero(INSIDE), n, replace=False)
    rows, columns = np.unravel_index(cells, GRID.shape)
    x, y = GRID.axes[0][columns], GRID.axes[1][rows]
    return table(*zip(x, y, CODES[rows, columns], strict=True))


def shape(kind: str, *points: tuple[float, float]) -> bytes:
    """Return a polygon or a line in GeoJSON."""
    corners = [list(point) for point in points]
    return geojson(kind, [corners] if kind == "Polygon" else corners).encode()


SHARES = np.where(INSIDE, 0.6, 0.2)
INCLUDE = b"SPECGRID\n 96 72 1 1 F /\nINCLUDE\n 'facies.inc' /\n"
X0, Y0 = GRID.origin
RIGHT = {
    "basins.tif": tif(BASINS),
    "facies.tif": tif(CODES, name="facies"),
    "wells.csv": wells(),
    "sand.tif": tif(SHARES, name="P_1"),
    "flow.geojson": shape("LineString", (X0 + 100, Y0 + 100), (X0 + 2000, Y0 + 900)),
    "second.tif": tif(CODES[::-1], name="facies"),
    "zones.tif": tif(np.tril(np.ones(GRID.shape)), name="zone"),
}
OF_IMAGE = (
    Wrong("remarks.csv", b"well,remark\nA,dry\nB,none\n", "no column contains numbers"),
    Wrong("parts.grdecl", INCLUDE, "put the values in place of INCLUDE, facies.inc."),
    Wrong("damaged.tif", RIGHT["facies.tif"][:900], "save it again"),
    Wrong("empty.sgems", sgems(np.full(GRID.shape, -999), "f"), "no cell has a value; choose"),
)
OF_DATA = (
    Wrong("remarks.csv", b"well,remark\nA,dry\nB,none\n", "no column contains numbers"),
    Wrong("degrees.csv", table((2.9, 46.8, 0), (2.8, 46.8, 1)), "2 of 2 data outside the grid"),
    Wrong("far.csv", wells() + b"\n500000,5294100,1", "1 of 31 data outside the grid"),
    Wrong("beside.tif", tif(CODES, BESIDE), "x from 849000 to 851400"),
    Wrong("words.csv", table((X0 + 9, Y0 + 9, "basalt")), "facies that the image does not have"),
)


class Task(NamedTuple):
    """A place for files on the page Guides."""

    title: str
    key: str  # of the field for files
    chosen: str  # key of the list that shows the file in use
    wrong: tuple[Wrong, ...]
    right: str
    shown: str  # in the list, if the right file is in use


SYSTEMS = "has the coordinate system 'EPSG:32632', but the grid has 'EPSG:2154'"
TASKS = (
    Task(
        "Where is the model",
        "guides_mask_file",
        "guides_active",
        (
            Wrong("utm.tif", tif(INSIDE, ELSEWHERE), SYSTEMS),
            Wrong(
                "far.geojson", shape("Polygon", (0, 0), (9, 0), (9, 9)), "does not reach the grid"
            ),
            Wrong("nothing.tif", tif(0 * INSIDE), "no cell of the grid is active; give"),
        ),
        "basins.tif",
        "file basins.tif",
    ),
    Task(
        "What is likely where",
        "guides_soft_file",
        "guides_probabilities",
        (
            Wrong("percent.tif", tif(100 * SHARES, name="P_1"), "divide percent by 100"),
            Wrong("beside.tif", tif(SHARES, BESIDE, "P_1"), "x from 849000 to 851400"),
        ),
        "sand.tif",
        "file sand.tif",
    ),
    Task(
        "Which way do bodies run",
        "guides_angle_file",
        "guides_angle",
        (
            Wrong("codes.tif", tif(np.where(INSIDE, 999, 30)), "angle = 999 is not between -360"),
            Wrong("far.geojson", shape("LineString", (0, 0), (9, 9)), "does not reach the grid"),
        ),
        "flow.geojson",
        "along drawn lines",
    ),
    Task(
        "A second image",
        "guides_other_file",
        "guides_use",
        (
            Wrong("damaged.tif", RIGHT["second.tif"][:900], "save it again"),
            Wrong("others.tif", tif(CODES + 5), "rename or merge its facies"),
        ),
        "second.tif",
        "all for each patch",
    ),
    Task(
        "Different areas",
        "guides_zones_file",
        "guides_zones",
        (
            Wrong("seven.tif", tif(7 * INSIDE), "zones: 7 is not the number of an image"),
            Wrong("half.tif", tif(INSIDE / 2), "zones: 0.5 is not the number of an image"),
        ),
        "zones.tif",
        "file zones.tif",
    ),
)
OF_PROJECT = (
    Wrong("picture.ccwsim", RIGHT["facies.tif"], "picture.ccwsim"),
    Wrong("cut.ccwsim", b"PK\x03\x04" + bytes(300), "cut.ccwsim"),
)
HONOURED = "30 of 30 data honoured"
RAW = re.compile(r"Traceback|Error\b|Exception|\bNone\b|\w+=")
"""Words of exceptions, and hints for scripts, which are not for the dashboard."""


def bring(film, key: str, name: str, content: bytes) -> Path:
    """Give a file to a field for files."""
    path = film.folder / name
    path.write_bytes(content)
    field = film.page.locator(f"[class*=st-key-{key}]")
    earlier = field.get_by_role("button", name=re.compile("^Remove"))
    at_rest(film.page)  # a field that is drawn anew loses its file
    if key == "guides_soft_file" and earlier.count():  # which takes several files
        earlier.first.click(timeout=SOON)
        earlier.first.wait_for(state="detached", timeout=SOON)
        at_rest(film.page)
    field.locator("input[type=file]").first.set_input_files(path, timeout=SLOW)
    return path


def refused(film, key: str, wrong: Wrong) -> None:
    """Give a wrong file; the message is below the field, in the words of the user."""
    page = film.page
    bring(film, key, wrong.name, wrong.content)
    alert = page.locator("[data-testid=stAlert]", has_text=wrong.message).locator("visible=true")
    alert.first.wait_for(timeout=SOON)
    at_rest(page)
    film.picture(f"{key}-{wrong.name}")

    def beside() -> None:
        field = page.locator(f"[class*=st-key-{key}]").first.bounding_box()
        box = alert.first.bounding_box()
        assert 0 <= box["y"] - field["y"] < 500
        assert box["x"] < field["x"] + field["width"]
        assert field["x"] < box["x"] + box["width"]

    soon(beside, SOON)
    assert alert.count() == 1
    assert not RAW.search(alert.first.inner_text())
    assert not page.locator("[data-testid=stException]").count()


def current(page) -> None:
    """Wait until the results belong to the study."""
    page.wait_for_selector("i.results-current", state="attached", timeout=SLOW)
    at_rest(page)


def kept(film, facts: str) -> None:
    """Check that the page Simulate shows current results with these facts."""
    to_page(film.page, "Simulate")
    film.see(film.page.locator(".facts", has_text=re.compile(facts)))
    current(film.page)


def to_import(page) -> None:
    """Open the page Import by its link in the menu of the image."""
    menu(page, "image_row")
    follow(page, page.get_by_role("link", name="Facies, colours, turns, advice"), "import")


def to_hard_data(page) -> None:
    """Choose hard data on the page Import."""
    kind = page.locator(".st-key-import_subject").get_by_text("Hard data", exact=True)
    field = page.locator(".st-key-wells_file input[type=file]")
    until(
        lambda: None if field.count() else kind.click(timeout=GLANCE),
        lambda wait: field.wait_for(state="attached", timeout=wait),
    )


@pytest.mark.parametrize("film", ["desktop"], indirect=True)
def test_wrong_files_are_refused_beside_their_field_and_change_nothing(film):
    from playwright.sync_api import expect

    page = film.page
    film.open("/import?data=none&realizations=4")
    field = "import_image_file"
    for wrong in OF_IMAGE:
        refused(film, field, wrong)
    kept(film, "4 realizations")
    film.see(page.locator(".st-key-image_row .note", has_text="channels"))
    to_import(page)
    bring(film, field, "facies.tif", RIGHT["facies.tif"])
    film.see("96 × 72 cells, 3 facies")
    to_hard_data(page)
    for wrong in OF_DATA:
        refused(film, "wells_file", wrong)
    kept(film, "4 realizations")
    to_import(page)
    to_hard_data(page)
    bring(film, "wells_file", "wells.csv", RIGHT["wells.csv"])
    film.see("30 data of wells.csv are in the study")
    kept(film, HONOURED)
    project = film.folder / "right.ccwsim"
    open_share(page)
    taken(page, "share_save", project)
    page.keyboard.press("Escape")
    to_page(page, "Guides")
    current(page)
    for task in TASKS:
        to_task(page, task.title)
        for wrong in task.wrong:
            refused(film, task.key, wrong)
            current(page)
        if task.key == "guides_other_file":  # further images are added to each other
            remove = page.get_by_role("button", name="Keep the guides as they were")
            film.press(remove, page.get_by_text("An image from a file"))
            expect(remove).to_have_count(0, timeout=SLOW)
        bring(film, task.key, task.right, RIGHT[task.right])
        if task.key == "guides_mask_file":
            film.see("choose which values are active")
            film.picture("question")
            for value, n in (("1", "2,304"), ("2", "4,608")):
                pill = page.locator(".st-key-ask_active_codes button", has_text=f"{value} (")
                film.press(pill, page.get_by_text(f"{n.replace(',', '')} of 6912 cells are active"))
        chosen = page.locator(f".st-key-{task.chosen} input").first
        expect(chosen).to_have_value(task.shown, timeout=SLOW)
        current(page)
        film.take(task.key)
    kept(film, r"(\d+) of \1 data honoured")
    opens = page.locator(".st-key-open button").first
    box = page.locator(".st-key-share_open input[type=file]")
    until(
        lambda: None if box.count() else opens.click(),
        lambda wait: box.wait_for(state="attached", timeout=wait),
    )
    for wrong in OF_PROJECT:
        refused(film, "share_open", wrong)
        current(page)
    bring(film, "share_open", project.name, project.read_bytes())
    film.see(page.locator(".st-key-guides .note", has_text="none in use"))
    page.keyboard.press("Escape")
    kept(film, HONOURED)
    film.take("project")
