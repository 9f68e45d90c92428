"""Test the sampling of a reference field: positions of the data, and their facies."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, strategies as st

from ccwsim import CCWSIMError
from ccwsim.datasets import sampling
from ccwsim.datasets.sampling import sample_grid, sample_random, sample_wells

SIDE = st.integers(1, 40)


def field(ny, nx, seed=0):
    return np.random.default_rng(seed).integers(-3, 300, (ny, nx))


def holds(data, truth):
    rows, columns = data.cells.T
    return (truth[rows, columns] == data.facies).all()


@given(SIDE, SIDE, st.integers(1, 2000), st.integers(0, 99))
def test_random_cells_are_as_many_as_asked_and_true(ny, nx, n, seed):
    truth = field(ny, nx)
    data = sample_random(truth, n, seed)
    assert data.n == min(n, ny * nx)
    assert holds(data, truth)
    assert sample_random(truth, n, seed).digest == data.digest


def test_another_seed_draws_other_cells():
    truth = field(60, 50)
    assert sample_random(truth, 30, 1).digest != sample_random(truth, 30, 2).digest
    assert sample_wells(truth, 3, 1).digest != sample_wells(truth, 3, 2).digest


def test_random_cells_reach_everywhere():
    quarter = np.floor(sample_random(field(40, 60), 400, 3).cells / (20, 30))
    counts = np.unique(quarter, axis=0, return_counts=True)[1]
    assert len(counts) == 4
    assert counts.min() > 60


@given(SIDE, SIDE, st.integers(1, 50), st.integers(1, 9), st.sampled_from(["N-S", "E-W"]))
def test_wells_cross_the_field_in_equal_steps(ny, nx, n, every, direction):
    truth = field(ny, nx)
    data = sample_wells(truth, n, 5, direction=direction, every=every)
    along, across = (0, 1) if direction == "N-S" else (1, 0)
    wells = np.unique(data.cells[:, across])
    assert len(wells) == min(n, truth.shape[across])
    steps = np.arange(0, truth.shape[along], every)
    for well in wells:
        assert np.array_equal(data.cells[data.cells[:, across] == well, along], steps)
    assert holds(data, truth)


@given(SIDE, SIDE, st.integers(1, 50))
def test_a_regular_grid_is_even_and_leaves_equal_margins(ny, nx, every):
    truth = field(ny, nx)
    data = sample_grid(truth, every)
    for axis, length in enumerate((ny, nx)):
        lines = np.unique(data.cells[:, axis])
        assert (np.diff(lines) == every).all()
        low, high = lines[0], length - 1 - lines[-1]
        assert abs(high - low) <= 1
        assert low + high < every
    assert holds(data, truth)


@pytest.mark.parametrize("bad", [0, -1, 1.5, True, "3"])
def test_numbers_that_make_no_sense_are_said(bad):
    truth = field(8, 8)
    for sample in (sample_random, sample_wells, sample_grid):
        with pytest.raises(CCWSIMError, match="at least 1"):
            sample(truth, bad)
    with pytest.raises(CCWSIMError, match="E-W"):
        sample_wells(truth, 1, direction="up")
    with pytest.raises(CCWSIMError, match="shape"):
        sample_grid(np.zeros(4, int), 2)


@pytest.mark.slow
@given(SIDE, SIDE, st.integers(1, 900), st.integers(0, 99))
def test_few_of_many_cells_are_different_ones_and_the_same_again(ny, nx, n, seed):
    cells = sampling._distinct(np.random.RandomState(seed), 10**6, n)
    assert len(set(cells.tolist())) == n
    assert 0 <= cells.min() <= cells.max() < 10**6
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sampling, "MAX_PERMUTED", 0)
        truth = field(ny, nx)
        data = sample_random(truth, n, seed)
        assert data.n == min(n, ny * nx)
        assert holds(data, truth)
        assert data.digest == sample_random(truth, n, seed).digest


@given(st.integers(1, 9), SIDE, SIDE, st.integers(1, 30), st.integers(1, 5), st.integers(0, 99))
def test_vertical_wells_of_volumes_are_true_and_none_twice(nz, ny, nx, n, every, seed):
    truth = np.random.default_rng(seed).integers(0, 9, (nz, ny, nx))
    data = sample_wells(truth, n, seed, every=every)
    assert (truth[tuple(data.cells.T)] == data.facies).all()
    columns, counts = np.unique(data.cells[:, 1:], axis=0, return_counts=True)
    assert len(columns) == min(n, ny * nx)
    assert set(counts.tolist()) == {-(-nz // every)}
    assert set(data.cells[:, 0].tolist()) == set(range(0, nz, every))
    spread = sample_random(truth, n, seed)
    assert spread.n == min(n, truth.size)
    assert (truth[tuple(spread.cells.T)] == spread.facies).all()


def test_wells_on_a_grid_go_through_all_layers_of_a_volume():
    truth = np.arange(4 * 10 * 12).reshape(4, 10, 12)
    data = sample_grid(truth, 5)
    flat = sample_grid(truth[0], 5)
    assert data.n == 4 * flat.n
    assert {tuple(cell[1:]) for cell in data.cells.tolist()} == set(map(tuple, flat.cells.tolist()))
    with pytest.raises(CCWSIMError, match="direction = 'N-S' must be \"vertical\""):
        sample_wells(truth, 2, direction="N-S")
    with pytest.raises(CCWSIMError, match='must be "N-S" or "E-W"'):
        sample_wells(truth[0], 2, direction="vertical")
