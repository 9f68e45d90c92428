"""Test that the orders of the path are the symmetries of a square or box, and cover the grid."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from ccwsim.engine.lengths import ScaledLengths
from ccwsim.engine.stages.conditioning import legal_splits
from ccwsim.engine.stages.path import (
    FROM_ABOVE,
    N_ORIENTATIONS,
    ORDERS,
    along_path,
    cells_from_path,
    cells_to_path,
    clip_patches,
    from_path,
    in_layers,
    in_order,
    make_patches,
    make_path,
    n_tiles,
    to_path,
)

maps = st.tuples(st.integers(1, 12), st.integers(1, 12))
volumes = st.tuples(st.integers(1, 6), st.integers(1, 7), st.integers(1, 8))
shapes = st.one_of(maps, volumes)


def numbered(shape: tuple[int, ...]) -> np.ndarray:
    return np.arange(np.prod(shape)).reshape(shape)


def orientations_of(shape: tuple[int, ...]) -> range:
    """Return the orientations of a path in a map, or twice as many in a volume."""
    return range(N_ORIENTATIONS if len(shape) == 2 else 2 * FROM_ABOVE)


@given(shapes, st.data())
def test_turning_back_undoes_turning(shape, data):
    orientation = data.draw(st.sampled_from(orientations_of(shape)))
    image = numbered(shape)
    there = to_path(image, orientation)
    *layers, ny, nx = shape
    assert there.shape == (*layers, *((nx, ny) if orientation & 4 else (ny, nx)))
    assert in_layers(there.shape) == along_path(in_layers(shape), orientation)
    np.testing.assert_array_equal(from_path(there, orientation), image)


@given(st.integers(1, 5), maps, st.integers(0, N_ORIENTATIONS - 1))
def test_each_layer_of_a_volume_turns_as_a_map_does(nz, shape, orientation):
    image = numbered((nz, *shape))
    layers = np.array([to_path(layer, orientation) for layer in image])
    np.testing.assert_array_equal(to_path(image, orientation), layers)
    np.testing.assert_array_equal(to_path(image, orientation | FROM_ABOVE), layers[::-1])


@given(maps)
def test_the_orientations_are_the_rotations_and_their_mirror_images(shape):
    image = numbered(shape)
    turned = {(t.shape, t.tobytes()) for t in (to_path(image, o) for o in range(8))}
    quarter_turns = [np.rot90(m, k) for m in (image, image.T) for k in range(4)]
    assert turned == {(t.shape, t.tobytes()) for t in quarter_turns}


def test_the_orientations_start_twice_in_each_corner_once_along_each_axis():
    image = numbered((4, 6))
    starts = [tuple(to_path(image, o)[0, :2].tolist()) for o in range(N_ORIENTATIONS)]
    assert len(set(starts)) == 8
    assert sorted(start for start, _ in starts) == [0, 0, 5, 5, 18, 18, 23, 23]


def test_the_orientations_of_a_volume_start_twice_in_each_corner():
    image = numbered((3, 4, 6))
    starts = [to_path(image, o)[0, 0, 0] for o in range(16)]
    corners = image[::2, ::3, ::5].ravel()
    assert sorted(starts) == sorted([*corners, *corners])


def test_the_first_orientation_starts_in_the_south_west_along_rows():
    for image in (numbered((3, 4)), numbered((2, 3, 4))):
        np.testing.assert_array_equal(to_path(image, 0), image)


@given(shapes, st.data())
def test_cells_turn_with_the_image(shape, data):
    orientation = data.draw(st.sampled_from(orientations_of(shape)))
    image = numbered(shape)
    cell = st.tuples(*(st.integers(0, n - 1) for n in shape))
    cells = np.array(data.draw(st.lists(cell, min_size=1, max_size=5)))
    moved = cells_to_path(cells, image.shape, orientation)
    there = to_path(image, orientation)
    np.testing.assert_array_equal(there[tuple(moved.T)], image[tuple(cells.T)])
    if len(shape) == 3:
        np.testing.assert_array_equal(cells_from_path(moved, there.shape, orientation), cells)


@given(st.integers(1, 300), st.integers(4, 64), st.data())
def test_patches_cover_every_cell_and_none_is_needless(length, template, data):
    overlap = data.draw(st.integers(1, template // 2))
    n = n_tiles(length, template, overlap)
    covered = np.zeros(length + 2 * template, int)
    for k in range(n):
        first = k * (template - overlap)
        assert first < length
        covered[first : first + template] += 1
    assert covered[:length].min() >= 1
    if n > 1:
        assert (n - 1) * (template - overlap) + overlap < length


@pytest.mark.parametrize(("length", "n"), [(1, 1), (32, 1), (33, 2), (56, 2), (57, 3)])
def test_a_new_patch_begins_when_one_cell_is_left(length, n):
    assert n_tiles(length, 32, 8) == n


def test_the_orders_of_a_volume_go_along_each_axis_as_the_fastest_or_the_slowest():
    """Test that layers can be the slowest, the middle or the fastest axis of the path."""
    ways = set()
    for order, orientation in product(range(len(ORDERS)), range(2 * FROM_ABOVE)):
        path = make_path((6, 7, 8), orientation, (4, 4, 4), (1, 1, 1), order)
        layer, row, column = np.unravel_index(in_order(path), path.tiles)
        assert len(set(in_order(path).tolist())) == np.prod(path.tiles)
        cells = numbered((6, 7, 8))
        first = to_path(cells, orientation)[layer * 3, row * 3, column * 3]
        ways.add(tuple(first.tolist()))
    assert len(ways) == 48


def test_a_map_is_covered_row_after_row_in_any_order():
    for order in range(len(ORDERS)):
        path = make_path((1, 60, 100), 0, (1, 32, 32), (0, 8, 8), order)
        assert path.tiles == (1, 3, 4)
        if order == 0:
            assert in_order(path).tolist() == list(range(12))


def random_lengths(volume: bool, rng: np.random.Generator) -> ScaledLengths:
    template = tuple(int(n) for n in 4 * rng.integers(2, 5, 3))
    overlap = tuple(int(rng.integers(1, t // 2 + 1)) for t in template)
    if not volume:
        template, overlap = (1, *template[1:]), (0, *overlap[1:])
    return ScaledLengths(template, overlap, (0, 0, 0), volume=volume)  # type: ignore[arg-type]


@settings(max_examples=60, deadline=None)
@given(st.booleans(), st.integers(0, 15), st.integers(0, 2), st.integers(0, 2**16))
def test_patches_lie_on_what_is_simulated_already_just_where_their_sides_say(
    volume, orientation, order, seed
):
    rng = np.random.default_rng(seed)
    lengths = random_lengths(volume, rng)
    grid_shape = tuple(int(n) for n in rng.integers(1, 33, 3))
    if not volume:
        grid_shape, orientation = (1, *grid_shape[1:]), orientation % 8
        order = 0
    path = make_path(grid_shape, orientation, *lengths[:2], order)  # type: ignore[arg-type]
    splits = legal_splits(*lengths[:2], volume)
    split_of = rng.integers(0, len(splits), np.prod(path.tiles))
    patches = make_patches(path, lengths.step, lengths.overlap, np.array(splits), split_of)
    done = np.zeros(path.full, bool)
    for number, (z0, y0, x0, nz, ny, nx, sides, split, tile, part) in enumerate(patches.tolist()):
        own = np.s_[z0 : z0 + nz, y0 : y0 + ny, x0 : x0 + nx]
        assert split == split_of[tile]
        assert part < np.prod(splits[split])
        assert (sides == 0) == (number == 0)
        box = done[own]
        assert box.shape == (nz, ny, nx)  # unclipped patches are inside the grid of complete tiles
        overlap = np.zeros_like(box)
        oz, oy, ox = lengths.overlap
        overlap[:, :, :ox] |= bool(sides & 1)
        overlap[:, :oy] |= bool(sides & 2)
        overlap[:oz] |= bool(sides & 4)
        assert box[overlap].all()
        if len(set(split_of.tolist())) == 1:  # parts of other sizes may cover more cells
            np.testing.assert_array_equal(box, overlap)
        done[own] = True
    assert done.all()
    assert all(full >= n for full, n in zip(path.full, path.shape, strict=True))
    n_parts = np.array([np.prod(parts) for parts in splits])
    assert len(patches) == n_parts[split_of].sum()


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 15), st.integers(0, 2), st.integers(0, 2), st.integers(0, 2**16))
def test_clipped_patches_cover_the_grid_and_no_block_outside(orientation, order, level, seed):
    rng = np.random.default_rng(seed)
    own = random_lengths(True, rng)
    step = np.subtract(own.template, own.overlap)
    lengths = own._replace(level=(min(level, 1), level, level))
    block = np.array(lengths.block)
    lengths = lengths._replace(
        template=tuple(block * own.template), overlap=tuple(block * own.overlap)
    )
    grid_shape = tuple(int(n) for n in block * rng.integers(1, 33, 3) + rng.integers(0, 4, 3))
    offset = tuple(int(n) for n in rng.integers(0, block * step))
    path = make_path(grid_shape, orientation, *lengths[:2], order, offset)  # type: ignore[arg-type]
    splits = np.array([(1, 1, 1)])
    whole = np.zeros(np.prod(path.tiles), np.int64)
    patches = make_patches(path, lengths.step, lengths.overlap, splits, whole)
    kept = clip_patches(patches, path, lengths.overlap, lengths.block, lengths.cell_size)
    assert len(kept) <= len(patches)
    low = np.array(offset) // block * block
    high = -(-np.add(offset, path.shape) // block) * block
    done = np.zeros(path.full, bool)
    for number, (z0, y0, x0, nz, ny, nx, sides, *_) in enumerate(kept.tolist()):
        assert ((z0, y0, x0) >= low).all()
        assert (np.add((z0, y0, x0), (nz, ny, nx)) <= high).all()
        assert not np.any(np.array((z0, y0, x0, nz, ny, nx)) % np.tile(block, 2))
        assert (sides == 0) == (number == 0)
        box = done[z0 : z0 + nz, y0 : y0 + ny, x0 : x0 + nx]
        oz, oy, ox = lengths.overlap
        overlap = np.zeros_like(box)
        overlap[:, :, :ox] |= bool(sides & 1)
        overlap[:, :oy] |= bool(sides & 2)
        overlap[:oz] |= bool(sides & 4)
        np.testing.assert_array_equal(box, overlap)
        assert not box.all()  # each patch adds new cells
        box[:] = True
    assert done[tuple(map(slice, low, high))].all()
    if not any(offset) and path.full == path.shape:
        np.testing.assert_array_equal(kept, patches)
