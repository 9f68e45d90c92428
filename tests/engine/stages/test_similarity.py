"""The score map of the compiled search against brute force over PyWavelets coefficients."""

from itertools import pairwise

import numpy as np
import pytest
import pywt
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from ccwsim.engine.stages.box import L_SHAPE, LEFT, TOP, Box
from ccwsim.engine.stages.pyramid import build_pyramid
from ccwsim.engine.stages.similarity import (
    n_run,
    overlap_energies,
    overlap_terms,
    score_places,
    score_type,
)
from tests.small_images import blobs, noise

SHAPES = [LEFT, TOP, L_SHAPE]


def compiled_scores(image, grid, place, sizes, shape, n_planes, similarity="ssd"):
    """Return the scores of every place, and ΣB², as the simulation loop gets them."""
    template, overlap, level = sizes
    unit = 2**level
    sums = build_pyramid(image, level, n_planes).sums
    kind = score_type(level, template, overlap)
    energy = overlap_energies(sums, template // unit, overlap // unit, kind)[shape]
    if similarity == "correlation":
        energy = np.zeros_like(energy)
    terms = np.empty((4, 2 * n_planes * template * overlap // unit**2), np.int64)
    n = overlap_terms(grid, Box(*place, template, shape, overlap), unit, n_planes, terms)
    scores = np.empty_like(energy)
    run = np.empty(n_run(sums, scores.shape[1]), scores.dtype)
    score_places(sums, terms, n, energy, np.empty(n, scores.dtype), run, scores)
    return scores, int((terms[3, :n] ** 2).sum())


def haar(image: NDArray, facies: int, level: int) -> NDArray:
    plane = (image == facies).astype(float)
    return pywt.wavedec2(plane, "haar", "periodization", level)[0]


def brute_force(image, grid, place, sizes, shape, n_planes):
    """Return SSD and ΣA·B of orthonormal Haar coefficients at every place."""
    template, overlap, level = sizes
    unit = 2**level
    side, width = template // unit, overlap // unit
    inside = np.zeros((side, side), bool)
    inside[:, :width] |= bool(shape & LEFT)
    inside[:width, :] |= bool(shape & TOP)
    y0, x0 = place
    tile = grid[y0 : y0 + template, x0 : x0 + template]
    ny, nx = image.shape[0] // unit - side + 1, image.shape[1] // unit - side + 1
    ssd, product = np.zeros((ny, nx)), np.zeros((ny, nx))
    cropped = image[: image.shape[0] // unit * unit, : image.shape[1] // unit * unit]
    for facies in [1] if n_planes == 1 else range(n_planes):
        a = haar(cropped, facies, level)
        b = haar(tile, facies, level)[inside]
        for y in range(ny):
            for x in range(nx):
                own = a[y : y + side, x : x + side][inside]
                ssd[y, x] += ((own - b) ** 2).sum()
                product[y, x] += (own * b).sum()
    return ssd, product


@pytest.mark.parametrize("n_planes", [1, 2, 3, 5])
@pytest.mark.parametrize("level", range(5))
@pytest.mark.parametrize("shape", SHAPES)
def test_scores_are_the_squared_differences_of_haar_coefficients(shape, level, n_planes):
    unit = 2**level
    sizes = 4 * unit, 2 * unit if level < 3 else unit, level
    image = noise((9 * unit + 1, 7 * unit + unit // 2), max(n_planes, 2), seed=level)
    grid = noise((5 * unit + 3, 6 * unit), max(n_planes, 2), seed=99)
    place = (3, 1)
    scores, energy_of_overlap = compiled_scores(image, grid, place, sizes, shape, n_planes)
    ssd, _ = brute_force(image, grid, place, sizes, shape, n_planes)
    np.testing.assert_allclose(scores + energy_of_overlap, ssd * unit**2, atol=1e-6)


@pytest.mark.parametrize("level", range(5))
@pytest.mark.parametrize("shape", SHAPES)
def test_correlation_scores_are_minus_twice_the_cross_correlation(shape, level):
    unit = 2**level
    sizes = 4 * unit, unit, level
    image, grid = noise((9 * unit, 7 * unit), 3), noise((5 * unit, 5 * unit), 3, seed=7)
    scores, _ = compiled_scores(image, grid, (1, 0), sizes, shape, 3, "correlation")
    _, product = brute_force(image, grid, (1, 0), sizes, shape, 3)
    np.testing.assert_allclose(scores, -2 * product * unit**2, atol=1e-6)


@settings(max_examples=40, deadline=None)
@given(
    st.integers(0, 2),
    st.integers(2, 5),
    st.integers(1, 2),
    st.integers(2, 4),
    st.sampled_from(SHAPES),
    st.integers(0, 2**16),
)
def test_scores_are_right_for_any_sizes(level, side, width, n_planes, shape, seed):
    unit = 2**level
    width = min(width, side // 2)
    rng = np.random.default_rng(seed)
    image = noise((side * unit + rng.integers(9), side * unit + rng.integers(9)), n_planes, seed)
    grid = noise((side * unit + 5, side * unit + 4), n_planes, seed + 1)
    place = int(rng.integers(6)), int(rng.integers(5))
    sizes = side * unit, width * unit, level
    scores, energy_of_overlap = compiled_scores(image, grid, place, sizes, shape, n_planes)
    ssd, _ = brute_force(image, grid, place, sizes, shape, n_planes)
    np.testing.assert_allclose(scores + energy_of_overlap, ssd * unit**2, atol=1e-6)


@pytest.mark.parametrize("shape", SHAPES)
def test_one_plane_ranks_two_facies_as_two_planes_do(shape):
    image, grid, sizes = blobs((41, 37), 2), blobs((20, 20), 2, seed=5), (16, 4, 1)
    one, energy_of_one = compiled_scores(image, grid, (2, 1), sizes, shape, 1)
    two, energy_of_two = compiled_scores(image, grid, (2, 1), sizes, shape, 2)
    np.testing.assert_array_equal(2 * (one + energy_of_one), two + energy_of_two)


@pytest.mark.parametrize("shape", SHAPES)
def test_scores_do_not_depend_on_how_facies_are_numbered(shape):
    image, grid, sizes = blobs((41, 37), 4), blobs((20, 20), 4, seed=5), (16, 8, 2)
    renamed = np.array([2, 0, 3, 1], np.uint8)
    scores, _ = compiled_scores(image, grid, (2, 1), sizes, shape, 4)
    again, _ = compiled_scores(renamed[image], renamed[grid], (2, 1), sizes, shape, 4)
    np.testing.assert_array_equal(scores, again)


@pytest.mark.parametrize("shape", SHAPES)
def test_a_place_that_has_the_overlap_scores_zero_and_is_best(shape):
    image, sizes = noise((48, 40), 3), (16, 4, 2)
    grid = image[8:24, 12:28].copy()
    scores, energy_of_overlap = compiled_scores(image, grid, (0, 0), sizes, shape, 3)
    distances = scores.astype(int) + energy_of_overlap
    assert distances[2, 3] == distances.min() == 0


@pytest.mark.parametrize("shape", SHAPES)
def test_a_coarser_level_never_scores_more_than_a_finer_one(shape):
    image, grid = noise((48, 56), 2), blobs((32, 32), 2)
    distances = []
    for level in range(4):
        scores, energy_of_overlap = compiled_scores(image, grid, (0, 0), (32, 8, level), shape, 1)
        at_places_of_level_3 = scores[:: 2 ** (3 - level), :: 2 ** (3 - level)].astype(int)
        distances.append((at_places_of_level_3 + energy_of_overlap) / 4**level)
    for finer, coarser in pairwise(distances):
        assert (coarser <= finer).all()


@pytest.mark.parametrize(
    ("template", "level"), [(16, 0), (16, 3), (32, 1), (32, 2), (32, 4), (64, 2), (64, 3), (64, 5)]
)
def test_the_type_of_scores_holds_the_best_and_the_worst_fit(template, level):
    full, empty = np.ones((template, template), np.uint8), np.zeros((template, template), np.uint8)
    overlap = template // 2
    cells = template**2 - overlap**2
    for image, grid, wrong in ((full, full, 0), (full, empty, 2), (empty, full, 2)):
        scores, energy_of_overlap = compiled_scores(
            image, grid, (0, 0), (template, overlap, level), L_SHAPE, 2
        )
        assert scores.item() + energy_of_overlap == wrong * cells * 4**level


@given(st.integers(0, 6), st.integers(4, 1024), st.data())
def test_the_type_of_scores_is_the_smallest_that_holds_its_bound(level, template, data):
    overlap = data.draw(st.integers(1, template // 2))
    kind = score_type(level, template, overlap)
    farthest = 2 * 4**level * (2 * template * overlap - overlap**2)
    assert farthest <= np.iinfo(kind).max
    if kind is np.int32:
        assert 2 * 4**level * 2 * template * overlap > np.iinfo(np.int16).max


def test_the_first_patch_has_no_overlap_and_no_preference():
    image, grid = noise((40, 40), 3), np.zeros((16, 16), np.uint8)
    scores, _ = compiled_scores(image, grid, (0, 0), (16, 4, 1), 0, 3)
    assert (scores == 0).all()
