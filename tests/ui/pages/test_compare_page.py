"""Test the page Compare: its settings, its findings, and the use of a setting for the study."""

from __future__ import annotations

import re
from dataclasses import replace
from html import escape, unescape

import numpy as np
import pytest
from streamlit.testing.v1 import AppTest

from ccwsim import Cancelled, Grid, HardData, Parameters, datasets, simulate
from ccwsim.experiments.comparison import STATISTICS, Comparison, PairRatio, compare
from ccwsim.experiments.two_point import simulate_two_point
from ccwsim.model.sizes import overlap_sizes, template_sizes
from ccwsim.report.settings import describe_setting
from ccwsim.report.verdicts import describe_curves
from ccwsim.sharing.choices import Choices, DataChoice, GuideChoice, ImageChoice, Upload
from ccwsim.ui.compare.findings import (
    comparison_csv,
    describe_against_first,
    describe_grades,
    describe_ratio,
    describe_speed,
    figures_table,
    ratio_table,
    ratios_csv,
    sentences,
    settings_csv,
)
from ccwsim.ui.compare.settings import (
    TWO_POINT,
    Beside,
    ComparePageState,
    ComparisonRun,
    both_images,
    compared_settings,
    usual_others,
)
from ccwsim.ui.session.state import KEY, State
from ccwsim.ui.study.image_questions import image_of_file
from tests.ui.widgets import charts, csv_rows, html, named, opened, texts
from tests.waiting import PATIENCE, wait_until

OWN = Parameters(template_size=16, overlap_size=4)
SMALL = Choices(data=DataChoice(), grid=Grid(48, 64), parameters=OWN)
CURVES = {f"{statistic}_{way}" for statistic in STATISTICS for way in "EN"}
FIGURES = CURVES | {"compared_times", "compared_proportions", "compared_mds"}


def launched(choices: Choices = SMALL, n: int = 3) -> AppTest:
    """Return the page after its first comparison."""
    state = State(choices=choices)
    state.change_compare(n=n)
    return settled(opened("compare", state).run())


def settled(app: AppTest) -> AppTest:
    """Return the page after its comparison."""

    def at_rest() -> bool:
        page_state = app.session_state[KEY].page(ComparePageState)
        run = page_state.run
        assert run is None or run.wait(PATIENCE), "the comparison does not come to its end"
        app.run()
        return page_state.run is run

    wait_until(at_rest, "the comparison")
    assert not app.exception
    return app


def state_of(app: AppTest) -> State:
    return app.session_state[KEY]


@pytest.fixture(scope="module")
def found() -> Comparison:
    settings = {"A": OWN, "B": Parameters(16, 4, method="ccsim")}
    data = HardData([[5, 7], [20, 40], [40, 11]], [1, 0, 1])
    return compare(datasets.load("channels"), (48, 64), settings, data, 3, seed=2)


def test_it_opens_cold_and_compares_what_is_usual():
    app = launched()
    assert not texts(app)
    assert charts(app) == FIGURES
    state = state_of(app)
    own, second, third = compared_settings(state)
    assert own == OWN
    assert second.method == "ccsim"
    assert third.wavelet_level == 3
    result = state.page(ComparePageState).run.latest_result
    assert [e.parameters for e in result.ensembles] == [own, second, third]
    for sentence in sentences(result):
        assert sentence in html(app)


@pytest.mark.slow
def test_a_change_is_fitted_and_said_after_the_run():
    app = launched()
    assert "Out of date" not in html(app)
    named(app.selectbox, "B_method").set_value("ccwsim").run()
    named(app.selectbox, "B_wavelet_level").set_value(3).run()
    changed = compared_settings(state_of(app))[1]
    assert (changed.method, changed.wavelet_level, changed.overlap_size) == ("ccwsim", 3, 8)
    assert "Out of date" in html(app)
    app.button(key="compare").click()
    settled(app.run())
    assert state_of(app).page(ComparePageState).run.latest_result.ensembles[1].parameters == changed
    assert "Out of date" not in html(app)


def test_only_sizes_that_fit_are_on_offer():
    app = launched()
    shape = datasets.load("channels").shape
    for letter, p in zip("ABC", compared_settings(state_of(app)), strict=True):
        template = named(app.selectbox, f"{letter}_template_size")
        overlap = named(app.selectbox, f"{letter}_overlap_size")
        assert template.options == [str(s) for s in template_sizes(p.level, shape)]
        assert overlap.options == [str(s) for s in overlap_sizes(p.level, p.template_size)]
    assert named(app.selectbox, "B_wavelet_level").disabled


@pytest.mark.slow
def test_the_first_setting_is_the_studys_own():
    app = launched()
    named(app.number_input, "A_n_candidates").set_value(7).run()
    assert state_of(app).choices.parameters.n_candidates == 7


def test_settings_are_added_copied_and_removed():
    app = launched()
    app.button(key="add_setting").click().run()
    there = compared_settings(state_of(app))
    assert len(set(there)) == 4
    assert not [b for b in app.button if b.key == "add_setting"]
    app.button(key="copy_D_from_B").click().run()
    assert compared_settings(state_of(app))[3] == there[1]
    app.button(key="remove_B").click().run()
    app.button(key="remove_B").click().run()
    assert compared_settings(state_of(app)) == (there[0], there[1])
    assert app.button(key="remove_B").disabled


@pytest.mark.slow
def test_use_these_takes_a_setting_to_the_study_and_loses_none():
    app = launched()
    own, second, third = compared_settings(state_of(app))
    app.button(key="use_C").click().run()
    assert not app.exception
    assert state_of(app).choices.parameters == third
    assert compared_settings(state_of(app)) == (third, second, own)


@pytest.mark.slow
def test_the_arrows_show_the_same_realization_of_all():
    app = launched()
    app.button(key="shown_previous").click().run()
    assert state_of(app).page(ComparePageState).shown == 2
    assert "Realization 3 of 3" in html(app)
    assert re.search(r"MDS plot: stress 0\.\d\d", html(app))
    app.button(key="shown_next").click().run()
    assert "Realization 1 of 3" in html(app)


@pytest.mark.slow
def test_curves_of_another_facies_are_worked_out():
    app = launched()
    before = state_of(app).page(ComparePageState).run.latest_result
    named(app.selectbox, "e_type").set_value(0)
    settled(app.run())
    after = state_of(app).page(ComparePageState).run.latest_result
    assert {key[0] for key in after.curves} == {0, 1}
    assert after.anodi is before.anodi
    assert charts(app) == FIGURES


def test_other_guides_make_the_comparison_an_old_one():
    app = launched()
    state_of(app).change(guides=GuideChoice(angle=30.0))
    app.run()
    assert "Out of date" in html(app)


def first_settings(found: Comparison, n: int) -> Comparison:
    """Return a comparison of which `n` settings are simulated."""
    return Comparison(found.names[:n], found.ensembles[:n])


def test_a_stopped_comparison_keeps_what_is_simulated(monkeypatch):
    app = launched()
    page_state = state_of(app).page(ComparePageState)
    first = page_state.run

    def stopped_after(n: int):
        def work(run, job):
            run.rows.append(first_settings(first.latest_result, n))
            raise Cancelled("stopped")

        return work

    monkeypatch.setattr(ComparisonRun, "work", stopped_after(1))
    app.button(key="compare").click()
    settled(app.run())
    earlier = "Stopped before two settings were simulated. The earlier comparison is still shown."
    assert earlier in texts(app)
    assert page_state.shown_run is page_state.kept_run is first
    monkeypatch.setattr(ComparisonRun, "work", stopped_after(2))
    app.button(key="compare").click()
    settled(app.run())
    assert "Stopped after 2 of 3 settings were simulated" in texts(app)
    assert page_state.earlier is None
    assert page_state.kept_run is page_state.run is not first
    assert not app.error


def test_a_comparison_started_again_keeps_the_finished_one(monkeypatch):
    app = launched()
    page_state = state_of(app).page(ComparePageState)
    first = page_state.run

    def work(run, job):
        run.rows.append(first_settings(first.latest_result, 1))
        job.sleep(PATIENCE)

    monkeypatch.setattr(ComparisonRun, "work", work)
    for _ in range(2):
        app.button(key="compare").click().run()
        assert page_state.going
        assert page_state.kept_run is first
        assert not app.error
    page_state.run.stop()
    settled(app)
    assert page_state.shown_run is first


def test_a_failed_comparison_says_why_and_keeps_the_earlier_one(monkeypatch):
    app = launched()
    page_state = state_of(app).page(ComparePageState)
    first = page_state.run

    def work(run, job):
        run.rows.append(first.latest_result)
        raise MemoryError

    monkeypatch.setattr(ComparisonRun, "work", work)
    app.button(key="compare").click()
    settled(app.run())
    assert "do not fit into memory" in texts(app)
    assert page_state.shown_run is first
    assert charts(app) == FIGURES


def test_what_cannot_run_is_said_and_nothing_is_lost():
    placed = DataChoice("placed", placed=HardData([[500, 500]], [1]))
    app = launched(replace(SMALL, data=placed))
    assert "outside the grid" in texts(app)
    assert app.button(key="compare").disabled
    assert state_of(app).choices.data == placed


def test_a_tiny_grid_says_why_patterns_are_missing():
    app = launched(replace(SMALL, grid=Grid(9, 9)), n=1)
    assert not texts(app)
    assert "Patterns are not compared" in html(app)
    assert charts(app) == FIGURES - {"compared_mds"}


@pytest.mark.slow
def test_another_image_makes_the_comparison_an_old_one():
    app = launched()
    state = state_of(app)
    state.change(image=ImageChoice(bundled="stone_wall"))
    settled(app.run())
    assert "Out of date" in html(app)
    assert charts(app) == FIGURES


@pytest.mark.parametrize("method", ["ccwsim", "ccsim"])
@pytest.mark.parametrize("level", [0, 1, 3])
def test_usual_settings_are_legal_and_different(method, level):
    own = Parameters(32, 8, level, method=method)
    others = usual_others(own, (64, 64))
    assert len(others) >= 3
    assert len({own, *others}) == 1 + len(others)
    assert all(describe_setting(p, own) != "the same" for p in others[:3])


def test_speeds_and_differences_are_told_beyond_the_scatter():
    said = ["4 times faster than", "2 times slower than", "as fast as"]
    assert [describe_speed(ratio) for ratio in (0.25, 2.0, 1.01)] == said


def test_the_sentences_say_the_figures(found):
    said = describe_against_first(found, 1)
    ratio = found.cpu_seconds[1] / found.cpu_seconds[0]
    assert ("slower" in said) == (ratio > 1.05)
    assert sentences(found)[-1] == "All 3 data are honoured by all settings."


def test_sentence_and_table_say_the_same_by_one_rule(found):
    for k in range(1, len(found.names)):
        row = next(r for r in found.ratios if (r.name, r.other) == (found.names[k], "A"))
        assert describe_grades(row) in describe_against_first(found, k)
        assert describe_grades(row) in describe_ratio(row)
        assert describe_grades(row) in unescape(ratio_table(found))


def test_the_table_of_figures_has_the_ratios_of_the_sentences(found):
    table = unescape(figures_table(found))
    for k in range(1, len(found.names)):
        row = found.ratio_of(found.names[k], "A")
        assert f"{row.within:.2f} × A" in table
        assert f"{row.between:.2f} × A" in table
    assert table.count(" bits") == 2  # only for setting A


@pytest.mark.slow
def test_titles_of_curves_say_which_settings_fail():
    app = launched(replace(SMALL, grid=Grid(64, 64)), n=4)
    for (_, statistic, _), curves in (
        state_of(app).page(ComparePageState).run.latest_result.curves.items()
    ):
        kind = "variogram" if statistic == "variogram" else "connectivity"
        said = describe_curves(dict(zip("ABCD", curves.fits, strict=False)), kind)
        assert escape(said.words) in html(app)
        assert escape(said.numbers) in html(app)
    assert "nearest to the training image" not in html(app)


def test_a_difference_is_more_than_two_standard_errors():
    ratios = "B", "A", 1.3, 1.1, 1.3 / 1.1
    sure = PairRatio(*ratios, errors=(0.01, 0.01, 0.01))
    assert sure.grades == (1, 1, 1)
    assert describe_ratio(sure) == (
        "B against A: 30 % more varied, 10 % farther from the training image; better by ANODI"
    )
    some = PairRatio(*ratios, errors=(0.01, 0.2, 0.2))
    assert some.grades == (1, 0, 0)
    assert "30 % more varied, as near to the training image; as good" in describe_ratio(some)
    assert "no difference in patterns" in describe_ratio(PairRatio(*ratios, errors=(0.2, 0.1, 0.1)))
    few = PairRatio(*ratios, errors=(np.nan,) * 3)
    assert few.grades == (0, 0, 0)
    assert "too few realizations" in describe_ratio(few)
    alone = PairRatio("B", "A", np.nan, 1.0, np.nan, (np.nan,) * 3)
    assert "shows no variety" in describe_ratio(alone)


@pytest.mark.slow
def test_proportions_that_a_setting_misses_are_said_with_their_sign():
    image = datasets.load("channels")
    plain = {"published_draw": True, "repair_seams": False}
    thin = Parameters(template_size=8, overlap_size=4, n_candidates=500, **plain)
    some = compare(image, (256, 256), {"A": Parameters(match_proportions=True), "B": thin}, None, 6)
    said = sentences(some)
    assert re.fullmatch(r"Proportions off: B: sand [\d.]+ % \(TI 27\.0 %; −\d\d %\)\.", said[-1])


@pytest.mark.slow
def test_data_that_a_setting_leaves_wrong_are_counted():
    data = datasets.load_hard_data("channels_400_data")
    loose = Parameters(exact_data=False)
    image = datasets.load("channels")
    some = compare(image, (512, 512), {"A": Parameters(), "B": loose}, data, 1)
    mean = some.ensembles[1].n_mismatched.mean()
    assert mean > 0
    assert sentences(some)[-1] == (
        f"Mean number of the 400 data not honoured: B {mean:g}; the other settings honour all data."
    )
    both = compare(image, (512, 512), {"A": loose, "B": loose}, data, 1)
    assert "others" not in sentences(both)[-1]


def test_names_of_settings_are_no_formulas_in_the_files(found):
    hostile = replace(found, names=("=1+1", "-2"))
    for made in (settings_csv, comparison_csv):
        names = {row["setting"] for row in csv_rows(made(hostile))}
        assert "'=1+1" in names <= {"'=1+1", "-2"}


def test_the_files_have_the_figures(found):
    files = settings_csv(found), comparison_csv(found), ratios_csv(found)
    settings, each, ratios = map(csv_rows, files)
    assert [row["setting"] for row in settings] == ["A", "B"]
    assert [row["method"] for row in settings] == ["ccwsim", "ccsim"]
    distance = float(settings[1]["distance_to_image_bits"])
    assert distance == pytest.approx(found.distance[1], rel=1e-5)
    assert len(each) == 6
    own = [float(row["distance_to_image_bits"]) for row in each if row["setting"] == "B"]
    np.testing.assert_allclose(own, found.distances[1], rtol=1e-5)
    assert float(ratios[0]["ratio"]) == pytest.approx(found.ratios[0].ratio, rel=1e-5)


def with_beside(beside: Beside = TWO_POINT, choices: Choices = SMALL) -> AppTest:
    state = State(choices=choices)
    state.change_compare(n=3, beside=beside)
    return settled(opened("compare", state).run())


def test_a_two_point_simulation_is_compared_and_marked_as_not_ccwsim():
    placed = DataChoice("placed", placed=HardData([[5, 7], [20, 40]], [1, 0]))
    app = with_beside(choices=replace(SMALL, data=placed))
    assert not texts(app)
    assert charts(app) == FIGURES
    page_state = state_of(app).page(ComparePageState)
    found, seed = page_state.run.latest_result, state_of(app).choices.seed
    assert found.names == page_state.run.names == ("A", "B", "C", TWO_POINT)
    alone = simulate_two_point(datasets.load("channels"), (48, 64), 3, seed)
    np.testing.assert_array_equal(found.ensembles[3].indices, alone.indices)
    assert "two-point is not CCWSIM" in html(app)
    assert "It ignores the 2 hard data." in html(app)
    assert "All 2 data are honoured by all settings." in html(app)
    settings, each = csv_rows(settings_csv(found)), csv_rows(comparison_csv(found))
    assert (settings[3]["setting"], settings[3]["method"]) == (TWO_POINT, "")
    assert {row["data_wrong"] for row in each if row["setting"] == TWO_POINT} == {"nan"}


def test_a_two_point_simulation_needs_the_place_of_a_setting():
    app = with_beside()
    app.button(key="add_setting").click().run()
    assert "At most 3 settings fit beside two-point." in texts(app)
    assert app.button(key="compare").disabled
    named(app.selectbox, "beside").set_value("").run()
    assert not texts(app)


@pytest.mark.slow
def test_a_two_point_simulation_has_the_variogram_but_not_the_connectivity():
    image, n = datasets.load("channels"), 8
    ensembles = {"A": Parameters(), TWO_POINT: simulate_two_point(image, (256, 256), n)}
    curves = compare(image, (256, 256), ensembles, None, n).curves
    off = {}
    for statistic in STATISTICS:
        c = curves[1, statistic, "E-W"]
        off[statistic] = [np.abs(b.median - c.reference)[5:60].mean() for b in c.bands]
    assert off["variogram"][1] < 0.02
    assert off["connectivity"][1] > 3 * off["connectivity"][0]


def test_half_of_the_realizations_are_from_a_second_image():
    placed = DataChoice("placed", placed=HardData([[5, 7], [20, 40]], [1, 0]))
    app = with_beside(ImageChoice("stone_wall"), replace(SMALL, data=placed))
    assert not texts(app)
    assert "Second image: stone wall" in html(app)
    assert "show whether that image is right" in html(app)
    page_state = state_of(app).page(ComparePageState)
    first, second = page_state.run.latest_result.ensembles[0], page_state.run.second_ensemble
    alone = simulate(datasets.load("stone_wall"), (48, 64), OWN, placed.placed, 3)
    np.testing.assert_array_equal(second.indices, alone.indices)
    assert second.n_mismatched.max() == 0
    both = both_images(first, second)
    assert both.n == 6
    means = (first.probability(1) + second.probability(1)) / 2
    np.testing.assert_allclose(both.probability(1), means)
    named(app.selectbox, "e_type").set_value(0)
    settled(app.run())
    assert page_state.run.second_ensemble is second  # other curves do not simulate again
    named(app.selectbox, "beside").set_value("").run()
    assert "Out of date" in html(app)


def test_a_second_image_needs_the_same_facies():
    app = with_beside(ImageChoice("barchans"))
    offered = named(app.selectbox, "beside").options
    assert "image stone wall" in offered
    assert "image dunes" not in offered
    said = "barchans has the facies 0, 1 and 2, and the training image of the study has 0 and 1"
    assert said in texts(app)
    assert app.button(key="compare").disabled


def test_a_file_is_a_second_image():
    text = "\n".join(",".join(row) for row in np.tile([["0", "1"], ["1", "1"]], (40, 40)))
    choice = image_of_file(Upload("other.csv", text.encode()))
    app = with_beside(choice)
    assert not texts(app)
    assert state_of(app).page(ComparePageState).run.second_ensemble.training_image.shape == (80, 80)
    assert "image other.csv" in named(app.selectbox, "beside").options
