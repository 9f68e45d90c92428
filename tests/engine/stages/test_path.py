"""The 8 ways of the path are the symmetries of a square, and patches cover the grid."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ccwsim.engine.stages.path import (
    N_ORIENTATIONS,
    cells_to_path,
    from_path,
    n_tiles,
    to_path,
)

orientations = st.integers(0, N_ORIENTATIONS - 1)
sides = st.integers(1, 12)


def numbered(ny: int, nx: int) -> np.ndarray:
    return np.arange(ny * nx).reshape(ny, nx)


@given(sides, sides, orientations)
def test_turning_back_undoes_turning(ny, nx, orientation):
    image = numbered(ny, nx)
    there = to_path(image, orientation)
    assert there.shape == ((nx, ny) if orientation & 4 else (ny, nx))
    np.testing.assert_array_equal(from_path(there, orientation), image)


@given(sides, sides)
def test_the_orientations_are_the_rotations_and_their_mirror_images(ny, nx):
    image = numbered(ny, nx)
    turned = {(t.shape, t.tobytes()) for t in (to_path(image, o) for o in range(8))}
    quarter_turns = [np.rot90(m, k) for m in (image, image.T) for k in range(4)]
    assert turned == {(t.shape, t.tobytes()) for t in quarter_turns}


def test_the_orientations_start_twice_in_each_corner_once_along_each_axis():
    image = numbered(4, 6)
    starts = [tuple(to_path(image, o)[0, :2].tolist()) for o in range(N_ORIENTATIONS)]
    assert len(set(starts)) == 8
    assert sorted(start for start, _ in starts) == [0, 0, 5, 5, 18, 18, 23, 23]


def test_the_first_orientation_starts_in_the_south_west_along_rows():
    image = numbered(3, 4)
    np.testing.assert_array_equal(to_path(image, 0), image)


@given(sides, sides, orientations, st.data())
def test_cells_turn_with_the_image(ny, nx, orientation, data):
    image = numbered(ny, nx)
    cell = st.tuples(st.integers(0, ny - 1), st.integers(0, nx - 1))
    cells = np.array(data.draw(st.lists(cell, min_size=1, max_size=5)))
    moved = cells_to_path(cells, image.shape, orientation)
    there = to_path(image, orientation)
    np.testing.assert_array_equal(there[tuple(moved.T)], image[tuple(cells.T)])


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
