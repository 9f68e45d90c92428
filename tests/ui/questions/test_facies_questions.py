"""Test that pages ask which facies of an image the numbers in other files are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ccwsim import Grid, HardData, datasets
from ccwsim.sharing.choices import Choices, DataChoice, GuideChoice, ImageChoice, Upload
from ccwsim.ui.session.resolve import data_of, fitted_to_image, image_of, secondary_of
from ccwsim.ui.session.state import KEY, State
from ccwsim.ui.share.menu import choices_of, project_of
from ccwsim.ui.study.data_step import problem_of_data, use_data
from ccwsim.ui.study.guides_step import problem_of_guides, use_guides
from ccwsim.ui.study.image_questions import image_of_file
from ccwsim.ui.study.image_step import use_image
from tests.numberings import (
    CHANNEL,
    IMAGES,
    codes,
    grid_with_gaps,
    probabilities,
    table,
)
from tests.ui.widgets import html, named, opened, texts

TABLE = DataChoice("file", upload=Upload("wells.csv", table()))
ANSWERS = (("facies_names", (("0", 1), ("1", 0))),)
DATA = {"table": TABLE, "grid": DataChoice("file", upload=Upload("wells.sgems", grid_with_gaps()))}
GUIDES = {
    "probabilities": GuideChoice(probabilities=Upload("soft.sgems", probabilities())),
    "zones of a second image": GuideChoice(
        images=(image_of_file(Upload("other.npy", codes())),),
        zones=(((0.0, 0.0), (30.0, 0.0), (30.0, 60.0), (0.0, 60.0)),),
    ),
}


def study(kind: str) -> State:
    name, content, answers = IMAGES[kind]
    choice = image_of_file(Upload(name, content()), answers)
    choices = replace(Choices(), image=choice, data=DataChoice(), grid=Grid(*CHANNEL.shape))
    return State(choices=fitted_to_image(choices, image_of(choice)))


def is_right(state: State) -> bool:
    data = data_of(state.choices)
    return data.n > 100 and bool((data.facies == 1 - CHANNEL[tuple(data.cells.T)]).all())


@pytest.mark.parametrize("kind", IMAGES)
@pytest.mark.parametrize("form", DATA)
def test_data_wait_until_their_facies_are_confirmed(kind, form):
    state = study(kind)
    use_data(state, DATA[form])
    assert state.data_draft is not None
    app = opened("import", state).run()
    app.button_group(key="import_subject").set_value("data").run()
    assert "choose which facies of the image 0 or 1 is" in texts(app) + html(app)
    menus = [named(app.selectbox, f"ask_name_{k}") for k in range(2)]
    assert [(menu.label, menu.value) for menu in menus] == [("Facies 0 is", 1), ("Facies 1 is", 0)]
    assert html(app).count('class="facies-swatch"') == 2
    named(app.button, "name_likeliest").click().run()
    assert app.session_state[KEY].data_draft is None
    assert is_right(app.session_state[KEY])
    app = opened("simulate", app.session_state[KEY]).run()
    assert "Facies: 0 → facies 1, 1 → facies 0" in html(app)


@pytest.mark.parametrize("kind", IMAGES)
@pytest.mark.parametrize("form", GUIDES)
def test_guides_wait_until_their_facies_are_confirmed(kind, form):
    state = study(kind)
    use_guides(state, GUIDES[form])
    assert state.guides_draft is not None
    app = opened("guides", state).run()
    assert "choose which facies of the image 0 or 1 is" in texts(app) + html(app)
    key = "soft_name" if form == "probabilities" else "image1_name"
    assert named(app.selectbox, f"ask_{key}_0").value == 1
    named(app.button, f"{key}_likeliest").click().run()
    state = app.session_state[KEY]
    assert state.guides_draft is None
    guides = secondary_of(state.choices)
    if form == "probabilities":
        assert np.allclose(guides.probabilities[0], 0.1 + 0.8 * CHANNEL)
    else:
        assert np.array_equal(guides.images[0].array, 1 - CHANNEL)


def test_another_answer_is_used_and_the_rest_follows_from_it():
    state = study("picture")
    use_data(state, TABLE)
    app = opened("import", state).run()
    app.button_group(key="import_subject").set_value("data").run()
    named(app.selectbox, "ask_name_0").set_value(0).run()
    assert named(app.selectbox, "ask_name_1").value == 1  # the other facies is left
    assert app.session_state[KEY].data_draft is not None
    named(app.button, "name_likeliest").click().run()
    state = app.session_state[KEY]
    assert state.choices.data.answers == (("facies_names", (("0", 0), ("1", 1))),)
    data = data_of(state.choices)
    assert (data.facies == CHANNEL[tuple(data.cells.T)]).all()


def test_names_in_data_are_matched_without_a_question():
    state = study("picture")
    state.change(image=replace(state.choices.image, names=("Sand", "Mud")))
    rows = table().decode().replace(",1\n", ",sand\n").replace(",0\n", ",mud\n")
    use_data(state, DataChoice("file", upload=Upload("wells.csv", rows.encode())))
    assert state.data_draft is None
    assert is_right(state)


def test_a_project_keeps_the_answer_and_asks_for_other_data():
    state = study("picture")
    use_data(state, replace(TABLE, answers=ANSWERS))
    choices, _ = choices_of(project_of(state))
    assert image_of(choices.image).numbering == "colours"
    again = State(choices=choices)
    assert is_right(again)
    use_data(again, TABLE)
    assert again.data_draft is not None


def test_data_placed_by_hand_are_asked_about_after_a_change_of_the_image():
    places = np.argwhere(CHANNEL >= 0)[::30]
    placed = HardData(places, 1 - CHANNEL[tuple(places.T)])
    state = study("picture")
    use_data(state, DataChoice("placed", placed=placed))
    assert state.data_draft is None
    use_image(state, image_of_file(Upload("coded.npy", codes())))
    draft = state.data_draft
    assert draft is not None
    use_data(state, draft)
    assert state.choices.data.source == "none"
    use_data(
        state, replace(draft, answers=(*draft.answers, ("facies_names", (("0", 1), ("1", 0)))))
    )
    assert state.data_draft is None
    data = data_of(state.choices)
    assert (data.facies == CHANNEL[tuple(data.cells.T)]).all()
    assert state.choices.data.answers == ()


def test_an_answer_is_not_used_for_another_image():
    state = study("picture")
    use_data(state, replace(TABLE, answers=ANSWERS))
    use_image(state, image_of_file(Upload("coded.npy", codes())))
    assert "facies_names" not in dict(state.data_draft.answers)


@pytest.mark.parametrize("form", GUIDES)
def test_answers_about_facies_of_guides_do_not_survive_a_change_of_the_image(form):
    state = study("picture")
    guides, stated = GUIDES[form], (("0", 1), ("1", 0))
    if form == "probabilities":
        guides = replace(guides, facies_names=stated)
    else:
        guides = replace(guides, images=(replace(guides.images[0], facies_names=stated),))
    use_guides(state, guides)
    assert state.guides_draft is None
    _, content, answers = IMAGES["palette"]
    use_image(state, image_of_file(Upload("other.png", content()), answers))
    assert problem_of_guides(state.choices).endswith("numbers of colours or classes are no codes")
    app = opened("guides", state).run()
    key = "soft_name" if form == "probabilities" else "image1_name"
    named(app.button, f"{key}_likeliest").click().run()
    assert not problem_of_guides(app.session_state[KEY].choices)


def test_answers_about_guides_that_wait_are_forgotten_too():
    state = study("picture")
    state.guides_draft = replace(GUIDES["probabilities"], facies_names=(("0", 1),))
    state.data_draft = replace(TABLE, answers=ANSWERS)
    use_image(state, ImageChoice("channels"))
    assert state.guides_draft.facies_names == ()
    assert state.data_draft.answers == ()


@pytest.mark.parametrize("source", ["file", "placed"])
def test_answers_about_data_do_not_survive_other_classes_of_the_same_file(source):
    state = study("classes")
    use_data(state, replace(TABLE, answers=ANSWERS))
    if source == "placed":
        use_data(state, DataChoice("placed", placed=data_of(state.choices)))
    assert is_right(state)
    upload = state.choices.image.upload
    use_image(state, image_of_file(upload, {"classes": 2}))
    assert state.choices.data.source == "none"
    assert "facies_names" not in dict(state.data_draft.answers)
    use_data(state, state.data_draft)
    assert state.data_draft is not None  # the page asks again
    assert "choose which facies" in problem_of_data(replace(state.choices, data=state.data_draft))


def test_answers_stay_if_the_image_is_only_turned_or_renamed():
    state = study("picture")
    use_data(state, replace(TABLE, answers=ANSWERS))
    image = state.choices.image
    use_image(state, replace(image, flip_ew=True, names=("Sand", "Mud")))
    assert state.data_draft is None
    assert state.choices.data.answers == ANSWERS


def test_bundled_data_are_asked_about_for_a_picture():
    state = study("picture")
    use_data(state, DataChoice("bundled", datasets.hard_data_names()[0]))
    assert state.data_draft is not None
    app = opened("simulate", state).run()
    assert named(app.button, "name_likeliest")
