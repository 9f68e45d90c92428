"""Test that block sums equal Haar coefficients, also of a part of the image."""

from itertools import pairwise

import numpy as np
import pytest
import pywt
from hypothesis import given, settings, strategies as st

from ccwsim import CCWSIMError
from ccwsim.engine.stages.bits import to_square_bits
from ccwsim.engine.stages.pyramid import build_pyramid, decompose, reconstruct
from tests.small_images import blobs, noise


def approximation(plane: np.ndarray, level: int) -> np.ndarray:
    return pywt.wavedec2(plane.astype(float), "haar", "periodization", level)[0]


def along_axes(plane: np.ndarray, level: tuple[int, ...]) -> np.ndarray:
    """Return the Haar approximation with a different level along each axis."""
    plane = plane.astype(float)
    for axis, n in enumerate(level):
        for _ in range(n):
            plane = pywt.dwt(plane, "haar", "periodization", axis=axis)[0]
    return plane


@pytest.mark.parametrize("level", range(7))
@pytest.mark.parametrize("n_facies", [1, 2, 3])
def test_block_sums_are_the_haar_approximation_of_indicators(level, n_facies):
    unit = 2**level
    image = noise((3 * unit, 5 * unit), n_facies)
    sums = build_pyramid(image[None], (0, level, level), n_facies).sums
    planes = [1] if n_facies == 1 else range(n_facies)
    for (plane,), facies in zip(sums, planes, strict=True):
        np.testing.assert_allclose(plane, approximation(image == facies, level) * unit, atol=1e-9)


levels = st.tuples(st.integers(0, 3), st.integers(0, 3), st.integers(0, 3))
volumes = st.tuples(st.integers(1, 4), st.integers(1, 4), st.integers(1, 4))


@settings(max_examples=60, deadline=None)
@given(levels, volumes, st.integers(1, 4), st.integers(0, 2**16))
def test_block_sums_of_volumes_are_the_approximation_along_each_axis(level, blocks, n_facies, seed):
    image = noise(tuple(np.array(blocks) * 2 ** np.array(level)), n_facies, seed)
    sums = build_pyramid(image, level, n_facies).sums
    planes = [1] if n_facies == 1 else range(n_facies)
    for plane, facies in zip(sums, planes, strict=True):
        expected = along_axes(image == facies, level) * 2 ** (sum(level) / 2)
        np.testing.assert_allclose(plane, expected, atol=1e-9)


@pytest.mark.parametrize(
    "level", [(0, 4, 4), (0, 5, 5), (0, 6, 6), (2, 3, 3), (4, 4, 4), (5, 4, 5)]
)
def test_full_blocks_of_high_levels_do_not_overflow(level):
    image = np.ones([2**n for n in level], np.uint8)
    assert build_pyramid(image, level, 2).sums[1].item() == 2 ** sum(level)


shapes = st.tuples(st.integers(0, 12), st.integers(0, 40), st.integers(0, 40))


@given(shapes, levels, st.integers(1, 4))
def test_block_sums_of_all_facies_fill_each_block(more, level, n_facies):
    block = np.array([2**n for n in level])
    image = noise(tuple(block + more), n_facies)
    sums = build_pyramid(image, level, max(n_facies, 2)).sums
    assert sums.shape[1:] == tuple(np.array(image.shape) // block)
    assert (sums.sum(axis=0) == block.prod()).all()


small = st.tuples(st.integers(0, 3), st.integers(0, 12), st.integers(0, 12))


@settings(deadline=None)
@given(small, levels)
def test_phases_are_the_image_cell_by_cell(more, level):
    block = np.array([2**n for n in level])
    image = noise(tuple(block + more), 5)
    pyramid = build_pyramid(image, level, 5)
    phases = pyramid.phases
    assert phases.shape == (*block, *(np.array(image.shape) // block))
    for at, facies in np.ndenumerate(phases):
        assert facies == image[tuple(block * at[3:] + at[:3])]
    np.testing.assert_array_equal(pyramid.image, image)
    np.testing.assert_array_equal(pyramid.square_bits, to_square_bits(image))


@pytest.mark.parametrize("level", range(5))
def test_reconstruct_gives_the_slice_of_the_image(level):
    unit = 2**level
    image = noise((7 * unit, 9 * unit), 3, seed=level)
    coefficients = decompose(image, level)
    for row in range(4):
        for column in (0, 3, 5):
            patch = reconstruct(coefficients, (row, column), 3 * unit)
            y, x = row * unit, column * unit
            np.testing.assert_allclose(patch, image[y : y + 3 * unit, x : x + 3 * unit], atol=1e-9)


@pytest.mark.parametrize("level", range(5))
def test_reconstruct_of_everything_is_waverec2(level):
    image = blobs((32, 32), 4)
    coefficients = decompose(image, level)
    whole = pywt.waverec2(coefficients, "haar", "periodization")
    np.testing.assert_allclose(reconstruct(coefficients, (0, 0), 32), whole, atol=1e-9)


@given(st.integers(0, 4), st.integers(0, 2**16))
def test_decompose_keeps_the_energy_of_the_image(level, seed):
    image = noise((32, 48), 4, seed).astype(float)
    approximation, *details = decompose(image, level)
    energy = (approximation**2).sum() + sum((d**2).sum() for bands in details for d in bands)
    assert energy == pytest.approx((image**2).sum())


@settings(max_examples=50)
@given(st.integers(0, 2**16))
def test_distance_of_coefficients_never_exceeds_that_of_a_finer_level(seed):
    one, other = noise((32, 32), 2, seed), noise((32, 32), 2, seed + 1)
    distances = [
        ((approximation(one, level) - approximation(other, level)) ** 2).sum() for level in range(6)
    ]
    assert distances[0] == np.count_nonzero(one != other)
    assert all(a >= b - 1e-9 for a, b in pairwise(distances))


def test_rows_and_columns_that_fill_no_block_are_left_out():
    image = noise((13, 18), 2)
    np.testing.assert_allclose(decompose(image, 2)[0], approximation(image[:12, :16], 2))


@pytest.mark.parametrize(("shape", "level"), [((7, 20), 3), ((20, 1), 1)])
def test_an_image_smaller_than_one_block_is_refused(shape, level):
    with pytest.raises(CCWSIMError, match="choose a lower level"):
        decompose(np.zeros(shape), level)


@pytest.mark.parametrize(
    ("shape", "level"),
    [
        ((1, 7, 20), (0, 3, 3)),
        ((1, 20, 1), (0, 1, 1)),
        ((3, 9, 9), (2, 1, 1)),
        ((4, 9, 7), (0, 0, 3)),
    ],
)
def test_a_pyramid_needs_an_image_of_a_block_along_each_axis(shape, level):
    with pytest.raises(CCWSIMError, match="choose a lower level"):
        build_pyramid(np.zeros(shape, np.uint8), level, 2)
