"""Test that the K best locations equal those of a full sort, and that ties are broken at random."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from hypothesis.extra import numpy as hnp
from scipy import stats

from ccwsim.engine.stages.candidates import (
    SEGMENT,
    best_places,
    draw_index,
    keep_within,
    kth_smallest,
    location_of_number,
    make_ranking,
    n_up_to,
    rule_out_continuations,
    segment_minima,
)
from ccwsim.engine.stages.path import Box

KINDS = [np.int16, np.int32, np.int64]


def whole(shape, kinds=KINDS, largest: int = 30):
    """Return arrays of integers, of each type that scores may have."""
    numbers = st.integers(-largest, largest)
    return st.sampled_from(kinds).flatmap(
        lambda kind: hnp.arrays(kind, shape, elements=numbers.map(kind))
    )


scores_of_any_size = st.one_of(
    whole(hnp.array_shapes(min_dims=1, max_dims=1, max_side=90)),
    whole(hnp.array_shapes(min_dims=1, max_dims=1, min_side=90, max_side=300), largest=2000),
)
"""Scores of maps and volumes are raveled, so the arrays have one axis."""


def drawn_places(scores: np.ndarray, k: int, rng: np.random.Generator) -> np.ndarray:
    ranking = make_ranking(scores.size, k, scores.dtype)
    best_places(scores.ravel(), rng, ranking)
    return ranking.places


@settings(deadline=None)
@given(scores_of_any_size, st.data())
def test_the_best_places_are_those_of_a_full_sort(scores, data):
    k = data.draw(st.integers(1, scores.size))
    places = drawn_places(scores, k, np.random.default_rng(0))
    np.testing.assert_array_equal(np.sort(scores[places]), np.sort(scores)[:k])
    assert len(set(places.tolist())) == k
    better = np.sort(scores)[:k] < np.sort(scores)[k - 1]
    assert (scores[places[: better.sum()]] < np.sort(scores)[k - 1]).all()


@settings(deadline=None)
@given(scores_of_any_size, st.data())
def test_the_kth_best_is_that_of_a_full_sort(scores, data):
    n = data.draw(st.integers(1, scores.size))
    k = data.draw(st.integers(1, n))
    assert kth_smallest(scores, n, k) == np.sort(scores[:n])[k - 1]


@settings(deadline=None)
@given(scores_of_any_size, st.integers(-31, 31))
def test_segments_have_their_smallest_score(scores, limit):
    minima = make_ranking(scores.size, 1, scores.dtype).minima
    segment_minima(scores, minima)
    parts = [scores[i :: len(minima)] for i in range(len(minima))]
    assert max(map(len, parts)) <= SEGMENT
    np.testing.assert_array_equal(minima, [part.min() for part in parts])
    assert n_up_to(scores, limit) == np.count_nonzero(scores <= limit)


@pytest.mark.parametrize("kind", KINDS)
def test_scores_at_the_ends_of_their_type_are_told_apart(kind):
    largest = np.iinfo(kind).max
    if kind is np.int64:
        largest = 2**60  # costs are added to scores of ruled-out locations
    scores = np.array([largest, -largest, largest - 1, 1 - largest] * 20).astype(kind)
    rng = np.random.default_rng(1)
    for k in (1, 20, 30, 41, 80):
        found = scores[drawn_places(scores, k, rng)]
        np.testing.assert_array_equal(np.sort(found), np.sort(scores)[:k])


@pytest.mark.parametrize("shape", [(1, 120, 131), (20, 21, 40)])
def test_large_maps_and_volumes_are_searched_in_full(shape):
    rng = np.random.default_rng(3)
    scores = rng.integers(-(2**14), 2**14, shape).astype(np.int16)
    for k in (1, 20, 500, scores.size):
        found = scores.flat[drawn_places(scores, k, rng)]
        np.testing.assert_array_equal(np.sort(found), np.sort(scores, axis=None)[:k])


@pytest.mark.parametrize("shape", [(1, 5, 6), (3, 4, 5)])
@pytest.mark.parametrize("k", [1, 3, 7])
def test_equal_places_are_drawn_equally_often(k, shape):
    scores = np.full(shape, 4, np.int16)
    scores[0, 1, 2] = 9  # never drawn
    rng = np.random.default_rng(11)
    drawn = np.zeros(scores.shape, int)
    n = 3000
    for _ in range(n):
        np.add.at(drawn.ravel(), drawn_places(scores, k, rng), 1)
    assert drawn[0, 1, 2] == 0
    counts = drawn[scores == 4]
    assert stats.chisquare(counts).pvalue > 1e-4


def test_better_places_are_always_among_those_drawn():
    scores = np.zeros(50, np.int64)
    scores[44], scores[4] = -2, -1
    rng = np.random.default_rng(5)
    for _ in range(50):
        places = drawn_places(scores, 4, rng).tolist()
        assert set(places[:2]) == {44, 4}
        assert len(set(places)) == 4


def test_an_index_is_drawn_from_all_equally():
    rng = np.random.default_rng(2)
    counts = np.bincount([draw_index(rng, 7) for _ in range(7000)], minlength=7)
    assert len(counts) == 7
    assert stats.chisquare(counts).pvalue > 1e-4


@settings(deadline=None)
@given(whole(20, [np.int32, np.int64]), st.integers(1, 20), st.integers(0, 40))
def test_places_within_the_slack_come_first(scores, k, slack):
    places = drawn_places(scores, k, np.random.default_rng(0))
    before = sorted(places.tolist())
    n = keep_within(scores, places, np.int64(slack))
    found = scores[places]
    assert sorted(places.tolist()) == before
    assert n >= 1
    assert (found[:n] <= scores.min() + slack).all()
    assert (found[n:] > scores.min() + slack).all()


@given(st.tuples(*[st.integers(1, 9)] * 3), st.tuples(*[st.sampled_from([1, 2, 4])] * 3), st.data())
def test_the_number_of_a_location_tells_where_it_is(shape, block, data):
    number = data.draw(st.integers(0, int(np.prod(shape)) - 1))
    at = np.unravel_index(number, shape)
    expected = [int(k) * b for k, b in zip(at, block, strict=True)]
    assert list(location_of_number(np.int64(number), shape[1:], block)) == expected


@pytest.mark.parametrize("block", [(1, 4, 4), (2, 2, 2)])
def test_what_goes_on_with_a_patch_beside_is_left_out(block):
    scores = np.arange(5 * 9 * 11, dtype=np.int16).reshape(5, 9, 11)
    patches = np.array([[0, 0, 0, 8, 8, 8], [0, 0, 6, 8, 8, 8]])
    locations = np.array([[4, 9, 13], [0, 0, 0]], np.int32)
    box = Box(0, 6, 0, 1, 8, 8, 0, 0, 4, 4)
    before = scores.copy()
    rule_out_continuations(box, np.array([0, -1]), patches, locations, block, (1, 1, 1), 0, scores)
    place = (locations[0] + box[:3] - patches[0, :3]) // np.array(block)
    out = np.zeros(scores.shape, bool)
    out[tuple(slice(max(k - 1, 0), k + 3) for k in place)] = True
    np.testing.assert_array_equal(scores[~out], before[~out])
    assert (scores[out] == np.iinfo(np.int16).max).all()
