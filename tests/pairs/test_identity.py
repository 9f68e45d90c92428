"""Test that files name wells and facies, and that coordinates keep all of their digits."""

from __future__ import annotations

import json
import re
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest

import ccwsim
from ccwsim import Grid, HardData, Parameters, Secondary, TrainingImage, simulate
from ccwsim.io import read_hard_data, read_realizations, realizations_as_bytes
from ccwsim.io.hard_data.files import hard_data_as_bytes, import_hard_data, names_of_data
from ccwsim.model.numbers import coordinate
from tests.ui.widgets import csv_rows

LAMBERT = Grid(40, 50, (50.0, 50.0), (844000.0, 6521500.0), crs="EPSG:2154")
STRIPES = np.tile([[3], [3], [7], [7]], (16, 64))
IMAGE = TrainingImage(STRIPES, facies_names=["clay", "sand"])
DATA = HardData([[12, 30], [20, 8]], [7, 3])
WELLS = [("F001", [(12, 30)])]


def test_coordinates_keep_all_digits():
    assert coordinate(6522175.0) == "6522175"
    assert coordinate(6522175.25) == "6522175.25"
    assert "50 × 50 from (844000, 6521500), EPSG:2154" in LAMBERT.describe()


def test_no_coordinate_is_written_with_six_digits():
    """The names are those of coordinates in the package."""
    nouns = "origin|corner|place|coordinate|position|number|x|y|side|size"
    of_place = rf"(?<!%)(?<!%\{{)\{{[^{{}}]*\b({nouns})\w*:\.?\d?g\}}"
    root, found = Path(ccwsim.__file__).parent, []
    for path in sorted(root.rglob("*.py")):
        found += [(path.name, m[0]) for m in re.finditer(of_place, path.read_text("utf-8"))]
    css = [("results.py", "{size:g}")]  # widths in a style sheet
    assert found == css


def test_csv_and_geojson_name_wells_and_facies_and_are_read_back():
    names = names_of_data(DATA, IMAGE, WELLS)
    csv = hard_data_as_bytes(DATA, "csv", LAMBERT, names)
    assert csv_rows(csv)[0] == {
        "x": "845525.0", "y": "6522125.0", "facies": "7", "facies_name": "sand", "well": "F001",
    }  # fmt: skip
    geojson = hard_data_as_bytes(DATA, "geojson", LAMBERT, names)
    content = json.loads(geojson)
    assert content["crs"]["properties"]["name"] == "EPSG:2154"
    first = content["features"][0]
    assert first["geometry"]["coordinates"] == [845525.0, 6522125.0]
    assert first["properties"] == {"facies": 7, "facies_name": "sand", "well": "F001"}
    for text in (csv, geojson):
        assert read_hard_data(BytesIO(text), LAMBERT, IMAGE).digest == DATA.digest


@pytest.mark.parametrize("n", [1, 4])
def test_geotiff_is_categorical(n):
    rasterio = pytest.importorskip("rasterio")
    active = np.ones(LAMBERT.shape, bool)
    active[:9, :20] = False
    e = simulate(
        IMAGE, LAMBERT, Parameters(16, 4, 1), n_realizations=n, secondary=Secondary(active=active)
    )
    content = realizations_as_bytes(e, "tif", colours=["#102030", "#405060"])
    with rasterio.MemoryFile(content) as memory, memory.open() as file:
        assert set(file.dtypes) == {"uint8"}
        assert file.nodata == 255
        assert file.crs.to_epsg() == 2154
        assert all("alpha" not in each.name for each in file.colorinterp)
        for band in range(1, n + 1):
            assert file.tags(band) == {"facies_3": "clay", "facies_7": "sand"}
        if n == 1:
            assert file.colormap(1)[7] == (0x40, 0x50, 0x60, 255)
    read = read_realizations(BytesIO(content), IMAGE)
    assert np.array_equal(read.indices, e.indices)
    assert read.grid == LAMBERT


def test_the_report_of_an_import_says_which_datum_of_a_cell_is_kept():
    table = {"well": ["F1", "F60", "F2"], "x": [10.0, 12.0, 80.0], "y": [10.0, 10.0, 80.0]}
    table["facies"] = [3, 7, 3]
    grid = Grid(4, 4, (25.0, 25.0))
    notes = import_hard_data(table, grid, IMAGE, on_collision="nearest").notes
    assert any("kept: row 2" in note for note in notes), notes
