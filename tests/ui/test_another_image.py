"""Test a change of the training image: settings that fit return, and old results disappear."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ccwsim import Grid, Parameters
from ccwsim.io import training_image_as_bytes
from ccwsim.model.hard_data import HardData
from ccwsim.model.training_image import TrainingImage
from ccwsim.sharing.choices import Choices, DataChoice, ImageChoice, Upload
from ccwsim.ui.session.state import KEY, State
from ccwsim.ui.study.image_step import use_image
from tests.ui.widgets import html, named, opened, texts

CHECKS = np.indices((20, 20)).sum(axis=0) // 2 % 2
STUDY = Choices(
    data=DataChoice(),
    grid=Grid(48, 64),
    parameters=Parameters(template_size=16, overlap_size=4),
    n_realizations=1,
)


def small_image() -> ImageChoice:
    image = TrainingImage(CHECKS, name="checks")
    return ImageChoice(upload=Upload("checks.npy", training_image_as_bytes(image, "npy")))


def settled(app):
    """Return the page after its job has ended."""
    while app.session_state[KEY].job is not None:
        assert app.session_state[KEY].job.wait(120)
        app.run()
    assert not app.exception
    return app


def test_sizes_come_back_after_an_image_without_room_for_them():
    asked = Parameters(template_size=48, overlap_size=12, wavelet_level=2)
    state = State(choices=Choices(parameters=asked))
    use_image(state, small_image())
    assert state.choices.parameters.template_size == 20
    use_image(state, ImageChoice(bundled="levees"))
    assert state.choices.parameters == asked


def test_what_was_changed_on_the_small_image_stays_changed():
    state = State(choices=Choices(parameters=Parameters(template_size=48, overlap_size=8)))
    use_image(state, small_image())
    state.change(parameters=Parameters(template_size=16, overlap_size=8, n_candidates=5))
    use_image(state, ImageChoice(bundled="levees"))
    parameters = state.choices.parameters
    assert (parameters.template_size, parameters.n_candidates) == (16, 5)


def test_the_uncertainty_map_calls_facies_as_the_results_do():
    app = settled(opened("simulate", State(choices=STUDY)).run())
    before = named(app.selectbox, "e_type")
    named(app.selectbox, "image_bundled").set_value("levees").run()
    named(app.button, "run").click().run()
    names = settled(app).session_state[KEY].ensemble.training_image.facies_names
    menu = named(app.selectbox, "e_type")
    assert menu.options[: len(names)] == [f"{name} in the realization" for name in names]
    # a menu keeps its first name in the browser, so a new name needs a new menu
    assert menu.id != before.id


def test_a_refused_upload_is_alone_on_its_page():
    app = settled(opened("simulate", State(choices=STUDY)).run())
    file = app.file_uploader(key="image_file")
    file.upload("broken.csv", b"sand, and mud\n", "text/csv").run()
    assert "keeps its present image" in " ".join(error.value for error in app.error)
    imported = opened("import", app.session_state[KEY]).run()
    assert not any(box.label.startswith("Flip") for box in imported.checkbox)
    assert not any((box.key or "").startswith("image_name") for box in imported.text_input)
    assert "contains no" in texts(imported)
    next(b for b in imported.button if b.label == "Keep the image as it was").click().run()
    assert {box.label for box in imported.checkbox} >= {"Flip E–W", "Transpose"}


def test_bundled_data_leave_with_their_image():
    state = State()
    assert state.choices.data.source == "bundled"
    use_image(state, ImageChoice("channels", flip_ew=True))
    assert state.choices.data.source == "bundled"  # a rotated image counts as the same image
    use_image(state, ImageChoice("dunes"))
    assert (state.choices.data, state.data_draft) == (DataChoice(), None)


@pytest.mark.slow
def test_data_of_ones_own_are_asked_after_when_the_image_changes():
    mine = DataChoice("placed", placed=HardData([[1, 1], [9, 30]], [0, 1]))
    app = settled(opened("simulate", State(choices=replace(STUDY, data=mine))).run())
    named(app.selectbox, "image_bundled").set_value("dunes").run()
    assert app.session_state[KEY].choices.data == DataChoice()
    assert "Your 2 data (placed by hand) fit the study but are not in the study yet" in html(app)
    named(app.button, "data_keep").click().run()
    assert app.session_state[KEY].choices.data == mine
    assert "another training image" not in html(app)
    named(app.selectbox, "image_bundled").set_value("channels").run()
    named(app.button, "data_leave").click().run()
    state = app.session_state[KEY]
    assert (state.choices.data, state.data_draft) == (DataChoice(), None)
    assert not app.exception


def test_data_of_ones_own_that_the_image_does_not_have_are_said_and_kept():
    mine = DataChoice("placed", placed=HardData([[1, 1], [9, 30]], [0, 7]))
    state = State(choices=replace(STUDY, data=DataChoice()), data_draft=mine)
    app = settled(opened("simulate", state).run())
    assert "The study keeps its present data" in texts(app)
    assert app.session_state[KEY].data_draft == mine
