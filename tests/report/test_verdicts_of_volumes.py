"""Test that verdicts on volumes state size, sign and reference."""

from __future__ import annotations

import numpy as np

from ccwsim.metrics import Fit
from ccwsim.report.verdicts import (
    crop_size_text,
    describe_curve,
    describe_geobodies,
    describe_patterns,
    describe_unseen,
)

CROPS = (12, 64, 80)


def fit(found, reference, tolerance=0.05) -> Fit:
    n = len(found)
    return Fit(
        np.arange(float(n)), np.array(found), np.array(reference), np.full(n, tolerance), CROPS
    )


def test_crops_are_written_along_x_y_and_z():
    assert crop_size_text(fit([0.0], [0.0])) == "80 × 64 × 12"
    said = str(describe_curve(fit([0.2, 0.9], [0.2, 0.5]), "connectivity"))
    assert said == (
        "too much connected beyond 0 cells: τ(1) 0.90 in pieces, 0.50 in TI crops of 80 × 64 × 12"
    )


def test_only_patterns_farther_than_crops_are_bad():
    far = Fit(
        np.array([2.0, 3.0]),
        np.array([0.03, 0.001]),
        np.full(2, 0.01),
        np.full(2, 0.002),
        CROPS,
        one_sided=True,
    )
    first, second = describe_patterns(far)
    assert str(first).startswith("patterns farther from the TI than crops: 2 × 2 × 2 cells, 0.0300")
    assert str(second).startswith("patterns as near to the TI as crops: 3 × 3 × 3 cells, 0.0010 b")
    assert (first.good, second.good) == (False, True)
    thin = Fit(np.array([3.0]), *np.full((3, 1), 0.01), (2, 64, 80))
    assert describe_patterns(thin)[0].numbers.startswith("3 × 3 × 2 cells")
    assert describe_patterns(None)[0].good is None


def test_geobodies_of_volumes_percolate_along_three_axes():
    found = fit([0.3, 0.0, 1.0, 1.0], [0.8, 1.0, 1.0, 0.2])
    gamma, along, upwards = describe_geobodies(found, "sand")
    assert str(gamma).startswith("geobodies of sand less connected: Γ 0.30 in pieces, 0.80 in TI")
    assert str(along).startswith("sand percolates E–W too seldom: percolation E–W 0.00 in pieces")
    assert upwards.words == "sand percolates vertically too often"
    assert upwards.numbers.startswith("percolation vertically 1.00 in pieces, 0.20 in TI crops of")


def test_unseen_patterns_are_said_with_and_without_data():
    assert describe_unseen(0.01, None) == "1.00 % of the 3 × 3 × 3 patterns do not occur in the TI"
    assert "3.25 % of those at data" in describe_unseen(0.01, 0.0325)
