"""Test that How it works shows the values that the engine computes for a volume."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ccwsim import Grid, HardData, Parameters
from ccwsim.engine.stages.cut import UNKNOWN
from ccwsim.engine.stages.path import BELOW, LEFT, TOP, from_path
from ccwsim.engine.trace import fates
from ccwsim.figures import LIGHT
from ccwsim.sharing.choices import Choices, DataChoice, ImageChoice
from ccwsim.ui.how_it_works.maps import (
    PatchView,
    TraceView,
    centre_of_patch,
    cut_map,
    grid_map,
    score_volume,
)
from ccwsim.ui.how_it_works.resimulation import windows_by_datum, windows_map
from ccwsim.ui.how_it_works.run import How, trace_of
from ccwsim.ui.how_it_works.words import describe_position
from ccwsim.ui.session.state import KEY, State
from tests.some import some
from tests.ui.widgets import html, named, opened, texts

pytestmark = pytest.mark.slow
"""The tests are slow; `test_volume_study` tests a volume on the main pages in the quick tests."""

P = Parameters((8, 16, 16), (2, 4, 4), (1, 1, 1))
WELL = HardData([(k, 7, 9) for k in range(12)], [0, 1] * 6)
VOLUME = Choices(ImageChoice("sinuous_channels"), DataChoice(), Grid(30, 40, nz=12), P)
WITH_DATA = Choices(
    ImageChoice("sinuous_channels"), DataChoice("placed", placed=WELL), Grid(30, 40, nz=12), P
)
COLOURS = ["#111111", "#eeeeee"]


@pytest.fixture(params=[0, 3])
def view(request) -> PatchView:
    return view_of(request.param)


def view_of(number: int) -> PatchView:
    state = State(choices=WITH_DATA)
    state.page(How).number = number
    trace = trace_of(state)
    step = trace.at(state.page(How).patch)
    return PatchView(trace, COLOURS, LIGHT, step, fates(step))


def test_what_is_shown_of_the_grid_is_what_the_engine_has(view):
    shown, step, path = grid_map(view).indices, view.step, view.trace.path
    assert shown.shape == (12, 30, 40)
    part = tuple(slice(k, k + n) for k, n in zip(path.offset, path.shape, strict=True))
    before = from_path(step.before[part], path.orientation)
    np.testing.assert_array_equal(shown == 2, before == UNKNOWN)
    known = before != UNKNOWN
    np.testing.assert_array_equal(np.where(shown > 2, shown - 3, shown)[known], before[known])
    lit = int((shown < 2).sum())
    assert 0 < lit <= step.in_overlap.sum()


def test_points_are_the_data_that_condition_the_patch(view):
    for number in range(len(view.trace.patches)):
        step = view.trace.at(number)
        own = PatchView(view.trace, COLOURS, LIGHT, step, fates(step))
        placed = {tuple(point[:4]) for point in grid_map(own).points}
        assert placed <= {(*cell, facies) for *cell, facies in WELL.triples}
        if step.data is not None:
            assert len(placed) == len(step.data.seen)


def test_the_cut_and_the_scores_are_those_of_the_patch(view):
    step = view.step
    cut = cut_map(view).indices
    assert (cut == 0).sum() == step.keep_mask.sum()
    assert (cut == 2).sum() == (~step.in_overlap & ~step.keep_mask).sum()
    assert (cut == 3).sum() == (step.error & ~step.keep_mask).sum()
    shown = score_volume(view)
    assert shown.indices.size == step.scores.size
    n_rejected = sum(at.fate not in ("drawn", "candidate") for at in view.locations)
    assert len(shown.points) == step.n_candidates + n_rejected
    looks = [point[3] for point in shown.points]
    assert (looks.count(1), looks.count(2)) == (1, n_rejected)
    assert shown.points_are == ("location", "locations")
    drawn = next(point[:3] for point in shown.points if point[3] == 1)
    own = from_path(step.ccw, view.trace.path.orientation)[tuple(drawn)]
    assert own == step.ccw[tuple(step.places[step.drawn])]


def test_the_drawn_location_is_where_the_image_has_the_patch():
    for number in range(3):  # realizations of different orientations
        view = view_of(number)
        step, image = view.step, view.image.indices
        drawn = view.locations[0]
        x, y, z = map(int, view.where(drawn).strip("()").split(", "))
        at = tuple(slice(k, k + n) for k, n in zip(step.drawn_place, step.cells.shape, strict=True))
        cells = view.trace.grid_frame.turned(view.trace.oriented.pyramid.image[at])
        nz, ny, nx = cells.shape
        np.testing.assert_array_equal(image[z : z + nz, y : y + ny, x : x + nx], cells)


def test_slices_go_through_the_patch(view):
    step, cursor = view.step, tuple(centre_of_patch(view))
    inside = np.zeros(step.before.shape, bool)
    box = step.box
    inside[box.z0 : box.z0 + box.nz, box.y0 : box.y0 + box.ny, box.x0 : box.x0 + box.nx] = True
    assert view.trace.grid_frame.to_grid(inside)[cursor]


def test_windows_are_those_of_local_resimulation():
    rng = np.random.default_rng(3)
    columns = rng.integers(0, (30, 40), (40, 2))
    cells = [(int(z), *map(int, at)) for at in np.unique(columns, axis=0) for z in range(0, 12, 3)]
    data = HardData(cells, rng.integers(0, 2, len(cells)).tolist())
    choices = replace(WITH_DATA, data=DataChoice("placed", placed=data))
    trace = trace_of(State(choices=choices))
    by_datum = windows_by_datum(trace.windows)
    assert by_datum
    datum, windows = next(iter(by_datum.items()))
    shown = windows_map(TraceView(trace, COLOURS, LIGHT), windows)
    assert shown.indices[tuple(data.cells[datum])] < 2
    lit = np.zeros(shown.indices.shape, bool)
    for w in windows:
        nz, ny, nx = w.before.shape
        lit[w.layer : w.layer + nz, w.row : w.row + ny, w.column : w.column + nx] = True
    np.testing.assert_array_equal(shown.indices < 2, lit)
    np.testing.assert_array_equal(
        np.where(lit, shown.indices, shown.indices - 3), trace.before_repair
    )
    app = opened("how_it_works", State(choices=choices)).run()
    assert not app.exception
    x, y, z = data.cells[datum][::-1].tolist()
    assert f"at ({x}, {y}, {z})" in str(named(app.selectbox, "how_datum").options[0])
    assert "by local re-simulation" in html(app)


def test_faces_are_where_the_path_came_from(view):
    trace = view.trace
    faces = trace.grid_frame.faces()
    assert len(faces) == 3
    marked = np.zeros(trace.path.shape)
    marked[0, 0, 0] = 1  # the path begins in the corner of these faces
    z, y, x = np.argwhere(from_path(marked, trace.path.orientation))[0]
    assert ("below" in faces, "south" in faces, "west" in faces) == (z == 0, y == 0, x == 0)
    assert describe_position(trace, 0) == (
        f"layer 1 of {trace.path.tiles[0]}, row 1 of {trace.path.tiles[1]}, "
        f"column 1 of {trace.path.tiles[2]} of the path"
    )


@pytest.mark.parametrize("choices", some([VOLUME, WITH_DATA], always=[WITH_DATA]))
def test_the_page_steps_through_a_volume(choices):
    app = opened("how_it_works", State(choices=choices)).run()
    assert not app.exception
    assert not texts(app)
    how = app.session_state[KEY].page(How)
    n, first = len(how.trace.patches), how.patch
    assert how.trace.patches[first].shape == LEFT | TOP | BELOW
    named(app.button, "how_next").click().run()
    assert not app.exception
    said = html(app)
    assert f"Patch {first + 2} of {n}" in said
    assert "3 faces: " in said or "2 faces: " in said or "1 face: " in said
    step = how.trace.at(first + 1)
    assert f"{int(step.keep_mask.sum())} cell" in said.replace("\u202f", "")
    assert "the minimum cut of a flow" in said
    changed = int((how.trace.before_repair != how.trace.realization.indices).sum())
    assert f"<b>{changed} cell" in said.replace("\u202f", "")
    named(app.selectbox, "how_wavelet_level_z").set_value(0).run()
    assert not app.exception
    how = app.session_state[KEY].page(How)
    assert how.parameters.wavelet_level == (0, 1, 1)
    assert how.trace.study.parameters.wavelet_level == (0, 1, 1)
