"""Test maps and realizations in formats of other programs, with their world coordinates."""

from __future__ import annotations

import base64
import sys
import zlib
from dataclasses import replace
from io import BytesIO
from xml.etree import ElementTree

import numpy as np
import pytest

import ccwsim.io as cio
from ccwsim import CCWSIMError, Grid, TrainingImage, metrics
from ccwsim.io.formats.vti import vti_as_bytes
from tests.io import sample_files as sample

E = sample.ensemble()
MAPS = metrics.etype(E).maps
X, Y = E.grid.axes


def vti(content: bytes) -> tuple[dict[str, str], dict[str, np.ndarray]]:
    """Return the attributes of the grid and the arrays of cells of a VTI file."""
    root = ElementTree.fromstring(content)
    assert root.attrib["compressor"] == "vtkZLibDataCompressor"
    (image,) = root
    assert image[0].attrib["Extent"] == image.attrib["WholeExtent"]
    nx, ny = (int(image.attrib["WholeExtent"].split()[k]) for k in (1, 3))
    found = {}
    for array in image.iter("DataArray"):
        text = array.text or ""
        n = int(np.frombuffer(base64.b64decode(text[:32])[:8], "<u8")[0])
        size = 4 * -(-8 * (3 + n) // 3)  # number of characters of the sizes
        sizes = np.frombuffer(base64.b64decode(text[:size]), "<u8").tolist()
        packed, at, raw = base64.b64decode(text[size:]), 0, b""
        for k, one in enumerate(sizes[3:]):
            block = zlib.decompress(packed[at : at + one])
            assert len(block) == (sizes[2] if k == n - 1 and sizes[2] else sizes[1])
            raw, at = raw + block, at + one
        kind = np.dtype(array.attrib["type"].lower()).newbyteorder("<")
        found[array.attrib["Name"]] = np.frombuffer(raw, kind).reshape(ny, nx)
    return image.attrib, found


def test_a_vtk_grid_has_cells_origin_and_spacing():
    grid, arrays = vti(cio.realizations_as_bytes(E, "vti"))
    assert grid["WholeExtent"] == "0 4 0 3 0 1"
    assert [float(v) for v in grid["Origin"].split()] == [350000, 4505000, 0]
    assert [float(v) for v in grid["Spacing"].split()] == [10, 20, 1]
    assert [*arrays] == ["realization_1", "realization_2"]
    np.testing.assert_array_equal(np.stack([*arrays.values()]), E.realizations)


@pytest.mark.slow
@pytest.mark.parametrize("n", [10, 362, 363, 1000])
def test_a_vtk_grid_of_many_blocks_has_every_cell(n):
    values = np.random.default_rng(n).normal(size=(n, n))
    _, arrays = vti(vti_as_bytes({'a "<&': values}, Grid(n, n)))
    np.testing.assert_array_equal(arrays['a "<&'], values)


def test_vtk_reads_a_vtk_grid(tmp_path):
    pyvista = pytest.importorskip("pyvista")
    cio.write_realizations(tmp_path / "out.vti", E)
    mesh = pyvista.read(tmp_path / "out.vti")
    assert mesh.bounds[:4] == (350000, 350040, 4505000, 4505060)
    assert mesh.spacing == (10, 20, 1)
    np.testing.assert_array_equal(mesh.cell_data["realization_2"].reshape(3, 4), E[1])


def test_a_geotiff_is_north_up_with_its_corner_and_cell_size(tmp_path):
    rasterio = pytest.importorskip("rasterio")
    cio.write_realizations(tmp_path / "out.tif", E)
    with rasterio.open(tmp_path / "out.tif") as file:
        assert tuple(file.bounds) == (350000, 4505000, 350040, 4505060)
        assert file.res == (10, 20)
        assert file.transform.e < 0
        assert file.descriptions == ("realization_1", "realization_2")
        np.testing.assert_array_equal(file.read()[:, ::-1], E.realizations)
        for row, column, facies in sample.POINTS:
            assert next(file.sample([(X[column], Y[row])]))[0] == facies


def test_netcdf_has_the_centres_of_cells_and_the_codes(tmp_path):
    xarray = pytest.importorskip("xarray")
    cio.write_realizations(tmp_path / "out.nc", E)
    with xarray.open_dataarray(tmp_path / "out.nc") as array:
        np.testing.assert_array_equal(array.values, E.realizations)
        assert array.attrs["flag_values"].tolist() == [0, 1, 2]
        assert array["realization"].values.tolist() == [3, 5]
        assert array.sel(x=350031, y=4505001, method="nearest").values.tolist() == [2, 0]


@pytest.mark.parametrize("kind", cio.MAP_FORMATS)
def test_an_e_type_is_written_in_every_format(kind, tmp_path):
    pytest.importorskip({"tif": "rasterio", "nc": "xarray"}.get(kind, "numpy"))
    path = tmp_path / f"etype.{kind}"
    cio.write_maps(path, MAPS, E.grid)
    names = [f"probability_{name}" for name in E.training_image.facies_names]
    names += ["most_likely", "most_likely_probability", "entropy"]
    assert [*MAPS] == names
    back = READERS[kind](path)
    assert [*back] == names
    for name in names:
        np.testing.assert_allclose(back[name], MAPS[name], atol=1e-6)


def bands(path) -> dict[str, np.ndarray]:
    import rasterio

    with rasterio.open(path) as file:
        return dict(zip(file.descriptions, file.read()[:, ::-1], strict=True))


def arrays(path) -> dict[str, np.ndarray]:
    with np.load(path) as saved:
        assert saved["origin"].tolist() == [350000, 4505000]
        return {name: saved[name] for name in saved.files if name in MAPS}


def columns(path) -> dict[str, np.ndarray]:
    assert cio.inspect(path).origin == E.grid.origin
    return {name: cio.read_grid(path, variable=name) for name in MAPS}


def variables(path) -> dict[str, np.ndarray]:
    import xarray

    with xarray.open_dataset(path) as data:
        np.testing.assert_array_equal(data["x"], X)
        return {str(name): data[name].values for name in data.data_vars}


def keywords(path) -> dict[str, np.ndarray]:
    short = [variable.name for variable in cio.inspect(path).variables]
    return {name: cio.read_grid(path, variable=k) for name, k in zip(MAPS, short, strict=True)}


READERS = {
    "grdecl": keywords,
    "npz": arrays,
    **dict.fromkeys(("gslib", "sgems", "dat"), columns),
    "vti": lambda path: vti(path.read_bytes())[1],
    "tif": bands,
    "nc": variables,
}


@pytest.mark.parametrize("codes", [(-5, 3, 200), (0, 300, 70_000), (-129, 0, 1)])
def test_codes_of_any_size_are_kept(codes, tmp_path):
    pytest.importorskip("rasterio")
    xarray = pytest.importorskip("xarray")
    own = np.array(codes)[sample.FACIES]
    for kind in ("vti", "tif", "nc"):
        cio.write_maps(tmp_path / f"a.{kind}", {"facies": own}, E.grid)
        assert (READERS[kind](tmp_path / f"a.{kind}")["facies"] == own).all()
    e = cio.read_realizations(BytesIO(sample.npy(own[None])))
    cio.write_realizations(tmp_path / "e.nc", e)
    with xarray.open_dataarray(tmp_path / "e.nc") as array:
        assert (array.values == own).all()


def test_a_code_that_does_not_exist_is_said_when_a_geotiff_is_written():
    pytest.importorskip("rasterio")
    grid = replace(E.grid, crs="EPSG:99999")
    elsewhere = replace(E, study=replace(E.study, grid=grid))
    with pytest.raises(CCWSIMError, match="crs = 'EPSG:99999' is unknown to GDAL"):
        cio.realizations_as_bytes(elsewhere, "tif")


@pytest.mark.parametrize(("kind", "package"), [("tif", "rasterio"), ("nc", "xarray")])
def test_a_package_that_is_missing_is_named(kind, package, monkeypatch):
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(CCWSIMError, match=f"{package}.*pip install"):
        cio.realizations_as_bytes(E, kind)
    with pytest.raises(CCWSIMError, match=f"{package}.*pip install"):
        cio.maps_as_bytes(MAPS, E.grid, kind)


@pytest.mark.parametrize(
    ("maps", "kind", "said"),
    [
        ({}, "vti", "no maps"),
        ({"a": np.zeros((4, 3))}, "vti", r"shape \(4, 3\)"),
        ({"a": np.zeros((3, 4), complex)}, "npz", "is not numeric"),
        ({"a\nb": np.zeros((3, 4))}, "gslib", "cannot be a map name"),
        ({"origin": np.zeros((3, 4))}, "npz", "rename"),
        ({"a": np.full((3, 4), 2**40)}, "tif", "below 2³¹"),
        ({"a": np.full((3, 4), 2**40)}, "nc", "below 2³¹"),
        ({"a": np.zeros((3, 4))}, "png", "cannot be written"),
    ],
)
def test_other_maps_are_refused_in_words(maps, kind, said):
    with pytest.raises(CCWSIMError, match=said):
        cio.maps_as_bytes(maps, E.grid, kind)


@pytest.mark.parametrize("kind", cio.MAP_FORMATS)
def test_names_of_users_break_no_file_of_an_e_type(kind):
    pytest.importorskip({"tif": "rasterio", "nc": "xarray"}.get(kind, "numpy"))
    odd = ['a/b "x"', "très fin\n<b>\0\u202e" + 50 * "y", "facies 2"]
    image = TrainingImage(E.training_image.array, facies_names=odd)
    maps = metrics.etype(replace(E, study=replace(E.study, training_image=image))).maps
    assert [*maps][2] == "probability_2"
    assert len(cio.maps_as_bytes(maps, E.grid, kind)) > 100


def test_facies_whose_names_are_not_distinct_are_named_by_codes():
    image = TrainingImage(E.training_image.array, facies_names=["sand", "sand\t", "clay"])
    maps = metrics.etype(replace(E, study=replace(E.study, training_image=image))).maps
    assert [*maps][:3] == ["probability_0", "probability_1", "probability_2"]
