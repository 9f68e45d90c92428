"""Test that studies at the limits honour data, report progress and stop on request."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from ccwsim import Cancelled, HardData, Parameters, TrainingImage, datasets, simulate

RNG = np.random.default_rng(15)


def many_facies() -> tuple:
    codes = RNG.integers(0, 254, (75, 75)).repeat(8, axis=0).repeat(8, axis=1)
    return TrainingImage(codes), (600, 600), Parameters(), HardData()


def noise() -> tuple:
    return TrainingImage(RNG.integers(0, 254, (600, 600))), (600, 600), Parameters(), HardData()


def dense_data() -> tuple:
    """Return a random datum in every fourth cell."""
    cells = RNG.choice(600 * 600, 90_000, replace=False)
    data = HardData(
        np.stack(np.unravel_index(cells, (600, 600)), axis=1), RNG.integers(0, 2, 90_000)
    )
    return datasets.load("channels"), (600, 600), Parameters(), data


def wide_templates() -> tuple:
    field = gaussian_filter(RNG.normal(size=(1100, 1100)), 6) > 0
    sizes = Parameters(template_size=1024, overlap_size=256, wavelet_level=3)
    return TrainingImage(field.astype(int)), (1500, 1500), sizes, HardData()


def large_volume() -> tuple:
    field = gaussian_filter(RNG.normal(size=(200, 200, 200)), 5) > 0
    sizes = Parameters(template_size=32, overlap_size=8, wavelet_level=2)
    return TrainingImage(field.astype(np.uint8)), (64, 64, 64), sizes, HardData()


LONG = [many_facies, noise, dense_data]
"""Studies during which a run checks several times whether to stop."""


@pytest.mark.slow
@pytest.mark.parametrize("study", [*LONG, wide_templates, large_volume], ids=lambda s: s.__name__)
def test_a_study_at_the_limits_is_exact_and_reports_its_progress(study):
    image, shape, parameters, data = study()
    told: list[float] = []
    ensemble = simulate(
        image, shape, parameters, data, progress=lambda share, *_: told.append(share)
    )
    assert np.isin(ensemble.realizations, image.codes).all()
    assert data.n_mismatched(ensemble.realizations[0]) == 0
    assert told == sorted(told)
    assert told[-1] == 1.0


@pytest.mark.slow
@pytest.mark.parametrize("study", LONG, ids=lambda s: s.__name__)
def test_a_study_at_the_limits_stops_when_told(study):
    asked = 0

    def cancel() -> bool:
        nonlocal asked
        asked += 1
        return asked > 3

    with pytest.raises(Cancelled):
        simulate(*study(), cancel=cancel)
    assert asked < 10  # no worker continues afterwards
