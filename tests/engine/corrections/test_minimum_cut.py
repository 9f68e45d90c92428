"""Test that the cut of a volume costs as much as the maximum flow that SciPy computes."""

from __future__ import annotations

from itertools import permutations, product
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import breadth_first_order, maximum_flow

from ccwsim.engine.corrections.minimum_cut import BROKEN_CELL, make_flow, minimum_cut
from ccwsim.engine.stages.conditioning import KEEP_OLD, TAKE_NEW, forced_side
from ccwsim.engine.stages.cut import keep_old, make_cut
from ccwsim.engine.stages.path import ABOVE, BELOW, BOTTOM, LEFT, RIGHT, TOP, UNKNOWN, Box
from tests.small_images import blobs

pytestmark = pytest.mark.slow
"""The tests are slow; golden digests and `test_volumes` test cuts of volumes in the quick tests."""

FACES = ((BELOW, ABOVE), (TOP, BOTTOM), (LEFT, RIGHT))
"""Sides at the beginning and the end of each axis, z first."""
SEEDS = st.integers(0, 2**32)
THIN = [(1, 6, 7), (6, 1, 7), (6, 7, 1), (2, 5, 6), (5, 2, 2), (1, 1, 8), (1, 1, 1)]
sizes = st.one_of(
    st.tuples(st.integers(2, 6), st.integers(2, 6), st.integers(2, 6)), st.sampled_from(THIN)
)


class Case(NamedTuple):
    """A box on a grid with data, and the location of the image from which a patch is pasted."""

    grid: NDArray[np.uint8]
    data: NDArray[np.uint8]
    image: NDArray[np.uint8]
    place: tuple[int, int, int]
    box: Box

    @property
    def own(self) -> tuple[slice, ...]:
        b = self.box
        return np.s_[b.z0 : b.z0 + b.nz, b.y0 : b.y0 + b.ny, b.x0 : b.x0 + b.nx]

    @property
    def old(self) -> NDArray[np.uint8]:
        return self.grid[self.own]

    @property
    def new(self) -> NDArray[np.uint8]:
        (z, y, x), b = self.place, self.box
        return self.image[z : z + b.nz, y : y + b.ny, x : x + b.nx]

    @property
    def free(self) -> NDArray[np.bool_]:
        """Mask of the cells in the overlap, which may stay old or become new."""
        return overlap_of(self.box)

    @property
    def demand(self) -> NDArray[np.int64]:
        cells = zip(self.old.flat, self.new.flat, self.data[self.own].flat, strict=True)
        return np.array([forced_side(*each) for each in cells]).reshape(self.old.shape) * self.free


def overlap_of(box: Box) -> NDArray[np.bool_]:
    """Return the mask of the cells of a box in an overlap, shape (nz, ny, nx)."""
    free = np.zeros((box.nz, box.ny, box.nx), bool)
    for axis, (width, (first, last)) in enumerate(zip(box[-3:], FACES, strict=True)):
        along = np.moveaxis(free, axis, 0)
        along[:width] |= bool(box.sides & first)
        along[len(along) - width :] |= bool(box.sides & last)
    return free


def random_case(
    size: tuple[int, int, int], sides: int, n_facies: int, n_data: int, seed: int
) -> Case:
    rng = np.random.default_rng(seed)
    first, place = rng.integers(0, 3, 3), rng.integers(0, 4, 3)
    shape, of_image = first + size + rng.integers(0, 3, 3), place + size + rng.integers(0, 3, 3)
    grid = rng.integers(0, n_facies, shape).astype(np.uint8)
    image = rng.integers(0, n_facies, of_image).astype(np.uint8)
    widths = [int(rng.integers(1, max(n // 2, 1) + 1)) for n in size]
    box = Box._make((*first.tolist(), *size, sides, *widths))
    data = np.full(grid.shape, UNKNOWN, np.uint8)
    case = Case(grid, data, image, tuple(place.tolist()), box)
    if rng.random() < 0.5:  # large equal parts, as in well-fitting patches
        alike = rng.random(size) < 0.6
        case.new[alike] = case.old[alike]
    inside = ~case.free
    case.old[inside] = UNKNOWN if seed % 2 else case.old[inside]  # as if this were the first patch
    cells = rng.integers(0, size, (n_data, 3)) + first
    data[tuple(cells.T)] = rng.integers(0, n_facies, n_data)
    return case


def links(case: Case) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Return the link costs between pairs of cells, shape (n, 3), to old cells and to new cells.

    Cells are numbered in the box. A link between two cells costs 1 for each of them that differs.
    The cells beyond a side with an overlap are old, and count as different if the cell at the side
    is different. Beyond the overlap all cells are new, and count as different if the other cell of
    the link is different.
    """
    differs, free = (case.old != case.new).astype(int), case.free
    number = np.arange(free.size).reshape(free.shape)
    pairs, stays, new = [], np.zeros(free.size, int), np.zeros(free.size, int)
    for axis in range(3):
        d, f, at = (np.moveaxis(a, axis, 0) for a in (differs, free, number))
        both = f[:-1] & f[1:]
        cost = d[:-1] + d[1:]
        pairs.append(np.stack([at[:-1][both], at[1:][both], cost[both]], axis=1))
        for own, other in ((np.s_[:-1], np.s_[1:]), (np.s_[1:], np.s_[:-1])):
            edge = f[own] & ~f[other]
            np.add.at(new, at[own][edge], 2 * d[own][edge])
        for side, end in zip(FACES[axis], (0, -1), strict=True):
            if case.box.sides & side:
                np.add.at(stays, at[end].ravel(), 2 * d[end].ravel())
    return np.concatenate(pairs), stays * free.ravel(), new


def largest_flow(case: Case) -> tuple[int, NDArray[np.bool_]]:
    """Return the maximum flow by SciPy, and the mask of cells still connected to the old cells."""
    pairs, stays, new = links(case)
    demand = case.demand.ravel()
    stays = stays + BROKEN_CELL * (demand == KEEP_OLD)
    new = new + BROKEN_CELL * (demand == TAKE_NEW)
    n = case.free.size
    source, sink, cells = n, n + 1, np.arange(n)
    first = np.concatenate([pairs[:, 0], pairs[:, 1], np.full(n, source), cells])
    last = np.concatenate([pairs[:, 1], pairs[:, 0], cells, np.full(n, sink)])
    most = np.concatenate([pairs[:, 2], pairs[:, 2], stays, new]).astype(np.int32)
    graph = csr_array((most, (first, last)), shape=(n + 2, n + 2))
    found = maximum_flow(graph, source, sink)
    left = csr_array(graph - found.flow)
    left.eliminate_zeros()
    reached = np.zeros(n + 2, bool)
    reached[breadth_first_order(left, source, return_predecessors=False)] = True
    assert not reached[sink]
    return found.flow_value, reached[:n].reshape(case.free.shape)


def price(case: Case, kept: NDArray[np.bool_]) -> int:
    """Return the cost of the seam between old and new cells, including the cost of lost data."""
    pairs, stays, new = links(case)
    k = kept.ravel()
    seam = pairs[:, 2] @ (k[pairs[:, 0]] != k[pairs[:, 1]]) + stays @ ~k + new @ k
    dropped = (case.demand == KEEP_OLD) & ~kept | (case.demand == TAKE_NEW) & kept
    return int(seam) + BROKEN_CELL * int(dropped.sum())


def cut(case: Case, flow=None) -> tuple[int, NDArray[np.bool_]]:
    """Return the cost and the mask of the compiled cut."""
    b = case.box
    kept = np.zeros((b.nz, b.ny, b.nx), np.bool_)
    flow = flow or make_flow((b.nz, b.ny, b.nx))
    cost = minimum_cut(case.grid, case.data, case.image, case.place, b, flow, kept)
    return cost, kept


def check(case: Case, flow=None) -> None:
    cost, kept = cut(case, flow)
    largest, reached = largest_flow(case)
    assert cost == largest == price(case, kept)
    assert not kept[~case.free].any()
    assert kept[case.demand == KEEP_OLD].all()
    assert not kept[case.demand == TAKE_NEW].any()
    np.testing.assert_array_equal(kept, reached)  # the cheapest cut with the fewest old cells


@settings(max_examples=200, deadline=None)
@given(sizes, st.integers(0, 63), st.integers(2, 4), st.integers(0, 12), SEEDS)
def test_the_cut_is_the_largest_flow(size, sides, n_facies, n_data, seed):
    check(random_case(size, sides, n_facies, n_data, seed))


@pytest.mark.parametrize("size", [(3, 4, 5), (4, 4, 4), *THIN])
def test_every_combination_of_sides_is_cut_as_cheaply_as_can_be(size):
    for sides in range(64):
        check(random_case(size, sides, 2 + sides % 3, sides % 5, sides))


def test_cuts_of_one_workspace_do_not_disturb_each_other():
    flow = make_flow((6, 7, 8))
    rng = np.random.default_rng(4)
    for seed in range(60):
        size = int(rng.integers(1, 7)), int(rng.integers(1, 8)), int(rng.integers(1, 9))
        check(random_case(size, int(rng.integers(64)), 3, int(rng.integers(6)), seed), flow)


@pytest.mark.parametrize("smooth", [True, False])
@pytest.mark.parametrize("n_facies", [2, 4])
def test_large_patches_are_cut_as_cheaply_as_can_be(smooth, n_facies):
    for seed, sides in enumerate([LEFT, LEFT | TOP, LEFT | TOP | BELOW, BELOW, 63]):
        case = random_case((14, 16, 18), sides, n_facies, 60, seed)
        if smooth:  # with bodies, as in images
            case.grid[:] = blobs(case.grid.shape, n_facies, seed)
            case.image[:] = blobs(case.image.shape, n_facies, seed + 9)
        check(case)


@settings(max_examples=12, deadline=None)
@given(st.integers(0, 63), st.integers(2, 4), SEEDS)
def test_no_cut_of_a_tiny_box_is_cheaper(sides, n_facies, seed):
    case = random_case((2, 2, 3), sides, n_facies, 3, seed)
    where = np.argwhere(case.free)[:10]
    cost, kept = cut(case)
    for choice in product((False, True), repeat=len(where)):
        other = kept.copy()
        other[tuple(where.T)] = choice
        assert price(case, other) >= cost


@settings(max_examples=40, deadline=None)
@given(sizes, st.integers(0, 63), SEEDS)
def test_dense_data_that_change_from_cell_to_cell_are_all_honoured(size, sides, seed):
    case = random_case(size, sides, 2, 0, seed)
    rng = np.random.default_rng(seed)
    case.data[:] = rng.integers(0, 2, case.data.shape)
    check(case)


@settings(max_examples=40, deadline=None)
@given(sizes, st.integers(0, 63), SEEDS)
def test_where_old_and_new_agree_the_cut_costs_nothing(size, sides, seed):
    case = random_case(size, sides, 3, 5, seed)
    case.new[case.free] = case.old[case.free]
    assert cut(case)[0] == 0


@settings(max_examples=40, deadline=None)
@given(SEEDS, st.integers(2, 3))
def test_a_wall_where_both_agree_is_the_seam(seed, at):
    rng = np.random.default_rng(seed)
    new = rng.integers(0, 2, (4, 5, 12)).astype(np.uint8)
    grid = 1 - new
    grid[:, :, at : at + 2] = new[:, :, at : at + 2]
    box = Box(0, 0, 0, 4, 5, 12, LEFT, 1, 1, 6)
    case = Case(grid, np.full_like(grid, UNKNOWN), new, (0, 0, 0), box)
    cost, kept = cut(case)
    assert cost == 0
    assert kept[:, :, :at].all()
    assert not kept[:, :, at + 2 :].any()


@settings(max_examples=40, deadline=None)
@given(st.sampled_from([*permutations(range(3))]), st.integers(0, 7), st.booleans(), SEEDS)
def test_axes_and_ends_are_cut_alike(turn, flips, with_data, seed):
    """Test that turning a box also turns its cut."""
    size, sides = (4, 5, 6), int(np.random.default_rng(seed).integers(64))
    case = random_case(size, sides, 3, 4 if with_data else 0, seed)
    cost, kept = cut(case)
    flipped = tuple(axis for axis in range(3) if flips >> axis & 1)

    def turned(cells: NDArray) -> NDArray:
        return np.ascontiguousarray(np.flip(cells, flipped).transpose(turn))

    faces = [[*reversed(f)] if k in flipped else [*f] for k, f in enumerate(FACES)]
    turned_sides = sum(
        FACES[new][end]
        for new, old in enumerate(turn)
        for end in range(2)
        if sides & faces[old][end]
    )
    widths = [case.box[-3:][old] for old in turn]
    box = Box._make((0, 0, 0, *(size[old] for old in turn), turned_sides, *widths))
    arrays = (turned(each) for each in (case.old, case.data[case.own], case.new))
    other = Case._make([*arrays, (0, 0, 0), box])
    turned_cost, turned_kept = cut(other)
    assert turned_cost == cost
    np.testing.assert_array_equal(turned_kept, turned(kept))


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 63), SEEDS)
def test_keep_old_takes_this_cut_in_volumes(sides, seed):
    case = random_case((4, 5, 6), sides, 3, 6, seed)
    work = make_cut((6, 7, 8), (3, 3, 3))
    work.keep_mask[:] = True  # left by an earlier patch
    keep_old(case.grid, case.data, case.image, case.place, case.box, work)
    np.testing.assert_array_equal(work.keep_mask[:4, :5, :6], cut(case)[1])
