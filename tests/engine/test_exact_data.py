"""Test that with `exact_data` off, data affect only the search, and mismatches are reported."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st
from streamlit.testing.v1 import AppTest

from ccwsim import Grid, HardData, Parameters, TrainingImage, read_hard_data, revise, simulate
from ccwsim.model.ensemble import WRONG, Ensemble
from ccwsim.model.watch import UNWATCHED
from ccwsim.sharing.choices import Choices, DataChoice
from ccwsim.ui.hard_data.page import describe_answer, describe_data_status
from ccwsim.ui.session.state import KEY, State
from ccwsim.ui.study.run import part_of
from ccwsim.ui.validate.conditioning import (
    data_status_shares,
    describe_match,
    resimulation_map,
    wrong_points,
)
from ccwsim.ui.widgets.facts import facts_of
from tests.small_images import blobs

METHODS = ("ccwsim", "ms-ccsim", "ccsim")
SHAPE = (83, 61)
IMAGE = TrainingImage(np.array([4, -2, 90])[blobs((64, 75), 3)])


def steering(method: str = "ccwsim", **others) -> Parameters:
    return Parameters(16, 8, 2, 5, method, exact_data=False, **others)


def scattered(n: int, seed: int = 0) -> HardData:
    rng = np.random.default_rng(seed)
    flat = rng.choice(SHAPE[0] * SHAPE[1], n, replace=False)
    return HardData(np.stack(np.divmod(flat, SHAPE[1]), axis=1), rng.choice(IMAGE.codes, n))


NUMBERS, SEEDS, VARIATIONS = st.integers(0, 300), st.integers(0, 2**20), st.sampled_from([0.0, 0.3])


@pytest.mark.slow
@given(st.sampled_from(METHODS), NUMBERS, SEEDS, st.booleans(), VARIATIONS)
def test_each_datum_is_told_as_met_or_wrong(method, n, seed, refine, variation):
    data = scattered(n, seed)
    p = steering(method, refine=refine, template_variation=variation)
    ensemble = simulate(IMAGE, SHAPE, p, data, n_realizations=2, seed=seed)
    rows, columns = data.cells.T
    wrong = ensemble.realizations[:, rows, columns] != data.facies
    np.testing.assert_array_equal(ensemble.data_status, np.where(wrong, WRONG, 0))
    np.testing.assert_array_equal(ensemble.n_wrong, ensemble.n_mismatched)
    assert np.isin(ensemble.realizations, IMAGE.codes).all()


@pytest.mark.parametrize("method", METHODS)
def test_data_steer_the_search(method):
    data = scattered(60)
    free = simulate(IMAGE, SHAPE, steering(method), None, 6)
    steered = simulate(IMAGE, SHAPE, steering(method), data, 6)
    by_chance = np.mean([data.n_mismatched(r) for r in free.realizations])
    assert 0 < steered.n_mismatched.mean() < 0.8 * by_chance


@pytest.mark.parametrize("method", METHODS)
def test_without_data_it_changes_nothing(method):
    exact = replace(steering(method), exact_data=True)
    one = simulate(IMAGE, SHAPE, exact, n_realizations=3)
    other = simulate(IMAGE, SHAPE, steering(method), n_realizations=3)
    np.testing.assert_array_equal(one.indices, other.indices)


def test_at_level_0_blocks_are_cells():
    data = scattered(90)
    cells = simulate(IMAGE, SHAPE, steering("ccsim"), data, 3)
    blocks = simulate(IMAGE, SHAPE, replace(steering(), wavelet_level=0), data, 3)
    np.testing.assert_array_equal(cells.indices, blocks.indices)


@pytest.mark.parametrize("method", METHODS)
def test_the_number_of_workers_does_not_change_the_result(method):
    data = scattered(200)
    one, three = (simulate(IMAGE, SHAPE, steering(method), data, 5, n_workers=n) for n in (1, 3))
    np.testing.assert_array_equal(one.indices, three.indices)
    np.testing.assert_array_equal(one.data_status, three.data_status)


def test_contradictory_data_in_one_block_are_told_for_what_they_are():
    cells = np.add(np.argwhere(np.ones((4, 4))), (40, 20))
    data = HardData(cells, np.array([4, -2])[cells.sum(axis=1) % 2])
    ensemble = simulate(IMAGE, SHAPE, steering(), data, 3)
    assert (ensemble.n_wrong > 0).all()
    assert ((ensemble.data_status == 0).sum(axis=1) + ensemble.n_wrong == 16).all()


def test_a_revision_marks_what_is_wrong_and_changes_no_cell():
    before = simulate(IMAGE, SHAPE, steering(), scattered(30), 3)
    data = scattered(80, seed=1)
    after = revise(before, data)
    np.testing.assert_array_equal(after.indices, before.indices)
    np.testing.assert_array_equal(after.n_wrong, after.n_mismatched)
    assert (after.n_wrong > 0).all()


@pytest.mark.slow
@pytest.mark.parametrize("level", [1, 2, 3])
@pytest.mark.parametrize("method", ["ccwsim", "ms-ccsim"])
def test_some_of_the_published_data_are_wrong_only_with_it_off(data_dir: Path, method, level):
    """Test the share of mismatches; the published CCWSIM code has 5.6, 6.5 and 13.3 %."""
    ti = TrainingImage(np.load(data_dir / "paper" / "ti_channel_256x256.npy"))
    data = read_hard_data(data_dir / "paper" / "hd_channel_400_grid512x512.csv", Grid(512, 512))
    off = Parameters(wavelet_level=level, method=method, exact_data=False)
    share = simulate(ti, (512, 512), off, data, 4).n_mismatched.mean() / data.n
    assert 0.01 < share < (0.2 if method == "ccwsim" else 0.33)
    on = simulate(ti, (512, 512), replace(off, exact_data=True), data, 2)
    assert on.n_mismatched.tolist() == [0, 0]


def wrongly_met() -> Ensemble:
    return simulate(IMAGE, SHAPE, steering(), scattered(80), 3)


def test_pages_say_how_many_are_wrong():
    ensemble = wrongly_met()
    n_wrong = ensemble.n_wrong
    fact = facts_of(ensemble)[0]
    assert fact.startswith("“Honour data exactly” is off: ")
    assert fact.endswith(f"of 80 data wrong ({100 * n_wrong.mean() / 80:.1f} %)")
    wrong = f"{n_wrong[1]} wrong, because “Honour data exactly” is off"
    assert wrong in describe_data_status(ensemble.data_status[1])
    names, shares = data_status_shares(ensemble)
    assert names == ["raster pass", "wrong"]
    assert shares[:, 1] * 80 == pytest.approx(n_wrong)
    assert "% not honoured" in describe_match(ensemble)
    assert len(wrong_points(ensemble)) == np.count_nonzero(
        (ensemble.data_status == WRONG).any(axis=0)
    )
    assert resimulation_map(ensemble, "#dddddd").indices.max() == 1  # none was re-simulated


SMALL = Choices(
    data=DataChoice("bundled", "channels_60_wells"),
    n_realizations=2,
    grid=Grid(512, 512),
    parameters=Parameters(16, 8, 3, method="ms-ccsim", exact_data=False),
)


@pytest.mark.slow
@pytest.mark.parametrize("page", ["pages/simulate.py", "pages/data.py", "pages/validate.py"])
def test_each_page_is_drawn_with_data_that_are_wrong(page):
    app = AppTest.from_file(str(Path(__file__).parents[2] / page), default_timeout=120)
    ensemble = part_of(SMALL)(0, SMALL.n_realizations, UNWATCHED)
    app.session_state[KEY] = State(choices=SMALL, ensemble=ensemble, ensemble_choices=SMALL)
    app.run()
    assert not app.exception
    assert not app.error
    shown = " ".join(element.proto.body for element in app.get("html"))
    assert "wrong" in shown or "not honoured" in shown


def test_the_editor_says_why_nothing_answers():
    state = State()
    state.ensemble = wrongly_met()
    assert "because “Honour data exactly” is off" in describe_answer(state, state.ensemble)
    local = revise(state.ensemble, scattered(20, seed=2))
    assert "edits condition only the next run's search" in describe_answer(state, local)
