"""Test the files for MODFLOW 6 and Eclipse, cell by cell at world coordinates."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ccwsim import CCWSIMError, Grid, io
from ccwsim.flow import darcy
from tests.flow.test_flow import ensemble

VALUES = {"mud": 1e-6, "sand": 1e-3}
VOLUME = Grid(4, 5, (10.0, 20.0, 0.5), (1000.0, 2000.0, -30.0), nz=3)
MAP = Grid(4, 5, (10.0, 20.0), (1000.0, 2000.0))


@pytest.mark.parametrize("grid", [MAP, VOLUME])
def test_flopy_loads_the_model_with_each_cell_in_place(tmp_path, grid):
    flopy = pytest.importorskip("flopy")
    e, well = ensemble(2, grid.shape, grid), (*[1] * (grid.n_dimensions - 1), 2)
    options = {"west_east": (2.0, 1.0), "wells": {well: -1e-6}, "anisotropy": 0.1}
    io.to_flopy(e, VALUES, tmp_path, realization=1, **options)
    model = flopy.mf6.MFSimulation.load(sim_ws=str(tmp_path), verbosity_level=0).get_model()
    placed = model.modelgrid
    k = model.npf.k.array
    for layer, row, column in np.ndindex(k.shape):
        at = [placed.xcellcenters[row, column], placed.ycellcenters[row, column]]
        if grid.nz is not None:
            at.append(placed.zcellcenters[layer, row, column])
        (cell,) = grid.cells_of(*([v] for v in at))
        per_day = 86400 * e.property(VALUES)[1][tuple(cell)]
        assert k[layer, row, column] == pytest.approx(per_day, rel=1e-9)
    heads = darcy(e.property(VALUES)[1], grid, **options).heads
    found = model.ic.strt.array[::-1, ::-1]
    np.testing.assert_allclose(found.reshape(grid.shape), heads, rtol=1e-5)
    assert_balanced(model, heads.reshape(found.shape), k[::-1, ::-1])


def assert_balanced(model, heads, k) -> None:
    """Check that the heads solve the equations of the packages as MODFLOW 6 assembles them."""
    dx, dy = model.dis.delr.array[0], model.dis.delc.array[0]
    edges = np.concatenate([[model.dis.top.array[0, 0]], model.dis.botm.array[:, 0, 0]])
    dz = -np.diff(edges)[0]
    vertical = model.npf.k33.array[::-1, ::-1]
    rest = np.zeros(heads.shape)
    for axis, (own, factor) in enumerate(
        ((vertical, dx * dy / dz), (k, dx * dz / dy), (k, dy * dz / dx))
    ):
        low, high = np.delete(own, -1, axis), np.delete(own, 0, axis)
        flow = -factor * 2 * low * high / (low + high) * np.diff(heads, axis=axis)
        rest -= np.diff(flow, axis=axis, prepend=0, append=0)
    nz, ny, _ = heads.shape
    scale = 0.0
    for (z, y, x), head, conductance, *_ in model.ghb.stress_period_data.get_data(0):
        cell = nz - 1 - z, ny - 1 - y, x
        inflow = conductance * (head - heads[cell])
        rest[cell] += inflow
        scale += abs(inflow)
    for (z, y, x), rate, *_ in model.wel.stress_period_data.get_data(0):
        rest[nz - 1 - z, ny - 1 - y, x] += rate
    assert np.abs(rest).max() < 1e-6 * scale


@pytest.mark.parametrize("grid", [MAP, VOLUME])
def test_another_program_reads_the_grdecl_cell_for_cell(tmp_path, grid):
    pyvista = pytest.importorskip("pyvista")
    e = ensemble(2, grid.shape, grid)
    geometry, *written = io.write_grdecl(tmp_path / "grid.grdecl", e, VALUES)
    names = ["grid_1.inc", "grid_1_facies.inc", "grid_2.inc", "grid_2_facies.inc"]
    assert [f.name for f in written] == names
    second = written[2]
    both = tmp_path / "both.GRDECL"
    both.write_bytes(geometry.read_bytes() + second.read_bytes())
    mesh = pyvista.read_grdecl(both, elevation=True)
    at = mesh.cell_centers().points[:, : grid.n_dimensions].T
    cells = tuple(grid.cells_of(*at).T)
    wanted = io.millidarcy(np.asarray(e.property(VALUES)))[1][cells]
    np.testing.assert_allclose(mesh.cell_data["PERMX"], wanted, rtol=1e-5)
    np.testing.assert_allclose(mesh.cell_data["PERMZ"], wanted, rtol=1e-5)


def test_bad_hand_over_is_one_sentence(tmp_path):
    pytest.importorskip("flopy")
    e = ensemble(1, MAP.shape, MAP)
    with pytest.raises(CCWSIMError, match="choose one of grdecl"):
        io.write_grdecl(tmp_path / "grid.txt", e, VALUES)
    with pytest.raises(CCWSIMError, match="unit"):
        io.write_grdecl(tmp_path / "grid.grdecl", e, VALUES, unit="cm/s")
    with pytest.raises(CCWSIMError, match="no head"):
        io.to_flopy(e, VALUES, tmp_path)
    with pytest.raises(CCWSIMError, match="realization"):
        io.to_flopy(e, VALUES, tmp_path, realization=3, west_east=(1, 0))
    (tmp_path / "file").touch()
    for folder in (tmp_path / "file", tmp_path / "file" / "below", tmp_path / ("a" * 10_000)):
        with pytest.raises(CCWSIMError, match="cannot be written") as caught:
            io.to_flopy(e, VALUES, folder, west_east=(1, 0))
        assert len(str(caught.value)) < 1000
    with pytest.raises(CCWSIMError, match="workspace = None"):
        io.to_flopy(e, VALUES, None, west_east=(1, 0))


def test_models_hold_heads_that_vary_along_a_side_and_no_inactive_cell(tmp_path):
    flopy = pytest.importorskip("flopy")
    e = ensemble(1, VOLUME.shape, VOLUME)
    active = np.random.default_rng(6).random(VOLUME.shape) < 0.8
    indices = np.where(active, e.indices, 255).astype(np.uint8)
    west = np.arange(12.0).reshape(3, 4)
    sides = {"west_east": (west, 1.0), "south_north": (None, 2.0)}
    io.to_flopy(replace(e, indices=indices), VALUES, tmp_path, **sides)
    model = flopy.mf6.MFSimulation.load(sim_ws=str(tmp_path), verbosity_level=0).get_model()
    rows = [tuple(row)[:3] for row in model.ghb.stress_period_data.get_data(0)]
    k = 86400 * e.property(VALUES)[0]
    wanted = []
    for z, y, x in np.argwhere(active):
        cell = 2 - z, 3 - y, x
        if x == 0:
            wanted.append((cell, west[z, y], 2 * k[z, y, x] * 20 * 0.5 / 10))
        if x == 4:
            wanted.append((cell, 1.0, 2 * k[z, y, x] * 20 * 0.5 / 10))
        if y == 3:
            wanted.append((cell, 2.0, 2 * k[z, y, x] * 10 * 0.5 / 20))
    assert [r[0] for r in sorted(rows)] == [r[0] for r in sorted(wanted)]
    for row, other in zip(sorted(rows), sorted(wanted), strict=True):
        assert row[1:] == pytest.approx(other[1:], rel=1e-8)


@pytest.mark.parametrize(("crs", "metres"), [("EPSG:2226", 0.3048006096), ("EPSG:8065", 0.3048)])
def test_a_grid_in_feet_gives_a_model_in_feet(tmp_path, crs, metres):
    pytest.importorskip("rasterio")
    pytest.importorskip("flopy")
    in_feet = Grid(4, 5, (100.0, 50.0), (6306015.0, 1982413.0), crs=crs)
    in_metres = replace(in_feet, cell_size=(100 * metres, 50 * metres), origin=(0, 0), crs="")
    options = {"west_east": (2.0, 1.0), "wells": {(1, 2): -1e-6}}
    e = ensemble(1, in_feet.shape, in_feet)
    model = io.to_flopy(e, VALUES, tmp_path / "feet", **options).get_model()
    assert model.dis.length_units.array == "feet"
    assert model.dis.delr.array.tolist() == [100.0] * 5
    k = 86400 * e.property(VALUES)[0] / metres
    np.testing.assert_allclose(model.npf.k.array[0, ::-1], k)
    # the same model in metres, with heads and thickness of the same number of metres
    scaled = {"west_east": (2 * metres, metres), "wells": {(1, 2): -1e-6}, "thickness": metres}
    e = ensemble(1, in_metres.shape, in_metres)
    other = io.to_flopy(e, VALUES, tmp_path / "metres", **scaled).get_model()
    assert other.dis.length_units.array == "meters"
    np.testing.assert_allclose(model.ic.strt.array * metres, other.ic.strt.array, rtol=1e-6)


@pytest.mark.parametrize("crs", ["EPSG:4326", "EPSG:4258", "WGS84"])
def test_degrees_are_refused_with_the_remedy(tmp_path, crs):
    pytest.importorskip("rasterio")
    pytest.importorskip("flopy")
    grid = Grid(4, 5, (1e-3, 1e-3), (9.0, 37.9), crs=crs)
    e = ensemble(1, grid.shape, grid)
    for write in (
        lambda: io.to_flopy(e, VALUES, tmp_path, west_east=(1, 0)),
        lambda: io.write_grdecl(tmp_path / "g.grdecl", e, VALUES),
    ):
        with pytest.raises(CCWSIMError, match=r"degrees.*UTM"):
            write()
    assert not [*tmp_path.iterdir()]
