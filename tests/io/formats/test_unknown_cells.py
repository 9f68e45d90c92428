"""Test that every reader recognizes and reports the same unknown cells."""

from __future__ import annotations

from io import BytesIO

import numpy as np
import pytest

from ccwsim import Grid, TrainingImage
from ccwsim.io import (
    import_hard_data,
    inspect,
    maps_as_bytes,
    read_geometry,
    read_grid,
    read_training_image,
)
from ccwsim.io.data_file import DataFile
from ccwsim.io.opening import READERS
from ccwsim.model.missing import CUSTOMARY_CODES
from tests.io.every_reader import CELLS, FILES, NEEDS

HOLE = np.zeros(CELLS.shape, bool)
HOLE[2, 1:4] = True
NO_IMAGES = ("geojson", "geopackage", "shapefile")
"""Formats that contain only points."""
OWN = {
    **dict.fromkeys(("surfer text", "surfer 6", "surfer 7"), 1.70141e38),
    **{"zmap": 1e30, "irap": 9999900.0},
}
"""Codes for unknown cells that formats define themselves."""


def content_of(kind: str, code: float) -> BytesIO:
    pytest.importorskip(NEEDS.get(kind, "numpy"))
    return BytesIO(FILES[kind](np.where(HOLE, code, CELLS.astype(float))))


def test_every_reader_has_a_file():
    assert {*FILES} == {*READERS} - {"shp"}, "add a file of the new reader"


@pytest.mark.parametrize("kind", FILES)
def test_a_customary_code_is_unknown_and_said(kind):
    content = content_of(kind, OWN.get(kind, -9999.0))
    if kind in NO_IMAGES:
        found = import_hard_data(content, Grid(*CELLS.shape), TrainingImage(CELLS))
        data = found.hard_data
        assert data.n == (~HOLE).sum()
        assert np.array_equal(CELLS[tuple(data.cells.T)], data.facies)
        assert any("3" in note for note in found.notes)
        return
    values = read_grid(content)
    expected = CELLS * 100 if kind == "picture" else CELLS
    assert np.array_equal(np.isnan(values), HOLE)
    assert np.array_equal(values[~HOLE], expected[~HOLE])
    said = "3 of 48 pixels are transparent" if kind == "picture" else "3 of 48 cells have no value"
    with pytest.warns(UserWarning, match=said):
        image = read_training_image(content)
    assert image.known is not None
    assert np.array_equal(image.known, ~HOLE)


@pytest.mark.parametrize("code", CUSTOMARY_CODES)
@pytest.mark.parametrize("kind", ["f4", "f8"])
def test_a_code_is_known_within_the_precision_of_its_type(code, kind):
    stored = np.array([0, 1, code], kind)
    file = DataFile("any", "a", {"f": stored[None, None]})
    assert file.known(stored).tolist() == [True, True, False]
    assert f"({code:.9g} means unknown)" in file.unknown_note(stored)


@pytest.mark.parametrize("kind", ["vti", "tif", "nc", "npz"])
def test_nan_is_unknown(kind):
    pytest.importorskip({"tif": "rasterio", "nc": "xarray"}.get(kind, "numpy"))
    content = maps_as_bytes({"f": np.where(HOLE, np.nan, CELLS)}, Grid(*CELLS.shape), kind)
    assert inspect(BytesIO(content)).variables[0].n_known == 45
    assert np.array_equal(np.isnan(read_grid(BytesIO(content))), HOLE)


def declared_tiff() -> bytes:
    rasterio = pytest.importorskip("rasterio")
    size = {"height": 6, "width": 8, "count": 1, "dtype": "uint8", "nodata": 77}
    at = rasterio.Affine(10, 0, 0, 0, -10, 60)
    with rasterio.io.MemoryFile() as memory:
        with memory.open(driver="GTiff", transform=at, **size) as file:
            file.write(np.where(HOLE, 77, CELLS)[::-1].astype("u1"), 1)
        return memory.read()


def declared_netcdf() -> bytes:
    xarray = pytest.importorskip("xarray")
    array = xarray.DataArray(np.where(HOLE, np.nan, CELLS), dims=("y", "x"), name="facies")
    how = {"facies": {"dtype": "int16", "_FillValue": 77}}
    return bytes(array.to_dataset().to_netcdf(engine="scipy", encoding=how))


def declared_esri() -> bytes:
    rows = "\n".join(" ".join(map(str, row)) for row in np.where(HOLE, 77, CELLS)[::-1])
    return f"ncols 8\nnrows 6\ncellsize 1\nNODATA_value 77\n{rows}\n".encode()


def inactive_grdecl() -> bytes:
    words = [" ".join(map(str, v[::-1].ravel())) for v in (CELLS, (~HOLE).astype(int))]
    return f"SPECGRID\n8 6 1 1 F /\nFACIES\n{words[0]} /\nACTNUM\n{words[1]} /\n".encode()


@pytest.mark.parametrize(
    "written", [declared_tiff, declared_netcdf, declared_esri, inactive_grdecl]
)
def test_a_declared_code_is_unknown(written):
    values = read_grid(BytesIO(written()))
    assert np.array_equal(np.isnan(values), HOLE)
    assert np.array_equal(values[~HOLE], CELLS[~HOLE])


def tiff_of(cells: np.ndarray, step: float, mask: np.ndarray | None = None) -> BytesIO:
    """Return a GeoTIFF with rows from the south (a positive step) or the north."""
    rasterio = pytest.importorskip("rasterio")
    at = rasterio.Affine(10, 0, 500, 0, step, 100 if step > 0 else 160)
    size = {"height": 6, "width": 8, "count": 1, "dtype": "uint8", "transform": at}
    with rasterio.io.MemoryFile() as memory:
        with memory.open(driver="GTiff", **size) as file:
            file.write(cells.astype("u1"), 1)
            if mask is not None:
                file.write_mask(~mask)
        return BytesIO(memory.read())


def test_a_mask_of_a_tiff_marks_unknown_cells():
    values = read_grid(tiff_of(CELLS[::-1], -10, HOLE[::-1]))
    assert np.array_equal(np.isnan(values), HOLE)
    assert np.array_equal(values[~HOLE], CELLS[~HOLE])


@pytest.mark.parametrize("step", [10, -10])
def test_rows_of_a_tiff_go_where_its_coordinates_say(step):
    content = tiff_of(CELLS if step > 0 else CELLS[::-1], step)
    assert np.array_equal(read_grid(content), CELLS)
    assert read_geometry(content) == Grid(6, 8, (10.0, 10.0), (500.0, 100.0))
