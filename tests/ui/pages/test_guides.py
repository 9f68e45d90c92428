"""Test the guides: the page, the line in the study column, runs, links and projects."""

from __future__ import annotations

import ast
import inspect
import json
import re
import tomllib
import tracemalloc
from collections.abc import Iterator
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from streamlit.testing.v1 import AppTest

from ccwsim import CCWSIMError, Grid, HardData, Parameters, io
from ccwsim.engine import copies
from ccwsim.io import write_maps
from ccwsim.jobs import limits
from ccwsim.model import errors, secondary
from ccwsim.sharing.choices import (
    Choices,
    DataChoice,
    Directions,
    Gradient,
    GuideChoice,
    ImageChoice,
    Shown,
    Stroke,
    Upload,
    ZoneLayers,
)
from ccwsim.sharing.link import link_of, own_choices, parts_left_out, read_link
from ccwsim.sharing.project import project_as_bytes
from ccwsim.ui.frontend.cells import CellMap
from ccwsim.ui.guides.page import GUIDES_OF_TASK, GuidesPage, _with_hard_data, take_drawing
from ccwsim.ui.session import resolve
from ccwsim.ui.session.resolve import image_of, same_realizations, secondary_of, study_of
from ccwsim.ui.session.state import KEY, State
from ccwsim.ui.share.menu import open_project, project_of
from ccwsim.ui.study.guides_step import problem_of_guides, use_guides
from ccwsim.ui.study.image_questions import image_of_file
from ccwsim.ui.study.questions import IN_SCRIPTS
from ccwsim.ui.study.run import collect, start_run
from ccwsim.ui.validate.conditioning import describe_zones
from ccwsim.ui.validate.statistics import Validation, zones
from ccwsim.ui.widgets.text import page_labels
from tests.fuzz.builders import png_of_remarks
from tests.ui.widgets import html, named, opened
from tests.waiting import wait_until

GRID = Grid(60, 80)
STUDY = Choices(data=DataChoice(), grid=GRID, parameters=Parameters(16, 4, 1), n_realizations=4)
TRIANGLE = ((0.0, 0.0), (80.0, 0.0), (0.0, 60.0))
STROKES = Stroke(0.9, 9.5, 0.5, ((30.0, 20.0), (60.0, 40.25))), Stroke(0, 5, 1, ((0.1, -2),))
FLOW = (((10.0, 5.0), (30.0, 50.5)), ((70.0, 5.0), (70.0, 30.0), (75.0, 55.0)))
WALL, EAST = ImageChoice("stone_wall"), ((40.0, -1.0), (81.0, -1.0), (81.0, 61.0), (40.0, 61.0))
ZONED = GuideChoice(images=(WALL,), zones=(EAST,), angle=FLOW, flow_azimuth=90.0)
GUIDES = GuideChoice(Gradient(), active=TRIANGLE, auxiliary=Directions(0.0, 90.0))


def grid_file(name: str = "map.gslib", grid: Grid = GRID, **maps: np.ndarray) -> Upload:
    file = BytesIO()
    write_maps(file, maps, grid, format="gslib")
    return Upload(name, file.getvalue())


def guides_page(state: State, task: str = "") -> AppTest:
    """Return the page Guides with the controls of a task; by default, of the first in use."""
    state.page(GuidesPage).task = task
    app = opened("guides", state).run()
    assert not app.exception
    return app


def to_task(app: AppTest, task: str) -> None:
    named(app.button_group, "guides_task").set_value(task).run()
    assert not app.exception


def run(state: State) -> State:
    start_run(state)
    assert state.job is not None, state.message
    state.job.wait(60)
    collect(state)
    assert state.ensemble is not None, state.message
    return state


def test_guides_are_chosen_on_the_page():
    app = guides_page(State(choices=STUDY))
    named(app.selectbox, "guides_active").set_value("inside an outline").run()
    to_task(app, "facies")
    named(app.selectbox, "guides_probabilities").set_value("a gradient").run()
    named(app.number_input, "guides_probabilities_azimuth").set_value(0.0).run()
    assert not app.exception
    assert not app.error
    guides = app.session_state[KEY].choices.guides
    assert guides.probabilities == Gradient(azimuth=0.0)
    assert len(guides.active) == 4
    named(app.button, "guides_none").click().run()
    assert app.session_state[KEY].choices.guides.is_empty


def test_a_gradient_and_a_polygon_reach_the_realizations():
    e = run(State(choices=replace(STUDY, guides=replace(GUIDES, auxiliary=None)))).ensemble
    assert e is not None
    p, active = e.probability(1), e.active
    assert active is not None
    assert np.isnan(p[~active]).all()
    assert not np.isnan(p[active]).any()
    west, east = p[:, :20][active[:, :20]].mean(), p[:, 40:][active[:, 40:]].mean()
    assert west < east


def test_strokes_draw_probabilities_one_over_the_other():
    choices = replace(STUDY, guides=GuideChoice(STROKES))
    study = study_of(choices)
    assert study.secondary is not None
    drawn, share = study.secondary.probabilities[1], study.training_image.proportions[1]
    np.testing.assert_allclose(drawn[20, 30], 0.9, atol=0.01)  # a cell from the line
    np.testing.assert_allclose(drawn[30, 45], 0.9, atol=0.01)
    np.testing.assert_allclose(drawn[[0, 59], [79, 0]], share)
    assert share < drawn[20, 23] < 0.9
    assert drawn[0, 0] < share  # the second stroke begins outside the grid


def test_a_drawing_of_the_browser_becomes_strokes_and_corners():
    state = State(choices=replace(STUDY, guides=GuideChoice((), active=TRIANGLE)))
    lines = [[s.value, s.radius, s.softness, list(map(list, s.points))] for s in STROKES]
    drawn = {
        "flow": False,
        "strokes": lines,
        "outlines": {"outline": [[0, 0], [50, 0], [0, 40.5]]},
    }
    take_drawing(state, drawn)
    guides = state.choices.guides
    assert guides.probabilities == STROKES
    assert guides.active == ((0.0, 0.0), (50.0, 0.0), (0.0, 40.5))
    with pytest.raises(CCWSIMError, match="value of a stroke = 3"):
        take_drawing(state, drawn | {"strokes": [[3, 1, 1, [[0, 0]]]], "outlines": {}})
    far = {"outline": [[900, 0], [999, 0], [999, 9]]}
    take_drawing(state, drawn | {"strokes": [], "outlines": far})
    assert state.guides_draft is not None  # no cell is active
    assert state.choices.guides.active == guides.active


def test_other_guides_are_other_realizations():
    one, other = (replace(STUDY, guides=replace(GUIDES, facies=k)) for k in (0, 1))
    assert not same_realizations(one, other)
    assert not same_realizations(one, STUDY)
    assert same_realizations(one, replace(STUDY, guides=replace(GUIDES, facies=0)))


def test_a_project_keeps_the_guides_exactly_and_those_of_a_script_as_maps():
    state = State(choices=replace(STUDY, guides=GUIDES, n_realizations=1))
    project, other = project_of(state), State()
    open_project(other, Upload("study.ccwsim", project_as_bytes(project)))
    assert other.choices == state.choices
    of_script = project_as_bytes(replace(project, choices=None))
    open_project(other, Upload("study.ccwsim", of_script))
    assert other.choices.guides.saved is not None
    assert same_realizations(other.choices, state.choices)
    saved = other.choices
    open_project(other, Upload("study.ccwsim", project_as_bytes(project_of(other))))
    assert other.choices.guides.saved is not None
    assert same_realizations(other.choices, saved)
    for page in ("simulate", "guides"):
        assert "From the project" in html(opened(page, State(choices=other.choices)).run())


def test_a_link_names_files_of_guides_and_a_reload_keeps_them():
    choices = replace(STUDY, guides=replace(GUIDES, active=grid_file(mask=np.ones((60, 80)))))
    assert parts_left_out(choices) == ("the secondary information map.gslib",)
    back, _, notes = read_link(link_of(choices))
    assert back.guides.is_empty
    assert "does not have the secondary information map.gslib" in " ".join(notes)
    back, _, notes = read_link(link_of(choices), own_choices(choices))
    assert back == choices
    assert not notes


@pytest.mark.parametrize(
    "guides",
    [
        GUIDES,
        GuideChoice(Gradient(-37.5, 0.1, 1 / 3), facies=0, soft_weight=2.5),
        GuideChoice(active=((1e6 + 0.1, -5.0), (2e6, 1e-7), (3.0, 4e20))),
        GuideChoice(auxiliary=Directions(90.0, -15.0), auxiliary_weight=3.0),
        GuideChoice(STROKES, facies=0, active=TRIANGLE),
        ZONED,
        GuideChoice(images=(ImageChoice("stone_wall"), ImageChoice("delta")), zones=0.25),
        GuideChoice(images=(ImageChoice("channels"),), angle=(), flow_azimuth=90.0),
        GuideChoice(images=(ImageChoice("stone_wall"), WALL), zones=ZoneLayers((3, 11))),
    ],
)
def test_a_link_contains_shapes_that_guide(guides):
    choices = replace(STUDY, guides=guides)
    assert not parts_left_out(choices)
    assert read_link(link_of(choices)) == (choices, Shown(), ())


@pytest.mark.parametrize(
    "text",
    [
        "", "{", "[]", "1", '{"gradient": 1}', '{"facies": 1.5}', '{"facies": 999}',
        '{"soft_weight": 9}', '{"soft_weight": NaN}', '{"auxiliary_weight": 11}',
        '{"auxiliary": {"image": 0, "grid": 1e999}}', '{"auxiliary": {"up": 0}}',
        '{"flow_azimuth": 400}', '{"active": [[0, 0], [1, 1]]}', '{"active": [[0, 0, 1]]}',
        '{"active": {"name": "a.png", "content": 0}}', '{"active": [["0", "1"]]}',
        '{"probabilities": [{"value": 2, "radius": 1, "softness": 1, "points": [[0, 0]]}]}',
        '{"probabilities": [{"value": 1, "radius": 1, "softness": 1, "points": []}]}',
        '{"images": [{"bundled": 1}]}', '{"images": ["channels"]}', '{"images": {}}',
        '{"zones": [[[0, 0], [1, 1]]]}', '{"zones": {"first": [1.5]}}', '{"angle": [[[0, 0]]]}',
        '{"scale": 0}', '{"mirrored": 1}', '{"saved": {}}', "[" * 9000,
    ],
)  # fmt: skip
def test_other_texts_guide_nothing_and_are_named(text):
    back, _, notes = read_link({"guides": [text]})
    assert back.guides.is_empty
    assert len(notes) == 1
    assert "guides = " in notes[0]


def test_files_become_maps():
    sand = np.linspace(0, 1, GRID.n_cells).reshape(GRID.shape)
    soft = grid_file(P_0=1 - sand, P_1=sand)
    secondary = secondary_of(replace(STUDY, guides=GuideChoice(soft)))
    assert secondary is not None
    np.testing.assert_allclose(secondary.probabilities[1], sand, atol=1e-6)
    single = secondary_of(
        replace(STUDY, guides=GuideChoice(grid_file(any=sand), facies_names=(("map", 0),)))
    )
    assert single is not None
    np.testing.assert_allclose(single.probabilities[0], sand, atol=1e-6)
    ring = json.dumps({"type": "Polygon", "coordinates": [TRIANGLE]}).encode()
    of_ring = secondary_of(replace(STUDY, guides=GuideChoice(active=Upload("a.geojson", ring))))
    of_corners = secondary_of(replace(STUDY, guides=GuideChoice(active=TRIANGLE)))
    assert of_ring is not None
    assert of_corners is not None
    assert np.array_equal(of_ring.active, of_corners.active)


DELTA = replace(STUDY, image=ImageChoice("delta"))
SAND = np.linspace(0.1, 0.6, GRID.n_cells).reshape(GRID.shape)


def upload_probabilities(app: AppTest, *files: Upload) -> AppTest:
    """Choose several files at once on the page Guides."""
    uploads = [(file.name, file.content, "text/plain") for file in files]
    named(app.get("file_uploader"), "guides_soft_file").set_value(uploads).run()
    assert not app.exception
    return app


def test_one_file_is_enough_for_three_facies_and_the_page_says_who_shares_the_rest():
    names, shares = (image_of(DELTA.image).facies_names, image_of(DELTA.image).proportions)
    state = State(choices=DELTA)
    app = upload_probabilities(
        guides_page(state, "facies"), grid_file(f"prob_{names[2]}.gslib", v=SAND)
    )
    secondary = secondary_of(state.choices)
    assert secondary is not None
    np.testing.assert_allclose(secondary.probabilities[2], SAND, atol=1e-6)
    others = shares[:2] / shares[:2].sum()
    expected = others[:, None, None] * (1 - SAND)
    np.testing.assert_allclose(secondary.probabilities[:2], expected, atol=1e-6)
    assert named(app.selectbox, "guides_facies").options == [names[2]]
    assert f"Given probability of {names[2]}" in html(app)
    rest = f"{names[0]} and {names[1]} share the rest of the probabilities".capitalize()
    assert rest in " ".join(caption.value for caption in app.caption)


def test_several_files_are_read_at_once_and_named_by_file_or_variable():
    names = image_of(DELTA.image).facies_names
    state = State(choices=DELTA)
    files = (
        grid_file(f"{names[0]}.gslib", v=SAND),
        grid_file("b.gslib", **{f"P_{names[1]}": SAND / 2}),
    )
    app = upload_probabilities(guides_page(state, "facies"), *files)
    assert not app.error
    assert state.choices.guides.probability_files == files
    assert state.choices.guides.files == files
    secondary = secondary_of(state.choices)
    assert secondary is not None
    np.testing.assert_allclose(secondary.probabilities[:2], [SAND, SAND / 2], atol=1e-6)
    assert [file.split()[-1] for file in parts_left_out(state.choices)] == ["b.gslib"]


def test_a_file_of_another_name_is_asked_for_its_facies():
    state = State(choices=DELTA)
    app = upload_probabilities(guides_page(state, "facies"), grid_file("seismic.gslib", v=SAND))
    assert not app.error
    assert "choose which facies of the image seismic is" in html(app)
    assert "Probability of seismic in the file" in html(app)  # the map, not an empty grid
    named(app.selectbox, "ask_soft_name_0").set_value(int(image_of(DELTA.image).codes[1])).run()
    assert not app.exception
    secondary = secondary_of(state.choices)
    assert state.guides_draft is None
    assert secondary is not None
    np.testing.assert_allclose(secondary.probabilities[1], SAND, atol=1e-6)


BASINS = 3.0 + 5 * (np.indices(GRID.shape)[1] // 20)  # 3, 8, 13 and 18 from west to east


def test_active_values_of_a_mask_with_several_are_asked():
    state = State(choices=STUDY)
    use_guides(state, GuideChoice(active=grid_file("basins.gslib", v=BASINS)))
    app = guides_page(state)
    assert "the values 3, 8, 13, 18 do not say which cells are inactive" in html(app)
    assert not app.error  # an open question is no error
    assert state.choices.guides.is_empty
    question = named(app.button_group, "ask_active_codes")
    assert question.options == [f"{code} (1,200 cells)" for code in (3, 8, 13, 18)]
    question.set_value([18.0]).run()
    named(app.button_group, "ask_active_codes").set_value([18.0, 8.0]).run()
    assert not app.exception
    guides, right = state.choices.guides, np.isin(BASINS, [8, 18])
    assert guides.active_codes == (8, 18)
    np.testing.assert_array_equal(secondary_of(state.choices).active, right)
    assert "2400 of 4800 cells are active" in html(app)
    saved = project_as_bytes(project_of(run(state)))
    again = State()
    open_project(again, Upload("basins.ccwsim", saved))
    np.testing.assert_array_equal(secondary_of(again.choices).active, right)
    named(app.button_group, "ask_active_codes").set_value([]).run()
    assert "choose which values are active" in html(app)
    named(app.selectbox, "guides_active").set_value("inside an outline").run()
    assert state.choices.guides.active_codes == ()


def test_two_files_of_one_facies_are_refused():
    name = image_of(DELTA.image).facies_names[1]
    files = grid_file(f"{name}.gslib", v=SAND), grid_file(f"prob_{name}.gslib", v=SAND)
    assert "two maps are of one facies" in problem_of_guides(
        replace(DELTA, guides=GuideChoice(files))
    )


HALF = np.full(GRID.shape, 0.5)
GROUND = CellMap(np.zeros(GRID.shape, np.uint8), ["#9AA9B8"], ["active"], "All cells of the grid")
PICTURE = Upload("a.png", png_of_remarks())
POINT = GuideChoice(angle=(((3.0, 4.0), (3.0, 4.0)),))
TWO = GuideChoice(images=(WALL,))
GAP = np.where(np.arange(256) == 3, np.nan, np.ones((256, 1)))
GAPS = grid_file(grid=Grid(256, 256), a=GAP)
BROKEN = {
    "another shape": (GuideChoice(grid_file(grid=Grid(30, 80), P_1=HALF[:30])), "80 × 60"),
    "percent": (GuideChoice(grid_file(P_1=100 * HALF)), "not between 0 and 1"),
    "sums": (GuideChoice(grid_file(P_0=HALF, P_1=0.4 * HALF)), "sum to 0.7"),
    "nothing": (GuideChoice(grid_file(P_1=np.nan * HALF)), "no cell has a value"),
    "a picture": (GuideChoice(PICTURE), "9 × 9 cells, but 80 × 60 are needed"),
    "no active cell": (GuideChoice(active=grid_file(a=0 * HALF)), "no cell of the grid is active"),
    "far polygon": (GuideChoice(active=((900.0, 0.0), (999.0, 0.0), (999.0, 9.0))), "no centre"),
    "not GeoJSON": (GuideChoice(active=Upload("a.geojson", b'{"type": 1')), "GeoJSON"),
    "two masks": (GuideChoice(active=grid_file(a=HALF, b=HALF)), "give one variable"),
    "gaps": (
        GuideChoice(auxiliary=(grid_file(grid=Grid(256, 256), a=GAP), grid_file(a=HALF))),
        "fill the gaps",
    ),
    "no grid": (GuideChoice(auxiliary=(grid_file(a=HALF), None)), "are needed"),
    "turns": (GuideChoice(angle=grid_file(a=1e9 * HALF)), "is not between"),
    "a point": (POINT, "a line between two different points"),
    "zone 2": (replace(TWO, zones=grid_file(a=4 * HALF)), "2 is not the number of an image"),
    "half a zone": (replace(TWO, zones=grid_file(a=HALF)), "0.5 is not the number of an image"),
    "layers of a map": (replace(TWO, zones=ZoneLayers((3,))), "need a volume"),
    "other facies": (GuideChoice(images=(ImageChoice("delta"),)), "rename or merge its facies"),
    "a volume": (GuideChoice(images=(ImageChoice("sinuous_channels"),)), "give images of one kind"),
}
UPLOADERS = {
    "probabilities": "guides_soft_file",
    "active": "guides_mask_file",
    "images": "guides_other_file",
    "auxiliary": "guides_grid_file",
    "angle": "guides_angle_file",
    "zones": "guides_zones_file",
}
"""The last uploader of each guide; messages about the guide are below it."""
IDENTIFIER = re.compile(r"`|\b(?!P_)\w+_\w+|\w=")
"""Pattern of words that only a programmer understands; variables of files have names like P_1."""


def guide_of(guides: GuideChoice) -> str:
    """Return the first guide that a choice has; zones are a guide of images."""
    names = ("auxiliary", "zones", "images", "probabilities", "active", "angle")
    return next(name for name in names if getattr(guides, name) not in (None, ()))


def elements(block: Any) -> Iterator[Any]:
    """Yield the elements of a page in the order on screen."""
    for child in block.children.values():
        yield from elements(child) if hasattr(child, "children") else [child]


def place_of_error(app: AppTest) -> str:
    """Return the key of the last uploader above the only error of a page."""
    shown = list(elements(app.main))
    (place,) = [k for k, element in enumerate(shown) if element.type == "error"]
    above = [element.key for element in shown[:place] if element.type == "file_uploader"]
    return re.sub(r"_\d$", "", above[-1]) if above else ""


@pytest.mark.parametrize("what", BROKEN)
def test_a_wrong_guide_says_so_below_its_control(what):
    guides, said = BROKEN[what]
    guide = guide_of(guides)
    task = next(task for task, names in GUIDES_OF_TASK.items() if guide in names)
    state = State(choices=STUDY)
    use_guides(state, guides)
    app = guides_page(state, task)
    (error,) = app.error
    assert said in error.value.replace("\\", "")
    assert place_of_error(app) == UPLOADERS[guide]
    assert not IDENTIFIER.search(error.value.replace("\\", ""))
    other = "active" if task != "active" else "facies"
    to_task(app, other)
    assert app.error[0].value.startswith(page_labels("tasks_of_guides")[task][0])
    assert not place_of_error(app).startswith("guides")


def test_an_auxiliary_variable_without_its_second_file_is_no_error():
    state = State(choices=STUDY)
    use_guides(state, GuideChoice(auxiliary=(None, grid_file(a=HALF))))
    for page in ("guides", "simulate"):
        app = opened(page, state).run()
        assert not app.error
        text = "There is no auxiliary map of the training image yet; choose a file."
        assert html(app).count(text) == 1
        assert named(app.button, "guides_keep")


def test_hard_data_are_on_the_map_and_those_of_a_volume_are_seen_from_above():
    data = DataChoice("placed", placed=HardData([[3, 70], [50, 8]], [0, 1]))
    drawn = _with_hard_data(State(choices=replace(STUDY, data=data)), GROUND)
    assert drawn.points == [[3, 70, 0, 0], [50, 8, 1, 0]]
    wells = (("A", ((0, 3, 70), (1, 3, 70))),)
    column = HardData([[0, 3, 70], [1, 3, 70]], [0, 1])
    volume = Choices(
        image=ImageChoice("sinuous_channels"),
        data=DataChoice("placed", placed=column, wells=wells),
        grid=Grid(60, 80, nz=48),
    )
    drawn = _with_hard_data(State(choices=volume), GROUND)
    assert drawn.points == [[3, 70, 0, 0], [3, 70, 1, 0]]
    assert drawn.wells == (("A", ((3, 70), (3, 70))),)
    broken = replace(STUDY, data=replace(data, placed=HardData([[900, 0]], [0])))
    assert _with_hard_data(State(choices=broken), GROUND) is GROUND


def test_questions_about_the_files_of_further_images_are_asked_one_by_one():
    values = np.random.default_rng(0).random((80, 80))
    file = BytesIO()
    np.save(file, values)
    uploads = [Upload(f"{name}.npy", file.getvalue()) for name in "ab"]
    state = State(choices=STUDY)
    use_guides(state, GuideChoice(images=tuple(map(image_of_file, uploads))))
    app = guides_page(state, "images")
    assert named(app.button_group, "ask_image1_values").value == "threshold"
    named(app.button_group, "ask_image2_values").set_value("classes").run()
    assert not app.exception
    state = app.session_state[KEY]
    first, second = (state.guides_draft or state.choices.guides).images
    assert "threshold" in dict(first.answers)
    assert dict(second.answers)["classes"] == 2
    assert named(app.number_input, "ask_image2_classes").value == 2


@pytest.mark.parametrize(
    ("before", "guide"), [(TWO, "auxiliary"), (GuideChoice(auxiliary=Directions()), "images")]
)
def test_guides_that_exclude_each_other_say_so_below_the_latest(before, guide):
    task = "facies" if guide == "auxiliary" else guide
    app = guides_page(State(choices=replace(STUDY, guides=before)), task)
    assert not app.error
    key, chosen = {
        "auxiliary": ("guides_auxiliary", "position along a direction"),
        "images": ("guides_other", "stone_wall"),
    }[guide]
    named(app.selectbox, key).set_value(chosen).run()
    (error,) = app.error
    assert "known only in the training image" in error.value
    assert place_of_error(app) == UPLOADERS[guide]
    assert app.session_state[KEY].choices.guides == before
    named(app.button, "guides_keep").click().run()
    assert not app.error


def test_the_page_begins_with_the_first_guide_and_undo_takes_a_change_back():
    app = guides_page(State(choices=replace(STUDY, guides=GUIDES)))
    assert named(app.button_group, "guides_task").value == "active"  # the first in use
    named(app.selectbox, "guides_active").set_value("none").run()
    state = app.session_state[KEY]
    assert state.choices.guides == replace(GUIDES, active=None)
    state.undo()
    app.run()
    assert not app.exception
    assert app.session_state[KEY].choices.guides == GUIDES


def test_a_change_of_guides_shows_realizations_beside_the_map():
    state = run(State(choices=STUDY, live=False))
    app = guides_page(state, "direction")
    named(app.selectbox, "guides_angle").set_value("one angle").run()
    state = app.session_state[KEY]
    wait_until(lambda: state.job is None or state.job.finished, "the run", every=0.1)
    app.run()
    assert state.ensemble_choices.guides.angle == 45.0
    assert "Realization 1 of 4" in html(app)
    assert "E-type" in html(app)


SHORT_LINE = b'{"type": "LineString", "coordinates": [[0]]}'


@pytest.mark.parametrize(
    ("task", "guide", "name", "content", "said"),
    [
        ("images", "images", "a.png", b"no picture", "contains no numbers"),
        ("images", "images", "a.dat", b"100000 100000 9\n1\nfacies\n0\n", "a.dat"),
        ("direction", "angle", "a.geojson", SHORT_LINE, "at least 2 points"),
        ("direction", "angle", "b.geojson", b"{nothing", "is not valid GeoJSON"),
    ],
)
def test_a_refused_file_says_so_below_its_control(task, guide, name, content, said):
    app = guides_page(State(choices=STUDY), task)
    key = next(up.key for up in app.get("file_uploader") if up.key.startswith(UPLOADERS[guide]))
    named(app.get("file_uploader"), key).upload(name, content).run()
    (error,) = app.error
    assert said in error.value.replace("\\", "")
    assert "The file is not used." in error.value
    assert place_of_error(app) == UPLOADERS[guide]
    assert not IDENTIFIER.search(error.value.replace("\\", ""))
    assert app.session_state[KEY].choices == STUDY
    named(app.selectbox, "guides_" + ("other" if guide == "images" else guide)).set_value(
        "stone_wall" if guide == "images" else "one angle"
    ).run()
    assert not app.error


def messages(module: Any) -> Iterator[str]:
    """Yield the messages of the errors that a module raises, without the inserted values."""
    table = tomllib.loads(Path(errors.__file__).with_suffix(".toml").read_text("utf-8"))
    for call in ast.walk(ast.parse(inspect.getsource(module))):
        name = ast.unparse(call.func) if isinstance(call, ast.Call) else ""
        if name in ("refused", "CCWSIMError"):
            text = table[call.args[0].value] if name == "refused" else ast.unparse(call.args[0])
            yield re.sub(r"\{[^}]*\}", "…", IN_SCRIPTS.sub("", text))


@pytest.mark.parametrize("module", [secondary, io.secondary, copies, resolve])
def test_messages_about_guides_have_no_names_of_arguments(module):
    assert list(messages(module))
    assert [text for text in messages(module) if IDENTIFIER.search(text)] == []


@pytest.mark.parametrize("what", BROKEN)
def test_unusable_guides_are_refused_in_one_sentence(what):
    guides, said = BROKEN[what]
    state = State(choices=STUDY)
    use_guides(state, guides)
    assert state.choices.guides.is_empty
    assert state.guides_draft is guides
    problem = problem_of_guides(replace(STUDY, guides=guides))
    assert said in problem
    assert "\n" not in problem
    for page in ("simulate", "guides"):
        use_guides(state, guides)
        app = opened(page, state).run()
        assert any(said.split()[0] in error.value for error in app.error)
        named(app.button, "guides_keep").click().run()
        assert not app.error
        assert study_of(app.session_state[KEY].choices).secondary is None


def test_simulate_shows_the_given_map_beside_the_e_type():
    state = run(State(choices=replace(STUDY, guides=GuideChoice(STROKES))))
    app = opened("simulate", state).run()
    assert not app.exception
    assert "Given probability of" in html(app)
    plain = run(State(choices=STUDY))
    assert "Given probability of" not in html(opened("simulate", plain).run())


def test_validate_shows_the_given_map_and_its_reliability():
    state = run(State(choices=replace(STUDY, guides=GUIDES)))
    state.page(Validation).unfolded = {"uncertainty"}
    app = opened("validate", state).run()
    assert not app.exception
    assert "Given probability of" in html(app)
    assert "Reliability" in html(app)
    e = state.ensemble
    assert e is not None
    assert e.secondary is not None
    mean = e.secondary.probabilities[1][e.active].mean()
    given = f"given {100 * mean:.1f} %"
    wait_until(lambda: given in html(app.run()), "the headline", every=0.1)
    assert "Match proportions" not in html(app)


TURNED = GuideChoice(angle=Gradient(90.0, -30.0, 30.0), scale=1.2, mirrored="xy")


@pytest.mark.parametrize(
    "guides",
    [TURNED, GuideChoice(angle=45.0), GuideChoice(scale=0.8), GuideChoice(mirrored="x")],
)
def test_a_turned_image_is_in_links_and_projects(guides):
    choices = replace(STUDY, guides=guides)
    assert read_link(link_of(choices)) == (choices, Shown(), ())
    own = secondary_of(choices)
    assert own is not None
    assert own.has_copies
    project = project_of(State(choices=choices))
    again = State()
    open_project(again, Upload("a.ccwsim", project_as_bytes(project)))
    saved = secondary_of(again.choices)
    assert saved is not None
    assert saved.digest == own.digest


def test_an_image_is_turned_from_the_page_by_a_number_or_a_map():
    state = State(choices=STUDY)
    app = guides_page(state, "direction")
    named(app.selectbox, "guides_angle").set_value("one angle").run()
    assert app.session_state[KEY].choices.guides.angle == 45.0
    named(app.number_input, "guides_one_angle").set_value(30.0).run()
    named(app.number_input, "guides_scale").set_value(1.5).run()
    named(app.selectbox, "guides_mirrored").set_value("x").run()
    assert not app.exception
    assert app.session_state[KEY].choices.guides == GuideChoice(angle=30.0, scale=1.5, mirrored="x")
    named(app.selectbox, "guides_angle").set_value("turning across the grid").run()
    assert isinstance(app.session_state[KEY].choices.guides.angle, Gradient)
    of_file = GuideChoice(angle=grid_file(a=np.full(GRID.shape, 20.0)))
    own = secondary_of(replace(STUDY, guides=of_file))
    assert own is not None
    assert (own.angle == 20).all()


def test_validate_measures_directions():
    state = run(State(choices=replace(STUDY, guides=GuideChoice(angle=45.0))))
    state.page(Validation).unfolded = {"uncertainty"}
    app = opened("validate", state).run()
    title = "Difference from the given angles"
    wait_until(lambda: title in html(app.run()), "the directions", every=0.1)
    assert not app.exception


def test_images_and_zones_are_chosen_on_the_page():
    app = guides_page(State(choices=STUDY), "images")
    named(app.selectbox, "guides_other").set_value("stone_wall").run()
    assert not app.exception
    assert not app.error
    assert "1 stone wall" in html(app)
    assert "0 channels" in html(app)
    assert app.session_state[KEY].choices.guides.zones is None
    to_task(app, "zones")
    named(app.selectbox, "guides_zones").set_value("inside outlines").run()
    guides = app.session_state[KEY].choices.guides
    assert guides.images == (WALL,)
    (((west, _), (east, _), *_),) = guides.zones
    assert 42 < west < 46
    assert 74 < east < 78
    to_task(app, "images")
    assert named(app.selectbox, "guides_use").value == "each in its zone"
    named(app.selectbox, "guides_use").set_value("a share of patches").run()
    named(app.slider, "guides_share").set_value(0.2).run()
    own = secondary_of(app.session_state[KEY].choices)
    assert own.weights == pytest.approx((0.8, 0.2))
    named(app.selectbox, "guides_other").set_value("channels").run()
    assert len(app.session_state[KEY].choices.guides.images) == 2
    named(app.button, "guides_drop_1").click().run()
    assert [one.bundled for one in app.session_state[KEY].choices.guides.images] == ["channels"]
    named(app.button, "guides_drop_1").click().run()
    assert app.session_state[KEY].choices.guides == GuideChoice()
    assert not app.exception


@pytest.mark.slow
def test_zones_of_a_volume_are_chosen_by_layer():
    volume = replace(
        STUDY, image=ImageChoice("sinuous_channels"), data=DataChoice(), grid=Grid(24, 20, nz=12),
        parameters=Parameters((4, 8, 8), (1, 2, 2), (0, 1, 1)),
    )  # fmt: skip
    app = guides_page(State(choices=volume), "zones")
    for _ in range(2):
        named(app.selectbox, "guides_other").set_value("sinuous_channels").run()
    assert not app.error
    named(app.selectbox, "guides_zones").set_value("by layer").run()
    assert app.session_state[KEY].choices.guides.zones == ZoneLayers((4, 8))
    named(app.number_input, "guides_layer_1").set_value(6).run()
    assert not app.exception
    assert not app.error
    choices = app.session_state[KEY].choices
    zones = secondary_of(choices).zones
    assert zones.shape == choices.grid.shape
    assert zones[:, 0, 0].tolist() == [0] * 4 + [1] * 2 + [2] * 6
    assert (zones == zones[:, :1, :1]).all()
    named(app.button, "guides_drop_1").click().run()
    assert app.session_state[KEY].choices.guides.zones == ZoneLayers((6,))


def test_zones_by_layer_are_refused_for_a_map():
    layers = GuideChoice(images=(WALL,), zones=ZoneLayers((3,)))
    assert "need a volume" in problem_of_guides(replace(STUDY, guides=layers))


def test_an_image_of_the_user_is_added_and_named_in_the_link():
    cells = np.indices((60, 60)).sum(0) // 6 % 2
    file = grid_file("diagonals.gslib", Grid(60, 60), facies=cells)
    app = guides_page(State(choices=STUDY), "images")
    uploader = named(app.get("file_uploader"), "guides_other_file_0")
    uploader.upload(file.name, file.content).run()
    assert not app.exception
    assert not app.error
    choices = app.session_state[KEY].choices
    (other,) = secondary_of(choices).images
    np.testing.assert_array_equal(other.array, cells)
    assert parts_left_out(choices) == ("the secondary information diagonals.gslib",)


def test_an_image_with_other_facies_is_refused_calmly():
    app = guides_page(State(choices=STUDY), "images")
    named(app.selectbox, "guides_other").set_value("delta").run()
    assert not app.exception
    assert "rename or merge its facies" in app.error[0].value
    assert app.session_state[KEY].choices.guides.is_empty
    named(app.button, "guides_keep").click().run()
    assert not app.error


def test_images_that_are_removed_take_their_outlines_with_them():
    two = replace(ZONED, images=(WALL, ImageChoice("channels")), zones=(EAST, TRIANGLE))
    app = guides_page(State(choices=replace(STUDY, guides=two)), "zones")
    named(app.button, "guides_drop_1").click().run()
    assert app.session_state[KEY].choices.guides.zones == (TRIANGLE,)
    named(app.selectbox, "guides_other").set_value("stone_wall").run()
    guides = app.session_state[KEY].choices.guides
    assert [one.bundled for one in guides.images] == ["channels", "stone_wall"]
    assert guides.zones[0] == TRIANGLE
    assert len(guides.zones) == 2


def test_zones_are_outlines_codes_or_polygons():
    by_outline = secondary_of(replace(STUDY, guides=replace(ZONED, angle=None)))
    codes = np.zeros(GRID.shape)
    codes[:, 40:] = 1
    ring = json.dumps({"type": "Polygon", "coordinates": [EAST]}).encode()
    for file in (grid_file(zone=codes), Upload("zones.geojson", ring)):
        own = secondary_of(replace(STUDY, guides=GuideChoice(images=(WALL,), zones=file)))
        np.testing.assert_array_equal(own.zones, codes)
        assert own.digest == by_outline.digest
    covered = replace(ZONED, images=(WALL, WALL), zones=(EAST, EAST))
    assert set(np.unique(secondary_of(replace(STUDY, guides=covered)).zones)) == {0, 2}
    wrong = GuideChoice(images=(WALL,), zones=grid_file(zone=2 * codes))
    assert "2 is not the number of an image" in problem_of_guides(replace(STUDY, guides=wrong))


def test_lines_turn_the_image_and_are_drawn_by_hand_or_read_from_a_file():
    state = State(choices=replace(STUDY, guides=GuideChoice(angle=(), flow_azimuth=90.0)))
    assert study_of(state.choices).secondary is None  # nothing is drawn yet
    lines = [[list(point) for point in line] for line in FLOW]
    take_drawing(state, {"strokes": False, "outlines": {}, "flow": lines})
    assert state.choices.guides.angle == FLOW
    angle = secondary_of(state.choices).angle
    assert abs(angle[15, 70] - 270) < 4  # the east of the image is turned to the north
    app = guides_page(state)
    assert any("azimuth 90° of the image" in note.value for note in app.caption)
    named(app.number_input, "guides_one_flow_azimuth").set_value(0.0).run()
    assert app.session_state[KEY].choices.guides.flow_azimuth == 0.0
    geometry = {"type": "MultiLineString", "coordinates": lines}
    named(app.get("file_uploader"), "guides_angle_file").upload(
        "flow.geojson", json.dumps(geometry).encode()
    ).run()
    assert app.session_state[KEY].choices.guides.angle == FLOW


def test_chosen_lines_begin_with_the_direction_of_the_bodies():
    rows = np.tile([[0], [0], [0], [1], [1], [1]], (12, 72))
    file = BytesIO()
    write_maps(file, {"facies": rows.astype(float)}, Grid(72, 72), format="gslib")
    image = ImageChoice(upload=Upload("rows.gslib", file.getvalue()))
    app = guides_page(State(choices=replace(STUDY, image=image)), "direction")
    named(app.selectbox, "guides_angle").set_value("along drawn lines").run()
    assert not app.exception
    guides = app.session_state[KEY].choices.guides
    assert (guides.angle, guides.flow_azimuth) == ((), 90.0)


def test_a_project_keeps_images_zones_and_lines():
    choices = replace(STUDY, guides=ZONED, n_realizations=1)
    other = State()
    content = project_as_bytes(project_of(State(choices=choices)))
    open_project(other, Upload("study.ccwsim", content))
    assert same_realizations(other.choices, choices)
    app = guides_page(State(choices=other.choices))
    assert "2 training images by zone, angle" in html(app)
    assert not [button for button in app.button if "guides_drop" in (button.key or "")]


def test_a_link_names_an_uploaded_image():
    file = grid_file("wall.gslib", Grid(40, 40), facies=np.indices((40, 40)).sum(0) // 5 % 2)
    choices = replace(STUDY, guides=GuideChoice(images=(ImageChoice(upload=file), WALL)))
    assert parts_left_out(choices) == ("the secondary information wall.gslib",)
    assert read_link(link_of(choices), own_choices(choices))[0] == choices
    other = grid_file("wall.gslib", Grid(40, 40), facies=np.indices((40, 40)).sum(0) // 4 % 2)
    changed = replace(STUDY, guides=GuideChoice(images=(ImageChoice(upload=other), WALL)))
    assert changed.guides.digest != choices.guides.digest
    assert secondary_of(changed).digest != secondary_of(choices).digest


def test_turned_realizations_are_not_judged_by_the_image_as_it_was_read():
    grid, data = Grid(512, 512), DataChoice("bundled", "channels_60_wells")
    choices = replace(STUDY, grid=grid, data=data, guides=GuideChoice(angle=90.0))
    state = run(State(choices=choices))
    state.page(Validation).unfolded = {"bodies", "fit"}
    app = opened("validate", state).run()
    wait_until(lambda: "realizations differ in" in html(app.run()), "the variety", every=0.1)
    assert not app.exception
    assert html(app).count("the first image as it was read") == 2  # one for the data
    assert 'class="checks"' not in html(app)
    assert not re.search("checks? (fit|differ)", html(app))
    assert "Your data" not in html(app)


def test_validate_compares_each_zone_with_its_own_image():
    state = run(State(choices=replace(STUDY, guides=ZONED)))
    state.page(Validation).unfolded = {"uncertainty"}
    app = opened("validate", state).run()
    wait_until(lambda: "nearest other" in html(app.run()), "the zones", every=0.1)
    headline = "zone 0: patterns are nearer to stone wall"
    wait_until(lambda: headline in html(app.run()), "the headline", every=0.1)
    assert not app.exception
    table = html(app).split("nearest other")[1].split("</table>")[0]
    assert "0 channels" in table
    assert "1 stone wall" in table
    assert "the first image as it was read" in html(app)
    assert "checks fit" not in html(app)
    found = zones(state.ensemble).work(lambda share: None)
    assert [fit.number for fit in found] == [0, 1]
    for k, size, shares, of_image, far in found:
        inside = secondary_of(state.choices).zones == k
        assert size == pytest.approx(inside.mean())
        cells = state.ensemble.indices[:, inside]
        np.testing.assert_allclose(shares[:, 1], (cells == 1).mean(axis=1))
        image = (
            study_of(state.choices).secondary.images[0]
            if k
            else study_of(state.choices).training_image
        )
        np.testing.assert_allclose(of_image, image.proportions)
        assert len(far) == 2
    near = [found[0]._replace(far=found[1].far[::-1]), found[1]]
    (verdict,) = describe_zones(near, ["channels", "stone wall"])
    assert verdict.good
    assert verdict.words == "patterns of all 2 zones are nearest to their own images"
    plain = found[0][-1], found[1][-1]
    assert plain[1][1] < plain[1][0]  # the wall is nearest to the wall


@pytest.mark.parametrize("guides", [GuideChoice(Gradient()), ZONED, GUIDES])
def test_guides_beyond_the_free_memory_are_refused_before_their_maps_are_made(monkeypatch, guides):
    """Test that a link cannot fill the memory with maps of the largest grid that pages offer."""
    monkeypatch.setattr(limits, "free_memory", lambda: limits.RESERVE + 2 * 10**9)
    link = link_of(replace(STUDY, grid=Grid(10_000, 10_000), guides=guides))
    choices, _, notes = read_link({name: [*values] for name, values in link.items()})
    assert not notes
    assert choices.guides == guides
    tracemalloc.start()
    with pytest.raises(CCWSIMError, match=r"on this grid, but 2\.0 GB are free"):
        secondary_of(choices)
    assert tracemalloc.get_traced_memory()[1] < 10**7
    tracemalloc.stop()
