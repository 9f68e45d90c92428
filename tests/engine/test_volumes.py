"""Test volumes: every datum is honoured, and every cell is copied from the training image."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from numpy.typing import NDArray

from ccwsim import Grid, HardData, Parameters, TrainingImage
from ccwsim.engine.prepared_image import PreparedImage
from ccwsim.engine.raster import make_plan
from ccwsim.engine.realization import Realization, random_numbers, simulate_realization
from ccwsim.engine.trace import Trace, fates
from ccwsim.model.ensemble import FORCED
from ccwsim.model.study import Study
from ccwsim.model.watch import Watch
from tests.small_images import blobs, noise
from tests.some import some

Shape = tuple[int, int, int]


def volume(
    indices: NDArray[np.uint8], shape: Shape, parameters: Parameters, seed: int = 3
) -> Study:
    """Return a study of a volume without data."""
    return Study(TrainingImage(indices), Grid.of(shape), parameters, HardData(), seed)


def realized(study: Study, number: int = 0) -> Realization:
    return simulate_realization(PreparedImage(study), number, True, Watch())


def with_data(study: Study, n: int, seed: int) -> Study:
    """Return the study with n data, half of them in wells along z."""
    rng, shape = np.random.default_rng(seed), study.grid.shape
    flat = rng.permutation(int(np.prod(shape)))[: n // 2]
    cells = [*zip(*np.unravel_index(flat, shape), strict=True)]
    for _ in range(n // 2 // shape[0]):
        y, x = rng.integers(0, shape[1:])
        cells += [(z, y, x) for z in range(shape[0])]
    own = np.unique(np.array(cells, np.int64).reshape(-1, 3), axis=0)
    codes = study.training_image.codes[rng.integers(0, study.training_image.n_facies, len(own))]
    return replace(study, hard_data=HardData(own, codes))


CASES = {
    "level 0": Parameters(8, 2, 0),
    "level 1": Parameters(8, 2, 1),
    "level 2": Parameters(16, 4, 2),
    "level 3": Parameters(16, 8, 3),
    "ccsim": Parameters(8, 2, method="ccsim"),
    "correlation": Parameters(8, 2, 1, similarity="correlation"),
    "proportions": Parameters(8, 2, 1, match_proportions=True),
    "not refined": Parameters(8, 4, 2, refine=False),
    "sizes vary": Parameters(8, 2, 1, template_variation=0.3),
    "near its place": Parameters(8, 2, 1, location_weight=1.0),
    "near its height": Parameters(8, 2, 1, location_weight=(0.5, 0, 0)),
    "ms-ccsim": Parameters(16, 8, 2, method="ms-ccsim"),
    "steered": Parameters(8, 2, 1, exact_data=False),
    "one way": Parameters(8, 2, 1, random_path=False),
}


def check(study: Study, number: int = 0) -> None:
    own = realized(study, number)
    assert own.indices.shape == own.sources.shape == study.grid.shape
    taken = own.sources >= 0
    image, data = study.training_image.indices, study.hard_data.cells
    np.testing.assert_array_equal(own.indices[taken], image.ravel()[own.sources[taken]])
    places = tuple(data.T)
    if study.parameters.exact_data:
        assert (own.indices[places] == study.facies_of_data).all()
        forced = {tuple(cell) for cell in data[own.data_status == FORCED].tolist()}
        assert {tuple(cell) for cell in data[~taken[places]].tolist()} <= forced
        whole = replace(study, parameters=replace(study.parameters, repair_seams=False))
        plain = realized(whole, number)  # without changes of single cells
        forced = {tuple(cell) for cell in data[plain.data_status == FORCED].tolist()}
        assert {tuple(cell) for cell in np.argwhere(plain.sources < 0).tolist()} <= forced
    else:
        wrong = own.indices[places] != study.facies_of_data
        np.testing.assert_array_equal(own.data_status != 0, wrong)
    again = realized(study, number)
    np.testing.assert_array_equal(own.indices, again.indices)


@pytest.mark.parametrize("n_data", some([0, 8, 300], always=[8]))
@pytest.mark.parametrize("case", some(CASES, always={*CASES} - {"level 3", "ms-ccsim"}))
def test_data_are_honoured_and_cells_come_from_the_image(case, n_data):
    image = blobs((18, 24, 26), 3 if case in ("level 2", "ms-ccsim") else 2)
    for number, shape in enumerate([(19, 21, 27), (3, 30, 9)]):
        check(with_data(volume(image, shape, CASES[case]), n_data, number), number)


@settings(max_examples=12, deadline=None)
@given(
    st.tuples(*[st.integers(1, 22)] * 3),
    st.sampled_from([(4, 1, 0), (8, 2, 1), (8, 4, 2)]),
    st.sampled_from([0.0, 0.02, 0.3, 1.0]),
    st.integers(1, 4),
    st.integers(0, 2**16),
)
def test_any_grid_and_any_data_will_do(shape, sizes, share, n_facies, seed):
    image = noise((9, 11, 13), n_facies, seed)
    study = volume(image, shape, Parameters(*sizes), seed=seed)
    check(with_data(study, round(2 * share * np.prod(shape)), seed))


@pytest.mark.parametrize("level", [0, 1])
def test_an_image_that_repeats_itself_is_continued_in_each_direction(level):
    """Test that a periodic image is continued for every order of the path."""

    def pattern(z: NDArray, y: NDArray, x: NDArray) -> NDArray[np.uint8]:
        return ((z % 4 == 0) + 2 * (y % 4 == 1) + 4 * (x % 4 == 3)).astype(np.uint8)

    image = pattern(*np.indices((20, 20, 20)))
    study = volume(image, (17, 22, 25), Parameters(8, 4, level, n_candidates=1))
    plans = set()
    for number in range(16):
        realization = realized(study, number)
        own = realization.indices
        for axis in range(3):
            ahead, back = np.moveaxis(own, axis, 0)[4:], np.moveaxis(own, axis, 0)[:-4]
            np.testing.assert_array_equal(ahead, back)
        first = np.array(np.unravel_index(realization.sources[0, 0, 0], image.shape))
        shifted = np.indices(study.grid.shape) + first[:, None, None, None]
        np.testing.assert_array_equal(own, pattern(*shifted))
        plan = make_plan(PreparedImage(study), (8, 8, 8), random_numbers(3, number))
        plans.add((plan.path.orientation, plan.path.order))
    assert len(plans) > 8


def test_all_48_ways_are_drawn_about_equally_often():
    study = volume(noise((6, 6, 6), 2), (9, 10, 11), Parameters(4, 1, 0))
    image, counts = PreparedImage(study), np.zeros((3, 16), int)
    rng = np.random.default_rng(1)
    for _ in range(1200):
        path = make_plan(image, (4, 4, 4), rng).path
        counts[path.order, path.orientation] += 1
    assert counts.min() > 5
    assert counts.max() < 60


@pytest.mark.parametrize(
    "case", ["level 1", "proportions", "near its place", "near its height", "steered"]
)
@pytest.mark.parametrize("n_data", [0, 60])
def test_a_trace_of_a_volume_ends_in_the_same_realization(case, n_data):
    study = with_data(volume(blobs((14, 20, 22), 2), (15, 21, 24), CASES[case]), n_data, 1)
    trace, own = Trace(study, 2), realized(study, 2)
    for name in ("indices", "sources", "data_status"):
        np.testing.assert_array_equal(getattr(trace.realization, name), getattr(own, name))
    for number in range(0, len(trace.patches), 7):
        step = trace.at(number)
        z, y, x = step.box[:3]
        part = np.s_[z : z + step.box.nz, y : y + step.box.ny, x : x + step.box.nx]
        expected = step.before.copy()
        expected[part] = np.where(step.keep_mask, step.old, step.cells)
        np.testing.assert_array_equal(step.after, expected)
        assert not (step.keep_mask & ~step.in_overlap).any()
        assert fates(step)[0].fate == "drawn"


@pytest.mark.parametrize("number", range(6))
def test_a_frame_puts_the_layers_of_a_volume_where_they_lie(number):
    study = volume(noise((9, 10, 11), 3), (9, 13, 16), CASES["level 1"])
    trace = Trace(study, number)
    last, layers = trace.at(len(trace.patches) - 1).after, trace.before_repair
    np.testing.assert_array_equal(trace.grid_frame.to_grid(last), layers)
    for z in range(len(layers)):
        assert last[trace.grid_frame.cell_to_path(z, 3, 5)] == layers[z, 3, 5]


def test_patches_that_keep_their_height_begin_at_random_distances_before_the_grid():
    study = volume(noise((9, 10, 11), 3), (9, 13, 16), CASES["near its height"])
    traces = [Trace(study, number) for number in range(12)]
    for number, trace in enumerate(traces):
        assert trace.path.offset == Trace(study, number).path.offset
        assert trace.at(1).steered
    assert all(len({trace.path.offset[axis] for trace in traces}) > 1 for axis in range(3))


def plain_score(study: Study, trace: Trace, step: Any, at: tuple[int, ...]) -> tuple[int, int]:
    """Return the SSD of block sums and the penalty of a location, computed in a plain loop."""
    sums, block = trace.oriented.pyramid.sums.astype(int), np.array(step.block)
    size = step.blocks.shape[1:]
    inside = step.in_overlap[:: block[0], :: block[1], :: block[2]]
    inside = inside[tuple(slice(n) for n in size)]
    part = tuple(slice(k, k + n) for k, n in zip(at, size, strict=True))
    ssd = np.square(sums[:, *part] - step.blocks)[:, inside].sum()
    image, cost = trace.oriented.pyramid.image, 0
    whole = np.array(image.shape) // block * block
    for datum in step.data.seen if step.data else ():
        place = np.array([datum.layer, datum.row, datum.column]) - step.box[:3] + at * block
        kind = "held" if datum.held else "missed" if datum.inside else "ahead"
        weight = getattr(step.data.weights, kind) * trace.search.datum_cost
        if (place < whole).all():
            cost += int(weight) * (image[tuple(place)] != datum.facies)
        else:
            cost += int(weight * (1 - study.training_image.proportions[datum.facies]))
    return int(ssd), cost


@pytest.mark.parametrize("n_data", [0, 60, 900])
@pytest.mark.parametrize("n_facies", [2, 3])
@pytest.mark.parametrize("sizes", [(8, 2, 1), (8, 2, 0), (12, 4, 2)])
def test_scores_are_squared_differences_and_what_data_cost(sizes, n_facies, n_data):
    image = blobs((19, 21, 23), n_facies)
    study = volume(image, (20, 23, 26), Parameters(*sizes))
    study = with_data(study, n_data, 2)
    trace, rng = Trace(study, 1), np.random.default_rng(0)
    assert n_data < 900 or max(p.parts for p in trace.patches) > 1
    for number in range(0, len(trace.patches), 11):
        step: Any = trace.at(number)
        n = step.scores.size
        for flat in {*rng.integers(0, n, 10).tolist(), n - 1}:
            at = tuple(int(k) for k in np.unravel_index(flat, step.scores.shape))
            ssd, cost = plain_score(study, trace, step, at)
            assert step.scores[at] + step.energy == ssd
            if step.totals is not None and not step.data.ruled_out[at]:
                assert step.totals[at] == step.scores[at] + cost
        steered = step.scores.astype(np.int64) if step.totals is None else step.totals
        chosen = steered[tuple(step.places.T)]
        np.testing.assert_array_equal(np.sort(chosen), np.sort(steered, axis=None)[: len(chosen)])
        assert abs(np.subtract(step.place, step.drawn_place)).max() < max(step.block)


def test_a_trace_goes_on_where_the_image_has_no_more_layers_than_the_template():
    image = blobs((8, 20, 22), 2)
    study = with_data(volume(image, (8, 21, 24), CASES["level 1"]), 40, 1)
    trace = Trace(study, 0)
    for number in range(len(trace.patches)):
        step = trace.at(number)
        assert step.scores.shape[0] == 1
        assert fates(step)[0].fate == "drawn"
