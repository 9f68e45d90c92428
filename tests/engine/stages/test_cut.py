"""The boundary cut is the cheapest of all paths and keeps what honours the data."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from ccwsim.engine.stages.box import Box
from ccwsim.engine.stages.cut import (
    BROKEN,
    KEEP_OLD,
    TAKE_NEW,
    UNKNOWN,
    boundary,
    keep_old,
    make_cut,
    paste,
    wanted,
)

SIDES = list(range(16))


def cut(error: np.ndarray, demand: np.ndarray) -> np.ndarray:
    n, m = error.shape
    workspace = make_cut(n, m)._replace(error=error, demand=demand)
    boundary(workspace, n, m)
    return workspace.path


def cost_of(path, error: np.ndarray, demand: np.ndarray) -> tuple[int, int]:
    """Return how many data a path drops, and the error on both its sides."""
    m = error.shape[1]
    dropped = seen = 0
    for i, c in enumerate(path):
        dropped += np.count_nonzero(demand[i, :c] == TAKE_NEW)
        dropped += np.count_nonzero(demand[i, c:] == KEEP_OLD)
        seen += int(error[i, max(c - 1, 0)]) + int(error[i, min(c, m - 1)])
    return dropped, seen


def cheapest(error: np.ndarray, demand: np.ndarray) -> tuple[int, int]:
    """Return the smallest cost of all paths, one by one."""
    n, m = error.shape
    best = (n * m, 0)
    for first in range(m + 1):
        for steps in product((-1, 0, 1), repeat=n - 1):
            path = np.cumsum((first, *steps))
            if path.min() >= 0 and path.max() <= m:
                best = min(best, cost_of(path, error, demand))
    return best


strips = st.tuples(st.integers(1, 6), st.integers(1, 4)).flatmap(
    lambda shape: st.tuples(
        hnp.arrays(np.uint8, shape, elements=st.integers(0, 1)),
        hnp.arrays(np.uint8, shape, elements=st.sampled_from([0, 0, 0, KEEP_OLD, TAKE_NEW])),
    )
)


@settings(max_examples=150, deadline=None)
@given(strips)
def test_the_boundary_is_the_cheapest_of_all_paths(strip):
    error, demand = strip
    path = cut(error, demand)
    assert path.min() >= 0
    assert path.max() <= error.shape[1]
    assert np.abs(np.diff(path)).max(initial=0) <= 1
    assert cost_of(path, error, demand) == cheapest(error, demand)


@settings(deadline=None)
@given(hnp.arrays(np.uint8, (40, 8), elements=st.integers(0, 1)), st.data())
def test_one_demand_is_always_met(error, data):
    demand = np.zeros_like(error)
    cell = data.draw(st.integers(0, 39)), data.draw(st.integers(0, 7))
    demand[cell] = data.draw(st.sampled_from([KEEP_OLD, TAKE_NEW]))
    assert cost_of(cut(error, demand), error, demand)[0] == 0


def test_a_datum_is_worth_more_than_any_path_of_a_usual_strip():
    error = np.ones((400, 60), np.uint8)
    error[:, 0] = 0
    demand = np.zeros_like(error)
    demand[200, 59] = KEEP_OLD
    assert cost_of(cut(error, demand), error, demand)[0] == 0
    assert BROKEN > 2 * 400


def test_a_datum_is_worth_more_than_any_path_of_the_widest_strip():
    error = np.ones((1024, 512), np.uint8)
    error[:, 0] = 0
    demand = np.zeros_like(error)
    demand[512, 511] = KEEP_OLD
    assert cost_of(cut(error, demand), error, demand)[0] == 0


def test_a_demand_is_made_only_where_one_of_both_honours_the_datum():
    assert wanted(old=1, new=0, datum=1) == KEEP_OLD
    assert wanted(old=0, new=1, datum=1) == TAKE_NEW
    for old, new, datum in ((1, 1, 1), (0, 2, 1), (0, 1, UNKNOWN)):
        assert wanted(old, new, datum) == 0


def random_tile(seed: int, kind: int | None = None):
    """Return grid, data, patch, first cell; `kind` keeps the data that make such a demand."""
    rng = np.random.default_rng(seed)
    grid = rng.integers(0, 3, (24, 25)).astype(np.uint8)
    height = width = int(rng.integers(8, 17))
    patch = rng.integers(0, 3, (height, width)).astype(np.uint8)
    y0, x0 = int(rng.integers(24 - height + 1)), int(rng.integers(25 - width + 1))
    data = np.full(grid.shape, UNKNOWN, np.uint8)
    for _ in range(30):
        y, x = int(rng.integers(height)), int(rng.integers(width))
        facies = rng.integers(3)
        demand = wanted(grid[y0 + y, x0 + x], patch[y, x], facies)
        if kind is None or demand == kind:
            data[y0 + y, x0 + x] = facies
    return grid, data, patch, y0, x0


def kept_cells(grid, data, patch, y0, x0, overlap, sides) -> np.ndarray:
    workspace = make_cut(len(patch), overlap)
    keep_old(grid, data, patch, 0, 0, Box(y0, x0, len(patch), sides, overlap), workspace)
    return workspace.keep_mask


def strips_of(shape, overlap: int, sides: int) -> np.ndarray:
    inside = np.zeros(shape, bool)
    parts = np.s_[:, :overlap], np.s_[:overlap], np.s_[:, -overlap:], np.s_[-overlap:]
    for bit, part in zip((1, 2, 4, 8), parts, strict=True):
        if sides & bit:
            inside[part] = True
    return inside


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**16), st.integers(1, 4), st.sampled_from(SIDES))
def test_the_cut_never_drops_a_datum_that_was_right(seed, overlap, sides):
    grid, data, patch, y0, x0 = random_tile(seed, KEEP_OLD)
    kept = kept_cells(grid, data, patch, y0, x0, overlap, sides)
    there = data[y0 : y0 + len(patch), x0 : x0 + patch.shape[1]] != UNKNOWN
    assert kept[there & strips_of(patch.shape, overlap, sides)].all()


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**16), st.integers(1, 4), st.sampled_from(SIDES))
def test_the_cut_takes_every_datum_that_only_the_patch_honours(seed, overlap, sides):
    grid, data, patch, y0, x0 = random_tile(seed, TAKE_NEW)
    kept = kept_cells(grid, data, patch, y0, x0, overlap, sides)
    there = data[y0 : y0 + len(patch), x0 : x0 + patch.shape[1]] != UNKNOWN
    assert not kept[there].any()


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**16), st.integers(1, 4), st.sampled_from(SIDES))
def test_only_cells_of_the_strips_are_kept(seed, overlap, sides):
    tile = random_tile(seed)
    kept = kept_cells(*tile, overlap, sides)
    assert not kept[~strips_of(kept.shape, overlap, sides)].any()


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**16), st.sampled_from([1, 2, 4, 8]))
def test_each_side_is_cut_alike(seed, side):
    grid, data, patch, _, _ = random_tile(seed)
    size = min(patch.shape)
    grid, data, patch = grid[:size, :size], data[:size, :size], patch[:size, :size].copy()
    turn = {1: lambda a: a, 2: lambda a: a.T, 4: lambda a: a[:, ::-1], 8: lambda a: a.T[:, ::-1]}
    back = {**turn, 8: lambda a: a[:, ::-1].T}
    turned = [np.ascontiguousarray(back[side](a)) for a in (grid, data, patch)]
    kept = kept_cells(*turned, 0, 0, 3, side)
    np.testing.assert_array_equal(turn[side](kept), kept_cells(grid, data, patch, 0, 0, 3, 1))


def test_where_old_and_new_agree_the_cut_costs_nothing():
    rng = np.random.default_rng(1)
    grid = rng.integers(0, 2, (20, 20)).astype(np.uint8)
    patch = 1 - grid[:16, :16]
    patch[:, 2] = grid[:16, 2]
    patch[:, 3] = grid[:16, 3]
    no_data = np.full(grid.shape, UNKNOWN, np.uint8)
    kept = kept_cells(grid, no_data, patch, 0, 0, 6, 1)
    assert kept[:, :3].all()
    assert not kept[:, 3:].any()


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**16), st.integers(1, 4), st.sampled_from([0, 1, 2, 3]))
def test_paste_changes_only_what_is_not_kept_and_keeps_the_counts(seed, overlap, shape):
    grid, _, patch, y0, x0 = random_tile(seed)
    height, width = patch.shape
    kept = np.random.default_rng(seed).random(patch.shape) < 0.5
    simulated = strips_of(patch.shape, overlap, shape)
    kept &= simulated
    tile = np.s_[y0 : y0 + height, x0 : x0 + width]
    grid[tile] = np.where(simulated, grid[tile], UNKNOWN)
    expected = grid.copy()
    expected[tile] = np.where(kept, grid[tile], patch)
    counts = np.bincount(grid[tile][simulated], minlength=3)
    box, sources = Box(y0, x0, height, shape, overlap), np.zeros(grid.shape, np.int32) - 1
    paste(patch, 0, 0, box, kept, counts, grid, sources)
    np.testing.assert_array_equal(grid, expected)
    np.testing.assert_array_equal(counts, np.bincount(expected[tile].ravel(), minlength=3))
    flat = np.arange(patch.size).reshape(patch.shape)
    np.testing.assert_array_equal(sources[tile], np.where(kept, -1, flat))


@pytest.mark.parametrize("sides", SIDES)
def test_a_patch_like_the_grid_changes_nothing(sides):
    grid, data, patch, y0, x0 = random_tile(8)
    patch = grid[y0 : y0 + len(patch), x0 : x0 + patch.shape[1]].copy()
    kept = kept_cells(grid, data, patch, y0, x0, 3, sides)
    before = grid.copy()
    box, none = Box(y0, x0, len(patch), 0, 3), np.zeros(0, np.int64)
    paste(patch, 0, 0, box, kept, none, grid, np.zeros((0, 0), np.int32))
    np.testing.assert_array_equal(grid, before)
