"""Test the flow efficiency of realizations and of their image."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ccwsim.flow import flow_efficiency
from ccwsim.metrics import fit_flow
from ccwsim.metrics.flow_fit import OVERHEAD
from ccwsim.report.verdicts import describe_flow
from tests.flow.test_flow import ensemble


def test_layers_conduct_fully_along_and_hardly_across():
    inside = np.zeros((20, 30), bool)
    inside[::2] = True
    assert flow_efficiency(inside, 1) == pytest.approx(1.0, abs=1e-6)
    assert flow_efficiency(inside, 0) < 1e-3


def test_cells_that_touch_at_corners_do_not_conduct():
    assert flow_efficiency(np.indices((16, 16)).sum(axis=0) % 2 == 0, 1) < 0.05


def test_an_ensemble_like_its_image_flows_like_it():
    e = ensemble(8, (64, 64))
    found = fit_flow(e, 1)
    assert found.each.shape == (8, 2)
    np.testing.assert_allclose(found.reference, found.each[0], rtol=1e-6)
    for axis in (0, 1):
        assert describe_flow(found, axis).good


def test_realizations_that_all_flow_worse_than_an_image_of_their_size_are_no_tick():
    found = fit_flow(ensemble(8, (64, 64)), 1)
    assert found.is_of_image_size
    assert found.fit is not None
    below = replace(found, each=np.full((8, 2), 0.4), reference=np.array([0.6, 0.6]))
    verdict = describe_flow(below, 0)
    assert (verdict.words, verdict.good) == ("all 8 below the image's 0.60", None)
    assert describe_flow(replace(below, is_of_image_size=False), 0).good
    wide = replace(found.fit, tolerance=np.full(2, 0.258))
    assert describe_flow(replace(found, fit=wide), 0).words == "cannot tell (± 26 %)"


def test_an_image_that_is_too_small_is_not_judged():
    assert describe_flow(fit_flow(ensemble(2, (10, 10)), 1), 0).good is None


def test_a_limit_of_cells_solves_fewer_realizations_crops_and_pieces():
    e = ensemble(8, (32, 32))
    whole, few = fit_flow(e, 1), fit_flow(e, 1, max_cells=5 * 2 * (32 * 32 + OVERHEAD))
    assert few.each.shape == (5, 2)
    np.testing.assert_array_equal(few.each, whole.each[:5])
    none = fit_flow(e, 1, max_cells=1)
    assert none.each.shape == (0, 2)
    assert np.isnan(none.reference).all()
    assert describe_flow(none, 0).good is None
    assert (few.fit.tolerance >= whole.fit.tolerance).all()
