"""Test small files whose meaning is easily misread; skipped if the folder is missing."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from ccwsim import Auxiliary, CCWSIMError, Grid, Secondary, TrainingImage, datasets
from ccwsim.io import (
    angles_along,
    import_hard_data,
    import_wells,
    inspect,
    read_active,
    read_geometry,
    read_lines,
    read_probabilities,
    read_training_image,
    read_values,
)

GRID = Grid(40, 60, (25, 25), (500000, 4200000), crs="EPSG:32632")
VOLUME = Grid(4, 5, (25, 25, 5), (500000, 4200000, -1600), nz=4, crs="EPSG:32632")
UNPLACED = Grid(128, 128)


@pytest.fixture(scope="module")
def folder(data_dir) -> Path:
    path = data_dir.parent / "cases" / "second"
    if not path.is_dir():
        pytest.skip("no second folder of cases")
    return path


@pytest.fixture(scope="module")
def image() -> TrainingImage:
    return datasets.load("channels")


def files(folder: Path, *patterns: str) -> list[Path]:
    found = sorted(path for pattern in patterns for path in folder.glob(pattern))
    assert found
    return found


def curve(path: Path) -> np.ndarray:
    return np.asarray(read_probabilities(path, VOLUME)["sand"]).reshape(4, -1)[:, 0]


def test_directions(folder):
    truth = np.load(folder / "grd_truth.npy")
    for path in files(folder, "g2[0-9]_*.grdecl", "g3*.grdecl"):
        found = read_training_image(path, volume=True).array
        np.testing.assert_array_equal(found, truth, err_msg=path.name)
    for name, truth in (("r35_rot180", "r_truth"), ("r40_rot180_small", "r39_truth")):
        found = read_training_image(folder / f"{name}.tif").array
        np.testing.assert_array_equal(found, np.load(folder / f"{truth}.npy"))
    zones = read_values(folder / "q03_zones_xflip.tif", GRID)
    np.testing.assert_array_equal(zones, np.broadcast_to(np.arange(60) > 30, GRID.shape))


def test_vertical_axes(folder):
    for path in files(folder, "v0*.nc"):
        found = read_training_image(path, volume=True).array
        np.testing.assert_array_equal(found, np.load(folder / "v_truth.npy"))
    top = np.load(folder / "r_truth.npy")
    found = read_training_image(folder / "r13_3d_z_down.nc", volume=True).array
    np.testing.assert_array_equal(found, np.stack([top, 0 * top + 1, 0 * top])[::-1])
    for path in files(folder, "c02*", "c05*", "c07*"):
        np.testing.assert_allclose(curve(path), [0.1, 0.2, 0.3, 0.4])


def test_masks(folder, image):
    outer, piece = np.load(folder / "m_outer.npy"), np.zeros((128, 128), bool)
    piece[20:100, 30:110] = True
    rights = {
        **dict.fromkeys(("b01*", "b04*", "b11*", "b12*", "b14*"), (UNPLACED, piece)),
        **dict.fromkeys(("m05*", "m32*", "m36*", "m42*"), (GRID, outer)),
        "m23_poly.shp": (GRID, np.load(folder / "m_hole.npy")),
    }
    for pattern, (grid, right) in rights.items():
        for path in files(folder, pattern):
            active = Secondary(active=read_active(path, grid)).fitted(grid, image).active
            np.testing.assert_array_equal(active, right, err_msg=path.name)


ADVICE = {
    "m34*": "do not say which cells are inactive",
    "m51*": "do not say which cells are inactive",
    "m07*": "x from .* but the grid has x from 500000 to 501500",
    "m20*": "x from .* but the grid has x from 500000 to 501500",
    "m22*": "save an outline as a polygon in GeoJSON",
    "m40*": "EPSG:32633.*EPSG:32632",
}


@pytest.mark.parametrize("pattern", ADVICE)
def test_advice_on_masks(folder, image, pattern):
    for path in files(folder, pattern):
        with pytest.raises(CCWSIMError, match=ADVICE[pattern]):
            Secondary(active=read_active(path, GRID)).fitted(GRID, image)


def test_places(folder):
    for name in ("p02_other_crs.tif", "p39_rotated.tif"):
        with pytest.raises(CCWSIMError, match=r"but (the grid has|those of the grid)"):
            read_probabilities(folder / name, GRID, "sand")
    for name in ("c03_other_z.csv", "q05_cube_other_z.sgems"):
        with pytest.raises(CCWSIMError, match=r"z .*from .* grid"):
            read_probabilities(folder / name, VOLUME)
    with pytest.raises(CCWSIMError, match="EPSG:25833"):
        read_values(folder / "q02_zones_other_crs.tif", GRID)
    with pytest.raises(CCWSIMError, match="does not reach the grid"):
        angles_along(read_lines(folder / "l04_outside.geojson"), GRID)
    assert len(read_lines(folder / "l06_utf16.geojson")) == 1


def test_values(folder, image):
    found = read_values(folder / "a01_minus99.tif", GRID)
    np.testing.assert_array_equal(found, np.load(folder / "a01_truth.npy"))
    for path, grid in (("a12_angles_with_m99.tif", GRID), ("a14_depth_m99.sgems", Grid(40, 60))):
        assert np.isfinite(read_values(folder / path, grid)).all()
    with pytest.warns(UserWarning, match="look like radians"):
        Secondary(angle=read_values(folder / "a03_radians.tif", GRID)).fitted(GRID, image)


def test_values_outside_the_mask(folder, image):
    active, of_image = (np.load(folder / f"{k}.npy") for k in ("o_active", "o01_aux_of_image"))
    (zones,), (angle,) = files(folder, "o04*"), files(folder, "o08*")
    guides = [
        *({"auxiliary": Auxiliary(of_image, read_values(k, GRID))}
          for k in files(folder, "o0[12]*.tif")),
        {"zones": read_values(zones, GRID), "images": [image]},
        {"angle": read_values(angle, GRID)},
        {"probabilities": read_probabilities(folder / "o06_prob_outside.tif", GRID)},
    ]  # fmt: skip
    for guide in guides:
        Secondary(active=active, **guide).fitted(GRID, image)


def test_grids_of_reservoir_programs(folder):
    for path in files(folder, "z0*.zmap"):
        size, corner = (
            (12.5, (499993.75, 4199993.75)) if "z09" in path.name else (50, (499975, 4199975))
        )
        found = read_training_image(path).array
        np.testing.assert_array_equal(found, np.load(folder / "z_truth.npy"), err_msg=path.name)
        assert read_geometry(path) == Grid(20, 31, (size, size), corner), path.name
    for path in files(folder, "g08*", "g10*", "g5[13]*"):
        with pytest.warns(UserWarning, match="5 of 288 cells have no value"):
            found = read_training_image(path, volume=True)
        assert found.codes.tolist() == [0, 1, 2], path.name
    read_training_image(folder / "g56_coord_first.grdecl", volume=True)
    for name, said in (("g04_include", "FACIES.dat"), ("g06_property_only", "no SPECGRID")):
        with pytest.raises(CCWSIMError, match=said):
            read_training_image(folder / f"{name}.grdecl")


def test_tables(folder, image):
    right = sorted(json.loads((folder / "x_truth.json").read_text()))
    for path in files(folder, "n*.csv", "x*.xlsx"):
        data = import_hard_data(path, GRID, image).hard_data
        rows = np.column_stack([data.cells, data.facies]).tolist()
        assert sorted(rows) == right, path.name
    for path in files(folder, "las*.las"):
        counts = {v.name: v.n_known for v in inspect(path).variables}
        assert counts == {"DEPT": 5, "GR": 4, "FACIES": 5}, path.name
    wells = Grid(40, 40, (5, 5, 5), (0, 0, -100), nz=24)
    volume = TrainingImage(np.indices((8, 8, 8)).sum(axis=0) % 2)
    data = import_wells(folder / "w01_xcollar.csv", folder / "w_intervals.csv", wells, volume)
    assert data.hard_data.n == 16
    assert {*map(tuple, data.hard_data.cells[:, 1:].tolist())} == {(20, 20)}


def test_attributes_of_netcdf(folder):
    path = folder / "r12_cf_grid_mapping.nc"
    assert read_geometry(path).crs == "EPSG:32632"
