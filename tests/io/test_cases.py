"""Test small files of kinds that users report as difficult; skipped if the folder is missing."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ccwsim import CCWSIMError, Grid, TrainingImage
from ccwsim.cli.program import main
from ccwsim.io import (
    fit_grid,
    guess_answers,
    import_hard_data,
    preview_wells,
    read_geometry,
    read_grid,
    read_points,
    read_realizations,
    read_training_image,
)

MAX_ANSWERS = 3
PLACED = Grid(30, 40, cell_size=(10.0, 10.0), origin=(350000.0, 4505000.0), crs="EPSG:32632")
TABLE = Grid(30, 40, cell_size=(10.0, 10.0))


@pytest.fixture(scope="module")
def cases(data_dir) -> Path:
    folder = data_dir.parent / "cases"
    if not folder.is_dir():
        pytest.skip("no folder of cases")
    return folder


@pytest.fixture(scope="module")
def truth(cases):
    return np.load(cases / "truth.npy")


def corner(n: int) -> np.ndarray:
    """Return the unknown cells: the first 4 columns of the 4 northern rows."""
    mask = np.zeros((30, 40), bool)
    mask[26:, :4] = True
    assert mask.sum() == n
    return mask


IMAGES = {
    "a06_nodata_null.asc": (16, None),
    "a07_nodata_-3.4e38.asc": (16, None),
    "r01_nodata255_uint8.tif": (16, PLACED),
    "r09_int32_zstd.tif": (0, PLACED),
    "n15_masked_-9999.npy": (8, None),
    "e01_facies.grdecl": (0, None),
    "s01_surfer6_ascii.grd": (0, Grid(30, 40)),
    "g01_sgems_named_size.gslib": (0, None),
    "g02_count_then_words.gslib": (0, None),
    "g11_crlf_ctrlz.gslib": (0, None),
    "m03_v4.mat": (0, None),
    "x01_netcdf3.nc": (0, None),
    "v01_pyvista_binary.vti": (0, None),
    "noextension": (0, None),
    "t03_matrix_pandas_index.csv": (0, None),
    "t04_matrix_names.csv": (0, None),
    "t05_matrix_trailing_comma.csv": (0, None),
    "t10_excel_sep_line.csv": (0, None),
    "t07_xyf_table.csv": (0, TABLE),
    "xyf_north_first.csv": (0, TABLE),
}
"""For each image, the number of unknown cells and the grid stated in the file, if any."""


@pytest.mark.parametrize("name", IMAGES)
def test_an_image_is_the_truth(cases, truth, name):
    n_unknown, grid = IMAGES[name]
    answers, asked = guess_answers(cases / name)
    assert len(asked) <= MAX_ANSWERS
    assert "crop" not in answers  # an image is used with its gap
    found = read_grid(cases / name, **answers)
    assert found.shape == truth.shape
    known = ~np.isnan(found)
    assert (~known).sum() == n_unknown
    assert np.array_equal(found[known], truth[known])
    if grid is not None:
        assert read_geometry(cases / name, **answers) == grid
    if n_unknown:
        with pytest.warns(UserWarning, match=f"{n_unknown} of 1200 cells have no value"):
            image = read_training_image(cases / name, **answers)
        assert np.array_equal(image.known, known)
        assert np.array_equal(image.array[known], truth[known])
    else:
        assert np.array_equal(read_training_image(cases / name, **answers).array, truth)


def test_names_of_a_matrix_are_names_of_facies(cases):
    assert read_training_image(cases / "t04_matrix_names.csv").facies_names == ("mud", "sand")


@pytest.mark.parametrize("name", ["p02_palette_transparent0.png", "p03_rgba_hole.png"])
def test_transparent_pixels_are_unknown(cases, truth, name):
    known = ~np.isnan(read_grid(cases / name))
    if name.startswith("p02"):
        assert np.array_equal(known, truth == 1)
    else:
        assert np.array_equal(~known, corner(16))
    with pytest.warns(UserWarning, match="pixels are transparent"):
        assert np.array_equal(read_training_image(cases / name).known, known)
    answers, asked = guess_answers(cases / name)
    assert "gaps" in asked
    assert read_training_image(cases / name, **answers).n_facies <= 2


def test_a_clipped_scene_has_no_facies_of_unknown_cells(cases):
    answers, _ = guess_answers(cases / "r12_clipped_scene_nodata255.tif")
    assert read_training_image(cases / "r12_clipped_scene_nodata255.tif", **answers).n_facies == 2


def test_a_picture_is_turned_as_its_camera_was(cases, truth):
    image = read_training_image(cases / "p09_exif_rotated.jpg", classes=2)
    shown = np.rot90(truth[::-1], -1)[::-1]  # rows from the south
    assert (image.array == 1 - shown).mean() > 0.95  # dark sand has the lower code


def test_pages_are_layers(cases):
    answers, asked = guess_answers(cases / "p12_two_pages.tif")
    assert asked == ("slice",)
    assert read_training_image(cases / "p12_two_pages.tif", **answers).shape == (2, 30, 40)


def test_a_format_that_is_not_read_is_named(cases):
    with pytest.raises(CCWSIMError, match=r"legacy VTK file; save it as \.vti"):
        read_training_image(cases / "v04_legacy_binary.vtk")


@pytest.mark.parametrize(
    ("name", "n"),
    [
        ("h02_one_based_cells.csv", 8),
        ("h16_bool_words.csv", 8),
        ("h22_title_row_above.csv", 8),
        ("q02_geojson_null_geometry.geojson", 8),
    ],
)
def test_points_have_the_facies_of_their_cells(cases, truth, name, n):
    data = import_hard_data(cases / name, Grid(30, 40), TrainingImage(truth)).hard_data
    assert data.n == n
    assert np.array_equal(truth[tuple(data.cells.T)], data.facies)


def test_a_row_without_coordinates_is_named(cases):
    points = read_points(cases / "q02_geojson_null_geometry.geojson")
    assert points.notes == ("Rows without coordinates, left out: 1 (feature 9).",)


def test_a_workbook_is_read(cases):
    assert read_points(cases / "h23_excel.xlsx").n == 2


def test_reservoir_cells_run_along_x_and_y_from_one(cases):
    points = read_points(cases / "h24_eclipse_ijk.csv")
    assert points.places.tolist() == [[9, 199], [89, 29]]
    assert points.notes[-1] == "Cells are counted from 1, because no number is 0."


@pytest.mark.parametrize("name", ["l02_wrapped.las", "l05_date_curve.las", "l07_stars.las"])
def test_a_well_log_has_depths_and_facies(cases, name):
    guess = preview_wells(cases / name, "intervals").guess
    assert guess == {"well": "well", "depth": "DEPT", "facies": "FACIES"}


def test_image_grid_and_wells_in_utm_meet(cases):
    answers, _ = guess_answers(cases / "facies_utm.tif")
    image = read_training_image(cases / "facies_utm.tif", **answers)
    grid = read_geometry(cases / "facies_utm.tif")
    assert (grid.crs, grid.cell_size) == ("EPSG:32632", (25.0, 25.0))
    points = read_points(cases / "wells_utm.csv")
    inside = grid.holds(grid.cells_of(*points.places.T))
    assert image.n_facies == 3
    assert (~inside).sum() == 2
    own = fit_grid(points, shape=(100, 100))  # the two distant points do not extend the grid
    assert (~own.holds(own.cells_of(*points.places.T))).sum() == 2


def test_an_image_in_utm_gives_realizations_in_utm(cases, tmp_path):
    pytest.importorskip("rasterio")
    pytest.importorskip("xarray")
    grid = read_geometry(cases / "facies_utm.tif", crop=(0, 0, 60, 60))
    files = {kind: tmp_path / f"out.{kind}" for kind in ("tif", "nc", "npz", "grdecl")}
    options = [
        "--crop",
        "0",
        "0",
        "60",
        "60",
        "--template",
        "16",
        "--overlap",
        "4",
        "--level",
        "1",
        "--quiet",
    ]
    outputs = [word for path in files.values() for word in ("--output", str(path))]
    assert main(["simulate", str(cases / "facies_utm.tif"), *options, *outputs]) == 0
    for kind, path in files.items():
        assert grid is not None
        kept = replace(grid, crs="") if kind == "grdecl" else grid
        assert read_realizations(path).grid == kept
