"""Test that every page opens alone, keeps its state, and describes problems."""

from __future__ import annotations

import re
import time
from dataclasses import replace
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from streamlit.testing.v1 import AppTest

from ccwsim import (
    Cancelled,
    CCWSIMError,
    Ensemble,
    Grid,
    HardData,
    Parameters,
    datasets,
    simulate,
)
from ccwsim.io import can_write, read_realizations, training_image_as_bytes
from ccwsim.jobs.job import Job
from ccwsim.metrics import diagnose, variogram
from ccwsim.model.parameters import fitted, parameter_table
from ccwsim.model.published import WITHOUT_ADDITIONS
from ccwsim.model.sizes import overlap_sizes, template_sizes
from ccwsim.model.watch import Watch
from ccwsim.sharing.choices import Choices, DataChoice, ImageChoice, Upload
from ccwsim.ui.page import OFF_MENU, PAGES, SIMULATE_PAGE
from ccwsim.ui.session.file_names import study_part
from ccwsim.ui.session.resolve import data_of, image_of, imported_data
from ccwsim.ui.session.state import KEY, State
from ccwsim.ui.simulate.results import MAP_KINDS, curves_csv, download_groups, realizations_csv
from ccwsim.ui.study.image_step import IMPORT_PAGE
from ccwsim.ui.study.run import collect, part_of, start_run
from ccwsim.ui.widgets.facts import facts_of
from tests.some import some
from tests.ui.widgets import html, named, open_menus, opened, texts

ROOT = Path(__file__).parents[2]
PARAMETERS = Parameters(template_size=16, overlap_size=4)
SMALL = Choices(data=DataChoice(), grid=Grid(48, 64), parameters=PARAMETERS, n_realizations=2)


def launched(choices: Choices = SMALL, path: str = "app.py") -> AppTest:
    """Return a page with a small study and its results; changes do not start runs."""
    app = open_menus(AppTest.from_file(str(ROOT / path), default_timeout=120))
    app.session_state[KEY] = State(choices=choices, live=False)
    return settled(app.run())


def settled(app: AppTest) -> AppTest:
    """Return the page after its job has ended."""
    state = app.session_state[KEY]
    if state.job is not None:
        assert state.job.wait(120)
        app.run()
    assert not app.exception
    return app


def uploaded(name: str, content: bytes, **choice) -> ImageChoice:
    return ImageChoice(upload=Upload(name, content), **choice)


def a_file(array=((0, 1, 1), (0, 0, 1))) -> bytes:
    ny, nx = np.shape(array)
    return "\n".join([f"{nx} {ny} 1", "1", "v", *map(str, np.ravel(array))]).encode()


@pytest.mark.parametrize("path", ["app.py", *(path for _, path in (*PAGES, *OFF_MENU))])
def test_every_page_launches_by_itself(path):
    app = launched(path=path)
    assert not texts(app)
    assert app.session_state[KEY].choices == SMALL


@pytest.mark.parametrize("path", ["app.py", "pages/simulate.py"])
def test_the_main_screen_says_what_came_out(path):
    assert "2 realizations in" in html(launched(path=path))


@pytest.mark.slow
def test_titles_call_broken_channels_too_little_connected():
    """Test titles for broken channels, which differ so much that their own band is wide."""
    plain = {"published_draw": True, "repair_seams": False}
    broken = Parameters(template_size=8, overlap_size=4, n_candidates=500, **plain)
    choices = Choices(data=DataChoice(), grid=Grid(256, 256), parameters=broken, n_realizations=6)
    said = html(launched(choices))
    assert len(re.findall(r"⚑ variogram too low", said)) == 2
    numbers = r"γ\(\d+\) 0\.\d+ in pieces, 0\.\d+ in TI crops of 128 × 128"
    assert len(re.findall(numbers, said)) == 2
    assert re.search(r"sand [\d.]+ % \(TI 27\.0 %\)", said)
    assert re.search(r"<th>sand</th><td>[\d.]+ %</td><td>27\.0 %</td><td>−\d\d %</td>", said)
    assert "“Match proportions” is off and would bring sand nearer to the TI" in said


def test_every_page_file_is_in_the_menu_but_the_one_that_a_step_leads_to():
    files = {f"pages/{file.name}" for file in (ROOT / "pages").glob("*.py")}
    assert files == {path for _, path in (*PAGES, *OFF_MENU)}


def test_the_first_screen_has_results_without_a_choice():
    app = open_menus(AppTest.from_file(str(ROOT / "app.py"), default_timeout=120).run())
    ensemble = settled(app).session_state[KEY].ensemble
    assert ensemble.n == Choices().n_realizations
    assert ensemble.n_mismatched.max() == 0


def test_a_run_gives_what_the_library_gives():
    state = launched().session_state[KEY]
    image = datasets.load("channels")
    own = simulate(image, SMALL.grid, SMALL.parameters, n_realizations=2, seed=0)
    assert np.array_equal(state.ensemble.realizations, own.realizations)


def test_a_change_and_run_replace_the_results():
    app = launched()
    app.number_input(key="seed").set_value(9).run()
    assert app.session_state[KEY].ensemble.seed == 0
    settled(app.button(key="run").click().run())
    assert app.session_state[KEY].ensemble.seed == 9


def test_live_runs_after_each_change():
    app = launched()
    app.toggle(key="live").set_value(True).run()
    settled(app.number_input(key="n_realizations").set_value(3).run())
    assert app.session_state[KEY].ensemble.n == 3


def test_a_closed_menu_has_no_fields_and_the_study_keeps_their_values():
    app = launched()

    def sizes(opened: bool) -> list[float]:
        app.session_state["grid_menu"] = opened
        boxes = app.run().number_input
        return [box.value for box in boxes if (box.key or "").startswith("grid_cell_size_x")]

    assert sizes(opened=False) == []
    assert sizes(opened=True) == [1.0]
    named(app.number_input, "grid_cell_size_x").set_value(25.0).run()
    assert sizes(opened=False) == []
    assert app.session_state[KEY].choices.grid.cell_size == (25.0, 1.0)
    assert sizes(opened=True) == [25.0]


def test_only_legal_sizes_are_on_offer_and_sizes_follow_the_level():
    app = launched()
    named(app.selectbox, "wavelet_level").set_value(3).run()
    p = app.session_state[KEY].choices.parameters
    assert (p.template_size, p.overlap_size, p.wavelet_level) == (16, 8, 3)
    assert named(app.selectbox, "template_size").options == [
        str(size) for size in template_sizes(3, (256, 256))
    ]
    assert named(app.selectbox, "overlap_size").options == ["8"]


@pytest.mark.slow
def test_a_level_that_is_too_coarse_for_dense_data_is_warned_of():
    state = State()
    cells = np.argwhere(np.ones((32, 32))) * 8  # 16 data per template
    placed = HardData(cells, cells.sum(axis=1) // 8 % 2)
    state.change(grid=Grid(256, 256), data=DataChoice("placed", placed=placed))
    app = opened("simulate", state).run()
    assert not app.exception
    assert "A template has" not in texts(app)
    named(app.selectbox, "wavelet_level").set_value(3).run()
    assert "A template has 16 data on average: at level 3" in texts(app)


def test_the_help_comes_from_the_table_of_parameters():
    app = launched()
    kinds = (app.selectbox, app.number_input, app.checkbox, app.slider)
    helps = [element.help for kind in kinds for element in kind]
    for row in parameter_table():
        assert any(row["meaning"] in text for text in helps if text), row["name"]


def test_the_rules_of_the_paper_are_chosen_and_left_again():
    app = launched()
    usual = app.session_state[KEY].choices.parameters
    for variant in ("paper", "code", "ours"):
        app.selectbox(key="p_variant").set_value(variant).run()
        assert app.session_state[KEY].choices.parameters == usual.as_in(variant)


def test_what_the_paper_does_not_have_is_marked_and_off_under_its_rules():
    for variant in ("ours", "paper"):
        app = launched(replace(SMALL, parameters=Parameters().as_in(variant)))
        widgets = {w.key: w for w in (*app.selectbox, *app.checkbox, *app.slider)}
        for name in WITHOUT_ADDITIONS:
            assert widgets[f"p_{name}"].label.endswith("⁺")
            assert widgets[f"p_{name}"].disabled == (variant == "paper")
        assert not widgets["p_search_fraction"].disabled
        assert "⁺" not in widgets["p_search_fraction"].label


def test_volumes_have_only_our_rules():
    app = launched(replace(SMALL, parameters=Parameters.published("code")))
    app.selectbox(key="image_bundled").set_value("stacked_lenses").run()
    p = app.session_state[KEY].choices.parameters
    assert p.variant == "ours"
    assert p.exact_data
    assert not [w for w in app.selectbox if w.key == "p_variant"]


def test_without_a_wavelet_the_level_is_zero():
    app = launched()
    app.selectbox(key="p_method").set_value("ccsim").run()
    assert app.session_state[KEY].choices.parameters.level == 0
    assert named(app.selectbox, "wavelet_level").disabled


@pytest.mark.parametrize("name", some(datasets.names(), ["delta", "stone_wall"]))
def test_every_bundled_image_can_be_chosen(name):
    app = launched()
    app.selectbox(key="image_bundled").set_value(name).run()
    assert image_of(app.session_state[KEY].choices.image).digest == datasets.load(name).digest
    assert not texts(app)


@pytest.mark.parametrize("name", some(datasets.hard_data_names(), ["channels_60_wells"]))
def test_bundled_data_grow_the_grid_to_where_they_lie(name):
    image = ImageChoice(bundled=datasets.hard_data_training_image(name))
    app = launched(replace(SMALL, image=image))
    app.selectbox(key="data_source").set_value("bundled").run()
    app.selectbox(key="data_bundled").set_value(name).run()
    choices = app.session_state[KEY].choices
    assert data_of(choices).n == datasets.load_hard_data(name).n
    assert choices.grid.shape == datasets.hard_data_grid_shape(name)


def test_a_grid_too_small_for_the_data_is_said_and_can_be_corrected():
    study = replace(SMALL, data=DataChoice("bundled", "channels_60_wells"))
    app = open_menus(AppTest.from_file(str(ROOT / "app.py"), default_timeout=120))
    app.session_state[KEY] = State(choices=study)
    app.run()
    assert "outside the grid" in texts(app)
    assert app.button(key="run").disabled
    place = app.selectbox(key="ask_on_outside")
    settled(place.set_value(1).run())
    data = data_of(app.session_state[KEY].choices)
    assert 0 < data.n < 60
    assert not app.button(key="run").disabled


def test_an_upload_can_be_taken_turned_and_named():
    app = launched()
    app.file_uploader(key="image_file").upload("own.dat", a_file(), "text/plain").run()
    assert texts(app) == "" or "larger than" in texts(app)
    app.switch_page(IMPORT_PAGE).run()
    app.checkbox(key="image_flip_ew").check().run()
    named(app.text_input, "image_name_1").set_value("sand").run()
    choice = app.session_state[KEY].choices.image
    image = image_of(choice)
    assert image.array.tolist() == [[1, 1, 0], [1, 0, 0]]
    assert image.facies_names[1] == "sand"
    as_shown = image.array[::-1]  # north at the top
    named(app.button, "image_rotate").click().run()
    turned = image_of(app.session_state[KEY].choices.image)
    assert turned.array[::-1].tolist() == np.rot90(as_shown).tolist()


def test_a_file_with_open_questions_leads_to_import_only_from_where_it_was_given():
    content = b"4 4 1\n1\nvalue\n" + b"\n".join(f"{k / 16}".encode() for k in range(16))
    app = launched()
    app.switch_page(IMPORT_PAGE).run()
    app.file_uploader(key="import_image_file").upload("grey.dat", content, "text/plain").run()
    assert app.session_state[KEY].image_draft is not None
    app.switch_page(SIMULATE_PAGE).run()
    assert not app.error
    assert app.button(key="run")
    assert app.session_state[KEY].image_draft is not None  # the question waits on Import
    app.file_uploader(key="image_file").upload("other.dat", content, "text/plain").run()
    assert named(app.button, "image_take")  # the page Import


def test_what_a_browser_still_says_of_replaced_widgets_changes_nothing():
    app = launched()
    stale = app._tree.get_widget_states()
    app.file_uploader(key="image_file").upload("own.dat", a_file(), "text/plain").run()
    taken = app.session_state[KEY].choices
    assert taken.image.upload is not None
    app._run(stale)  # sent before the browser draws the reply
    assert app.session_state[KEY].choices == taken


def test_an_image_says_on_demand_which_parameters_suit_it_and_they_can_be_taken():
    app = launched(SMALL)
    app.switch_page(IMPORT_PAGE).run()
    assert "Advised values" in html(app)
    settled(app.button(key="use_advice").click().run())
    advised = diagnose(datasets.load("channels"))
    parameters = app.session_state[KEY].choices.parameters
    assert parameters.template_size == advised.advised("template_size")
    assert parameters.wavelet_level == advised.advised("wavelet_level")


def test_a_broken_upload_is_said_and_loses_nothing():
    app = launched()
    before = app.session_state[KEY].choices, app.session_state[KEY].ensemble
    app.file_uploader(key="image_file").upload("bad.dat", b"3 2 1\n1\nv\n0\n1", "text/plain").run()
    assert "bad.dat" in texts(app)
    assert "keeps its present image" in texts(app)
    assert (app.session_state[KEY].choices, app.session_state[KEY].ensemble) == before


def test_a_question_of_the_reader_is_asked_on_a_page_that_opens_by_itself():
    rng = np.random.default_rng(0)
    app = launched()
    content = a_file(rng.normal(size=(40, 40)))
    app.file_uploader(key="image_file").upload("grey.dat", content, "text/plain").run()
    assert app.session_state[KEY].image_draft is not None
    app.button_group(key="ask_values").set_value("classes").run()
    named(app.number_input, "ask_classes").set_value(3).run()
    state = app.session_state[KEY]
    assert state.choices.image.upload is None
    app.button(key="image_take").click().run()
    assert state.image_draft is None
    assert image_of(state.choices.image).n_facies == 3


def test_data_from_a_file_say_what_became_of_them():
    csv = b"row,col,facies\n3,4,1\n3,4,0\n9,9,1\n900,4,1\n"
    study = replace(SMALL, data=DataChoice("file", upload=Upload("w.csv", csv)))
    with pytest.raises(CCWSIMError, match="outside the grid"):
        data_of(study)
    answers = (("on_collision", "drop"), ("on_outside", "drop"))
    report = imported_data(replace(study, data=replace(study.data, answers=answers)))
    assert report.hard_data.cells.tolist() == [[9, 9]]
    assert len(report.notes) == 2


def test_sampled_data_come_from_a_realization_of_the_study():
    study = replace(SMALL, data=DataChoice("sampled", n_sampled=50, seed_sampled=4))
    truth = simulate(image_of(study.image), study.grid, study.parameters, seed=4).realizations[0]
    data = data_of(study)
    assert data.n == 50
    assert data.n_mismatched(truth) == 0
    other = replace(study, data=replace(study.data, seed_sampled=5))
    assert data_of(other).digest != data.digest


def test_the_state_is_kept_when_a_page_is_left():
    app = launched()
    app.number_input(key="seed").set_value(5).run()
    other = open_menus(AppTest.from_file(str(ROOT / "app.py"), default_timeout=120))
    other.session_state[KEY] = app.session_state[KEY]  # only this survives a change of page
    other.run()
    assert other.number_input(key="seed").value == 5
    assert other.session_state[KEY].ensemble is app.session_state[KEY].ensemble
    assert "2 realizations in" in html(other)


def test_any_other_error_is_friendly_and_keeps_the_state(monkeypatch):
    app = launched()
    before = app.session_state[KEY].ensemble

    def broken(*_):
        raise RuntimeError("boom")

    monkeypatch.setattr("ccwsim.ui.simulate.results.draw_facts", broken)
    app.run()
    assert not app.exception
    assert "boom" not in texts(app)  # only the log has the cause
    assert "kept" in texts(app)
    assert app.session_state[KEY].ensemble is before


def test_a_cancelled_run_keeps_what_was_finished():
    state = State(choices=SMALL)
    start_run(state)
    assert state.job.wait(120)
    whole = state.job.result
    collect(state)
    assert state.ensemble is whole
    part = replace(whole, indices=whole.indices[:1], cpu_seconds=whole.cpu_seconds[:1])

    def stopped(job):
        raise Cancelled("stopped after 1 of 2 realizations", part)

    state.job = Job(stopped, about=SMALL)
    assert state.job.wait(5)
    collect(state)
    assert state.ensemble is part
    assert "Stopped after 1 of 2" in state.message
    assert state.job is None


def test_a_failed_run_leaves_the_earlier_results():
    state = State(choices=SMALL, ensemble=object())
    state.job = Job(lambda job: 1 / 0, about=SMALL)
    assert state.job.wait(5)
    collect(state)
    assert state.ensemble is not None
    assert re.search(r"error, number \w{6} in the server.s log", state.message)


def test_a_job_reports_and_stops_when_asked():
    def work(job):
        job.report(0.1, 1)
        while not job.is_cancelled():
            job.report(0.25, 3)
            time.sleep(0.001)
        return "stopped"

    job = Job(work)
    assert not job.wait(0.05)
    assert (job.fraction, job.n_done) == (0.25, 3)
    assert job.seconds_left > 0
    job.cancel()
    assert job.wait(5)
    assert job.result == "stopped"


def test_the_work_of_a_study_can_be_cancelled():
    work = part_of(replace(SMALL, grid=Grid(900, 900), n_realizations=200))
    with pytest.raises(Cancelled):
        work(0, 200, Watch(cancel=lambda: True))


@pytest.mark.parametrize("level", range(5))
@pytest.mark.parametrize("shape", [(20, 30), (64, 64), (256, 300)])
def test_fitted_sizes_are_always_legal(level, shape):
    p = fitted(Parameters(), shape, wavelet_level=level)
    assert p.template_size in template_sizes(p.level, shape)
    assert p.overlap_size in overlap_sizes(p.level, p.template_size)
    assert p.template_size <= min(shape)


def test_two_uploads_of_the_same_name_are_told_apart():
    one, two = (uploaded("t.dat", a_file(a)) for a in ([[0, 1]], [[1, 0]]))
    assert image_of(one).array.tolist() == [[0, 1]]
    assert image_of(two).array.tolist() == [[1, 0]]


def test_what_is_written_can_be_read_back():
    image = datasets.load("channels")
    content = training_image_as_bytes(image, "sgems")
    assert image_of(uploaded("c.sgems", content)).digest == image.digest


def test_facts_say_when_data_are_not_honoured():
    ensemble: Ensemble = launched().session_state[KEY].ensemble
    assert facts_of(ensemble)[0] == "no hard data"
    wrong = ensemble.training_image.codes[1 - ensemble.indices[:, 5, 7]]
    data = datasets.load_hard_data("channels_60_wells").__class__([[5, 7]], wrong[:1])
    facts = facts_of(replace(ensemble, study=replace(ensemble.study, hard_data=data)))
    assert facts[0].startswith("up to 1 of 1 data not")
    assert re.fullmatch(
        r"sand [\d.]+ % \(TI 27\.0 %, data (0|100)\.0 %; (±|\+|−)\d+ %\)", facts[-1]
    )


def test_downloads_hold_what_is_shown():
    app = launched()
    assert not app.get("download_button")  # files are offered when the menu is opened
    app.session_state["downloads"] = True
    names = {element.proto.label for element in app.run().get("download_button")}
    assert any("NumPy" in name for name in names)
    from ccwsim.io import realizations_as_bytes

    ensemble = app.session_state[KEY].ensemble
    with np.load(BytesIO(realizations_as_bytes(ensemble, "npz"))) as saved:
        assert np.array_equal(saved["realizations"], ensemble.realizations)


def test_downloads_say_the_study_and_hold_every_format_that_can_be_written():
    ensemble: Ensemble = launched().session_state[KEY].ensemble
    colours = ["#000000", "#ffffff"]
    groups = download_groups(ensemble, colours, 0, 1)
    files = {file.key: file for group in groups.values() for file in group}
    assert study_part(ensemble) == (
        f"channels_{ensemble.grid.nx}x{ensemble.grid.ny}_T{ensemble.parameters.template_size}"
        f"_L{ensemble.parameters.wavelet_level}_seed{ensemble.seed}"
    )
    assert len({file.ending for file in files.values()}) == len(files)
    for kind in (kind for kind in MAP_KINDS if can_write(kind)):
        assert files[f"realizations_{kind}"].content()
        assert files[f"etype_{kind}"].content()
    back = read_realizations(BytesIO(files["realizations_npz"].content()))
    assert back.digest == ensemble.digest
    with np.load(BytesIO(files["etype_npz"].content())) as maps:
        np.testing.assert_array_equal(maps["probability_sand"], ensemble.probability(1))
    head = files["curves_csv"].content().decode()
    assert "connection,N-S,7," in head


def test_a_format_whose_package_is_missing_is_not_offered(monkeypatch):
    ensemble: Ensemble = launched().session_state[KEY].ensemble
    monkeypatch.setattr(
        "ccwsim.model.extras.find_spec", lambda package: None if package == "rasterio" else True
    )
    groups = download_groups(ensemble, ["#000000", "#ffffff"], 0, 1)
    labels = {file.label for group in groups.values() for file in group}
    assert {"NumPy", "VTK"} <= labels
    assert "GeoTIFF" not in labels


def test_the_numbers_of_the_charts_can_be_taken_home():
    ensemble: Ensemble = launched().session_state[KEY].ensemble
    head, *lines = realizations_csv(ensemble).decode().splitlines()
    assert head == "realization,cpu_seconds,data_not_honoured,proportion_0,proportion_1"
    shares = [[float(v) for v in line.split(",")[3:]] for line in lines]
    assert np.allclose(shares, ensemble.proportions, atol=1e-5)
    head, *lines = curves_csv(ensemble, 1).decode().splitlines()
    assert head.endswith("q05,median,q95,realization_1,realization_2")
    named = [line.split(",") for line in lines if line.startswith("variogram,N-S,7,")]
    gamma = variogram(ensemble.indices, 1, "N-S", [7]).gamma.ravel()
    assert np.allclose([float(v) for v in named[0][-2:]], gamma, rtol=1e-5)
