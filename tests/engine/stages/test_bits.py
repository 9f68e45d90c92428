"""Comparing facies 64 cells at a time against comparing them one by one."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from ccwsim.engine.stages.bits import make_strips, n_different, take_strips, to_bits
from ccwsim.engine.stages.box import BOTTOM, LEFT, RIGHT, TOP, Box
from ccwsim.engine.stages.conditioning import place_data
from ccwsim.engine.stages.refinement import data_at_stake, refine_place

SEEDS = st.integers(0, 2**32)
FACIES = st.sampled_from([1, 2, 3, 5, 200])


@settings(max_examples=60, deadline=None)
@given(seed=SEEDS, n_facies=FACIES, nx=st.sampled_from([1, 63, 64, 65, 130, 200]))
def test_bits_are_those_of_each_cell(seed, n_facies, nx):
    image = np.random.default_rng(seed).integers(0, n_facies, (3, nx)).astype(np.uint8)
    words = to_bits(image)
    x = np.arange(nx)
    bits = words[:, :, x // 64] >> (x % 64).astype(np.uint64) & np.uint64(1)
    facies = (bits << np.arange(len(words), dtype=np.uint64)[:, None, None]).sum(axis=0)
    np.testing.assert_array_equal(facies, image)


def strip_mask(size, left, top, right, bottom):
    mask = np.zeros((size, size), bool)
    mask[:, :left] = mask[:top] = True
    mask[:, size - right :] = mask[size - bottom :] = True
    return mask


@settings(max_examples=150, deadline=None)
@given(
    seed=SEEDS,
    n_facies=FACIES,
    size=st.sampled_from([1, 4, 31, 32, 63, 64, 65, 100]),
    data=st.data(),
)
def test_cells_that_differ_are_counted_as_one_by_one(seed, n_facies, size, data):
    rng = np.random.default_rng(seed)
    image = rng.integers(0, n_facies, (size + 9, size + 70)).astype(np.uint8)
    grid = rng.integers(0, n_facies, (size + 3, size + 5)).astype(np.uint8)
    overlap = data.draw(st.sampled_from([size // 4, size // 2]))
    sides = data.draw(st.integers(0, 15))
    widths = [overlap if sides & side else 0 for side in (LEFT, TOP, RIGHT, BOTTOM)]
    y0, x0 = data.draw(st.integers(0, 3)), data.draw(st.integers(0, 5))
    ty, tx = data.draw(st.integers(0, 9)), data.draw(st.integers(0, 70))
    words = to_bits(image)
    strips = make_strips(words, size + data.draw(st.sampled_from([0, 40])))
    take_strips(grid, Box(0, 0, size, LEFT, size), strips)  # what was there before is replaced
    take_strips(grid, Box(y0, x0, size, sides, overlap), strips)
    old, new = grid[y0 : y0 + size, x0 : x0 + size], image[ty : ty + size, tx : tx + size]
    expected = int(((old != new) & strip_mask(size, *widths)).sum())
    assert n_different(words, ty, tx, size, strips, 1 << 60) == expected
    limit = data.draw(st.integers(0, expected + 3))
    assert min(n_different(words, ty, tx, size, strips, limit), limit) == min(expected, limit)


@settings(max_examples=60, deadline=None)
@given(seed=SEEDS, shape=st.sampled_from([0, LEFT, TOP, LEFT | TOP]), level=st.integers(1, 3))
def test_refinement_weighs_the_data_that_the_cut_cannot_keep(seed, shape, level):
    rng = np.random.default_rng(seed)
    image = rng.integers(0, 3, (40, 43)).astype(np.uint8)
    grid = rng.integers(0, 3, (20, 22)).astype(np.uint8)
    cells = rng.permutation(np.argwhere(np.ones(grid.shape)))[:30]
    data = place_data(cells, rng.integers(0, 3, 30).astype(np.uint8), grid.shape)
    y0, x0, size, overlap, unit = 2, 3, 16, 4, 2**level
    ty, tx = int(rng.integers(25)), int(rng.integers(28))
    words = to_bits(image)
    box, at_stake = Box(y0, x0, size, shape, overlap), np.zeros((30, 3), np.int64)
    strips = make_strips(words, size)
    place = refine_place(image, words, grid, data, box, unit, ty, tx, strips, at_stake)
    mask = strip_mask(size, overlap * bool(shape & LEFT), overlap * bool(shape & TOP), 0, 0)
    old, known = (a[y0 : y0 + size, x0 : x0 + size] for a in (grid, data.required))

    def misfit(y, x):
        new = image[y : y + size, x : x + size]
        missed = (known != 255) & (new != known) & ~(mask & (old == known))
        return int((mask & (old != new)).sum()) + 40 * int(missed.sum())

    best, at = misfit(ty, tx), (ty, tx)
    stride = unit // 2
    while stride:
        middle = at
        for dy in (-stride, 0, stride):
            for dx in (-stride, 0, stride):
                y, x = middle[0] + dy, middle[1] + dx
                if 0 <= y <= 24 and 0 <= x <= 27 and misfit(y, x) < best:
                    best, at = misfit(y, x), (y, x)
        stride //= 2
    assert place == at
    n = data_at_stake(grid, data, box, at_stake)
    wanted = (known != 255) & ~(mask & (old == known))
    np.testing.assert_array_equal(at_stake[:n, :2], np.argwhere(wanted))
