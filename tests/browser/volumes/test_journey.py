"""Test a published volume in a browser: file, wells, run, slices, validation, VTI file."""

from __future__ import annotations

import re
from pathlib import Path
from urllib.parse import urlencode

import numpy as np
import pytest

from ccwsim import Grid, HardData, Parameters, TrainingImage, simulate
from ccwsim.io import read_hard_data, read_training_image, write_training_image
from tests.browser.hands import (
    GLANCE,
    SLOW,
    at_rest,
    downloaded,
    follow,
    menu,
    run,
    soon,
    to_page,
    until,
    upload,
)
from tests.browser.served import CHROMIUM

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pyvista = pytest.importorskip("pyvista", exc_type=ImportError)
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no {CHROMIUM}"),
]

GRID = Grid(36, 40, nz=20)
P = Parameters((8, 16, 16), (2, 4, 4), (1, 1, 1))
STUDY = {
    "ti": "sinuous_channels", "data": "none", "grid": "40x36x20", "template": "16x16x8",
    "overlap": "4x4x2", "level": "1x1x1", "realizations": "2", "seed": "7",
}  # fmt: skip
CELLS = """async () => {
  const kept = [...window[Symbol.for('ccwsim-volume')].cells.values()];
  return Promise.all(kept.map(async (each) => Array.from(await each)));
}"""


@pytest.fixture
def image_file(data_dir, tmp_path) -> Path:
    """Return a published volume of four facies as an SGeMS file."""
    published = data_dir / "volumes" / "ti_alluvial_ti1_78x59x116.npz"
    if not published.exists():
        pytest.skip(f"there is no {published}")
    with np.load(published) as file:
        cells = file["ti"][:40]
    path = tmp_path / "alluvial.sgems"
    write_training_image(path, TrainingImage(cells), format="sgems")
    return path


@pytest.fixture
def wells_file(image_file, tmp_path) -> Path:
    """Return a file of four vertical wells, whose facies are those of columns of the image."""
    image = read_training_image(image_file, volume=True)
    rows = ["well,x,y,z,facies"]
    for k, (row, column) in enumerate([(5, 6), (9, 33), (28, 8), (30, 30)]):
        log = image.array[: GRID.nz, 10 + row, 12 + column]
        for layer, facies in enumerate(log.tolist()):
            rows.append(f"W{k},{column + 0.5},{row + 0.5},{layer + 0.5},{facies}")
    path = tmp_path / "wells.csv"
    path.write_text("\n".join(rows))
    return path


def vti_cells(path: Path) -> np.ndarray:
    """Return the cells of the first realization, read from the VTI file by another program."""
    mesh = pyvista.read(path)
    nx, ny, nz = (n - 1 for n in mesh.dimensions)
    name = next(iter(mesh.cell_data.keys()))
    return np.asarray(mesh.cell_data[name]).reshape(nz, ny, nx).astype(int)


def test_a_published_volume_goes_from_its_file_to_paraview(tab, address, image_file, wells_file):
    tab.goto(f"{address}/simulate?{urlencode(STUDY)}")
    tab.wait_for_selector(".st-key-volume_realization canvas", timeout=SLOW)
    menu(tab, "image_row")
    tab.locator(".st-key-image_file input[type=file]").set_input_files(image_file, timeout=SLOW)
    tab.wait_for_url("**/import*", timeout=SLOW)
    use = tab.get_by_role("button", name="Use this image")
    on = tab.get_by_role("button", name="Simulate", exact=True)
    use.wait_for(timeout=SLOW)
    tab.locator(".st-key-volume_import canvas").first.wait_for(timeout=SLOW)
    at_rest(tab)
    until(
        lambda: None if on.count() else use.click(timeout=GLANCE),
        lambda wait: on.wait_for(timeout=wait),
    )
    follow(tab, on, "simulate")
    tab.locator(".st-key-image_row .note", has_text="4 facies").first.wait_for(timeout=SLOW)
    upload(tab, "data", wells_file, note="80 data")
    run(tab)
    honoured = re.compile(r"80 of 80 data honoured")
    tab.locator(".facts", has_text=honoured).first.wait_for(timeout=SLOW)

    image = read_training_image(image_file, volume=True)
    data = read_hard_data(wells_file, GRID, image)
    assert isinstance(data, HardData)
    own = simulate(image, GRID, P, data, n_realizations=2, seed=7)
    at_rest(tab)

    def slices_are_of_the_run() -> None:
        shown = tab.evaluate(CELLS)
        wanted = own.indices[0].ravel().tolist()
        assert wanted in shown

    soon(slices_are_of_the_run, SLOW)

    file = Path(downloaded(tab, "realizations_vti").path())
    saved = file.rename(file.with_suffix(".vti"))
    np.testing.assert_array_equal(vti_cells(saved), own.realizations[0])
    tab.keyboard.press("Escape")

    at_rest(tab)
    to_page(tab, "Validate")
    tab.locator(".facts.judged", has_text="all 80 data honoured").first.wait_for(timeout=SLOW)
    tab.locator(".st-key-chart_variogram_v .js-plotly-plot").first.wait_for(timeout=SLOW)
    assert not tab.locator("[data-testid=stException], [data-testid=stAlert]").count()
