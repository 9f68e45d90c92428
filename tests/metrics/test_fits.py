"""Test the verdicts on patterns and on proportions of layers, relative to crops of the image."""

from __future__ import annotations

import numpy as np
import pytest

from ccwsim import TrainingImage
from ccwsim.metrics import (
    fit_geobodies,
    fit_patterns,
    geobody_statistics,
    pattern_distance,
)
from ccwsim.metrics.reference_band import crops_of, pieces_of
from tests.metrics.test_reference_band import ensemble_of
from tests.metrics.volumes import a_volume

GRID = (12, 24, 24)


@pytest.fixture(scope="module")
def beds() -> TrainingImage:
    """Return a volume in which facies 7 becomes rarer upwards."""
    field = a_volume(3, (12, 60, 60), range(100), smooth=1.5)
    return TrainingImage(np.where(field < np.linspace(70, 10, 12)[:, None, None], 7, 3))


def windows(image: TrainingImage, n: int = 6) -> np.ndarray:
    """Return windows of an image as large as the grid, as facies indices."""
    rng = np.random.default_rng(0)
    places = rng.integers(0, np.array(image.shape[1:]) - GRID[1:] + 1, (n, 2))
    return np.array([image.indices[:, y : y + GRID[1], x : x + GRID[2]] for y, x in places])


def test_patterns_of_pieces_are_as_far_as_pattern_distance_says(beds):
    own = windows(beds)
    fit = fit_patterns(ensemble_of(beds, own))
    assert fit.at.tolist() == [2, 3]
    pieces = beds.codes[pieces_of(ensemble_of(beds, own), fit.crop_shape).indices]
    for k, size in enumerate((2, 3)):
        alone = pattern_distance(pieces, beds, size=size, factors=(1,))
        assert fit.found[k] == pytest.approx(alone.mean())
    assert fit.fits
    assert fit.one_sided


def test_a_crop_is_compared_with_the_image_without_its_patterns():
    """Test that the reference of a crop excludes its own patterns, for an image of two halves."""
    rng = np.random.default_rng(1)
    west, east = rng.integers(0, 2, (64, 64)), 2 + rng.integers(0, 2, (64, 64))
    image = TrainingImage(np.hstack([west, east]))
    ensemble = ensemble_of(image, image.indices[None])
    fit = fit_patterns(ensemble, [1])
    rows, columns = fit.crop_shape
    crops = crops_of(image.indices, fit.crop_shape)
    whole = np.bincount(image.indices.ravel(), minlength=4)
    wanted = []
    for crop in crops:
        p = np.bincount(crop.ravel(), minlength=4)
        q = whole - p
        p, q = p / p.sum(), q / q.sum()
        m = (p + q) / 2
        terms = [x * np.log2(x / y) for a in (p, q) for x, y in zip(a, m, strict=True) if x]
        wanted.append(sum(terms) / 2)
    assert (rows, columns) == (16, 32)
    assert fit.reference[0] == pytest.approx(np.mean(wanted))


def test_noise_is_farther_than_crops(beds):
    noise = np.random.default_rng(1).integers(0, 2, (3, *GRID)).astype(np.uint8)
    fit = fit_patterns(ensemble_of(beds, noise))
    assert fit.outside.all()
    assert (fit.found > fit.reference).all()


def test_fewer_neighbours_connect_less(beds):
    ensemble = ensemble_of(beds, windows(beds))
    sides, all_of_them = (fit_geobodies(ensemble, 7, n) for n in (6, 26))
    assert sides.found[0] <= all_of_them.found[0]
    assert np.array_equal(all_of_them.found, fit_geobodies(ensemble, 7).found)
    pieces = beds.codes[pieces_of(ensemble, sides.crop_shape).indices]
    alone = geobody_statistics(pieces, 7, 6).gamma
    assert sides.found[0] == pytest.approx(alone.mean())


def test_shares_in_geobodies_are_those_of_counting(beds):
    found = geobody_statistics(beds, 7, 6)
    sizes = found.sizes[0]
    at_least = [1, 2, 5, 50, int(sizes[0]), int(sizes[0]) + 1]
    wanted = [sizes[sizes >= n].sum() / sizes.sum() for n in at_least]
    assert found.share_in(at_least)[0] == pytest.approx(wanted)
    assert wanted[-1] == 0
    absent = geobody_statistics(np.zeros((1, 4, 5, 6), bool), 1)
    assert np.isnan(absent.share_in([1, 9])).all()
