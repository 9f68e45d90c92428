"""Test that the page Validate shows the values of the metrics for any study, without errors."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from streamlit.testing.v1 import AppTest

from ccwsim import Grid, HardData, Parameters, TrainingImage, datasets, simulate
from ccwsim.engine.revision import revise
from ccwsim.jobs.memo import Memo
from ccwsim.jobs.statistics import StatisticsWorker
from ccwsim.metrics import (
    Check,
    Fit,
    connectivity,
    copying,
    etype,
    fit_proportions,
    variogram,
)
from ccwsim.metrics.lags import distinct_lags, lag_offsets
from ccwsim.report.verdicts import (
    LAYERS_NOT_JUDGED,
    NOT_JUDGED,
    describe_checks,
    describe_curve,
    describe_patterns,
)
from ccwsim.sharing.choices import Choices, DataChoice, ImageChoice
from ccwsim.ui.session.state import KEY, State
from ccwsim.ui.validate.conditioning import (
    data_status_shares,
    describe_match,
    resimulation_map,
    scoring_problem,
    wrong_map,
    wrong_points,
)
from ccwsim.ui.validate.page import (
    SECTIONS,
    data_verdict,
    findings,
    proportion_verdicts,
    variety_verdict,
)
from ccwsim.ui.validate.reproduction import seam_map, strips_of, use_map
from ccwsim.ui.validate.statistics import (
    Validation,
    checks,
    copied,
    curves,
    geobodies,
    lag_maps,
    patterns,
    reference_scores,
    sources_of,
    transitions,
)
from ccwsim.ui.widgets.facts import facts_of, proportions_table
from tests.small_images import facies_at_edges
from tests.ui.widgets import charts, html, named, opened, texts
from tests.waiting import PATIENCE, wait_until

OWN = Parameters(template_size=16, overlap_size=4)
SMALL = Choices(data=DataChoice(), grid=Grid(48, 64), parameters=OWN, n_realizations=3)
CURVES = {"variogram_E", "variogram_N", "connectivity_E", "connectivity_N"}
MAPS = {"lags_image", "lags_mean", "lags_apart"}
STRIPS = {"gamma", "n_bodies", "euler", "largest"}
ALL = frozenset(name for name, *_ in SECTIONS)


def nothing(share: float) -> None:
    """Ignore progress."""


def launched(choices: Choices = SMALL, seen=ALL, **changes) -> AppTest:
    """Return the page after all of its computations."""
    state = State(choices=choices, **changes)
    state.page(Validation).unfolded |= seen
    return settled(opened("validate", state).run())


def settled(app: AppTest) -> AppTest:
    """Return the page after its run and all computations, drawn as rarely as possible."""

    def at_rest() -> bool:
        state = app.session_state[KEY]
        v = state.page(Validation)
        if state.job is None and not v.waiting:
            return True
        if state.job is not None:
            assert state.job.wait(PATIENCE), "the run does not come to its end"
        for statistic in v.waiting.values():
            v.worker.wait_for(statistic, PATIENCE)
        app.run()
        return False

    wait_until(at_rest, "all statistics of the page")
    assert not app.exception
    return app


@pytest.fixture(scope="module")
def ensemble():
    image = datasets.load("channels")
    data = HardData([[5, 7], [20, 40], [40, 11]], [1, 0, 1])
    return simulate(
        image, (48, 64), Parameters(template_size=16, overlap_size=4), data, n_realizations=4
    )


def test_it_opens_cold_and_shows_every_figure():
    app = launched()
    assert not texts(app)
    assert CURVES | MAPS | STRIPS | {"mds", "proportions", "anodi", "transiograms"} <= charts(app)
    assert {"variogram_azimuth", "connectivity_azimuth", "repetition", "quarters"} <= charts(app)


def test_every_check_has_a_line_and_a_link_to_its_figures():
    said = html(launched(seen=frozenset()))
    (checks,) = re.findall(r'<ul class="checks".*?</ul>', said)
    lines = re.findall(r"<li>(.*?)</li>", checks)
    n = re.search(r"(?:all|\d+ of) (\d+) checks", said)
    assert n is not None
    assert len(lines) == int(n[1]) > 1
    for line in lines:
        anchor = re.search(r'href="#(\w+)"', line)
        assert anchor is not None
        assert f'id="{anchor[1]}"' in said
        assert re.search(r"<small>.*\d.* in (TI crops of|the TI)", line)


def test_only_unfolded_sections_are_worked_out():
    app = launched(seen=frozenset())
    assert charts(app) == CURVES | {"mds"}
    assert re.search(r"MDS plot: stress 0\.\d\d", html(app))
    kept = app.session_state[KEY].page(Validation).drawn
    assert not {"geobodies", "lag_maps", "transitions", "diagnosis"} & set(kept)
    assert html(app).count('aria-expanded="false"') == len(SECTIONS)


def test_the_summary_says_what_was_found():
    said = html(launched(seen=frozenset()))
    assert "No hard data" in said
    assert re.search(r"title=\"sand [\d.]+ % \(TI 27.0 %; .*?>. sand [\d.]+ % \(TI 27.0 %\)<", said)
    assert re.search(r"✓ (all \d+|\d+ of \d+) checks fit|⚑ \d+ of \d+ checks differ", said)
    assert re.search(r"about \d+ % of good ensembles", said)
    assert "two realizations differ in" in said
    assert "as much as from the image" not in said


@pytest.mark.slow
@pytest.mark.parametrize("name", ["stone_wall", "barchans", "levees"])  # of 2, 3 and 4 facies
def test_other_bundled_images_can_be_judged(name):
    app = launched(replace(SMALL, image=ImageChoice(bundled=name)))
    assert not texts(app)
    assert "mds" in charts(app)


@pytest.mark.slow
def test_a_single_realization_can_be_judged():
    app = launched(replace(SMALL, n_realizations=1))
    assert not texts(app)
    assert "Realization 1 of 1" in html(app)


@pytest.mark.slow
def test_a_tiny_image_says_why_and_draws_the_rest():
    image = TrainingImage(np.tile([[0, 1], [1, 0]], (3, 3)), name="tiny")
    p = Parameters(template_size=4, overlap_size=1, wavelet_level=0)
    found = simulate(image, (12, 12), p, n_realizations=2)
    app = launched(ensemble=found, ensemble_choices=SMALL)
    assert "too small to compare its quarters" in html(app)
    assert "variogram_E" in charts(app)


def test_another_facies_is_followed_everywhere():
    app = launched(seen=frozenset())
    settled(app.selectbox(key="judged").set_value(0).run())
    assert app.session_state[KEY].facies == 0
    assert any("of mud" in chart.proto.spec for chart in app.get("plotly_chart"))
    assert named(app.selectbox, "e_type").value == 0


def test_the_arrows_go_round():
    app = launched(seen=frozenset())
    settled(app.button(key="shown_previous").click().run())
    assert app.session_state[KEY].shown == 2
    settled(app.button(key="shown_next").click().run())
    assert app.session_state[KEY].shown == 0


def test_more_realizations_can_be_run_from_here():
    app = launched(seen=frozenset())
    app.number_input(key="n_realizations").set_value(5).run()
    assert "Out of date" in html(app)
    settled(app.button(key="run").click().run())
    assert app.session_state[KEY].ensemble.n == 5
    assert "Out of date" not in html(app)


@pytest.mark.slow
def test_advice_can_be_taken_into_the_study():
    app = launched()
    app.button(key="use_advice").click().run()
    p = app.session_state[KEY].choices.parameters
    assert (p.template_size, p.overlap_size, p.wavelet_level) != (16, 4, 2)
    assert "Out of date" in html(app)


@pytest.mark.slow
def test_the_direction_is_kept_when_the_page_is_left():
    app = launched()
    settled(app.slider(key="azimuth").set_value(120).run())
    again = settled(opened("validate", app.session_state[KEY]).run())
    assert again.slider(key="azimuth").value == 120
    assert "Variogram 120°" in html(again)


@pytest.mark.slow
def test_a_reference_field_is_scored_without_the_data(ensemble):
    other = simulate(
        ensemble.training_image, ensemble.grid, ensemble.parameters, n_realizations=1, seed=99
    )
    reference = TrainingImage(other.realizations[0])
    scores, table = reference_scores(ensemble, reference).work(nothing)
    most = etype(ensemble).most_likely
    scored = np.ones(ensemble.grid.shape, bool)
    scored[tuple(ensemble.hard_data.cells.T)] = False
    own = (most == other.indices[0])[scored].mean()
    assert scores.accuracy == pytest.approx(own)
    assert scores.n_cells == 48 * 64 - 3
    assert table.count.sum() == 2 * scores.n_cells
    assert np.array_equal(wrong_map(scores, ["#000000"] * 2).indices == 1, ~scores.right)
    app = launched(ensemble=ensemble, ensemble_choices=SMALL, reference=reference)
    assert "calibration" in charts(app)
    assert "cells without data predicted" in html(app)


@pytest.mark.slow
def test_a_reference_field_that_does_not_fit_is_said(ensemble):
    assert "cells" in scoring_problem(TrainingImage([[0, 1]]), ensemble)
    strange = TrainingImage(np.where(ensemble.realizations[0] == 1, 7, 0))
    assert "facies 7" in scoring_problem(strange, ensemble)
    app = launched(ensemble=ensemble, ensemble_choices=SMALL, reference=strange)
    assert "Sample the data again" in texts(app)
    assert not app.exception


def test_curves_are_those_of_the_metrics(ensemble):
    image = ensemble.training_image
    found = curves(ensemble, "variogram", 1, "E-W").work(nothing).value
    assert found.each == pytest.approx(variogram(ensemble.indices, 1, "E-W", 32).gamma)
    assert found.reference == pytest.approx(variogram(image.indices, 1, "E-W", 32).gamma[0])
    found = curves(ensemble, "connectivity", 1, "N-S").work(nothing).value
    assert found.each == pytest.approx(
        connectivity(ensemble.indices, 1, "N-S", 24).tau, nan_ok=True
    )


@pytest.mark.parametrize("azimuth", [0.0, 20.0, 45.0, 90.0, 135.0, 170.0])
def test_lags_along_an_azimuth_reach_different_cells_at_their_true_distance(azimuth):
    lags, distances = distinct_lags(azimuth, 30)
    offsets = lag_offsets(azimuth, lags)
    assert len({tuple(offset) for offset in offsets.tolist()}) == len(lags)
    assert distances == pytest.approx(np.linalg.norm(offsets, axis=1))
    assert (np.diff(distances) > 0).all()
    everything = {tuple(o) for o in lag_offsets(azimuth, np.arange(31)).tolist()}
    assert everything == {tuple(o) for o in offsets.tolist()}


def test_a_variogram_map_goes_through_the_variograms(ensemble):
    found = lag_maps(ensemble, 1).work(nothing)
    middle = len(found.lags) // 2
    along = curves(ensemble, "variogram", 1, "E-W").work(nothing).value
    assert found.mean[middle, middle:] == pytest.approx(
        along.each.mean(axis=0)[: middle + 1], abs=1e-9
    )


def test_transitions_from_a_facies_sum_to_one(ensemble):
    found = transitions(ensemble, "N-S").work(nothing)
    assert found[0, 0].reference + found[0, 1].reference == pytest.approx(1)
    assert found[1, 0].each + found[1, 1].each == pytest.approx(1)


def test_geobodies_are_counted_by_area(ensemble):
    strips = {word: strip for _, word, strip in strips_of(geobodies(ensemble, 1).work(nothing))}
    assert strips["n_bodies"].reference == pytest.approx(
        found_in(ensemble.training_image.indices) * 10_000 / 256**2
    )
    assert len(strips["gamma"].each) == 4
    assert (strips["largest"].each <= 1).all()
    assert (strips["gamma"].each <= strips["largest"].each + 1e-12).all()


def found_in(indices) -> int:
    from scipy import ndimage

    return ndimage.label(indices == 1, np.ones((3, 3)))[1]


def test_a_change_of_contents_changes_the_keys(ensemble):
    other = replace(ensemble, indices=ensemble.indices[::-1].copy())
    assert patterns(ensemble).key != patterns(other).key
    assert curves(ensemble, "variogram", 0, "E-W") != curves(ensemble, "variogram", 1, "E-W")
    assert geobodies(ensemble, 1) == geobodies(replace(ensemble), 1)
    assert copied(ensemble, 0) != copied(ensemble, 1)


def test_sources_lead_back_to_the_realization(ensemble):
    image = ensemble.training_image
    for r in (0, 3):
        source = sources_of(ensemble, r)
        known = source >= 0
        assert np.array_equal(image.indices.ravel()[source[known]], ensemble.indices[r][known])
    found = copied(ensemble, 3).work(nothing)
    assert found.copied == copying(sources_of(ensemble, 3), image.shape).copied
    shown = seam_map(found, ensemble, 3, ["#000000", "#ffffff"], "#ff0000")
    assert np.array_equal(shown.indices % 2, ensemble.indices[3])
    assert np.array_equal(shown.indices >= 2, found.seams)
    uses = use_map(found)
    assert [uses.labels[k] for k in (0, 1)] == ["used 0 times", "used 1 times"]
    assert int(uses.indices.max()) == min(int(found.uses.max()), 100)


@pytest.mark.slow
def test_sources_of_an_edited_realization_are_not_guessed(ensemble):
    cell = np.argwhere(ensemble.indices[0] == 0)[0]
    data = HardData([*ensemble.hard_data.cells, cell], [*ensemble.hard_data.facies, 1])
    edited = revise(ensemble, data)
    assert edited.indices[0][tuple(cell)] == 1
    app = launched(ensemble=edited, ensemble_choices=SMALL)
    assert "the sources of its cells are unknown" in html(app)


def test_statuses_of_data_add_up(ensemble):
    names, shares = data_status_shares(ensemble)
    assert names[0] == "raster pass"
    assert names[-1] == "forced"
    assert shares.sum(axis=1) == pytest.approx(1)
    assert shares[:, 0] * 3 == pytest.approx((ensemble.data_status == 0).sum(axis=1))
    assert shares[:, -1] * 3 == pytest.approx(ensemble.n_forced)
    assert describe_match(ensemble) == "all 3 honoured in all 4 realizations"
    assert wrong_points(ensemble) == []


def test_a_datum_that_is_not_honoured_is_said_and_marked(ensemble):
    wrong = replace(ensemble, indices=1 - ensemble.indices)
    assert not data_verdict(wrong).good
    assert describe_match(wrong).startswith("100 % not honoured, up to 3 of 3")
    assert [point[:2] for point in wrong_points(wrong)] == ensemble.hard_data.cells.tolist()
    assert all(point[3] for point in wrong_points(wrong))


def test_the_map_of_resimulation_shows_each_datum(ensemble):
    shown = resimulation_map(ensemble, "#dddddd")
    shares = np.rint(100 * (ensemble.data_status != 0).mean(axis=0)).astype(int)
    rows, columns = ensemble.hard_data.cells.T
    assert shown.indices[rows, columns].tolist() == (1 + shares).tolist()
    assert np.count_nonzero(shown.indices) == 3
    assert len(shown.colours) == len(shown.labels) == 102


def band(found: list[float], tolerance: float = 0.2) -> Fit:
    """Return values at lags 1, 2, … compared with a training image whose value is always 0.9."""
    n = len(found)
    levels = np.full(n, 0.9), np.full(n, tolerance)
    return Fit(np.arange(1.0, n + 1), np.array(found), *levels, (100, 128))


def test_a_curve_outside_the_band_says_where_how_much_and_which_way():
    inside = (
        "inside the band of TI crops: τ(1) 1.00 in pieces, 0.90 ± 0.20 in TI crops of 128 × 100, "
        "up to 3 cells"
    )
    assert str(describe_curve(band([1.0, 0.8, 0.8]), "connectivity")) == inside
    assert str(describe_curve(band([0.9, 0.6, 0.35]), "connectivity")) == (
        "too little connected beyond 1 cell: τ(3) 0.35 in pieces, 0.90 in TI crops of 128 × 100"
    )
    assert str(describe_curve(band([1.2, 0.9, 0.9]), "connectivity")).startswith(
        "too much connected at 1 cell: τ(1) 1.20 in pieces, 0.90 in TI crops"
    )
    assert str(describe_curve(band([0.3, 0.6, 0.5]), "variogram")).startswith(
        "variogram too low at all lags: γ(1) 0.300 in pieces, 0.900"
    )
    assert str(describe_curve(band([0.9, 0.3, 0.4, 0.9, 0.2, 1.5]), "variogram")).startswith(
        "variogram too low at 5 cells: γ(5) 0.200"
    )
    for nothing in (None, band([np.nan, np.nan])):
        assert describe_curve(nothing, "connectivity").good is None


def test_findings_go_by_direction_and_call_failure_failure():
    """Test that too low in one direction and too high in another are two failures, not a mean."""
    several = [
        Check("connectivity", 1, "E-W", band([0.9, 0.5])),
        Check("connectivity", 1, "N-S", band([0.9, 1.3])),
        Check("variogram", 1, "E-W", band([0.9, 0.9])),
    ]
    names = ["mud", "channel"]
    headline, (less, more, fine) = describe_checks(several, names)
    assert [each.verdict.good for each in (less, more, fine)] == [False, False, True]
    assert (headline.words, headline.good) == ("2 of 3 checks differ from the TI", False)
    assert less.what == "Connectivity of channel, E–W"
    assert less.verdict.words == "too little connected beyond 1 cell"
    assert more.verdict.words == "too much connected beyond 1 cell"
    assert more.verdict.numbers.startswith("τ(2) 1.30 in pieces, 0.90 in TI crops")
    assert fine.verdict.words == "as in TI crops"
    assert fine.verdict.numbers.startswith("γ(1) 0.900 in pieces, 0.900 ± 0.200 in TI crops")
    assert describe_checks(several[2:], names)[0].words == "the only check fits the training image"
    assert describe_checks([], names)[0].good is None


def test_every_verdict_has_eight_words_or_fewer():
    three = band([0.1, 0.9, 0.1])
    kinds = ("connectivity", "variogram", "geobodies", "patterns")
    ways = ("E-W", "N-S", None, None)
    each = [Check(kind, 1, way, three) for kind, way in zip(kinds, ways, strict=True)]
    headline, lines = describe_checks(each, ["mud", "sand"])
    said = headline, *(line.verdict for line in lines)
    assert len(said) == 5
    for verdict in (*said, NOT_JUDGED, LAYERS_NOT_JUDGED, *describe_patterns(three)):
        assert 1 < len(verdict.words.split()) <= 8


def test_a_facies_lost_at_the_edges_is_marked_although_crops_vary_as_much():
    image = TrainingImage(facies_at_edges())
    found = simulate(image, image.shape, Parameters(32, 8, 2), n_realizations=12)
    fit = fit_proportions(found)
    assert fit is not None
    assert fit.fits
    lost, *others, advice = proportion_verdicts(found, fit)
    assert "facies 0" in lost.words
    assert lost.good is False
    assert all(each.good for each in others)
    assert advice.words.startswith("facies 0 is at the edges of the TI: half the template")


def drawn_facts(ensemble) -> None:
    from ccwsim.ui.widgets.facts import draw_facts

    draw_facts(ensemble)


def test_proportions_have_a_sign_and_the_data_beside_them():
    data = HardData([[0, 0], [0, 1], [0, 2], [0, 3]], [0, 0, 0, 1])
    image = TrainingImage(np.tile([0, 0, 0, 1], (64, 16)), facies_names=["mud", "sand"])
    some = simulate(image, (40, 40), OWN, data, 2)
    few = np.zeros_like(some.indices)
    few[:, :4] = 1
    bad = replace(some, indices=few)
    said, advice = proportion_verdicts(bad, fit_proportions(bad))
    assert said.words == "sand 10.0 % (TI 25.0 %)"
    assert said.numbers == "sand 10.0 % (TI 25.0 %, data 25.0 %; −60 %)"
    assert not said.good
    assert advice.words == "“Match proportions” is off and would bring sand nearer to the TI"
    assert facts_of(bad)[-2:] == [said.numbers, advice.words]
    assert facts_of(bad, short=True)[-2:] == [said.words, advice.words]
    app = AppTest.from_function(drawn_facts, args=(bad,)).run()
    assert not app.exception
    *_, line_in_menu = (e.proto.body for e in app.get("html"))  # the style cuts the line above
    assert all(f'<span class="fact">{fact}</span>' in line_in_menu for fact in facts_of(bad))
    mud = replace(bad, study=replace(bad.study, hard_data=HardData(data.cells, [0, 0, 0, 0])))
    assert len(proportion_verdicts(mud, fit_proportions(mud))) == 1  # no advice against the data
    matched = replace(
        bad, study=replace(bad.study, parameters=replace(OWN, match_proportions=True))
    )
    assert len(proportion_verdicts(matched, fit_proportions(matched))) == 1
    good = np.zeros_like(some.indices)
    good[:, :10] = 1
    fine = replace(some, indices=good)
    (said,) = proportion_verdicts(fine, fit_proportions(fine))
    assert said.good
    assert said.numbers == "sand 25.0 % (TI 25.0 %, data 25.0 %; ±0 %)"
    assert facts_of(fine)[-1] == said.numbers


def test_a_table_has_the_shares_of_all_facies():
    image = TrainingImage(np.tile([0, 1, 1, 2], (64, 16)), facies_names=["<b>", "silt", "sand"])
    data = HardData([[0, 0], [0, 1]], [0, 2])
    some = simulate(image, (40, 40), OWN, data, 2)
    shares = np.zeros_like(some.indices)
    shares[:, :20], shares[:, :4] = 1, 2
    table = proportions_table(replace(some, indices=shares))
    head = ("facies", "simulated", "TI", "data", "relative difference")
    assert "".join(f"<th>{name}</th>" for name in head) in table
    for name, *cells in (
        ("&lt;b&gt;", "50.0 %", "25.0 %", "50.0 %", "+100 %"),
        ("silt", "40.0 %", "50.0 %", "0.0 %", "−20 %"),
        ("sand", "10.0 %", "25.0 %", "50.0 %", "−60 %"),
    ):
        assert f"<th>{name}</th>" + "".join(f"<td>{cell}</td>" for cell in cells) in table
    assert facts_of(replace(some, indices=shares), short=True)[2] == (
        "largest difference: <b> 50.0 % (TI 25.0 %)"
    )


def test_variety_is_the_share_of_differing_cells(ensemble):
    shares = ensemble.proportions.mean(axis=0)
    found = variety_verdict(ensemble, 0.39)
    independent = f"{100 * (1 - (shares**2).sum()):.0f} % if cells were independent"
    assert found.words == f"two realizations differ in 39 % of the cells ({independent})"
    assert variety_verdict(ensemble, 0.0).good is False


def test_findings_come_as_they_are_known(ensemble):
    state = State(facies=1)
    state.page(Validation).worker = StatisticsWorker(Memo())
    few = len(findings(state, ensemble))
    shelf = state.page(Validation).worker.memo
    asked = checks(ensemble)
    shelf.put(asked.key, asked.work(nothing))
    assert len(findings(state, ensemble)) > few


def test_more_variety_for_less_distance_is_a_larger_ratio(ensemble):
    found = patterns(ensemble).work(nothing)
    better = replace(found, between=2 * found.between)
    assert better.mean_ratio == pytest.approx(2 * found.mean_ratio)
    by_hand = sum(found.weights * found.between[0] / found.within[0])
    assert float(found.mean_ratio[0]) == pytest.approx(by_hand)


@pytest.mark.slow
def test_a_redraw_leaves_alone_what_is_being_typed():
    app = launched()
    app.run()
    boxes = [app.number_input(key=key) for key in ("n_realizations",)]
    assert not any(box.proto.set_value for box in [*boxes, app.slider(key="azimuth")])
    app.session_state[KEY].change(n_realizations=7)
    app.run()
    assert named(app.number_input, "n_realizations").value == 7
    assert not named(app.number_input, "n_realizations").proto.set_value
