"""Test that common work of several sessions is done once, and that sessions stay separate."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import streamlit as st

from ccwsim import simulate
from ccwsim.model.arrays import readonly
from ccwsim.model.numbers import duration
from ccwsim.run.simulation import simulate_study
from ccwsim.sharing.choices import Choices, ImageChoice
from ccwsim.ui.results import charts
from ccwsim.ui.session.resolve import image_of
from ccwsim.ui.session.state import State
from ccwsim.ui.study.run import collect, start_run
from tests.ui.test_pages import SMALL, launched
from tests.ui.widgets import html, light_charts

SLOW = 300


@pytest.fixture(autouse=True)
def _nothing_is_known_yet():
    st.cache_resource.clear()
    yield
    st.cache_resource.clear()


@pytest.fixture
def simulations(monkeypatch):
    """Return the list of the seeds of all simulated studies."""
    seeds = []

    def counted(study, n, **options):
        if not options["first_realization"]:  # a run may have parts
            seeds.append(study.seed)
        return simulate_study(study, n, **options)

    monkeypatch.setattr("ccwsim.ui.study.run.simulate_study", counted)
    return seeds


def ran(*studies: Choices) -> list[State]:
    """Return sessions that run their studies at the same time."""
    states = [State(choices=choices) for choices in studies]
    for state in states:
        start_run(state)
    for state in states:
        assert state.job.wait(SLOW)
        collect(state)
        assert not state.message
    return states


def test_sessions_with_the_same_study_simulate_it_once(simulations):
    ensembles = [state.ensemble for state in (*ran(SMALL, SMALL), *ran(SMALL))]
    assert simulations == [0]
    assert len(set(ensembles)) == 1
    alone = simulate(image_of(SMALL.image), SMALL.grid, SMALL.parameters, n_realizations=2)
    assert ensembles[0].digest == alone.digest
    assert (ensembles[0].cpu_seconds > 0).all()


@pytest.mark.parametrize(
    "changed",
    [
        {"seed": 1},
        {"n_realizations": 3},
        {"grid": replace(SMALL.grid, nx=65)},
        {"grid": replace(SMALL.grid, origin=(1.0, 0.0))},
        {"parameters": replace(SMALL.parameters, n_candidates=3)},
        {"image": ImageChoice(flip_ew=True)},
        {"image": ImageChoice(names=("shale", "sand"))},
    ],
)
def test_only_equal_studies_meet(simulations, changed):
    first, second = ran(SMALL, replace(SMALL, **changed))
    assert len(simulations) == 2
    assert first.ensemble is not second.ensemble


def test_a_session_sees_the_names_of_its_own_image():
    named = ImageChoice(names=("shale", "reef"))
    first, second = ran(SMALL, replace(SMALL, image=named))
    assert first.ensemble.digest == second.ensemble.digest
    assert "reef" not in first.ensemble.training_image.facies_names
    assert second.ensemble.training_image.facies_names == ("shale", "reef")


def test_a_second_session_is_sent_the_same_page_without_making_its_charts(monkeypatch):
    made = []

    def counted(*arguments, **options):
        made.append(1)
        return chart(*arguments, **options)

    chart = charts.curves_chart
    monkeypatch.setattr(charts, "curves_chart", counted)
    pages = [launched(path="pages/simulate.py") for _ in range(2)]
    assert len(made) == 3
    kinds = [[element.type for element in page.main] for page in pages]
    assert kinds[0] == kinds[1]
    specs = [[each.proto.json for each in light_charts(page)] for page in pages]
    assert len(specs[0]) == 5
    assert specs[0] == specs[1]


@pytest.mark.slow
def test_charts_in_other_names_and_times_are_their_own():
    (state,) = ran(SMALL)
    page = launched_with(state)
    named = launched(replace(SMALL, image=ImageChoice(names=("shale", "reef"))))
    assert " of reef" in specs_of(named)
    assert "reef" not in specs_of(page)
    slower = readonly(np.full(2, 9.0))
    state.ensemble = replace(state.ensemble, cpu_seconds=slower)
    later = launched_with(state)
    assert f"{duration(9.0)} CPU each" in html(later)
    assert specs_of(later) != specs_of(page)


def launched_with(state: State):
    page = launched(state.choices, "pages/simulate.py")
    page.session_state["ccwsim"] = state
    return page.run()


def specs_of(page) -> str:
    return " ".join(each.proto.json for each in light_charts(page))
