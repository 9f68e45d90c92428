"""Test that statistics ignore unknown and inactive cells, by brute force."""

import numpy as np
import pytest

from ccwsim import Parameters, Secondary, TrainingImage, metrics, simulate
from ccwsim.metrics.measures import MEASURES, OfFacies
from ccwsim.metrics.stack import as_stack
from tests.small_images import blobs

RNG = np.random.default_rng(0)
SHAPE = (34, 41)
CELLS = blobs((3, *SHAPE), 3)
HOLE = np.zeros(SHAPE, bool)
HOLE[5:16, 20:] = True
HOLE |= RNG.random(SHAPE) < 0.03
GAPS = np.where(HOLE, np.nan, CELLS)


def ensemble():
    p, secondary = Parameters(8, 2, 1), Secondary(active=~HOLE)
    return simulate(TrainingImage(CELLS[0]), SHAPE, p, None, 4, secondary=secondary)


def test_proportions_and_etype():
    e = ensemble()
    inside = e.indices[:, ~HOLE]
    expected = np.stack([(inside == k).mean(axis=1) for k in range(3)], axis=1)
    np.testing.assert_allclose(metrics.proportions(e), expected)
    np.testing.assert_allclose(e.proportions, expected)
    found = metrics.etype(e)
    assert np.isnan(found.probability[:, HOLE]).all()
    np.testing.assert_allclose(found.probability[1][~HOLE], (inside == 1).mean(axis=0))
    np.testing.assert_array_equal(found.probability[1], e.probability(1))
    assert metrics.facies_counts(e)[:, HOLE].sum() == 0
    most = found.probability[:, ~HOLE].argmax(axis=0)
    assert np.isnan(found.most_likely[HOLE]).all()
    np.testing.assert_array_equal(found.most_likely[~HOLE], e.training_image.codes[most])
    assert (found.most_likely_indices[HOLE] == 255).all()


@pytest.mark.parametrize("step", [(0, 3), (2, 0), (2, 2), (3, -3)])
def test_variograms_and_transiograms(step):
    dy, dx = step
    first = GAPS[:, : SHAPE[0] - dy, max(0, -dx) : SHAPE[1] - max(0, dx)]
    second = GAPS[:, dy:, max(0, dx) : SHAPE[1] - max(0, -dx)]
    known = ~np.isnan(first) & ~np.isnan(second)
    gamma = [
        np.mean((a[k] == 1) != (b[k] == 1)) / 2
        for a, b, k in zip(first, second, known, strict=True)
    ]
    found = metrics.variogram(GAPS, 1, step, [1]).gamma[:, 0]
    np.testing.assert_allclose(found, gamma)
    whole = metrics.variogram_map(GAPS, 1, 3)
    np.testing.assert_allclose(whole.gamma[:, 3 + dy, 3 + dx], gamma)
    pairs = [np.mean(b[(a == 1) & k] == 2) for a, b, k in zip(first, second, known, strict=True)]
    table = metrics.transiograms(GAPS, [0, 1, 2], step, [1]).probability
    np.testing.assert_allclose(table[:, 1, 2, 0], pairs)


def test_patterns_with_unknown_cells_are_left_out():
    windows = np.lib.stride_tricks.sliding_window_view(GAPS[0], (4, 4)).reshape(-1, 16)
    windows = windows[~np.isnan(windows).any(axis=1)]
    _, counts = np.unique(windows, axis=0, return_counts=True)
    found = metrics.pattern_histogram(GAPS[0], codes=[0, 1, 2])
    np.testing.assert_allclose(np.sort(found.frequencies), np.sort(counts) / counts.sum())


def test_every_figure_of_a_masked_ensemble_is_finite_or_missing():
    e = ensemble()
    image = e.training_image
    for call in (
        lambda: metrics.connectivity(e, 1),
        lambda: metrics.connected_geobodies(e[[0]], 1),
        lambda: metrics.geobody_statistics(e, 1),
        lambda: metrics.pattern_distance(e, image),
        lambda: metrics.unseen_patterns(e, image),
        lambda: metrics.entropy(metrics.etype(e).probability),
        lambda: metrics.measure(e, 1),
        lambda: metrics.judge(e),
        lambda: metrics.check_ensemble(e),
        lambda: metrics.coarsened(e[[0]], 2),
        lambda: metrics.differing_share(e.realizations),
        lambda: metrics.anodi({"masked": e, "same": e}, image),
        lambda: metrics.feature_spacing(e[[0]]),
        lambda: metrics.stationarity(e[[0]]),
        lambda: metrics.diagnose(TrainingImage(GAPS[0])),
    ):
        call()


def test_pairs_of_realizations_are_compared_in_known_cells_only():
    inside = [cells[~HOLE] for cells in CELLS]
    shares = [np.mean(inside[a] != inside[b]) for a, b in ((0, 1), (0, 2), (1, 2))]
    assert metrics.differing_share(GAPS) == pytest.approx(np.mean(shares))
    one = GAPS.copy()
    one[2] = np.nan  # a realization without known cells
    assert metrics.differing_share(one, range(3)) == pytest.approx(shares[0])
    assert np.isnan(metrics.differing_share(one[1:], range(3)))


@pytest.mark.parametrize("volume", [False, True])
def test_measures_count_known_cells_only(volume):
    cells = GAPS[:, None] if volume else GAPS
    of = OfFacies(as_stack(cells, range(3)), 1, TrainingImage(np.nan_to_num(cells[0])))
    found = {m.name: m.values(of) for m in MEASURES if m.volumes in (None, volume)}
    for k, image in enumerate(GAPS):
        pairs = [
            (a, b)
            for first, second in ((image[:, 1:], image[:, :-1]), (image[1:], image[:-1]))
            for a, b in zip(first.ravel(), second.ravel(), strict=True)
            if not np.isnan(a + b)
        ]
        unequal = np.mean([(a == 1) != (b == 1) for a, b in pairs])
        assert found["boundary"][k] == pytest.approx(unequal)
        assert found["proportion"][k] == pytest.approx(np.mean(image[~HOLE] == 1))
        per = 1_000_000 if volume else 10_000
        assert found["geobodies"][k] == pytest.approx(
            per * metrics.geobody_statistics(image, 1).n_geobodies[0] / (~HOLE).sum()
        )


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("hole", [np.s_[:64, :64], np.s_[:, :56], np.s_[::21, ::21]])
def test_gaps_do_not_make_an_image_nonstationary(hole):
    drifting = 0
    for seed in range(6):
        image = blobs((128, 132), 3, seed).astype(float)
        image[hole] = np.nan
        drifting += not metrics.stationarity(image).stationary
        volume = np.repeat(image[None], 3, axis=0)
        volume[1] = np.nan
        layers = metrics.stationarity(volume[None])
        np.testing.assert_allclose(
            layers.differences, metrics.stationarity(image).differences, atol=1e-6
        )
    assert drifting <= 1


def test_a_trend_is_found_beside_a_gap():
    image = blobs((128, 132), 2).astype(float)
    image[:, 90:] = np.random.default_rng(0).random((128, 42)) < 0.9
    image[20:70, :40] = np.nan
    assert metrics.stationarity(image).drifting[7].any()  # the eastern half


@pytest.mark.filterwarnings("error")
def test_an_ensemble_whose_pieces_are_not_all_active_is_compared_with_crops():
    image, active = TrainingImage(blobs((128, 128), 2)), np.ones((150, 150), bool)
    active[:80, :80] = False
    e = simulate(image, (150, 150), Parameters(16, 4, 1), secondary=Secondary(active=active))
    fit = metrics.fit_patterns(e)
    assert fit is not None
    assert fit.fits
    crop = np.full((128, 128), np.nan)
    crop[:64, :64] = image.array[:64, :64]
    assert metrics.check_ensemble(simulate(crop, (100, 100), Parameters(16, 4, 1)))
