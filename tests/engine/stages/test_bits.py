"""Test that comparing 64 facies at once gives the same result as comparing them one by one."""

import numpy as np
from hypothesis import given, settings, strategies as st

from ccwsim.engine.corrections.refinement import data_at_stake, refine_place
from ccwsim.engine.stages.bits import (
    make_strips,
    n_bits,
    n_different,
    nth_bit,
    take_strips,
    to_bits,
    to_square_bits,
)
from ccwsim.engine.stages.conditioning import UNKNOWN, place_data
from ccwsim.engine.stages.path import ABOVE, BELOW, BOTTOM, LEFT, RIGHT, TOP, Box, inside_overlap

SEEDS = st.integers(0, 2**32)
FACIES = st.sampled_from([1, 2, 3, 5, 200])
LAYERS = st.sampled_from([1, 1, 2, 5])


@settings(max_examples=60, deadline=None)
@given(seed=SEEDS, n_facies=FACIES, nz=LAYERS, nx=st.sampled_from([1, 63, 64, 65, 130, 200]))
def test_bits_are_those_of_each_cell(seed, n_facies, nz, nx):
    image = np.random.default_rng(seed).integers(0, n_facies, (nz, 3, nx)).astype(np.uint8)
    words = to_bits(image)
    x = np.arange(nx)
    bits = words[..., x // 64] >> (x % 64).astype(np.uint64) & np.uint64(1)
    plane = np.arange(len(words), dtype=np.uint64)[:, None, None, None]
    np.testing.assert_array_equal((bits << plane).sum(axis=0), image)


@settings(max_examples=60, deadline=None)
@given(
    seed=SEEDS,
    n_facies=FACIES,
    nz=LAYERS,
    ny=st.sampled_from([1, 7, 8, 20]),
    nx=st.sampled_from([1, 7, 8, 9, 30]),
)
def test_bits_of_squares_are_those_of_each_cell(seed, n_facies, nz, ny, nx):
    image = np.random.default_rng(seed).integers(0, n_facies, (nz, ny, nx)).astype(np.uint8)
    words = to_square_bits(image)
    wide = np.pad(image, ((0, 0), (0, 8), (0, 8)))  # beyond the image no bit is set
    for y, x in np.ndindex(ny, nx):
        columns = words.view(np.uint8)[:, :, y, x : x + 8]
        square = np.unpackbits(columns[..., None], axis=3, bitorder="little").swapaxes(2, 3)
        plane = 1 << np.arange(len(words))[:, None, None, None]
        np.testing.assert_array_equal((square * plane).sum(axis=0), wide[:, y : y + 8, x : x + 8])


@given(st.integers(1, 2**64 - 1), st.data())
def test_each_bit_of_a_word_is_found(word, data):
    bits = [k for k in range(64) if word >> k & 1]
    n = data.draw(st.integers(0, len(bits) - 1))
    assert nth_bit(np.uint64(word), n) == bits[n]


@given(st.integers(0, 2**64 - 1))
def test_bits_of_a_word_are_counted(word):
    assert n_bits(np.uint64(word)) == word.bit_count()


def overlap_mask(box: Box) -> np.ndarray:
    """Return the mask of the cells of a box in its overlap."""
    mask = np.zeros((box.nz, box.ny, box.nx), bool)
    faces = (BELOW, ABOVE), (TOP, BOTTOM), (LEFT, RIGHT)
    for axis, (width, (first, last)) in enumerate(zip(box[-3:], faces, strict=True)):
        along = np.moveaxis(mask, axis, 0)
        along[:width] |= bool(box.sides & first)
        along[len(along) - width :] |= bool(box.sides & last)
    return mask


@given(st.integers(0, 63), st.tuples(*[st.integers(1, 9)] * 3), SEEDS)
def test_what_no_overlap_reaches_lies_inside(sides, size, seed):
    rng = np.random.default_rng(seed)
    widths = [int(rng.integers(n // 2 + 1)) for n in size]
    box = Box._make((3, 4, 5, *size, sides, *widths))
    low_z, high_z, low_y, high_y, low_x, high_x = inside_overlap(box)
    outside = np.ones(size, bool)
    outside[low_z:high_z, low_y:high_y, low_x:high_x] = False
    np.testing.assert_array_equal(outside, overlap_mask(box))


@settings(max_examples=200, deadline=None)
@given(
    seed=SEEDS,
    n_facies=FACIES,
    nz=LAYERS,
    size=st.sampled_from([1, 4, 31, 32, 63, 64, 65, 100]),
    data=st.data(),
)
def test_cells_that_differ_are_counted_as_one_by_one(seed, n_facies, nz, size, data):
    rng = np.random.default_rng(seed)
    ny = int(rng.integers(1, 9)) if nz > 1 else size
    more, spare = (2 if nz > 1 else 0, 9, 70), (1 if nz > 1 else 0, 3, 5)
    shape = nz, ny, size
    image = rng.integers(0, n_facies, np.add(shape, more)).astype(np.uint8)
    grid = rng.integers(0, n_facies, np.add(shape, spare)).astype(np.uint8)
    overlap = data.draw(st.sampled_from([size // 4, size // 2]))
    sides = data.draw(st.integers(0, 63))
    first = [data.draw(st.integers(0, n)) for n in spare]
    place = tuple(data.draw(st.integers(0, n)) for n in more)
    widths = nz // 2, min(overlap, ny // 2), overlap
    box = Box._make((*first, *shape, sides, *widths))
    words = to_square_bits(image)
    longer = data.draw(st.sampled_from([0, 40]))
    strips = make_strips(words, (nz, ny + longer, size + longer))
    take_strips(grid, Box(0, 0, 0, *shape, LEFT, nz, ny, size), words, strips)  # replaced below
    take_strips(grid, box, words, strips)
    old, new = (
        cells[tuple(slice(a, a + n) for a, n in zip(at, shape, strict=True))]
        for cells, at in ((grid, first), (image, place))
    )
    expected = int(((old != new) & overlap_mask(box)).sum())
    known = words.ravel(), words.shape, place, strips
    assert n_different(*known, 1 << 60) == expected
    limit = data.draw(st.integers(0, expected + 3))
    assert min(n_different(*known, limit), limit) == min(expected, limit)


@settings(max_examples=120, deadline=None)
@given(
    seed=SEEDS,
    sides=st.integers(0, 7),
    level=st.tuples(st.integers(0, 3), st.integers(0, 3), st.integers(0, 3)),
    volume=st.booleans(),
    keep=st.sampled_from([True, True, False]),
)
def test_refinement_weighs_the_data_that_the_cut_cannot_keep(seed, sides, level, volume, keep):
    rng = np.random.default_rng(seed)
    size, overlap = ((6, 8, 10), (2, 3, 4)) if volume else ((1, 16, 16), (0, 4, 4))
    block = tuple(2**n for n in (level if volume else (0, level[1], level[1])))
    more, spare = np.array((6, 20, 27)) * (volume, 1, 1), np.array((2, 4, 6)) * (volume, 1, 1)
    image = rng.integers(0, 3, np.add(size, more)).astype(np.uint8)
    grid = rng.integers(0, 3, np.add(size, spare)).astype(np.uint8)
    cells = rng.permutation(np.argwhere(np.ones(grid.shape)))[:30]
    data = place_data(cells, rng.integers(0, 3, 30).astype(np.uint8), grid.shape, keep)
    first = [int(rng.integers(n + 1)) for n in spare]
    start = tuple(b * int(rng.integers(n // b + 1)) for n, b in zip(more, block, strict=True))
    box = Box._make((*first, *size, sides, *overlap))
    weight, words = 7, to_square_bits(image)
    at_stake, strips = np.zeros((30, 4), np.int64), make_strips(words, size)
    take_strips(grid, box, words, strips)
    lost = at_stake[: data_at_stake(grid, data, box, at_stake)]
    wrong, *place = refine_place(image, words, box, block, start, strips, lost, weight)
    mask = overlap_mask(box)
    own = tuple(slice(a, a + n) for a, n in zip(first, size, strict=True))
    old, known = grid[own], data.required[own]
    wanted = (known != UNKNOWN) & ~(mask & (old == known))

    def misfit(place: tuple[int, ...]) -> int:
        new = image[tuple(slice(a, a + n) for a, n in zip(place, size, strict=True))]
        return int((mask & (old != new)).sum()) + weight * int((wanted & (new != known)).sum())

    best, at = misfit(start), start
    stride = max(block) // 2
    while stride:
        middle = at
        steps = [[-stride, 0, stride] if stride <= b // 2 else [0] for b in block]
        for shift in np.array(np.meshgrid(*steps, indexing="ij")).reshape(3, -1).T:
            near = tuple(np.add(middle, shift).tolist())
            inside = all(0 <= k <= n for k, n in zip(near, more, strict=True))
            if inside and misfit(near) < best:
                best, at = misfit(near), near
        stride //= 2
    assert (wrong, *place) == (best, *at)
    assert all(abs(k - j) < b for k, j, b in zip(place, start, block, strict=True))
    np.testing.assert_array_equal(lost[:, :3], np.argwhere(wanted))
    np.testing.assert_array_equal(lost[:, 3], known[wanted])
