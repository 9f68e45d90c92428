"""Test that the address contains the study on every page, and that the menu opens projects."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from streamlit.testing.v1 import AppTest

from ccwsim import Grid, HardData, Parameters, TrainingImage, read_project
from ccwsim.io import training_image_as_bytes
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.study import Study
from ccwsim.sharing.choices import Choices, DataChoice, ImageChoice, Upload
from ccwsim.sharing.link import own_choices
from ccwsim.sharing.project import Project, project_as_bytes
from ccwsim.ui.page import OFF_MENU, PAGES
from ccwsim.ui.session.resolve import image_of
from ccwsim.ui.session.state import KEY, State
from ccwsim.ui.share.menu import choices_of, file_name, open_project, project_of, report_of
from ccwsim.ui.study.run import collect, start_run
from ccwsim.ui.widgets.text import plain
from tests.ui.test_pages import ROOT, SMALL, launched, settled, texts
from tests.ui.widgets import named, open_menus

QUERY = {"ti": "dunes", "data": "none", "grid": "64x48", "template": "16", "overlap": "4"}
QUERY |= {"realizations": "2", "seed": "7", "show": "2"}
PARAMETERS = Parameters(template_size=16, overlap_size=4)
ADDRESSED = Choices(ImageChoice("dunes"), DataChoice(), Grid(48, 64), PARAMETERS, 2, 7)


def addressed(path: str = "pages/simulate.py", **query: str | list[str]) -> AppTest:
    """Return a page opened in a new session by its address."""
    app = open_menus(AppTest.from_file(str(ROOT / path), default_timeout=120))
    app.query_params.update({**QUERY, **query})
    return app.run()


@pytest.mark.slow
@pytest.mark.parametrize("path", [path for _, path in (*PAGES, *OFF_MENU)])
def test_every_page_starts_a_study_from_its_address(path):
    app = addressed(path)
    assert not app.exception
    assert app.session_state[KEY].choices == ADDRESSED
    assert app.session_state[KEY].notes == ()
    written = QUERY.keys() - {"data"}  # the image has no data of its own, so "none" is the default
    assert {name: app.query_params[name] for name in written} == {n: QUERY[n] for n in written}


def test_a_changed_setting_is_in_the_address_at_once():
    app = settled(addressed())
    app.session_state[KEY].live = False
    named(app.number_input, "seed").set_value(8).run()
    assert app.query_params["seed"] == "8"
    named(app.number_input, "seed").set_value(0).run()
    assert "seed" not in app.query_params
    state = app.session_state[KEY]
    assert (state.shown, state.ensemble.seed) == (1, 7)


def test_an_address_that_is_wrong_in_part_is_said_and_the_rest_is_taken():
    app = addressed(template="17", colour=["0-112233", "x"], utm="a")
    said = texts(app)
    assert "Template 17 must be a multiple of 4" in said
    assert "colour" in said
    state = app.session_state[KEY]
    assert state.choices.image.colours == ((0, "#112233"),)
    assert state.choices.seed == 7
    assert app.query_params["utm"] == "a"
    assert "template" not in app.query_params
    named(app.button, "told_close").click().run()
    assert "Template" not in texts(app)


def test_parts_that_do_not_go_together_are_corrected_in_words():
    app = addressed(template="512", data="channels_400_data")
    assert "Template 512 and overlap 4 do not suit the training image" in texts(app)
    assert "The hard data are ignored" in texts(app)
    state = app.session_state[KEY]
    assert state.choices.parameters.template_size == 256
    assert state.choices.data == DataChoice()


def test_a_link_waits_for_the_files_of_its_sender_and_then_runs():
    image = ImageChoice(
        upload=Upload("<own>.npy", training_image_as_bytes(TrainingImage(np.eye(40)), "npy"))
    )
    (name,) = own_choices(replace(SMALL, image=image))
    app = addressed(ti=name)
    state = app.session_state[KEY]
    assert (state.job, state.ensemble) == (None, None)
    assert "choose again: " in texts(app)
    assert texts(app).count(plain("<own>.npy")) == 2
    assert app.query_params["ti"] == name
    named(app.number_input, "seed").set_value(8).run()
    assert (state.job, state.ensemble) == (None, None)
    assert app.query_params["ti"] == name  # a reload asks again
    state.change(image=image)
    settled(app.run())
    assert app.session_state[KEY].ensemble.training_image.name == "<own>"
    assert "choose again: " not in texts(app)


def test_a_link_runs_without_the_files_of_its_sender_if_the_user_wants_to():
    app = addressed(ti="own-1a-wall.tif")
    named(app.button, "run").click()
    settled(app.run())
    assert app.session_state[KEY].ensemble.training_image.name == "channels"
    assert "ti" not in app.query_params


def test_a_project_of_a_script_keeps_names_with_slashes():
    image = TrainingImage(np.eye(40), name="aquifer/upper v1.2", facies_names=["a/b", "c"])
    project = Project(Study(image, Grid(20, 20), PARAMETERS))
    again = image_of(choices_of(project)[0].image)
    assert (again.name, again.facies_names) == (image.name, image.facies_names)


def test_a_note_is_shown_as_it_is():
    assert plain("<b>*a*</b> [x](y)") == r"\<b>\*a\*\</b> \[x\](y)"


def an_own_study() -> State:
    image = TrainingImage(np.kron(np.eye(20, dtype=int) * 9, np.ones((2, 3), int)), name="wall")
    data = HardData([[k // 8 * 4, k % 8 * 7] for k in range(60)], np.arange(60) % 2 * 9)
    upload = Upload("wall.npy", training_image_as_bytes(image, "npy"))
    named = {"names": ("a", "b"), "colours": ((9, "#112233"),)}
    chosen = ImageChoice(upload=upload, flip_ew=True, **named)
    choices = Choices(chosen, DataChoice("placed", placed=data), Grid(48, 64), PARAMETERS, 2, 5)
    return State(choices=choices, shown=1)


def ran(state: State) -> State:
    if state.job is None:
        start_run(state)
    assert state.job is not None
    assert state.job.wait(120)
    collect(state)
    assert state.message == ""
    return state


@pytest.mark.slow
def test_a_project_opened_in_another_session_gives_the_same_numbers():
    before, after = ran(an_own_study()), State()
    content = project_as_bytes(project_of(before))
    assert file_name(before.choices) == "wall.ccwsim"
    open_project(after, Upload("wall.ccwsim", content))
    ran(after)
    assert before.ensemble is not None
    assert after.ensemble is not None
    assert after.ensemble.digest == before.ensemble.digest
    assert after.ensemble.training_image.facies_names == ("a", "b")
    assert after.choices.image.colours == ((9, "#112233"),)
    assert after.shown == 1
    page = launched(after.choices)
    assert page.session_state[KEY].ensemble.digest == before.ensemble.digest


def test_a_project_that_cannot_be_opened_leaves_the_study(tmp_path):
    state, choices = State(), Choices()
    large = Project(Study(TrainingImage(np.eye(40)), Grid(2, 20_000)))
    layers = TrainingImage(np.arange(40 * 40 * 40).reshape(40, 40, 40) % 2)
    volume = Project(Study(layers, Grid(2, 2, nz=20_000), Parameters((8, 16, 16), (2, 4, 4), 1)))
    for content, said in (
        (b"no", "is not a project"),
        (project_as_bytes(volume), "20000 cells along a side"),
        (project_as_bytes(large), "command line|--proj"),
    ):
        with pytest.raises(CCWSIMError, match=said):
            open_project(state, Upload("a.ccwsim", content))
    assert state.choices == choices
    assert state.job is None


def test_a_project_of_another_version_is_opened_with_a_word():
    state = State()
    project = replace(project_of(an_own_study()), versions={"Program": "ccwsim 9.9"})
    open_project(state, Upload("a.ccwsim", project_as_bytes(project)))
    assert "saved with ccwsim 9.9" in state.notes[0]
    ran(state)


def test_the_open_menu_has_all_that_can_be_taken_away():
    app = launched()
    app.session_state["share"] = True
    app.run()
    assert not app.exception
    codes = [code.value for code in app.code]
    assert codes[0].startswith("?data=none")
    assert "import ccwsim" in codes[1]
    assert codes[2].startswith("python -m ccwsim simulate channels --grid 64x48")
    assert not texts(app)


@pytest.mark.slow
def test_the_report_is_of_the_results_and_not_of_what_was_changed_since():
    state = ran(State(choices=SMALL))
    state.change(seed=99)
    page = report_of(state)().decode()
    assert "seed=0" in page
    assert "seed=99" not in page
    assert state.ensemble is not None
    assert state.ensemble.digest in page
    project = read_project_of(state)
    assert (project.study.seed, project.digest) == (99, "")


def read_project_of(state: State) -> Project:
    from io import BytesIO

    return read_project(BytesIO(project_as_bytes(project_of(state))))
