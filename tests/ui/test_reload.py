"""Test that a reloaded page has the files of the same user, and that other users do not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ccwsim.model.hard_data import HardData
from ccwsim.model.parameters import Parameters
from ccwsim.sharing.choices import Choices, DataChoice, ImageChoice, Shown, Upload
from ccwsim.sharing.link import link_of, own_choices, read_link
from ccwsim.sharing.project import project_as_bytes
from ccwsim.ui.compare.settings import compared_settings
from ccwsim.ui.session import kept
from ccwsim.ui.session.kept import KeptChoices, bytes_of_choice
from ccwsim.ui.session.resolve import data_of
from ccwsim.ui.session.state import KEY, State
from ccwsim.ui.share.menu import open_project, project_of
from tests.ui.test_pages import SMALL, a_file, settled
from tests.ui.widgets import html, named, opened, texts

IMAGE = ImageChoice(upload=Upload("mine.dat", a_file(np.arange(900).reshape(30, 30) // 7 % 2)))
PLACED = HardData([[k // 40, k % 40] for k in range(300)], [k % 2 for k in range(300)])
OWN = replace(SMALL, image=replace(IMAGE, flip_ew=True), data=DataChoice("placed", placed=PLACED))


@pytest.fixture(autouse=True)
def store(monkeypatch):
    """Return a new store for each test."""
    own = KeptChoices(10**6, 3600)
    monkeypatch.setattr(kept, "kept_choices", lambda: own)
    return own


def reloaded(query: dict[str, list[str]], browser: str, page: str = "simulate"):
    """Return a new session opened by an address."""
    app = opened(page)
    app.session_state[kept.COOKIE] = browser
    for name, values in query.items():
        app.query_params[name] = values
    return app.run()


def test_a_reload_of_the_same_browser_has_the_same_study():
    app = opened("simulate", State(choices=OWN))
    app.session_state[kept.COOKIE] = "ann"
    settled(app.run())
    again = reloaded(link_of(OWN), "ann")
    assert again.session_state[KEY].choices == OWN
    assert not texts(again)


def test_a_reload_keeps_the_settings_of_flow():
    app = opened("flow", State(choices=SMALL))
    settled(app.run())
    named(app.number_input, "flow_high").set_value(12.5).run()
    app.session_state[KEY].change_flow(well=(5, 6), rate=3.0)
    app.run()
    query = {name: app.query_params[name] for name in app.query_params}
    again = settled(reloaded(query, "ann", "flow"))
    assert named(again.number_input, "flow_high").value == 12.5
    assert "Well in row 5, column 6" in html(again)
    assert again.session_state[KEY].flow == app.session_state[KEY].flow


def test_a_reload_keeps_the_settings_of_compare_and_sweep():
    app = opened("compare", State(choices=SMALL))
    state = app.session_state[KEY]
    delta, other = ImageChoice("delta", flip_ew=True), Parameters(16, 4, 1, n_candidates=3)
    state.change_compare(others=(None, other), n=2, beside=delta)
    state.change_sweep(ranges=(("template_size", (16, 24)),), n_realizations=7, error="copying")
    app.run()
    query = {name: app.query_params[name] for name in app.query_params}
    again = settled(reloaded(query, "ann", "compare"))
    kept_state = again.session_state[KEY]
    assert (kept_state.compare, kept_state.sweep) == (state.compare, state.sweep)
    assert compared_settings(kept_state)[2] == other
    assert named(again.number_input, "n_compared").value == 2
    upload = ImageChoice(upload=Upload("own.png", b"picture"))
    state.change_compare(beside=upload)
    app.run()
    query = {name: app.query_params[name] for name in app.query_params}
    kept_state = reloaded(query, "bob", "compare").session_state[KEY]
    assert kept_state.compare == replace(state.compare, beside="")


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ('{"n":101}', "realizations compared"),
        ('{"others":[]}', "number of compared settings"),
        ('{"beside":"three-point"}', "is changed"),
    ],
)
def test_settings_of_compare_out_of_bounds_are_left_out(text, reason):
    shown, notes = read_link({"compare": [text]})[1:]
    assert shown == Shown()
    assert reason in notes[0]


def test_a_reload_keeps_the_answers_to_a_file_of_wells_and_a_project_its_data():
    wells = Upload("wells.csv", b"x;y;facies\n3,5;4;Ton\n8;12,5;Sand\n")
    answers = (("facies_names", (("Sand", 1), ("Ton", 0))), ("on_collision", "majority"))
    own = replace(OWN, data=DataChoice("file", upload=wells, answers=answers))
    app = opened("simulate", State(choices=own))
    app.session_state[kept.COOKIE] = "ann"
    settled(app.run())
    again = reloaded(link_of(own), "ann").session_state[KEY]
    assert again.choices == own
    assert data_of(again.choices).triples == ((4, 3, 0), (12, 8, 1))
    state = State()
    content = project_as_bytes(project_of(app.session_state[KEY]))
    open_project(state, Upload("study.ccwsim", content))
    assert data_of(state.choices).triples == ((4, 3, 0), (12, 8, 1))


def test_a_reload_keeps_what_waits_for_answers_until_it_is_settled():
    wells = DataChoice("file", upload=Upload("wells.csv", b"x,y,facies\n10,20,1\n900,20,1\n"))
    image = ImageChoice(upload=Upload("ramp.dat", a_file(np.arange(900).reshape(30, 30))))
    app = opened("import", State(choices=SMALL, image_draft=image, data_draft=wells))
    app.session_state[kept.COOKIE] = "ann"
    app.run()
    again = reloaded(link_of(SMALL), "ann", "import")
    state = again.session_state[KEY]
    assert (state.choices, state.image_draft, state.data_draft) == (SMALL, image, wells)
    other = reloaded(link_of(replace(SMALL, seed=7)), "ann", "import").session_state[KEY]
    assert (other.image_draft, other.data_draft) == (None, None)
    named(again.button, "wells_drop").click().run()
    third = reloaded(link_of(SMALL), "ann", "import").session_state[KEY]
    assert (third.image_draft, third.data_draft) == (image, None)


def test_another_browser_with_the_same_address_gets_nothing_of_it(store):
    store.keep("ann", own_choices(OWN))
    app = reloaded(link_of(OWN), "bob")
    choices = app.session_state[KEY].choices
    assert choices.image == ImageChoice()
    assert choices.data == DataChoice()
    assert "does not have the training image mine.dat of this link" in texts(app)
    assert "does not have the hard data set by hand" in texts(app)


def test_two_tabs_keep_an_image_each():
    other = replace(OWN, image=replace(IMAGE, flip_ns=True))
    own = own_choices(OWN) | own_choices(other)
    for choices in (OWN, other):
        assert read_link(link_of(choices), own)[0] == choices


def test_what_is_kept_is_bounded_in_number_time_and_size():
    now = [0.0]
    some = KeptChoices(1050, 60, lambda: now[0])

    def image(k: int, size: int = 10) -> dict:
        return own_choices(Choices(image=ImageChoice(upload=Upload(f"{k}", bytes(size)))))

    for k in range(12):
        some.keep("ann", image(k))
    assert len(some.of("ann")) == kept.MAX_OF_BROWSER
    some.keep("bob", image(1, 700))
    assert some.of("bob") == image(1, 700)
    now[0] = 59.0
    some.keep("bob", image(1, 700))
    now[0] = 100.0
    assert some.of("bob")
    assert some.of("ann") == {}
    now[0] = 120.0
    assert some.of("bob") == {}
    some.keep("bob", image(2, 2000))  # larger than the memory for kept files
    assert some.of("bob") == {}


def test_the_browser_with_the_most_bytes_loses_its_oldest_first():
    some = KeptChoices(450, 60)
    own = {
        who: own_choices(Choices(image=ImageChoice(upload=Upload(f"{who}.dat", bytes(size)))))
        for who, size in {"ann": 60, "bob": 40, "cy": 50}.items()
    }
    for who in own:
        some.keep(who, own[who])
    images = [ImageChoice(upload=Upload(f"{k}", bytes(70))) for k in range(5)]
    many = [own_choices(Choices(image=image)) for image in images]
    for each in many:
        some.keep("eve", each)
    assert {who: some.of(who) for who in own} == own
    assert some.of("eve") == many[-2] | many[-1]
    for k in range(20):  # any number of browsers, each with one large file
        some.keep(f"eve {k}", many[0])
    assert {who: some.of(who) for who in own} == own


def test_data_placed_by_hand_count_too():
    (data,) = own_choices(Choices(data=DataChoice("placed", placed=PLACED))).values()
    assert bytes_of_choice(data) == PLACED.n * 3 * 8
