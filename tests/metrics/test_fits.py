"""Patterns and proportions by layer are judged by what crops of the training image have."""

from __future__ import annotations

import numpy as np
import pytest

from ccwsim import CCWSIMError, TrainingImage
from ccwsim.metrics import (
    fit_geobodies,
    fit_patterns,
    fit_vertical_proportions,
    geobody_statistics,
    pattern_distance,
    vertical_proportions,
)
from ccwsim.metrics.reference_band import crop_shape, crops_of, pieces_of
from tests.metrics.test_reference_band import ensemble_of
from tests.metrics.volumes import a_volume

GRID = (12, 24, 24)


@pytest.fixture(scope="module")
def beds() -> TrainingImage:
    """A volume with less of facies 7 the higher it is."""
    field = a_volume(3, (12, 60, 60), range(100), smooth=1.5)
    return TrainingImage(np.where(field < np.linspace(70, 10, 12)[:, None, None], 7, 3))


def windows(image: TrainingImage, n: int = 6) -> np.ndarray:
    """Windows of an image as large as the grid, as indices of its facies."""
    rng = np.random.default_rng(0)
    places = rng.integers(0, np.array(image.shape[1:]) - GRID[1:] + 1, (n, 2))
    return np.array([image.indices[:, y : y + GRID[1], x : x + GRID[2]] for y, x in places])


def test_layers_are_those_of_the_image_and_of_the_realizations(beds):
    own = windows(beds)
    fit = fit_vertical_proportions(ensemble_of(beds, own), 7)
    index = beds.index_of(7)
    assert fit.at.tolist() == list(range(12))
    assert fit.reference == pytest.approx((beds.array == 7).mean(axis=(1, 2)))
    assert fit.found == pytest.approx((own == index).mean(axis=(0, 2, 3)))
    assert fit.judged
    assert fit.fits


def test_layers_upside_down_are_outside_with_the_sign_of_the_trend(beds):
    fit = fit_vertical_proportions(ensemble_of(beds, windows(beds)[:, ::-1]), 7)
    assert fit.outside[0]
    assert fit.outside[-1]
    assert fit.found[0] < fit.reference[0]
    assert fit.found[-1] > fit.reference[-1]


def test_a_grid_of_other_layers_is_not_judged_and_a_map_refused(beds):
    assert fit_vertical_proportions(ensemble_of(beds, windows(beds)[:, :10]), 7) is None
    flat = TrainingImage(beds.array[0])
    with pytest.raises(CCWSIMError, match="volumes, not maps"):
        fit_vertical_proportions(ensemble_of(flat, flat.indices[None]), 7)


def test_patterns_are_as_far_as_pattern_distance_says(beds):
    own = windows(beds)
    fit = fit_patterns(ensemble_of(beds, own))
    shape = crop_shape(beds.shape, GRID)
    assert fit.at.tolist() == [2, 3]
    for k, size in enumerate((2, 3)):
        pieces = beds.codes[pieces_of(own, shape)]
        crops = beds.codes[crops_of(beds.indices, shape)]
        for found, images in ((fit.found, pieces), (fit.reference, crops)):
            alone = pattern_distance(images, beds, size=size, factors=(1,))
            assert found[k] == pytest.approx(alone.mean())
    assert fit.fits


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
    pieces = beds.codes[pieces_of(ensemble.indices, sides.crop_shape)]
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


def test_layers_of_the_metric_and_of_the_fit_are_one(beds):
    ensemble = ensemble_of(beds, windows(beds))
    fit = fit_vertical_proportions(ensemble, 3)
    assert fit.found == pytest.approx(vertical_proportions(ensemble)[:, 0].mean(axis=0))
