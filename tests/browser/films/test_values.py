"""Test an own elevation map: GeoTIFF and measured points become the probability of high ground."""

from __future__ import annotations

import re

import numpy as np
import pytest

from ccwsim import Grid
from ccwsim.io import maps_as_bytes
from tests.browser.hands import SLOW, at_rest, choose, downloaded, to_page
from tests.browser.served import CHROMIUM
from tests.browser.test_import import bring_wells

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no {CHROMIUM}"),
]
PLACE = {"cell_size": (25.0, 25.0), "origin": (413000.0, 5294000.0), "crs": "EPSG:32632"}


def relief(shape: tuple[int, int] = (100, 120), seed: int = 3) -> np.ndarray:
    """Return ridges from about 300 m to 700 m."""
    q = np.hypot(np.fft.fftfreq(shape[0])[:, None], np.fft.rfftfreq(shape[1]))
    noise = np.fft.rfft2(np.random.default_rng(seed).standard_normal(shape))
    field = np.fft.irfft2(noise * (q**2 + 0.02**2) ** -1.1, shape)
    return 500 + 60 * (field - field.mean()) / field.std()


@pytest.fixture
def files(tmp_path):
    """Return a GeoTIFF of elevations, a table of 50 measured points, and their cells and values."""
    image, points = tmp_path / "elevation.tif", tmp_path / "points.csv"
    field = relief()
    image.write_bytes(maps_as_bytes({"elevation": field}, Grid(*field.shape, **PLACE), "tif"))
    truth = relief(seed=8).round(2)
    cells = np.random.default_rng(4).choice(truth.size, 50, replace=False)
    rows, columns = np.unravel_index(cells, truth.shape)
    (dx, dy), (x0, y0) = PLACE["cell_size"], PLACE["origin"]
    places = zip(x0 + dx * columns + 9, y0 + dy * rows + 9, truth[rows, columns], strict=True)
    points.write_text(
        "\n".join(["easting,northing,elevation", *(f"{x},{y},{v}" for x, y, v in places)])
    )
    return image, points, (rows, columns), truth[rows, columns]


def test_measured_points_become_the_probability_of_high_ground(film, files):
    rasterio = pytest.importorskip("rasterio")
    image, points, cells, measured = files
    page = film.page
    film.open()
    page.wait_for_selector(".st-key-map_e_type canvas", timeout=SLOW)
    chooser = page.locator(".st-key-import_image_file")
    film.press(page.get_by_role("button", name="Bring a picture"), chooser)
    chooser.locator("input[type=file]").set_input_files(image, timeout=SLOW)
    film.see("120 × 100 cells, 2 facies")
    film.take("a-threshold-is-guessed")
    page.get_by_text("keep values", exact=True).click(timeout=SLOW)
    film.see("120 × 100 cells, elevation")
    units = page.get_by_label("Units, such as m or %")
    units.fill("m", timeout=SLOW)
    units.press("Enter")
    film.take("values-are-kept")
    film.press(page.get_by_role("button", name="Use this image"), page.get_by_text("Simulate"))
    bring_wells(page, points)
    film.see("50 data of points.csv are in the study")
    film.take("points")
    honoured = page.locator(".facts", has_text=re.compile("50 of 50 data honoured"))
    film.press(page.get_by_role("button", name="Simulate", exact=True), honoured)
    at_rest(page)
    film.take("probability-above-the-median")
    choose(page, "e_type", "standard deviation")
    at_rest(page)
    film.take("standard-deviation")
    saved = downloaded(page, "realizations_tif")
    with rasterio.open(saved.path()) as made:
        for at in range(1, made.count + 1):
            assert (made.read(at)[::-1][cells] == measured).all()
    to_page(page, "Validate")
    page.wait_for_selector(".st-key-chart_mds .js-plotly-plot", timeout=SLOW)
    film.see("elevation > ")
    film.take("verdicts")
