"""Test that every written format is read back with its cells, cell size, origin and CRS."""

from __future__ import annotations

from dataclasses import replace
from io import BytesIO

import numpy as np
import pytest

import ccwsim
import ccwsim.io as cio
from ccwsim import Ensemble, Grid, HardData, Parameters, TrainingImage
from ccwsim.io import maps, realizations, training_images
from ccwsim.io.data_file import printable
from ccwsim.io.formats.rasters import code_and_wkt
from ccwsim.io.hard_data.files import HARD_DATA_FORMATS as HARD_FORMATS
from ccwsim.model.study import Study

IMAGE = TrainingImage([[0, 5, -3], [5, 0, 0]], facies_names=["lime", "mud", "sand"])
MAP = Grid(3, 4, (10.0, 20.0), (350000.0, 4505000.0), crs="EPSG:32632")
VOLUME = Grid(3, 4, (10.0, 20.0, 2.5), (350000.0, 4505000.0, -1200.0), nz=2, crs="EPSG:32632")
KEEP_CRS = ("npz", "tif", "nc")
"""Formats that contain a coordinate system."""
NO_VOLUMES = ("tif", "png")


def grids_of(kind: str) -> list[Grid]:
    return [MAP] if kind in NO_VOLUMES else [MAP, VOLUME]


def ensemble_of(grid: Grid, n: int = 2) -> Ensemble:
    image = IMAGE if grid.nz is None else TrainingImage(IMAGE.array[None])
    indices = np.random.default_rng(3).integers(0, 3, (n, *grid.shape)).astype(np.uint8)
    status, cpu = np.zeros((n, 0), np.int16), np.ones(n)
    study = Study(image, grid, seed=7, checked=False)
    return Ensemble(study, indices, cpu, 0.5, status, np.arange(n))


def of_grid(grid: Grid, kind: str) -> Grid:
    """Return the grid that a format stores."""
    return grid if kind in KEEP_CRS else replace(grid, crs="")


@pytest.mark.parametrize("kind", realizations.REALIZATION_FORMATS)
def test_realizations_are_read_back(kind):
    for grid in grids_of(kind):
        ensemble = ensemble_of(grid, 1 if kind == "png" else 2)
        content = BytesIO(cio.realizations_as_bytes(ensemble, kind))
        if kind == "png":  # colours are numbered as facies
            picture = cio.read_training_image(content, classes="codes")
            assert np.array_equal(picture.array, ensemble.indices[0])
            continue
        back = cio.read_realizations(content, ensemble.training_image)
        assert np.array_equal(back.realizations, ensemble.realizations)
        assert back.grid == of_grid(grid, kind)
        assert (back.seed, back.revised) == ((7, False) if kind == "npz" else (0, True))


@pytest.mark.parametrize("grid", [MAP, VOLUME])
def test_realizations_on_disk_are_read_back(grid, tmp_path):
    wide = TrainingImage(np.tile(IMAGE.array, (6, 6)) if grid.nz is None else np.ones((4, 12, 12)))
    size = Parameters(template_size=4, overlap_size=1, wavelet_level=0)
    out = tmp_path / "run.npy"
    ensemble = ccwsim.simulate(wide, grid, size, n_realizations=2, out=out)
    back = cio.read_realizations(out, wide)
    assert np.array_equal(back.realizations, ensemble.realizations)


@pytest.mark.parametrize("kind", maps.MAP_FORMATS)
def test_maps_are_read_back(kind):
    for grid in grids_of(kind):
        cells = np.arange(np.prod(grid.shape)).reshape(grid.shape)
        given = {"facies": cells % 3, "probability of sand": cells / 32}
        content = cio.maps_as_bytes(given, grid, kind)
        names = [variable.name for variable in cio.inspect(BytesIO(content)).variables]
        assert len(names) == 2
        for name, expected in zip(names, given.values(), strict=True):
            how = {"variable": name, "volume": grid.nz is not None}
            assert np.allclose(cio.read_grid(BytesIO(content), **how), expected, atol=1e-6)
            assert cio.read_geometry(BytesIO(content), **how) == of_grid(grid, kind)


@pytest.mark.parametrize("kind", training_images.IMAGE_FORMATS)
def test_training_images_are_read_back(kind):
    for image in (IMAGE, TrainingImage(np.arange(24).reshape(2, 3, 4) % 3)):
        volume = image.n_dimensions == 3
        if volume and kind in NO_VOLUMES:
            continue
        content = cio.training_image_as_bytes(image, kind)
        back = cio.read_training_image(BytesIO(content), volume=volume)
        expected = image.indices if kind == "png" and image.codes[0] < 0 else image.array
        assert np.array_equal(back.array, expected)


@pytest.mark.parametrize("kind", HARD_FORMATS)
def test_hard_data_are_read_back(kind):
    for grid, cells in ((MAP, [[0, 3], [2, 1]]), (VOLUME, [[1, 0, 3], [0, 2, 1]])):
        image = IMAGE if grid.nz is None else TrainingImage(IMAGE.array[None])
        data = HardData(cells, [5, -3])
        content = cio.hard_data_as_bytes(data, kind, grid)
        assert cio.read_hard_data(BytesIO(content), grid, image).triples == data.triples


EVIL = (
    "=1+1\n9 9 9\n\"'`<b onload=x>,;\t",
    "-5 /\n/\x1a\x00END",
    "</VTKFile>]]>&lt;%n{x}$x$",
)
"""Names that could end a line, a record, a tag or a text."""


@pytest.mark.parametrize("kind", realizations.REALIZATION_FORMATS)
def test_names_of_users_break_no_file_of_realizations(kind):
    for grid in grids_of(kind):
        ensemble = ensemble_of(grid, 1)
        array = ensemble.training_image.array
        image = TrainingImage(array, name=EVIL[0], facies_names=EVIL)
        ensemble = replace(ensemble, study=replace(ensemble.study, training_image=image))
        content = BytesIO(cio.realizations_as_bytes(ensemble, kind))
        if kind == "png":
            picture = cio.read_training_image(content, classes="codes")
            assert np.array_equal(picture.array, ensemble.indices[0])
        else:
            back = cio.read_realizations(content, image)
            assert np.array_equal(back.realizations, ensemble.realizations)


@pytest.mark.parametrize("kind", maps.MAP_FORMATS)
def test_names_of_users_break_no_file_of_maps(kind):
    for grid in grids_of(kind):
        cells = np.arange(np.prod(grid.shape)).reshape(grid.shape) % 7
        given = {printable(name): cells + k for k, name in enumerate(EVIL)}
        content = cio.maps_as_bytes(given, grid, kind)
        names = [variable.name for variable in cio.inspect(BytesIO(content)).variables]
        assert len(names) == len(EVIL)
        for k, name in enumerate(names):
            how = {"variable": name, "volume": grid.nz is not None}
            assert np.array_equal(cio.read_grid(BytesIO(content), **how), cells + k)


@pytest.mark.parametrize("kind", training_images.IMAGE_FORMATS)
def test_names_of_users_break_no_file_of_an_image(kind):
    image = TrainingImage(IMAGE.array + 3, name=EVIL[1], facies_names=EVIL)
    content = cio.training_image_as_bytes(image, kind)
    assert np.array_equal(cio.read_training_image(BytesIO(content)).array, image.array)


def test_parameters_are_read_back():
    parameters = Parameters(template_size=24, wavelet_level=1)
    assert cio.parameters_from_json(cio.parameters_to_json(parameters)) == parameters


def test_a_coordinate_system_is_known_by_its_code():
    rasterio = pytest.importorskip("rasterio")
    assert code_and_wkt(rasterio.crs.CRS.from_epsg(32632).to_wkt())[0] == "EPSG:32632"


def test_gdal_finds_the_coordinate_system_of_netcdf(tmp_path):
    rasterio = pytest.importorskip("rasterio")
    path = tmp_path / "facies.nc"
    cio.write_maps(path, {"facies": np.eye(3, 4)}, MAP)
    try:
        opened = rasterio.open(path)
    except rasterio.errors.RasterioIOError:
        pytest.skip("GDAL without NetCDF")
    with opened as file:
        assert file.crs.to_string() == "EPSG:32632"


def test_an_image_in_utm_is_written_in_utm():
    pytest.importorskip("rasterio")
    tif = cio.maps_as_bytes({"facies": np.arange(12).reshape(3, 4) % 2}, MAP, "tif")
    grid = cio.read_geometry(BytesIO(tif))
    assert grid is not None
    assert grid == MAP
    for kind in KEEP_CRS:
        again = cio.maps_as_bytes({"facies": np.zeros(MAP.shape)}, grid, kind)
        assert cio.read_geometry(BytesIO(again)) == grid


@pytest.mark.parametrize("kind", HARD_FORMATS)
@pytest.mark.parametrize("grid", [MAP, VOLUME])
def test_names_of_users_break_no_file_of_hard_data(kind, grid):
    array = IMAGE.array if grid.nz is None else IMAGE.array[None]
    image = TrainingImage(array, name=EVIL[0], facies_names=EVIL)
    data = HardData([[1, 0, 3], [0, 2, 1]] if grid.nz else [[0, 3], [2, 1]], [5, -3])
    content = BytesIO(cio.hard_data_as_bytes(data, kind, grid))
    assert cio.read_hard_data(content, grid, image).triples == data.triples


@pytest.mark.parametrize("kind", training_images.IMAGE_FORMATS)
def test_names_of_users_break_no_file_of_a_training_image(kind):
    image = TrainingImage(IMAGE.array, name=EVIL[0], facies_names=EVIL)
    content = BytesIO(cio.training_image_as_bytes(image, kind))
    back = cio.read_training_image(content, volume=False)
    assert np.array_equal(back.array, image.indices if kind == "png" else image.array)
