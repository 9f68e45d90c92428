"""The K best places are those of a full sort, and ties are drawn without favour."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy import stats

from ccwsim.engine.stages.candidates import best_places, draw_index, keep_within, kth_best

scores_of_any_size = hnp.arrays(
    st.sampled_from([np.int16, np.int64]),
    hnp.array_shapes(min_dims=2, max_dims=2, max_side=9),
    elements=st.integers(-30, 30),
)


def drawn_places(scores: np.ndarray, k: int, rng: np.random.Generator) -> np.ndarray:
    places = np.full((k, 2), -1, np.int64)
    best_places(scores, k, rng, np.empty(len(scores), np.int64), places)
    return places


@settings(deadline=None)
@given(scores_of_any_size, st.data())
def test_the_best_places_are_those_of_a_full_sort(scores, data):
    k = data.draw(st.integers(1, scores.size))
    places = drawn_places(scores, k, np.random.default_rng(0))
    found = scores[places[:, 0], places[:, 1]]
    np.testing.assert_array_equal(np.sort(found), np.sort(scores, axis=None)[:k])
    assert len({tuple(place) for place in places.tolist()}) == k


@settings(deadline=None)
@given(scores_of_any_size, st.data())
def test_the_kth_best_is_that_of_a_full_sort(scores, data):
    k = data.draw(st.integers(1, scores.size))
    row_best = np.empty(len(scores), np.int64)
    assert kth_best(scores, k, row_best) == np.sort(scores, axis=None)[k - 1]
    np.testing.assert_array_equal(row_best, scores.min(axis=1))


def test_large_maps_are_searched_in_full():
    rng = np.random.default_rng(3)
    scores = rng.integers(-(2**14), 2**14, (120, 131)).astype(np.int16)
    for k in (1, 20, 500, scores.size):
        places = drawn_places(scores, k, rng)
        found = scores[places[:, 0], places[:, 1]]
        np.testing.assert_array_equal(np.sort(found), np.sort(scores, axis=None)[:k])


@pytest.mark.parametrize("k", [1, 3, 7])
def test_equal_places_are_drawn_equally_often(k):
    scores = np.full((5, 6), 4, np.int16)
    scores[1, 2] = 9  # never
    rng = np.random.default_rng(11)
    drawn = np.zeros(scores.shape, int)
    n = 3000
    for _ in range(n):
        np.add.at(drawn, tuple(drawn_places(scores, k, rng).T), 1)
    assert drawn[1, 2] == 0
    counts = drawn[scores == 4]
    assert stats.chisquare(counts).pvalue > 1e-4


def test_better_places_are_always_among_those_drawn():
    scores = np.zeros((4, 5), np.int64)
    scores[2, 3], scores[0, 4] = -2, -1
    rng = np.random.default_rng(5)
    for _ in range(50):
        assert {(2, 3), (0, 4)} <= {tuple(p) for p in drawn_places(scores, 4, rng).tolist()}


def test_an_index_is_drawn_from_all_equally():
    rng = np.random.default_rng(2)
    counts = np.bincount([draw_index(rng, 7) for _ in range(7000)], minlength=7)
    assert len(counts) == 7
    assert stats.chisquare(counts).pvalue > 1e-4


@settings(deadline=None)
@given(
    hnp.arrays(np.int64, (4, 5), elements=st.integers(-30, 30)),
    st.integers(1, 20),
    st.integers(0, 40),
)
def test_places_within_the_slack_come_first(scores, k, slack):
    places = drawn_places(scores, k, np.random.default_rng(0))
    before = sorted(map(tuple, places.tolist()))
    n = keep_within(scores, places, slack)
    found = scores[places[:, 0], places[:, 1]]
    assert sorted(map(tuple, places.tolist())) == before
    assert n >= 1
    assert (found[:n] <= scores.min() + slack).all()
    assert (found[n:] > scores.min() + slack).all()
