"""Test studies of a continuous variable on the pages."""

from __future__ import annotations

from io import BytesIO

import numpy as np
import pytest
from PIL import Image

from ccwsim import Ensemble, Grid, HardData, Parameters, TrainingImage
from ccwsim.sharing.choices import Choices, DataChoice, ImageChoice, Upload
from ccwsim.ui.frontend.cells import map_of_values, number_map
from ccwsim.ui.hard_data.edits import Editor, take_edits
from ccwsim.ui.hard_data.table import data_of_rows, rows_of
from ccwsim.ui.results import charts, maps
from ccwsim.ui.session.resolve import data_of, image_of, imported_data
from ccwsim.ui.session.state import KEY, State
from ccwsim.ui.simulate.results import download_groups
from tests.ui.widgets import charts as charts_of, html, named, opened, texts


def relief(shape: tuple[int, int] = (90, 100)) -> np.ndarray:
    """Return a smooth field of values from about 80 to 320."""
    y, x = (np.linspace(0, n / 9, n) for n in shape)
    noise = np.random.default_rng(1).normal(size=shape)
    return 200 + 60 * np.add.outer(np.sin(y), np.cos(1.3 * x)) + noise


def choices(**changes) -> Choices:
    content = BytesIO()
    np.save(content, relief())
    answers = ("continuous", True), ("units", "m")
    image = ImageChoice(upload=Upload("elevation.npy", content.getvalue()), answers=answers)
    values = {"elevation": [120.5, 310.25, 200.0]}
    placed = HardData([[3, 4], [20, 30], [40, 9]], values=values)
    study = {
        "image": image,
        "data": DataChoice("placed", placed=placed),
        "grid": Grid(50, 60),
        "parameters": Parameters(16, 4, 1),
        "n_realizations": 3,
    }
    return Choices(**(study | changes))


def drawn(page: str, study: Choices):
    app = opened(page, State(choices=study)).run()
    state = app.session_state[KEY]
    if state.job is not None:
        assert state.job.wait(60)
        app.run()
    assert not app.exception
    return app, state


@pytest.fixture(scope="module")
def ran() -> tuple[State, Ensemble]:
    _, state = drawn("simulate", choices())
    return state, state.ensemble


def test_simulate_shows_values_and_a_histogram():
    app, state = drawn("simulate", choices())
    assert texts(app) == ""
    ensemble = state.ensemble
    assert [*ensemble.values] == ["elevation"]
    assert ensemble.training_image.units == "m"
    assert not ensemble.n_mismatched.any()
    assert {"values_E", "values_N", "connection", "proportions"} <= charts_of(app)
    assert "Histogram" in html(app)
    assert "elevation &gt;" not in html(app).replace("τ of elevation &gt;", "")
    options = named(app.selectbox, "e_type").options
    assert options[:3] == ["probability above the threshold", "mean", "standard deviation"]


def test_the_threshold_moves_map_and_connectivity():
    app, state = drawn("simulate", choices())
    usual = maps.threshold_of(state, state.image)
    assert usual == state.image.median
    before = maps.uncertainty_map(state, state.ensemble, []).indices
    named(app.slider, "threshold").set_value(260.0).run()
    state = app.session_state[KEY]
    assert state.threshold == pytest.approx(260, abs=2)
    after = maps.uncertainty_map(state, state.ensemble, [])
    above = state.ensemble.values_of() > state.threshold
    assert (after.indices == np.rint(200 * above.mean(axis=0))).all()
    assert (after.indices != before).any()
    shown = maps.as_facies(state, state.ensemble)
    assert (shown.indices == above).all()
    assert f"elevation > {state.threshold:.0f} m" in shown.training_image.facies_names


@pytest.mark.parametrize("e_type", ["mean", "deviation", "P10", "P50", "P90"])
def test_an_uncertainty_map_shows_a_statistic_of_the_values(ran, e_type):
    state, ensemble = ran
    state.e_type = e_type
    shown = maps.uncertainty_map(state, ensemble, [])
    values = ensemble.values_of()
    wanted = {
        "mean": values.mean(axis=0),
        "deviation": values.std(axis=0),
        **{f"P{q}": np.quantile(values, q / 100, axis=0) for q in (10, 50, 90)},
    }[e_type]
    texts_of_cells = [float(shown.labels[k].split()[-2]) for k in shown.indices.ravel()]
    step = np.ptp(wanted) / 150 + 1
    np.testing.assert_allclose(texts_of_cells, wanted.ravel(), atol=step)
    assert all(label.endswith(" m") for label in shown.labels)
    state.e_type = "entropy"  # of another image
    assert "Probability" in maps.uncertainty_map(state, ensemble, []).alt


def test_colours_are_for_the_range_of_image_and_data():
    image = TrainingImage.from_array(relief(), continuous=True, variable="z", units="m")
    data = HardData([[0, 0]], values={"z": [900.0]})
    shown = map_of_values(np.array([[900.0, np.nan]]), image, data, "a map")
    assert shown.indices.tolist() == [[200, 255]]
    assert shown.labels[200] == "z 900 m"
    assert shown.strip["high"] == "900 m"
    assert number_map(np.array([[0.25]]), "P =", "").labels[50] == "P = 0.25"


def test_a_turned_image_keeps_its_values():
    study = choices()
    image = study.image
    for flips in ({"flip_ew": True}, {"flip_ns": True}, {"transpose": True}):
        turned = image_of(ImageChoice(upload=image.upload, answers=image.answers, **flips))
        back = turned.values["elevation"]
        back = back[:, ::-1] if "flip_ew" in flips else back
        back = back[::-1] if "flip_ns" in flips else back
        back = back.T if "transpose" in flips else back
        assert (back == relief()).all()
        assert turned.facies_names == image_of(image).facies_names


def test_a_file_of_points_gives_values_and_the_table_edits_them():
    file = Upload("points.csv", b"x,y,elevation\n4.5,3.5,120.75\n30.5,20.5,310.5\n")
    study = choices(data=DataChoice("file", upload=file))
    data, image = data_of(study), image_of(study.image)
    assert data.values["elevation"].tolist() == [120.75, 310.5]
    rows = rows_of(data, study.grid, True, (), "elevation")
    assert rows.columns.tolist() == ["x", "y", "elevation"]
    rows.loc[0, "elevation"] = 99.5
    edited, notes = data_of_rows(rows, study.grid, image, True)
    assert (edited.values["elevation"].tolist(), notes) == ([99.5, 310.5], [])
    assert edited.facies[0] == 0  # the lowest class
    app, _ = drawn("data", study)
    assert texts(app) == ""


def test_facies_are_refused_for_an_image_of_values():
    study = choices(data=DataChoice("placed", placed=HardData([[0, 0]], [1])))
    with pytest.raises(Exception, match="hard data have facies, but the training image has elev"):
        imported_data(study)


def test_a_brush_places_the_median_of_a_class_and_a_moved_datum_keeps_its_value():
    state = State(choices=choices())
    state.pages[Editor] = Editor()
    image = state.image
    take_edits(state, [{"seq": 1, "set": [[10, 10, 7]]}])
    placed = data_of(state.choices)
    assert placed.triples[1] == (10, 10, image.class_medians[7])
    index = int(placed.facies[placed.triples.index((20, 30, 310.25))])
    take_edits(state, [{"seq": 2, "set": [[20, 30, -1], [21, 31, index]]}])
    assert (21, 31, 310.25) in data_of(state.choices).triples
    n = data_of(state.choices).n
    take_edits(state, [{"seq": 3, "set": [[21, 31, -1], [22, 32, -1]]}])  # one cell is empty
    assert data_of(state.choices).n == n - 1
    take_edits(state, [{"seq": 4, "set": [[0, 0, -1], [5, 5, 0]]}])  # nothing was moved
    assert (5, 5, image.class_medians[0]) in data_of(state.choices).triples


@pytest.mark.parametrize("way", ["sampled", "menu"])
def test_sampled_data_have_values(way):
    study = choices(data=DataChoice("sampled", n_sampled=30))
    if way == "sampled":
        data = data_of(study)
    else:
        app, _ = drawn("data", choices(data=DataChoice()))
        named(app.button, "sample_take").click().run()
        data = data_of(app.session_state[KEY].choices)
        fields = app.session_state[KEY].ensemble.values_of()
        assert fields.shape == (3, 50, 60)
    assert data.n in (30, 100)
    assert len(np.unique(data.values["elevation"])) > 20


@pytest.mark.slow
@pytest.mark.parametrize("page", ["validate", "compare", "flow", "how_it_works", "guides", "sweep"])
def test_each_page_takes_a_study_of_values(page):
    app, _ = drawn(page, choices())
    assert texts(app) == ""


def test_the_curves_of_values_are_judged_against_crops(ran):
    _, ensemble = ran
    fit = charts.fit_of(ensemble, "values", 0, "E-W")
    assert fit.judged
    sill = ensemble.training_image.sorted_values.var()
    assert (np.abs(fit.reference) < 2 * sill).all()
    bundle = charts.histogram_of(ensemble)
    assert np.allclose(bundle.each.sum(axis=1), 100)
    assert np.isclose(bundle.reference.sum(), 100)


def test_the_import_page_keeps_values_and_hides_names_of_classes():
    study = choices()
    draft = ImageChoice(upload=study.image.upload, answers=(("threshold", 200.0),))
    app = opened("import", State(choices=Choices(), image_draft=draft)).run()
    assert not app.exception
    named(app.get("button_group"), "ask_values").set_value("keep values").run()
    state = app.session_state[KEY]
    assert dict(state.image_draft.answers)["continuous"] is True
    assert "100 × 90 cells, elevation" in html(app)
    named(app.text_input, "ask_units").set_value("m").run()
    state = app.session_state[KEY]
    assert dict(state.image_draft.answers)["units"] == "m"
    assert image_of(state.image_draft).units == "m"


def test_values_are_used_as_conductivities_on_the_page_flow():
    app, _ = drawn("flow", choices())
    named(app.get("button_group"), "flow_values").set_value("log K").run()
    state = app.session_state[KEY]
    assert state.flow.values_are == "log K"
    assert not [field for field in app.select_slider if field.key.startswith("flow_k_")]
    (porosity,) = (f for f in app.number_input if f.key.startswith("flow_porosity_"))
    porosity.set_value(0.1).run()
    rocks = [rock for _, rock in app.session_state[KEY].flow.rocks]
    assert [porosity for _, porosity in rocks] == [0.1] * state.image.n_facies
    assert len({k for k, _ in rocks}) == state.image.n_facies  # as they were
    assert "10 to the power" in "".join(field.help for field in app.get("button_group"))


def test_every_file_offered_of_values_can_be_written(ran):
    _, ensemble = ran
    groups = download_groups(ensemble, ["#000000"] * 8, 0, 3, 200.0)
    files = {file.key: file for group in groups.values() for file in group}
    assert all(file.content() for file in files.values())
    with np.load(BytesIO(files["etype_npz"].content())) as saved:
        assert np.array_equal(saved["P90"], ensemble.quantile(0.9))
        assert np.array_equal(saved["P_above_200"], ensemble.exceedance(200.0))
    head = files["curves_csv"].content().decode()
    assert "connection,N-S,7," in head
    png = np.asarray(Image.open(BytesIO(files["realization_1_png"].content())).convert("RGB"))
    assert len(np.unique(png.reshape(-1, 3), axis=0)) > 8
