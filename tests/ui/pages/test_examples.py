"""Test the studies of the lecture plan, the quiz, and the link for a class."""

from __future__ import annotations

import re
from base64 import b64decode
from collections import Counter
from dataclasses import replace
from html import escape
from io import BytesIO
from pathlib import Path
from urllib.parse import parse_qs, parse_qsl, urlsplit

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from streamlit.testing.v1 import AppTest

from ccwsim import Ensemble, Grid, Parameters, datasets, simulate
from ccwsim.experiments.two_point import simulate_two_point
from ccwsim.figures import LIGHT
from ccwsim.jobs.job import Job
from ccwsim.metrics import copying, etype, unseen_patterns, vertical_proportions
from ccwsim.model.study import Study
from ccwsim.report.document import report_html
from ccwsim.sharing.choices import Choices, DataChoice
from ccwsim.sharing.link import link_of, read_link
from ccwsim.ui.compare.settings import compared_settings
from ccwsim.ui.examples.catalogue import (
    EXAMPLES,
    LECTURE_PARTS,
    Example,
    example_address,
    example_named,
    lecture_sheet,
    next_example,
)
from ccwsim.ui.examples.opened import Examples, back_to_own, compare_example, open_example
from ccwsim.ui.examples.page import (
    N_LAGS,
    arrived,
    class_link,
    expected_pictures,
    pictures_html,
    pictures_of,
    small,
)
from ccwsim.ui.examples.quiz import (
    N_PICTURES,
    WINDOW_SIDE,
    Quiz,
    Round,
    describe_seams,
    describe_verdict,
    draw_round,
    new_shapes,
    pick,
    piece_map,
    piece_side,
    window_codes,
)
from ccwsim.ui.session.resolve import data_of, image_of
from ccwsim.ui.session.state import KEY, State
from ccwsim.ui.widgets.text import page_labels
from tests.small_images import blobs, places_of
from tests.ui.widgets import html, named, opened
from tests.waiting import wait_until

ROOT = Path(__file__).parents[3]
OWN = Choices(data=DataChoice(), grid=Grid(48, 64), parameters=Parameters(16, 4), seed=5)
NAMES = [example.name for example in EXAMPLES]


def example(name: str) -> Example:
    found = example_named(name)
    assert found is not None
    return found


def launched() -> AppTest:
    return quiet(opened("examples", State(choices=OWN)).run())


def followed(query: dict[str, str], page: str = "examples") -> AppTest:
    """Return the page of a user who opens a link."""
    app = opened(page)
    for name, value in query.items():
        app.query_params[name] = value
    return quiet(app.run())


def round_of(app: AppTest) -> Round:
    """Return the round of the quiz that is shown, once it is ready."""
    run_until(app, lambda a: state_of(a).page(Quiz).round is not None)
    drawn = state_of(app).page(Quiz).round
    assert drawn is not None
    return drawn


def sources_of(found: Ensemble) -> NDArray[np.int32]:
    assert found.sources is not None
    return found.sources


def quiet(app: AppTest) -> AppTest:
    assert not app.exception
    assert not app.error
    return app


def state_of(app: AppTest) -> State:
    return app.session_state[KEY]


def run_until(app: AppTest, done) -> AppTest:
    wait_until(lambda: done(quiet(app.run())), "the page", every=0.1)
    return app


@pytest.fixture
def by_setting():
    """Return four realizations for each setting of an example, on a small grid or its own grid."""

    def simulated(name: str, whole: bool = False):
        e = example(name)
        choices = e.choices if whole else small(e.choices)
        image, data = image_of(choices.image), data_of(choices)
        return [simulate(image, choices.grid, p, data, 4) for p in e.settings]

    return simulated


@pytest.mark.parametrize("name", NAMES)
def test_an_example_can_be_read_and_honours_its_data(name):
    e = example(name)
    image = image_of(e.choices.image)
    for p in e.settings:
        Study(image, e.choices.grid, p, data_of(e.choices))  # valid on its own grid
    choices = small(e.choices)
    data = data_of(choices)
    assert (data.n > 0) == (e.choices.data.source != "none")
    for p in e.settings:
        found = simulate(image, choices.grid, p, data)
        assert found.indices.shape == (1, *choices.grid.shape)
        assert (found.n_mismatched.max() > 0) == (not p.exact_data)


@pytest.mark.parametrize("name", NAMES)
def test_an_example_says_what_to_look_at_and_fits_into_an_address(name):
    e = example(name)
    assert e.title
    assert 1 <= e.text.count(". ") + 1 <= 3
    assert len(e.text) < 300
    assert e.task.endswith("?")
    assert len(e.task) < 110
    found, _, notes = read_link(link_of(e.choices))
    assert (found, notes) == (e.choices, ())
    assert len(set(e.settings)) == len(e.others) + 1


def test_the_lecture_goes_through_every_example_once():
    assert len(set(NAMES)) == len(EXAMPLES) == sum(len(part.examples) for part in LECTURE_PARTS)
    walked, now = [NAMES[0]], next_example(NAMES[0])
    while now is not None:
        walked.append(now.name)
        now = next_example(now.name)
    assert walked == NAMES
    assert example_named("nothing") is next_example("nothing") is None


@pytest.mark.parametrize("name", ["delta", "bend"])
def test_keeping_patches_in_their_place_draws_them_from_nearby(name):
    e = example(name)
    image, shape = image_of(e.choices.image), e.choices.grid.shape
    assert image.shape == shape
    own = np.indices(shape)
    off = []
    for p in e.settings:
        found = simulate(image, shape, p, n_realizations=4, keep_sources=True)
        places = np.stack(np.divmod(sources_of(found), shape[1]), axis=1)
        off.append(np.abs(places - own).mean())
    assert off[1] < 0.5 * off[0]


def test_the_mouth_bars_stay_in_the_east_where_patches_keep_their_place(by_setting):
    free, kept = by_setting("delta")
    west = (slice(None), slice(None), slice(0, 100))
    assert not np.any(kept.training_image.indices[:, :100] == 2)
    assert np.mean(free.indices[west] == 2) > 10 * np.mean(kept.indices[west] == 2)


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["small-template", "thin-overlap", "high-level", "candidates", "no-refine"]
)
def test_bad_parameters_make_shapes_that_the_image_does_not_have(by_setting, name):
    bad, good = (2 if name == "candidates" else 0), 1
    ensembles = by_setting(name)
    image = ensembles[0].training_image
    known = np.unique(window_codes(image.indices, image.n_facies))
    new = [np.mean([new_shapes(r, image.n_facies, known)[1] for r in e.indices]) for e in ensembles]
    assert new[bad] > 1.2 * new[good]


@pytest.mark.slow
def test_a_level_too_high_along_z_breaks_the_lenses(by_setting):
    coarse, fine = by_setting("volume-lenses", whole=True)
    new = [unseen_patterns(e, e.training_image).mean() for e in (coarse, fine)]
    assert new[0] > 1.3 * new[1]


@pytest.mark.slow
def test_a_location_weight_along_z_keeps_the_order_of_the_beds(by_setting):
    free, kept = by_setting("volume-trend")
    own = vertical_proportions(free.training_image)[0]
    off = [np.abs(vertical_proportions(e).mean(axis=0) - own).mean() for e in (free, kept)]
    assert off[1] < 0.9 * off[0]


@pytest.mark.slow
def test_wells_make_cells_certain_and_leave_others_open(by_setting):
    (e,) = by_setting("volume-wells")
    entropy = etype(e).entropy
    assert (entropy[tuple(e.hard_data.cells.T)] == 0).all()
    assert entropy.mean() > 0.2


@pytest.mark.slow
def test_pictures_of_volumes_are_slices():
    for name, sizes in (
        ("volume-channels", [(160, 160), (80, 80), (80, 48)]),
        ("volume-lenses", [(160, 48), (80, 48), (80, 48)]),
    ):
        pictures = pictures_of(example(name), LIGHT).work(lambda share: None)
        assert [(p.nx, p.ny) for p in pictures] == sizes
        for p in pictures:
            png = b64decode(re.search(r"base64,([^\"]+)", p.content)[1])
            width, height = Image.open(BytesIO(png)).size
            assert width / height == pytest.approx(p.nx / p.ny, rel=0.02)


def test_one_candidate_copies_longer_pieces():
    e = example("candidates")
    image = image_of(e.choices.image)
    blocks = []
    for p in e.settings:
        found = simulate(image, e.choices.grid, p, n_realizations=4, keep_sources=True)
        blocks.append(np.mean([copying(s, image.shape).largest_block for s in sources_of(found)]))
    assert blocks[0] > 1.5 * blocks[1]


@pytest.mark.slow
def test_pictures_are_of_the_study_and_keep_their_room():
    for name in ("two-point", "unconditional", "candidates"):
        e = example(name)
        pictures = pictures_of(e, LIGHT).work(lambda share: None)
        assert [replace(p, content="<i></i>") for p in pictures] == expected_pictures(e)
        before, after = pictures_html(e, None), pictures_html(e, pictures)
        assert "aria-busy" in before
        assert "aria-busy" not in after
        assert after.count("<img") == before.count("<i>") == len(pictures)
    assert small(Choices()).grid.shape == (300, 300)
    assert [picture.label for picture in expected_pictures(EXAMPLES[0])][1:] == [
        "realization 1",
        "realization 2",
    ]
    assert pictures_of(e, LIGHT).key != pictures_of(replace(e, others=()), LIGHT).key


@pytest.mark.slow
def test_connected_sand_lets_water_through_about_a_hundred_times_earlier():
    e = example("breakthrough")
    image, grid = image_of(e.choices.image), e.choices.grid
    two_point = simulate_two_point(image, grid, 4, e.choices.seed)
    channels = simulate(image, grid, e.choices.parameters, n_realizations=4, seed=e.choices.seed)
    half = [
        np.median([np.argmax(arrived(one) >= 0.5) for one in indices]) * 3 / (N_LAGS - 1)
        for indices in (channels.indices, two_point.indices)
    ]  # decimal logarithms of the median times
    assert 1.5 < half[1] - half[0] < 2.5
    assert abs(np.mean(two_point.indices == 1) - np.mean(channels.indices == 1)) < 0.04


@pytest.mark.slow
def test_an_example_takes_the_place_of_a_study_that_comes_back():
    app = launched()
    state = state_of(app)
    state.change_compare(n=5)
    open_example(state, example("delta"))
    assert state.choices == example("delta").choices
    assert state.job is not None
    compare_example(state, example("candidates"))
    assert state.compare.others == example("candidates").others
    back_to_own(state)
    assert (state.choices, state.ensemble, state.job) == (OWN, None, None)
    assert state.compare.others == (None, None)
    assert state.compare.n == 5
    back_to_own(state)  # no study is left to restore
    assert state.choices == OWN


@pytest.mark.slow
def test_the_page_shows_every_example():
    app = launched()
    assert not [key for key in (b.key for b in app.button) if key == "back_to_own"]
    for e in EXAMPLES:
        assert e.title in html(app)
        assert named(app.button, f"open_{e.name}")
        assert any(b.key == f"compare_{e.name}" for b in app.button) == bool(e.others)


@pytest.mark.slow
def test_a_click_opens_an_example_and_another_goes_back():
    app = launched()
    quiet(app.button(key="open_delta").click().run())
    state = state_of(app)
    assert state.choices == example("delta").choices
    assert state.page(Examples).opened == "delta"
    quiet(app.button(key="back_to_own").click().run())
    assert state_of(app).choices == OWN


@pytest.mark.slow
def test_simulate_says_which_example_is_open():
    state = State(choices=OWN)
    open_example(state, replace(example("delta"), choices=OWN))
    app = quiet(opened("simulate", state).run())
    assert "Example 11: A delta" in html(app)
    app.button(key="compare_opened").click().run()
    assert state.compare.others == example("delta").others
    quiet(app.button(key="keep_example").click().run())
    assert "Example 11" not in html(app)
    assert state_of(app).page(Examples).kept is None


@pytest.mark.slow
def test_a_round_has_one_piece_of_the_image_and_the_rest_of_realizations():
    image = datasets.load("channels")
    drawn = draw_round(image, Parameters(wavelet_level=3, refine=False), seed=3)
    again = draw_round(image, Parameters(wavelet_level=3, refine=False), seed=3)
    np.testing.assert_array_equal(drawn.pictures, again.pictures)
    assert drawn.answer == again.answer
    for k, picture in enumerate(drawn.pictures):
        taken = drawn.sources[k] >= 0  # except single cells changed by seam repair
        assert taken.mean() > 0.99
        own = image.indices.ravel()[drawn.sources[k][taken]]
        np.testing.assert_array_equal(own, picture[taken])
        whole = len(places_of(picture, image.indices)) > 0
        assert whole == (k == drawn.answer) == (drawn.shapes_at(k)[1] == 0)
        assert (drawn.copying_of(k).largest_square == len(picture)) == (k == drawn.answer)
    assert drawn.easiest != drawn.answer
    assert piece_side(image.shape) == len(drawn.pictures[0]) == 96
    assert piece_side((100, 300)) == 50


@pytest.mark.slow
def test_the_answer_has_no_favourite_place():
    image = datasets.load("channels")
    places = Counter(draw_round(image, Parameters(), seed).answer for seed in range(60))
    assert set(places) == set(range(N_PICTURES))
    assert max(places.values()) < 25


def test_new_shapes_are_those_that_brute_force_finds():
    image, other = blobs((40, 44), 3, seed=1), blobs((20, 23), 3, seed=2)
    other[4:14, 5:15] = image[10:20, 20:30]
    where, share = new_shapes(other, 3, np.unique(window_codes(image, 3)))
    expected_new = np.zeros(where.shape, bool)
    count = 0
    for row in range(other.shape[0] - WINDOW_SIDE + 1):
        for column in range(other.shape[1] - WINDOW_SIDE + 1):
            window = other[row : row + WINDOW_SIDE, column : column + WINDOW_SIDE]
            if not len(places_of(window, image)):
                count += 1
                expected_new[row + 2 : row + 4, column + 2 : column + 4] = True
    np.testing.assert_array_equal(where, expected_new)
    assert share == pytest.approx(count / ((20 - WINDOW_SIDE + 1) * (23 - WINDOW_SIDE + 1)))
    assert 0 < share < 1


def test_only_the_first_pick_of_a_round_counts():
    quiz = Quiz()
    pick(quiz, 0)
    assert not quiz.tallies
    quiz.job = Job(lambda _: draw_round(datasets.load("channels"), Parameters(), seed=1))
    assert quiz.job.wait(60)
    assert quiz.round is not None
    wrong = (quiz.round.answer + 1) % N_PICTURES
    pick(quiz, 99)
    pick(quiz, wrong)
    pick(quiz, quiz.round.answer)
    assert quiz.picked == wrong
    assert quiz.tallies == {"channels, level 2, K 20": (0, 1)}
    assert f"picture {quiz.round.answer + 1}" in describe_verdict(wrong, quiz.round)
    assert describe_verdict(quiz.round.answer, quiz.round).startswith("Yes")
    share = 100 * quiz.round.shapes_at(wrong)[1]
    assert f"{share:.1f} % of the 6 × 6 windows" in " ".join(describe_seams(quiz.round, wrong))
    used = piece_map(quiz.round, wrong, ["#000000", "#ffffff"]).indices < 2
    np.testing.assert_array_equal(used, quiz.round.copying_of(wrong).uses > 0)


@pytest.mark.slow
def test_the_quiz_counts_by_setting_and_goes_on():
    app = launched()
    named(app.button_group, "examples_view").set_value("quiz").run()
    first = round_of(app)
    quiz = state_of(app).page(Quiz)
    pick(quiz, first.answer)
    quiet(app.run())
    assert "1 of 1 found" in html(app)
    assert f"Yes: picture {first.answer + 1}" in html(app)
    app.button(key="quiz_next").click().run()
    assert round_of(app) is not first
    named(app.selectbox, "quiz_level").set_value(3).run()
    named(app.checkbox, "quiz_refine").set_value(False).run()
    third = round_of(app)
    assert third.parameters.wavelet_level == 3
    assert not third.parameters.refine
    pick(quiz, third.answer)
    quiet(app.run())
    assert quiz.tallies == {
        "channels, level 2, K 20": (1, 1),
        "channels, level 3, K 20, no refine": (1, 1),
    }
    assert "2 of 2 found" in html(app)


@pytest.mark.slow
def test_everyone_of_a_class_has_a_seed_of_their_own_and_the_same_study():
    link = class_link(OWN, "http://lab:8501/examples?seed=5")
    assert link.startswith("http://lab:8501/simulate?")
    query = {name: values[0] for name, values in parse_qs(urlsplit(link).query).items()}
    assert query["class"] == "1"
    assert "seed" not in query
    readers = [state_of(followed(query)) for _ in range(2)]
    seeds = [state.choices.seed for state in readers]
    assert len({*seeds, OWN.seed}) == 3
    for state, seed in zip(readers, seeds, strict=True):
        assert replace(state.choices, seed=OWN.seed) == OWN
        assert state.own_seed == seed


@pytest.mark.slow
def test_a_seed_stays_for_the_session_and_examples_take_it():
    app = followed({"ti": "bend", "class": "1"})
    seed = state_of(app).choices.seed
    quiet(app.run())
    assert state_of(app).choices.seed == seed
    assert "class" not in app.query_params
    assert app.query_params["seed"] in (str(seed), [str(seed)])  # a reload keeps the seed
    open_example(state_of(app), example("delta"))
    assert state_of(app).choices == replace(example("delta").choices, seed=seed)


def test_the_lecture_sheet_has_every_task_and_on_its_last_page_every_answer():
    sheet = lecture_sheet("http://lab:8501/examples?seed=5")
    *parts, short, answers = sheet.sections
    assert [part.note for part in parts] == [f"{part.minutes} minutes" for part in LECTURE_PARTS]
    assert [part.on_new_page for part in (*parts, short)] == [False] * (len(LECTURE_PARTS) + 1)
    assert answers.on_new_page
    screens = page_labels("lecture_in_20_minutes").items()
    for text, (title, (minutes, address, show, ask)) in zip(short.blocks, screens, strict=True):
        assert text.words == f"{title}, {minutes} minutes: {show} {ask}"
        assert text.link == f"http://lab:8501/{address}"
    tasks = [text for part in parts for text in part.blocks]
    for number, (e, task, answer) in enumerate(zip(EXAMPLES, tasks, answers.blocks, strict=True)):
        assert task.words == f"{number + 1}. {e.title}: {e.task}"
        assert answer.words.startswith(f"{number + 1}. {e.title}: {e.text.strip()[:4]}")
        assert not {"`", "*"} & set(task.words + answer.words)
        query = parse_qs(urlsplit(task.link).query)
        assert task.link.startswith(f"http://lab:8501/{'compare' if e.others else 'simulate'}")
        assert read_link(query)[0] == e.choices
        assert not read_link(query)[2]
    assert sheet.subtitle.endswith("The dashboard is at http://lab:8501/")
    page = report_html(sheet)
    assert "src=" not in page
    assert "<script" not in page
    assert "A4" in page


@pytest.mark.parametrize("name", ["levels", "methods"])
def test_the_address_of_an_example_with_several_settings_opens_them_on_compare(name):
    address = example_address(example(name), "http://lab:8501/examples")
    app = followed(dict(parse_qsl(urlsplit(address).query)), urlsplit(address).path[1:])
    assert compared_settings(state_of(app)) == example(name).settings
    assert not state_of(app).notes


def test_a_short_lecture_has_six_screens_with_readable_addresses():
    screens = page_labels("lecture_in_20_minutes")
    assert len(screens) == 6
    assert next(iter(screens)) == "The paper beside ours"
    assert sum(minutes for minutes, *_ in screens.values()) == 20
    how_to = (ROOT / "docs" / "how-to" / "examples.md").read_text("utf-8")
    state = State(choices=OWN)
    state.page(Examples).view = "short"
    page = html(quiet(opened("examples", state).run()))
    for title, (minutes, address, show, ask) in screens.items():
        name, _, query = address.partition("?")
        assert (ROOT / "pages" / f"{name}.py").is_file()
        choices, _, notes = read_link(parse_qs(query))
        assert not notes
        assert bool(query) == (choices != Choices())
        assert ask.endswith("?")
        assert f"| {title} | `/{address}` | {minutes} | {show} | {ask} |" in how_to
        link = f'<a href="{escape(address)}" target="_blank">{title}</a>'
        assert f"<th>{link}</th><td>{minutes}</td><td>{show}</td><td>{ask}</td>" in page


@pytest.mark.slow
def test_the_page_gives_the_lecture_sheet():
    downloads = [button.proto.label for button in launched().get("download_button")]
    assert downloads == ["Lecture sheet"]


def test_simulate_shows_the_seed_of_the_class():
    state = State(choices=replace(OWN, seed=4321), own_seed=4321)
    app = quiet(opened("simulate", state).run())
    assert "Your own seed in this class is 4321" in html(app)
