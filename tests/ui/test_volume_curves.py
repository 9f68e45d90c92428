"""Test curves of volumes along three axes and by layer, on the page and as a table."""

from __future__ import annotations

import numpy as np
import pytest
from streamlit.testing.v1 import AppTest

from ccwsim import Grid, HardData, Parameters, TrainingImage, simulate
from ccwsim.metrics import connectivity, fit_curve, variogram, vertical_proportions
from ccwsim.report.verdicts import describe_curve
from ccwsim.ui.results.charts import curve_bundle, vertical_proportions_bundle
from ccwsim.ui.simulate.results import curves_csv
from tests.metrics.volumes import a_volume
from tests.ui.widgets import charts, csv_rows, html

P = Parameters(template_size=(4, 8, 8), overlap_size=(2, 4, 4), wavelet_level=1)


@pytest.fixture(scope="module")
def ensemble():
    image = TrainingImage(
        a_volume(1, (10, 40, 40), (3, 7), smooth=1.5), facies_names=("mud", "sand")
    )
    grid = Grid(20, 24, (25.0, 25.0, 2.0), (0.0, 0.0, 100.0), nz=10)
    wells = HardData([[k, 5, 6] for k in range(4, 10)], image.array[4:10, 5, 6])
    return simulate(image, grid, P, wells, n_realizations=3)


def page(ensemble, axis="E-W"):
    """Draw the curves of the second facies."""
    from ccwsim.ui.results.charts import draw_facies_charts

    draw_facies_charts(ensemble, 1, axis)


def drawn(ensemble, axis="E-W") -> AppTest:
    app = AppTest.from_function(page, default_timeout=180, args=(ensemble, axis)).run()
    assert not app.exception
    return app


@pytest.mark.parametrize("way", ["E-W", "N-S", "vertical"])
def test_there_are_charts_along_the_chosen_axis_and_one_by_layer(ensemble, way):
    app = drawn(ensemble, way)
    assert charts(app) == {"layers", "times", f"variogram_{way[0]}", f"connectivity_{way[0]}"}
    said = html(app)
    for statistic in ("variogram", "connectivity"):
        verdict = describe_curve(fit_curve(ensemble, statistic, 7, way), statistic)
        assert verdict.words in said
        assert verdict.numbers in said
    assert ("Vertical variogram" in said) == (way == "vertical")
    assert "Vertical proportions" in said


def test_maps_keep_their_four_charts(ensemble):
    image = TrainingImage(ensemble.training_image.array[0])
    own = simulate(image, (20, 24), Parameters(template_size=8, overlap_size=4, wavelet_level=1))
    assert charts(drawn(own)) == {"variogram_E", "variogram_N", "connection", "times"}


def test_bundles_are_those_of_the_metrics(ensemble):
    for way, lags in (("E-W", 12), ("vertical", 5)):
        bundle = curve_bundle(ensemble, "variogram", 1, way)
        assert bundle.each == pytest.approx(variogram(ensemble, 7, way, lags).gamma)
        assert bundle.reference == pytest.approx(
            variogram(ensemble.training_image, 7, way, lags).gamma[0]
        )
    layers = vertical_proportions_bundle(ensemble, 1)
    assert layers.lags.tolist() == [101.0 + 2 * k for k in range(10)]
    assert layers.each == pytest.approx(vertical_proportions(ensemble)[:, 1])
    assert layers.median == pytest.approx(np.median(layers.each, axis=0))


def test_the_table_has_all_axes_and_all_layers(ensemble):
    rows = csv_rows(curves_csv(ensemble, 1))
    named = {(row["statistic"], row["direction"]) for row in rows}
    assert named == {("proportion", "vertical")} | {
        (statistic, way)
        for statistic in ("variogram", "connection")
        for way in ("E-W", "N-S", "vertical")
    }
    (row,) = (
        r
        for r in rows
        if [r["statistic"], r["direction"], r["lag_cells"]] == ["connection", "vertical", "3"]
    )
    tau = connectivity(ensemble, 7, "vertical", [3]).tau.ravel()
    assert [float(row[f"realization_{r}"]) for r in (1, 2, 3)] == pytest.approx(tau, rel=1e-5)
    layers = [r for r in rows if r["statistic"] == "proportion"]
    assert [int(r["layer"]) for r in layers] == list(range(10))
    assert {r["lag_cells"] for r in layers} == {""}
    own = vertical_proportions(ensemble.training_image)[0, 1]
    assert [float(r["training_image"]) for r in layers] == pytest.approx(own, rel=1e-5)


def test_a_grid_of_other_layers_than_the_image_is_said(ensemble):
    study = ensemble.training_image, (6, 20, 24), ensemble.parameters
    thinner = simulate(*study, n_realizations=2)
    assert "training image (10 layers) scaled to the grid" in html(drawn(thinner))
    layers = [r for r in csv_rows(curves_csv(thinner, 1)) if r["statistic"] == "proportion"]
    assert [r["realization_1"] == "" for r in layers] == [False] * 6 + [True] * 4
    assert all(r["training_image"] for r in layers)


def test_a_volume_of_one_layer_has_its_curves(ensemble):
    image = TrainingImage(ensemble.training_image.array[:1])
    p = Parameters(template_size=(1, 8, 8), overlap_size=(0, 4, 4), wavelet_level=(0, 1, 1))
    flat = simulate(image, (1, 20, 24), p, n_realizations=2)
    assert "layers" in charts(drawn(flat))
    assert csv_rows(curves_csv(flat, 1))
