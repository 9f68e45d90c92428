"""Test the measures of copying from the training image against plain loops."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy import ndimage

from ccwsim.metrics import copying
from ccwsim.model.errors import CCWSIMError

TI = (9, 11)


def patched(seed):
    """Return sources pasted patch by patch, as in a simulation, with one unknown source."""
    rng = np.random.default_rng(seed)
    ny, nx = rng.integers(3, 14, 2)
    flat = np.arange(TI[0] * TI[1]).reshape(TI)
    positions = np.full((ny + 5, nx + 5), -1)
    for i in range(0, ny, 4):
        for j in range(0, nx, 4):
            y, x = rng.integers(0, TI[0] - 4), rng.integers(0, TI[1] - 4)
            positions[i : i + 5, j : j + 5] = flat[y : y + 5, x : x + 5]
    positions[rng.integers(0, ny), rng.integers(0, nx)] = -1
    return positions[:ny, :nx]


def touch(a, b, dy, dx):
    """Return whether location b of the training image is (dy, dx) away from location a."""
    if a < 0 or b < 0:
        return False
    return (b // TI[1] - a // TI[1], b % TI[1] - a % TI[1]) == (dy, dx)


@settings(deadline=None, max_examples=40)
@given(seed=st.integers(0, 10**6), scattered=st.booleans())
def test_pairs_seams_and_uses_are_those_of_loops(seed, scattered):
    positions = patched(seed)
    if scattered:
        positions = np.random.default_rng(seed).integers(-1, TI[0] * TI[1], positions.shape)
    ny, nx = positions.shape
    found = copying(positions, TI)
    joined, seams = [], np.zeros((ny, nx), bool)
    for i in range(ny):
        for j in range(nx):
            for dy, dx in ((0, 1), (1, 0)):
                if i + dy < ny and j + dx < nx:
                    joined.append(touch(positions[i, j], positions[i + dy, j + dx], dy, dx))
                    seams[i, j] |= not joined[-1]
    assert found.copied == pytest.approx(np.mean(joined))
    np.testing.assert_array_equal(found.seams, seams)
    assert found.uses.sum() == (positions >= 0).sum()
    assert found.n_unknown == (positions < 0).sum()
    assert all(found.uses.flat[k] == (positions == k).sum() for k in range(TI[0] * TI[1]))


@settings(deadline=None, max_examples=40)
@given(seed=st.integers(0, 10**6))
def test_largest_copies_are_those_of_exhaustive_search(seed):
    positions = patched(seed)
    ny, nx = positions.shape
    rows, columns = np.indices((ny, nx))
    shift = [
        (positions[i, j] // TI[1] - i, positions[i, j] % TI[1] - j)
        if positions[i, j] >= 0
        else None
        for i, j in zip(rows.ravel(), columns.ravel(), strict=True)
    ]
    names = {s: k + 1 for k, s in enumerate(dict.fromkeys(s for s in shift if s))}
    number = np.array([names.get(s, 0) for s in shift]).reshape(ny, nx)
    side = max(
        (
            k
            for k in range(1, min(ny, nx) + 1)
            for i in range(ny - k + 1)
            for j in range(nx - k + 1)
            if number[i, j] and (number[i : i + k, j : j + k] == number[i, j]).all()
        ),
        default=0,
    )
    block = max(
        np.bincount(ndimage.label(number == k)[0].ravel())[1:].max() for k in names.values()
    )
    found = copying(positions, TI)
    assert found.largest_square == side
    assert found.largest_block == block
    i, j = found.square_at
    assert (number[i : i + side, j : j + side] == number[i, j]).all()


def test_a_copy_of_the_training_image_is_one_block():
    found = copying(np.arange(99).reshape(TI), TI)
    assert found.copied == 1
    assert found.used == 1
    assert found.largest_square == 9
    assert found.largest_block == 99
    assert not found.seams.any()


def test_the_end_of_a_row_does_not_touch_the_next_row():
    assert copying([[10, 11]], TI).copied == 0


def test_nothing_known_is_nothing_copied():
    found = copying(np.full((3, 3), -1), TI)
    assert found.copied == found.largest_square == found.largest_block == 0
    assert found.n_unknown == 9


def test_places_outside_are_said():
    with pytest.raises(CCWSIMError, match=r"positions .*: 99 is too large"):
        copying([[99]], TI)
    with pytest.raises(CCWSIMError, match="shape"):
        copying([1, 2], TI)
