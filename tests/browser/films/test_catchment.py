"""Test the study of an aquifer: own files in one coordinate system, flow, and a project.

All files are made here: an image with a corner without data, wells with two contradictions, a
probability map, an outline, and a line along which bodies run. The project, opened
in a new browser, has the same study.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from ccwsim import Grid, datasets
from ccwsim.io import maps_as_bytes
from ccwsim.sharing.project import read_project
from tests.browser.hands import SLOW, at_rest, choose, fill, to_page, until
from tests.browser.served import CHROMIUM
from tests.browser.test_guides import to_task
from tests.browser.test_import import bring_wells
from tests.browser.test_share import cells, open_share, taken

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytest.importorskip("rasterio")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no {CHROMIUM}"),
]
GRID = Grid(60, 80, (50.0, 50.0), (844000.0, 6521500.0), crs="EPSG:2154")
OF_IMAGE = Grid(150, 180, (50.0, 50.0), (842000.0, 6520000.0), crs="EPSG:2154")
N_WELLS, WRONG = 40, 2


ENDS = {
    "image": ".tif",
    "wells": ".csv",
    "probability": ".tif",
    "outline": ".geojson",
    "line": ".geojson",
}
"""The files of the study, and their endings."""


@dataclass
class Files:
    """The files of the study."""

    image: Path
    wells: Path
    probability: Path
    outline: Path
    line: Path


@pytest.fixture
def files(tmp_path) -> Files:
    """Return the files: facies 1 to 3, and wells of which two contradict two others."""
    own = Files(**{name: tmp_path / f"{name}{end}" for name, end in ENDS.items()})
    codes = datasets.load("dunes").indices[:150, :180] + 1.0
    truth = datasets.load("dunes").indices[100:160, 100:180] + 1.0
    codes[-20:, -20:][np.tri(20, dtype=bool)[::-1]] = np.nan  # no data in a corner
    own.image.write_bytes(maps_as_bytes({"facies": codes}, OF_IMAGE, "tif"))
    sand = np.clip(gaussian_filter((truth == 2).astype(float), 5), 0, 1)
    own.probability.write_bytes(maps_as_bytes({"P_2": sand}, GRID, "tif"))
    flat = np.random.default_rng(7).choice(truth.size, N_WELLS, replace=False)
    rows, columns = np.divmod(flat, GRID.nx)
    rows, columns = np.append(rows, rows[:WRONG]), np.append(columns, columns[:WRONG])
    facies = truth[rows, columns]
    facies[-WRONG:] = facies[-WRONG:] % 3 + 1
    x, y = GRID.origin[0] + 50 * columns + 20, GRID.origin[1] + 50 * rows + 30
    lines = [f"F{k:03},{x[k]:.1f},{y[k]:.1f},{facies[k]:.0f}" for k in range(len(x))]
    own.wells.write_text("\n".join(["well,x,y,facies", *lines, ""]))
    angle = np.linspace(0, 2 * np.pi, 40)
    ring = np.column_stack([846000 + 1800 * np.cos(angle), 6523000 + 1300 * np.sin(angle)])
    bend = np.column_stack([np.linspace(844100, 847900, 12), 6523000 + 300 * np.sin(angle[:12])])
    own.outline.write_text(geojson("Polygon", [ring.tolist()]))
    own.line.write_text(geojson("LineString", bend.tolist()))
    return own


def geojson(kind: str, coordinates: list[Any]) -> str:
    return json.dumps(
        {
            "type": "FeatureCollection",
            "crs": {"type": "name", "properties": {"name": "EPSG:2154"}},
            "features": [
                {
                    "type": "Feature",
                    "properties": {},
                    "geometry": {"type": kind, "coordinates": coordinates},
                }
            ],
        }
    )


GUIDES = {
    "Where is the model": ("guides_mask_file", "outline", "guides_active"),
    "What is likely where": ("guides_soft_file", "probability", "guides_probabilities"),
    "Which way do bodies run": ("guides_angle_file", "line", "guides_angle"),
}
"""Task on the page Guides: its field for files, the file, and the list that shows its use."""
HONOURED = re.compile(r"(\d+) of \1 data honoured")


def test_a_study_of_a_catchment_is_whole_after_it_is_saved_and_opened(
    film, files, chromium, tmp_path
):
    from playwright.sync_api import expect

    page = film.page
    film.open()
    page.wait_for_selector(".st-key-map_e_type canvas", timeout=SLOW)
    chooser = page.locator(".st-key-import_image_file")
    film.press(page.get_by_role("button", name="Bring a picture"), chooser)
    chooser.locator("input[type=file]").set_input_files(files.image, timeout=SLOW)
    film.see("180 × 150 cells, 3 facies")
    film.take("image")
    bring_wells(page, files.wells)
    film.see(page.get_by_text(re.compile("more than one facies: 2")))
    choose(page, "ask_on_collision", "keep the majority facies")
    film.see(page.get_by_text(re.compile(r"\d+ data of wells.csv are in the study")))
    film.take("wells")
    to_page(page, "Guides")
    for task, (key, name, chosen) in GUIDES.items():
        to_task(page, task)
        box = page.locator(f".st-key-{key} input[type=file]")
        box.set_input_files(getattr(files, name), timeout=SLOW)
        if name == "probability":  # its grid is smaller than that of the image
            fits = page.get_by_role("button", name="Fit to probability.tif").first
            film.press(fits, page.get_by_text("The grid fits probability.tif."))
        lines = page.locator(f".st-key-{chosen} input").first
        expect(lines).not_to_have_value("none", timeout=SLOW)
        at_rest(page)
        film.take(name)
    to_page(page, "Simulate")
    film.see(page.locator(".facts", has_text=HONOURED))
    film.take("realizations")
    to_page(page, "Flow")
    page.wait_for_selector(".st-key-map_heads canvas", timeout=SLOW)
    at_rest(page)
    if film.width > 600:
        fill(page, "flow_thickness", 12)
    film.take("flow")
    to_page(page, "Simulate")
    film.see(page.locator(".facts", has_text=HONOURED))
    page.wait_for_selector("i.results-current", state="attached", timeout=SLOW)
    numbers, facts = cells(page, tmp_path), page.locator(".facts").first.inner_text()
    project = tmp_path / "catchment.ccwsim"
    open_share(page)
    taken(page, "share_save", project)
    context = chromium.new_context(viewport=page.viewport_size, accept_downloads=True)
    again = context.new_page()
    again.goto(f"{film.address}/simulate")
    again.wait_for_selector(".st-key-map_realization canvas", timeout=SLOW)
    box = again.locator(".st-key-share_open input[type=file]")
    until(
        lambda: None if box.count() else again.locator(".st-key-open button").first.click(),
        lambda wait: box.wait_for(state="attached", timeout=wait),
    )
    box.set_input_files(project, timeout=SLOW)
    found = HONOURED.search(facts)
    assert found
    again.locator(".facts", has_text=found[0]).first.wait_for(timeout=SLOW)
    again.wait_for_selector("i.results-current", state="attached", timeout=SLOW)
    again.keyboard.press("Escape")
    at_rest(again)
    assert cells(again, tmp_path) == numbers
    to_page(again, "Guides")
    for task, (_, name, chosen) in GUIDES.items():
        to_task(again, task)
        used = page_value(again, chosen)
        assert getattr(files, name).name in used or name == "line"
        assert used != "none"
    to_page(again, "Flow")
    again.wait_for_selector(".st-key-map_heads canvas", timeout=SLOW)
    if film.width > 600:
        expect(again.locator(".st-key-flow_thickness input")).to_have_value("12", timeout=SLOW)
    context.close()
    saved = read_project(project)
    assert saved.choices.data.upload.name == "wells.csv"
    assert saved.choices.grid.crs == "EPSG:2154"
    page.keyboard.press("Escape")


def page_value(page: Any, key: str) -> str:
    """Return the shown value of a list."""
    box = page.locator(f".st-key-{key} input").first
    box.wait_for(timeout=SLOW)
    return box.input_value()
