"""Test the suggested ranges of a sweep: enough settings around any legal study, and all legal."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from ccwsim import Parameters, TrainingImage, datasets
from ccwsim.experiments.plan import (
    MIN_SUGGESTED,
    SweepPlan,
    describe_advice,
    plan_sweep,
    suggested_ranges,
)
from ccwsim.metrics.diagnosis import recommended_parameters, resolving_levels
from ccwsim.model.parameters import METHODS, fitted
from ccwsim.model.sizes import levels, overlap_sizes, template_sizes

SIDES = st.sampled_from((4, 5, 6, 7, 9, 16, 33, 64, 100))


def image_of(shape: tuple[int, ...], thickness: int) -> TrainingImage:
    return TrainingImage(np.indices(shape).sum(axis=0) // thickness % 2)


def plan_for(p: Parameters, image: TrainingImage) -> SweepPlan:
    return plan_sweep(p, suggested_ranges(p, image), image.shape)


@st.composite
def studies(draw) -> tuple[Parameters, TrainingImage]:
    """Return parameters that are legal for an image, and the image."""
    layers = draw(st.sampled_from(((), (1,), (2,), (5,), (16,))))
    shape = (*layers, draw(SIDES), draw(SIDES))
    level = draw(st.sampled_from(levels(shape)))
    template = draw(st.sampled_from(template_sizes(level, shape)))
    overlap = draw(st.sampled_from(overlap_sizes(level, template)))
    k, method = draw(st.sampled_from((1, 2, 7, 20, 10**6))), draw(st.sampled_from(METHODS))
    base = Parameters(n_candidates=k, method=method, published_draw=draw(st.booleans()))
    sizes = {"template_size": template, "overlap_size": overlap, "wavelet_level": level}
    return fitted(base, shape, **sizes), image_of(shape, draw(st.integers(1, 9)))


def n_legal(p: Parameters, shape: tuple[int, ...]) -> int:
    used = [0] if p.method == "ccsim" else levels(shape)
    return sum(len(overlap_sizes(j, t)) for j in used for t in template_sizes(j, shape))


@settings(max_examples=60, deadline=None)
@given(studies())
def test_any_study_has_nine_settings_or_all_legal_ones(study):
    p, image = study
    plan = plan_for(p, image)
    volume, k_counts = len(image.shape) == 3, p.published_draw or len(image.shape) == 3
    assert len(plan) >= MIN_SUGGESTED or (not k_counts and len(plan) == n_legal(p, image.shape))
    assert len(plan) <= 64
    assert not plan.left_out
    assert p in plan.fitting or p.method == "ccsim"
    for setting in plan:
        assert setting == fitted(setting, image.shape)
    assert len({setting.overlap_size for setting in plan}) > 1
    assert (len({setting.n_candidates for setting in plan}) > 1) == k_counts
    assert volume or all(isinstance(setting.template_size, int) for setting in plan)


def test_ranges_follow_the_study_and_not_a_list():
    image = datasets.load("stone_wall")
    ranges = suggested_ranges(Parameters(30, 10, 1), image)
    assert ranges["template_size"] == [20, 30, 45]
    assert ranges["overlap_size"] == [7, 10, 15]
    assert ranges["n_candidates"] == [20]
    paper = suggested_ranges(Parameters.published("paper"), image)
    assert paper["n_candidates"] == [5, 20]


def test_no_level_is_suggested_at_which_the_thinnest_facies_vanishes():
    image = datasets.load("fractures")  # a facies is 2 cells thick
    assert resolving_levels(image) == (0, 1, 1)
    ranges = suggested_ranges(Parameters(32, 8, 1), image)
    assert max(ranges["wavelet_level"]) == 1
    assert suggested_ranges(Parameters(32, 8, 3), image)["wavelet_level"] == [0, 1, 3]


@pytest.mark.parametrize("name", datasets.names())
def test_one_function_advises_and_never_a_level_that_loses_the_thinnest_facies(name):
    image = datasets.load(name)
    base = Parameters(n_candidates=7)
    advised, reason = recommended_parameters(image, base)
    assert advised.n_candidates == 7
    limits = resolving_levels(image)
    assert all(j <= k for j, k in zip(advised.along(image.shape).level, limits, strict=True))
    assert reason in describe_advice(image)
    assert f"level {advised.along(image.shape).level[-1]}" in describe_advice(image)
    assert advised == fitted(advised, image.shape)
    tried = plan_for(advised, image)
    assert advised in tried.fitting
    assert len(tried) >= MIN_SUGGESTED


def test_an_image_that_is_too_small_for_advice_has_none():
    assert describe_advice(image_of((5, 6), 2)) == ""
