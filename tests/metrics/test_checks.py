"""Test that all checks together seldom flag good fields, and flag poor simulations.

`python -m benchmarks.reproduction` measures the rates over many fields.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from benchmarks import verdicts
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
from ccwsim.metrics import check_ensemble, fit_curve, fit_geobodies, fit_proportions
from ccwsim.report.verdicts import (
    compare_proportion,
    describe_checks,
    describe_proportion,
    relative_text,
)
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
    ("name", "case", "seed", "m"),
    [
        ("levees", "true, bundled", 9700, 12),  # τ of long bodies
        ("levees", "true, other", 9701, 8),
        ("dunes", "true, other", 9701, 12),
        ("channels", "true, other", 9700, 40),  # γ
    ],
)
def test_true_fields_of_long_bodies_are_not_flagged(name, case, seed, m):
    number = None if case == "true, bundled" else seed
    group = verdicts.GROUPS[m][-1]
    assert not differing(verdicts.true_ensemble(name, seed, number, group))


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
    _, lines = describe_checks(check_ensemble(ensemble_of(image, holes[None])), ("mud", "sand"))
    words = {(what, verdict.words): verdict.numbers for _, what, verdict in lines}
    assert words["Measures", "unseen patterns too many"].startswith("Unseen patterns, % ")
    assert words["Measures of sand", "boundary too rough"].startswith("Boundary, % ")
    assert all(len(verdict.words.split()) <= 8 for *_, verdict in lines)


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
    short = f"{image.facies_names[1]} {mean:.1f} % (given {100 * known:.1f} %)"
    assert describe_proportion(e, 1, short=True) == short
    assert compare_proportion(e, 1) == {
        "simulated": f"{mean:.1f} %",
        "given": f"{100 * known:.1f} %",
        "TI": "27.0 %",
        "relative difference": relative_text(mean, 100 * known),
    }
    free = simulate(image, (128, 128), SMALL, None, 2, secondary=replace(given, soft_weight=0))
    assert free.expected_proportions.tolist() == free.image_proportions.tolist()


@pytest.mark.parametrize(("share", "is_other"), [(0.27, False), (0.6, True)])
def test_a_map_that_asks_for_another_amount_is_judged_only_by_its_amount(share, is_other):
    image = datasets.load("channels")
    given = Secondary(probabilities={1: share})
    e = simulate(image, (128, 128), SMALL, None, 8, secondary=given)
    checks = check_ensemble(e)
    (shares,) = (check for check in checks if check.kind == "proportions")
    assert shares.against == "given map"
    assert {check.fit.judged for check in checks if check is not shares} == {not is_other}
    assert (fit_curve(e, "connectivity", 1) is None) == is_other
    assert (fit_geobodies(e, 1) is None) == is_other
    headline, lines = describe_checks(checks, image.facies_names)
    of_kind = {line.kind: line.verdict for line in lines}
    assert of_kind["proportions"].numbers.endswith("in the given map")
    assert len(of_kind) == 6
    if is_other:
        assert str(of_kind["patterns"]) == (
            "not judged: the map of probabilities asks for another amount"
        )
        assert headline.words.startswith("the only check fits")


def test_a_facies_without_given_probability_has_no_relative_difference():
    given = Secondary(probabilities={1: 0.0})
    e = simulate(datasets.load("channels"), (64, 64), SMALL, None, 2, secondary=given)
    assert describe_proportion(e, 1).endswith("(given 0.0 %, TI 27.0 %)")


def test_nothing_is_checked_where_the_image_is_too_small():
    small = TrainingImage(blobs((12, 12), 2))
    assert check_ensemble(ensemble_of(small, np.zeros((1, 40, 40), np.uint8))) == []
