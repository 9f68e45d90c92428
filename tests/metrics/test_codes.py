"""Test that facies are identified by codes in ensembles, training images and arrays."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, is_dataclass, replace
from typing import Any

import numpy as np
import pytest

from ccwsim import (
    CCWSIMError,
    Ensemble,
    HardData,
    Parameters,
    TrainingImage,
    datasets,
    metrics as m,
    simulate,
)
from ccwsim.experiments.comparison import compare
from ccwsim.experiments.sweep import sweep

CODES = np.array([3, 7, 9])
NAME = next(name for name in datasets.names() if datasets.load(name).n_facies == 3)
INDICES = datasets.load(NAME).indices[:72, :80]
IMAGE = TrainingImage(CODES[INDICES])
P = Parameters(template_size=16, overlap_size=4, wavelet_level=1)


@pytest.fixture(scope="module")
def ensemble() -> Ensemble:
    return simulate(IMAGE, (40, 50), P, ([[3, 4], [20, 30]], [7, 9]), 3, seed=1)


OF_FACIES: dict[str, Callable[[Any, Any], Any]] = {
    "variogram": lambda images, k: m.variogram(images, k, "NE-SW", 12),
    "variogram map": lambda images, k: m.variogram_map(images, k, 9),
    "connectivity": lambda images, k: m.connectivity(images, k, "N-S", 12),
    "geobodies": m.geobody_statistics,
}
OF_ONE_IMAGE: dict[str, Callable[[Any, Any], Any]] = {
    "labels": m.connected_geobodies,
    "granulometry": m.granulometry,
}
OF_ALL: dict[str, Callable[[Any], Any]] = {
    "proportions": m.proportions,
    "e-type": lambda images: m.etype(images).probability,
    "entropy": lambda images: m.etype(images).entropy,
    "counts": m.facies_counts,
    "transiograms": lambda images: m.transiograms(images, direction="E-W", lags=9),
    "patterns": lambda images: [
        [(h.codes, h.frequencies) for h in row] for row in m.pyramid_histograms(images)
    ],
    "differing": m.differing_share,
}


def same(one: Any, other: Any) -> bool:
    """Return whether two results are exactly equal."""
    if is_dataclass(one):
        return all(same(getattr(one, f.name), getattr(other, f.name)) for f in fields(one))
    if isinstance(one, str) or one is None:
        return one == other
    if isinstance(one, (list, tuple)):
        return len(one) == len(other) and all(map(same, one, other))
    return np.array_equal(np.asarray(one), np.asarray(other), equal_nan=True)


@pytest.mark.parametrize("name", OF_FACIES)
def test_a_code_gives_what_its_index_gave(ensemble, name):
    measure = OF_FACIES[name]
    for index, code in enumerate(CODES):
        before = measure(ensemble.indices, index)
        for images in (ensemble, ensemble.realizations, ensemble.realizations.tolist()):
            assert same(measure(images, code), before)
        assert same(measure(IMAGE, int(code)), measure(INDICES, index))


@pytest.mark.parametrize("name", OF_ONE_IMAGE)
def test_a_code_of_one_image_gives_what_its_index_gave(name):
    measure = OF_ONE_IMAGE[name]
    for index, code in enumerate(CODES):
        before = measure(INDICES, index)
        assert same(measure(IMAGE, code), before)
        assert same(measure(CODES[INDICES], code), before)


@pytest.mark.parametrize("name", OF_ALL)
def test_codes_that_images_say_themselves_change_no_digit(ensemble, name):
    measure = OF_ALL[name]
    before = measure(ensemble.indices)
    assert same(measure(ensemble), before)
    assert same(measure(ensemble.realizations), before)
    if name != "differing":
        assert same(measure(IMAGE), measure(INDICES))


def test_measures_against_the_training_image_change_no_digit(ensemble):
    before = m.anodi(ensemble.indices, INDICES)
    for found in (m.anodi(ensemble, IMAGE), m.anodi({"a": ensemble.realizations}, IMAGE.array)):
        assert same(found.divergence, before.divergence)
    distances = m.pattern_distance(ensemble.indices, INDICES)
    assert same(m.pattern_distance(ensemble, IMAGE), distances)
    assert same(m.stationarity(IMAGE), m.stationarity(INDICES))
    assert same(m.feature_spacing(IMAGE), m.feature_spacing(INDICES))
    assert same(m.diagnose(CODES[INDICES]).advice, m.diagnose(IMAGE).advice)
    coarse = m.coarsened(INDICES, 3)
    assert same(m.coarsened(IMAGE, 3), CODES[coarse])


def test_scores_against_a_reference_field_take_codes(ensemble):
    found, field = m.etype(ensemble), CODES[INDICES[:40, :50]]
    before = m.score_reference(found.probability, INDICES[:40, :50], ensemble.n)
    assert same(m.score_reference(found, field), before)
    assert same(m.score_reference(found, TrainingImage(field)), before)
    assert same(m.score_reference(found.probability, field, ensemble.n, codes=CODES), before)
    one = m.calibration(found.probability, INDICES[:40, :50], 2)
    assert same(m.calibration(found, field, 9), one)
    with pytest.raises(CCWSIMError, match="facies = 2 must be one of 3, 7, 9"):
        m.calibration(found, field, 2)
    with pytest.raises(CCWSIMError, match=r"facies code \d is not one of 3, 7, 9"):
        m.score_reference(found, INDICES[:40, :50])
    with pytest.raises(CCWSIMError, match="ascend"):
        m.score_reference(found.probability, field, 3, codes=[7, 3, 9])


def test_what_results_name_are_codes(ensemble):
    assert set(np.unique(m.etype(ensemble).most_likely)) <= {3, 7, 9}
    assert {m.judge(ensemble).facies, m.judge(ensemble).proportion_facies} <= {3, 7, 9}
    assert m.judge(ensemble, 7).facies == 7
    fit = m.fit_proportions(ensemble)
    assert fit is not None
    assert fit.at.tolist() == [3, 7, 9]


def test_experiments_take_and_name_codes(ensemble):
    settings = {"a": P, "b": replace(P, n_candidates=3)}
    found = compare(IMAGE.array, (40, 50), settings, None, 2, facies=np.uint8(7))
    assert {key[0] for key in found.curves} == {7}
    swept = sweep(IMAGE.array, (40, 50), [P], n_realizations=2, facies=9)
    assert swept.rows[0].quality.facies == 9
    assert set(np.unique(swept.rows[0].realizations)) <= {3, 7, 9}
    for run in (
        lambda: compare(IMAGE, (40, 50), settings, facies=2),
        lambda: sweep(IMAGE, (40, 50), [P], facies=2),
    ):
        with pytest.raises(CCWSIMError, match="facies = 2 must be one of 3"):
            run()


@pytest.mark.parametrize("name", [*OF_FACIES, *OF_ONE_IMAGE])
def test_a_code_that_nothing_has_is_an_error(name):
    measure = (OF_FACIES | OF_ONE_IMAGE)[name]
    for images in (IMAGE, CODES[INDICES]):
        for wrong in (1, -1, 300, True, "7", 7.0):
            with pytest.raises(
                CCWSIMError, match=r"must be one of (facies )?3, (facies )?7, (facies )?9"
            ):
                measure(images, wrong)


def test_a_facies_that_the_realizations_lack_is_known_by_the_training_image(ensemble):
    indices = np.minimum(ensemble.indices, 1)  # the last facies does not occur
    study = replace(ensemble.study, hard_data=HardData())
    poor = replace(ensemble, indices=indices, study=study)
    assert (m.variogram(poor, 9, lags=5).gamma == 0).all()
    assert np.isnan(m.connectivity(poor, 9, lags=5).tau).all()
    assert m.geobody_statistics(poor, 9).n_geobodies.tolist() == [0, 0, 0]
    assert (m.proportions(poor)[:, 2] == 0).all()
    assert m.etype(poor).probability.shape == (3, 40, 50)
    assert not m.score_reference(m.etype(poor), np.full((40, 50), 9)).right.any()
    with pytest.raises(CCWSIMError, match="one of 3, 7"):
        m.variogram(poor.realizations, 9, lags=5)


def test_codes_name_what_an_array_lacks():
    image = [[3, 3], [9, 3]]
    assert m.proportions(image).tolist() == [[0.75, 0.25]]
    assert m.proportions(image, CODES).tolist() == [[0.75, 0.0, 0.25]]
    assert m.proportions(image, [9, 7, 3]).tolist() == [[0.75, 0.0, 0.25]]
    assert m.pattern_histogram(image, CODES, size=1).facies == (3, 7, 9)
    for wrong in ([3], [3, 7], [], [3, 3, 9], "39", [[3, 9]], 0.5, 3):
        with pytest.raises(CCWSIMError):
            m.proportions(image, wrong)


def test_a_mask_has_both_facies():
    assert m.proportions(np.zeros((2, 2), bool)).tolist() == [[1.0, 0.0]]
    assert (m.variogram(np.ones((3, 3), bool), 0, lags=2).gamma == 0).all()


def test_whole_floats_are_codes_with_and_without_gaps():
    codes = np.random.default_rng(0).integers(0, 2, (3, 20, 30))
    whole, gaps = codes.astype(float), codes.astype(float)
    gaps[0, 4, 5] = np.nan
    assert np.array_equal(m.variogram(whole, 1, lags=5).gamma, m.variogram(codes, 1, lags=5).gamma)
    assert np.array_equal(
        m.variogram(gaps, 1, lags=5).gamma[1:], m.variogram(gaps[1:], 1, lags=5).gamma
    )
    with pytest.raises(CCWSIMError, match="whole numbers"):
        m.variogram(codes + 0.5, 1, lags=5)
