"""Test on the page Import small files of kinds that users report as difficult."""

from __future__ import annotations

import numpy as np
import pytest

from ccwsim import Grid, Parameters
from ccwsim.io import read_training_image
from ccwsim.sharing.choices import Choices, DataChoice, ImageChoice, Upload
from ccwsim.ui.session.resolve import data_of, image_of
from ccwsim.ui.session.state import KEY, State
from ccwsim.ui.study.data_step import use_data
from ccwsim.ui.study.image_questions import asked_of
from ccwsim.ui.study.image_step import import_image
from tests.io.test_cases import IMAGES, MAX_ANSWERS, cases, truth  # noqa: F401 (fixtures)
from tests.ui.widgets import named, opened, texts

SMALL = Parameters(template_size=8, overlap_size=2, wavelet_level=1)
OF_POINTS = (
    "h02_one_based_cells.csv",
    "h16_bool_words.csv",
    "h22_title_row_above.csv",
    "q02_geojson_null_geometry.geojson",
)


@pytest.mark.slow
@pytest.mark.parametrize("name", IMAGES)
def test_an_image_is_the_truth_after_one_press_at_most(cases, truth, name):  # noqa: F811
    state = State(choices=Choices(data=DataChoice(), grid=Grid(16, 16), parameters=SMALL))
    import_image(state, Upload(name, (cases / name).read_bytes()))
    choice = state.image_draft or state.choices.image
    assert len(asked_of(choice)) <= MAX_ANSWERS
    app = opened("import", state).run()
    assert not app.exception
    assert texts(app) == ""
    if app.session_state[KEY].image_draft is not None:
        named(app.button, "image_take").click().run()
    state = app.session_state[KEY]
    assert state.image_draft is None
    found = image_of(state.choices.image)  # an image is used with its gap
    known = np.ones(truth.shape, bool) if found.known is None else found.known
    assert found.shape == truth.shape
    assert np.array_equal(found.array[known], truth[known])
    _, grid = IMAGES[name]
    if grid is not None:  # the study uses the grid of the image
        own = state.choices.grid
        assert (own.shape, own.cell_size, own.crs) == (found.shape, grid.cell_size, grid.crs)
        assert own.origin == grid.origin


@pytest.mark.slow
@pytest.mark.parametrize("name", OF_POINTS)
def test_points_have_the_facies_of_their_cells(cases, truth, tmp_path, name):  # noqa: F811
    image = Upload("truth.npy", (cases / "truth.npy").read_bytes())
    grid = Grid(*read_training_image(cases / "truth.npy").shape)
    choices = Choices(ImageChoice(upload=image), DataChoice(), grid, SMALL)
    state = State(choices=choices)
    use_data(state, DataChoice("file", upload=Upload(name, (cases / name).read_bytes())))
    app = opened("import", state).run()
    assert not app.exception
    assert app.session_state[KEY].data_draft is None
    data = data_of(app.session_state[KEY].choices)
    assert data.n == 8
    assert np.array_equal(truth[tuple(data.cells.T)], data.facies)
