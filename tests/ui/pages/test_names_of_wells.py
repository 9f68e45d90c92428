"""Test that each page with data on a map gives the map the names of the wells."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest
from streamlit.testing.v1 import AppTest

from ccwsim import Grid, HardData, Parameters
from ccwsim.sharing.choices import Choices, DataChoice, ImageChoice, Upload
from ccwsim.ui.frontend import cells
from ccwsim.ui.hard_data.edits import take_data
from ccwsim.ui.results.maps import wells_of_data
from ccwsim.ui.session.resolve import data_of, wells_of
from ccwsim.ui.session.state import State
from ccwsim.ui.validate.statistics import Validation
from tests.ui.pages import (
    test_compare_page as compare,
    test_how_page as how_it_works,
    test_sweep_page as sweep,
)
from tests.ui.pages.test_data_of_volumes import run
from tests.ui.widgets import opened

WELLS = b"well,x,y,facies\nA-1,7.5,5.5,1\nA-1,8.5,6.5,1\nB 2,40.5,20.5,0\n,11.5,40.5,1\n"
NAMES = (("A-1", ((5, 7), (6, 8))), ("B 2", ((20, 40),)))
OWN = Parameters(template_size=16, overlap_size=4)
NAMED = DataChoice("file", upload=Upload("wells.csv", WELLS))
STUDY = Choices(data=NAMED, grid=Grid(48, 64), parameters=OWN, n_realizations=2)


def page(name: str) -> Callable[[], AppTest]:
    return lambda: opened(name, run(State(choices=STUDY))).run()


PAGES: dict[str, tuple[Callable[[], AppTest], set[str]]] = {
    "simulate": (page("simulate"), {"map_realization", "map_e_type"}),
    "data": (page("data"), {"editor", "map_e_type"}),
    "validate": (page("validate"), {"map_realization", "map_e_type"}),
    "compare": (lambda: compare.launched(STUDY), {"map_A", "map_B"}),
    "sweep": (lambda: sweep.launched(sweep.swept(choices=STUDY)), {"map_swept"}),
    "how it works": (lambda: how_it_works.launched(STUDY), {"map_how_grid"}),
}
"""For each page, a function that draws it, and the maps that have named wells."""


@pytest.fixture
def drawn(monkeypatch) -> dict[str, Any]:
    """Return a dict that collects the data of all maps that are drawn."""
    found: dict[str, Any] = {}
    draw = cells.draw_component

    def draw_and_keep(name: str, key: str, data: dict[str, Any], *args: Any, **options: Any):
        found[key] = data
        draw(name, key, data, *args, **options)

    monkeypatch.setattr(cells, "draw_component", draw_and_keep)
    return found


@pytest.mark.slow
@pytest.mark.parametrize("name", PAGES)
def test_each_page_names_the_wells_on_its_maps(name, drawn):
    open_page, maps = PAGES[name]
    assert not open_page().exception
    wanted = [[well, list(map(list, path))] for well, path in NAMES]
    assert maps <= drawn.keys()
    assert {key: drawn[key]["wells"] for key in maps} == dict.fromkeys(maps, wanted)


VOLUME_WELLS = b"""well,x,y,z,facies
D-1,7.5,5.5,0.5,1
D-1,7.5,5.5,1.5,1
D-1,8.5,5.5,2.5,1
E,20.5,9.5,1.5,0
"""
SLICES = {
    (0, 1): (("D-1", ((5, 7),)), ("E", ((9, 20),))),  # layer 1
    (0, 2): (("D-1", ((5, 8),)),),
    (1, 5): (("D-1", ((0, 7), (1, 7), (2, 8))),),  # a section along the deviated well
    (2, 20): (("E", ((1, 9),)),),
    (1, 0): (),
}
"""Named wells, with their cells, in slices of a volume by axis and index."""


@pytest.mark.slow
def test_a_slice_names_the_wells_that_it_meets(drawn):
    study = Choices(
        image=ImageChoice("sinuous_channels"),
        data=DataChoice("file", upload=Upload("wells.csv", VOLUME_WELLS)),
        grid=Grid(24, 30, (1.0, 1.0, 1.0), (0.0, 0.0, 0.0), nz=4),
        parameters=Parameters(wavelet_level=1, template_size=(4, 8, 8), overlap_size=(2, 2, 2)),
        n_realizations=2,
    )
    state = run(State(choices=study))
    for (axis, at), wells in SLICES.items():
        validation = state.page(Validation)
        validation.slice_axis, validation.slice_at = axis, {axis: at}
        drawn.clear()
        assert not opened("validate", state).run().exception
        wanted = [[name, list(map(list, path))] for name, path in wells]
        for key in ("map_realization", "map_e_type"):
            assert drawn[key]["wells"] == wanted, (axis, at, key)


def test_wells_keep_their_names_on_a_map_that_is_edited():
    state = State(choices=STUDY)
    data = data_of(STUDY)
    assert wells_of(STUDY) == NAMES
    more = HardData([*data.cells.tolist(), [1, 1]], [*data.facies.tolist(), 0])
    take_data(state, more, wells=wells_of(STUDY))
    assert wells_of(state.choices) == NAMES


def test_only_data_of_the_study_have_the_names_of_its_wells():
    state = State(choices=STUDY)
    assert wells_of_data(state, data_of(STUDY)) == NAMES
    assert wells_of_data(state, HardData([[5, 7]], [1])) == ()
    state.choices = replace(STUDY, grid=Grid(16, 16))  # the wells are outside this grid
    assert wells_of_data(state, data_of(STUDY)) == ()
