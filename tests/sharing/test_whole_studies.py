"""Test that projects and links keep each choice of random studies, and so cells and pages."""

from __future__ import annotations

from functools import cache
from io import BytesIO

import pytest

from ccwsim import Ensemble, simulate
from ccwsim.model.study import Study
from ccwsim.sharing.choices import Choices, GuideChoice, Shown
from ccwsim.sharing.link import link_of, own_choices, parts_left_out, read_link
from ccwsim.sharing.project import Project, project_as_bytes, read_project
from ccwsim.ui.session.address import show, shown_of
from ccwsim.ui.session.resolve import data_of, image_of, study_of, wells_of
from ccwsim.ui.session.state import State
from ccwsim.ui.share.menu import choices_of, project_of
from tests.sharing.random_choices import changed_in, fields_in, random_study
from tests.sharing.test_link import as_address
from tests.some import some
from tests.ui.widgets import html, opened, texts

NUMBERS = range(30)
WITH_FILES = [random_study(number, files=True) for number in NUMBERS]
WITHOUT = [random_study(number, files=False) for number in NUMBERS]
OF_SCRIPTS = {("GuideChoice", "saved")}  # guides of a project that a script has saved


def state_of(choices: Choices, shown: Shown) -> State:
    state = State(choices=choices)
    show(state, shown)
    return state


def sent(choices: Choices, shown: Shown) -> Project:
    """Return the project of a study after it was saved and read."""
    content = project_as_bytes(project_of(state_of(choices, shown)))
    return read_project(BytesIO(content))


def cells_of(study: Study) -> str:
    inputs = study.training_image, study.grid, study.parameters, study.hard_data
    return simulate(*inputs, seed=study.seed, secondary=study.secondary).digest


def test_random_studies_have_each_field_of_choices():
    """A new field needs a value in `random_choices.py`, so that links and projects are tested."""
    wanted = {*fields_in(Choices), *fields_in(Shown)} - OF_SCRIPTS
    wanted = {(kind, name) for kind, name in wanted if kind not in ("Secondary", "Auxiliary")}
    given = {*changed_in(tuple(WITH_FILES)), *changed_in(tuple(WITHOUT))}
    assert not wanted - given


@pytest.mark.parametrize("number", NUMBERS)
def test_a_project_keeps_each_choice(number):
    choices, shown = WITH_FILES[number]
    project = sent(choices, shown)
    again, seen = choices_of(project)
    assert (again, seen) == (choices, shown_of(state_of(choices, shown)))
    assert project.study.training_image.facies_names == image_of(choices.image).facies_names


@pytest.mark.parametrize("number", some(NUMBERS, [1, 5]))
def test_a_project_keeps_the_cells(number):
    choices, shown = WITH_FILES[number]
    project = sent(choices, shown)
    assert cells_of(project.study) == cells_of(study_of(choices))
    assert project.simulate(1).digest == cells_of(study_of(choices_of(project)[0]))


def test_a_link_keeps_each_choice():
    """Test links without files, and links with files in the browser of the sender."""
    for choices, shown in WITHOUT:
        assert not parts_left_out(choices)
        assert read_link(as_address(link_of(choices, shown))) == (choices, shown, ())
    for choices, shown in WITH_FILES:
        query = as_address(link_of(choices, shown))
        assert read_link(query, own_choices(choices)) == (choices, shown, ())


@pytest.mark.parametrize("number", some(NUMBERS, [2]))
def test_a_link_keeps_the_cells(number):
    choices, shown = WITHOUT[number]
    again, _, _ = read_link(as_address(link_of(choices, shown)))
    assert cells_of(study_of(again)) == cells_of(study_of(choices))


def test_a_project_keeps_wells_outside_and_their_names():
    of_files = [study for study, _ in WITH_FILES if study.data.source == "file"]
    masked = [study for study in of_files if study_of(study).inactive_data.n]
    assert masked
    for choices in masked:
        again, _ = choices_of(sent(choices, Shown()))
        assert data_of(again).n > study_of(again).hard_data.n
        assert wells_of(again) == wells_of(choices)
        assert again.data.upload.name == choices.data.upload.name
        assert again.guides != GuideChoice()


@cache
def ensemble_of(number: int) -> Ensemble:
    choices, _ = WITH_FILES[number]
    study, n = study_of(choices), choices.n_realizations
    inputs = study.training_image, study.grid, study.parameters, study.hard_data
    return simulate(*inputs, n, study.seed, secondary=study.secondary, n_workers=1)


def page_of(name: str, choices: Choices, shown: Shown, ensemble: Ensemble) -> str:
    """Return the texts and fields of a page with the results `ensemble`."""
    state = state_of(choices, shown)
    state.ensemble, state.ensemble_choices, state.last_attempt = ensemble, choices, choices
    app = opened(name, state).run()
    assert not app.exception
    kinds = app.number_input, app.selectbox, app.slider, app.select_slider, app.button_group
    values = [(field.label, field.value) for kind in kinds for field in kind]
    labels = [button.label for button in app.button]
    return f"{html(app)} {texts(app)} {values} {labels}"


@pytest.mark.slow
@pytest.mark.parametrize("name", ["simulate", "guides", "flow", "import"])
@pytest.mark.parametrize("number", [1, 2, 3, 4, 5])
def test_pages_of_a_project_are_those_of_the_study(name, number):
    choices, shown = WITH_FILES[number]
    opened_study = choices_of(sent(choices, shown))
    ensemble = ensemble_of(number)
    assert page_of(name, *opened_study, ensemble) == page_of(name, choices, shown, ensemble)
