"""Test that the proportions of realizations follow a trend of the data."""

from __future__ import annotations

import numpy as np
import pytest

from ccwsim import HardData, Parameters, TrainingImage, simulate
from ccwsim.engine.corrections.proportions import draw_between, proportions_of_data
from ccwsim.engine.corrections.trend_of_data import (
    expected_before,
    is_representative,
    rake,
    trend_of_data,
)
from ccwsim.engine.stages.path import in_order, make_patches, make_path
from tests.small_images import blobs

SHAPE = (1, 120, 100)


def data_with(chance: np.ndarray, n: int = 300, seed: int = 0):
    """Return the proportions of data; `chance` is the probability of facies 1 in each row."""
    rng = np.random.default_rng(seed)
    cells = rng.choice(SHAPE[1] * SHAPE[2], n, replace=False)
    cells = np.column_stack([np.zeros(n, int), *np.divmod(cells, SHAPE[2])])
    facies = (rng.random(n) < chance[cells[:, 1]]).astype(np.uint8)
    mean = float(chance.mean())
    image = blobs((1, 60, 60), 2)
    return proportions_of_data(cells, facies, image, np.array([1 - mean, mean]), SHAPE)


def test_a_trend_is_found_and_only_where_there_is_one():
    rows = np.linspace(0.0, 0.9, SHAPE[1])
    trend = trend_of_data(data_with(rows), SHAPE, 8.0)
    assert trend is not None
    found = trend.proportions[..., 1].mean(axis=1)
    wanted = rows[((np.arange(len(found)) + 0.5) * trend.pixel).astype(int).clip(max=SHAPE[1] - 1)]
    assert np.abs(found - wanted).max() < 0.15
    assert np.allclose(trend.proportions.sum(axis=-1), 1)
    assert 0.3 < trend.residual < 0.9
    even = [trend_of_data(data_with(np.full(120, 0.3), seed=k), SHAPE, 8.0) for k in range(20)]
    assert sum(each is not None for each in even) <= 2
    assert trend_of_data(data_with(rows, 9), SHAPE, 8.0) is None


def test_data_at_random_places_are_representative_and_preferential_data_are_not():
    def found(preferred: float, n: int, seed: int) -> bool:
        rng, cells = np.random.default_rng(seed), SHAPE[1] * SHAPE[2]
        sand = (np.indices(SHAPE[1:]) // 20).sum(axis=0).ravel() % 2
        chance = np.where(sand, preferred, 1.0)
        at = rng.choice(cells, n, replace=False, p=chance / chance.sum())
        places = np.column_stack([np.zeros(n, int), *np.divmod(at, SHAPE[2])])
        image, half = blobs((1, 60, 60), 2), np.array([0.5, 0.5])
        facies = sand[at].astype(np.uint8)
        return is_representative(proportions_of_data(places, facies, image, half, SHAPE))

    assert sum(found(1, 400, k) for k in range(20)) >= 14
    assert not any(found(4, 400, k) for k in range(10))
    assert not found(1, 100, 0)  # too few to tell


def test_a_trend_lets_data_contradict_the_image():
    south = np.where(np.arange(SHAPE[1]) < 60, 0.5, 0.02)
    data = data_with(south, 600)
    trend = trend_of_data(data, SHAPE, 8.0)
    assert trend is not None
    assert 0.02 < trend.between < 0.2
    image, rng = np.array([0.5, 0.5]), np.random.default_rng(0)
    assert draw_between(image, image, data, rng, trend.residual) is None
    steered = draw_between(image, image, data, rng, trend.residual, trend.between)
    assert steered is not None
    assert abs(steered[1] - 0.26) < 0.08


def test_bodies_do_not_fill_the_empty_side_of_a_truth():
    """Test that, with data at random positions, proportions are those of the truth."""
    image = blobs((1, 128, 128), 2)[0]
    truth = np.rot90(image, 2).copy()
    truth[64:] = 0
    cells = np.random.default_rng(3).choice(truth.size, 400, replace=False)
    at = np.column_stack(np.unravel_index(cells, truth.shape))
    data = HardData(at, truth[tuple(at.T)])
    e = simulate(TrainingImage(image), truth.shape, Parameters(24, 8), data, 8)
    assert e.n_mismatched.max() == 0
    assert abs(e.proportions[:, 1].mean() - truth.mean()) < 0.35 * (image.mean() - truth.mean())


def test_a_raked_map_has_the_mean_that_is_wanted():
    rng = np.random.default_rng(1)
    given = rng.dirichlet([2, 1, 1], (20, 30))
    raked = rake(given, np.array([0.3, 0.3, 0.4]))
    assert np.allclose(raked.mean(axis=(0, 1)), [0.3, 0.3, 0.4], atol=0.01)
    assert np.allclose(raked.sum(axis=-1), 1)
    assert np.allclose(rake(given, given.mean(axis=(0, 1))), given, atol=1e-6)


@pytest.mark.parametrize("offset", [(0, 0, 0), (0, 5, 17)])
def test_expected_proportions_are_those_of_the_cells_that_are_done(offset):
    template, overlap, pixel = (1, 32, 32), (0, 8, 8), 2.0
    path = make_path(SHAPE, 0, template, overlap, 0, offset)
    step = tuple(t - o for t, o in zip(template, overlap, strict=True))
    splits = np.array([(1, 1, 1)])
    patches = make_patches(path, step, overlap, splits, np.zeros(len(in_order(path)), np.int64))
    share = np.random.default_rng(0).random((60, 50))
    given = np.stack([1 - share, share], axis=-1)
    found = expected_before(given, pixel, patches, overlap, (1, 1, 1), path)
    assert np.allclose(found.sum(axis=1), 1)
    assert np.allclose(found[0], given.mean(axis=(0, 1)))
    # cell by cell, for the patches of the interior
    cells = np.full(path.full[1:], np.nan)
    oy, ox = offset[1:]
    cells[oy : oy + 120, ox : ox + 100] = np.kron(share, np.ones((2, 2)))
    done = np.zeros(path.full[1:], bool)
    for k, (_, y, x, _, ny, nx, *_) in enumerate(patches):
        if k > 3:
            assert abs(found[k, 1] - np.nanmean(cells[done])) < 0.05
        done[y : y + ny, x : x + nx] = True


def test_facies_stay_where_data_show_them():
    """Test that channels of an image without trend do not fill a part without data of channels."""
    image = TrainingImage(blobs((1, 100, 100), 2)[0])
    rng = np.random.default_rng(2)
    at = rng.choice(120 * 100, 400, replace=False)
    cells = np.column_stack(np.divmod(at, 100))
    share = float(image.proportions[1])
    north = cells[:, 0] >= 60
    facies = np.where(north, rng.random(400) < min(1.6 * share, 1.0), rng.random(400) < 0.4 * share)
    e = simulate(image, (120, 100), Parameters(16, 4, 1), HardData(cells, facies.astype(int)), 8)
    low, high = (e.indices[:, part].mean() for part in (np.s_[:50], np.s_[70:]))
    assert e.n_mismatched.sum() == 0
    assert low < 0.75 * share
    assert high > 1.15 * share
