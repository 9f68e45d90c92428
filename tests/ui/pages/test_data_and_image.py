"""Test the verdict on data and training image in the study column and on *Validate*."""

from __future__ import annotations

from dataclasses import replace
from io import BytesIO

import numpy as np
import pytest

from ccwsim import CCWSIMError, Grid, HardData, Parameters, datasets
from ccwsim.metrics import fit_data
from ccwsim.sharing.choices import Choices, DataChoice, ImageChoice, Upload
from ccwsim.sharing.link import read_link
from ccwsim.ui.session.resolve import data_of, facies_by_code
from ccwsim.ui.session.state import KEY, State
from ccwsim.ui.study.data_step import verdict
from tests.small_images import facies_at_edges
from tests.ui.pages.test_validate_page import launched, settled
from tests.ui.widgets import html, named, opened
from tests.waiting import wait_until

VOLUME = "grid=100x100x48&template=32x32x16&overlap=8x8x4&level=2x2x1"


def choices(link: str) -> Choices:
    return read_link({k: [v] for k, v in (part.split("=") for part in link.split("&"))})[0]


@pytest.fixture(scope="module")
def app():
    link = "ti=fractures&data=channels_60_wells&realizations=2"
    return launched(choices(link), seen=frozenset({"fit"}))


def test_it_says_whether_the_data_contradict_the_image(app):
    said = html(app)
    fit = fit_data(
        datasets.load("fractures"),
        app.session_state[KEY].ensemble.hard_data,
        app.session_state[KEY].ensemble.grid,
    )
    assert verdict(fit) in said
    assert all(name in said for name in fit.families)


def test_images_are_ranked_and_data_left_out_on_demand(app):
    named(app.button, "ask_rank_images").click().run()
    app = settled(app)
    said = html(app)
    assert "Data cannot tell these images apart" in said  # fewer than 200 data
    assert said.count("<img") == len(datasets.names())
    named(app.button, "ask_leave_data_out").click().run()
    assert "Too few data to judge the probabilities" in html(settled(app))


def test_the_study_column_says_it_once_no_run_is_going():
    study = choices("ti=channels&data=channels_400_data&seed=77&realizations=1")
    app = opened("simulate", State(choices=study))
    words = "Data do not contradict this training image"
    app.run()
    state = app.session_state[KEY]
    assert words not in html(app) or state.job is None
    wait_until(lambda: words in html(app.run()), "the comparison of data and image", every=0.3)
    assert state.job is None


def test_an_image_that_is_turned_against_the_data_can_be_turned():
    study = choices("ti=dunes&data=none&grid=128x128&seed=77&realizations=1")
    image = datasets.load("dunes")
    rng = np.random.default_rng(0)
    cells = np.column_stack(np.divmod(rng.choice(128**2, 250, replace=False), 128))
    placed = HardData(cells, image.array[tuple(cells.T)])
    turned = replace(study, data=DataChoice("placed", placed=placed), image=study.image.rotated)
    app = opened("simulate", State(choices=turned))
    wait_until(lambda: "Your data fit the image" in html(app.run()), "the variants", every=0.3)
    assert "turned by 90° better (z " in html(app)
    named(app.button, "turn_image").click().run()
    assert app.session_state[KEY].choices.image == study.image
    wait_until(lambda: "Data do not contradict" in html(app.run()), "the comparison", every=0.3)
    assert "Your data fit the image" not in html(app)


@pytest.mark.parametrize(
    ("link", "taken", "facies"),
    [
        ("ti=channels&data=channels_400_data", "", [0, 1]),
        ("ti=bend&data=channels_400_data", "", [0, 1]),
        (
            "ti=stone_wall&data=channels_400_data",
            "mud counts as stone, sand counts as mortar",
            [0, 1],
        ),
        (
            "ti=stone_wall&data=channels_60_wells",
            "mud counts as stone, sand counts as mortar",
            [0, 1],
        ),
        ("ti=lenses&data=channels_400_data", "mud counts as shale", [0, 1]),
        (f"ti=folded_layers&data=sinuous_channels_10_wells&{VOLUME}", "mud counts as clay", [0, 2]),
    ],
)
def test_facies_of_bundled_data_go_by_name_and_else_it_is_said(link, taken, facies):
    study = choices(link)
    assert facies_by_code(study) == taken
    assert np.unique(data_of(study).facies).tolist() == facies


def test_facies_of_the_image_may_get_the_names_in_the_data():
    study = choices("ti=stone_wall&data=channels_400_data")
    named = replace(study, image=replace(study.image, names=("sand", "mud")))
    assert facies_by_code(named) == ""
    np.testing.assert_array_equal(data_of(named).facies, 1 - data_of(study).facies)


def test_a_name_whose_code_stands_for_another_name_is_a_question():
    study = choices("ti=dunes&data=barchans_200_data")
    with pytest.raises(CCWSIMError, match="has no facies 'sand body'"):
        data_of(study)
    answers = ("facies_names", (("sand body", 1),))
    answered = replace(study, data=replace(study.data, answers=(answers,)))
    own = datasets.load_hard_data("barchans_200_data").facies
    assert data_of(answered).facies.tolist() == np.array([0, 2, 1])[own].tolist()


def test_the_pages_say_which_names_differ():
    link = "ti=stone_wall&data=channels_60_wells&grid=64x64&realizations=2"
    link += '&answers=[["on_outside","drop"]]'
    app = launched(choices(link))
    assert "data: mud counts as stone, sand counts as mortar" in html(app)
    app = opened("simulate", State(choices=choices(link)))
    assert "mud counts as stone" in app.run().warning[0].value


@pytest.mark.slow
def test_an_image_of_another_kind_is_flagged():
    """Test channels with twice the share of fractures: too few data differ in anything else."""
    link = "ti=fractures&data=channels_400_data&realizations=2"
    said = html(launched(choices(link), seen=frozenset({"fit"})))
    assert "⚑ Wells prefer fracture, or the image lacks it; otherwise it fits" in said


@pytest.mark.parametrize(("template", "warned"), [(32, True), (16, False)])
def test_the_method_names_a_facies_at_the_edges_of_an_image(template, warned):
    file = BytesIO()
    np.save(file, facies_at_edges())
    image = ImageChoice(upload=Upload("own.npy", file.getvalue()))
    p = Parameters(template, template // 4, 2)
    app = opened("simulate", State(Choices(image, DataChoice(), Grid(72, 96), p))).run()
    assert not app.exception
    assert any("facies 0 (18 %" in each.value for each in app.warning) is warned
