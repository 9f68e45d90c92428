"""Test that the boundary cut is the cheapest path and keeps cells that honour data."""

from itertools import product
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from hypothesis.extra import numpy as hnp
from numpy.typing import NDArray

from ccwsim.engine.stages.conditioning import KEEP_OLD, TAKE_NEW, forced_side
from ccwsim.engine.stages.cut import (
    MAX_BIT_COST,
    MISSED_DATUM_COST,
    CutWorkspace,
    bit_boundary,
    boundary,
    keep_old,
    make_cut,
    paste,
)
from ccwsim.engine.stages.path import ABOVE, BELOW, BOTTOM, LEFT, RIGHT, TOP, UNKNOWN, Box


def cut_of(error: np.ndarray, demand: np.ndarray) -> CutWorkspace:
    n, m = error.shape
    loss = MISSED_DATUM_COST * ((demand == KEEP_OLD).astype(np.int64) - (demand == TAKE_NEW))
    workspace = make_cut((1, n, n), (0, m, m))._replace(off=error.astype(np.int64), loss=loss)
    for c in range(m):
        workspace.error[:n] |= error[:, c].astype(np.uint64) << np.uint64(c % 64)
    return workspace


def cut(error: np.ndarray, demand: np.ndarray) -> np.ndarray:
    workspace = cut_of(error, demand)
    boundary(workspace, *error.shape)
    return workspace.path


def cost_of(path, error: np.ndarray, demand: np.ndarray) -> tuple[int, int]:
    """Return the number of data that a path does not honour, and the error on both of its sides."""
    m = error.shape[1]
    dropped = seen = 0
    for i, c in enumerate(path):
        dropped += np.count_nonzero(demand[i, :c] == TAKE_NEW)
        dropped += np.count_nonzero(demand[i, c:] == KEEP_OLD)
        seen += int(error[i, max(c - 1, 0)]) + int(error[i, min(c, m - 1)])
    return int(dropped), seen


def cheapest(error: np.ndarray, demand: np.ndarray) -> tuple[int, int]:
    """Return the smallest cost of all paths, computed path by path."""
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
@given(st.integers(0, 2**32), st.integers(1, 40), st.integers(1, 63), st.floats(0, 0.6))
def test_a_bit_boundary_is_the_same_one(seed, n, m, share):
    error = (np.random.default_rng(seed).random((n, m)) < share).astype(np.uint8)
    no_data = np.zeros((n, m), np.uint8)
    expected, workspace = cut(error, no_data), cut_of(error, no_data)
    _, cost = cost_of(expected, error, no_data)
    assert bit_boundary(workspace, n, m) == (cost < MAX_BIT_COST)
    if cost < MAX_BIT_COST:
        assert np.array_equal(workspace.path, expected)


@pytest.mark.parametrize("m", [64, 65, 130])
def test_a_boundary_in_a_wide_overlap_is_where_nothing_differs(m):
    error = np.ones((9, m), np.uint8)
    error[:, m - 3 : m - 1] = 0
    assert (cut(error, np.zeros_like(error)) == m - 2).all()


@pytest.mark.slow
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
    assert MISSED_DATUM_COST > 2 * 400


def test_a_datum_is_worth_more_than_any_path_of_the_widest_strip():
    error = np.ones((1024, 512), np.uint8)
    error[:, 0] = 0
    demand = np.zeros_like(error)
    demand[512, 511] = KEEP_OLD
    assert cost_of(cut(error, demand), error, demand)[0] == 0


def test_a_demand_is_made_only_where_one_of_both_honours_the_datum():
    assert forced_side(old=1, new=0, datum=1) == KEEP_OLD
    assert forced_side(old=0, new=1, datum=1) == TAKE_NEW
    for old, new, datum in ((1, 1, 1), (0, 2, 1), (0, 1, UNKNOWN)):
        assert forced_side(old, new, datum) == 0


class Tile(NamedTuple):
    """A patch of any shape to paste into a grid; maps have one layer."""

    grid: NDArray[np.uint8]
    data: NDArray[np.uint8]
    patch: NDArray[np.uint8]
    first: tuple[int, int, int]

    @property
    def own(self) -> tuple[slice, ...]:
        """Position of the patch in the grid."""
        ends = zip(self.first, self.patch.shape, strict=True)
        return tuple(slice(start, start + n) for start, n in ends)

    def box(self, overlap: int, sides: int) -> Box:
        nz = self.patch.shape[0]
        deep = min(overlap, nz // 2) if nz > 1 else 0
        return Box._make((*self.first, *self.patch.shape, sides, deep, overlap, overlap))


def random_tile(seed: int, kind: int | None = None, layers: int = 1) -> Tile:
    """Return a tile of random cells; with `kind`, only data that require this side of the cut."""
    rng = np.random.default_rng(seed)
    around = layers + 2 if layers > 1 else 1
    grid = rng.integers(0, 3, (around, 24, 25)).astype(np.uint8)
    size = layers, int(rng.integers(8, 17)), int(rng.integers(8, 17))
    patch = rng.integers(0, 3, size).astype(np.uint8)
    first = tuple(int(rng.integers(m - n + 1)) for m, n in zip(grid.shape, size, strict=True))
    tile = Tile(grid, np.full(grid.shape, UNKNOWN, np.uint8), patch, first)  # type: ignore[arg-type]
    for _ in range(30 * layers):
        cell, facies = tuple(rng.integers(0, size)), rng.integers(3)
        demand = forced_side(grid[tile.own][cell], patch[cell], facies)
        if kind is None or demand == kind:
            tile.data[tile.own][cell] = facies
    return tile


def kept_cells(tile: Tile, overlap: int, sides: int) -> np.ndarray:
    box, size = tile.box(overlap, sides), tile.patch.shape
    workspace = make_cut((box.nz, box.ny, box.nx), (box.oz, box.oy, box.ox))
    keep_old(tile.grid, tile.data, tile.patch, (0, 0, 0), box, workspace)
    assert workspace.keep_mask.shape == size
    return workspace.keep_mask


def strips_of(box: Box) -> np.ndarray:
    """Return the mask of the cells of a box in its overlap."""
    inside = np.zeros((box.nz, box.ny, box.nx), bool)
    oz, oy, ox = box[-3:]
    n, m, w = inside.shape
    parts = {
        LEFT: np.s_[:, :, :ox], TOP: np.s_[:, :oy], BELOW: np.s_[:oz],
        RIGHT: np.s_[:, :, w - ox :], BOTTOM: np.s_[:, m - oy :], ABOVE: np.s_[n - oz :],
    }  # fmt: skip
    for bit, part in parts.items():
        if box.sides & bit:
            inside[part] = True
    return inside


MAP_SIDES = [
    LEFT * a + TOP * b + RIGHT * c + BOTTOM * d for a, b, c, d in product((0, 1), repeat=4)
]
tiles = st.one_of(
    st.tuples(st.just(1), st.sampled_from(MAP_SIDES)),
    st.tuples(st.integers(2, 5), st.integers(0, 63)),
)
"""Numbers of layers, and sides of the tile with an overlap."""


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 2**16), st.integers(1, 4), tiles)
def test_the_cut_never_drops_a_datum_that_was_right(seed, overlap, layers_and_sides):
    layers, sides = layers_and_sides
    tile = random_tile(seed, KEEP_OLD, layers)
    kept = kept_cells(tile, overlap, sides)
    there = tile.data[tile.own] != UNKNOWN
    assert kept[there & strips_of(tile.box(overlap, sides))].all()


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 2**16), st.integers(1, 4), tiles)
def test_the_cut_takes_every_datum_that_only_the_patch_honours(seed, overlap, layers_and_sides):
    layers, sides = layers_and_sides
    tile = random_tile(seed, TAKE_NEW, layers)
    kept = kept_cells(tile, overlap, sides)
    assert not kept[tile.data[tile.own] != UNKNOWN].any()


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 2**16), st.integers(1, 4), tiles)
def test_only_cells_of_the_strips_are_kept(seed, overlap, layers_and_sides):
    layers, sides = layers_and_sides
    tile = random_tile(seed, layers=layers)
    kept = kept_cells(tile, overlap, sides)
    assert not kept[~strips_of(tile.box(overlap, sides))].any()


TURNS = {
    LEFT: lambda a: a,
    TOP: lambda a: a.swapaxes(1, 2),
    RIGHT: lambda a: a[:, :, ::-1],
    BOTTOM: lambda a: a.swapaxes(1, 2)[:, :, ::-1],
    BELOW: lambda a: a.swapaxes(0, 2),
    ABOVE: lambda a: a.swapaxes(0, 2)[:, :, ::-1],
}
"""Functions that turn a tile so that a cut along each side becomes a cut on the left."""
BACK = {
    **TURNS,
    BOTTOM: lambda a: a[:, :, ::-1].swapaxes(1, 2),
    ABOVE: lambda a: a[:, :, ::-1].swapaxes(0, 2),
}


@settings(max_examples=80, deadline=None)
@given(st.integers(0, 2**16), st.sampled_from([*TURNS]), st.booleans())
def test_each_side_is_cut_alike(seed, side, volume):
    if not volume and side in (BELOW, ABOVE):
        return
    tile = random_tile(seed, layers=8 if volume else 1)
    size = min(tile.patch.shape[1:])
    size = min(size, tile.patch.shape[0]) if volume else size
    own = np.s_[: size if volume else 1, :size, :size]
    arrays = [each[own] for each in (tile.grid, tile.data, tile.patch)]
    one = Tile._make([*map(np.ascontiguousarray, arrays), (0, 0, 0)])
    other = Tile._make([*(np.ascontiguousarray(BACK[side](a)) for a in arrays), (0, 0, 0)])
    turned = TURNS[side](kept_cells(other, 3, side))
    np.testing.assert_array_equal(turned, kept_cells(one, 3, LEFT))


@pytest.mark.parametrize("layers", [1, 3])
def test_where_old_and_new_agree_the_cut_costs_nothing(layers):
    rng = np.random.default_rng(1)
    grid = rng.integers(0, 2, (layers, 20, 20)).astype(np.uint8)
    patch = 1 - grid[:, :16, :16]
    patch[:, :, 2] = grid[:, :16, 2]
    patch[:, :, 3] = grid[:, :16, 3]
    no_data = np.full(grid.shape, UNKNOWN, np.uint8)
    kept = kept_cells(Tile(grid, no_data, patch, (0, 0, 0)), 6, LEFT)
    assert kept[:, :, :2].all()
    assert kept[:, :, 2].all() or layers > 1  # of equal cuts, volumes keep fewest cells
    assert not kept[:, :, 3:].any()


@settings(max_examples=80, deadline=None)
@given(st.integers(0, 2**16), st.integers(1, 4), st.integers(0, 7), st.integers(1, 4))
def test_paste_changes_only_what_is_not_kept_and_keeps_the_counts(seed, overlap, sides, layers):
    tile = random_tile(seed, layers=layers)
    grid, patch, box = tile.grid, tile.patch, tile.box(overlap, sides)
    rng = np.random.default_rng(seed)
    simulated = strips_of(box)
    kept = (rng.random(patch.shape) < 0.5) & simulated
    grid[tile.own] = np.where(simulated, grid[tile.own], UNKNOWN)
    expected = grid.copy()
    expected[tile.own] = np.where(kept, grid[tile.own], patch)
    counts = np.bincount(grid[tile.own][simulated], minlength=3)
    sources = np.zeros(grid.shape, np.int32) - 1
    around = [(int(rng.integers(3)), int(rng.integers(3))) for _ in range(3)]
    image, place = np.pad(patch, around), tuple(before for before, _ in around)
    paste(image, place, box, kept, counts, grid, sources)
    np.testing.assert_array_equal(grid, expected)
    np.testing.assert_array_equal(counts, np.bincount(expected[tile.own].ravel(), minlength=3))
    flat = np.arange(image.size).reshape(image.shape)
    flat = flat[tuple(slice(a, a + n) for a, n in zip(place, patch.shape, strict=True))]
    np.testing.assert_array_equal(sources[tile.own], np.where(kept, -1, flat))
    sources[tile.own] = -1
    assert (sources == -1).all()


@pytest.mark.parametrize("sides", MAP_SIDES)
def test_a_patch_like_the_grid_changes_nothing(sides):
    for layers in (1, 4):
        tile = random_tile(8, layers=layers)
        tile = tile._replace(patch=tile.grid[tile.own].copy())
        for own in (sides, sides | BELOW, sides | ABOVE):
            kept = kept_cells(tile, 3, own)
            before, none = tile.grid.copy(), np.zeros(0, np.int64)
            no_sources = np.zeros((0, 0, 0), np.int32)
            paste(tile.patch, (0, 0, 0), tile.box(3, 0), kept, none, tile.grid, no_sources)
            np.testing.assert_array_equal(tile.grid, before)
