"""The draw is steered to a target: its chances, margins and spread are as they are meant to be."""

import numpy as np
import pytest
from scipy import stats

from ccwsim import Parameters, TrainingImage, simulate
from ccwsim.engine.stages.box import Box
from ccwsim.engine.stages.candidates import place_of
from ccwsim.engine.stages.proportions import (
    N_COMPARED,
    PART,
    Steering,
    closest_to_target,
    draw_target,
    draw_towards,
    margin_weights,
)
from ccwsim.engine.stages.pyramid import build_pyramid
from tests.small_images import blobs


@pytest.mark.parametrize("layers", [1, 3])
def test_the_candidate_that_corrects_the_proportions_is_taken(layers):
    """With many more draws than candidates, each of them is looked at but for bad luck."""
    rng = np.random.default_rng(7)
    image = rng.integers(0, 3, (layers + 2, 12, 14)).astype(np.uint8)
    counts, after, block = np.array([40, 10, 10]), np.zeros(3, np.int64), (1, 2, 2)
    proportions, box = np.array([0.2, 0.4, 0.4]), Box(0, 0, 0, layers, 6, 6, 0, 0, 1, 1)
    n_places = (4, 5)
    candidates = np.array([0, 13, 57 if layers > 1 else 17])

    def off(number: int) -> float:
        z, y, x = place_of(number, n_places, block)
        patch = image[z : z + layers, y : y + 6, x : x + 6]
        sums = counts + np.bincount(patch.ravel(), minlength=3)
        return float(np.abs(sums - proportions * sums.sum()).sum())

    drawn = [
        closest_to_target(
            image, candidates, box, block, n_places, proportions, counts, after, rng
        )
        for _ in range(400)
    ]  # fmt: skip
    shares = np.bincount(drawn, minlength=3)
    best_first = np.argsort([off(number) for number in candidates])
    chance = [((3 - k) ** N_COMPARED - (2 - k) ** N_COMPARED) / 3**N_COMPARED for k in range(3)]
    assert stats.chisquare(shares[best_first], np.array(chance) * 400).pvalue > 1e-4


@pytest.mark.parametrize("shape", [(1, 50, 61), (9, 20, 24)])
@pytest.mark.parametrize("n_facies", [2, 3])
def test_weighted_patches_have_the_proportions_of_the_image(shape, n_facies):
    image = blobs(shape, n_facies)
    image[:, :8] = 0  # a margin of one facies, which few patches cover
    proportions = np.bincount(image.ravel(), minlength=n_facies) / image.size
    level = (0, 1, 1)
    sums = build_pyramid(image, level, 1 if n_facies == 2 else n_facies).sums
    size = (min(4, shape[0]), 8, 8)
    cells = size[0] * 16 * 16
    weights = margin_weights(sums, size, cells, proportions)
    windows = np.lib.stride_tricks.sliding_window_view(
        np.stack([image == k for k in range(n_facies)]), (size[0], 16, 16), axis=(1, 2, 3)
    )[:, :, ::2, ::2]
    shares = windows.mean(axis=(4, 5, 6)).reshape(n_facies, -1)
    chance = np.exp(-weights @ shares)
    plain, own = shares.mean(axis=1), shares @ chance / chance.sum()
    assert abs(plain - proportions).max() > 0.01
    np.testing.assert_allclose(own, proportions, atol=1e-5)


@pytest.mark.parametrize("n_facies", [2, 3])
def test_a_candidate_is_drawn_as_often_as_its_proportions_say(n_facies):
    rng = np.random.default_rng(3)
    image, block = blobs((3, 24, 28), n_facies, 2), (1, 2, 2)
    sums = build_pyramid(image, (0, 1, 1), 1 if n_facies == 2 else n_facies).sums
    box, n_places = Box(0, 0, 0, 2, 8, 8, 0, 0, 2, 2), (9, 11)
    candidates = np.array([0, 31, 98, 150])
    counts = np.arange(1, n_facies + 1) * 100
    target = np.full(n_facies, 1 / n_facies)
    steering = Steering(target, np.linspace(0.0, 2.0, n_facies), 0.02)
    tilt, chances = np.zeros(n_facies), np.zeros(4)
    fixed = sums, candidates, box, block, n_places, steering, counts, tilt, chances
    drawn = np.bincount([draw_towards(*fixed, rng) for _ in range(4000)], minlength=4)
    weights = steering.margin + 0.02 * (counts - target * counts.sum())
    expected = []
    for number in candidates:
        z, y, x = place_of(number, n_places, block)
        patch = image[z : z + 2, y : y + 8, x : x + 8]
        shares = np.bincount(patch.ravel(), minlength=n_facies) / patch.size
        expected.append(np.exp(-weights @ shares))
    expected = 4000 * np.array(expected) / sum(expected)
    assert stats.chisquare(drawn, expected).pvalue > 1e-4


def test_targets_vary_as_pieces_of_the_image_do():
    image = blobs((1, 120, 160), 2)
    proportions = np.bincount(image.ravel()) / image.size
    rng = np.random.default_rng(0)
    spread = {}
    for shape in ((1, 60, 80), (1, 120, 160)):
        targets = np.array([draw_target(image, proportions, shape, rng) for _ in range(600)])
        np.testing.assert_allclose(targets.sum(axis=1), 1)
        assert (targets >= 0).all()
        spread[shape] = targets[:, 1].std()
    assert spread[1, 60, 80] == pytest.approx(2 * spread[1, 120, 160], rel=0.15)
    pieces = np.lib.stride_tricks.sliding_window_view(image[0], (120 // PART, 160 // PART))
    own = pieces.mean(axis=(2, 3)).std() / PART
    assert spread[1, 120, 160] == pytest.approx(own, rel=0.15)


def test_the_mean_of_realizations_is_that_of_the_image_and_each_has_its_own():
    image = TrainingImage(np.roll(blobs((90, 90), 2), 20, axis=0))
    p = Parameters(16, 4, 1, repair_seams=False)
    steered = simulate(image, (200, 200), p, n_realizations=40, seed=1).proportions[:, 1]
    matched = Parameters(16, 4, 1, repair_seams=False, match_proportions=True)
    matched = simulate(image, (200, 200), matched, n_realizations=40, seed=1).proportions[:, 1]
    assert abs(steered.mean() - image.proportions[1]) < 0.01
    assert steered.std() > 3 * matched.std()
