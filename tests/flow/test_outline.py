"""Test heads along the outline of active cells against a direct solution and exact properties."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import ndimage, sparse
from scipy.sparse.linalg import spsolve

from ccwsim import CCWSIMError, Ensemble, Grid, Secondary, flow, io
from ccwsim.cli.program import main
from ccwsim.flow import Edge, darcy, starts_at_inflow, tracks
from ccwsim.flow.answers import usual_heads
from ccwsim.flow.tracks import LEFT_GRID, STUCK
from ccwsim.sharing.choices import FlowChoice
from ccwsim.ui.flow.solving import flow_settings, solution
from tests.flow.test_flow import ensemble

GRID = Grid(60, 80, (100.0, 100.0), (844000.0, 6521500.0))
VALUES = {"mud": 1e-7, "sand": 1e-4}


def catchment(n: int = 2) -> Ensemble:
    """Return realizations within an outline that touches no side of the grid, with a hole."""
    e = ensemble(n, GRID.shape, GRID)
    rows, columns = np.indices(GRID.shape)
    angle = np.arctan2(rows - 30, columns - 40)
    radius = np.hypot((columns - 40) / 37, (rows - 30) / 28)
    active = radius < 1 + 0.04 * np.sin(3 * angle)
    active[25:29, 50:54] = False
    indices = np.where(active, e.indices, 255).astype(np.uint8)
    return replace(e, indices=indices, study=replace(e.study, secondary=Secondary(active=active)))


def outside_of(part: np.ndarray) -> np.ndarray:
    """Return the cells outside a part, by a flood from a frame around the grid."""
    free = np.pad(~part, 1, constant_values=True)
    labels, _ = ndimage.label(free)
    return labels == labels[0, 0]


def direct(k, grid, head_of, wells=None) -> tuple[np.ndarray, float]:
    """Return heads and the energy lost, assembled cell by cell; maps only.

    `head_of(x, y)` is the head on faces between active cells and the outside of their part.
    """
    (dx, dy), (x0, y0) = grid.cell_size, grid.origin
    active = np.isfinite(k)
    labels, n = ndimage.label(active)
    outside = [outside_of(labels == part) for part in range(1, n + 1)]
    number = {tuple(c): i for i, c in enumerate(np.argwhere(active).tolist())}
    matrix, rhs = sparse.lil_array((len(number),) * 2), np.zeros(len(number))
    fixed = []
    for (row, column), i in number.items():
        rhs[i] += (wells or {}).get((row, column), 0.0)
        for down, right in ((0, -1), (0, 1), (-1, 0), (1, 0)):
            other, t = (row + down, column + right), dy / dx if right else dx / dy
            if other in number:
                t /= 0.5 / k[row, column] + 0.5 / k[other]
                matrix[i, i] += t
                matrix[i, number[other]] -= t
            elif outside[labels[row, column] - 1][other[0] + 1, other[1] + 1]:
                t *= 2 * k[row, column]
                head = head_of(
                    x0 + (column + 0.5 + right / 2) * dx, y0 + (row + 0.5 + down / 2) * dy
                )
                matrix[i, i] += t
                rhs[i] += t * head
                fixed.append((i, t, head))
    heads = np.full(k.shape, np.nan)
    solved = spsolve(matrix.tocsc(), rhs)
    heads[active] = solved
    return heads, sum(t * (head - solved[i]) * head for i, t, head in fixed)


def west_to_east(active: np.ndarray, high: float, low: float):
    """Return the heads that fall from the west to the east end of the active cells."""
    columns = np.flatnonzero(active.any(axis=0))
    west = GRID.origin[0] + columns[0] * GRID.cell_size[0]
    length = (columns[-1] + 1 - columns[0]) * GRID.cell_size[0]
    return lambda x, y: high + (x - west) / length * (low - high), length


def test_flow_in_a_catchment_is_that_of_a_direct_solution_on_page_and_command_line(tmp_path):
    pytest.importorskip("flopy")
    import flopy

    e = catchment()
    head_of, length = west_to_east(e.active, 1.0, 0.0)
    k = e.property(VALUES)
    wanted, each = [], []
    for r in range(e.n):
        heads, energy = direct(k[r], GRID, head_of)
        wanted.append(heads)
        volume = GRID.cell_size[0] * GRID.cell_size[1] * e.n_active
        each.append(energy * length**2 / volume)
    # the page
    choice = FlowChoice(rocks=tuple((name, (k, 0.25)) for name, k in VALUES.items()))
    shown = solution(e, 1, flow_settings(choice, e)).work(lambda _: None)
    np.testing.assert_allclose(shown.flow.heads, wanted[1], rtol=0, atol=1e-6)
    assert shown.flow.effective_k == pytest.approx(each[1], rel=1e-6)
    # the command line
    io.write_realizations(tmp_path / "out.npz", e)
    table, model, geometry = (tmp_path / name for name in ("k.csv", "model", "grid.grdecl"))
    options = ["-k", "mud=1e-7", "-k", "sand=1e-4", "-o", str(table), "--grdecl", str(geometry)]
    file = str(tmp_path / "out.npz")
    assert main(["flow", file, *options, "--modflow", str(model), "--thickness", "7"]) == 0
    listed = [float(line.split(",")[1]) for line in table.read_text().splitlines()[1:-1]]
    assert listed == pytest.approx(each, rel=1e-6)
    loaded = flopy.mf6.MFSimulation.load(sim_ws=str(model), verbosity_level=0).get_model()
    start = loaded.ic.strt.array[0, ::-1]
    np.testing.assert_allclose(start[e.active], wanted[0][e.active], rtol=0, atol=1e-6)
    assert loaded.dis.top.array[0, 0] - loaded.dis.botm.array[0, 0, 0] == pytest.approx(7)
    assert "7.0" in geometry.read_text()
    ghb = loaded.ghb.stress_period_data.get_data(0)
    assert len(ghb) == len(shown.flow.fixed_faces.heads)
    rest = sum(row[2] * (row[1] - start[::-1][row[0][1:]]) for row in ghb)
    assert abs(rest) < 1e-5 * sum(row[2] for row in ghb)


@pytest.mark.parametrize("seed", range(12))
def test_any_parts_of_active_cells_keep_balance_maximum_principle_and_the_direct_heads(seed):
    rng = np.random.default_rng(seed)
    shape, grid = (14, 17), Grid(14, 17, (3.0, 5.0), (100.0, -20.0))
    active = ndimage.uniform_filter(rng.random(shape), 1 + seed % 3) < rng.uniform(0.45, 0.7)
    k = np.where(active, 10.0 ** rng.uniform(-4, 0, shape), np.nan)
    points = ((105.0, 0.0), (140.0, 30.0))
    start, way = np.array(points[0]), np.subtract(*points[::-1])

    def head_of(x, y):
        return 3 - 2 * np.clip(((x, y) - start) @ way / (way @ way), 0, 1)

    solved = darcy(k, grid, edge=Edge((3.0, 1.0), points))
    wanted, _ = direct(k, grid, head_of)
    np.testing.assert_allclose(solved.heads, wanted, rtol=0, atol=2e-6)
    assert abs(solved.balance) < 1e-6
    inside = solved.heads[active]
    assert 1 - 1e-9 <= inside.min() <= inside.max() <= 3 + 1e-9
    lost = sum(np.diff(flux, axis=axis) for axis, flux in enumerate(solved.fluxes))
    for axis, flux in enumerate(solved.fluxes):  # inactive cells exchange water with neighbours
        assert flux.shape[axis] == shape[axis] + 1
    assert np.abs(lost[active]).max() < 1e-6 * solved.inflow
    # particles leave through the outline
    ended = tracks(solved, starts_at_inflow(solved, 40, "edge"))
    assert np.isin(ended.status, (LEFT_GRID, STUCK)).all()
    assert (ended.status == LEFT_GRID).mean() > 0.9


@pytest.mark.parametrize("shape", [(9, 12), (3, 9, 12)])
def test_the_outline_of_a_whole_grid_equals_heads_at_all_sides(shape):
    k = 10.0 ** np.random.default_rng(3).uniform(-4, 0, shape)
    nz = shape[0] if len(shape) == 3 else None
    grid = Grid(*shape[-2:], (2.0, 3.0, 0.5)[: len(shape)], nz=nz)
    along = np.broadcast_to(5 - 4 * (np.arange(12) + 0.5) / 12, (*shape[:-2], 12))
    sides = darcy(k, grid, west_east=(5.0, 1.0), south_north=(along, along))
    outline = darcy(k, grid, edge=Edge((5.0, 1.0)))
    np.testing.assert_allclose(outline.heads, sides.heads, atol=1e-12)
    assert outline.through == pytest.approx(sides.through)
    assert darcy(np.ones(shape), grid, edge=Edge((5.0, 1.0), "y")).effective_k == pytest.approx(1)


def test_a_well_is_fed_through_an_outline_with_one_head_and_thickness_scales_the_flow():
    e = catchment(1)
    k, well = e.property({"mud": 1e-4, "sand": 1e-4})[0], {(30, 40): -1e-3}
    thin = darcy(k, GRID, edge=Edge(10.0), wells=well)
    assert thin.inflow == pytest.approx(1e-3, rel=1e-6)
    assert np.nanargmin(thin.heads) == 30 * 80 + 40
    thick = darcy(k, GRID, edge=Edge(10.0), wells=well, thickness=20.0)
    np.testing.assert_allclose(10 - thick.heads, (10 - thin.heads) / 20, atol=1e-6)
    ways = [tracks(f, starts_at_inflow(f, 9, "edge"), keep_paths=False) for f in (thin, thick)]
    np.testing.assert_allclose(ways[1].times, 20 * ways[0].times, rtol=1e-4)
    with pytest.raises(CCWSIMError, match="two different heads"):
        _ = thin.effective_k


def test_bounds_hold_for_heads_along_an_outline():
    e = catchment()
    for edge in (
        Edge(),
        Edge((0.0, 1.0), "y"),
        Edge((1, 0), ((846000, 6523000), (850000, 6524000))),
    ):
        effective = flow.effective_k(e, VALUES, heads=edge)
        assert (effective.harmonic <= effective.each * (1 + 1e-6)).all()
        assert (effective.each <= effective.arithmetic * (1 + 1e-6)).all()
    homogeneous = flow.effective_k(e, {"mud": 2.0, "sand": 2.0})
    np.testing.assert_allclose(homogeneous.each, 2.0, rtol=0.01)  # the hole is no-flow
    assert flow.travel_times(e, VALUES, n_particles=5).shape == (2, 5)


def test_capture_counts_starts_in_active_cells_only():
    e = catchment()
    captured = flow.capture_probability(
        e, {"mud": 1e-4, "sand": 1e-4}, (30, 40), 1e-3, edge=Edge(10.0), step=4
    )
    shares = captured.probability
    active = e.active[np.ix_(np.arange(2, 60, 4), np.arange(2, 80, 4))]
    np.testing.assert_array_equal(np.isnan(shares), ~active)
    assert shares[active].mean() > 0.95  # all water flows to the well
    alone = flow.Capture(captured.starts[captured.active], (1, active.sum()),
                         captured.captured[:, captured.active])  # fmt: skip
    assert captured.brier() == pytest.approx(alone.brier())


def test_usual_heads_are_at_sides_unless_a_side_has_no_active_cell():
    active = np.ones((4, 5), bool)
    assert usual_heads(active) == (1.0, 0.0)
    active[:, 0] = False
    assert usual_heads(active) == Edge((1.0, 0.0), "x")
    assert usual_heads(active, "y") == (1.0, 0.0)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (((1.0, 2.0, 3.0),), "one or two numbers"),
        ((np.nan,), "one or two numbers"),
        (((1, 0), "z"), "two different points"),
        (((1, 0), ((0, 0), (0, 0))), "two different points"),
        (((1, 0), (1, 2, 3)), "two different points"),
    ],
)
def test_bad_heads_along_an_outline_are_one_sentence(arguments, words):
    with pytest.raises(CCWSIMError, match=words):
        Edge(*arguments)


def test_sides_and_outline_exclude_each_other_and_thickness_is_for_maps():
    k = np.ones((4, 4))
    with pytest.raises(CCWSIMError, match="leave one of them out"):
        darcy(k, west_east=(1, 0), edge=Edge())
    with pytest.raises(CCWSIMError, match="thickness"):
        darcy(k, west_east=(1, 0), thickness=0)
    with pytest.raises(CCWSIMError, match="thickness is for maps"):
        darcy(np.ones((2, 4, 4)), west_east=(1, 0), thickness=2)
    k[[0, -1]] = k[:, [0, -1]] = np.nan
    with pytest.raises(CCWSIMError, match=r"along the outline of the active cells \(edge\)"):
        darcy(k, west_east=(1, 0))


@pytest.mark.parametrize(
    ("option", "words"),
    [
        ("edge,1,2,3", "must be two heads"),
        ("edge,12,12", "two different heads"),
        ("12", "must be two heads"),
        ("12,7", "no head is fixed"),
    ],
)
def test_bad_heads_of_the_command_are_one_sentence(tmp_path: Path, option, words, capsys):
    io.write_realizations(tmp_path / "out.npz", catchment(1))
    values = ["-k", "mud=1e-7", "-k", "sand=1e-4"]
    assert main(["flow", str(tmp_path / "out.npz"), *values, "--heads", option]) == 2
    assert words in capsys.readouterr().err
