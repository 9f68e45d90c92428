"""Test the first ten minutes of a modeller: own GeoTIFF and wells, verdicts, GeoTIFF of results."""

from __future__ import annotations

import re

import numpy as np
import pytest

from ccwsim import Grid
from ccwsim.io import maps_as_bytes
from tests.browser.hands import SLOW, at_rest, choose, downloaded, to_page
from tests.browser.served import CHROMIUM
from tests.browser.test_import import bring_wells
from tests.small_images import facies_at_edges

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no {CHROMIUM}"),
]
PLACE = {"cell_size": (25.0, 25.0), "origin": (413000.0, 5294000.0), "crs": "EPSG:32632"}
CODES = facies_at_edges()
FAR = "500000,5294100,1"  # a well with a wrong easting


@pytest.fixture
def files(tmp_path):
    """Return a GeoTIFF with three facies, a table of 41 wells, and the cells of 40 of them."""
    image, wells = tmp_path / "facies.tif", tmp_path / "wells.csv"
    image.write_bytes(maps_as_bytes({"facies": CODES}, Grid(*CODES.shape, **PLACE), "tif"))
    cells = np.random.default_rng(4).choice(CODES.size, 40, replace=False)
    rows, columns = np.unravel_index(cells, CODES.shape)
    (dx, dy), (x0, y0) = PLACE["cell_size"], PLACE["origin"]
    places = zip(x0 + dx * columns + 9, y0 + dy * rows + 9, CODES[rows, columns], strict=True)
    lines = [f"{x},{y},{code}" for x, y, code in places]
    wells.write_text("\n".join(["easting,northing,facies", *lines, FAR]))
    return image, wells, (rows, columns)


def test_own_image_and_wells_become_maps_in_the_coordinates_of_the_image(film, files):
    rasterio = pytest.importorskip("rasterio")
    image, wells, cells = files
    page = film.page
    film.open()
    page.wait_for_selector(".st-key-map_e_type canvas", timeout=SLOW)
    film.take("first-screen")
    chooser = page.locator(".st-key-import_image_file")
    film.press(page.get_by_role("button", name="Bring a picture"), chooser)
    film.take("bring-a-picture")
    chooser.locator("input[type=file]").set_input_files(image, timeout=SLOW)
    film.see("96 × 72 cells, 3 facies")
    film.take("image")
    bring_wells(page, wells)
    film.see("1 of 41 data outside the grid")
    film.take("question-about-a-distant-well")
    assert not page.locator(".st-key-ask_fit").count()  # a distant well does not extend the grid
    choose(page, "ask_on_outside", "leave them out")
    film.see("40 data of wells.csv are in the study")
    film.take("wells")
    honoured = page.locator(".facts", has_text=re.compile("40 of 40 data honoured"))
    film.press(page.get_by_role("button", name="Simulate", exact=True), honoured)
    film.take("realizations")
    to_page(page, "Validate")
    page.wait_for_selector(".st-key-chart_mds .js-plotly-plot", timeout=SLOW)
    film.take("verdicts")
    to_page(page, "Simulate")
    film.see(honoured)
    at_rest(page)
    saved = downloaded(page, "realizations_tif")
    film.take("download")
    with rasterio.open(saved.path()) as made, rasterio.open(image) as given:
        assert (made.crs, made.transform, made.shape) == (given.crs, given.transform, given.shape)
        for at in range(1, made.count + 1):
            assert (made.read(at)[::-1][cells] == CODES[cells]).all()
