"""Test the measures of quality of volumes against their definitions."""

from __future__ import annotations

import numpy as np
import pytest

from ccwsim import TrainingImage
from ccwsim.metrics import connectivity, copying, differing_share, judge, pattern_distance
from tests.metrics.volumes import a_volume, ensemble_of


def test_an_ensemble_of_volumes_is_judged_along_three_axes():
    image = TrainingImage(a_volume(1, (10, 40, 42), (0, 3, 7), 1.5))
    volumes = np.array([a_volume(k, (9, 20, 24), (0, 3, 7), 1.2) for k in range(2, 6)])
    sources = np.random.default_rng(1).integers(-1, image.indices.size, volumes.shape)
    ensemble = ensemble_of(image, volumes, sources.astype(np.int32))
    found = judge(ensemble, 3)
    distances = pattern_distance(volumes, image)
    np.testing.assert_allclose(found.pattern_distances, distances.mean(axis=0))
    for k, (way, n_lags) in enumerate((("E-W", 10), ("N-S", 10), ("vertical", 4))):
        lags = np.arange(1, n_lags + 1)
        own = connectivity(image, 3, way, lags).tau[0]
        tau = connectivity(volumes, 3, way, lags).tau
        assert found.tau_errors[k] == pytest.approx(np.abs(tau.mean(axis=0) - own).mean())
        assert found.tau_spreads[k] == pytest.approx(tau.std(axis=0, ddof=1).mean())
    assert found.tau_error == max(found.tau_errors)
    pairs = [(a != b).mean() for i, a in enumerate(volumes) for b in volumes[i + 1 :]]
    assert found.differing == differing_share(volumes) == pytest.approx(np.mean(pairs))
    blocks = [copying(one, (10, 40, 42)).largest_block for one in sources]
    assert found.largest_copied == np.mean(blocks)
    shares = np.array([[(v == code).mean() for code in (0, 3, 7)] for v in volumes])
    own = np.array([(image.array == code).mean() for code in (0, 3, 7)])
    errors = shares.mean(axis=0) / own - 1
    assert found.proportion_error == pytest.approx(errors[np.abs(errors).argmax()])


def test_a_thin_volume_is_judged_without_lags_along_z():
    image = TrainingImage(a_volume(1, (6, 40, 42), smooth=1.5))
    volumes = np.array([a_volume(k, (1, 24, 24), smooth=1.5) for k in (2, 3)])
    found = judge(ensemble_of(image, volumes))
    assert np.isnan(found.tau_errors[2])
    assert found.tau_error == max(found.tau_errors[:2])
    assert np.isfinite(found.pattern_distances).all()
