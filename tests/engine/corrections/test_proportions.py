"""Test the steering towards target proportions: probabilities, margin weights and variation."""

import numpy as np
import pytest
from scipy import stats

from ccwsim import HardData, Parameters, TrainingImage, datasets, simulate
from ccwsim.engine.corrections.proportions import (
    MAX_FACTOR,
    MAX_PRODUCTS,
    MAX_SHARES,
    N_COMPARED_CANDIDATES,
    N_PIECES_ALONG,
    DataProportions,
    Steering,
    closest_to_target,
    draw_between,
    draw_target,
    draw_towards,
    gain_factors,
    margin_weights,
    patch_shares,
    proportions_of_data,
)
from ccwsim.engine.stages.candidates import location_of_number
from ccwsim.engine.stages.path import Box
from ccwsim.engine.stages.pyramid import build_pyramid
from ccwsim.engine.stages.similarity import running_sums
from tests.small_images import blobs

ALL_LEGAL = np.zeros((0, 0, 0), np.uint8)


@pytest.mark.parametrize("layers", [1, 3])
def test_the_candidate_that_corrects_the_proportions_is_taken(layers):
    """Test the probability that each of three candidates is closest in a random sample of three."""
    rng = np.random.default_rng(7)
    image = rng.integers(0, 3, (layers + 2, 12, 14)).astype(np.uint8)
    counts, after, block = np.array([40, 10, 10]), np.zeros(3, np.int64), (1, 2, 2)
    proportions, box = np.array([0.2, 0.4, 0.4]), Box(0, 0, 0, layers, 6, 6, 0, 0, 1, 1)
    n_places = (4, 5)
    candidates = np.array([0, 13, 57 if layers > 1 else 17])

    def off(number: int) -> float:
        z, y, x = location_of_number(number, n_places, block)
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
    chance = [
        ((3 - k) ** N_COMPARED_CANDIDATES - (2 - k) ** N_COMPARED_CANDIDATES)
        / 3**N_COMPARED_CANDIDATES
        for k in range(3)
    ]
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
    weights = margin_weights(patch_shares(sums, size, cells, ALL_LEGAL), proportions)
    windows = np.lib.stride_tricks.sliding_window_view(
        np.stack([image == k for k in range(n_facies)]), (size[0], 16, 16), axis=(1, 2, 3)
    )[:, :, ::2, ::2]
    shares = windows.mean(axis=(4, 5, 6)).reshape(n_facies, -1)
    chance = np.exp(-weights @ shares)
    plain, own = shares.mean(axis=1), shares @ chance / chance.sum()
    assert abs(plain - proportions).max() > 0.01
    np.testing.assert_allclose(own, proportions, atol=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("n_facies", [30, 163, 254])
def test_many_facies_take_a_bounded_number_of_products(n_facies, monkeypatch):
    image = np.random.default_rng(0).integers(0, n_facies, (1, 300, 300)).astype(np.uint8)
    proportions = np.bincount(image.ravel(), minlength=n_facies) / image.size
    sums = build_pyramid(image, (0, 1, 1), n_facies).sums
    own, steps, shares = np.linalg.lstsq, [], patch_shares(sums, (1, 8, 8), 256, ALL_LEGAL)
    monkeypatch.setattr(np.linalg, "lstsq", lambda *a, **k: (steps.append(1), own(*a, **k))[1])
    weights = margin_weights(shares, proportions)
    assert shares.size <= MAX_SHARES
    assert 1 <= len(steps) <= MAX_PRODUCTS // (shares.size * n_facies)
    assert np.isfinite(weights).all()


@pytest.mark.parametrize("n_facies", [2, 3])
def test_a_candidate_is_drawn_as_often_as_its_proportions_say(n_facies):
    rng = np.random.default_rng(3)
    image, block = blobs((3, 24, 28), n_facies, 2), (1, 2, 2)
    sums = build_pyramid(image, (0, 1, 1), 1 if n_facies == 2 else n_facies).sums
    box, n_places = Box(0, 0, 0, 2, 8, 8, 0, 0, 2, 2), (9, 11)
    candidates = np.array([0, 31, 98, 150])
    counts = np.arange(1, n_facies + 1) * 100
    target, gain = np.full(n_facies, 1 / n_facies), np.linspace(0.01, 0.02, n_facies)
    targets = np.stack([1 - target, target, 0 * target])  # of patches 0, 1 and 2
    steering = Steering(targets, np.linspace(0.0, 2.0, n_facies)[None], gain, True)
    tilt, chances = np.zeros(n_facies), np.zeros(4)
    running = running_sums(sums, (0, 1, 1), (2, 8, 8))
    fixed = running, candidates, 1, box, block, n_places, steering, counts, tilt, chances
    drawn = np.bincount([draw_towards(*fixed, rng) for _ in range(4000)], minlength=4)
    weights = steering.margin[0] + gain * (counts - target * counts.sum())
    expected = []
    for number in candidates:
        z, y, x = location_of_number(number, n_places, block)
        patch = image[z : z + 2, y : y + 8, x : x + 8]
        shares = np.bincount(patch.ravel(), minlength=n_facies) / patch.size
        expected.append(np.exp(-weights @ shares))
    expected = 4000 * np.array(expected) / sum(expected)
    assert stats.chisquare(drawn, expected).pvalue > 1e-4


def test_only_rare_facies_have_a_larger_gain():
    image = np.zeros((1, 120, 120), np.uint8)
    image[0, ::2] = 1
    image[0, 20:26, 30:50] = 2
    sums = build_pyramid(image, (0, 1, 1), 3).sums
    proportions = np.bincount(image.ravel()) / image.size
    factors = gain_factors(patch_shares(sums, (1, 8, 8), 256, ALL_LEGAL), proportions)
    assert factors[:2].tolist() == [1, 1]
    assert 1 < factors[2] <= MAX_FACTOR


def test_a_rare_facies_is_not_lost():
    rng = np.random.default_rng(5)
    array, (y, x) = np.zeros((150, 150), int), np.mgrid[:150, :150]
    for row, column in rng.uniform(0, 150, (9, 2)):
        array[(y - row) ** 2 + (x - column) ** 2 < 30] = 1
    image = TrainingImage(array)
    shares = simulate(image, (150, 150), n_realizations=40, seed=3).proportions[:, 1]
    assert abs(shares.mean() / image.proportions[1] - 1) < 0.15


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
    pieces = np.lib.stride_tricks.sliding_window_view(
        image[0], (120 // N_PIECES_ALONG, 160 // N_PIECES_ALONG)
    )
    own = pieces.mean(axis=(2, 3)).std() / N_PIECES_ALONG
    assert spread[1, 120, 160] == pytest.approx(own, rel=0.15)


@pytest.mark.parametrize("shape", [(1, 40, 60), (6, 40, 60)])
def test_margins_of_the_image_count_like_its_middle_in_targets(shape):
    image = np.zeros(shape, np.uint8)
    image[..., :4] = 1
    image[:, -3:, 20:30] = 2
    proportions = np.bincount(image.ravel()) / image.size
    rng = np.random.default_rng(0)
    targets = np.array([draw_target(image, proportions, shape, rng) for _ in range(4000)])
    errors = targets.std(axis=0) / len(targets) ** 0.5
    assert (abs(targets.mean(axis=0) - proportions) < 4 * errors).all()


def test_targets_of_a_volume_vary_as_its_columns_do_not_as_its_layers():
    layers = np.repeat(np.arange(3), 8)[:, None, None]
    image = np.broadcast_to(layers, (24, 60, 60)).astype(np.uint8).copy()
    image[:, :20] = np.roll(image[:, :20], 2, axis=0)  # with equal numbers of each facies
    image[4:8, 30:, 30:] = 2
    proportions = np.bincount(image.ravel()) / image.size
    rng = np.random.default_rng(0)
    targets = np.array([draw_target(image, proportions, (24, 60, 60), rng) for _ in range(400)])
    assert targets[:, 1].std() == pytest.approx(0, abs=1e-12)
    assert targets[:, 2].std() > 0.01


def test_the_mean_of_realizations_is_that_of_the_image_and_each_has_its_own():
    image = TrainingImage(np.roll(blobs((90, 90), 2), 20, axis=0))
    p = Parameters(16, 4, 1, repair_seams=False)
    steered = simulate(image, (200, 200), p, n_realizations=40, seed=1).proportions[:, 1]
    matched = Parameters(16, 4, 1, repair_seams=False, match_proportions=True)
    matched = simulate(image, (200, 200), matched, n_realizations=40, seed=1).proportions[:, 1]
    assert abs(steered.mean() - image.proportions[1]) < 0.01
    assert steered.std() > 3 * matched.std()


def test_a_column_of_data_weighs_as_the_part_of_the_grid_that_is_nearest_to_it():
    rng = np.random.default_rng(4)
    image, shape = blobs((12, 40, 50), 3), (9, 30, 44)
    places = np.array([(2, 3), (2, 4), (25, 40), (14, 20), (3, 3)])
    cells = np.array([(z, y, x) for y, x in places for z in rng.permutation(9)[:5]])
    facies = rng.integers(0, 3, len(cells)).astype(np.uint8)
    order = rng.permutation(len(cells))
    proportions = np.bincount(image.ravel()) / image.size
    found = proportions_of_data(cells[order], facies[order], image, proportions, shape)
    rows, columns = np.indices(shape[1:])
    distance = np.hypot(*(np.stack([rows, columns])[:, None] - places.T[:, :, None, None]))
    nearest = distance == distance.min(axis=0)
    by_place = places[:, 0] * shape[2] + places[:, 1]
    expected = (nearest / nearest.sum(axis=0)).mean(axis=(1, 2))[np.argsort(by_place)]
    np.testing.assert_allclose(found.weights, expected, atol=0.03)  # any of equally close columns
    of_places = (
        np.stack([np.bincount(facies[5 * k : 5 * k + 5], minlength=3) for k in range(5)]) / 5
    )
    np.testing.assert_allclose(found.shares, of_places[np.argsort(by_place)])
    targets = [draw_target(image, proportions, shape, rng) for _ in range(2000)]
    assert found.natural == pytest.approx(np.var(targets, axis=0).sum(), rel=0.5)


def as_data(shares) -> DataProportions:
    shares = np.column_stack([1 - np.array(shares), shares])
    columns, weights = np.zeros((len(shares), 2), int), np.full(len(shares), 1 / len(shares))
    return DataProportions(columns, shares, weights, natural=0.002)


def targets(data: DataProportions, n: int = 500) -> np.ndarray:
    """Return targets for an image with 30 % sand, whose pieces vary by 0.03."""
    rng = np.random.default_rng(1)
    image = np.array([0.7, 0.3])
    drawn = image + np.outer(rng.normal(0, 0.002**0.5 / 2**0.5, n), [-1, 1])
    found = [draw_between(target, image, data, rng) for target in drawn]
    return np.array([target for target in found if target is not None])


def test_many_data_decide_the_target_and_few_leave_it_to_the_image():
    few, many = targets(as_data([0, 1, 1, 0])), targets(as_data(np.arange(2000) % 20 < 7))
    assert abs(few[:, 1].mean() - 0.3) < 0.01
    assert abs(many[:, 1].mean() - 0.35) < 0.01
    assert abs(many[:, 1].mean() - 0.35) < abs(many[:, 1].mean() - 0.3)
    np.testing.assert_allclose(many.sum(axis=1), 1)


def test_targets_vary_as_far_as_data_leave_them_open():
    spread = [targets(as_data(np.arange(n) % 10 < 3))[:, 1].std() for n in (10, 200, 4000)]
    assert spread[0] > spread[1] > spread[2]
    data = 2 * 0.3 * 0.7 / 4000  # their variance, over both facies
    assert spread[2] == pytest.approx((0.5 / (1 / 0.002 + 1 / data)) ** 0.5, rel=0.15)


def test_nothing_is_steered_by_data_that_contradict_the_image():
    assert len(targets(as_data(np.arange(400) % 10 < 8))) == 0
    assert len(targets(as_data([1, 1, 0]))) == 500  # two of three may be sand by chance


@pytest.mark.slow
def test_volumes_with_wells_have_the_proportions_of_the_image():
    """Test that sand between wells is biased by over 4 points only with the published method."""
    image, wells = (
        datasets.load("sinuous_channels"),
        datasets.load_hard_data("sinuous_channels_10_wells"),
    )
    lengths = {"template_size": (16, 32, 32), "overlap_size": (4, 8, 8), "wavelet_level": (1, 2, 2)}
    off = {}
    for published in (False, True):
        p = Parameters(**lengths, published_draw=published)
        e = simulate(image, datasets.catalogue.WELLS_SHAPE, p, wells, n_realizations=12, seed=3)
        assert not e.n_mismatched.any()
        off[published] = abs(e.proportions[:, 1].mean() - image.proportions[1])
    assert off[False] < 0.04 < off[True]


def test_data_that_agree_with_the_image_take_bias_away():
    image = TrainingImage(blobs((90, 90), 2))
    field = blobs((200, 200), 2)
    cells = np.argwhere(np.ones(field.shape))[
        np.random.default_rng(0).permutation(field.size)[:200]
    ]
    data = HardData(cells, field[tuple(cells.T)])
    p = Parameters(16, 4, 1, repair_seams=False)
    e = simulate(image, field.shape, p, data, n_realizations=30, seed=1)
    assert not e.n_mismatched.any()
    assert abs(e.proportions[:, 1].mean() - field.mean()) < 0.015
