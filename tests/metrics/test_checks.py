"""Test that all checks together seldom flag good fields, and flag poor simulations.

`python -m benchmarks.reproduction` measures the rates over many fields.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from benchmarks.reproduction import (
    MAPS,
    SEED,
    VOLUME_SHAPE,
    VOLUMES,
    WRONG,
    differing,
    flagged,
    simulated,
)
from ccwsim import Parameters, Secondary, TrainingImage, datasets, simulate
from ccwsim.metrics import check_ensemble, fit_proportions
from ccwsim.report.verdicts import describe_checks, describe_proportion, relative_text
from tests.metrics.test_reference_band import ensemble_of
from tests.metrics.volumes import a_volume
from tests.small_images import blobs

SMALL = Parameters(16, 4, 1)
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
        *product(("channels", "stone_wall", "lenses"), ("K 500 as published", "template 8", WRONG)),
        ("stone_wall", "level 4, T 32, OR 16"),
        ("barchans", "template 8"),
        ("barchans", WRONG),
    ],
)
def test_poor_simulations_and_wrong_images_are_flagged(name, settings):
    assert differing(simulated(name, settings, SEED + 50))


def test_the_checks_cover_all_facies_and_directions():
    image = TrainingImage(blobs((96, 96), 3, seed=2))
    checks = check_ensemble(ensemble_of(image, image.indices[None]))
    curves = {(c.kind, c.facies, c.direction) for c in checks if c.direction}
    kinds = ("variogram", "connectivity")
    assert curves == {(s, k, way) for s in kinds for k in range(3) for way in ("E-W", "N-S")}
    assert [c.facies for c in checks if c.kind == "geobodies"] == [0, 1, 2]
    assert [c.facies for c in checks if c.kind == "measures"] == [None, 0, 1, 2]
    assert sum(c.kind in ("proportions", "patterns") for c in checks) == 2
    volume = TrainingImage(a_volume(1, (12, 48, 48), smooth=1.5))
    ways = {c.direction for c in check_ensemble(ensemble_of(volume, volume.indices[None]))}
    assert ways == {None, "E-W", "N-S", "vertical"}


def test_a_measure_that_differs_is_named_with_its_facies():
    image = TrainingImage(blobs((120, 120), 2, seed=1), facies_names=("mud", "sand"))
    holes = image.indices.copy()
    holes[::5, ::5] = 1 - holes[::5, ::5]
    _, *differs = describe_checks(check_ensemble(ensemble_of(image, holes[None])), ("mud", "sand"))
    words = {verdict.words: verdict.numbers for verdict in differs}
    assert words["unseen patterns too many"].startswith("Unseen patterns, % ")
    assert words["sand: boundary too rough"].startswith("Boundary, % ")
    assert all(len(word.split()) <= 8 for word in words)


@pytest.mark.parametrize(
    ("secondary", "judged"),
    [
        (None, True),
        (Secondary(mirrored=("x",)), True),
        (Secondary(angle=90.0), False),
        (Secondary(scale=1.3), False),
        (Secondary(images=[datasets.load("stone_wall")]), False),
    ],
    ids=["none", "mirrored", "turned", "scaled", "several"],
)
def test_only_what_is_made_of_the_image_as_it_was_read_is_judged_by_its_crops(secondary, judged):
    image = datasets.load("channels")
    e = simulate(image, (64, 64), SMALL, None, 2, secondary=secondary)
    kinds = {check.kind for check in check_ensemble(e)}
    assert ("patterns" in kinds) == ("variogram" in kinds) == ("geobodies" in kinds) == judged
    several = secondary is not None and bool(secondary.images)
    assert ("proportions" in kinds) == (not several)  # an angle does not change proportions
    assert describe_proportion(e, 1).count("TIs") == several


def test_several_images_give_proportions_by_cells_weights_or_zones():
    first = TrainingImage(np.tile([1, 2], (20, 10)))
    other = TrainingImage(np.tile([2, 2, 2, 2, 1], (20, 16)), name="other")
    zones = np.zeros((30, 40), int)
    zones[:, :30] = 1
    active = np.ones((30, 40), bool)
    active[:, :20] = False
    for given, share in [
        ({}, (200 + 1280) / 2000),
        ({"weights": (3, 1)}, 0.75 * 0.5 + 0.25 * 0.8),
        ({"zones": zones}, 0.25 * 0.5 + 0.75 * 0.8),
        ({"zones": zones, "active": active}, 0.5 * 0.5 + 0.5 * 0.8),
    ]:
        secondary = Secondary(images=[other], **given)
        e = simulate(first, (30, 40), Parameters(10, 2, 0), None, 1, secondary=secondary)
        assert e.image_proportions == pytest.approx([1 - share, share])
    assert simulate(first, (30, 40), Parameters(10, 2, 0)).image_proportions.tolist() == [0.5, 0.5]


def test_proportions_are_judged_by_given_probabilities():
    image, code = datasets.load("channels"), 1
    shares = np.tile(np.linspace(0.2, 0.6, 128), (128, 1))
    shares[:, :32] = np.nan
    active = np.ones((128, 128), bool)
    active[:, 96:] = False
    known = np.where(np.isnan(shares), image.proportions[1], shares)[active].mean()
    given = Secondary(probabilities={code: shares}, active=active)
    e = simulate(image, (128, 128), SMALL, None, 8, secondary=given)
    assert e.expected_proportions == pytest.approx([1 - known, known])
    fit = fit_proportions(e)
    assert fit is not None
    assert fit.reference == pytest.approx(e.expected_proportions)
    mean = 100 * e.proportions[:, 1].mean()
    start = f"{image.facies_names[1]} {mean:.1f} % (given {100 * known:.1f} %, TI 27.0 %; "
    assert describe_proportion(e, 1).startswith(start)
    assert describe_proportion(e, 1).endswith(f"{relative_text(mean, 100 * known)})")
    free = simulate(image, (128, 128), SMALL, None, 2, secondary=replace(given, soft_weight=0))
    assert free.expected_proportions.tolist() == free.image_proportions.tolist()


def test_a_facies_without_given_probability_has_no_relative_difference():
    given = Secondary(probabilities={1: 0.0})
    e = simulate(datasets.load("channels"), (64, 64), SMALL, None, 2, secondary=given)
    assert describe_proportion(e, 1).endswith("(given 0.0 %, TI 27.0 %)")


def test_nothing_is_checked_where_the_image_is_too_small():
    small = TrainingImage(blobs((12, 12), 2))
    assert check_ensemble(ensemble_of(small, np.zeros((1, 40, 40), np.uint8))) == []
