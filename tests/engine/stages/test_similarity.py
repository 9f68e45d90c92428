"""Test the score map of the compiled search against brute force with PyWavelets coefficients."""

from itertools import pairwise
from math import prod
from typing import NamedTuple

import numpy as np
import pytest
import pywt
from hypothesis import given, settings, strategies as st
from numpy.typing import NDArray

from ccwsim.engine.stages.path import BELOW, LEFT, TOP, Box, Triple, overlap_cells
from ccwsim.engine.stages.pyramid import build_pyramid
from ccwsim.engine.stages.similarity import (
    legal_spans,
    make_terms,
    overlap_energies,
    overlap_terms,
    running_squares,
    running_sums,
    score_places,
    score_type,
)
from tests.small_images import blobs, noise

NO_SPANS = np.zeros((0, 0, 2), np.int64)

SHAPES = [LEFT, TOP, LEFT | TOP]
VOLUME_SHAPES = [*range(1, 8)]


class Sizes(NamedTuple):
    """Template and overlap in cells, and the level, along each axis."""

    template: Triple
    overlap: Triple
    level: Triple

    @property
    def block(self) -> Triple:
        z, y, x = self.level
        return 2**z, 2**y, 2**x

    def in_blocks(self, lengths: Triple) -> Triple:
        z, y, x = (n >> level for n, level in zip(lengths, self.level, strict=True))
        return z, y, x


def flat(template: int, overlap: int, level: int) -> Sizes:
    """Return the sizes of a map."""
    return Sizes((1, template, template), (0, overlap, overlap), (0, level, level))


def cube(template: int, overlap: int, level: Triple) -> Sizes:
    return Sizes((template, template, template), (overlap, overlap, overlap), level)


def layered(array: NDArray) -> NDArray:
    """Return a map as a volume of one layer."""
    return array if array.ndim == 3 else array[None]


def energies_of(sums: NDArray, box: Box, sizes: Sizes, kind: type) -> NDArray:
    """Return ΣA² of the overlap of a box at each location of a complete template."""
    template = sizes.in_blocks(sizes.template)
    places = [n - t + 1 for n, t in zip(sums.shape[1:], template, strict=True)]
    energies = np.full(places, 77, kind)
    overlap_energies(running_squares(sums, kind), box, sizes.block, energies)
    return energies


def compiled_scores(image, grid, place, sizes, shape, n_planes, similarity="ssd", kind=None):
    """Return the scores of all locations, and ΣB², as the simulation loop computes them."""
    image, grid, place = layered(image), layered(grid), (0, *place)[-3:]
    sums = build_pyramid(image, sizes.level, n_planes).sums
    correlation = similarity == "correlation"
    kind = kind or score_type(sizes.level, sizes.template, sizes.overlap, correlation)
    box = Box._make((*place, *sizes.template, shape, *sizes.overlap))
    energy = energies_of(sums, box, sizes, kind)
    if correlation:
        energy = np.zeros_like(energy)
    running = running_sums(sums, sizes.level, sizes.template)
    terms = make_terms(running, sizes.template, sizes.overlap, sizes.block)
    n_groups = overlap_terms(grid, box, sizes.block, running, terms)
    scores = np.empty_like(energy)
    score_places(running, 0, NO_SPANS, terms, n_groups, energy, scores)
    tile = grid[tuple(slice(at, at + n) for at, n in zip(place, sizes.template, strict=True))]
    own = build_pyramid(tile, sizes.level, n_planes).sums.astype(np.int64)
    return scores, int(np.square(own[:, overlap_of(sizes, shape)]).sum())


def test_scores_of_legal_locations_do_not_depend_on_illegal_locations():
    sizes, image = flat(16, 4, 1), layered(blobs((90, 80), 2))
    sums, box = (
        build_pyramid(image, sizes.level, 1).sums,
        Box(0, 9, 5, 1, 16, 16, LEFT | TOP, 0, 4, 4),
    )
    energy = energies_of(sums, box, sizes, np.int16)
    running = running_sums(sums, sizes.level, sizes.template)
    terms = make_terms(running, sizes.template, sizes.overlap, sizes.block)
    n_groups = overlap_terms(image, box, sizes.block, running, terms)
    _, rows, columns = np.indices(energy.shape)
    illegal = (np.hypot(rows - 18, columns - 9) > 7).astype(np.uint8)  # many rows have no location
    scores, some = np.empty_like(energy), np.empty_like(energy)
    score_places(running, 0, NO_SPANS, terms, n_groups, energy, scores)
    score_places(running, 0, legal_spans(illegal), terms, n_groups, energy, some)
    np.testing.assert_array_equal(some[illegal == 0], scores[illegal == 0])
    np.testing.assert_array_equal(some[:, 32:], energy[:, 32:])


def overlap_of(sizes: Sizes, shape: int) -> NDArray:
    """Return the mask of the blocks of a template in the overlap."""
    inside = np.zeros(sizes.in_blocks(sizes.template), bool)
    oz, oy, ox = sizes.in_blocks(sizes.overlap)
    inside[:, :, :ox] |= bool(shape & LEFT)
    inside[:, :oy] |= bool(shape & TOP)
    inside[:oz] |= bool(shape & BELOW)
    return inside


def haar(image: NDArray, facies: int, level: Triple) -> NDArray:
    plane = (image == facies).astype(float)
    for axis, n in enumerate(level):
        for _ in range(n):
            plane = pywt.dwt(plane, "haar", "periodization", axis=axis)[0]
    return plane


def brute_force(image, grid, place, sizes, shape, n_planes):
    """Return SSD and ΣA·B of orthonormal Haar coefficients at all locations."""
    image, grid, place = layered(image), layered(grid), (0, *place)[-3:]
    side, inside = sizes.in_blocks(sizes.template), overlap_of(sizes, shape)
    tile = grid[tuple(slice(at, at + n) for at, n in zip(place, sizes.template, strict=True))]
    blocks = [n // b for n, b in zip(image.shape, sizes.block, strict=True)]
    cropped = image[tuple(slice(n * b) for n, b in zip(blocks, sizes.block, strict=True))]
    found = tuple(n - t + 1 for n, t in zip(blocks, side, strict=True))
    ssd, product = np.zeros(found), np.zeros(found)
    for facies in [1] if n_planes == 1 else range(n_planes):
        a = haar(cropped, facies, sizes.level)
        b = haar(tile, facies, sizes.level)[inside]
        for at in np.ndindex(found):
            own = a[tuple(slice(k, k + n) for k, n in zip(at, side, strict=True))][inside]
            ssd[at] += ((own - b) ** 2).sum()
            product[at] += (own * b).sum()
    return ssd, product


@pytest.mark.parametrize("n_planes", [1, 2, 3, 5])
@pytest.mark.parametrize("level", range(5))
@pytest.mark.parametrize("shape", SHAPES)
def test_scores_are_the_squared_differences_of_haar_coefficients(shape, level, n_planes):
    unit = 2**level
    sizes = flat(4 * unit, 2 * unit if level < 3 else unit, level)
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
    sizes = flat(4 * unit, unit, level)
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
    sizes = flat(side * unit, width * unit, level)
    scores, energy_of_overlap = compiled_scores(image, grid, place, sizes, shape, n_planes)
    ssd, _ = brute_force(image, grid, place, sizes, shape, n_planes)
    np.testing.assert_allclose(scores + energy_of_overlap, ssd * unit**2, atol=1e-6)


@pytest.mark.parametrize("shape", SHAPES)
def test_one_plane_ranks_two_facies_as_two_planes_do(shape):
    image, grid, sizes = blobs((41, 37), 2), blobs((20, 20), 2, seed=5), flat(16, 4, 1)
    one, energy_of_one = compiled_scores(image, grid, (2, 1), sizes, shape, 1)
    two, energy_of_two = compiled_scores(image, grid, (2, 1), sizes, shape, 2)
    np.testing.assert_array_equal(2 * (one + energy_of_one), two + energy_of_two)


@pytest.mark.parametrize("shape", SHAPES)
def test_scores_do_not_depend_on_how_facies_are_numbered(shape):
    image, grid, sizes = blobs((41, 37), 4), blobs((20, 20), 4, seed=5), flat(16, 8, 2)
    renamed = np.array([2, 0, 3, 1], np.uint8)
    scores, _ = compiled_scores(image, grid, (2, 1), sizes, shape, 4)
    again, _ = compiled_scores(renamed[image], renamed[grid], (2, 1), sizes, shape, 4)
    np.testing.assert_array_equal(scores, again)


@pytest.mark.parametrize("shape", SHAPES)
def test_a_place_that_has_the_overlap_scores_zero_and_is_best(shape):
    image, sizes = noise((48, 40), 3), flat(16, 4, 2)
    grid = image[8:24, 12:28].copy()
    scores, energy_of_overlap = compiled_scores(image, grid, (0, 0), sizes, shape, 3)
    distances = scores.astype(int) + energy_of_overlap
    assert distances[0, 2, 3] == distances.min() == 0


@pytest.mark.parametrize("shape", SHAPES)
def test_a_coarser_level_never_scores_more_than_a_finer_one(shape):
    image, grid = noise((48, 56), 2), blobs((32, 32), 2)
    distances = []
    for level in range(4):
        sizes = flat(32, 8, level)
        scores, energy_of_overlap = compiled_scores(image, grid, (0, 0), sizes, shape, 1)
        at_places_of_level_3 = scores[:, :: 2 ** (3 - level), :: 2 ** (3 - level)].astype(int)
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
            image, grid, (0, 0), flat(template, overlap, level), LEFT | TOP, 2
        )
        assert scores.item() + energy_of_overlap == wrong * cells * 4**level


LEVELS = [(0, 0, 0), (0, 1, 1), (1, 1, 1), (1, 2, 2), (2, 1, 0)]


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("n_planes", [1, 2, 3, 4])
def test_scores_of_volumes_are_squared_differences_too(level, n_planes):
    sizes = cube(8, 4, level)
    image = noise((11, 13, 12), max(n_planes, 2), seed=n_planes)
    grid = noise((10, 11, 9), max(n_planes, 2), seed=99)
    volume = prod(sizes.block)
    for shape in VOLUME_SHAPES:
        given = image, grid, (2, 3, 1), sizes, shape, n_planes
        ssd, product = brute_force(*given)
        scores, energy_of_overlap = compiled_scores(*given)
        np.testing.assert_allclose(scores + energy_of_overlap, ssd * volume, atol=1e-6)
        scores, _ = compiled_scores(*given, "correlation")
        np.testing.assert_allclose(scores, -2 * product * volume, atol=1e-6)


@settings(max_examples=40, deadline=None)
@given(
    st.tuples(*[st.integers(0, 2)] * 3),
    st.tuples(*[st.integers(2, 4)] * 3),
    st.integers(2, 4),
    st.sampled_from(VOLUME_SHAPES),
    st.sampled_from([np.int16, np.int32, np.int64]),
    st.integers(0, 2**16),
)
def test_scores_of_volumes_are_right_for_any_sizes_and_types(
    level, side, n_planes, shape, kind, seed
):
    rng = np.random.default_rng(seed)
    block = np.array([2**n for n in level])
    width = [int(rng.integers(1, n // 2 + 1)) for n in side]
    sizes = Sizes(tuple(block * side), tuple(block * width), level)
    cells = np.array(sizes.template)
    image = noise(tuple(cells + rng.integers(0, 9, 3)), n_planes, seed)
    grid = noise(tuple(cells + 3), n_planes, seed + 1)
    place = tuple(rng.integers(0, 4, 3).tolist())
    kinds = [np.int16, np.int32, np.int64]
    smallest = score_type(sizes.level, sizes.template, sizes.overlap)
    kind = max(kind, smallest, key=kinds.index)  # at least the type that contains all scores
    planes = 1 if n_planes == 2 and seed % 2 else n_planes
    given = image, grid, place, sizes, shape, planes
    scores, energy_of_overlap = compiled_scores(*given, kind=kind)
    assert scores.dtype == kind
    ssd, _ = brute_force(*given)
    np.testing.assert_allclose(
        scores.astype(float) + energy_of_overlap, ssd * prod(sizes.block), atol=1e-6
    )


@settings(max_examples=40, deadline=None)
@given(
    st.tuples(*[st.integers(1, 4)] * 3), st.tuples(*[st.integers(0, 3)] * 3), st.integers(0, 2**16)
)
def test_energies_are_the_squares_over_each_shape_of_overlap(template, more, seed):
    rng = np.random.default_rng(seed)
    sums = rng.integers(0, 255, (2, *np.add(template, more))).astype(np.uint8)
    overlap = tuple(int(rng.integers(0 if k == 0 else 1, n + 1)) for k, n in enumerate(template))
    sizes = Sizes(template, overlap, (0, 0, 0))  # type: ignore[arg-type]
    squares = (sums.astype(int) ** 2).sum(axis=0)
    for shape in range(8 if overlap[0] else 4):
        box = Box._make((0, 0, 0, *template, shape, *overlap))
        inside = np.zeros(template, bool)
        inside[:, :, : overlap[2]] |= bool(shape & LEFT)
        inside[:, : overlap[1]] |= bool(shape & TOP)
        inside[: overlap[0]] |= bool(shape & BELOW)
        windows = np.lib.stride_tricks.sliding_window_view(squares, template)
        expected = windows[..., inside].sum(axis=-1)
        np.testing.assert_array_equal(energies_of(sums, box, sizes, np.int64), expected)
        wrapped = expected.astype(np.int16)  # sums beyond the type wrap modulo 2¹⁶
        np.testing.assert_array_equal(energies_of(sums, box, sizes, np.int16), wrapped)


@pytest.mark.parametrize(
    ("template", "overlap", "level", "kind"),
    [
        (16, 8, (0, 0, 0), np.int16),
        (16, 4, (0, 2, 1), np.int16),
        (16, 8, (1, 1, 1), np.int16),
        (16, 8, (1, 2, 1), np.int32),
        (32, 16, (3, 3, 3), np.int32),
        (32, 16, (4, 4, 3), np.int32),
        (64, 32, (4, 4, 4), np.int32),
        pytest.param(128, 64, (6, 6, 6), np.int64, marks=pytest.mark.slow),
    ],
)
def test_the_type_of_scores_holds_the_best_and_the_worst_fit_in_volumes(
    template, overlap, level, kind
):
    sizes = cube(template, overlap, level)
    assert score_type(level, sizes.template, sizes.overlap) is kind
    full = np.ones(sizes.template, np.uint8)
    cells = template**3 - (template - overlap) ** 3
    for image, grid, wrong in ((full, full, 0), (full, 1 - full, 2), (1 - full, full, 2)):
        given = image, grid, (0, 0, 0), sizes, 7, 2
        scores, energy_of_overlap = compiled_scores(*given)
        assert scores.astype(np.int64).item() + energy_of_overlap == wrong * cells * 2 ** sum(level)
        scores, _ = compiled_scores(*given, "correlation")
        assert scores.astype(np.int64).item() == -(2 - wrong) * cells * 2 ** sum(level)


lengths = st.integers(4, 1024).flatmap(
    lambda t: st.tuples(st.just(t), st.integers(1, t // 2), st.integers(0, 6))
)


@given(st.one_of(st.just((1, 0, 0)), lengths), lengths, lengths, st.booleans())
def test_the_type_of_scores_is_the_smallest_that_holds_its_bound(z, y, x, correlation):
    template, overlap, level = zip(z, y, x, strict=True)
    kind = score_type(level, template, overlap, correlation)
    cells = prod(template) - prod(t - o for t, o in zip(template, overlap, strict=True))
    farthest = (1 + correlation) * 2 ** sum(level) * cells
    holds = {np.int16: 2**15 - 1, np.int32: 2**31 - 1, np.int64: 2**63 - 1}
    assert kind is next(k for k, largest in holds.items() if farthest <= largest)
    assert int(kind(farthest)) == farthest
    assert int(kind(-farthest)) == -farthest


def test_the_first_patch_has_no_overlap_and_no_preference():
    image, grid = noise((40, 40), 3), np.zeros((16, 16), np.uint8)
    scores, _ = compiled_scores(image, grid, (0, 0), flat(16, 4, 1), 0, 3)
    assert (scores == 0).all()
    image, grid = noise((11, 12, 13), 3), np.zeros((8, 8, 8), np.uint8)
    scores, _ = compiled_scores(image, grid, (0, 0, 0), cube(8, 2, (1, 1, 1)), 0, 3)
    assert (scores == 0).all()


@pytest.mark.parametrize("shape", VOLUME_SHAPES)
def test_a_place_of_a_volume_that_has_the_overlap_scores_zero_and_is_best(shape):
    image, sizes = noise((20, 24, 28), 3), cube(12, 4, (1, 2, 2))
    grid = image[2:14, 8:20, 12:24].copy()
    scores, energy_of_overlap = compiled_scores(image, grid, (0, 0, 0), sizes, shape, 3)
    distances = scores.astype(int) + energy_of_overlap
    assert distances[1, 2, 3] == distances.min() == 0


@pytest.mark.parametrize("n_planes", [1, 3])
@pytest.mark.parametrize("full", [(0, 16, 0, 32), (0, 3, 0, 32), (2, 9, 0, 5), (13, 16, 20, 32)])
def test_groups_of_terms_give_the_same_scores_wherever_bodies_are(full, n_planes):
    sizes = Sizes((16, 32, 32), (4, 8, 8), (1, 2, 2))
    image = blobs((20, 40, 44), max(n_planes, 2))
    grid = np.zeros(sizes.template, np.uint8)
    z0, z1, y0, y1 = full
    grid[z0:z1, y0:y1] = 1
    largest = 32 * overlap_cells(sizes.template, sizes.overlap)
    assert largest > 4 * np.iinfo(np.uint16).max  # larger sums need several groups
    for shape in VOLUME_SHAPES:
        given = image, grid, (0, 0, 0), sizes, shape, n_planes
        ssd, _ = brute_force(*given)
        scores, energy_of_overlap = compiled_scores(*given)
        np.testing.assert_allclose(scores + energy_of_overlap, ssd * 32, atol=1e-6)


def terms_of(image, grid, sizes, shape, n_planes):
    """Return the nonzero weights of the terms."""
    sums = build_pyramid(layered(image), sizes.level, n_planes).sums
    running = running_sums(sums, sizes.level, sizes.template)
    terms = make_terms(running, sizes.template, sizes.overlap, sizes.block)
    box = Box._make((0, 0, 0, *sizes.template, shape, *sizes.overlap))
    n_groups = overlap_terms(layered(grid), box, sizes.block, running, terms)
    weights = terms.weights[: terms.ends[n_groups - 1]]
    return weights[weights != 0]


@settings(max_examples=30, deadline=None)
@given(st.tuples(*[st.integers(0, 2)] * 3), st.integers(2, 4), st.booleans(), st.integers(0, 2**16))
def test_there_are_no_more_terms_than_block_sums_that_are_not_zero(level, n_facies, noisy, seed):
    sizes = Sizes((8, 16, 16), (4, 4, 8), level)
    made = noise if noisy else blobs
    image, grid = made((16, 24, 24), n_facies, seed), made(sizes.template, n_facies, seed + 1)
    own = build_pyramid(grid, level, n_facies).sums[:, overlap_of(sizes, 7)]
    assert len(terms_of(image, grid, sizes, 7, n_facies)) <= np.count_nonzero(own)


def test_a_body_has_a_term_where_each_line_of_it_begins_and_one_where_it_ends():
    image, grid = blobs((40, 40), 2), np.ones((16, 16), np.uint8)
    assert len(terms_of(image, grid, flat(16, 4, 0), LEFT | TOP, 1)) == 2 * (4 + 4)
    grid[:, 6:9] = 0  # a gap at the top, and none on the left
    assert len(terms_of(image, grid, flat(16, 4, 0), LEFT | TOP, 1)) == 4 * 4 + 2 * 4
