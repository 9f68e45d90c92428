"""Windows around missed data: what is passed over has no location, and progress is told."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ccwsim import HardData, Parameters, TrainingImage, simulate
from ccwsim.engine.stages import resimulation
from ccwsim.engine.stages.bits import to_bits
from ccwsim.engine.stages.box import Box
from ccwsim.engine.stages.cut import UNKNOWN
from ccwsim.engine.stages.resimulation import (
    honouring_places,
    is_unknown,
    known_patterns,
    own_counts,
)
from tests.small_images import noise

PARAMETERS = Parameters(template_size=16, overlap_size=4)


def dense_data(shape: tuple[int, int], seed: int) -> HardData:
    """Noise in every cell: nearly none of its patterns is in an image of bands."""
    codes = np.random.default_rng(seed).integers(0, 2, shape)
    return HardData(np.argwhere(np.ones(shape)), codes.ravel())


@settings(max_examples=80, deadline=None)
@given(st.integers(1, 3), st.integers(4, 8), st.integers(0, 2**16))
def test_a_pattern_that_is_passed_over_has_no_location(n_facies, size, seed):
    rng = np.random.default_rng(seed)
    image = np.kron(noise((4, 4), n_facies, seed), np.ones((3, 3), np.uint8)).astype(np.uint8)
    first = rng.integers(0, 4, 2)
    grid = np.tile(image, (2, 2))[first[0] : first[0] + 12, first[1] : first[1] + 12].copy()
    for _ in range(int(rng.integers(3))):
        grid[tuple(rng.integers(0, 12, 2))] = rng.choice(np.unique(image))
    if seed % 3 == 0:
        grid[tuple(rng.integers(0, 12, 2))] = UNKNOWN
    patterns, bits = known_patterns(image), to_bits(image)
    mask = np.empty(bits.shape[1:], np.uint64)
    for y0, x0 in np.ndindex(12 - size + 1, 12 - size + 1):
        box = Box(y0, x0, size, 0, 1)
        for y, x in np.ndindex(size, size):
            if is_unknown(grid, box, y0 + y, x0 + x, patterns):
                assert honouring_places(bits, grid, box, image.shape, mask) == 0


def test_patterns_that_are_unknown_are_told():
    image = np.kron(np.indices((8, 8)).sum(0) % 2, np.ones((4, 4))).astype(np.uint8)
    patterns, box = known_patterns(image), Box(0, 0, 8, 0, 1)
    grid = np.random.default_rng(0).integers(0, 2, (8, 8)).astype(np.uint8)
    told = [is_unknown(grid, box, y, x, patterns) for y, x in np.ndindex(8, 8)]
    assert np.mean(told) > 0.9
    assert not any(is_unknown(image[:8, :8], box, y, x, patterns) for y, x in np.ndindex(8, 8))


@pytest.mark.parametrize("shape", [(3, 40), (40, 3), (4, 4)])
def test_small_images_have_few_patterns_or_none(shape):
    assert known_patterns(np.zeros(shape, np.uint8)).sum() == (min(shape) >= 4)


def test_dense_data_give_the_same_realization_with_and_without_patterns(monkeypatch):
    image = TrainingImage(np.kron(noise((12, 12), 2, 4), np.ones((4, 4))))
    given = image, (40, 44), PARAMETERS, dense_data((40, 44), 0)
    one = simulate(*given, n_realizations=2, seed=3)
    monkeypatch.setattr(resimulation, "DENSE", 2.0)
    other = simulate(*given, n_realizations=2, seed=3)
    assert one.digest == other.digest
    np.testing.assert_array_equal(one.data_status, other.data_status)


def test_progress_goes_on_while_windows_are_simulated():
    image = TrainingImage(np.kron(noise((40, 40), 2, 4), np.ones((4, 4))))
    told: list[float] = []
    shape = 200, 200
    simulate(
        image, shape, PARAMETERS, dense_data(shape, 1), n_realizations=1, seed=3,
        progress=lambda share, _: told.append(share), n_workers=1,
    )  # fmt: skip
    assert told == sorted(told)
    assert told[-1] == 1.0


def test_windows_report_growing_shares_below_one():
    shape, shares = (30, 30), []
    image = np.kron(noise((10, 10), 2, 4), np.ones((4, 4))).astype(np.uint8)
    data = dense_data(shape, 2)
    grid = np.zeros(shape, np.uint8)
    facies = np.full(shape, UNKNOWN, np.uint8)
    facies[tuple(data.cells.T)] = data.facies
    target = resimulation.Target(
        image, to_bits(image), facies, grid, np.zeros((0, 0), np.int32)
    )  # fmt: skip
    thresholds = resimulation.isolated_datum_thresholds(image)
    rng = np.random.default_rng(0)
    resimulation.resimulate(target, data.cells, 16, rng, thresholds, shares.append)
    assert shares == sorted(shares)
    assert 0 <= shares[0] < 0.5 < shares[-1] < 1
    np.testing.assert_array_equal(grid, facies)


@given(st.integers(1, 9), st.integers(1, 9), st.integers(0, 2**16))
def test_own_counts_are_those_of_a_plain_loop(ny, nx, seed):
    rng = np.random.default_rng(seed)
    grid = rng.integers(0, 3, (ny, nx)).astype(np.uint8)
    cells = np.argwhere(np.ones((ny, nx)))
    expected = [
        sum(
            grid[min(max(y + dy, 0), ny - 1), min(max(x + dx, 0), nx - 1)] == grid[y, x]
            for dy in range(-2, 3)
            for dx in range(-2, 3)
        )
        for y, x in cells
    ]
    assert own_counts(grid, cells).tolist() == expected
