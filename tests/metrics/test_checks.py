"""Test that all checks together seldom flag good fields, and flag poor simulations.

`python -m benchmarks.reproduction` measures the rates over many fields.
"""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.reproduction import MAPS, POOR, SEED, VOLUME_SHAPE, VOLUMES, differing, flagged
from ccwsim import TrainingImage, datasets, simulate
from ccwsim.metrics import check_ensemble
from tests.metrics.test_reference_band import ensemble_of
from tests.metrics.volumes import a_volume
from tests.small_images import blobs

SEEDS = range(8310, 8312)


@pytest.mark.slow
def test_good_fields_are_seldom_flagged():
    found = [checks for name in MAPS for checks in flagged(name, (256, 256), 1, SEEDS)]
    found += [checks for name in MAPS for checks in flagged(name, (384, 384), 4, SEEDS)]
    found += [checks for name in VOLUMES for checks in flagged(name, VOLUME_SHAPE, 1, SEEDS)]
    assert len(found) == 20
    assert sum(map(bool, found)) <= 1


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "settings"),
    [
        ("channels", "template 8"),
        ("channels", "K 500 as published"),
        ("stone_wall", "K 500 as published"),
        ("stone_wall", "level 4, T 32, OR 16"),
        ("lenses", "template 8"),
    ],
)
def test_poor_simulations_are_flagged(name, settings):
    assert differing(simulate(datasets.load(name), (256, 256), POOR[settings], None, 12, SEED))


def test_the_checks_cover_all_facies_and_directions():
    image = TrainingImage(blobs((96, 96), 3, seed=2))
    checks = check_ensemble(ensemble_of(image, image.indices[None]))
    curves = {(c.kind, c.facies, c.direction) for c in checks if c.direction}
    kinds = ("variogram", "connectivity")
    assert curves == {(s, k, way) for s in kinds for k in range(3) for way in ("E-W", "N-S")}
    assert [c.facies for c in checks if c.kind == "geobodies"] == [0, 1, 2]
    assert sum(c.kind in ("proportions", "patterns") for c in checks) == 2
    volume = TrainingImage(a_volume(1, (12, 48, 48), smooth=1.5))
    ways = {c.direction for c in check_ensemble(ensemble_of(volume, volume.indices[None]))}
    assert ways == {None, "E-W", "N-S", "vertical"}


def test_nothing_is_checked_where_the_image_is_too_small():
    small = TrainingImage(blobs((12, 12), 2))
    assert check_ensemble(ensemble_of(small, np.zeros((1, 40, 40), np.uint8))) == []
