"""Test that no file is silently read as a similar format or as one of several pictures."""

from __future__ import annotations

from io import BytesIO

import numpy as np
import pytest
from PIL import Image
from scipy.io import savemat

from ccwsim import CCWSIMError, Grid, TrainingImage
from ccwsim.io import (
    guess_answers,
    inspect,
    read_geometry,
    read_grid,
    read_points,
    read_training_image,
)
from tests.io.every_reader import CELLS

ROWS = [(10 * x + 5, 10 * y + 105, CELLS[y, x]) for y, x in np.ndindex(*CELLS.shape)]
XYZ = "\n".join("{:g} {:g} {:g}".format(*row) for row in ROWS[::-1])  # rows may be in any order
PLACED = Grid(6, 8, (10.0, 10.0), (0.0, 100.0))


@pytest.mark.parametrize("head", ["", "X Y Z\n", "x y facies\n", "# x y z\n"])
def test_xyz_goes_where_x_and_y_say(head):
    content = (head + XYZ + "\n").encode()
    answers, _ = guess_answers(BytesIO(content))
    assert np.array_equal(read_training_image(BytesIO(content), **answers).array, CELLS)
    assert read_geometry(BytesIO(content), **answers) == PLACED


def test_three_columns_that_are_no_places_are_a_matrix():
    matrix = np.arange(60).reshape(20, 3) % 2
    text = "\n".join(" ".join(map(str, row)) for row in matrix) + "\n"
    assert np.array_equal(read_grid(BytesIO(text.encode())), matrix[::-1])


def test_matlab_and_netcdf_in_hdf5_are_told_apart(tmp_path):
    h5py = pytest.importorskip("h5py")
    xarray = pytest.importorskip("xarray")
    pytest.importorskip("h5netcdf")
    matlab = tmp_path / "ti.mat"
    with h5py.File(matlab, "w", userblock_size=512) as file:
        array = file.create_dataset("ti", data=CELLS.T.astype(float))
        array.attrs["MATLAB_class"] = np.bytes_("double")
    head = b"MATLAB 7.3 MAT-file, Platform: PCWIN64"
    matlab.write_bytes(head + matlab.read_bytes()[len(head) :])
    place = {"y": 10.0 * np.arange(6)[::-1] + 105, "x": 10.0 * np.arange(8) + 5}
    cells = xarray.DataArray(CELLS[::-1].astype("i2"), place, ("y", "x"), name="facies")
    cells.to_dataset().to_netcdf(tmp_path / "ti.nc", engine="h5netcdf")
    kinds = {"ti.mat": "MATLAB 7.3 file", "ti.nc": "NetCDF file"}
    for name, kind in kinds.items():
        assert inspect(tmp_path / name).kind == kind
        assert np.array_equal(read_grid(tmp_path / name), CELLS)
    assert read_geometry(tmp_path / "ti.nc") == PLACED


def pictures(format: str) -> BytesIO:
    pages = [Image.fromarray((CELLS[::-1] * 100 + k).astype(np.uint8)) for k in range(3)]
    content = BytesIO()
    pages[0].save(content, format, save_all=True, append_images=pages[1:])
    return content


def test_pages_of_a_tiff_are_layers():
    pytest.importorskip("rasterio")
    with pytest.raises(CCWSIMError, match="3 slices; choose one"):
        read_training_image(pictures("TIFF"))
    assert read_training_image(pictures("TIFF"), volume=True, classes="codes").shape == (3, 6, 8)


@pytest.mark.parametrize("format", ["GIF", "PNG"])
def test_frames_are_never_the_first_in_silence(format):
    with pytest.raises(CCWSIMError, match="has 3 frames; save one frame as PNG, or all"):
        read_training_image(pictures(format))


def test_a_camera_turns_the_picture():
    turned = Image.fromarray(np.rot90((CELLS[::-1] * 100).astype(np.uint8), 1))
    exif = Image.Exif()
    exif[0x0112] = 6  # rotate by 90 degrees clockwise
    content = BytesIO()
    turned.save(content, "PNG", exif=exif)
    assert np.array_equal(read_training_image(content).array, CELLS)


@pytest.mark.parametrize("ending", ["gpkg", "shz"])
def test_a_null_geometry_is_a_row_left_out(ending, tmp_path):
    pytest.importorskip("pyogrio")
    from pyogrio import raw

    point = np.array([1, 1, 0, 0, 0], np.uint8).tobytes()
    places = np.array([(5.5, 2.5), (6.5, 3.5)])
    shapes = np.array([point + places[0].tobytes(), None, point + places[1].tobytes()], object)
    path = tmp_path / f"wells.{ending}"
    columns = {"field_data": [np.array([0, 1, 1])], "fields": ["facies"], "crs": "EPSG:32632"}
    raw.write(path, shapes, geometry_type="Point", **columns)
    points = read_points(path)
    assert points.places.tolist() == places.tolist()
    assert points.notes == ("Rows without coordinates, left out: 1 (feature 2).",)


@pytest.mark.parametrize("kind", ["f8", "f4", "i4", "u1"])
def test_matrices_of_matlab_4_have_any_type(kind):
    content = BytesIO()
    savemat(content, {"note": "a text", "ti": CELLS.astype(kind)}, format="4")
    assert np.array_equal(read_grid(content), CELLS)


def test_depths_of_a_netcdf_count_down():
    xarray = pytest.importorskip("xarray")
    volume = np.stack([CELLS, 1 + CELLS])
    depth = ("z", [5.0, 15.0], {"positive": "down"})
    cells = xarray.DataArray(volume, {"z": depth}, ("z", "y", "x"))
    image = TrainingImage.of(cells)
    assert np.array_equal(image.array, volume[::-1])
    content = BytesIO(bytes(cells.to_dataset(name="facies").to_netcdf(engine="scipy")))
    assert np.array_equal(read_training_image(content, volume=True).array, volume[::-1])
    grid = read_geometry(content, volume=True)
    assert grid is not None
    assert (grid.cell_size[2], grid.origin[2]) == (10.0, -20.0)


def test_an_asterisk_in_grass_ascii_is_unknown():
    pytest.importorskip("rasterio")
    rows = "\n".join(" ".join(map(str, row)) for row in CELLS[::-1]).replace("2", "*")
    head = "north: 6\nsouth: 0\neast: 8\nwest: 0\nrows: 6\ncols: 8\n"
    values = read_grid(BytesIO(f"{head}{rows}\n".encode()))
    assert np.array_equal(np.isnan(values), CELLS == 2)
