"""Test that cell repair reduces unseen patterns exactly as a repair in plain Python does."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from numpy.typing import NDArray

from ccwsim.engine.corrections import cell_repair
from ccwsim.engine.corrections.cell_repair import STAYS, cell_weights, ends_of_walks, repair_cells
from ccwsim.engine.corrections.resimulation import Target
from ccwsim.engine.corrections.unseen_patterns import Patterns, known_patterns
from ccwsim.engine.stages.bits import to_bits, to_square_bits
from ccwsim.engine.stages.candidates import draw_index
from ccwsim.engine.stages.path import UNKNOWN
from ccwsim.model.watch import Watch
from tests.small_images import blobs, noise

Cell = tuple[int, int, int]
SHAPES = [(1, 40, 50), (6, 14, 15)]


def target_of(image: NDArray[np.uint8], grid: NDArray[np.uint8], sources: bool = False) -> Target:
    data = np.full(grid.shape, UNKNOWN, np.uint8)
    origin = np.full(grid.shape if sources else (0, 0, 0), -1, np.int32)
    return Target(
        image, to_bits(image), to_square_bits(image), data, grid, origin, np.zeros(256, np.int64)
    )


def damaged(shape: Cell, n_facies: int, share: float, seed: int) -> NDArray[np.uint8]:
    """Return a grid that is similar to the images, with some cells changed."""
    grid = blobs(shape, n_facies, seed)
    rng = np.random.default_rng(seed)
    wrong = rng.random(shape) < share
    grid[wrong] = rng.integers(0, n_facies, int(wrong.sum()))
    return grid


def windows(cells: NDArray[np.uint8], patterns: Patterns) -> NDArray[np.uint8]:
    return np.lib.stride_tricks.sliding_window_view(cells, patterns.size)


def is_known(cells: NDArray[np.uint8], patterns: Patterns, weights: NDArray[np.uint32]) -> bool:
    """Return whether the image has a pattern with the same hash number."""
    labels = patterns.labels[cells.ravel()].astype(np.uint64)
    number = int((labels * weights).sum() % 2**32) >> patterns.shift
    return bool(patterns.known_bits[number // 8] >> number % 8 & 1)


class OneByOne:
    """Cell repair in plain Python, for a grid with only one part."""

    def __init__(self, target: Target, patterns: Patterns) -> None:
        self.patterns, self.weights = patterns, cell_weights(patterns)
        self.grid, self.data, self.cells = target.grid.copy(), target.data, patterns.size
        self.firsts = list(np.ndindex(windows(self.grid, patterns).shape[:3]))
        self.starts = set(self.firsts)
        self.balance = np.zeros(256, int)

    def is_unseen(self, first: Cell) -> bool:
        part = tuple(slice(k, k + n) for k, n in zip(first, self.cells, strict=True))
        return not is_known(self.grid[part], self.patterns, self.weights)

    def n_unseen(self, cell: Cell) -> int:
        """Count the unseen patterns that contain a cell."""
        around = product(*(range(k - n + 1, k + 1) for k, n in zip(cell, self.cells, strict=True)))
        own = set(around) & self.starts
        return sum(self.is_unseen(first) for first in own)

    def beside(self, cell: Cell) -> list[Cell]:
        """Return the neighbours of a cell: along x first, then y and z."""
        found = []
        for axis, step in product((2, 1, 0), (-1, 1)):
            place = list(cell)
            place[axis] += step
            inside = all(0 <= k < n for k, n in zip(place, self.grid.shape, strict=True))
            if inside and self.cells[axis] > 1:
                found.append(tuple(place))
        return found  # type: ignore[return-value]

    def more_after(self, cell: Cell, facies: int) -> int:
        """Return by how much the number of unseen patterns grows if a cell gets another facies."""
        own, before = self.grid[cell], self.n_unseen(cell)
        self.grid[cell] = facies
        more = self.n_unseen(cell) - before
        self.grid[cell] = own
        return more

    def changes(self, first: Cell) -> Iterator[tuple[Cell, int, int]]:
        """Yield changes of one cell of a pattern: cell, facies, number of added unseen patterns."""
        for step in np.ndindex(self.cells):
            cell: Cell = tuple(a + b for a, b in zip(first, step, strict=True))  # type: ignore[assignment]
            if self.data[cell] != UNKNOWN:
                continue
            latest = self.grid[cell]
            for facies in (int(self.grid[other]) for other in self.beside(cell)):
                if facies not in (self.grid[cell], latest):
                    latest = facies
                    yield cell, facies, self.more_after(cell, facies)

    def change(self, cell: Cell, facies: int) -> None:
        """Change a cell for good."""
        self.balance[self.grid[cell]] -= 1
        self.balance[facies] += 1
        self.grid[cell] = facies

    def excess(self, change: tuple[Cell, int, int]) -> int:
        """Return by how much more the new facies has been added so far than the old one."""
        return int(self.balance[change[1]] - self.balance[self.grid[change[0]]])

    def walk(self, first: Cell, rng: np.random.Generator) -> None:
        """Run a tabu search from a pattern, then restore the best state."""
        near, more, least, stays = [first], 0, 0, {}
        part = tuple(slice(k, k + n) for k, n in zip(first, self.cells, strict=True))
        at_data = (self.data[part] != UNKNOWN).any()
        share = (self.data != UNKNOWN).mean() if at_data else 0.0
        further, patience = ends_of_walks(self.cells[0] > 1, share)
        changed: list[tuple[Cell, int]] = []
        n_kept = 0
        while near and len(changed) < n_kept + patience:
            k = draw_index(rng, len(near))
            if not self.is_unseen(near[k]):
                near[k] = near[-1]
                near.pop()
                continue
            best, n_equal = None, 0
            for cell, facies, own in self.changes(near[k]):
                if stays.get(cell, 0) > len(changed) and more + own >= least:
                    continue
                rank = own, self.excess((cell, facies, own))
                if best is not None and rank > (best[2], best[3]):
                    continue
                n_equal = n_equal + 1 if best is not None and rank == (best[2], best[3]) else 1
                if n_equal == 1 or draw_index(rng, n_equal) == 0:
                    best = cell, facies, *rank
            if best is None or more + best[2] > least + further:
                break
            cell, facies, own, _ = best
            changed.append((cell, int(self.grid[cell])))
            around = (np.subtract(cell, step) for step in np.ndindex(self.cells))
            around = [tuple(other) for other in around if tuple(other) in self.starts]
            seen = [other for other in around if not self.is_unseen(other)]
            self.grid[cell] = facies
            near += [other for other in seen if self.is_unseen(other)]
            stays[cell], more = len(changed) + STAYS, more + own
            if more < least:
                least, n_kept = more, len(changed)
        for cell, facies in reversed(changed[n_kept:]):
            self.grid[cell] = facies
        kept = {cell: int(self.grid[cell]) for cell, _ in changed[:n_kept]}
        for cell, facies in reversed(changed[:n_kept]):
            self.grid[cell] = facies
        for cell, facies in kept.items():
            self.change(cell, facies)

    def repaired(self, rng: np.random.Generator, walks: bool) -> tuple[NDArray[np.uint8], int]:
        n_changed = 0
        found = [first for first in self.firsts if self.is_unseen(first)]
        for first in found:
            while self.is_unseen(first):
                ranked = (
                    (change[2], self.excess(change), change) for change in self.changes(first)
                )
                least = min(ranked, key=lambda each: each[:2], default=None)
                if least is None or least[0] >= 0:
                    break
                self.change(*least[2][:2])
                n_changed += 1
        for first in found if walks else ():
            if self.is_unseen(first):
                before = self.grid.copy()
                self.walk(first, rng)
                n_changed += int((self.grid != before).sum())
        return self.grid, n_changed


FIVE = [(SHAPES[0], False), (SHAPES[0], True), (SHAPES[1], False)]
"""Shapes and walks with five facies; plain Python takes a minute for walks through a volume."""


@pytest.mark.parametrize(
    ("shape", "n_facies", "walks"),
    [
        *product(SHAPES, (2, 3), (False, True)),
        *(pytest.param(shape, 5, walks, marks=pytest.mark.slow) for shape, walks in FIVE),
    ],
)
def test_cells_change_as_one_by_one_finds_it(shape, n_facies, walks, monkeypatch):
    image = blobs((shape[0] + 3 * (shape[0] > 1), 60, 70), n_facies)
    patterns = known_patterns(image, 1)
    grid = damaged((shape[0], 20, 22) if shape[0] == 1 else (5, 9, 10), n_facies, 0.04, 4)
    target = target_of(image, grid)
    target.data[:, ::7, ::5] = grid[:, ::7, ::5]
    monkeypatch.setattr(cell_repair, "SHARE_OF_DATA", 0.02)
    wanted, n_wanted = OneByOne(target, patterns).repaired(np.random.default_rng(3), walks)
    assert repair_cells(target, patterns, np.random.default_rng(3), walks) == n_wanted > 0
    np.testing.assert_array_equal(target.grid, wanted)


@pytest.mark.parametrize("n_facies", [2, 4])
@pytest.mark.parametrize("shape", SHAPES)
def test_parts_together_are_repaired_as_well(shape, n_facies, monkeypatch):
    image = blobs((shape[0] + 3 * (shape[0] > 1), 60, 70), n_facies)
    patterns = known_patterns(image, 1)
    grid = damaged(shape, n_facies, 0.02, 5)
    size = int(np.prod(patterns.size))
    known = {row.tobytes() for row in windows(image, patterns).reshape(-1, size)}

    def n_unseen(cells: NDArray[np.uint8]) -> int:
        return sum(row.tobytes() not in known for row in windows(cells, patterns).reshape(-1, size))

    before = n_unseen(grid)
    left = []
    for lengths in (shape, (3, 5, 7), (1, 1, 4)):
        monkeypatch.setattr(cell_repair, "PART_SHAPE", lengths)
        monkeypatch.setattr(cell_repair, "PART_SHAPE_VOLUME", lengths)
        monkeypatch.setattr(cell_repair, "PARTS_PER_CALL", 3)
        target = target_of(image, grid.copy())
        n_changed = repair_cells(target, patterns, np.random.default_rng(0), False)
        assert n_changed >= (target.grid != grid).sum() > 0
        left.append(n_unseen(target.grid))
    assert max(left) < 0.8 * before
    assert max(left) - min(left) < 0.2 * before


def test_nothing_changes_where_the_image_has_all_patterns():
    for shape in ((1, 50, 60), (8, 30, 32)):
        image = blobs(shape, 3)
        grid = image[..., 3:40, 5:44].copy()
        target = target_of(image, grid)
        assert repair_cells(target, known_patterns(image, 1), np.random.default_rng(0), True) == 0
        np.testing.assert_array_equal(target.grid, image[..., 3:40, 5:44])


def test_a_cell_alone_takes_the_facies_around_it_and_the_place_of_its_neighbours():
    image = np.zeros((1, 30, 30), np.uint8)
    image[:, 10:] = 1
    grid = image.copy()
    grid[0, 20, 20] = 0
    target = target_of(image, grid, sources=True)
    target.sources[:] = np.arange(image.size).reshape(image.shape)
    target.sources[0, 20, 20] = 0
    assert repair_cells(target, known_patterns(image, 1), np.random.default_rng(0), True) == 1
    np.testing.assert_array_equal(target.grid, image)
    np.testing.assert_array_equal(target.sources.ravel(), np.arange(image.size))
    grid[0, 20, 20] = 0
    target.data[0, 20, 20] = 0
    repair_cells(target, known_patterns(image, 1), np.random.default_rng(0), True)
    assert grid[0, 20, 20] == 0


@pytest.mark.parametrize("shape", SHAPES)
def test_walks_leave_fewer_patterns_unseen(shape):
    image = blobs((shape[0] + 3 * (shape[0] > 1), 60, 70), 3)
    patterns = known_patterns(image, 1)
    grid, left = damaged(shape, 3, 0.04, 4), []
    for walks in (False, True):
        target = target_of(image, grid.copy())
        repair_cells(target, patterns, np.random.default_rng(0), walks)
        work = OneByOne(target, patterns)
        left.append(sum(map(work.is_unseen, work.firsts)))
    assert left[1] < 0.8 * left[0]


@pytest.mark.parametrize("walks", [False, True])
def test_a_source_is_that_of_the_facies_or_none(walks):
    image, grid = blobs((9, 30, 30), 3), damaged((7, 24, 26), 3, 0.02, 6)
    target = target_of(image, grid, sources=True)
    flat = image.ravel()
    rng = np.random.default_rng(1)
    for facies in range(3):
        places = np.flatnonzero(flat == facies)
        target.sources[grid == facies] = rng.choice(places, int((grid == facies).sum()))
    before = grid.copy()
    assert repair_cells(target, known_patterns(image, 1), rng, walks) > 20
    changed = grid != before
    if not walks:  # tabu searches may change a cell back
        assert (target.sources[~changed] >= 0).all()
    taken = target.sources >= 0
    np.testing.assert_array_equal(grid[taken], flat[target.sources[taken]])
    assert taken[changed].any()
    assert not taken[changed].all()


@pytest.mark.parametrize("n_facies", [2, 3, 4])
@pytest.mark.parametrize("shape", SHAPES)
def test_weights_add_up_to_the_number_of_a_pattern(shape, n_facies):
    """Test that changing a cell changes the number of a pattern by the weight of the cell."""
    image = noise(shape, n_facies)
    patterns = known_patterns(image, 1)
    weights = cell_weights(patterns)
    own = windows(image, patterns)
    assert all(is_known(own[at], patterns, weights) for at in np.ndindex(own.shape[0], 9, 9))
    others = windows(noise(shape, n_facies, 1), patterns)
    found = [is_known(others[at], patterns, weights) for at in np.ndindex(others.shape[0], 9, 9)]
    assert np.mean(found) < 0.1


@settings(max_examples=25, deadline=None)
@given(
    st.tuples(st.integers(1, 9), st.integers(1, 30), st.integers(1, 30)),
    st.tuples(st.integers(1, 9), st.integers(1, 30), st.integers(1, 30)),
    st.integers(1, 4),
    st.integers(0, 2**16),
)
def test_any_grid_and_any_image_will_do(grid_shape, image_shape, n_facies, seed):
    image = noise(image_shape, n_facies, seed)
    rng = np.random.default_rng(seed)
    grid = rng.integers(0, n_facies, grid_shape).astype(np.uint8)
    target = target_of(image, grid, sources=True)
    target.data[rng.random(grid_shape) < 0.2] = 0
    known = target.data != UNKNOWN
    before = grid.copy()
    n = repair_cells(target, known_patterns(image, 1), rng, walks=seed % 2 == 0)
    assert n >= (grid != before).sum()
    assert (grid < n_facies).all()
    np.testing.assert_array_equal(grid[known], before[known])


@pytest.mark.parametrize("walks", [False, True])
@pytest.mark.parametrize("shape", SHAPES)
def test_an_image_without_structure_takes_no_more_work_than_its_cells_allow(
    shape, walks, monkeypatch
):
    parts = []
    made = cell_repair.make_part

    def make_part(*given):
        parts.append(made(*given))
        return parts[-1]

    monkeypatch.setattr(cell_repair, "make_part", make_part)
    image, left = noise((2 * shape[0] - 1, 60, 60), 4), []
    patterns = known_patterns(image, 1)
    n_of_a_pattern = 6 * len(cell_weights(patterns))  # maximum number of changes tried at once
    for n_trials in (0, 1, 10):
        target = target_of(image, noise(shape, 4, 1))
        before, rng = target.grid.copy(), np.random.default_rng(0)
        n_changed = repair_cells(target, patterns, rng, walks, trials_a_cell=n_trials)
        assert -n_of_a_pattern < parts[-1].trials[0] <= max(n_trials - 1, 0) * before.size
        left.append(n_changed)
        assert n_changed >= (target.grid != before).sum()
    assert left[0] == 0 < left[1] < left[2]


def test_it_can_be_stopped_and_tells_how_far_it_is(monkeypatch):
    image = blobs((1, 60, 60), 2)
    monkeypatch.setattr(cell_repair, "PART_SHAPE", (1, 10, 10))
    monkeypatch.setattr(cell_repair, "PARTS_PER_CALL", 4)
    seen: list[float] = []

    def report(share: float, n_done: int) -> None:
        seen.append(share)
        if share > 0.5:
            raise InterruptedError

    target, rng = target_of(image, noise((1, 90, 90), 2)), np.random.default_rng(0)
    with pytest.raises(InterruptedError):
        repair_cells(target, known_patterns(image, 1), rng, True, Watch(report))
    assert len(seen) > 3
    assert seen == sorted(seen)
    assert seen[0] == 0
