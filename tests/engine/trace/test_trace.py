"""Test that a trace repeats the run: it ends in the same realization, with the same steps."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.reference import refined
from ccwsim import CCWSIMError, Grid, HardData, Parameters, TrainingImage, datasets, simulate
from ccwsim.engine import raster
from ccwsim.engine.stages.path import LEFT, UNKNOWN
from ccwsim.engine.stages.pyramid import decompose
from ccwsim.engine.trace import Frame, Trace, fates
from ccwsim.model.study import Study
from tests.small_images import blobs

SMALL = Grid(45, 60)


def image(n_facies: int = 2) -> TrainingImage:
    return TrainingImage(blobs((64, 72), n_facies))


def sampled(n: int, seed: int = 1, n_facies: int = 2, shape: tuple[int, int] = SMALL.shape):
    rng = np.random.default_rng(seed)
    flat = rng.choice(shape[0] * shape[1], n, replace=False)
    return HardData(np.stack(np.divmod(flat, shape[1]), axis=1), rng.integers(0, n_facies, n))


def traced(parameters: Parameters, data: HardData | None = None, number: int = 0, n_facies=2):
    return Trace(Study(image(n_facies), SMALL, parameters, data or HardData(), 3), number)


def simulated(trace: Trace):
    s = trace.study
    study = s.training_image, s.grid, s.parameters, s.hard_data, 1, s.seed, 1
    return simulate(*study, first_realization=trace.number, keep_sources=True)


CASES = {
    "level 0": (Parameters(16, 4, 0), 0, 2),
    "level 1": (Parameters(16, 4, 1), 0, 2),
    "level 2": (Parameters(16, 4, 2), 0, 3),
    "level 3": (Parameters(16, 8, 3), 0, 2),
    "ccsim": (Parameters(16, 4, method="ccsim"), 12, 2),
    "few data": (Parameters(16, 4, 1), 12, 2),
    "data, level 0": (Parameters(16, 4, 0), 12, 2),
    "data, level 3": (Parameters(16, 8, 3), 12, 2),
    "split tiles": (Parameters(16, 4, 2), 300, 2),
    "split tiles, three facies": (Parameters(24, 4, 1), 200, 3),
    "data steer only": (Parameters(16, 4, 2, exact_data=False), 40, 2),
    "correlation": (Parameters(16, 4, 1, similarity="correlation"), 12, 2),
    "proportions": (Parameters(16, 4, 1, match_proportions=True), 12, 2),
    "not refined": (Parameters(16, 4, 2, refine=False), 12, 2),
    "sizes vary": (Parameters(16, 4, 1, template_variation=0.3), 12, 2),
    "near its place": (Parameters(16, 4, 1, location_weight=1.0), 0, 2),
}


@pytest.fixture(params=CASES, scope="module")
def trace(request):
    parameters, n, n_facies = CASES[request.param]
    return traced(parameters, sampled(n, n_facies=n_facies) if n else None, n_facies=n_facies)


def sample(trace: Trace) -> list[int]:
    """Return the numbers of a corner patch, edge patches, an inner patch and the last patch."""
    shapes = [p.shape for p in trace.patches]
    return sorted({*(shapes.index(s) for s in set(shapes)), len(shapes) // 2, len(shapes) - 1})


@pytest.mark.slow
@pytest.mark.parametrize("number", [0, 5])
def test_it_ends_in_what_simulate_gives(trace, number):
    own = Trace(trace.study, number)
    ensemble = simulated(own)
    assert np.array_equal(own.realization.indices, ensemble.indices[0])
    assert ensemble.sources is not None
    assert np.array_equal(own.realization.sources, ensemble.sources[0])
    assert np.array_equal(own.realization.data_status, ensemble.data_status[0])


def test_the_patches_are_laid_one_on_the_other(trace):
    last = trace.at(0).before
    assert (last == UNKNOWN).all()
    for number in range(len(trace.patches)):
        step = trace.at(number)
        assert np.array_equal(step.before, last)
        last = step.after
    grid = trace.grid_frame.to_grid(last)
    for window in trace.windows:
        rows = slice(window.row, window.row + window.size)
        grid[rows, window.column : window.column + window.size] = window.after
    assert np.array_equal(grid, trace.before_repair)


@pytest.mark.slow
def test_any_patch_is_the_same_again_in_any_order(trace):
    order = np.random.default_rng(0).permutation(len(trace.patches))[:8]
    forward = {k: Trace(trace.study, trace.number).at(int(k)) for k in order}
    for k in order:
        step = trace.at(int(k))
        for name in ("before", "after", "scores", "places", "cells", "keep_mask"):
            assert np.array_equal(getattr(step, name), getattr(forward[k], name)), name
        assert (step.place, step.drawn) == (forward[k].place, forward[k].drawn)


def test_the_score_map_is_the_sum_of_squared_differences_of_block_sums(trace):
    p, ti = trace.study.parameters, trace.study.training_image
    unit, sums = 2**p.level, trace.oriented.pyramid.sums[:, 0].astype(int)
    facies = [1] if len(sums) == 1 else range(ti.n_facies)
    for number in sample(trace):
        step = trace.at(number)
        size = step.patch.size // unit
        old = np.stack([step.old == f for f in facies])[:, : size * unit, : size * unit]
        blocks = old.reshape(-1, size, unit, size, unit).sum(axis=(2, 4))
        inside = step.in_overlap[::unit, ::unit][:size, :size]
        assert np.array_equal(np.where(inside, blocks, 0), step.blocks)
        if step.patch.shape:
            coefficients = decompose(old[0], p.level)[0]
            assert np.allclose(step.approximation[0][inside], coefficients[inside])
        for py, px in np.argwhere(np.ones(step.scores.shape))[:: max(step.scores.size // 60, 1)]:
            own = sums[:, py : py + size, px : px + size][:, inside]
            b = blocks[:, inside]
            wanted = (own * b).sum() if step.correlation else np.square(own - b).sum()
            assert step.ccw[py, px] == wanted / unit**2


def test_the_candidates_are_the_best_places(trace):
    for number in sample(trace):
        step = trace.at(number)
        steered = step.scores.astype(np.int64) if step.totals is None else step.totals
        steered = np.where(step.copies, 2**40, steered.astype(np.int64))
        chosen = steered[tuple(step.places.T)]
        assert len({tuple(place) for place in step.places.tolist()}) == len(step.places)
        assert np.array_equal(np.sort(chosen), np.sort(steered, axis=None)[: len(chosen)])
        assert 0 <= step.drawn < step.n_candidates <= len(step.places)
        if step.slack is None:
            assert step.n_candidates == len(step.places)
        else:
            near = chosen <= chosen.min() + step.slack
            assert near[: step.n_candidates].all()
            assert near.sum() == step.n_candidates


def test_what_data_cost_is_what_was_added_to_the_scores(trace):
    p = trace.study.parameters
    for number in range(len(trace.patches)):
        step = trace.at(number)
        if step.data is None or p.location_weight:
            continue
        d, unit = step.data, step.block_size
        cost = [int(w * trace.search.datum_cost) for w in d.weights[:3]]
        costs = d.missed * cost[0] + d.held * cost[1]
        far_y, far_x = (np.array(trace.oriented.pyramid.phases.shape[4:]) - d.reach // unit).clip(0)
        within = np.zeros(step.scores.shape, bool)
        within[: far_y + 1, : far_x + 1] = True
        within &= ~d.ruled_out
        wanted = step.scores + costs + d.ahead * cost[2]
        assert np.array_equal(step.totals[within], wanted[within])
        if number % 7 == 0 and p.exact_data:
            missed_one_by_one(trace, step)


def missed_one_by_one(trace: Trace, step) -> None:
    turned, unit, d = trace.oriented.pyramid.image[0], step.block_size, step.data
    for py, px in step.places[:3]:
        missed = [
            turned[py * unit + s.row - step.patch.y0, px * unit + s.column - step.patch.x0]
            != s.facies
            for s in d.seen
            if s.inside and not s.held
        ]
        assert d.missed[py, px] == sum(missed)


def test_every_place_has_the_fate_that_its_figures_say(trace):
    for number in sample(trace):
        step = trace.at(number)
        told = fates(step)
        assert [p.fate for p in told].count("drawn") == 1
        drawn = (told[0].row, told[0].column)
        assert drawn == tuple(step.places[step.drawn])
        candidates = {(p.row, p.column) for p in told if p.fate in ("drawn", "candidate")}
        assert candidates == {tuple(place) for place in step.candidates.tolist()}
        for p in told:
            assert p.ccw == step.ccw[p.row, p.column]
            assert (p.fate == "copy") == step.copies[p.row, p.column]
            if p.fate == "fraction":
                assert step.data.ruled_out[p.row, p.column]
            if p.fate == "data":
                rows, columns = trace.oriented.pyramid.phases.shape[4:]
                reach = (
                    step.data.reach // step.block_size
                )  # data beyond the image have an expected cost
                ends = p.row + reach > rows or p.column + reach > columns
                assert p.missed + p.held + p.ahead > 0 or ends
        if (step.totals is None and not step.copies.any()) or not step.patch.shape:
            assert len(told) == len(step.places)
        if step.totals is None:
            assert {p.fate for p in told} <= {"drawn", "candidate", "slack", "copy", "tie"}


def test_the_cut_mask_gives_the_pasted_grid(trace):
    for number in sample(trace):
        step = trace.at(number)
        y, x, size = step.patch.y0, step.patch.x0, step.patch.size
        wanted = step.before.copy()
        wanted[y : y + size, x : x + size] = np.where(step.keep_mask, step.old, step.cells)
        assert np.array_equal(step.after, wanted)
        assert not (step.keep_mask & ~step.in_overlap).any()
        assert np.array_equal(step.error, (step.old != step.cells) & step.in_overlap)


@pytest.mark.parametrize("published", [False, True])
def test_of_the_locations_drawn_the_one_is_taken_that_fits_best(published, monkeypatch):
    monkeypatch.setattr(raster, "N_DRAWN", 400)  # so that each candidate is drawn,
    monkeypatch.setattr(raster, "GAIN", 0.0)  # with equal probabilities
    trace = traced(Parameters(16, 4, 2, n_candidates=4, published_draw=published))
    turned, unit = trace.oriented.pyramid.image[0], trace.search.block[2]
    found = []
    for number in range(1, len(trace.patches)):
        step = trace.at(number)
        seen = step.in_overlap & (step.old != UNKNOWN)

        def misfit(at: tuple[int, ...], step=step, seen=seen) -> int:
            patch = turned[at[0] :, at[1] :][: len(step.cells), : len(step.cells)]
            return int(np.count_nonzero((patch != step.old)[seen]))

        candidates = (step.places[: step.n_candidates] * unit).tolist()
        least = min(misfit(refined(turned, step.old, seen, at, unit)) for at in candidates)
        found.append(misfit(step.place) - least)
    assert (max(found) > 0) == published


@pytest.mark.parametrize("sizes", [(32, 8), (64, 16), (48, 12), (16, 4)])
def test_slack_grows_with_the_overlap(sizes):
    study = Study(datasets.load("channels"), Grid(80, 80), Parameters(*sizes, 0), HardData(), 0)
    template, overlap = sizes
    cells = template**2 - (template - overlap) ** 2
    assert Trace(study).search.slack == 8 * max(cells / 448, 1)


def test_the_inverse_transform_of_the_drawn_place_is_the_slice_of_the_image(trace):
    turned, unit = trace.oriented.pyramid.image[0], trace.search.block[2]
    for number in sample(trace):
        step = trace.at(number)
        (ty, tx), size = step.drawn_place, step.patch.size
        size -= size % unit  # parts of split tiles may contain incomplete blocks
        patch = trace.reconstructed(step, 1)
        assert np.allclose(patch, turned[ty : ty + size, tx : tx + size] == 1)
        assert abs(np.subtract(step.place, step.drawn_place)).max() < unit
        (ty, tx), size = step.place, step.patch.size
        assert np.array_equal(step.cells, turned[ty : ty + size, tx : tx + size])


def test_the_windows_replayed_give_the_realization():
    trace = traced(Parameters(16, 4, 2), sampled(60))
    grid = trace.grid_frame.to_grid(trace.at(len(trace.patches) - 1).after)
    flat = trace.study.training_image.indices.ravel()
    assert any(w.fits for w in trace.windows)
    for w in trace.windows:
        part = np.s_[w.row : w.row + w.size, w.column : w.column + w.size]
        assert np.array_equal(grid[part], w.before)
        grid[part] = w.after
        row, column = trace.study.hard_data.cells[w.datum]
        right = grid[row, column] == trace.study.facies_of_data[w.datum]
        assert right or not w.fits
        taken = w.sources >= 0
        assert np.array_equal(w.after[taken], flat[w.sources[taken]])
        assert w.fits or np.array_equal(w.before, w.after)
    assert np.array_equal(grid, trace.before_repair)


def test_a_cell_belongs_to_the_patch_that_covers_it_first():
    trace = traced(Parameters(16, 4, 1), sampled(200), number=2)
    steps = [trace.at(k) for k in range(len(trace.patches))]
    for row, column in ((0, 0), (44, 59), (20, 30), (3, 58)):
        y, x = trace.grid_frame.cell_to_path(row, column)
        first = next(k for k, step in enumerate(steps) if step.after[y, x] != UNKNOWN)
        assert trace.patch_of_cell(row, column) == first


@pytest.mark.parametrize("offset", [(0, 0), (2, 1)])
@pytest.mark.parametrize("orientation", range(8))
def test_a_frame_puts_everything_where_it_lies(orientation, offset):
    world = np.arange(6 * 9).reshape(6, 9)
    shape = (9, 6) if orientation & 4 else (6, 9)
    frame = Frame(orientation, shape, offset)
    numbers = np.zeros(np.add(shape, offset), int)
    for row, column in np.argwhere(world >= 0):
        numbers[frame.cell_to_path(int(row), int(column))] = world[row, column]
    assert np.array_equal(frame.to_grid(numbers), world)
    y, x = offset
    part = world[frame.box_to_grid((2 + y, 1 + x), (3, 2))]
    assert np.array_equal(part, frame.turned(numbers[2 + y : 5 + y, 1 + x : 3 + x]))
    box = frame.box_to_grid((0, 0), (3 + y, 2 + x))  # cells before the grid are cut off
    assert {side.stop - side.start for side in box} == {3, 2}
    first = np.argwhere(world == numbers[y, x])[0]
    second = np.argwhere(world == numbers[y, x + 1])[0]
    sides = {"south": (0, 0), "north": (0, 5), "west": (1, 0), "east": (1, 8)}
    corners = [sides[side] for side in frame.faces()]
    assert all(first[axis] == at for axis, at in corners)
    ways = {(0, 1): "east", (0, -1): "west", (1, 0): "north", (-1, 0): "south"}
    assert frame.direction == ways[tuple((second - first).tolist())]


def test_the_default_study_is_the_same_too():
    study = Study(
        datasets.load("channels"), Grid(128, 128), Parameters(), HardData([[5, 9]], [1]), 0
    )
    trace = Trace(study, 1)
    assert np.array_equal(trace.realization.indices, simulated(trace).indices[0])


def test_what_cannot_be_followed_is_said():
    with pytest.raises(CCWSIMError, match="ms-ccsim"):
        traced(Parameters(16, 4, 1, method="ms-ccsim"))
    with pytest.raises(CCWSIMError, match="patch 99"):
        traced(Parameters(16, 4, 1)).at(99)


def test_frames_turn_boxes_and_name_sides():
    assert Frame(1, (2, 2)).to_grid(np.array([[1, 2], [3, 4]])).tolist() == [[3, 4], [1, 2]]
    assert Frame(4, (10, 20)).box_to_grid((0, 5), (2, 3)) == (slice(5, 8), slice(0, 2))
    assert Frame(0, (9, 9)).faces() == ["south", "west"]
    assert Frame(6, (9, 9)).faces(LEFT) == ["north"]
