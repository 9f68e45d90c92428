"""Verdicts on volumes say size, sign and against what."""

from __future__ import annotations

import numpy as np

from ccwsim.metrics import Fit
from ccwsim.report.verdicts import (
    describe_curve,
    describe_geobodies,
    describe_layers,
    describe_patterns,
    describe_unseen,
    size_text,
)

CROPS = (12, 64, 80)


def fit(found, reference, tolerance=0.05) -> Fit:
    n = len(found)
    return Fit(
        np.arange(float(n)), np.array(found), np.array(reference), np.full(n, tolerance), CROPS
    )


def test_crops_are_written_along_x_y_and_z():
    assert size_text(fit([0.0], [0.0])) == "80 × 64 × 12"
    said = describe_curve(fit([0.2, 0.9], [0.2, 0.5]), "connectivity")
    assert said == "too much connected beyond 0 cells: τ(1) 0.90, TI 0.50 (crops of 80 × 64 × 12)"


def test_layers_are_named_with_the_sign_of_the_worst():
    assert describe_layers(fit([0.3, 0.1, 0.0, 0.3], [0.3, 0.3, 0.3, 0.3]), "sand") == (
        "too little sand in layers 1 to 2: 0 % in layer 2, TI 30 % (crops of 80 × 64 × 12)"
    )
    assert describe_layers(fit([0.3, 0.5], [0.3, 0.3]), "sand").startswith(
        "too much sand in layer 1: 50 %, TI 30 %"
    )
    inside = "each layer inside the band of TI crops (80 × 64 × 12)"
    assert describe_layers(fit([0.3], [0.3]), "sand") == inside
    assert "another number of layers" in describe_layers(None, "sand")
    assert "not judged" in describe_layers(fit([np.nan], [0.3]), "sand")


def test_only_patterns_farther_than_crops_are_bad():
    far = Fit(
        np.array([2.0, 3.0]), np.array([0.03, 0.001]), np.full(2, 0.01), np.full(2, 0.002), CROPS
    )
    (first, bad), (second, good) = describe_patterns(far)
    assert first.startswith("2 × 2 × 2 patterns 3.0 times as far from the TI as its crops: 0.0300")
    assert second.startswith("3 × 3 × 3 patterns as near to the TI as its crops: 0.0010 bits")
    assert (bad, good) == (False, True)
    thin = Fit(np.array([3.0]), *np.full((3, 1), 0.01), (2, 64, 80))
    assert describe_patterns(thin)[0][0].startswith("3 × 3 × 2 patterns as near")
    assert "not judged" in describe_patterns(None)[0][0]


def test_geobodies_of_volumes_percolate_along_three_axes():
    found = fit([0.3, 0.0, 1.0, 1.0], [0.8, 1.0, 1.0, 0.2])
    gamma, along, upwards = describe_geobodies(found, "sand")
    assert gamma.startswith("geobodies of sand less connected: Γ 0.30, TI 0.80")
    assert along.startswith("sand percolates E–W too seldom: in 0 % of the pieces")
    assert upwards.startswith(
        "sand percolates vertically too often: in 100 % of the pieces, in 20 %"
    )


def test_unseen_patterns_are_said_with_and_without_data():
    assert describe_unseen(0.01, None) == "1.00 % of the 3 × 3 × 3 patterns do not occur in the TI"
    assert "3.25 % of those at data" in describe_unseen(0.01, 0.0325)
