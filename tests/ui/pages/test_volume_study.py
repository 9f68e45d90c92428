"""Test a study of a volume: set up, run, show, download, and open again."""

from __future__ import annotations

import re
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from urllib.parse import parse_qs, urlencode

import numpy as np
import pytest
from PIL import Image
from streamlit.testing.v1 import AppTest

from ccwsim import Grid, Parameters, TrainingImage, datasets
from ccwsim.io import read_realizations, training_image_as_bytes
from ccwsim.model.parameters import fitted
from ccwsim.model.sizes import overlap_sizes, template_sizes
from ccwsim.report.document import report_html
from ccwsim.sharing.choices import Choices, DataChoice, ImageChoice, Shown, Upload
from ccwsim.sharing.link import link_of, read_link
from ccwsim.sharing.project import project_as_bytes
from ccwsim.sharing.recipe import reproduction_recipe
from ccwsim.sharing.study_report import study_report
from ccwsim.ui.page import OFF_MENU, PAGES
from ccwsim.ui.session.resolve import data_of, grids_for_data, image_of, study_of
from ccwsim.ui.session.state import KEY, State
from ccwsim.ui.share.menu import open_project, project_of
from ccwsim.ui.simulate.results import download_groups, go_back
from ccwsim.ui.study.data_step import problem_of_data, use_data
from ccwsim.ui.study.image_step import image_thumbnail, import_image, use_image
from ccwsim.ui.study.run import collect, demand_of_run, estimated_seconds, start_run, study_problem
from tests.some import some
from tests.ui.widgets import PAGES as FOLDER, html, named, open_menus, opened, texts

SIZES = Parameters((8, 16, 16), (2, 4, 4), (1, 1, 1))
VOLUME = Choices(
    ImageChoice("sinuous_channels"),
    DataChoice(),
    Grid(30, 40, nz=12),
    SIZES,
    n_realizations=2,
)
COLOURS = ["#111111", "#eeeeee"]


def finished(state: State) -> State:
    """Return the state after its run."""
    start_run(state)
    assert state.job is not None, state.message
    assert state.job.wait(120)
    collect(state)
    assert state.ensemble is not None, state.message
    return state


@pytest.fixture(scope="module")
def ran() -> State:
    """Return the page of a small volume with its results."""
    return finished(State(choices=VOLUME))


def at_rest(app: AppTest) -> AppTest:
    """Return the page after its run, and check that there is no exception."""
    app.run()
    job = app.session_state[KEY].job
    if job is not None:
        assert job.wait(120)
        app.run()
    assert not app.exception
    return app


def test_a_bundled_volume_is_chosen_run_and_shown() -> None:
    app = at_rest(opened("simulate", State(choices=replace(VOLUME, image=ImageChoice("channels"),
        grid=Grid(32, 32), parameters=Parameters(template_size=16, overlap_size=4)))))  # fmt: skip
    named(app.selectbox, "image_bundled").set_value("sinuous_channels").run()
    state = app.session_state[KEY]
    assert state.choices.grid.shape == (48, 100, 100)
    assert state.choices.parameters.template_size == (8, 16, 16)
    named(app.number_input, "grid_nx").set_value(40).run()
    named(app.number_input, "grid_ny").set_value(30).run()
    named(app.number_input, "grid_nz").set_value(12).run()
    named(app.selectbox, "template_size_z").set_value(12).run()
    assert state.choices.parameters.template_size == (12, 16, 16)
    named(app.button, "run").click()
    at_rest(app)
    ensemble = app.session_state[KEY].ensemble
    assert ensemble.grid.shape == (12, 30, 40)
    assert ensemble.parameters.template_size[0] == 12
    said = html(app)
    assert "160 × 160 × 48" in said
    assert "Realization 1 of 2" in said
    assert "Training image" in said
    assert not texts(app)


def test_a_map_chosen_after_a_volume_is_a_map_again() -> None:
    state = State(choices=replace(Choices(), data=DataChoice()))
    use_image(state, ImageChoice("stacked_lenses"))
    assert state.choices.parameters.template_size == (16, 32, 32)
    assert not study_problem(state)
    use_image(state, ImageChoice("channels"))
    assert state.choices == replace(Choices(), data=DataChoice())


@pytest.mark.parametrize("nz", [1, 2, 3, 4, 5, 7, 9, 48])
def test_sizes_of_thin_volumes_are_legal(nz: int) -> None:
    for level in range(4):
        p = fitted(Parameters(), (nz, 40, 50), wavelet_level=level)
        assert p.template_size[0] <= nz
        assert p.template_size[1:] == (32, 32)
        assert fitted(p, (nz, 40, 50)) == p
        for template in template_sizes(p.level[0], (nz, 40, 50), along_z=True):
            for overlap in overlap_sizes(p.level[0], template, along_z=True):
                Parameters((template, 32, 32), (overlap, 8, 8), p.wavelet_level)


def test_a_thin_volume_runs() -> None:
    image = datasets.load("folded_layers").array[:2, :40, :40]
    content = BytesIO()
    np.save(content, image)
    choice = ImageChoice(upload=Upload("thin.npy", content.getvalue()), answers=(("volume", True),))
    state = State(choices=replace(VOLUME, grid=Grid(20, 20, nz=2)))
    use_image(state, choice)
    assert state.choices.image == choice
    assert finished(state).ensemble.indices.shape == (2, 2, 20, 20)


def test_a_template_larger_than_the_image_along_z_is_said(ran: State) -> None:
    state = State(choices=replace(VOLUME, parameters=replace(SIZES, template_size=(64, 16, 16))))
    assert "Template 64 along z is larger than the training image" in study_problem(state)
    app = opened("simulate", state).run()
    assert not app.exception
    assert named(app.button, "run").disabled


@pytest.mark.slow
def test_methods_and_a_vertical_trend_are_set_for_a_volume(ran: State) -> None:
    state = State(
        choices=VOLUME, ensemble=ran.ensemble, ensemble_choices=VOLUME, last_attempt=VOLUME
    )
    app = opened("simulate", state).run()
    named(app.checkbox, "p_vertical_trend").set_value(True).run()
    assert state.choices.parameters.location_weight == (0.5, 0.0, 0.0)
    named(app.slider, "p_location_weight").set_value(3.0).run()
    assert state.choices.parameters.location_weight == (3.0, 0.0, 0.0)
    named(app.checkbox, "p_vertical_trend").set_value(False).run()
    assert state.choices.parameters.location_weight == 3.0
    named(app.selectbox, "wavelet_level").set_value(2).run()
    assert state.choices.parameters.wavelet_level == (1, 2, 2)
    for method in ("ccsim", "ms-ccsim", "ccwsim"):
        named(app.selectbox, "p_method").set_value(method).run()
        assert not app.exception
        assert state.choices.parameters.method == method
        assert not study_problem(state)
    named(app.number_input, "grid_cell_size_z").set_value(0.5).run()
    assert state.choices.grid.cell_size == (1.0, 1.0, 0.5)
    assert not app.exception


def test_all_cells_count() -> None:
    state = State(choices=VOLUME)
    assert demand_of_run(state.choices).n_cells == 12 * 30 * 40 * 2
    more = replace(VOLUME, grid=replace(VOLUME.grid, nz=24))
    assert estimated_seconds(more) > estimated_seconds(VOLUME) > 0


@pytest.mark.slow
def test_wells_of_a_volume_are_honoured_and_their_grid_is_taken() -> None:
    state = State(choices=VOLUME)
    use_data(state, DataChoice("bundled", "sinuous_channels_10_wells"))
    assert state.choices.grid.shape == (48, 100, 100)
    assert data_of(state.choices).n == 480
    table = b"x,y,z,facies\n3.5,4.5,1.5,1\n30.5,20.5,11.5,0\n"
    state = State(choices=VOLUME)
    use_data(state, DataChoice("file", upload=Upload("wells.csv", table)))
    assert not problem_of_data(state.choices)
    assert data_of(state.choices).n == 2
    assert not finished(state).ensemble.n_mismatched.any()


def test_wells_outside_the_volume_are_listed_and_a_grid_that_holds_them_is_offered() -> None:
    table = b"x,y,z,facies\n3.5,4.5,1.5,1\n3.5,4.5,19.5,0\n"
    draft = DataChoice("file", upload=Upload("wells.csv", table))
    state = State(choices=VOLUME, data_draft=draft, ensemble_choices=VOLUME, last_attempt=VOLUME)
    fitting = grids_for_data(replace(VOLUME, data=draft)).get("fit")
    assert fitting is not None
    assert data_of(replace(VOLUME, data=draft, grid=fitting)).n == 2
    for page in ("simulate", "import"):
        app = opened(page, replace(state)).run()
        if page == "import":
            app.button_group(key="import_subject").set_value("data").run()
        assert not app.exception
        assert "1 of 2 data outside the grid" in texts(app) + str(app.selectbox)


def test_downloads_have_the_same_cells(ran: State) -> None:
    ensemble = ran.ensemble
    groups = download_groups(ensemble, COLOURS, 0, 1)
    files = {file.key: file for group in groups.values() for file in group}
    assert "realizations_tif" not in files
    assert "realizations_png" not in files
    for kind in ("npz", "gslib", "vti"):
        content = BytesIO(files[f"realizations_{kind}"].content())
        content.name = f"a.{kind}"
        read = read_realizations(content, training_image=ensemble.training_image)
        assert (read.realizations == ensemble.realizations).all(), kind
        assert files[f"etype_{kind}"].content()
    assert all(file.content() for file in files.values())


def test_a_link_opens_the_same_study() -> None:
    weights = replace(SIZES, location_weight=(2.0, 0.0, 0.0))
    world = Grid(30, 40, (10.0, 10.0, 0.5), (100.0, 0.0, -20.0), nz=12)
    wells = DataChoice("bundled", "stacked_lenses_10_wells")
    for choices in (
        VOLUME,
        replace(VOLUME, parameters=weights, grid=world),
        replace(VOLUME, image=ImageChoice("stacked_lenses", flip_ns=True), data=wells),
    ):
        query = parse_qs(urlencode(link_of(choices), doseq=True))
        again, _, notes = read_link(query)
        assert again == choices
        assert not notes


def test_data_of_a_volume_are_carried_by_a_link() -> None:
    data = replace(
        DataChoice("placed"), placed=datasets.load_hard_data("sinuous_channels_10_wells")
    )
    few = replace(data, placed=type(data.placed)(data.placed.cells[:40], data.placed.facies[:40]))
    choices = replace(VOLUME, data=few)
    again, _, notes = read_link(link_of(choices))
    assert not notes
    assert again.data.placed.digest == few.placed.digest


@pytest.mark.slow
def test_a_link_with_a_volume_alone_opens_its_usual_study() -> None:
    app = opened("simulate")
    app.query_params["ti"] = "sinuous_channels"
    app.query_params["realizations"] = "1"
    app.run()
    state = app.session_state[KEY]
    assert not app.exception
    assert not state.notes
    assert state.choices.grid.shape == (48, 100, 100)
    assert state.choices.parameters.template_size == (16, 32, 32)
    if state.job is not None:
        state.job.cancel()


@pytest.mark.slow
@pytest.mark.parametrize("query", some(["grid=10x10x10", "template=8x8x8",
    "ti=folded_layers&grid=9x9", "ti=folded_layers&cell=1x1", "cell=1x1x1",
    "ti=folded_layers&template=8x8x900"], always=["template=8x8x8", "ti=folded_layers&grid=9x9"])
)  # fmt: skip
def test_a_link_that_does_not_go_together_is_said_and_runs(query: str) -> None:
    app = opened("simulate")
    for name, values in parse_qs(query).items():
        app.query_params[name] = values[-1]
    app.run()
    state = app.session_state[KEY]
    assert not app.exception
    assert not study_problem(state)
    if state.job is not None:
        state.job.cancel()


@pytest.mark.slow
def test_a_project_opens_the_same_study(ran: State) -> None:
    for image in (VOLUME.image, ImageChoice("sinuous_channels", names=("a", "b"))):
        saved = State(choices=replace(VOLUME, image=image))
        upload = Upload("a.ccwsim", project_as_bytes(project_of(saved)))
        state = State()
        open_project(state, upload)
        assert state.job is not None
        assert state.job.wait(120)
        collect(state)
        assert (state.ensemble.realizations == ran.ensemble.realizations).all()
        assert state.choices.grid == VOLUME.grid


def test_the_script_gives_the_same_cells(ran: State, tmp_path: Path, monkeypatch) -> None:
    recipe = reproduction_recipe(VOLUME, study_of(VOLUME), "a.ccwsim")
    monkeypatch.chdir(tmp_path)
    found: dict = {}
    exec(recipe.python, found)
    assert (found["e"].realizations == ran.ensemble.realizations).all()
    assert "--grid 40x30x12 --template 16x16x8" in recipe.command


def sgems(image: np.ndarray) -> bytes:
    """Return a volume as an SGeMS file."""

    return training_image_as_bytes(TrainingImage(image), "sgems")


@pytest.mark.parametrize("before", ["volume", "map"])
def test_an_uploaded_volume_is_taken_whole_and_one_layer_may_be(before: str) -> None:
    array = datasets.load("sinuous_channels").array[:20, :40, :50]
    study = VOLUME if before == "volume" else Choices()
    state = State(choices=replace(study, data=DataChoice()))
    import_image(state, Upload("volume.sgems", sgems(array)))
    assert state.image_draft is not None
    app = opened("import", state).run()
    assert not app.exception
    assert "All 20 layers are used as a volume. For a map, choose “one layer”." in html(app)
    assert (image_of(app.session_state[KEY].image_draft).array == array).all()
    named(app.button_group, "ask_layers").set_value("one layer").run()
    assert not app.exception
    assert "Layer 11 of 20 is used as a map. For all layers, choose “the whole volume”" in html(app)
    assert (image_of(app.session_state[KEY].image_draft).array == array[10]).all()
    named(app.slider, "ask_slice").set_value(3).run()
    assert (image_of(app.session_state[KEY].image_draft).array == array[2]).all()
    named(app.button_group, "ask_layers").set_value("the whole volume").run()
    named(app.button, "image_take").click().run()
    assert not app.exception
    assert (image_of(app.session_state[KEY].choices.image).array == array).all()


def test_arrays_are_asked_which_layer_is_the_bottom() -> None:
    array = datasets.load("sinuous_channels").array[:20, :40, :50]
    content = BytesIO()
    np.save(content, array)
    upload = Upload("volume.npy", content.getvalue())
    top_first = ImageChoice(upload=upload, answers=(("volume", True), ("z_up", False)))
    state = State(choices=VOLUME, image_draft=top_first)
    app = opened("import", state).run()
    assert not app.exception
    assert named(app.selectbox, "ask_z_up")
    assert (image_of(top_first).array == array[::-1]).all()


def test_a_file_whose_layers_count_from_the_top_asks_if_this_is_right() -> None:
    array = datasets.load("sinuous_channels").array[:20, :40, :50]
    content = training_image_as_bytes(TrainingImage(array), "grdecl")
    upload = Upload("volume.grdecl", content)
    state = State(
        choices=VOLUME, image_draft=ImageChoice(upload=upload, answers=(("volume", True),))
    )
    app = opened("import", state).run()
    question = named(app.selectbox, "ask_z_up")
    assert question.value is False  # the first layer of the file is the top
    question.set_value(True).run()
    assert not app.exception
    assert (image_of(app.session_state[KEY].image_draft).array == array[::-1]).all()


@pytest.mark.slow
@pytest.mark.parametrize("path", [path for _, path in (*PAGES, *OFF_MENU)])
def test_every_page_takes_a_volume_calmly(path: str, ran: State) -> None:
    state = State(
        choices=VOLUME, ensemble=ran.ensemble, ensemble_choices=VOLUME, last_attempt=VOLUME
    )
    app = open_menus(AppTest.from_file(str(FOLDER.parent / path), default_timeout=180))
    app.session_state[KEY] = state
    app.run()
    assert not app.exception
    assert not app.error
    assert app.session_state[KEY].choices.image == VOLUME.image


def test_earlier_runs_of_maps_and_volumes_are_gone_back_to(ran: State) -> None:
    state = State(choices=replace(VOLUME, seed=5), runs=ran.runs)
    finished(state)
    app = opened("simulate", state).run()
    assert not app.exception
    assert len(state.runs.runs) == 2
    go_back(state, state.runs.runs[1].key)
    assert state.ensemble is ran.ensemble
    assert state.choices == VOLUME


@pytest.mark.slow
def test_a_report_of_a_volume_says_which_slices_it_shows_and_judges_all_axes(ran: State) -> None:
    assert ran.ensemble is not None
    how = reproduction_recipe(VOLUME, study_of(VOLUME), "a.ccwsim")
    document = study_report(ran.ensemble, VOLUME, Shown(), COLOURS, ["done"], "?", how)
    page = report_html(document)
    assert "40 × 30 × 12 cells" in page
    assert "slices through the middle, counted from the bottom, south and west" in page
    assert "Realization 1, layer 6, from the bottom" in page
    charts = (f"{way}: " in page for way in ("E–W", "N–S", "vertical"))
    assert all(charts), re.findall(r"Variogram of [^<]*", page)


def test_the_thumbnail_of_a_volume_shows_its_fullest_layer() -> None:
    cells = np.zeros((5, 12, 12), int)
    cells[0, 3:9, 3:9] = 1  # the middle layer is empty
    picture = Image.open(BytesIO(image_thumbnail(TrainingImage(cells), COLOURS))).convert("RGB")
    colours = picture.getcolors()
    assert colours is not None
    assert len(colours) == 2
