"""Test the connectivity function against counted pairs and published values."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from skimage.measure import label

from ccwsim.metrics import connected_geobodies, connectivity
from ccwsim.model.errors import CCWSIMError

STEPS = {"E-W": (0, 1), "N-S": (1, 0), "NE-SW": (1, 1), "NW-SE": (1, -1), (2, -1): (2, -1)}


def counted(image, facies, step, lag, neighbours):
    """Return both probabilities, computed by two loops over cells with labels of scikit-image."""
    geobodies = label(image == facies, connectivity=2 if neighbours == 8 else 1)
    ny, nx = image.shape
    pairs = both = joined = 0
    for i in range(ny):
        for j in range(nx):
            k, m = i + lag * step[0], j + lag * step[1]
            if 0 <= k < ny and 0 <= m < nx:
                pairs += 1
                both += bool(geobodies[i, j] and geobodies[k, m])
                joined += bool(geobodies[i, j] and geobodies[i, j] == geobodies[k, m])
    return joined / both if both else np.nan, joined / pairs


@settings(deadline=None, max_examples=20)
@given(
    seed=st.integers(0, 10**6),
    direction=st.sampled_from(list(STEPS)),
    neighbours=st.sampled_from([4, 8]),
    facies=st.sampled_from([0, 7]),
)
def test_probabilities_are_those_of_counting(seed, direction, neighbours, facies):
    rng = np.random.default_rng(seed)
    image = rng.choice([0, 7, 9], (12, 11), p=[0.4, 0.5, 0.1])
    lags = [0, 1, 3, 5]
    found = connectivity(image, facies, direction, lags, neighbours)
    expected = [counted(image, facies, STEPS[direction], lag, neighbours) for lag in lags]
    np.testing.assert_allclose(found.tau[0], [e[0] for e in expected])
    np.testing.assert_allclose(found.unconditional[0], [e[1] for e in expected])
    assert found.tau[0, 0] == 1


def test_an_azimuth_of_90_degrees_is_east_and_west():
    image = np.random.default_rng(1).integers(0, 2, (20, 30))
    by_name, by_angle = connectivity(image, 1, "E-W", 9), connectivity(image, 1, 90.0, 9)
    np.testing.assert_array_equal(by_name.tau, by_angle.tau)
    turned = connectivity(image.T, 1, "N-S", 9)
    np.testing.assert_array_equal(by_name.tau, turned.tau)


def test_a_stack_has_one_row_an_image_and_progress_ends_at_one():
    stack = np.random.default_rng(2).integers(0, 2, (4, 15, 16))
    shares = []
    found = connectivity(stack, 1, lags=6, progress=shares.append)
    assert found.tau.shape == (4, 7)
    assert shares[-1] == 1
    np.testing.assert_array_equal(found.tau[2], connectivity(stack[2], 1, lags=6).tau[0])


def test_one_body_is_connected_at_all_lags_and_an_absent_facies_at_none():
    image = np.ones((9, 9), int)
    assert (connectivity(image, 1, lags=8).tau == 1).all()
    nothing = connectivity(np.zeros((9, 9), bool), 1, lags=8)
    assert np.isnan(nothing.tau).all()
    assert (nothing.unconditional == 0).all()


def test_corners_join_eight_neighbours_only():
    assert connected_geobodies(np.eye(4, dtype=int), 1, 8)[1] == 1
    assert connected_geobodies(np.eye(4, dtype=int), 1, 4)[1] == 4


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("CCWSIM_channel512_hd400_L1", (1.00, 0.96, 0.92, 0.88)),
        ("CCWSIM_channel512_hd400_L3", (0.99, 0.94, 0.88, 0.82)),
        ("MS-CCSIM_channel512_hd400_L3", (0.97, 0.85, 0.74, 0.62)),
        ("CCWSIM_channel512_t2_1000_L1", (0.98, 0.88, 0.77, 0.65)),
    ],
)
def test_figures_of_the_published_code_come_out(data_dir, name, expected):
    realizations = np.load(data_dir / "reference" / f"{name}.npz")["r"]
    found = connectivity(realizations, 1, "E-W", [21, 41, 61, 81])
    np.testing.assert_allclose(found.tau.mean(axis=0), expected, atol=0.0055)


def test_the_channels_of_the_training_image_are_connected_throughout(data_dir):
    ti = np.load(data_dir / "paper" / "ti_channel_256x256.npy")
    assert (connectivity(ti, 1, "E-W", [21, 41, 61, 81]).tau == 1).all()


def test_what_cannot_be_measured_is_said():
    image = np.eye(5, dtype=int)
    with pytest.raises(CCWSIMError, match="does not fit an image of 5 × 5"):
        connectivity(image, 1, lags=5)
    with pytest.raises(CCWSIMError, match="must be 4 or 8"):
        connectivity(image, 1, lags=2, neighbours=6)
    with pytest.raises(CCWSIMError, match="direction 'up'"):
        connectivity(image, 1, "up", lags=2)
    with pytest.raises(CCWSIMError, match="lags"):
        connectivity(image, 1, lags=[-1])
    with pytest.raises(CCWSIMError, match="shape"):
        connectivity(np.zeros(4, int), 1, lags=1)
