"""Test flow and tracks against exact solutions and an independent assembly."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage, sparse
from scipy.sparse.linalg import spsolve

from ccwsim import (
    Cancelled,
    CCWSIMError,
    Ensemble,
    Grid,
    Secondary,
    TrainingImage,
    flow,
)
from ccwsim.flow import answers, darcy, starts_at_inflow, tracks
from ccwsim.flow.tracks import IN_WELL
from ccwsim.model.study import Study

LAYERS = 10.0 ** np.random.default_rng(0).uniform(-4, 0, 40)


def ensemble(n: int = 6, shape: tuple[int, ...] = (24, 30), grid: Grid | None = None) -> Ensemble:
    """Return random realizations of two facies, which need no simulation."""
    indices = (np.random.default_rng(1).random((n, *shape)) < 0.4).astype(np.uint8)
    image = TrainingImage(indices[0], facies_names=["mud", "sand"])
    return Ensemble(
        Study(image, grid or Grid.of(shape), checked=False),
        indices=indices, cpu_seconds=np.zeros(n), wall_seconds=0.0,
        data_status=np.zeros((n, 0), np.int16), numbers=np.arange(n),
    )  # fmt: skip


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("along", [0, 1, 2])
def test_layers_are_exact(axis, along):
    shape = np.array([4, 5, 6])
    shape[axis] = len(LAYERS)
    k = np.broadcast_to(LAYERS.reshape([-1 if a == axis else 1 for a in range(3)]), shape)
    ends = {("bottom_top", "south_north", "west_east")[along]: (3.0, 1.0)}
    grid = Grid(*shape[1:], (2.0, 3.0, 0.5), nz=int(shape[0]))
    found = darcy(k, grid, **ends)
    exact = 1 / np.mean(1 / LAYERS) if along == axis else LAYERS.mean()
    assert found.effective_k == pytest.approx(exact, rel=1e-8)
    assert abs(found.balance) < 1e-7


def dense(k: np.ndarray, sizes, heads, q, anisotropy=1.0) -> np.ndarray:
    """Return heads from an assembly cell by cell: fixed heads west and east, NaN inactive."""
    k3 = k if k.ndim == 3 else k[None]
    sizes = [*sizes, 1.0][:3]
    cells = [tuple(c) for c in np.argwhere(np.isfinite(k3))]
    number = {c: i for i, c in enumerate(cells)}
    matrix, rhs = sparse.lil_array((len(cells),) * 2), np.zeros(len(cells))
    volume = np.prod(sizes)
    for c, i in number.items():
        rhs[i] += q.get(c[-k.ndim :], 0.0)
        for axis, size in zip((2, 1, 0), sizes, strict=True):
            ratio = anisotropy if axis == 0 else 1.0
            for step in (-1, 1):
                other = tuple(v + step * (a == axis) for a, v in enumerate(c))
                if other in number:
                    resistance = 0.5 / k3[c] + 0.5 / k3[other]
                    t = ratio * volume / size**2 / resistance
                    matrix[i, i] += t
                    matrix[i, number[other]] -= t
                elif axis == 2 and not 0 <= other[2] < k3.shape[2]:
                    t = 2 * k3[c] * volume / size**2
                    matrix[i, i] += t
                    rhs[i] += t * heads[step > 0]
    found = np.full(k3.shape, np.nan)
    found[tuple(np.array(cells).T)] = spsolve(matrix.tocsc(), rhs)
    return found.reshape(k.shape)


@pytest.mark.parametrize("shape", [(17, 23), (5, 8, 11)])
def test_heads_equal_those_of_another_assembly_with_a_well_and_a_mask(shape):
    rng = np.random.default_rng(3)
    k = np.where(rng.random(shape) < 0.5, 1.0, 1e-3)
    mask = np.ones(shape, bool)
    mask[..., 3:6, 8:11] = False
    well = (*(n // 2 for n in shape[:-1]), shape[-1] // 3)
    mask[well] = True
    sizes = (10.0, 20.0, 0.5)[: len(shape)]
    grid = Grid(*shape[-2:], sizes, nz=shape[0] if len(shape) == 3 else None)
    found = darcy(k, grid, west_east=(2.0, 1.0), wells={well: -0.01}, active=mask, anisotropy=0.1)
    wanted = dense(np.where(mask, k, np.nan), sizes, (2.0, 1.0), {well: -0.01}, 0.1)
    scale = np.ptp(wanted[mask])
    np.testing.assert_allclose(found.heads[mask], wanted[mask], atol=1e-6 * scale)
    assert np.isnan(found.heads[~mask]).all()
    assert sum(found.through.values()) == pytest.approx(0.01, rel=1e-6)


def test_isolated_cells_have_no_head_and_no_flow():
    k = np.ones((5, 6))
    k[:, 2] = k[2, :2] = np.nan
    found = darcy(k, west_east=(1.0, None))
    assert np.isnan(found.heads[:, 2:]).all()
    np.testing.assert_allclose(found.heads[[0, 1, 3, 4], :2], 1.0)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"west_east": (1, 0), "conductivity": np.zeros((4, 4))}, "above 0"),
        ({"conductivity": np.ones((4, 4))}, "no head is fixed"),
        ({"west_east": (1, 0), "wells": {(9, 9): 1}}, "outside the grid"),
        ({"west_east": (1, 0), "wells": {(1, 2): 1}, "active": np.eye(4) == 0}, "no active"),
        ({"west_east": (1, None), "wells": {(1, 1): 1}, "active": np.eye(4) == 0}, "inactive"),
        ({"west_east": (1, None), "wells": {(0, 3): 1}, "active": np.eye(4) == 0}, "cut off"),
        ({"west_east": (np.nan, 0)}, "numbers from"),
        ({"west_east": (1, 0), "anisotropy": 0}, "anisotropy"),
        ({"bottom_top": (1, 0)}, "no layers"),
        ({"west_east": 1}, "pair"),
    ],
)
def test_bad_input_is_one_sentence(options, words):
    k = options.pop("conductivity", np.ones((4, 4)))
    if "active" in options:
        options["active"] = options["active"][:, ::1]
        if words == "no active":
            options["active"] = np.tile([True, False, True, True], (4, 1))
    with pytest.raises(CCWSIMError, match=words):
        darcy(k, **options)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"sand": 1.0}, "mud has no value"),
        ({"sand": 1.0, "mud": 0.0}, "mud = 0.0 must be a number from"),
        ({"sand": 1.0, "mud": 1.0, "silt": 1}, "facies = 'silt' must be one of mud, sand"),
        ({"sand": 1e9, "mud": 1e-8}, "same unit"),
        ([1, 2], "dict"),
    ],
)
def test_a_facies_needs_a_positive_value(values, words):
    with pytest.raises(CCWSIMError, match=words):
        ensemble().property(values)


def test_a_property_is_computed_on_access():
    e = ensemble()
    k = e.property({"mud": 1e-8, 1: 1e-4}, unit="m/s")
    assert k.shape == e.shape
    assert np.array_equal(k[2], np.where(e.indices[2] == 1, 1e-4, 1e-8))
    assert np.array_equal(np.array([*k]), np.asarray(k))


def test_times_through_layers_and_in_series():
    found = darcy(np.repeat(LAYERS[:, None], 80, 1), west_east=(1.0, 0.0))
    starts = np.column_stack([np.zeros(40), np.arange(40) + 0.5])
    times = tracks(found, starts, porosity=0.25).times
    np.testing.assert_allclose(times, 80**2 * 0.25 / LAYERS, rtol=1e-5)
    found = darcy(np.repeat(LAYERS[None], 8, 0), west_east=(1.0, 0.0))
    (time,) = tracks(found, [[0.0, 4.5]], porosity=0.25).times
    assert time == pytest.approx(40 * 0.25 * np.sum(1 / LAYERS), rel=1e-5)


def test_radial_flow_to_a_well():
    n, length, radius = 201, 100.0, 40.0
    d = length / n
    grid = Grid(n, n, (d, d))
    centres = (np.arange(n) + 0.5) * d - length / 2

    def side(x):
        return np.log(np.hypot(x, centres) / length) / (2 * np.pi)

    ends = (side(-length / 2), side(length / 2))
    well = {(n // 2, n // 2): -1.0}
    found = darcy(np.ones((n, n)), grid, west_east=ends, south_north=ends, wells=well)
    angle = np.linspace(0, 2 * np.pi, 64, endpoint=False)
    starts = length / 2 + radius * np.column_stack([np.cos(angle), np.sin(angle)])
    went = tracks(found, starts, porosity=0.2)
    assert (went.status == IN_WELL).all()
    last = np.array([path[-1, 1:] for path in went.paths]) - length / 2
    exact = np.pi * 0.2 * (radius**2 - (last**2).sum(axis=1))
    assert abs(np.mean(went.times / exact) - 1) < 1e-4


def test_a_track_backward_ends_where_the_forward_track_began():
    k = np.where(np.random.default_rng(5).random((30, 40)) < 0.5, 1.0, 0.01)
    found = darcy(k, west_east=(1.0, 0.0))
    starts = starts_at_inflow(found, 20)
    forward = tracks(found, starts)
    assert (forward.status == 0).all()
    ends = np.array([path[-1, 1:] for path in forward.paths]) - [1e-9, 0]
    back = tracks(found, ends, backward=True)
    np.testing.assert_allclose([path[-1, 1:] for path in back.paths], starts, atol=1e-3)
    np.testing.assert_allclose(back.times, forward.times, rtol=1e-3)


def test_effective_k_is_between_its_bounds_and_can_be_stopped():
    e, values = ensemble(), {"mud": 1e-3, "sand": 1.0}
    found = flow.effective_k(e, values)
    assert (found.harmonic <= found.each).all()
    assert (found.each <= found.arithmetic).all()
    assert found.image == pytest.approx(found.each[0])
    told = []
    flow.effective_k(e, values, n_workers=1, progress=lambda share, n: told.append(n))
    assert told[-1] == e.n
    many = e[[0] * 1000]  # not finished before the first question
    with pytest.raises(Cancelled):
        flow.effective_k(many, values, n_workers=1, cancel=lambda: True)
    with pytest.raises(CCWSIMError, match="axis"):
        flow.effective_k(e, values, "z")


def masked(seed: int) -> tuple[np.ndarray, np.ndarray, Grid]:
    """Return random conductivities, active cells, at least in one line along x, and a grid."""
    rng = np.random.default_rng(seed)
    shape = tuple(rng.integers(1, (4, 9, 9)))[seed % 2 :]
    k = 10.0 ** rng.uniform(-4, 0, shape)
    active = ndimage.uniform_filter(rng.random(shape), 1 + seed % 3) < rng.uniform(0.3, 1)
    active[..., int(rng.integers(shape[-2])), :] = True
    sizes = tuple(rng.uniform(0.5, 20, len(shape)))
    return k, active, Grid(*shape[-2:], sizes, nz=shape[0] if len(shape) == 3 else None)


def test_bounds_hold_for_any_active_cells():
    n_tight = 0
    for seed in range(300):
        k, active, grid = masked(seed)
        found = darcy(k, grid, active=active, west_east=(1001.0, 1000.0)).effective_k
        low, high = answers._bounds(np.where(active, k, np.nan), k.ndim - 1)
        assert 0 < low <= found * (1 + 1e-6), seed
        assert found <= high * (1 + 1e-6), seed
        if active.all():
            n_tight += 1
            assert (low, high) == pytest.approx((1 / np.mean(1 / k), k.mean()))
    assert 5 < n_tight < 295


def test_a_strip_of_active_cells_has_the_conductivity_of_its_rock():
    e, values = ensemble(3), {"mud": 1e-3, "sand": 1.0}
    active = np.zeros(e.grid.shape, bool)
    active[4:9] = True
    indices = np.where(active, e.indices, 255).astype(np.uint8)
    strip = flow.effective_k(
        replace(e, indices=indices, study=replace(e.study, secondary=Secondary(active=active))),
        values,
    )
    alone = replace(e, indices=e.indices[:, 4:9], study=replace(e.study, grid=Grid(5, 30)))
    for name in ("each", "harmonic", "arithmetic", "efficiency"):
        wanted = getattr(flow.effective_k(alone, values), name)
        np.testing.assert_allclose(getattr(strip, name), wanted, rtol=1e-6)


@pytest.mark.parametrize("contrast", [1e2, 1e6, 1e8])
@pytest.mark.parametrize("n", [12, 60])
def test_the_datum_of_heads_changes_nothing(n, contrast):
    k = np.ones((n, n))
    k[:, n // 2] = 1 / contrast  # a barrier
    exact = n / (n - 1 + contrast)
    for datum in (0.0, 3000.0, -1e5):
        found = darcy(k, west_east=(datum + 1.0, datum))
        assert found.effective_k == pytest.approx(exact, rel=1e-6)
        assert abs(found.balance) < 1e-6
    # unconnected bodies with different heads: each has its own datum
    k[n // 3] = np.nan
    ends = np.where(np.arange(n) < n // 3, 1e5, 2.0), np.where(np.arange(n) < n // 3, 1e5, 1.0)
    found = darcy(k, west_east=ends)
    upper, lower = n - n // 3 - 1, n / (n - 1 + contrast) / n
    assert found.through["west"] == pytest.approx(upper * lower, rel=1e-6)
    assert (found.heads[: n // 3] == 1e5).all()


def test_iterations_end_when_the_residuals_are_small_beside_the_flows():
    """Test that the balance of all cells, not only at the sides, is within the tolerance."""
    rng = np.random.default_rng(8)
    for contrast in (1e1, 1e4, 1e8):
        k = np.where(ndimage.gaussian_filter(rng.normal(size=(40, 50)), 2) < 0, 1.0, 1 / contrast)
        for tolerance in (1e-3, 1e-6):
            found = darcy(k, west_east=(1.0, 0.0), wells={(20, 20): 1e-9}, tolerance=tolerance)
            lost = sum(np.diff(flux, axis=axis) for axis, flux in enumerate(found.fluxes))
            lost[20, 20] -= 1e-9
            inflow = found.through["west"] + found.wells[20, 20]
            assert np.abs(lost).sum() <= 2 * inflow * tolerance * 1.01 + 1e-13


@pytest.mark.parametrize(
    "ends",
    [
        {"west_east": (0.1, 0.1)}, {"west_east": (np.full(4, 0.1), 0.1)},
        {"west_east": (1e5 + 0.1, None)}, {"west_east": (7.3, 7.3), "south_north": (7.3, None)},
    ],
)  # fmt: skip
def test_equal_heads_give_no_flow_at_all_and_an_error_in_words(ends):
    k = 10.0 ** np.random.default_rng(2).uniform(-6, 0, (4, 5))
    found = darcy(k, **ends)
    assert found.balance == 0.0
    assert not any(flux.any() for flux in found.fluxes)
    assert np.ptp(found.heads) == 0.0
    with pytest.raises(CCWSIMError, match="two different heads"):
        _ = found.effective_k
    with pytest.raises(CCWSIMError, match="nothing flows into the grid"):
        starts_at_inflow(found, 3)


def test_a_third_head_gives_no_effective_k():
    found = darcy(np.ones((4, 5)), west_east=(1.0, 0.0), south_north=(0.2, None))
    assert found.fixed["x"] == (1.0, 0.0)
    assert found.fixed["y"][0] == 0.2
    with pytest.raises(CCWSIMError, match="neither wells nor other heads"):
        _ = found.effective_k


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"tolerance": 0}, "tolerance = 0"), ({"tolerance": -1}, "tolerance = -1"),
        ({"tolerance": 1}, "tolerance = 1 "), ({"tolerance": np.nan}, "tolerance = nan"),
        ({"tolerance": "1e-6"}, "tolerance = '1e-6'"), ({"wells": [((1, 1), 2)]}, "wells"),
        ({"wells": {3: 1}}, "well in cell 3"), ({"wells": {(1, 1): "a"}}, "rate of the well"),
        ({"conductivity": np.full((4, 4), 1e308)}, "conductivity from 1e.308"),
        ({"conductivity": np.full((4, 4), 1e-320)}, "conductivity from .*e-321"),
        ({"conductivity": np.geomspace(1, 1e13, 16).reshape(4, 4)}, "factor of"),
        ({"conductivity": np.full((4, 4), np.nan)}, "no cell is active"),
        ({"grid": Grid(4, 4, (1e-200, 1e-200))}, "cell size"), ({"anisotropy": "a"}, "anisotropy"),
        ({"west_east": (1e308, 0)}, "1e.30"), ({"grid": "a"}, "grid"),
    ],
)  # fmt: skip
def test_numbers_that_cannot_be_computed_are_refused(options, words):
    given = {"conductivity": np.ones((4, 4)), "west_east": (1, 0), **options}
    with pytest.raises(CCWSIMError, match=words):
        darcy(**given)


def test_an_axis_that_the_grid_lacks_has_no_inflow():
    found = darcy(np.ones((4, 5)), west_east=(1.0, 0.0))
    for axis in ("z", "q", 0, None):
        with pytest.raises(CCWSIMError, match=r"axis = .* must be one of x, y"):
            starts_at_inflow(found, 3, axis)


def test_porosity_may_be_unknown_in_inactive_cells_only():
    k = np.ones((4, 5))
    k[3] = np.nan
    found, porosity = darcy(k, west_east=(1.0, 0.0)), np.where(np.isnan(k), np.nan, 0.2)
    wanted = tracks(found, [[0.0, 0.5]], porosity=0.2).times
    assert tracks(found, [[0.0, 0.5]], porosity=porosity).times == pytest.approx(wanted)
    porosity[0, 0] = np.nan
    with pytest.raises(CCWSIMError, match="porosity"):
        tracks(found, [[0.0, 0.5]], porosity=porosity)


def test_scores_equal_plain_loops():
    captured = np.random.default_rng(4).random((5, 12)) < 0.4
    found = flow.Capture(np.zeros((12, 2)), (3, 4), captured)
    own, constant = [], []
    for r in range(5):
        others = np.delete(captured, r, axis=0).mean(axis=0)
        own += [(others[k] - captured[r, k]) ** 2 for k in range(12)]
        constant += [(others.mean() - captured[r, k]) ** 2 for k in range(12)]
    assert found.brier() == pytest.approx((np.mean(own), np.mean(constant)))
    with pytest.raises(CCWSIMError, match=r"shape \(12,\)"):
        found.brier(captured)


def test_representatives_have_the_rank_asked_for():
    e, values = ensemble(11), {"mud": 1e-3, "sand": 1.0}
    order = np.argsort(flow.effective_k(e, values).each)
    each = flow.effective_k(e, values).each
    assert flow.at_percentiles(each, (0, 50, 100)).tolist() == order[[0, 5, 10]].tolist()
    assert len(flow.at_percentiles(each)) == 3


def test_breakthrough_in_a_homogeneous_grid_is_plug_flow():
    times = flow.travel_times(ensemble(2), {0: 2.0, 1: 2.0}, {0: 0.5, 1: 0.5}, "y", n_particles=5)
    np.testing.assert_allclose(times, 24**2 * 0.5 / 2.0, rtol=1e-6)


def test_capture_in_a_homogeneous_grid_is_certain():
    e = ensemble(3, (40, 60))
    well, q, rate = (20, 40), 1 / 60, 0.3
    found = flow.capture_probability(e, {0: 1.0, 1: 1.0}, well, rate, west_east=(1.0, 0.0), step=2)
    assert set(np.unique(found.probability)) == {0.0, 1.0}
    assert found.brier()[0] == 0.0 < found.brier()[1]
    width = found.probability[:, 0].sum() * 2  # rows captured far upstream
    assert width == pytest.approx(rate / q, abs=6)
    assert found.brier(found.captured[0])[0] == 0.0
    inside = flow.capture_probability(
        e, {0: 1.0, 1: 1.0}, well, rate, west_east=(1.0, 0.0), step=2, within=50.0
    )
    assert inside.probability.sum() < found.probability.sum()
