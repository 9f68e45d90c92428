"""Test that over many realizations only the image and the data determine the E-type."""

from __future__ import annotations

import numpy as np
import pytest

from ccwsim import HardData, Parameters, datasets, simulate
from tests.small_images import facies_at_edges

N = 200
SHAPE = (200, 200)
CENTRE = (100, 100)


@pytest.fixture(scope="module", params=[0, 1], ids=["mud datum", "sand datum"])
def conditioned(request):
    data = HardData([CENTRE], [request.param])
    p = Parameters(template_size=32, overlap_size=8, wavelet_level=2)
    ti = datasets.load("channels")
    return ti, request.param, simulate(ti, SHAPE, p, data, n_realizations=N, seed=11)


def _distance():
    rows, columns = np.indices(SHAPE)
    return np.hypot(rows - CENTRE[0], columns - CENTRE[1])


@pytest.mark.slow
def test_far_from_the_data_the_e_type_tends_to_the_proportion_of_the_image(conditioned):
    ti, _, ensemble = conditioned
    far = ensemble.probability(1)[_distance() > 70]
    assert far.mean() == pytest.approx(ti.proportions[1], abs=0.025)
    assert far.min() > 0.02
    assert far.max() < 0.65


@pytest.mark.slow
def test_near_a_datum_the_e_type_tends_to_the_datum(conditioned):
    _, facies, ensemble = conditioned
    honoured = ensemble.probability(facies)
    near = honoured[_distance() <= 1.5].mean()
    assert honoured[CENTRE] == 1.0
    assert near > 0.8
    further = honoured[(_distance() > 4) & (_distance() < 6)].mean()
    assert near > further > honoured[_distance() > 70].mean() - 0.05


@pytest.mark.slow
def test_no_place_of_the_grid_is_favoured_without_data():
    ti = datasets.load("channels")
    probability = simulate(ti, (96, 96), n_realizations=400, seed=5).probability(1)
    quarters = probability.reshape(4, 24, 4, 24).mean(axis=(1, 3))
    assert np.abs(quarters - ti.proportions[1]).max() < 0.06


def test_facies_at_the_edges_of_a_small_image_keep_most_of_their_proportion():
    image = facies_at_edges()
    found = simulate(image, image.shape, Parameters(32, 8, 2), n_realizations=48, seed=1)
    assert (image == 0).mean() == pytest.approx(0.180, abs=0.001)
    assert found.proportions[:, 0].mean() > 0.135  # 0.117 with the limit for large images
