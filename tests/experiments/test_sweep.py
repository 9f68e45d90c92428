"""Test sweeps: compatible settings are tried, judged like `judge`, and one is recommended."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from itertools import product
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

from ccwsim import CCWSIMError, HardData, Parameters, TrainingImage, datasets, simulate
from ccwsim.experiments.plan import label, plan_sweep, varied
from ccwsim.experiments.sweep import (
    Sweep,
    SweepRow,
    nearest_on_front,
    pareto_front,
    recommended,
    sweep,
)
from ccwsim.experiments.timing import typical_seconds
from ccwsim.figures import DARK, LIGHT, sweep_chart
from ccwsim.figures.sweep import LABEL_POSITIONS, LETTER_WIDTH, LINE_HEIGHT, POINT_GAP, label_sides
from ccwsim.metrics import judge
from ccwsim.model.parameters import METHODS, fitted
from tests.small_images import blobs

BASE = Parameters(template_size=16, overlap_size=4, wavelet_level=1, n_candidates=5)
IMAGE = TrainingImage(blobs((64, 72), 2, seed=4))
DATA = HardData([[3, 4], [20, 30], [33, 2]], [1, 0, 1])
TRIED = [replace(BASE, template_size=t, wavelet_level=j) for t in (8, 16) for j in (1, 2)]


@pytest.fixture(scope="module")
def found():
    return sweep(IMAGE, (40, 44), TRIED, DATA, n_realizations=3, seed=5)


def fits(changes: dict) -> bool:
    try:
        return bool(replace(BASE, **changes))
    except CCWSIMError:
        return False


def test_settings_are_all_combinations_that_fit():
    ranges = {
        "template_size": [8, 12, 16, 96],
        "overlap_size": [2, 4, 8],
        "wavelet_level": [0, 1, 2, 3],
        "n_candidates": [1, 9],
    }
    combinations = [dict(zip(ranges, v, strict=True)) for v in product(*ranges.values())]
    fitting = [replace(BASE, **c) for c in combinations if fits(c)]
    plan = plan_sweep(BASE, ranges)
    assert set(plan) == set(fitting)
    assert len(plan) == len(fitting)
    assert len(plan.left_out) == len(combinations) - len(fitting)
    rounded = plan_sweep(BASE, ranges, IMAGE.shape)
    assert (
        set(rounded)
        == {fitted(BASE, IMAGE.shape, **c) for c in combinations}
        > {p for p in fitting if p.template_size <= 64}
    )
    assert len(rounded) + rounded.n_equal == len(combinations)
    assert not rounded.left_out


def test_what_means_the_same_is_tried_once():
    plan = plan_sweep(BASE, {"method": ["ccwsim", "ccsim"], "wavelet_level": [0, 1, 2]})
    assert [(p.method, p.wavelet_level) for p in plan] == [
        ("ccwsim", 0),
        ("ccwsim", 1),
        ("ccwsim", 2),
        ("ccsim", 0),
    ]
    assert plan.n_equal == 2
    assert len(plan_sweep(BASE, {"n_candidates": [3, 3]})) == 1


@pytest.mark.parametrize("method", METHODS)
def test_every_method_can_be_swept(method):
    plan = plan_sweep(BASE, {"method": [method]}, IMAGE.shape)
    result = sweep(IMAGE, (30, 30), plan.fitting, n_realizations=1)
    assert not result.failed
    assert result.rows[0].parameters.method == method


def test_a_wrong_range_is_said():
    with pytest.raises(CCWSIMError, match=r"'refine' has no range: choose from method"):
        plan_sweep(BASE, {"refine": [True]})
    with pytest.raises(CCWSIMError, match="template_size has no value to try"):
        plan_sweep(BASE, {"template_size": []})
    with pytest.raises(CCWSIMError, match="there is no setting to try"):
        sweep(IMAGE, (30, 30), [])


def test_labels_say_what_differs():
    tried = [BASE, replace(BASE, n_candidates=9), replace(BASE, method="ccsim")]
    names = varied(tried)
    assert names == ["method", "wavelet_level", "n_candidates"]
    assert [label(p, names) for p in tried] == [
        "ccwsim · level 1 · K 5",
        "ccwsim · level 1 · K 9",
        "ccsim · K 5",
    ]


def test_rows_are_what_simulate_and_judge_give(found):
    assert [row.parameters for row in found.rows] == TRIED
    assert not found.stopped
    for row, parameters in zip(found.rows, TRIED, strict=True):
        alone = simulate(IMAGE, (40, 44), parameters, DATA, 3, seed=5, keep_sources=True)
        assert np.array_equal(row.realizations, alone.indices[:2])
        own = replace(judge(alone), cpu_seconds=row.quality.cpu_seconds)
        assert row.quality == own
        assert row.quality.cpu_seconds > 0
    assert np.array_equal(found.errors(), [row.quality.pattern_distance for row in found.rows])
    assert np.array_equal(found.errors("connection"), [r.quality.tau_error for r in found.rows])
    assert np.array_equal(
        found.errors("mended"), [r.quality.n_resimulated + r.quality.n_forced for r in found.rows]
    )


def test_rows_come_one_by_one_and_a_stopped_sweep_keeps_them():
    seen: list[SweepRow] = []
    shares: list[tuple[float, int]] = []
    stopped = sweep(
        IMAGE,
        (40, 44),
        TRIED,
        DATA,
        n_realizations=2,
        found=seen.append,
        progress=lambda share, n: shares.append((share, n)),
        cancel=lambda: len(seen) >= 2,
    )
    assert stopped.stopped
    assert list(stopped.rows) == seen
    assert [row.parameters for row in seen] == TRIED[:2]
    assert shares == sorted(shares)
    assert shares[-1][0] < 1


def test_progress_ends_with_all_done():
    shares = []
    sweep(IMAGE, (30, 30), TRIED[:2], n_realizations=1, progress=lambda *a: shares.append(a))
    assert shares[-1] == (1.0, 2)
    assert all(0 <= share <= 1 for share, _ in shares)


def test_a_setting_that_cannot_be_simulated_does_not_end_the_sweep():
    larger = Parameters(template_size=96, overlap_size=8)
    result = sweep(IMAGE, (30, 30), [larger, BASE], n_realizations=1)
    assert [p for p, _ in result.failed] == [larger]
    assert "larger than the training image" in result.failed[0][1]
    assert len(result.rows) == 1
    assert not result.stopped


@given(st.lists(st.tuples(st.integers(0, 6), st.integers(0, 6)), max_size=12))
def test_no_other_point_dominates_the_front(points):
    by_hand = {
        k
        for k, (t, e) in enumerate(points)
        if not any(a <= t and b <= e and (a, b) != (t, e) for a, b in points)
    }
    front = pareto_front([t for t, _ in points], [e for _, e in points])
    assert set(front.tolist()) == by_hand
    assert len(front) == len(by_hand)
    assert [points[k][0] for k in front] == sorted(points[k][0] for k in front)


def test_unknown_errors_are_not_on_the_front():
    assert pareto_front([1.0, 2.0], [np.nan, 3.0]).tolist() == [1]
    with pytest.raises(CCWSIMError, match="2 times and 1 errors"):
        pareto_front([1, 2], [3])


def judged(found: Sweep, numbers: list[dict], image_shape=(640, 640), thickness=4) -> Sweep:
    """Return a sweep of the same settings with other results and facies of another thickness."""
    image = TrainingImage(np.arange(72) // thickness % 2 * np.ones((64, 1), int))
    rows = [
        replace(
            row,
            quality=replace(row.quality, **changes),
            trial=replace(row.trial, training_image=image),
        )
        for row, changes in zip(found.rows, numbers, strict=True)
    ]
    return replace(found, rows=tuple(rows), image_shape=image_shape)


def numbers(distance, seconds, tau=0.01, wrong=0.0, spread=0.0, share=0.01, copied=90.0) -> dict:
    each = {"pattern_distances": (distance,) * 3, "pattern_spread": spread}
    each |= {"tau_errors": (tau, tau), "tau_spreads": (spread, spread)}
    each |= {"proportion_error": share, "proportion_spread": spread}
    each |= {"largest_copied": copied, "copied_spread": 0.0}
    return {**each, "cpu_seconds": seconds, "n_mismatched": wrong}


FIRST, SECOND, POOR, NEXT = (1.0, 9), (1.05, 3), numbers(2, 1), numbers(1.2, 2)
CHOICES = [
    ([numbers(*FIRST), numbers(*SECOND), POOR, NEXT], 1, "differ by less than 10 % in patterns"),
    (
        [numbers(1.0, 2), numbers(*SECOND), POOR, NEXT],
        0,
        "2 settings are worse in patterns: 1.2",
    ),
    (
        [numbers(*FIRST), numbers(*SECOND, tau=0.2), POOR, NEXT],
        0,
        "the error of τ(h) is 0.2 or more, but 0.01 with the best setting",
    ),
    ([numbers(*FIRST, wrong=2), numbers(*SECOND, wrong=2), POOR, numbers(3, 2)], 2, "as good"),
    ([numbers(*FIRST, tau=np.nan), numbers(*SECOND, tau=np.nan), POOR, NEXT], 1, "fastest"),
    (
        [numbers(*FIRST), numbers(*SECOND, share=-0.4), POOR, NEXT],
        0,
        "a facies is off by 40 % or more, but by only 1 % with the best setting",
    ),
]


@pytest.mark.parametrize(("each", "index", "words"), CHOICES)
def test_the_fastest_of_the_good_ones_is_recommended(found, each, index, words):
    choice = recommended(judged(found, each))
    assert choice.index == index
    assert words in choice.reason


def test_settings_that_the_spread_cannot_tell_apart_are_named_with_the_fastest(found):
    each = [numbers(1.0, 9, spread=0.5), numbers(1.4, 3, spread=0.5), POOR, numbers(1.3, 4)]
    choice = recommended(judged(found, each))
    names = "T 8 · level 2; T 16 · level 2; T 8 · level 1"
    assert choice.reason.startswith(
        f"These cannot be told apart by 3 realizations each: {names}. "
        "The fastest setting is T 8 · level 2, 3"
    )
    assert (choice.index, choice.alike) == (1, (1, 3, 0))
    apart = [{**one, "pattern_spread": 0.01, "proportion_spread": 0.01} for one in each]
    assert recommended(judged(found, apart)).alike == (0,)


def test_copying_is_weighed_before_the_patterns(found):
    t = [row.parameters.template_size**2 for row in found.rows]
    each = [numbers(1.0, 1, copied=9.0 * t[0]), numbers(2.0, 5, copied=2.0 * t[1]), POOR, POOR]
    choice = recommended(judged(found, each))
    assert choice.index != 0
    assert "1 other setting copies pieces of up to 576 cells from the training image" in (
        choice.reason
    )
    all_copy = [numbers(1.0, 1, copied=(9.0 - k) * t[k]) for k in range(4)]
    choice = recommended(judged(found, all_copy))
    assert choice.index == 3
    assert "This setting copies least" in choice.reason


@pytest.mark.parametrize("name", ["channels", "levees"])
def test_one_candidate_is_not_recommended_as_it_copies_large_pieces(name):
    image = datasets.load(name)
    plain = Parameters(published_draw=True, repair_seams=False)
    tried = [replace(plain, n_candidates=k) for k in (1, 5, 20)]
    result = sweep(image, (256, 256), tried, n_realizations=3, seed=1)
    copied = result.errors("copying")
    assert copied[0] > 4 * 32**2 > copied[1:].max()
    choice = recommended(result)
    assert choice.index != 0
    assert "1 other setting copies pieces of up to" in choice.reason


def test_a_template_that_hardly_fits_the_image_is_not_recommended(found):
    each = [numbers(2.0, 5), numbers(2.0, 4), numbers(1.0, 3), numbers(1.0, 2)]
    choice = recommended(judged(found, each, image_shape=(64, 72)))  # T 8: 72 fit, T 16: 16 fit
    assert choice.index == 1
    assert "2 other settings have templates so large" in choice.reason
    assert recommended(judged(found, each)).index == 3


def test_no_level_is_recommended_whose_blocks_are_larger_than_the_thinnest_facies(found):
    each = [numbers(2.0, 5), numbers(1.0, 1), numbers(2.0, 4), numbers(1.0, 1)]
    assert [row.parameters.wavelet_level for row in found.rows] == [1, 2, 1, 2]
    assert recommended(judged(found, each)).index == 1
    choice = recommended(judged(found, each, thickness=2))
    assert choice.index == 2
    assert "2 other settings have levels whose blocks are larger than the thinnest" in choice.reason
    assert set(nearest_on_front(judged(found, each, thickness=2))) == {2}
    choice = recommended(judged(found, each, thickness=1))
    assert choice.index == 1
    assert "All settings have levels whose blocks" in choice.reason


def test_the_settings_on_the_front_nearest_to_the_recommended_one_are_offered(found):
    each = [numbers(1.0, 9), numbers(2.0, 3), numbers(4.0, 1), numbers(3.0, 8)]
    sweep_of_four = judged(found, each)
    assert recommended(sweep_of_four).index == 0
    assert nearest_on_front(sweep_of_four) == [2, 1, 0]
    assert nearest_on_front(sweep_of_four, 2) == [1, 0]


def test_nothing_is_recommended_before_anything_is_known(found):
    with pytest.raises(CCWSIMError, match="no setting is finished yet"):
        recommended(replace(found, rows=()))
    assert recommended(replace(found, rows=found.rows[:1])).reason.startswith("This is the only")


def test_finer_and_denser_is_expected_to_take_longer():
    shapes = (256, 256), (512, 512)
    expected_seconds = partial(typical_seconds, judged=True)
    times = [expected_seconds(Parameters(wavelet_level=j), *shapes) for j in (0, 1, 2, 3)]
    assert times == sorted(times, reverse=True)
    assert expected_seconds(Parameters(), *shapes, n_data=400) > times[2]
    assert expected_seconds(Parameters(), *shapes, n_facies=5) > times[2]
    assert expected_seconds(Parameters(template_size=512), *shapes) > 0
    assert typical_seconds(Parameters(), *shapes) < times[2]


def traces_of(chart) -> dict[str, Any]:
    return {trace.name: trace for trace in chart.data}


@pytest.mark.parametrize("theme", [LIGHT, DARK])
@pytest.mark.parametrize("high", [3.0, 400.0])
def test_the_chart_shows_settings_front_and_marks(theme, high):
    x, y = np.array([1.0, high, 2.0]), np.array([high + 1, 1.5, high + 2])
    chart: Any = sweep_chart(
        x,
        y,
        ["a", "b", "c"],
        theme,
        front=pareto_front(x, y),
        selected=2,
        recommended=0,
        y_title="error",
    )
    traces = traces_of(chart)
    assert next(iter(traces)) == "settings"
    dots = traces["settings"]
    assert list(dots.x) == list(x)
    assert list(dots.y) == list(y)
    assert dots.marker.symbol == ("diamond", "circle", "circle-open")
    assert dots.customdata[0] == "a · recommended"
    assert list(traces["front"].x) == [1.0, high]
    assert (traces["selected"].x[0], traces["selected"].y[0]) == (2.0, high + 2)
    assert chart.layout.xaxis.type == ("log" if high > 100 else None)


def test_the_chart_of_one_setting_or_of_unknown_errors_is_drawn():
    for y in (0.0, np.nan):
        chart: Any = sweep_chart(
            np.array([2.0]),
            np.array([y]),
            ["only"],
            LIGHT,
            front=[],
            selected=0,
            recommended=None,
            y_title="error",
        )
        assert np.isfinite(chart.layout.yaxis.range).all()
        assert np.isfinite(chart.layout.xaxis.range).all()


@given(
    st.lists(st.tuples(st.floats(0, 400), st.floats(0, 300)), max_size=15, unique=True),
    st.integers(3, 20),
)
def test_labels_do_not_lie_on_each_other(points, letters):
    sides = label_sides(points, ["x" * letters] * len(points), range(len(points)), (400, 300))
    boxes = []
    for (x, y), side in zip(points, sides, strict=True):
        if side is None:
            continue
        right, down = LABEL_POSITIONS[side]
        width = letters * LETTER_WIDTH
        middle, line = x + right * (POINT_GAP + width / 2), y + down * (POINT_GAP + LINE_HEIGHT / 2)
        boxes.append(
            (middle - width / 2, line - LINE_HEIGHT / 2, middle + width / 2, line + LINE_HEIGHT / 2)
        )
    for k, a in enumerate(boxes):
        assert a[0] >= 0
        assert a[2] <= 400
        for b in boxes[:k]:
            assert a[0] >= b[2] or b[0] >= a[2] or a[1] >= b[3] or b[1] >= a[3]
