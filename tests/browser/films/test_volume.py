"""Test a volume: own files, one camera for image and realization, a cut, verdicts, ParaView."""

from __future__ import annotations

import re
from pathlib import Path
from urllib.parse import urlencode

import numpy as np
import pytest

from ccwsim import Grid, HardData, Parameters, TrainingImage, datasets, simulate
from ccwsim.io import read_hard_data, read_training_image, write_training_image
from tests.browser.hands import SLOW, downloaded, soon, to_page
from tests.browser.served import CHROMIUM
from tests.browser.test_import import bring_wells

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
def image_file(request, tmp_path) -> Path:
    """Return a published volume of four facies as an SGeMS file, or a bundled volume."""
    try:
        published = request.getfixturevalue("data_dir") / "volumes/ti_alluvial_ti1_78x59x116.npz"
        with np.load(published) as file:
            image = TrainingImage(file["ti"][:40])
    except (FileNotFoundError, pytest.skip.Exception):
        image = datasets.load("sinuous_channels")
    path = tmp_path / "own.sgems"
    write_training_image(path, image, format="sgems")
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


def test_an_own_volume_goes_from_its_file_to_paraview(film, image_file, wells_file):
    page = film.page
    film.open(f"/import?{urlencode(STUDY)}")
    given = page.locator(".st-key-import_image_file input[type=file]")
    given.set_input_files(image_file, timeout=SLOW)
    page.wait_for_selector(".st-key-volume_import canvas", timeout=SLOW)
    film.take("volume")
    simulate_it = page.get_by_role("button", name="Simulate", exact=True)
    film.press(page.get_by_role("button", name="Use this image"), simulate_it)
    bring_wells(page, wells_file)
    film.see("80 data of wells.csv are in the study")
    film.take("wells")
    honoured = page.locator(".facts", has_text=re.compile("80 of 80 data honoured"))
    film.press(simulate_it, honoured)
    film.take("realization")

    image = read_training_image(image_file, volume=True)
    data = read_hard_data(wells_file, GRID, image)
    assert isinstance(data, HardData)
    own = simulate(image, GRID, P, data, n_realizations=2, seed=7)

    def slices_are_of_the_run() -> None:
        assert own.indices[0].ravel().tolist() in page.evaluate(CELLS)

    soon(slices_are_of_the_run, SLOW)
    to_page(page, "Validate")
    film.see(page.locator("canvas"))
    film.take("verdicts")
    to_page(page, "Flow")
    page.wait_for_selector(".st-key-flow_maps canvas", timeout=SLOW)
    film.take("flow")
    to_page(page, "Simulate")
    film.see(honoured)
    file = Path(downloaded(page, "realizations_vti").path())
    saved = file.rename(file.with_suffix(".vti"))
    np.testing.assert_array_equal(vti_cells(saved), own.realizations[0])
