"""Test the penalties of missed data against a plain loop over data and locations."""

from math import prod

import numpy as np
import pytest
from hypothesis import example, given, settings, strategies as st

from ccwsim.engine.stages.conditioning import (
    DENSE_WEIGHTS,
    MAX_PATCH_DATA,
    SPARSE,
    add_missed,
    data_ahead,
    legal_splits,
    make_misses,
    place_data,
    ruled_out,
    split_tiles,
    start_totals,
    total_type,
)
from ccwsim.engine.stages.path import UNKNOWN, Box, make_path
from ccwsim.engine.stages.pyramid import build_pyramid
from tests.small_images import noise

N_FACIES = 3


def random_data(shape: tuple[int, ...], n: int, rng: np.random.Generator):
    """Return cells and facies of n data in random order."""
    flat = rng.choice(prod(shape), n, replace=False)
    cells = np.stack(np.unravel_index(flat, shape), axis=1)
    return cells, rng.integers(0, N_FACIES, n).astype("u1")


def plain_loop(image, grid, cells, facies, box, ahead, block, costs, proportions, totals, keep):
    """Add penalties like `add_missed`, for one location and one datum at a time."""
    ends = [length // b * b for length, b in zip(image.shape, block, strict=True)]
    for cell, code in zip(cells, facies, strict=True):
        at = np.subtract(cell, box[:3])
        if (at < 0).any() or (at >= ahead * np.array(box[3:6])).any():
            continue
        cost = costs.ahead
        if (at < box[3:6]).all():
            cost = costs.held if keep and grid[tuple(cell)] == code else costs.missed
        for place in np.ndindex(totals.shape):
            there = np.multiply(place, block) + at
            if (there < ends).all():
                totals[place] += int(cost) * (image[tuple(there)] != code)
            else:
                totals[place] += int(cost * (1.0 - proportions[code]))


MAP, VOLUME = 1, 3
dimensions = st.sampled_from([MAP, VOLUME])


@settings(max_examples=120, deadline=None)
@given(
    dimensions,
    st.integers(0, 2),
    st.integers(1, 4),
    st.integers(0, 40),
    st.sampled_from([7, 2.3]),
    st.sampled_from([np.int32, np.int64]),
    st.integers(0, 2**16),
)
@example(MAP, 2, 4, 1500, 7, np.int64, 0)  # more data than fit into one pass, or into a byte
@example(MAP, 2, 1, 1500, 7, np.int32, 5)
@example(MAP, 1, 2, 400, 7, np.int64, 2)
@example(VOLUME, 1, 2, 3000, 7, np.int32, 3)
@example(VOLUME, 0, 1, 900, 2.3, np.int64, 8)
def test_missed_data_cost_what_a_plain_loop_counts(
    dimension, level, co_template, n, datum_cost, kind, seed
):
    rng = np.random.default_rng(seed)
    levels = (int(rng.integers(level + 1)), level, int(rng.integers(level + 1)))
    levels = levels if dimension == VOLUME else (0, level, level)
    block = np.array([2**k for k in levels])
    most = 7 if dimension == MAP else 4
    blocks = rng.integers(1, most, 3)
    more, spare = rng.integers(14, size=3), rng.integers(1, 12, 3)
    if dimension == MAP:
        blocks[0], more[0], spare[0] = 1, 0, 0
    template = block * blocks
    image = noise(tuple(template + more // (1 if dimension == MAP else 2)), N_FACIES)
    grid = noise(tuple(template + spare), N_FACIES, seed)
    n = min(n, grid.size)
    cells, facies = random_data(grid.shape, n, rng)
    phases = build_pyramid(image, levels, N_FACIES).phases
    places = tuple(
        (length // b) - t // b + 1
        for length, t, b in zip(image.shape, template, block, strict=True)
    )
    proportions = np.bincount(image.ravel(), minlength=N_FACIES) / image.size
    totals = rng.integers(-1000, 1000, places).astype(kind)
    weights = DENSE_WEIGHTS if seed % 2 else SPARSE
    size = template.copy()
    if seed % 3 == 0:  # parts of split tiles may contain incomplete blocks
        size = rng.integers((template + 1) // 2, template + 1)
    first = [int(rng.integers(k + 1)) for k in spare]
    box, keep = Box._make((*first, *size.tolist(), 0, 1, 1, 1)), seed % 5 != 0
    costs = weights._replace(**{
        name: getattr(weights, name) * datum_cost for name in ("missed", "held", "ahead")
    })  # fmt: skip
    expected = totals.astype(np.int64)
    plain_loop(
        image, grid, cells, facies, box, co_template, block, costs, proportions, expected, keep
    )
    data = place_data(cells, facies, grid.shape, keep)  # type: ignore[arg-type]
    misses = make_misses(n, phases.shape[3:], places)
    if seed % 4 == 0:  # as if column numbers did not fit into a byte
        misses = misses._replace(column_of=misses.column_of[:0])
    layers = 0, phases.shape[3]
    given = (
        phases,
        layers,
        grid,
        data,
        box,
        co_template,
        proportions,
        weights,
        float(datum_cost),
        misses,
    )
    before = totals.copy()
    add_missed(*given, totals)
    np.testing.assert_array_equal(totals, expected)
    add_missed(*given, before)  # again, with the used workspace
    np.testing.assert_array_equal(before, expected)


@pytest.mark.parametrize("axis", range(3))
def test_data_beyond_the_end_of_the_image_cost_their_chance_along_each_axis(axis):
    """Test a datum that is only in the co-template, at locations where the image ends."""
    template = np.array([4, 6, 8])
    image = noise(tuple(template + 1), N_FACIES)
    grid = noise(tuple(2 * template), N_FACIES)
    cell = np.ones(3, int)
    cell[axis] = template[axis]
    data = place_data(cell[None], np.array([2], np.uint8), grid.shape)  # type: ignore[arg-type]
    phases, places = build_pyramid(image, (0, 0, 0), N_FACIES).phases, (2, 2, 2)
    totals = np.zeros(places, np.int32)
    proportions = np.array([0.5, 0.25, 0.25])
    misses = make_misses(1, image.shape, places)  # type: ignore[arg-type]
    box = Box._make((0, 0, 0, *template.tolist(), 0, 1, 1, 1))
    add_missed(
        phases, (0, phases.shape[3]), grid, data, box, 2, proportions, SPARSE, 10.0, misses, totals
    )
    chance = np.moveaxis(totals, axis, 0)
    assert (chance[1] == int(10 * SPARSE.ahead * 0.75)).all()
    facies = np.moveaxis(image, axis, 0)[template[axis], 1:3, 1:3]
    np.testing.assert_array_equal(chance[0], 10 * SPARSE.ahead * (facies != 2))


@given(dimensions, st.integers(0, 30), st.integers(0, 2**16))
def test_placed_data_are_the_data(nz, n, seed):
    rng = np.random.default_rng(seed)
    shape = nz, 7, 9
    cells, facies = random_data(shape, n, rng)
    expected = np.full(shape, UNKNOWN)
    for cell, code in zip(cells, facies, strict=True):
        expected[tuple(cell)] = code
    for keep in (True, False):
        data = place_data(cells, facies, shape, keep)
        np.testing.assert_array_equal(data.facies, expected)
        assert (data.required == (expected if keep else UNKNOWN)).all()
        for z, y in np.ndindex(nz, 7):
            columns = data.columns[data.first[z * 7 + y] : data.first[z * 7 + y + 1]]
            np.testing.assert_array_equal(columns, np.flatnonzero(expected[z, y] != UNKNOWN))


@settings(deadline=None)
@given(dimensions, st.integers(0, 8), st.integers(0, 2**16), st.integers(1, 4))
def test_data_ahead_are_seen_wherever_they_lie(nz, n, seed, times):
    rng = np.random.default_rng(seed)
    shape = nz, 9, 8
    cells, facies = random_data(shape, n, rng)
    data = place_data(cells, facies, shape)
    first, size = rng.integers(0, shape), rng.integers(1, 4, 3)
    part = tuple(slice(a, a + times * n) for a, n in zip(first, size, strict=True))
    there = (data.facies[part] != UNKNOWN).any()
    box = Box._make((*first.tolist(), *size.tolist(), 0, 0, 1, 1))
    assert data_ahead(data, box, times) == there


@settings(deadline=None)
@given(
    st.integers(0, 2**16),
    st.floats(0.001, 1),
    st.sampled_from([40, 255, 5000]),
    st.sampled_from([np.int16, np.int32, np.int64]),
    st.sampled_from([np.int32, np.int64]),
)
def test_the_best_share_of_the_overlaps_is_kept(seed, share, spread, of_scores, of_totals):
    rng = np.random.default_rng(seed)
    scores = rng.integers(-spread // 2, spread // 2, 13 * 17).astype(of_scores)
    totals = np.empty(scores.shape, of_totals)
    start_totals(scores, share, False, totals)
    out = ruled_out(totals)
    kept = totals < out // 2
    assert (totals[kept] == scores[kept]).all()
    assert (totals[~kept] == scores[~kept] + of_totals(out)).all()
    assert np.count_nonzero(kept) >= share * scores.size
    assert scores[kept].max() < scores[~kept].min(initial=np.iinfo(np.int16).max)
    class_width = (int(scores.max()) - int(scores.min())) // 256 + 1
    needed = np.sort(scores)[int(np.ceil(share * scores.size)) - 1]
    assert scores[kept].max() < needed + class_width


def test_excluded_locations_do_not_change_the_share_of_the_others():
    scores = np.random.default_rng(0).integers(-7000, 7000, 400).astype(np.int16)
    mixed = np.insert(scores, range(0, 400, 2), 2**15 - 1)
    alone, among = np.empty(400, np.int32), np.empty(600, np.int32)
    start_totals(scores, 0.1, False, alone)
    start_totals(mixed, 0.1, True, among)
    assert (among[mixed < 2**14] == alone).all()
    assert np.count_nonzero(alone < ruled_out(alone) // 2) < 80


def test_where_all_overlaps_are_alike_none_is_ruled_out():
    totals = np.empty(30, np.int64)
    start_totals(np.full(30, 3, np.int16), 0.01, False, totals)
    assert (totals == 3).all()


@pytest.mark.parametrize("bound", [0, 2**29 - 1, 2**29, 2.0**40, 2.0**58])
def test_a_ruled_out_location_is_worse_than_any_other_and_fits_its_type(bound):
    kind = total_type(bound)
    out = int(ruled_out(np.zeros(1, kind)))
    assert (kind is np.int32) == (bound < 2**29)
    assert out - bound > bound  # scores are between −bound and bound
    assert out + bound <= np.iinfo(kind).max


@st.composite
def templates(draw):
    """Return template and overlap along each axis of a map or a volume."""
    sizes = st.integers(4, 128).flatmap(lambda t: st.tuples(st.just(t), st.integers(1, t // 2)))
    y = draw(sizes)
    each = draw(st.one_of(st.tuples(sizes, st.just(y), sizes), st.just((y, y, y))))
    if draw(st.booleans()):
        each = ((1, 0), *each[1:])
    return tuple(zip(*each, strict=True))


@given(templates(), st.booleans())
def test_parts_of_a_split_tile_cover_it_and_hold_their_overlap(lengths, volume):
    template, overlap = lengths
    splits = legal_splits(template, overlap, volume)
    assert splits[0] == (1, 1, 1)
    assert len(set(splits)) == len(splits)
    halves = [parts for parts in splits if sorted(parts) == [1, 1, 2]]
    alike = [parts for parts in splits if parts not in halves]
    assert splits == alike[:1] + halves + sorted(alike[1:])
    assert volume or not halves
    assert all(parts[1] == parts[2] >= parts[0] for parts in alike)
    for parts in splits:
        for t, o, n in zip(template, overlap, parts, strict=True):
            size, remainder = divmod(t - o, n)
            assert remainder == 0
            assert (n - 1) * size + size + o == t
            assert 2 * o <= size + o
    if template[0] == 1:
        assert all(parts[0] == 1 for parts in splits)


@pytest.mark.parametrize("n", [0, 5, MAX_PATCH_DATA, MAX_PATCH_DATA + 1, 40, 200, 700])
def test_a_tile_of_a_map_is_split_until_its_parts_hold_few_data(n):
    template, overlap = (1, 32, 32), (0, 4, 4)
    splits = legal_splits(template, overlap)
    step = np.subtract(template, overlap)
    cells, facies = random_data(template, n, np.random.default_rng(n))
    path = make_path((1, 60, 60), 0, template, overlap)  # 2 × 2 tiles, data in the last tile
    first = step * (np.array(path.tiles) - 1)
    data = place_data(cells + first, facies, path.full)
    shares = [prod(step // parts + overlap) / prod(template) for parts in np.array(splits)]
    few = np.flatnonzero([n * share <= MAX_PATCH_DATA for share in shares])
    expected = few[0] if len(few) else len(splits) - 1
    assert split_tiles(splits, data, path, template, overlap)[-1] == expected


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_tile_with_a_well_is_halved_along_the_well(axis):
    template, overlap = (16, 16, 16), (4, 4, 4)
    path = make_path((28, 28, 28), 0, template, overlap)
    well = np.full((28, 3), 20)
    well[:, axis] = np.arange(28)
    data = place_data(well, np.zeros(28, np.uint8), path.full)
    splits = legal_splits(template, overlap, volume=True)
    split_of = split_tiles(splits, data, path, template, overlap, volume=True).reshape(path.tiles)
    crossed = np.moveaxis(np.zeros(path.tiles, bool), axis, 0)
    crossed[:, 1, 1] = True  # 16 data per tile, 10 per half
    halves = tuple(2 if a == axis else 1 for a in range(3))
    assert splits[1:4] == [(2, 1, 1), (1, 2, 1), (1, 1, 2)]
    for tile in np.ndindex(path.tiles):
        wanted = halves if np.moveaxis(crossed, 0, axis)[tile] else (1, 1, 1)
        assert splits[split_of[tile]] == wanted


@settings(max_examples=40, deadline=None)
@given(dimensions, st.integers(0, 200), st.integers(1, 40), st.integers(0, 2**16))
def test_each_tile_counts_the_data_in_it(dimension, n, max_data, seed):
    rng, volume = np.random.default_rng(seed), dimension != MAP
    template, overlap = ((8, 12, 12), (2, 3, 3)) if volume else ((1, 16, 16), (0, 4, 4))
    grid_shape = tuple(int(k) for k in rng.integers(1, 33, 3))
    grid_shape = grid_shape if volume else (1, *grid_shape[1:])
    path = make_path(grid_shape, 0, template, overlap)  # type: ignore[arg-type]
    cells, facies = random_data(grid_shape, min(n, prod(grid_shape)), rng)
    data = place_data(cells, facies, path.full)
    splits = legal_splits(template, overlap, volume)
    split_of = split_tiles(splits, data, path, template, overlap, max_data, volume)
    step = np.subtract(template, overlap)

    def n_inside(first, size):
        return ((cells >= first) & (cells < first + size)).all(axis=1).sum()

    for tile, at in enumerate(np.ndindex(path.tiles)):
        first, few = step * at, []
        for k in splits:
            size = step // k + overlap
            if volume:
                of_parts = [n_inside(first + step // k * part, size) for part in np.ndindex(k)]
                few.append(max(of_parts) <= max_data)
            else:
                few.append(prod(size) * n_inside(first, template) <= max_data * prod(template))
        assert split_of[tile] == (few.index(True) if True in few else len(splits) - 1)
