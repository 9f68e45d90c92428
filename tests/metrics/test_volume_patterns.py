"""Test patterns of volumes against counting one by one and against maps."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from scipy.spatial.distance import jensenshannon
from skimage.transform import resize

from ccwsim import TrainingImage
from ccwsim.metrics import (
    anodi,
    coarsened,
    js_divergence,
    pattern_codes as own,
    pattern_distance,
    pattern_histogram,
    pyramid_histograms,
    unseen_patterns,
)
from ccwsim.model.errors import CCWSIMError
from tests.metrics.volumes import a_volume


def patterns(image, size):
    """Return the patterns at all locations, in order."""
    if image.ndim == 2:
        image = image[None]
    height = min(size, len(image)) if len(image) > 1 else 1
    box = height, size, size
    places = np.ndindex(*(n - m + 1 for n, m in zip(image.shape, box, strict=True)))
    return [
        image[z : z + height, y : y + size, x : x + size].astype(np.uint8).tobytes()
        for z, y, x in places
    ]


@pytest.mark.parametrize("size", [1, 2, 3])
@pytest.mark.parametrize("n_facies", [1, 2, 3, 4, 7])
@pytest.mark.parametrize("shape", [(6, 8, 9), (2, 7, 11)])
def test_counts_and_divergence_are_those_of_plain_counting(size, n_facies, shape):
    codes = range(n_facies)
    volumes = [a_volume(seed, shape, codes) for seed in (1, 2)]
    one, two = (pattern_histogram(volume, codes, size) for volume in volumes)
    a, b = (Counter(patterns(volume, size)) for volume in volumes)
    counts = one.frequencies * sum(a.values())
    assert sorted(np.rint(counts).astype(int)) == sorted(a.values())
    assert (one.size, one.layers) == (size, min(size, shape[0]))
    assert (np.diff(one.codes.astype(object)) > 0).all()
    keys = list({**a, **b})
    expected = jensenshannon([a[k] for k in keys], [b[k] for k in keys], base=2) ** 2
    assert js_divergence(one, two) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("n_facies", [2, 7])
def test_patterns_counted_in_pieces_are_the_same(monkeypatch, n_facies):
    volume = a_volume(3, (7, 12, 9), range(n_facies))
    whole = pattern_histogram(volume, size=3)
    for cells in (1, 40, 250):
        monkeypatch.setattr(own, "CELLS_OF_STRIP", cells)
        pieces = pattern_histogram(volume, size=3)
        np.testing.assert_array_equal(pieces.codes, whole.codes)
        np.testing.assert_array_equal(pieces.frequencies, whole.frequencies)


def test_a_table_knows_its_codes_and_no_others():
    codes = np.random.default_rng(0).integers(0, 2**40, 30_000).astype(np.uint64)
    known = np.unique(np.append(codes[:9000], np.uint64(0)))
    table = own.make_hash_table(known)
    np.testing.assert_array_equal(own.are_unknown(codes, *table), ~np.isin(codes, known))
    near = codes + np.uint64(1)
    np.testing.assert_array_equal(own.are_unknown(near, *table), ~np.isin(near, known))


@pytest.mark.parametrize("factors", [(2, 2, 2), (1, 3, 3), (2, 3, 1)])
def test_coarsening_is_the_anti_aliased_resizing_of_scikit_image(factors):
    volume = a_volume(4, (8, 20, 23), (0, 1, 2), 2.0)
    smaller = tuple(n // f for n, f in zip(volume.shape, factors, strict=True))
    shares = np.array(
        [resize((volume == f).astype(float), smaller, anti_aliasing=True) for f in range(3)]
    )
    result = coarsened(volume, factors)
    assert result.shape == smaller
    chosen = np.take_along_axis(shares, result[None].astype(int), axis=0)[0]
    np.testing.assert_allclose(chosen, shares.max(axis=0), atol=1e-8)
    if factors == (2, 2, 2):
        np.testing.assert_array_equal(coarsened(volume, 2), result)


def test_a_thin_volume_is_coarsened_along_z_only_as_far_as_patterns_fit():
    volumes = np.array([a_volume(seed, (7, 18, 20)) for seed in (1, 2)])
    rows = pyramid_histograms(volumes, factors=(1, 2, 3))
    for volume, row in zip(volumes, rows, strict=True):
        for z, factor, found in zip((1, 2, 2), (1, 2, 3), row, strict=True):
            alone = pattern_histogram(coarsened(volume, (z, factor, factor), [0, 1]), [0, 1])
            np.testing.assert_array_equal(found.codes, alone.codes)
            np.testing.assert_array_equal(found.frequencies, alone.frequencies)


def test_distances_of_volumes():
    image = a_volume(1, (20, 24, 26), smooth=2.0)
    likes = np.array([a_volume(seed, (9, 24, 25), smooth=2.0) for seed in (2, 3, 4)])
    rough = np.array([a_volume(seed, (9, 24, 25), smooth=0.5) for seed in (5, 6, 7)])
    near, far = (pattern_distance(volumes, image) for volumes in (likes, rough))
    assert near.shape == (3, 3)
    assert (near.max(axis=0) < far.min(axis=0))[:2].all()
    np.testing.assert_array_equal(pattern_distance(image[None], image), 0)
    found = anodi({"likes": likes, "rough": rough}, TrainingImage(image))
    assert found.pattern_size == 3
    np.testing.assert_allclose(found.within[0], near.mean(axis=0))
    np.testing.assert_allclose(found.within[1], far.mean(axis=0))
    one_layer = pattern_distance(likes[:, :1], TrainingImage(image[:1]))
    np.testing.assert_array_equal(one_layer, pattern_distance(likes[:, 0], image[0], size=3))


@pytest.mark.parametrize("n_facies", [2, 3, 6])
@pytest.mark.parametrize("shape", [(6, 9, 10), (2, 9, 10), (9, 10)])
def test_unseen_patterns_are_those_of_looking_each_one_up(n_facies, shape):
    codes = 2 * np.arange(n_facies) + 1
    image = a_volume(1, (12, 40, 40)[-len(shape) :], codes)
    images = np.array([a_volume(seed, shape, codes) for seed in (2, 3)])
    mask = np.random.default_rng(1).random(shape) < 0.01
    mask.flat[-1] = True
    thin = len(shape) == 3 and shape[0] < 3
    known = patterns(image, 3)
    if thin:
        places = range(len(image) - 1)
        known = [p for z in places for p in patterns(image[z : z + 2], 3)]
    everywhere = unseen_patterns(images, image)
    at_data = unseen_patterns(images, image, mask=mask)
    for k, one in enumerate(images):
        unknown = np.array([p not in set(known) for p in patterns(one, 3)])
        holds = np.array([any(p) for p in patterns(mask, 3)])
        assert everywhere[k] == unknown.mean()
        assert at_data[k] == unknown[holds].mean()
    assert everywhere.max() > 0
    assert everywhere.max() < 1 or n_facies > 3
    np.testing.assert_array_equal(unseen_patterns(image[None], image), 0)


def test_unseen_patterns_without_cells_and_with_bad_input():
    image = a_volume(1, (12, 13))
    assert np.isnan(unseen_patterns(image, image, mask=np.zeros((12, 13), bool))).all()
    with pytest.raises(CCWSIMError, match="mask must be of type bool"):
        unseen_patterns(image, image, mask=np.zeros((3, 3), bool))
    with pytest.raises(CCWSIMError, match="pattern size = 13"):
        unseen_patterns(image, image, size=13)
    with pytest.raises(CCWSIMError, match=r"one volume as array\[None\]"):
        unseen_patterns(a_volume(1), a_volume(2))
    with pytest.raises(CCWSIMError, match="3 × 3 × 3 and of 3 cells"):
        js_divergence(pattern_histogram(a_volume(1)), pattern_histogram(image, size=3))
    with pytest.raises(CCWSIMError, match="one number, or three"):
        coarsened(a_volume(1), (1, 2))
    with pytest.raises(CCWSIMError, match="coarsening factor = 8"):
        coarsened(a_volume(1), 8)


def test_a_pattern_that_the_image_has_is_known_in_turned_or_moved_places_only():
    image = np.zeros((6, 12, 12), int)
    image[2, 4] = 1
    moved = np.roll(image, 3, axis=1)
    assert unseen_patterns(moved[None], image, codes=[0, 1])[0] == 0
    upright = np.zeros((6, 12, 12), int)
    upright[:, 4, 4] = 1
    assert unseen_patterns(upright[None], image, codes=[0, 1])[0] > 0
