"""Test that Validate draws every section for a volume, with the values of the metrics."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ccwsim import Grid, HardData, Parameters, TrainingImage, datasets, simulate
from ccwsim.metrics import (
    MEASURES,
    Measure,
    connectivity,
    diagnose,
    etype,
    fit_curve,
    fit_patterns,
    geobody_statistics,
    measure,
    unseen_patterns,
    vertical_proportions,
)
from ccwsim.model.arrays import describe_shape
from ccwsim.model.ensemble import FORCED, Ensemble
from ccwsim.model.numbers import three_digits
from ccwsim.model.parameters import fitted
from ccwsim.report.verdicts import (
    describe_curve,
    describe_patterns,
    describe_unseen,
)
from ccwsim.sharing.choices import Choices, DataChoice, ImageChoice
from ccwsim.ui.session.cached import shared_values
from ccwsim.ui.session.state import KEY, State
from ccwsim.ui.validate.conditioning import data_status_shares, scoring_problem, troubled_data
from ccwsim.ui.validate.page import SECTIONS
from ccwsim.ui.validate.reproduction import (
    describe_percolation,
    measures_csv,
    meter_of,
    sizes_of,
    strips_of,
)
from ccwsim.ui.validate.slices import ShownSlice, slice_of
from ccwsim.ui.validate.statistics import (
    Validation,
    copied,
    curves,
    geobodies,
    layers,
    reference_scores,
    volume_patterns,
)
from tests.metrics.volumes import a_volume
from tests.ui.pages.test_validate_page import launched, nothing, settled
from tests.ui.widgets import charts, csv_rows, html, named, texts

pytestmark = pytest.mark.slow
"""The tests are slow; `test_volume_study` tests a volume on the main pages in the quick tests."""

P = Parameters(template_size=(4, 8, 8), overlap_size=(2, 4, 4), wavelet_level=1)
GRID = Grid(20, 24, (25.0, 25.0, 2.0), (1000.0, 0.0, 100.0), nz=10)
CURVES = {f"{s}_{way}" for s in ("variogram", "connectivity") for way in "ENv"}
ALL = frozenset(name for name, *_ in SECTIONS)


@pytest.fixture(scope="module")
def image() -> TrainingImage:
    field = a_volume(1, (10, 40, 40), range(100), smooth=1.5)
    cells = np.where(field < np.linspace(60, 20, 10)[:, None, None], 7, 3)
    return TrainingImage(cells, facies_names=("mud", "sand"))


@pytest.fixture(scope="module")
def ensemble(image) -> Ensemble:
    """Return an ensemble with two wells; the data of one well contradict the surrounding cells."""
    well = [(k, 5, 6) for k in range(2, 10)]
    other = [(k, 14, 18) for k in range(10)]
    facies = [*image.array[2:10, 5, 6], *([3, 7] * 5)]
    return simulate(image, GRID, P, HardData([*well, *other], facies), n_realizations=4)


@pytest.fixture(scope="module")
def unconditional(image) -> Ensemble:
    return simulate(image, GRID, P, n_realizations=4)


@pytest.fixture(scope="module")
def app(ensemble):
    return launched(ensemble=ensemble, seen=ALL)


def test_every_section_is_drawn_with_wells(app):
    assert not texts(app)
    assert charts(app) >= CURVES | {"mds", "layers", "unseen", "unseen_at_data", "data_status"}
    assert charts(app) >= {"proportions", "gamma", "n_bodies", "euler", "largest", "sizes"}
    assert charts(app) >= {"anodi", "transiograms", "variogram_azimuth", "connectivity_azimuth"}
    assert not {"lags_image", "lags_mean", "lags_apart"} & charts(app)
    said = html(app)
    for name, *_ in SECTIONS:
        assert f'id="{name}"' in said
    assert "Variogram maps are drawn only for maps" in said


def test_every_section_is_drawn_without_wells(unconditional):
    app = launched(ensemble=unconditional, seen=ALL)
    assert not texts(app)
    assert "unseen" in charts(app)
    assert not {"unseen_at_data", "data_status"} & charts(app)
    assert "No hard data" in html(app)


def advised_for(name: str):
    """Return the page with the section on the training image, which is a bundled volume."""
    choices = Choices(ImageChoice(name), DataChoice(), Grid(20, 24, nz=10), P, n_realizations=2)
    e = simulate(datasets.load(name), choices.grid, P, n_realizations=2)
    own = {"ensemble_choices": choices, "last_attempt": choices}
    return launched(choices, frozenset({"image"}), ensemble=e, **own)


def test_the_study_of_a_volume_is_judged_and_takes_advice():
    app = advised_for("sinuous_channels")
    assert not app.error
    assert charts(app) >= CURVES | {"repetition", "quarters"}
    advised = diagnose(datasets.load("sinuous_channels")).advised("template_size")
    assert describe_shape(advised) in html(app)
    named(app.button, "use_advice").click().run()
    assert not app.error
    assert app.session_state[KEY].choices.parameters.template_size == advised


def test_a_trend_is_advised_and_means_nothing_in_a_map():
    app = advised_for("folded_layers")
    assert "<b>0.5 along z</b>" in html(app)
    named(app.button, "use_advice").click().run()
    assert not app.error
    taken = app.session_state[KEY].choices.parameters
    assert taken.location_weight == (0.5, 0.0, 0.0)
    assert fitted(taken, (200, 200)).location_weight == 0.0
    assert fitted(replace(taken, location_weight=(0.0, 2.0, 2.0)), (200, 200)).location_weight == 2


def test_verdicts_are_those_of_the_metrics(app, ensemble):
    said = html(app)
    for way in ("E-W", "N-S", "vertical"):
        for statistic in ("variogram", "connectivity"):
            verdict = describe_curve(fit_curve(ensemble, statistic, 7, way), statistic)
            assert f'title="{verdict.numbers}"' in said
            assert verdict.words in said
    assert "one image cannot tell this" in said
    for verdict in describe_patterns(fit_patterns(ensemble)):
        assert verdict.words in said
        assert verdict.numbers in said
    mask = np.zeros(GRID.shape, bool)
    mask[tuple(ensemble.hard_data.cells.T)] = True
    of_all = unseen_patterns(ensemble, ensemble.training_image).mean()
    at_data = unseen_patterns(ensemble, ensemble.training_image, mask=mask).mean()
    assert describe_unseen(of_all, at_data) in said
    assert f"All {ensemble.hard_data.n} data honoured in all 4 realizations" in said
    assert "20 × 20 × 10" in said


def test_statistics_are_those_of_the_metrics(ensemble, image):
    found = curves(ensemble, "connectivity", 1, "vertical").work(nothing).value
    assert found.each == pytest.approx(connectivity(ensemble, 7, "vertical", 5).tau, nan_ok=True)
    by_layer = layers(ensemble, 1).work(nothing)
    assert by_layer.each == pytest.approx(vertical_proportions(ensemble)[:, 1])
    assert by_layer.reference == pytest.approx(vertical_proportions(image)[0, 1])
    for neighbours in (6, 26):
        joined = geobodies(ensemble, 1, neighbours).work(nothing)
        own = geobody_statistics(ensemble, 7, neighbours)
        assert joined.each.n_geobodies.tolist() == own.n_geobodies.tolist()
        strips = {key: strip for _, key, strip in strips_of(joined)}
        assert strips["n_bodies"].title == "per 1,000,000 cells"
        assert strips["n_bodies"].each == pytest.approx(own.n_geobodies * 1e6 / GRID.n_cells)
        sizes = sizes_of(joined)
        assert sizes.each[:, 0] == pytest.approx(1)
        assert sizes.each[:, -1] == pytest.approx(0)
        assert "vertically in" in describe_percolation(joined, "sand")
    assert geobodies(ensemble, 1, 6) != geobodies(ensemble, 1, 26)
    copies = copied(ensemble, 1).work(nothing)
    side = copies.largest_square
    assert dict(meter_of(copies))["largest cube copied"] == f"{side} × {side} × {side} cells"


def test_unseen_patterns_at_data_come_only_with_data(ensemble, unconditional):
    assert volume_patterns(unconditional).work(nothing).unseen_at_data is None
    found = volume_patterns(ensemble).work(nothing)
    assert found.shape == (3, 3, 3)
    assert len(found.unseen) == len(found.unseen_at_data) == 4


def test_a_slice_is_the_part_of_cells_probabilities_and_data(ensemble):
    data = ensemble.hard_data
    for axis, at, shape in ((0, 4, (20, 24)), (1, 5, (10, 24)), (2, 18, (10, 20))):
        here = ShownSlice(axis, at)
        own = here.ensemble(ensemble)
        assert own.grid.shape == shape
        assert np.array_equal(own.indices, ensemble.indices.take(at, axis + 1))
        assert own.hard_data.n == (data.cells[:, axis] == at).sum() > 0
        assert not own.n_mismatched.any()
        assert own.data_status.shape == (4, own.hard_data.n)
        whole = etype(ensemble).probability
        assert etype(own).probability == pytest.approx(here.of(whole))
    section = ShownSlice(1, 5).ensemble(ensemble).grid
    assert (section.cell_size, section.origin) == ((25.0, 2.0), (1000.0, 100.0))
    across = ShownSlice(2, 18).ensemble(ensemble).grid
    assert (across.cell_size, across.origin) == ((25.0, 2.0), (0.0, 100.0))


def test_a_map_is_its_own_slice(image):
    flat = TrainingImage(image.array[0])
    own = simulate(flat, (20, 24), Parameters(template_size=8, overlap_size=4, wavelet_level=1))
    here = slice_of(State(), own)
    assert here.ensemble(own) is own
    assert here.of(own.indices) is own.indices
    assert str(here) == ""


def test_the_slice_can_be_chosen(ensemble):
    app = launched(ensemble=ensemble, seen=frozenset({"reuse"}))
    assert "at a seam, layer 5" in html(app)
    named(app.slider, "slice_layer").set_value(8).run()
    settled(app)
    assert "at a seam, layer 8" in html(app)
    named(app.get("button_group"), "slice").set_value(1).run()
    settled(app)
    assert "at a seam, row 10" in html(app)
    assert app.session_state[KEY].page(Validation).slice_at == {0: 8}


def test_the_share_of_certain_cells_is_of_the_whole_volume(ensemble):
    certain = 100 * (etype(ensemble).entropy < 0.05).mean()
    app = launched(ensemble=ensemble, seen=frozenset({"uncertainty"}))
    assert f"{three_digits(certain)} % of the cells are certain" in html(app)


def test_neighbours_can_be_chosen(ensemble):
    app = launched(ensemble=ensemble, seen=frozenset({"bodies"}))
    assert "touch at sides, edges or corners" in html(app)
    named(app.get("button_group"), "neighbours").set_value(6).run()
    settled(app)
    assert "touch at sides are connected" in html(app)


def test_data_that_took_trouble_are_listed_worst_first(ensemble):
    n = ensemble.hard_data.n
    status = np.zeros((4, n), np.int16)
    status[:3, 5] = 4
    status[0, 7] = FORCED
    indices = ensemble.indices.copy()
    k, row, column = ensemble.hard_data.cells[9]
    indices[1, k, row, column] ^= 1
    own = replace(ensemble, indices=indices, data_status=status)
    order, times = troubled_data(own)
    assert order.tolist() == [9, 7, 5]
    assert times[:, [9, 7, 5]].T.tolist() == [[1, 0, 0], [0, 1, 0], [0, 0, 3]]
    names, shares = data_status_shares(own)
    assert names == ["raster pass", "re-simulated, 4 cells long", "forced"]
    assert shares.sum(axis=1) == pytest.approx(1)
    app = launched(ensemble=own, seen=frozenset({"data"}))
    said = html(app)
    assert f"3 of {n} not honoured in the raster pass" in said
    x, y, z = GRID.centers_of(own.hard_data.cells[9:10])[0]
    assert f"{x:g}, {y:g}, {z:g}" in said


def test_a_reference_volume_is_scored(ensemble, image):
    truth = simulate(image, GRID, P, n_realizations=1, seed=99).realizations[0]
    scores, _ = reference_scores(ensemble, TrainingImage(truth)).work(nothing)
    assert scores.n_cells == GRID.n_cells - ensemble.hard_data.n
    app = launched(ensemble=ensemble, reference=TrainingImage(truth), seen=frozenset({"truth"}))
    assert f"of {scores.n_cells:,} cells without data predicted" in html(app)
    assert "calibration" in charts(app)
    assert "24 × 20 × 10" in scoring_problem(TrainingImage(truth[:5]), ensemble)


def test_a_grid_of_other_layers_is_judged_but_by_layer(image):
    thin = simulate(image, (6, 20, 24), P, n_realizations=3)
    app = launched(ensemble=thin, seen=ALL)
    assert not texts(app)
    assert "training image (10 layers) scaled to the grid" in html(app)


def test_a_volume_of_one_layer_is_judged(image):
    p = Parameters(template_size=(1, 8, 8), overlap_size=(0, 4, 4), wavelet_level=(0, 1, 1))
    flat = simulate(TrainingImage(image.array[:1]), (1, 20, 24), p, n_realizations=2)
    app = launched(ensemble=flat, seen=ALL)
    assert not texts(app)
    assert "1 × 3" not in html(app)
    assert "3 × 3 × 1 patterns" in html(app)


def test_measures_of_volumes_are_listed_beside_crops_and_saved(ensemble, monkeypatch):
    own = Measure("Bottom row, %", "Made up.", lambda of: of.inside[:, 0].mean((1, 2)), 0.5)
    monkeypatch.setattr("ccwsim.metrics.measures.MEASURES", (*MEASURES, own))
    shared_values.clear()  # earlier tests may have cached the table without this entry
    app = launched(ensemble=ensemble, seen=frozenset({"measures"}))
    said = html(app)
    for shown in MEASURES:
        assert (shown.title in said) is (shown.volumes is not False)
    assert "Bottom row, %" in said  # the page needs only an entry of the table
    rows = csv_rows(measures_csv(measure(ensemble, 7)))
    assert [row["measure"] for row in rows][-1] == "Bottom row, %"
    share = float(rows[0]["realization_2"])
    assert share == pytest.approx(100 * float(ensemble.proportions[1, 1]), abs=1e-3)
    shared_values.clear()
