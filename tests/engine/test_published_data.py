"""Test realizations of the published training images and hard data."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from ccwsim import HardData, Parameters, TrainingImage, simulate


def image_of(folder: Path, name: str) -> TrainingImage:
    return TrainingImage(np.load(folder / "paper" / f"{name}.npy"))


def data_of(folder: Path, name: str) -> HardData:
    rows = np.loadtxt(folder / "paper" / f"{name}.csv", delimiter=",", skiprows=1, dtype=int)
    return HardData(rows[:, :2], rows[:, 2])


def pattern_shares(image: NDArray) -> NDArray[np.float64]:
    windows = np.lib.stride_tricks.sliding_window_view(image, (4, 4)).reshape(-1, 16)
    numbers = windows.astype(np.int64) @ (1 << np.arange(16))
    return np.bincount(numbers, minlength=1 << 16) / len(numbers)


def divergence(p: NDArray, q: NDArray) -> float:
    """Return the Jensen–Shannon divergence in bits."""
    middle = (p + q) / 2

    def half(a: NDArray) -> float:
        there = a > 0
        return float((a[there] * np.log2(a[there] / middle[there])).sum()) / 2

    return half(p) + half(q)


@pytest.mark.slow
@pytest.mark.parametrize("level", [1, 2, 3])
def test_scattered_data_are_honoured_by_patches_and_windows(data_dir, level):
    ti = image_of(data_dir, "ti_channel_256x256")
    data = data_of(data_dir, "hd_channel_400_grid512x512")
    p = Parameters(wavelet_level=level)
    ensemble = simulate(ti, (512, 512), p, data, n_realizations=3, seed=1)
    assert data.n == 397
    assert ensemble.n_mismatched.tolist() == [0, 0, 0]
    assert ((ensemble.data_status == 0).sum(axis=1) > 0.85 * data.n).all()
    assert (ensemble.n_forced <= 0.01 * data.n).all()


@pytest.mark.slow
@pytest.mark.parametrize(("level", "most"), [(1, 0.0040), (2, 0.0056), (3, 0.0140)])
def test_patterns_are_as_near_to_the_image_as_twice_the_published_distance(data_dir, level, most):
    ti = image_of(data_dir, "ti_channel_256x256")
    p = Parameters(wavelet_level=level)
    realizations = simulate(ti, (512, 512), p, n_realizations=4, seed=1).indices
    mean = np.mean([pattern_shares(r) for r in realizations], axis=0)
    assert divergence(mean, pattern_shares(ti.indices)) < most


def test_conditional_realizations_stay_varied(data_dir):
    ti = image_of(data_dir, "ti_channel_256x256")
    data = data_of(data_dir, "hd_channel_400_grid512x512")
    a, b, c = simulate(ti, (512, 512), None, data, n_realizations=3, seed=2).realizations
    for one, other in ((a, b), (a, c), (b, c)):
        assert np.mean(one != other) > 0.2


def test_dense_data_are_honoured_on_the_whole_grid(data_dir):
    ti = image_of(data_dir, "ti_channel_256x256")
    data = data_of(data_dir, "hd_channel_dense_4000_grid256x256")
    reference = np.load(data_dir / "paper" / "reference_channel_dense_256x256.npy")
    ensemble = simulate(ti, (256, 256), Parameters(wavelet_level=1), data, n_realizations=2)
    assert data.n == 3883
    assert ensemble.n_mismatched.tolist() == [0, 0]
    assert all(np.mean(r != reference) < 0.15 for r in ensemble.realizations)


def test_three_facies_are_honoured_and_in_their_shares(data_dir):
    ti = image_of(data_dir, "ti_three_facies_400x400")
    data = data_of(data_dir, "hd_three_facies_400_grid1000x1000")
    p = Parameters(template_size=48, overlap_size=8, wavelet_level=2)
    ensemble = simulate(ti, (1000, 1000), p, data, n_realizations=2)
    assert ensemble.n_mismatched.tolist() == [0, 0]
    assert np.abs(ensemble.proportions - ti.proportions).max() < 0.05


def test_the_data_pull_the_e_type_towards_their_facies(data_dir):
    ti = image_of(data_dir, "ti_stonewall_200x200")
    data = data_of(data_dir, "hd_stonewall_300_grid512x512")
    ensemble = simulate(ti, (512, 512), None, data, n_realizations=6)
    code = ti.codes[1]
    p = ensemble.probability(code)
    beside = np.minimum(np.add(data.cells, [0, 1]), 511)
    at, near = (p[tuple(cells.T)] for cells in (data.cells, beside))
    has = data.facies == code
    assert (at == has).all()
    assert near[has].mean() > near[~has].mean() + 0.3
