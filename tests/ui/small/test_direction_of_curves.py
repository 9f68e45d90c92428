"""Test that curves of maps follow the main direction of the geobodies, and a click turns them."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from streamlit.testing.v1 import AppTest

from ccwsim import Parameters, Secondary, TrainingImage, simulate
from ccwsim.metrics import variogram
from ccwsim.ui.results.charts import curve_bundle, directions_of_curves
from ccwsim.ui.simulate.results import curves_csv
from tests.ui.widgets import charts, csv_rows, html, named

P = Parameters(template_size=16, overlap_size=4, wavelet_level=1)


def stripes(azimuth: float) -> TrainingImage:
    north, east = np.indices((80, 80))
    across = east * np.cos(np.radians(azimuth)) - north * np.sin(np.radians(azimuth))
    return TrainingImage((across // 5 % 2).astype(int), facies_names=("mud", "sand"))


def simulated(azimuth: float, **options):
    return simulate(stripes(azimuth), (48, 60), P, n_realizations=2, **options)


def page(ensemble):
    from ccwsim.ui.results.charts import draw_facies_charts

    draw_facies_charts(ensemble, 1)


def drawn(ensemble) -> AppTest:
    app = AppTest.from_function(page, default_timeout=180, args=(ensemble,)).run()
    assert not app.exception
    return app


def test_connectivity_is_along_geobodies_and_a_click_shows_it_across():
    app = drawn(simulated(0))
    for title in ("Variogram N–S, along", "Variogram E–W, across", "Connectivity N–S, along"):
        assert f">{title}<" in html(app)
    assert html(app).index("Variogram N–S") < html(app).index("Variogram E–W")
    turn = named(app.button, "turn_connectivity")
    assert turn.label == "E–W"
    assert turn.help == "Show connectivity E–W, across"
    app = turn.click().run()
    assert ">Connectivity E–W, across<" in html(app)
    assert named(app.button, "turn_connectivity").label == "N–S"
    assert ">Variogram N–S, along<" in html(app)


def test_curves_follow_an_oblique_direction():
    ensemble = simulated(42)
    assert directions_of_curves(ensemble, 1) == {40.0: ", along", 130.0: ", across"}
    app = drawn(ensemble)
    assert ">Connectivity 40°, along<" in html(app)
    assert charts(app) == {"variogram_40", "variogram_130", "connection", "times"}


def test_an_oblique_curve_is_drawn_at_its_distances():
    ensemble = simulated(42)
    bundle = curve_bundle(ensemble, "variogram", 1, 40.0)
    steps = np.rint(np.outer(np.arange(25), np.cos(np.radians([40, 50])))).astype(int)
    distances = np.unique(np.hypot(*steps.T))
    assert bundle.lags == pytest.approx(distances)
    for north, east in steps[1:]:
        gamma = variogram(ensemble, 1, (int(north), int(east)), [1]).gamma[:, 0]
        drawn_at = np.argmin(abs(bundle.lags - np.hypot(north, east)))
        assert bundle.each[:, drawn_at] == pytest.approx(gamma)


def test_the_file_of_curves_has_the_axes_and_the_directions_on_the_page():
    ensemble = simulated(42)
    rows = csv_rows(curves_csv(ensemble, 1))
    assert {row["direction"] for row in rows} == {"E-W", "N-S", "azimuth 40", "azimuth 130"}
    for statistic, name in (("variogram", "variogram"), ("connectivity", "connection")):
        bundle = curve_bundle(ensemble, statistic, 1, 40.0)
        along = [r for r in rows if (r["statistic"], r["direction"]) == (name, "azimuth 40")]
        assert [float(r["lag_cells"]) for r in along] == pytest.approx(bundle.lags, rel=1e-5)
        assert [float(r["training_image"]) for r in along] == pytest.approx(
            bundle.reference, rel=1e-5
        )
    straight = csv_rows(curves_csv(simulated(0), 1))
    assert {row["direction"] for row in straight} == {"E-W", "N-S"}


def test_images_without_a_direction_keep_the_axes():
    noise = np.random.default_rng(1).random((60, 60)) > 0.6
    ensemble = simulate(noise.astype(int), (48, 60), P, n_realizations=2)
    assert list(directions_of_curves(ensemble, 1).items()) == [("E-W", ""), ("N-S", "")]
    app = drawn(ensemble)
    assert ">Connectivity E–W<" in html(app)
    assert ">Connectivity N–S<" in html(named(app.button, "turn_connectivity").click().run())


def test_turned_images_keep_the_axes():
    ensemble = simulated(0, secondary=Secondary(angle=30.0))
    assert list(directions_of_curves(ensemble, 1)) == ["E-W", "N-S"]


def test_the_note_judges_both_directions(monkeypatch):
    from ccwsim.report.verdicts import Verdict
    from ccwsim.ui.results import charts as results

    ensemble = simulated(0)
    fits = {way: SimpleNamespace(judged=True, fits=True, way=way) for way in ("N-S", "E-W")}
    words = {"N-S": "too little connected", "E-W": "too much connected"}
    monkeypatch.setattr(results, "fit_of", lambda *about: fits[about[-1]])
    monkeypatch.setattr(results, "_figure_of", lambda _: "{}")
    monkeypatch.setattr(
        results.verdicts,
        "describe_curve",
        lambda fit, _: Verdict("inside") if fit.fits else Verdict(words[fit.way], good=False),
    )
    assert "✓ all inside<" in html(drawn(ensemble))
    fits["E-W"].fits = False
    assert "⚑ E–W too much connected; N–S inside the band<" in html(drawn(ensemble))
    fits["N-S"].fits = False
    assert "⚑ N–S too little connected; E–W too much connected<" in html(drawn(ensemble))
