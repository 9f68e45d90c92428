"""Test the grid that follows own files, and the buttons that fit or enlarge it."""

from __future__ import annotations

import json
from dataclasses import replace
from io import BytesIO

import numpy as np
import pytest
from streamlit.testing.v1 import AppTest

from ccwsim import Grid
from ccwsim.io import write_maps
from ccwsim.sharing.choices import Choices, DataChoice, GuideChoice, ImageChoice, Upload
from ccwsim.ui.session.resolve import data_of, described, fitting_grids, grids_for_data, image_of
from ccwsim.ui.session.state import State
from ccwsim.ui.study.data_step import use_data
from ccwsim.ui.study.guides_step import use_guides
from ccwsim.ui.study.image_step import import_image
from tests.ui.widgets import html, named, opened, texts

pytest.importorskip("rasterio")
WORLD = Grid(80, 100, (50.0, 50.0), (842000.0, 6520000.0), crs="EPSG:2154")
RASTER = Grid(60, 70, (50.0, 50.0), (842500.0, 6520500.0), crs="EPSG:2154")
RING = [[842600, 6520600], [845000, 6520600], [845000, 6523300], [842600, 6520600]]
ZONES = np.kron(np.indices((10, 10)).sum(axis=0) % 3 + 1, np.ones((8, 10))).astype(float)


def raster(name: str, grid: Grid, values: np.ndarray) -> Upload:
    file = BytesIO()
    write_maps(file, {"band": values}, grid, format="tif")
    return Upload(name, file.getvalue())


def wells(*places: tuple[float, float]) -> DataChoice:
    rows = "".join(f"{x},{y},{1 + k % 3}\n" for k, (x, y) in enumerate(places))
    return DataChoice("file", upload=Upload("wells.csv", f"x,y,facies\n{rows}".encode()))


INSIDE = (843010.0, 6521010.0), (845010.0, 6521010.0), (844010.0, 6523010.0)
NEAR = (*INSIDE, (847110.0, 6521010.0))
GAPPED = np.where(np.indices((80, 100)).sum(axis=0) > 160, np.nan, ZONES)
CORNER = raster("corner.tif", WORLD, GAPPED)


def study() -> State:
    """Return a session with an own image that has a gap in a corner."""
    state = State()
    assert not import_image(state, CORNER)
    return state


def pressed(state: State, key: str, page: str = "simulate") -> AppTest:
    """Return a page after a click on a button."""
    app = named(opened(page, state).run().button, key).click().run()
    assert not app.exception
    return app


def test_an_own_image_brings_its_grid_and_undo_takes_it_back():
    state = study()
    assert state.choices.grid == WORLD
    app = opened("simulate", state).run()
    assert "The grid follows the image corner" in html(app)
    assert "100 × 80 cells of 50 × 50 m from (842000, 6520000), EPSG:2154" in html(app)
    assert "The grid follows the image corner" in html(opened("import", study()).run())
    named(app.button, "grid_undo").click().run()
    assert not app.exception
    assert state.choices.grid == Grid(512, 512)
    assert state.choices.image.upload == CORNER
    assert "The grid follows" not in html(app)


def test_an_image_without_coordinates_brings_its_cells_but_moves_no_placed_grid():
    file = BytesIO()
    np.save(file, ZONES.astype(np.uint8))
    plain = Upload("plain.npy", file.getvalue())
    state = State()
    import_image(state, plain)
    assert state.choices.grid == Grid(80, 100)
    placed = State(choices=Choices(grid=RASTER))
    import_image(placed, plain)
    assert placed.choices.grid == RASTER


def test_a_new_name_of_a_facies_leaves_a_changed_grid_alone():
    state = study()
    state.change(grid=RASTER)
    app = opened("import", state).run()
    named(app.text_input, "image_name_1").set_value("clay").run()
    assert image_of(state.choices.image).facies_names[0] == "clay"
    assert state.choices.grid == RASTER


def test_a_gap_costs_only_its_cells_and_a_piece_is_cut_only_if_asked():
    state = study()
    known = image_of(state.choices.image).known
    assert known is not None
    assert np.array_equal(~known, np.isnan(GAPPED))
    app = opened("import", state).run()
    assert "The file" not in html(app)
    named(app.segmented_control, "ask_gaps").set_value("a piece").run()
    assert not app.exception
    assert image_of(state.choices.image).known is None
    assert "The file" in html(app)  # the original, beside the piece
    named(app.segmented_control, "ask_gaps").set_value("the whole image").run()
    assert state.choices.image.upload == CORNER
    assert state.choices.grid == WORLD


def test_data_elsewhere_bring_their_grid():
    state = State()
    use_data(state, wells(*INSIDE))
    assert state.fitted is not None
    assert state.fitted[0] == "The grid follows wells.csv."
    assert state.choices.grid.holds(state.choices.grid.cells_of(*np.transpose(INSIDE))).all()
    state = study()
    use_data(state, wells(*INSIDE))  # all inside
    assert state.choices.grid == WORLD


def test_data_in_degrees_do_not_move_a_grid_with_a_place():
    state = study()
    use_data(state, wells((2.9, 46.8), (2.8, 46.9)))
    assert state.choices.grid == WORLD
    assert state.data_draft is not None
    app = opened("import", state).run()
    assert "2 of 2 data outside the grid" in app.warning[0].value


@pytest.mark.parametrize("page", ["simulate", "import"])
def test_data_outside_are_dropped_or_the_grid_is_enlarged(page):
    part = "step_" if page == "simulate" else ""
    for key, n, grid in (
        ("ask_drop", 3, WORLD),
        ("ask_enlarge", 4, replace(WORLD, nx=103)),
    ):
        state = study()
        use_data(state, wells(*NEAR))
        assert state.data_draft is not None
        pressed(state, f"{part}{key}", page)
        assert state.data_draft is None
        assert data_of(state.choices).n == n
        assert state.choices.grid == grid


def test_a_grid_that_is_too_large_is_not_offered():
    state = study()
    use_data(state, wells(*INSIDE))
    state.change(grid=replace(WORLD, cell_size=(0.1, 0.1)))
    assert [*grids_for_data(state.choices)] == ["fit"]
    app = opened("simulate", state).run()
    assert "more than 10,000 cells along a side" in " ".join(k.value for k in app.caption)
    assert "outside the grid" in texts(app)  # the data are still in the study
    named(app.button, "step_ask_fit").click().run()
    assert data_of(state.choices).n == 3


def test_buttons_fit_the_grid_to_wells_outline_raster_and_image():
    state = study()
    use_data(state, wells(*INSIDE))
    ring = json.dumps({"type": "Polygon", "coordinates": [RING]}).encode()
    soft = raster("prob_2.tif", RASTER, np.full(RASTER.shape, 0.3))
    use_guides(state, GuideChoice(soft, active=Upload("catchment.geojson", ring)))
    state.data_draft, state.choices = None, replace(state.choices, data=wells(*INSIDE))
    grids = fitting_grids(state.choices, state.guides_draft or state.choices.guides)
    assert [*grids] == ["wells", "outline", "prob_2.tif", "image"]
    for name, grid in grids.items():
        assert grid.cell_size == WORLD.cell_size
        assert grid.crs == "EPSG:2154"
        app = opened("simulate", state).run()
        if grid == state.choices.grid:
            assert named(app.button, f"grid_to_{name}").disabled
            continue
        named(app.button, f"grid_to_{name}").click().run()
        assert not app.exception
        assert state.choices.grid == grid
        assert f"The grid fits {name}." in html(app)
        assert described(grid) in " ".join(k.value for k in app.caption)
    assert grids["prob_2.tif"] == RASTER
    assert grids["image"] == WORLD
    corners = np.array(RING, float)
    assert grids["outline"].holds(grids["outline"].cells_of(*corners.T)).all()


def test_a_raster_of_another_grid_has_its_button_below_the_message():
    state = study()
    use_guides(state, GuideChoice(raster("prob_2.tif", RASTER, np.full(RASTER.shape, 0.3))))
    app = pressed(state, "guides_to_prob_2.tif", "guides")
    assert state.choices.grid == RASTER
    assert state.guides_draft is None
    assert not app.error


def test_every_grid_of_data_has_the_label_of_a_button():
    from ccwsim.ui.study.questions import GRID_BUTTONS

    placed = Choices(image=ImageChoice(), data=wells((10.0, 20.0), (900.0, 20.0)))
    assert GRID_BUTTONS.keys() == {*grids_for_data(placed)}
