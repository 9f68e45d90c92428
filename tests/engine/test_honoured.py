"""Test that every hard datum is honoured at full resolution, for random studies."""

from __future__ import annotations

import os

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from ccwsim import Grid, HardData, Parameters, TrainingImage, revise, simulate

CASES = int(os.environ.get("CCWSIM_CASES", "40"))


@st.composite
def studies(draw):
    """Return a study of random image, codes, grid, parameters and data, also contradictory data."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    n_facies = draw(st.integers(1, 4))
    codes = rng.choice(np.arange(-50, 300), n_facies, replace=False)
    my, mx = draw(st.integers(16, 70)), draw(st.integers(16, 70))
    smooth = draw(st.integers(1, 8))
    coarse = rng.integers(0, n_facies, (my // smooth + 1, mx // smooth + 1))
    image = np.kron(coarse, np.ones((smooth, smooth), int))[:my, :mx]
    ti = TrainingImage(codes[image])
    level = draw(st.integers(0, 3))
    unit = 2**level
    overlap = unit * draw(st.integers(1, max(1, 8 // unit)))
    low = max(2 * overlap, 4)
    template = draw(
        st.sampled_from(
            [t for t in range(0, 33, unit) if t >= low and t <= min(my, mx)]
            or [min(my, mx) // unit * unit]
        )
    )
    if overlap > template // 2:
        overlap, template, level = 1, 8, 0
    p = Parameters(
        template_size=template,
        overlap_size=overlap,
        wavelet_level=level,
        n_candidates=draw(st.integers(1, 30)),
        method=draw(st.sampled_from(["ccwsim", "ms-ccsim", "ccsim"])),
        similarity=draw(st.sampled_from(["ssd", "correlation"])),
        search_fraction=draw(st.sampled_from([0.05, 0.1, 1.0])),
        co_template=draw(st.integers(1, 3)),
        random_path=draw(st.booleans()),
        template_variation=draw(st.sampled_from([0.0, 0.3])),
        location_weight=draw(st.sampled_from([0.0, 2.0])),
        match_proportions=draw(st.booleans()),
        published_draw=draw(st.booleans()),
        repair_seams=draw(st.booleans()),
        refine=draw(st.booleans()),
    )
    ny, nx = draw(st.integers(1, 90)), draw(st.integers(1, 90))
    share = draw(st.sampled_from([0.0, 0.002, 0.02, 0.2, 1.0]))
    where = np.argwhere(rng.random((ny, nx)) < share)
    if draw(st.booleans()):
        where = np.vstack([where, [[0, 0], [ny - 1, nx - 1]]])
        where = np.unique(where, axis=0)
    facies = ti.codes[rng.integers(0, ti.n_facies, len(where))].astype(int)
    return ti, (ny, nx), p, HardData(where, facies), draw(st.integers(0, 2**40))


def sampled(n: int):
    """Return settings of Hypothesis for n random studies."""
    return settings(max_examples=n, deadline=None, suppress_health_check=list(HealthCheck))


def check_data(study):
    """Check that every datum is honoured, and counted once by the way in which it is honoured."""
    ti, shape, p, data, seed = study
    ensemble = simulate(ti, shape, p, data, n_realizations=2, seed=seed)
    assert (ensemble.realizations[:, *data.cells.T] == data.facies).all()
    assert ensemble.n_mismatched.sum() == 0
    counted = (ensemble.data_status == 0).sum(axis=1) + ensemble.n_resimulated
    assert (counted + ensemble.n_forced == data.n).all()


@sampled(CASES)
@given(studies())
def test_every_datum_is_honoured_whatever_is_asked(study):
    check_data(study)


@st.composite
def volumes(draw):
    """Return random volumes with vertical and deviated wells, scattered and contradictory data."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    n_facies = draw(st.integers(1, 4))
    codes = rng.choice(np.arange(-50, 300), n_facies, replace=False)
    shape = [draw(st.integers(4, 20)), draw(st.integers(8, 36)), draw(st.integers(8, 36))]
    smooth = draw(st.integers(1, 6))
    coarse = rng.integers(0, n_facies, [n // smooth + 1 for n in shape])
    image = np.kron(coarse, np.ones((smooth,) * 3, int))[tuple(slice(n) for n in shape)]
    ti = TrainingImage(codes[image])
    level, overlap, template = [], [], []
    for n in shape:
        unit = 2 ** draw(st.integers(0, 2 if n >= 8 else 0))
        o = unit * draw(st.integers(1, max(1, min(4, n // 2) // unit)))
        template.append(draw(st.sampled_from(range(max(2 * o, 4), min(n, 16) + 1, unit))))
        overlap.append(o)
        level.append(unit.bit_length() - 1)
    p = Parameters(
        template_size=tuple(template),
        overlap_size=tuple(overlap),
        wavelet_level=tuple(level),
        n_candidates=draw(st.integers(1, 30)),
        similarity=draw(st.sampled_from(["ssd", "correlation"])),
        search_fraction=draw(st.sampled_from([0.05, 1.0])),
        co_template=draw(st.integers(1, 2)),
        random_path=draw(st.booleans()),
        template_variation=draw(st.sampled_from([0.0, 0.3])),
        location_weight=draw(st.sampled_from([0.0, (1.0, 0.0, 0.0)])),
        match_proportions=draw(st.booleans()),
        published_draw=draw(st.booleans()),
        repair_seams=draw(st.booleans()),
        refine=draw(st.booleans()),
    )
    grid = tuple(draw(st.integers(1, most)) for most in (16, 40, 40))
    kind = draw(st.sampled_from(["none", "wells", "deviated", "scattered", "dense", "all"]))
    where = np.argwhere(rng.random(grid) < {"scattered": 0.01, "dense": 0.3, "all": 1}.get(kind, 0))
    if kind in ("wells", "deviated"):
        lean = 0 if kind == "wells" else rng.normal(size=(6, 1, 2))
        layers = np.arange(grid[0])
        ways = rng.integers(0, grid[1:], (6, 1, 2)) + lean * layers[:, None]
        cells = np.dstack([np.broadcast_to(layers, (6, grid[0])), np.rint(ways)])
        where = np.unique(cells.reshape(-1, 3), axis=0).astype(int)
        where = where[((where >= 0) & (where < grid)).all(axis=1)]
    facies = ti.codes[rng.integers(0, ti.n_facies, len(where))].astype(int)
    if draw(st.booleans()):  # data from the image instead of independent data
        near = np.minimum(where, np.array(ti.shape) - 1)
        facies = np.asarray(ti.array)[tuple(near.T)].astype(int)
    return ti, grid, p, HardData(where, facies), draw(st.integers(0, 2**40))


@pytest.mark.slow
@sampled(6 * CASES)
@given(st.one_of(studies(), volumes()))
def test_every_datum_of_many_studies_is_honoured(study):
    check_data(study)


def test_a_revision_honours_the_edited_data_and_changes_only_windows_around_them(channels):
    p = Parameters()
    before = simulate(channels, (200, 160), p, n_realizations=4, seed=3)
    rng = np.random.default_rng(0)
    cells = np.column_stack([rng.integers(0, 200, 12), rng.integers(0, 160, 12)])
    data = HardData(cells, rng.integers(0, 2, 12))
    after = revise(before, data)
    assert after.n_mismatched.sum() == 0
    assert after.revised
    assert not before.revised
    changed = np.argwhere(after.indices != before.indices)[:, 1:]
    gap = np.abs(changed[:, None, :] - cells[None]).max(axis=2).min(axis=1)
    assert gap.max() <= p.template_size


def test_a_datum_that_is_honoured_already_changes_nothing(channels):
    before = simulate(channels, (100, 100), n_realizations=3, seed=1)
    same = np.argwhere((before.indices == before.indices[0]).all(axis=0))[:5]
    data = HardData(same, before.realizations[0][same[:, 0], same[:, 1]])
    after = revise(before, data)
    assert np.array_equal(after.indices, before.indices)
    assert (after.data_status == 0).all()


@pytest.fixture(scope="module")
def channels():
    from ccwsim import datasets

    return datasets.load("channels")


def test_data_of_a_grid_in_world_coordinates_are_met(channels):
    grid = Grid(64, 96, cell_size=(25.0, 50.0), origin=(1000.0, -300.0))
    cells = grid.cells_of([1010.0, 3399.0], [-300.0, 2899.0])
    ensemble = simulate(channels, grid, hard_data=HardData(cells, [1, 0]), n_realizations=2)
    assert ensemble.realizations[:, 0, 0].tolist() == [1, 1]
    assert ensemble.realizations[:, 63, 95].tolist() == [0, 0]


@pytest.mark.slow
@pytest.mark.parametrize("keep_sources", [False, True])
def test_forced_counts_what_is_forced_at_the_end_of_a_revision(keep_sources):
    n_forced = 0
    for seed in range(8):
        rng = np.random.default_rng(seed)
        image = TrainingImage(np.kron(rng.integers(0, 2, (5, 5)), np.ones((6, 6), int)))
        cells = np.column_stack(np.divmod(rng.choice(1600, 300, replace=False), 40))
        data = HardData(cells, rng.integers(0, 2, 300))
        few = HardData(data.cells[:290], data.facies[:290])
        p = Parameters(template_size=16, overlap_size=4, wavelet_level=1)
        study = image, (40, 40), p, few, 2, seed
        before = simulate(*study, keep_sources=True)
        after = revise(before, data)
        rows, columns = data.cells.T
        own = np.searchsorted(image.codes, data.facies)
        is_new = [tuple(cell) not in set(map(tuple, few.cells)) for cell in data.cells]
        # seam repair may have set a single cell to the facies of a new datum
        met = is_new & (before.indices[:, rows, columns] == own)
        forced = ((after.sources[:, rows, columns] == -1) & ~met).sum(axis=1)
        n_forced += forced.sum()
        found = revise(simulate(*study, keep_sources=keep_sources), data)
        assert found.n_forced.tolist() == forced.tolist()
    assert n_forced
