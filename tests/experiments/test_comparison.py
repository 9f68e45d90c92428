"""Test comparisons: each setting gives the result of `simulate`; ratios are means over pairs."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.distance import pdist, squareform

from ccwsim import Cancelled, CCWSIMError, Grid, HardData, Parameters, TrainingImage, simulate
from ccwsim.experiments.comparison import add_curves, compare
from ccwsim.metrics import (
    connectivity,
    fit_curve,
    js_divergence,
    metric_scaling,
    pyramid_histograms,
    variogram,
)
from tests.small_images import blobs

N, SEED = 3, 7
GRID = Grid(60, 52)
DATA = HardData([[5, 7], [20, 40], [40, 11], [41, 12]], [0, 1, 1, 2])
SETTINGS = {
    "level 1": Parameters(16, 4, wavelet_level=1),
    "cells": Parameters(16, 4, method="ccsim", refine=False),
    "level 2": Parameters(24, 8, wavelet_level=2, n_candidates=3),
}


@pytest.fixture(scope="module")
def image():
    return TrainingImage(blobs((64, 72), 3))


@pytest.fixture(scope="module")
def found(image):
    return compare(image, GRID, SETTINGS, DATA, N, SEED)


def test_each_setting_is_what_simulate_gives_alone(image, found):
    assert found.names == tuple(SETTINGS)
    for ensemble, parameters in zip(found.ensembles, SETTINGS.values(), strict=True):
        alone = simulate(image, GRID, parameters, DATA, N, SEED)
        np.testing.assert_array_equal(ensemble.indices, alone.indices)
        np.testing.assert_array_equal(ensemble.data_status, alone.data_status)
        np.testing.assert_array_equal(ensemble.n_mismatched, alone.n_mismatched)


def test_an_ensemble_of_another_method_is_compared_as_it_is(image, found):
    other = simulate(image, GRID, Parameters(24, 8), n_realizations=N, seed=SEED)
    both = compare(image, GRID, {"A": SETTINGS["level 1"], "other": other}, DATA, N, SEED)
    assert both.ensembles[1] is other
    np.testing.assert_array_equal(both.ensembles[0].indices, found.ensembles[0].indices)
    assert both.ratios[0].name == "other"


def test_the_curves_are_those_of_the_metrics(image, found):
    for (facies, statistic, way), curves in found.curves.items():
        assert facies == 2
        measure = variogram if statistic == "variogram" else connectivity
        name = "gamma" if statistic == "variogram" else "tau"
        reference = getattr(measure(image.indices, facies, way, curves.lags), name)[0]
        np.testing.assert_array_equal(curves.reference, reference)
        for ensemble, band, fit in zip(found.ensembles, curves.bands, curves.fits, strict=True):
            each = getattr(measure(ensemble.indices, facies, way, curves.lags), name)
            np.testing.assert_allclose(band.median, np.nanmedian(each, axis=0))
            np.testing.assert_allclose(band.low, np.nanquantile(each, 0.05, axis=0))
            alone = fit_curve(ensemble, statistic, facies, way)
            np.testing.assert_array_equal(fit.found, alone.found)
            np.testing.assert_array_equal(fit.tolerance, alone.tolerance)
    assert len(found.curves) == 4


def test_curves_of_another_facies_can_be_added(found):
    more = add_curves(found, 0)
    assert {key[0] for key in more.curves} == {0, 2}
    assert more.anodi is found.anodi
    with pytest.raises(CCWSIMError, match="facies = 3 must be one of 0, 1, 2"):
        add_curves(found, 3)


def test_the_table_of_ratios_by_brute_force(image, found):
    factors, weights = (1, 2, 3), np.array([4, 2, 1]) / 7
    target = pyramid_histograms(image)[0]
    between, within = {}, {}
    for name, ensemble in zip(found.names, found.ensembles, strict=True):
        rows = [pyramid_histograms(r, image.codes)[0] for r in ensemble.indices]
        pairs = [(i, j) for i in range(N) for j in range(i)]
        between[name] = np.array(
            [np.mean([js_divergence(rows[i][g], rows[j][g]) for i, j in pairs]) for g in range(3)]
        )
        within[name] = np.array(
            [np.mean([js_divergence(row[g], target[g]) for row in rows]) for g in range(3)]
        )
    assert found.anodi is not None
    assert found.anodi.factors == factors
    names = [(row.name, row.other) for row in found.ratios]
    assert names == [("cells", "level 1"), ("level 2", "level 1"), ("level 2", "cells")]
    for row in found.ratios:
        b = weights @ (between[row.name] / between[row.other])
        w = weights @ (within[row.name] / within[row.other])
        ratio = {name: between[name] / within[name] for name in (row.name, row.other)}
        r = weights @ (ratio[row.name] / ratio[row.other])
        assert (row.between, row.within, row.ratio) == pytest.approx((b, w, r))
    assert found.distance == pytest.approx([weights @ within[name] for name in found.names])
    assert found.distance == pytest.approx([each.mean() for each in found.distances])
    assert found.variety == pytest.approx([weights @ between[name] for name in found.names])


def test_all_realizations_are_placed_with_the_training_image(found):
    assert found.scaling is not None
    assert found.scaling.positions.shape == (1 + 3 * N, 2)
    mixed = np.sqrt(np.tensordot(found.anodi.weights, found.anodi.divergence, axes=1))
    assert found.scaling.stress == metric_scaling(mixed).stress
    apart = pdist(found.scaling.positions)
    assert np.corrcoef(apart, squareform(mixed, checks=False))[0, 1] > 0.5


def test_equal_settings_are_equal(image):
    same = SETTINGS["level 1"]
    found = compare(image, GRID, {"A": same, "B": same}, DATA, N, SEED)
    np.testing.assert_array_equal(found.ensembles[0].indices, found.ensembles[1].indices)
    row = found.ratios[0]
    assert (row.between, row.within, row.ratio) == pytest.approx((1, 1, 1))


def test_progress_goes_up_and_parts_come_as_they_are_known(image):
    shares, counts, parts = [], [], []

    def progress(share, n_done):
        shares.append(share)
        counts.append(n_done)

    compare(image, GRID, SETTINGS, DATA, N, SEED, progress, on_partial=parts.append)
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1)
    assert counts == sorted(counts)
    assert counts[-1] == 3 * N
    known = [(len(p.names), len(p.curves), p.anodi is not None) for p in parts]
    assert known == [(1, 0, False), (2, 0, False), (3, 0, False), (3, 4, False), (3, 4, True)]


@pytest.mark.parametrize("n_parts", [0, 2, 3, 4])
def test_it_stops_wherever_it_is(image, n_parts):
    parts = []
    with pytest.raises(Cancelled):
        compare(
            image,
            GRID,
            SETTINGS,
            DATA,
            N,
            SEED,
            cancel=lambda: len(parts) >= n_parts,
            on_partial=parts.append,
        )
    assert len(parts) == n_parts


@pytest.mark.parametrize("n", [0, 1, 5])
def test_two_to_four_settings_are_needed(image, n):
    with pytest.raises(CCWSIMError, match=f"{n} settings were given"):
        compare(image, GRID, {str(k): Parameters() for k in range(n)})


def test_a_setting_that_does_not_fit_is_named_before_anything_runs(image):
    parts = []
    settings = {"A": SETTINGS["level 1"], "B": Parameters(128, 8)}
    with pytest.raises(CCWSIMError, match=r"setting B: .*128"):
        compare(image, GRID, settings, on_partial=parts.append)
    assert not parts


def test_a_grid_too_small_for_patterns_still_gives_the_rest(image):
    settings = {"A": Parameters(8, 2, 1), "B": Parameters(8, 2, 0)}
    found = compare(image, (9, 9), settings, n_realizations=1)
    assert found.anodi is None
    assert "pattern size" in found.problem
    assert not found.ratios
    assert np.isnan(found.distance).all()
    assert len(found.curves) == 4


def test_single_realizations_have_no_variety(image):
    settings = {"A": SETTINGS["level 1"], "B": SETTINGS["cells"]}
    found = compare(image, GRID, settings, n_realizations=1)
    assert np.isnan(found.variety).all()
    assert np.isnan(found.ratios[0].ratio)
    assert np.isfinite(found.distance).all()
