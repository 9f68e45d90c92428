"""Test windows around missed data: the search of locations, and the reported progress."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from numpy.typing import NDArray

from ccwsim import HardData, Parameters, TrainingImage, simulate
from ccwsim.engine.corrections import resimulation
from ccwsim.engine.corrections.resimulation import (
    ISOLATED_SHARE,
    MIN_SIZE,
    MIN_SIZE_ISOLATED,
    MIN_WINDOW_LAYERS,
    N_BEST_LOCATIONS,
    Target,
    _halved,
    best_windows,
    honouring_places,
    is_unknown,
    isolated_datum_thresholds,
    largest_window,
    make_honouring,
    own_counts,
    resimulate,
    window_around,
)
from ccwsim.engine.corrections.unseen_patterns import known_patterns
from ccwsim.engine.stages.bits import Strips, make_strips, take_strips, to_bits, to_square_bits
from ccwsim.engine.stages.conditioning import data_grid
from ccwsim.engine.stages.path import (
    ABOVE,
    BELOW,
    BOTTOM,
    LEFT,
    RIGHT,
    TOP,
    UNKNOWN,
    Box,
    inside_overlap,
)
from ccwsim.model.ensemble import FORCED
from ccwsim.model.watch import Watch
from tests.small_images import blobs, noise

PARAMETERS = Parameters(template_size=16, overlap_size=4)


NO_GAPS = np.zeros((0, 0, 0), np.int64)


def dense_data(shape: tuple[int, int], seed: int) -> HardData:
    """Return noise in every cell; few of its patterns occur in an image of bands."""
    codes = np.random.default_rng(seed).integers(0, 2, shape)
    return HardData(np.argwhere(np.ones(shape)), codes.ravel())


def whole(box: Box, shape: tuple[int, ...]) -> tuple[int, int]:
    """Return the part of the image that contains all rows of locations."""
    return 0, (shape[0] - box.nz + 1) * (shape[1] - box.ny + 1)


@pytest.mark.slow
@settings(max_examples=80, deadline=None)
@given(st.integers(1, 3), st.integers(4, 8), st.integers(0, 2**16))
def test_a_pattern_that_is_passed_over_has_no_location(n_facies, size, seed):
    rng = np.random.default_rng(seed)
    image = np.kron(noise((4, 4), n_facies, seed), np.ones((3, 3), np.uint8)).astype(np.uint8)
    first = rng.integers(0, 4, 2)
    grid = np.tile(image, (2, 2))[first[0] : first[0] + 12, first[1] : first[1] + 12].copy()
    for _ in range(int(rng.integers(3))):
        grid[tuple(rng.integers(0, 12, 2))] = rng.choice(np.unique(image))
    if seed % 3 == 0:
        grid[tuple(rng.integers(0, 12, 2))] = UNKNOWN
    patterns, bits = known_patterns(image[None], 1), to_bits(image[None])
    mask = np.empty(bits.shape[1:], np.uint64)
    for y0, x0 in np.ndindex(12 - size + 1, 12 - size + 1):
        box = Box(0, y0, x0, 1, size, size, 0, 0, 1, 1)
        for y, x in np.ndindex(size, size):
            if is_unknown(grid, box, y0 + y, x0 + x, patterns):
                assert (
                    honouring_places(
                        bits,
                        grid[None],
                        box,
                        (1, *image.shape),
                        (0, 1),
                        whole(box, (1, *image.shape)),
                        mask,
                    )
                    == 0
                )


def test_patterns_that_are_unknown_are_told():
    image = np.kron(np.indices((8, 8)).sum(0) % 2, np.ones((4, 4))).astype(np.uint8)
    patterns, box = known_patterns(image[None], 1), Box(0, 0, 0, 1, 8, 8, 0, 0, 1, 1)
    grid = np.random.default_rng(0).integers(0, 2, (8, 8)).astype(np.uint8)
    told = [is_unknown(grid, box, y, x, patterns) for y, x in np.ndindex(8, 8)]
    assert np.mean(told) > 0.9
    assert not any(is_unknown(image[:8, :8], box, y, x, patterns) for y, x in np.ndindex(8, 8))


def test_dense_data_give_the_same_realization_with_and_without_patterns(monkeypatch):
    image = TrainingImage(np.kron(noise((12, 12), 2, 4), np.ones((4, 4))))
    given = image, (40, 44), PARAMETERS, dense_data((40, 44), 0)
    one = simulate(*given, n_realizations=2, seed=3)
    monkeypatch.setattr(resimulation, "MAX_DATA_SHARE", 2.0)
    other = simulate(*given, n_realizations=2, seed=3)
    assert one.digest == other.digest
    np.testing.assert_array_equal(one.data_status, other.data_status)


def test_progress_goes_on_while_windows_are_simulated():
    image = TrainingImage(np.kron(noise((40, 40), 2, 4), np.ones((4, 4))))
    told: list[float] = []
    shape = 200, 200
    simulate(
        image, shape, PARAMETERS, dense_data(shape, 1), n_realizations=1, seed=3,
        progress=lambda share, _: told.append(share), n_workers=1,
    )  # fmt: skip
    assert told == sorted(told)
    assert told[-1] == 1.0


NO_SOURCES = np.zeros((0, 0, 0), np.int32)


def whole_image(image: NDArray[np.uint8]) -> tuple[tuple[int, ...], tuple[int, int]]:
    """Return the shape of an image, and its first layer and number of layers."""
    return image.shape, (0, len(image))


def target_of(image, grid, cells, facies, sources: NDArray[np.int32] = NO_SOURCES) -> Target:
    bits = to_bits(image), to_square_bits(image)
    return Target(
        image,
        *bits,
        data_grid(cells, facies, grid.shape),
        grid,
        sources,
        np.zeros(256, np.int64),
        volume=len(image) > 1,
    )


def test_windows_report_growing_shares_below_one():
    shape, shares = (1, 30, 30), []
    image = np.kron(noise((10, 10), 2, 4), np.ones((4, 4))).astype(np.uint8)[None]
    data = dense_data((30, 30), 2)
    grid, cells = np.zeros(shape, np.uint8), np.pad(data.cells, ((0, 0), (1, 0)))
    target = target_of(image, grid, cells, data.facies)
    thresholds = isolated_datum_thresholds(image)
    rng = np.random.default_rng(0)
    watch = Watch(lambda share, n_done: shares.append(share))
    resimulate(target, cells, (1, 16, 16), rng, thresholds, watch)
    assert shares == sorted(shares)
    assert 0 <= shares[0] < 0.5 < shares[-1] < 1
    np.testing.assert_array_equal(grid, target.data)


@settings(deadline=None)
@given(st.tuples(*[st.integers(1, 7)] * 3), st.integers(0, 2), st.integers(0, 2**16))
def test_own_counts_are_those_of_a_plain_loop(shape, layers, seed):
    rng = np.random.default_rng(seed)
    grid = rng.integers(0, 3, shape).astype(np.uint8)
    cells = np.argwhere(np.ones(shape))
    around = [*np.ndindex(2 * layers + 1, 5, 5)]
    near = (cells[:, None] + around - (layers, 2, 2)).clip(0, np.array(shape) - 1)
    expected = (grid[tuple(near.T)] == grid[tuple(cells.T)]).sum(axis=0)
    assert own_counts(grid, cells, layers).tolist() == expected.tolist()


@pytest.mark.parametrize("shape", [(1, 40, 50), (12, 20, 25)])
def test_few_cells_of_the_image_are_isolated_themselves(shape):
    image = blobs(shape, 3)
    thresholds = isolated_datum_thresholds(image)
    cells = np.argwhere(np.ones(shape))
    counts = own_counts(image, cells, 1 if shape[0] > 1 else 0)
    isolated = counts < thresholds[image.ravel()]
    assert isolated.mean() <= ISOLATED_SHARE
    assert (thresholds[:3] > 0).all()


sides_of = st.integers(1, 40)


@given(*[st.tuples(sides_of, sides_of, sides_of)] * 3)
def test_the_largest_window_fits_into_template_image_and_grid(template, image, grid):
    nz, ny, nx = largest_window(template, image, grid)
    assert ny == nx == min(template[1:] + image[1:] + grid[1:])
    assert nz == min(template[0], image[0], grid[0])


@given(st.integers(1, 64), st.integers(1, 64), st.sampled_from([MIN_SIZE, MIN_SIZE_ISOLATED]))
def test_windows_become_smaller_down_to_the_smallest(nz, side, smallest):
    sizes = _halved((nz, side, side), smallest)
    if side < smallest:
        assert sizes == []
        return
    assert sizes[0] == (nz, side, side)
    assert sizes[-1][1:] == (smallest, smallest)
    assert all(own[1] == own[2] >= smallest for own in sizes)
    assert all(min(nz, MIN_WINDOW_LAYERS) <= own[0] <= nz for own in sizes)
    cells = [np.prod(own) for own in sizes]
    assert all(a > b for a, b in pairwise(cells))
    if nz == 1:
        halves = [side >> k for k in range(7) if side >> k > smallest]
        assert [own[1] for own in sizes] == [*halves, smallest]


@given(st.tuples(*[st.integers(1, 20)] * 3), st.data())
def test_a_window_lies_around_its_cell_with_an_overlap_where_the_grid_goes_on(shape, data):
    size = tuple(data.draw(st.integers(1, n)) for n in shape)
    cell = tuple(data.draw(st.integers(0, n - 1)) for n in shape)
    box = window_around(*cell, size, shape)
    faces = (BELOW, ABOVE), (TOP, BOTTOM), (LEFT, RIGHT)
    assert box[3:6] == size
    for axis, (first, last) in enumerate(faces):
        start, n, length, at = box[axis], size[axis], shape[axis], cell[axis]
        assert 0 <= start <= at < start + n <= length
        assert bool(box.sides & first) == (start > 0)
        assert bool(box.sides & last) == (start + n < length)
        if 0 < start < length - n:
            assert start == at - n // 2
    low_z, high_z, low_y, high_y, low_x, high_x = inside_overlap(box)
    if min(size[1:]) >= 3:
        assert low_z < high_z
        assert low_y < high_y
        assert low_x < high_x


def random_window(seed: int, volume: bool, n_data: int, n_facies: int = 3):
    """Return an image, a grid, data, and a box in the grid with an overlap on random sides."""
    rng = np.random.default_rng(seed)
    size = tuple(int(n) for n in rng.integers(1, 6, 3))
    size = size if volume else (1, *size[1:])
    more, spare = rng.integers(0, 5, 3), rng.integers(0, 3, 3)
    more[2] *= 20
    if not volume:
        more[0] = spare[0] = 0
    image = noise(tuple(np.add(size, more)), n_facies, seed)
    grid = noise(tuple(np.add(size, spare)), n_facies, seed + 1)
    first = [int(rng.integers(n + 1)) for n in spare]
    widths = [int(rng.integers(1, n // 2 + 1)) if n > 1 else 0 for n in size]
    box = Box._make((*first, *size, int(rng.integers(64)), *widths))
    data = np.full(grid.shape, UNKNOWN, np.uint8)
    for cell in rng.integers(0, size, (n_data, 3)) + first:
        data[tuple(cell)] = rng.choice(image.ravel())  # the image contains every facies of the data
    return image, grid, data, box


def own_cells(cells: np.ndarray, first: tuple[int, ...], box: Box) -> np.ndarray:
    return cells[tuple(slice(a, a + n) for a, n in zip(first, box[3:6], strict=True))]


def honours(image, data, box) -> np.ndarray:
    """Return which locations honour all data of a box, computed location by location."""
    known = own_cells(data, box[:3], box)
    places = tuple(m - n + 1 for m, n in zip(image.shape, box[3:6], strict=True))
    found = np.zeros(places, bool)
    for place in np.ndindex(places):
        new = own_cells(image, place, box)
        found[place] = ((known == UNKNOWN) | (known == new)).all()
    return found


def strips_of(image: NDArray[np.uint8], grid: NDArray[np.uint8], box: Box) -> Strips:
    """Return the strips of a box, with which locations are compared."""
    bits = to_square_bits(image)
    strips = make_strips(bits, box[3:6])
    take_strips(grid, box, bits, strips)
    return strips


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 2**16), st.booleans(), st.integers(0, 4), st.sampled_from([1, 2, 3, 200]))
def test_places_that_honour_all_data_are_marked(seed, volume, n_data, n_facies):
    image, _, data, box = random_window(seed, volume, n_data, n_facies)
    bits = to_bits(image)
    mask = np.full(bits.shape[1:], 0x5A5A5A5A5A5A5A5A, np.uint64)  # old content is replaced
    n = honouring_places(bits, data, box, *whole_image(image), whole(box, image.shape), mask)
    expected = honours(image, data, box)
    assert n == np.count_nonzero(expected)
    x = np.arange(expected.shape[2])
    if n:
        own = mask[: expected.shape[0], : expected.shape[1]]
        marked = own[..., x // 64] >> (x % 64).astype(np.uint64) & np.uint64(1)
        np.testing.assert_array_equal(marked, expected)


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**16), st.booleans(), st.integers(0, 3), st.integers(0, 99))
def test_a_part_of_the_rows_goes_on_from_the_last_to_the_first(seed, volume, n_data, first):
    image, grid, data, box = random_window(seed, volume, n_data)
    bits, (_, n_rows) = to_bits(image), whole(box, image.shape)
    expected = honours(image, data, box)
    rows = expected.reshape(-1, expected.shape[2])
    honouring, strips = make_honouring(bits), strips_of(image, grid, box)
    first, some = first % n_rows, 1 + seed % n_rows
    own = [(first + k) % n_rows for k in range(some)]
    n = honouring_places(bits, data, box, *whole_image(image), (first, some), honouring.mask)
    assert n == np.count_nonzero(rows[own])
    if n:
        best, rng = np.empty((N_BEST_LOCATIONS, 4), np.int64), np.random.default_rng(seed)
        known = (
            to_square_bits(image),
            *whole_image(image),
            honouring,
            box,
            (first, some),
            strips,
        )
        n_best = best_windows(*known, (n, n, False), 10**6, NO_GAPS, rng, best)
        assert n_best == min(n, N_BEST_LOCATIONS)
        for _, *place in best[:n_best].tolist():
            assert expected[tuple(place)]
            assert place[0] * expected.shape[1] + place[1] in own


@pytest.mark.slow
@settings(max_examples=100, deadline=None)
@given(st.integers(0, 2**16), st.booleans(), st.integers(0, 2), st.sampled_from([0.1, 0.5, 1.0]))
def test_the_best_windows_are_those_whose_ring_fits_best(seed, volume, n_data, tolerance):
    image, grid, data, box = random_window(seed, volume, n_data)
    bits, every = to_bits(image), whole(box, image.shape)
    honouring = make_honouring(bits)
    n_places = honouring_places(bits, data, box, *whole_image(image), every, honouring.mask)
    if n_places == 0:
        return
    strips = strips_of(image, grid, box)
    low_z, high_z, low_y, high_y, low_x, high_x = inside_overlap(box)
    ring = np.ones(box[3:6], bool)
    ring[low_z:high_z, low_y:high_y, low_x:high_x] = False
    old, limit = own_cells(grid, box[:3], box), int(tolerance * ring.sum())
    misfits = {
        tuple(map(int, place)): int((own_cells(image, tuple(place), box) != old)[ring].sum())
        for place in np.argwhere(honours(image, data, box))
    }
    best, rng = np.empty((N_BEST_LOCATIONS, 4), np.int64), np.random.default_rng(seed)
    known = to_square_bits(image), *whole_image(image), honouring, box, every, strips
    n = best_windows(*known, (n_places, n_places, False), limit, NO_GAPS, rng, best)
    fitting = sorted(misfit for misfit in misfits.values() if misfit <= limit)
    found = best[:n].tolist()
    assert sorted(row[0] for row in found) == fitting[:N_BEST_LOCATIONS]
    assert len({tuple(row[1:]) for row in found}) == n
    assert all(misfits[tuple(place)] == misfit for misfit, *place in found)
    some = n_places, n_places / 3.3, bool(seed % 2)
    n = best_windows(*known, some, limit, NO_GAPS, rng, best)
    assert n <= len(fitting)
    assert all(misfits[tuple(place)] == misfit <= limit for misfit, *place in best[:n].tolist())


def looked_at(every: float, rng: np.random.Generator, by_chance: bool = False) -> list[int]:
    """Return the columns of compared locations, in an image of one row."""
    image = np.random.default_rng(1).integers(0, 2, (1, 1, 300)).astype(np.uint8)
    grid = np.zeros((1, 1, 4), np.uint8)
    box, bits = Box(0, 0, 0, 1, 1, 4, LEFT, 0, 0, 1), to_bits(image)
    data = np.full(grid.shape, UNKNOWN, np.uint8)
    data[0, 0, 2] = 0
    honouring, part = make_honouring(bits), whole(box, image.shape)
    n_places = honouring_places(bits, data, box, *whole_image(image), part, honouring.mask)
    best, sample = np.empty((300, 4), np.int64), (n_places, n_places / every, by_chance)
    known = (
        to_square_bits(image),
        *whole_image(image),
        honouring,
        box,
        part,
        strips_of(image, grid, box),
    )
    n = best_windows(*known, sample, 4, NO_GAPS, rng, best)
    return sorted(best[:n, 3].tolist())


@pytest.mark.slow
@pytest.mark.parametrize("every", [1.0, 1.4, 2.0, 7.5, 40.0])
def test_of_each_few_locations_one_is_looked_at(every):
    rng = np.random.default_rng(0)
    honouring = looked_at(1.0, rng)
    for _ in range(50):
        own = looked_at(every, rng)
        assert set(own) <= set(honouring)
        assert abs(len(own) - len(honouring) / every) <= 1


@pytest.mark.slow
@pytest.mark.parametrize("by_chance", [False, True])
@pytest.mark.parametrize("every", [1.4, 2.0, 7.5])
def test_all_locations_are_looked_at_equally_often(every, by_chance):
    rng = np.random.default_rng(0)
    honouring = looked_at(1.0, rng)
    seen = np.zeros(300)
    for _ in range(4000):
        seen[looked_at(every, rng, by_chance)] += 1
    seen = seen[honouring]
    assert abs(seen.mean() - 4000 / every) < 0.03 * 4000
    assert seen.min() > 0.8 * seen.mean()
    assert seen.max() < 1.2 * seen.mean()


@pytest.mark.slow
def test_equal_windows_are_found_equally_often_in_a_volume():
    image = np.zeros((4, 4, 5), np.uint8)
    image[0, 0, 0] = 1  # so that locations near this cell are excluded
    grid = np.zeros((6, 6, 6), np.uint8)
    data = np.full(grid.shape, UNKNOWN, np.uint8)
    data[2:4, 2:4, 2:4] = 0
    box, bits = Box(2, 2, 2, 2, 2, 2, LEFT, 0, 1, 1), to_bits(image)
    honouring, every = make_honouring(bits), whole(box, image.shape)
    n_places = honouring_places(bits, data, box, *whole_image(image), every, honouring.mask)
    assert n_places == 3 * 3 * 4 - 1
    known = (
        to_square_bits(image),
        *whole_image(image),
        honouring,
        box,
        every,
        strips_of(image, grid, box),
    )
    best, rng, seen = (
        np.empty((N_BEST_LOCATIONS, 4), np.int64),
        np.random.default_rng(0),
        np.zeros((3, 3, 4)),
    )
    for _ in range(3000):
        n = best_windows(*known, (n_places, n_places, False), 8, NO_GAPS, rng, best)
        seen[tuple(best[rng.integers(n), 1:])] += 1
    assert seen[0, 0, 0] == 0
    drawn = np.delete(seen.ravel(), 0)
    assert drawn.min() > 0.3 * drawn.mean()
    assert drawn.max() < 3 * drawn.mean()


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**16), st.integers(1, 3), st.integers(0, 80), st.booleans())
def test_no_datum_of_a_volume_is_left_wrong(seed, n_facies, n, isolated):
    rng = np.random.default_rng(seed)
    shape, of_image = tuple(rng.integers(1, 14, 3)), tuple(rng.integers((2, 8, 8), (12, 20, 20)))
    make = blobs if seed % 2 and n_facies > 1 else noise
    image = make(of_image, n_facies, seed)
    grid = noise(shape, n_facies, seed + 1) if seed % 3 else make(shape, n_facies, seed + 1)
    n = min(n, grid.size)
    cells = np.stack(np.unravel_index(rng.permutation(grid.size)[:n], shape), axis=1)
    facies = rng.integers(0, n_facies, n).astype(np.uint8)
    sources = np.full(shape, image.size, np.int32)
    before = grid.copy()
    target = target_of(image, grid, cells, facies, sources)
    thresholds = isolated_datum_thresholds(image) if isolated else None
    windows: list[tuple[int, tuple[int, int, int], bool]] = []
    status = resimulate(
        target, cells, (8, 8, 8), rng, thresholds, on_window=lambda *each: windows.append(each)
    )
    assert (grid[tuple(cells.T)] == facies).all()
    changed = sources != image.size
    np.testing.assert_array_equal(grid[~changed], before[~changed])
    taken = sources[changed & (sources >= 0)]
    np.testing.assert_array_equal(grid[changed & (sources >= 0)], image.ravel()[taken])
    assert {tuple(cell) for cell in np.argwhere(sources < 0)} <= set(
        map(tuple, cells[status == FORCED])
    )
    right = before[tuple(cells.T)] == facies
    if not isolated:
        assert (status[~right] != 0).sum() >= (changed.any() and (~right).any())
    for datum, lengths, fits in windows:
        assert 0 <= datum < n
        if lengths == (1, 1, 1) and fits:
            continue
        assert all(
            a <= b
            for a, b in zip(lengths, largest_window((8, 8, 8), image.shape, shape), strict=True)
        )


def test_a_volume_that_honours_its_data_stays_as_it_is():
    image, grid = blobs((10, 16, 16), 2), blobs((9, 17, 18), 2, seed=4)
    rng = np.random.default_rng(0)
    cells = np.stack(np.unravel_index(rng.permutation(grid.size)[:60], grid.shape), axis=1)
    before = grid.copy()
    target = target_of(image, grid, cells, grid[tuple(cells.T)])
    status = resimulate(target, cells, (8, 8, 8), rng)
    np.testing.assert_array_equal(grid, before)
    assert (status >= 0).all()
