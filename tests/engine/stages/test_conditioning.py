"""What missed data add to the scores, against a plain loop over data and places."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from ccwsim.engine.stages.box import Box
from ccwsim.engine.stages.conditioning import (
    DENSE,
    MAX_DATA,
    RULED_OUT,
    SPARSE,
    add_missed,
    data_ahead,
    legal_splits,
    make_misses,
    place_data,
    split_tiles,
    start_totals,
)
from ccwsim.engine.stages.cut import UNKNOWN
from ccwsim.engine.stages.path import make_path
from ccwsim.engine.stages.pyramid import build_pyramid
from tests.small_images import noise

N_FACIES = 3


def random_data(shape: tuple[int, int], n: int, rng: np.random.Generator):
    """Return cells and facies of n data, in no order."""
    flat = rng.choice(shape[0] * shape[1], n, replace=False)
    return np.stack(np.divmod(flat, shape[1]), axis=1), rng.integers(0, N_FACIES, n).astype("u1")


def plain_loop(
    image, grid, cells, facies, tile, ahead, unit, unit_cost, weights, proportions, totals
):
    """Add the cost of missed data as `add_missed` does, one place and one datum at a time."""
    y0, x0, template = tile
    ny, nx = (length // unit * unit for length in image.shape)
    for (y, x), code in zip(cells, facies, strict=True):
        dy, dx = y - y0, x - x0
        if not (0 <= dy < ahead and 0 <= dx < ahead):
            continue
        weight = weights.ahead
        if dy < template and dx < template:
            weight = weights.held if grid[y, x] == code else weights.missed
        for py, px in np.ndindex(totals.shape):
            ty, tx = py * unit + dy, px * unit + dx
            if ty < ny and tx < nx:
                missed = image[ty, tx] != code
                totals[py, px] += weight * unit_cost * missed
            else:
                totals[py, px] += int(weight * unit_cost * (1.0 - proportions[code]))


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2), st.integers(1, 4), st.integers(0, 40), st.integers(0, 2**16))
@example(level=2, co_template=4, n=1500, seed=0)  # more than are counted at once, or in a byte
@example(level=2, co_template=1, n=1500, seed=5)
@example(level=1, co_template=2, n=400, seed=2)
def test_missed_data_cost_what_a_plain_loop_counts(level, co_template, n, seed):
    rng = np.random.default_rng(seed)
    unit = 2**level
    template = 2 * unit * int(rng.integers(1, 4))
    image = noise((template + int(rng.integers(14)), template + int(rng.integers(14))), N_FACIES)
    grid = noise((template + 11, template + 6), N_FACIES, seed)
    n = min(n, grid.size)
    cells, facies = random_data(grid.shape, n, rng)
    y0, x0 = int(rng.integers(12)), int(rng.integers(7))
    phases = build_pyramid(image, level, N_FACIES).phases
    places = tuple((length // unit) - template // unit + 1 for length in image.shape)
    proportions = np.bincount(image.ravel(), minlength=N_FACIES) / image.size
    totals = rng.integers(-1000, 1000, places)
    weights = DENSE if seed % 2 else SPARSE
    expected = totals.copy()
    ahead, part = co_template * template, (y0, x0, template)
    plain_loop(image, grid, cells, facies, part, ahead, unit, 7, weights, proportions, expected)
    data = place_data(cells, facies, grid.shape)
    box = Box(y0, x0, template, 0, 1)
    misses = make_misses(n, phases.shape[3], places)
    add_missed(phases, grid, data, box, ahead, proportions, weights, 7, misses, totals)
    np.testing.assert_array_equal(totals, expected)


@given(st.integers(0, 30), st.integers(0, 2**16))
def test_placed_data_are_the_data(n, seed):
    rng = np.random.default_rng(seed)
    cells, facies = random_data((7, 9), n, rng)
    data = place_data(cells, facies, (7, 9))
    expected = np.full((7, 9), UNKNOWN)
    for (y, x), code in zip(cells, facies, strict=True):
        expected[y, x] = code
    np.testing.assert_array_equal(data.facies, expected)
    for y in range(7):
        columns = data.columns[data.first[y] : data.first[y + 1]]
        np.testing.assert_array_equal(columns, np.flatnonzero(expected[y] != UNKNOWN))


@settings(deadline=None)
@given(st.integers(0, 8), st.integers(0, 2**16), st.integers(1, 12))
def test_data_ahead_are_seen_wherever_they_lie(n, seed, size):
    rng = np.random.default_rng(seed)
    cells, facies = random_data((9, 8), n, rng)
    data = place_data(cells, facies, (9, 8))
    y0, x0 = int(rng.integers(9)), int(rng.integers(8))
    there = (data.facies[y0 : y0 + size, x0 : x0 + size] != UNKNOWN).any()
    assert data_ahead(data, y0, x0, size) == there


@settings(deadline=None)
@given(st.integers(0, 2**16), st.floats(0.001, 1), st.sampled_from([40, 255, 5000]))
def test_the_best_share_of_the_overlaps_is_kept(seed, share, spread):
    rng = np.random.default_rng(seed)
    scores = rng.integers(-spread // 2, spread // 2, (13, 17)).astype(np.int16)
    totals = np.empty(scores.shape, np.int64)
    start_totals(scores, share, totals)
    kept = totals < RULED_OUT // 2
    assert (totals[kept] == scores[kept]).all()
    assert np.count_nonzero(kept) >= share * scores.size
    assert scores[kept].max() < scores[~kept].min(initial=np.iinfo(np.int16).max)
    class_width = (int(scores.max()) - int(scores.min())) // 256 + 1
    needed = np.sort(scores, axis=None)[int(np.ceil(share * scores.size)) - 1]
    assert scores[kept].max() < needed + class_width


def test_where_all_overlaps_are_alike_none_is_ruled_out():
    totals = np.empty((6, 5), np.int64)
    start_totals(np.full((6, 5), 3, np.int16), 0.01, totals)
    assert (totals == 3).all()


@given(st.integers(4, 128), st.data())
def test_parts_of_a_split_tile_cover_it_and_hold_their_overlap(template, data):
    overlap = data.draw(st.integers(1, template // 2))
    splits = legal_splits(template, overlap)
    assert splits[0] == 1
    for parts in splits:
        size, remainder = divmod(template - overlap, parts)
        assert remainder == 0
        assert (parts - 1) * size + size + overlap == template
        assert 2 * overlap <= size + overlap


@pytest.mark.parametrize("n", [0, 5, MAX_DATA, MAX_DATA + 1, 40, 200, 700])
def test_a_tile_is_split_until_its_parts_hold_few_data(n):
    template, overlap = 32, 4
    splits = np.array(legal_splits(template, overlap))
    cells, facies = random_data((template, template), n, np.random.default_rng(n))
    path = make_path((60, 60), 0, template, overlap)  # two rows of two tiles; the data lie in one
    data = place_data(np.add(cells, template - overlap), facies, path.full)
    size = (template - overlap) // splits + overlap
    few = np.flatnonzero(n * (size / template) ** 2 <= MAX_DATA)
    expected = few[0] if len(few) else len(splits) - 1
    assert split_tiles(splits.tolist(), data, path, template, overlap)[3] == expected
