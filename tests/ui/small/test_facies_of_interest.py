"""Test which facies is shown first, and that a choice is kept for its image and in addresses."""

from __future__ import annotations

import numpy as np
import pytest

from ccwsim import Grid, TrainingImage, datasets
from ccwsim.sharing.choices import Choices, DataChoice, ImageChoice, Shown
from ccwsim.sharing.link import link_of, read_link
from ccwsim.ui.examples.catalogue import example_named
from ccwsim.ui.examples.opened import open_example
from ccwsim.ui.results.maps import choose_statistic
from ccwsim.ui.session.address import show, shown_of
from ccwsim.ui.session.state import KEY, State
from tests.ui.widgets import named, opened

DUNES = Choices(ImageChoice("dunes"), DataChoice(), Grid(64, 64), n_realizations=2)


@pytest.mark.parametrize(
    ("cells", "index"),
    [
        ([73, 27], 1),
        ([27, 73], 0),
        ([50, 50], 1),
        ([60, 25, 15], 2),
        ([600, 390, 10], 1),  # 1 % is too little
        ([990, 10], 1),
        ([995, 3, 2], 1),
        ([10], 0),
    ],
)
def test_the_rarest_facies_that_is_frequent_enough_is_shown_first(cells, index):
    image = TrainingImage([np.repeat(np.arange(len(cells)), cells)])
    assert image.facies_of_interest == index


def test_sand_is_shown_first_in_bundled_images_of_channels():
    for name in ("channels", "bend", "sinuous_channels"):
        image = datasets.load(name)
        assert image.facies_names[image.facies_of_interest] == "sand"


@pytest.mark.parametrize("page", ["simulate", "compare", "validate"])
def test_pages_show_the_facies_of_interest_until_another_is_chosen(page):
    app = opened(page, State(choices=DUNES)).run()
    state: State = app.session_state[KEY]
    if state.job is not None:
        assert state.job.wait(60)
        app.run()
    assert not app.exception
    assert state.facies == 2
    choose_statistic(state, 0)
    assert app.run().session_state[KEY].facies == 0


def test_a_choice_is_kept_for_its_image_only():
    state = State(choices=DUNES)
    dunes, channels = datasets.load("dunes"), datasets.load("channels")
    state.choose_facies(dunes)
    choose_statistic(state, 0)
    state.choose_facies(dunes)
    assert state.facies == 0
    state.choose_facies(channels)
    assert state.facies == 1


def test_addresses_carry_only_a_facies_that_was_chosen():
    state = State(choices=DUNES)
    assert "facies" not in link_of(state.choices, shown_of(state))
    state.choose_facies(datasets.load("dunes"))
    assert "facies" not in link_of(state.choices, shown_of(state))
    choose_statistic(state, 1)
    address = link_of(state.choices, shown_of(state))
    assert address["facies"] == ["1"]
    choices, shown, notes = read_link(address)
    assert not notes
    other = State(choices=choices)
    show(other, shown)
    other.choose_facies(datasets.load("dunes"))
    assert other.facies == 1
    show(other, Shown(facies=9))
    assert other.facies == 2
    show(other, Shown())
    assert other.facies == 2


def test_an_example_shows_its_facies_of_interest():
    state = State(choices=DUNES)
    state.choose_facies(datasets.load("dunes"))
    choose_statistic(state, 0)
    example = example_named("three-facies")
    assert example is not None
    open_example(state, example)
    state.choose_facies(datasets.load("barchans"))
    assert datasets.load("barchans").facies_names[state.facies] == "sand body"


def test_how_it_works_shows_the_facies_of_interest():
    app = opened("how_it_works", State(choices=DUNES)).run()
    assert not app.exception
    assert named(app.selectbox, "how_facies").value == 2
