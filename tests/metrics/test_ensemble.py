"""Test proportions, E-type, entropy and honoured data against plain counting."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import entropy as scipy_entropy

from ccwsim.metrics import (
    data_match,
    entropy,
    etype,
    etype_of_counts,
    facies_counts,
    proportions,
)
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.hard_data import HardData


@pytest.fixture
def stack():
    return np.random.default_rng(0).choice([0, 1, 2], (11, 8, 9), p=[0.6, 0.3, 0.1])


def test_proportions_are_shares_of_cells(stack):
    found = proportions(stack, range(4))
    for k in range(4):
        np.testing.assert_allclose(found[:, k], (stack == k).mean(axis=(1, 2)))


def test_etype_is_the_share_of_realizations(stack):
    found = etype(stack, range(3))
    for k in range(3):
        np.testing.assert_allclose(found.probability[k], (stack == k).mean(axis=0))
    np.testing.assert_allclose(found.probability.sum(axis=0), 1)
    chosen = np.take_along_axis(found.probability, found.most_likely[None].astype(int), axis=0)
    np.testing.assert_array_equal(chosen[0], found.probability.max(axis=0))
    np.testing.assert_allclose(found.entropy, scipy_entropy(found.probability) / np.log(3))
    assert found.n == 11


def test_facies_may_be_renumbered(stack):
    order = np.array([2, 0, 1])
    one, other = etype(stack, range(3)), etype(order[stack], range(3))
    np.testing.assert_allclose(one.entropy, other.entropy)
    np.testing.assert_array_equal(one.probability, other.probability[order])


def test_entropy_goes_from_certain_to_even():
    assert entropy([[1.0], [0.0], [0.0]])[0] == 0
    assert entropy([[1 / 3]] * 3)[0] == pytest.approx(1)
    assert entropy(np.ones((1, 2, 2))).tolist() == [[0, 0], [0, 0]]
    with pytest.raises(CCWSIMError, match="at least one"):
        etype_of_counts(np.zeros((2, 3, 3), int))


def test_counts_are_whole(stack):
    counts = facies_counts(stack, range(3))
    np.testing.assert_array_equal(counts, [(stack == k).sum(axis=0) for k in range(3)])


def test_data_match_counts_every_miss(stack):
    rng = np.random.default_rng(1)
    cells = np.stack(np.unravel_index(rng.permutation(72)[:20], (8, 9)), axis=1)
    data = HardData(cells, rng.integers(0, 3, 20))
    found = data_match(stack, data)
    assert found.n_wrong.tolist() == [data.n_mismatched(image) for image in stack]
    assert found.times_wrong.sum() == found.n_wrong.sum() > 0
    assert (found.map >= 0).sum() == 20
    for (row, column), code in zip(data.cells, data.facies, strict=True):
        assert found.map[row, column] == np.sum(stack[:, row, column] != code)


def test_no_data_are_all_honoured(stack):
    found = data_match(stack, HardData())
    assert (found.n_wrong == 0).all()
    assert (found.map == -1).all()


def test_a_datum_outside_is_named(stack):
    with pytest.raises(CCWSIMError, match="row 8, column 0"):
        data_match(stack, HardData([[8, 0]], [1]))
