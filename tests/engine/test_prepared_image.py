"""Test that the stored parts of a prepared training image have a bounded size."""

import numpy as np
import pytest

from ccwsim import Parameters, TrainingImage, simulate
from ccwsim.engine import prepared_image
from ccwsim.engine.prepared_image import PreparedImage
from ccwsim.model.grid import Grid
from ccwsim.model.study import Study
from ccwsim.system.lru_cache import n_bytes
from tests.small_images import blobs

P = Parameters(template_size=16, overlap_size=4, wavelet_level=1)


@pytest.mark.parametrize("n_workers", [1, 3])
def test_parts_that_are_not_kept_are_made_again_with_the_same_cells(monkeypatch, n_workers):
    image = TrainingImage(blobs((60, 50), 3))
    expected = simulate(image, (40, 45), P, n_realizations=12, n_workers=1).digest
    monkeypatch.setattr(prepared_image, "KEPT_BYTES", 0)
    found = simulate(image, (40, 45), P, n_realizations=12, n_workers=n_workers).digest
    assert found == expected


def test_the_parts_used_last_are_kept_as_far_as_the_bytes_go(monkeypatch):
    study = Study(TrainingImage(blobs((60, 50), 3)), Grid(40, 45), P)
    one = n_bytes(PreparedImage(study).oriented(0, (1, 16, 16)))
    monkeypatch.setattr(prepared_image, "KEPT_BYTES", 3 * one)
    image = PreparedImage(study)
    made = [image.oriented(way, (1, 16, 16)) for way in range(8)]
    assert image.oriented(7, (1, 16, 16)) is made[7]
    again = image.oriented(0, (1, 16, 16))
    assert again is not made[0]
    np.testing.assert_array_equal(again.squares, made[0].squares)
