"""Test that pages draw and count only the active cells of a catchment."""

from __future__ import annotations

import json
import zlib
from base64 import b64decode
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from streamlit.testing.v1 import AppTest

from ccwsim import Grid, HardData, Parameters, Secondary, datasets
from ccwsim.model.missing import UNKNOWN
from ccwsim.sharing.choices import Choices, DataChoice, GuideChoice
from ccwsim.ui.compare.settings import ComparePageState
from ccwsim.ui.flow.solving import FlowState
from ccwsim.ui.session.state import State
from ccwsim.ui.sweep.planning import SweepState, start_sweep
from ccwsim.ui.validate.page import SECTIONS
from ccwsim.ui.validate.statistics import Validation
from tests.ui.widgets import opened
from tests.waiting import PATIENCE, wait_until

GRID = Grid(90, 110)
ROWS, COLUMNS = np.indices(GRID.shape)
ACTIVE = np.hypot(ROWS - 45, COLUMNS - 50) < 44
NOT_OF_REALIZATIONS = {"map_image", "map_mended", "map_empty"}
"""Maps that show no cells of the grid, or the squares around data."""


def catchment(**guides: Any) -> State:
    """Return a study with an outline, data on both sides of it, and its realizations."""
    image, rng = datasets.load("channels"), np.random.default_rng(0)
    cells = np.unique(rng.integers(0, GRID.shape, (40, 2)), axis=0)
    data = HardData(cells, image.array[tuple(cells.T)])
    east = np.tile(np.linspace(0.1, 0.5, GRID.nx), (GRID.ny, 1))
    secondary = Secondary(active=ACTIVE, probabilities={1: east}, **guides).fitted(GRID, image)
    choices = Choices(
        data=DataChoice("placed", placed=data), grid=GRID, parameters=Parameters(16, 4, 1),
        n_realizations=4, guides=GuideChoice(saved=secondary),
    )  # fmt: skip
    state = State(choices=choices)
    state.page(Validation).unfolded |= {name for name, *_ in SECTIONS}
    ranges = ("template_size", (16, 24)), ("overlap_size", (4,))
    state.change_sweep(ranges=ranges, n_realizations=2)
    state.change_compare(n=2)
    return state


def settled(page: str, state: State) -> AppTest:
    """Return a page after its runs and computations."""
    app = opened(page, state).run()

    def at_rest() -> bool:
        runs = state.job, state.page(ComparePageState).run, state.page(SweepState).run
        jobs = [run for run in (*runs, state.page(FlowState).run) if run is not None]
        assert all(job.wait(PATIENCE) for job in jobs)
        validation = state.page(Validation)
        waiting = dict(validation.waiting)
        for task in waiting.values():
            validation.worker.wait_for(task, PATIENCE)
        app.run()
        return state.job is None and not validation.waiting

    wait_until(at_rest, "the page")
    assert not app.exception
    assert not app.error
    return app


def maps_of(app: AppTest) -> Iterator[tuple[str, np.ndarray]]:
    """Yield name and cells of each map of the grid on a page."""
    for element in app.get("bidi_component"):
        content = json.loads(element.proto.json or "{}")
        if "cells" in content and (content.get("ny"), content.get("nx")) == GRID.shape:
            cells = np.frombuffer(zlib.decompress(b64decode(content["cells"])), np.uint8)
            yield element.proto.id.rsplit("-", 1)[-1], cells.reshape(GRID.shape)


@pytest.mark.parametrize("page", ["simulate", "data", "validate", "compare", "sweep", "flow"])
def test_maps_have_no_colour_outside_the_catchment(page):
    state = catchment(angle=20.0) if page == "validate" else catchment()
    settled("simulate", state)
    if page == "sweep":
        start_sweep(state)
    app = settled(page, state)
    maps = dict(maps_of(app))
    assert maps
    for name, cells in maps.items():
        if name not in NOT_OF_REALIZATIONS:
            assert (cells[~ACTIVE] == UNKNOWN).all(), name
            assert (cells[ACTIVE] != UNKNOWN).all(), name
    assert "not honoured" not in json.dumps([e.proto.json for e in app.get("bidi_component")])
