"""Test geobodies, Γ, percolation and Euler number against scikit-image and plain sums."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from skimage.measure import euler_number, label

from ccwsim.metrics import geobody_statistics


@settings(deadline=None, max_examples=40)
@given(
    seed=st.integers(0, 10**6),
    ny=st.integers(1, 15),
    nx=st.integers(1, 15),
    share=st.floats(0, 1),
    neighbours=st.sampled_from([4, 8]),
)
def test_bodies_are_those_of_scikit_image(seed, ny, nx, share, neighbours):
    image = np.random.default_rng(seed).random((ny, nx)) < share
    connectivity = 2 if neighbours == 8 else 1
    labels = label(image, connectivity=connectivity)
    sizes = sorted(np.bincount(labels.ravel())[1:].tolist(), reverse=True)
    found = geobody_statistics(image, 1, neighbours)
    assert found.sizes[0].tolist() == sizes
    assert found.n_geobodies[0] == len(sizes)
    assert found.euler_number[0] == euler_number(image, connectivity=connectivity)
    west_east = (set(labels[:, 0]) & set(labels[:, -1])) - {0}
    south_north = (set(labels[0]) & set(labels[-1])) - {0}
    assert found.percolates_ew[0] == bool(west_east)
    assert found.percolates_ns[0] == bool(south_north)


def test_gamma_is_the_share_of_connected_pairs():
    image = np.random.default_rng(3).integers(0, 2, (9, 9))
    geobodies = label(image, connectivity=2).ravel()
    inside = geobodies[geobodies > 0]
    expected = np.mean(inside[:, None] == inside[None, :])
    assert geobody_statistics(image, 1).gamma[0] == pytest.approx(expected)


def test_a_facies_that_is_absent_has_no_bodies():
    found = geobody_statistics(np.zeros((2, 5, 5), bool), 1)
    assert found.n_geobodies.tolist() == [0, 0]
    assert np.isnan(found.gamma).all()
    assert not found.percolates_ew.any()


def test_a_river_percolates_along_itself_only():
    image = np.zeros((9, 9), int)
    image[4] = 3
    found = geobody_statistics(image, 3)
    assert found.percolates_ew[0]
    assert not found.percolates_ns[0]
