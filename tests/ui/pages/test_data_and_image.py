"""Test the verdict on data and training image in the study column and on *Validate*."""

from __future__ import annotations

import pytest

from ccwsim import datasets
from ccwsim.metrics import fit_data
from ccwsim.sharing.choices import Choices
from ccwsim.sharing.link import read_link
from ccwsim.ui.session.state import KEY, State
from ccwsim.ui.study.data_step import verdict
from tests.ui.pages.test_validate_page import launched, settled
from tests.ui.widgets import html, named, opened
from tests.waiting import wait_until


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
    app = opened("simulate", State(choices=choices("ti=channels&data=channels_400_data&seed=77")))
    words = "Data do not contradict this training image"
    app.run()
    state = app.session_state[KEY]
    assert words not in html(app) or state.job is None
    wait_until(lambda: words in html(app.run()), "the comparison of data and image", every=0.3)
    assert state.job is None


@pytest.mark.slow
def test_an_image_of_another_kind_is_said_to_contradict_the_data():
    link = "ti=fractures&data=channels_400_data&realizations=2"
    said = html(launched(choices(link), seen=frozenset({"fit"})))
    assert "⚑ Data contradict this training image" in said
