"""Test that How it works shows the values that the engine computes, step by step."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from streamlit.testing.v1 import AppTest

from ccwsim import Grid, HardData, Parameters, datasets
from ccwsim.engine.trace import Trace, fates
from ccwsim.figures import LIGHT
from ccwsim.figures.style import N_STEPS
from ccwsim.model.study import Study
from ccwsim.sharing.choices import Choices, DataChoice, GuideChoice, ImageChoice
from ccwsim.ui.how_it_works.maps import (
    PatchView,
    grid_map,
    location_marks,
    score_map,
)
from ccwsim.ui.how_it_works.page import PLAY_SECONDS
from ccwsim.ui.how_it_works.resimulation import windows_by_datum
from ccwsim.ui.how_it_works.run import How
from ccwsim.ui.how_it_works.words import describe_sides
from ccwsim.ui.session.state import KEY, State
from tests.some import some
from tests.ui.widgets import html, named, opened

ROOT = Path(__file__).parents[3]
OWN = Parameters(template_size=16, overlap_size=4, wavelet_level=1)
SMALL = Choices(data=DataChoice(), grid=Grid(48, 64), parameters=OWN)
DATA = HardData([[5, 7], [20, 40], [22, 44], [40, 11], [30, 30]], [1, 0, 1, 1, 0])
WITH_DATA = replace(SMALL, data=DataChoice("placed", placed=DATA))
NOISE = np.random.default_rng(3).integers(0, 2, 120)
EVERYWHERE = HardData(np.argwhere(np.ones((10, 12))) * [4, 5], NOISE)
MANY = replace(SMALL, data=DataChoice("placed", placed=EVERYWHERE))


def launched(choices: Choices = SMALL, **how) -> AppTest:
    state = State(choices=choices, pages={How: How(**how)})
    return seen(opened("how_it_works", state).run())


def seen(app: AppTest) -> AppTest:
    assert not app.exception
    assert not app.error, [error.value for error in app.error]
    return app


def text(app: AppTest) -> str:
    return re.sub("<[^>]*>", "", html(app))


def trace_of(choices: Choices, number: int = 0) -> Trace:
    data = choices.data.placed or HardData()
    image = datasets.load(choices.image.bundled)
    return Trace(Study(image, choices.grid, choices.parameters, data, choices.seed), number)


def how(app: AppTest):
    return app.session_state[KEY].page(How)


def press(app: AppTest, key: str) -> AppTest:
    return seen(named(app.button, key).click().run())


def test_it_opens_cold_on_a_patch_that_shows_much():
    app = seen(opened("how_it_works").run())
    trace = how(app).trace
    assert trace.patches[how(app).patch].shape == 3
    assert f"Patch {how(app).patch + 1} of {len(trace.patches)}" in text(app)
    assert "cH₂" in text(app)
    assert "400 data" in text(app)


@pytest.mark.slow
@pytest.mark.parametrize("choices", some([SMALL, WITH_DATA, MANY], always=[WITH_DATA]))
def test_every_patch_shows_the_figures_of_the_core(choices):
    trace = trace_of(choices)
    app = launched(choices)
    shapes = [p.shape for p in trace.patches]
    with_data = [p.number for p in trace.patches if trace.at(p.number).data is not None]
    for number in sorted({*map(shapes.index, set(shapes)), *with_data[:2], len(shapes) - 1}):
        named(app.slider, "how_patch").set_value(number + 1).run()
        step, said = trace.at(number), text(seen(app))
        told = fates(step)
        assert f"Patch {number + 1} of {len(shapes)}" in said
        assert describe_sides(trace, step.patch.shape) in said
        assert f"Drawn: CCW {told[0].ccw:.4g}" in said
        first = re.search(r'<tr class="drawn"><td>(.*?)</td><td>(.*?)</td>', html(app))
        assert first is not None
        view = PatchView(trace, [], LIGHT, step, told)
        assert first[1] == view.where(told[0])
        assert first[2] == f"{told[0].ccw:.4g}"
        if step.patch.shape:
            n = int(step.error.sum())
            assert f"differ in {n} of {int(step.in_overlap.sum())}" in said
            assert f"Before the boundary, {int(step.keep_mask.sum())} cell" in said
        if step.data is not None:
            inside = sum(datum.inside for datum in step.data.seen)
            assert f"{inside} dat" in said
            assert f"at random from the {step.n_candidates} of the K = " in said


def test_next_previous_and_the_ends():
    app = launched(patch=0)
    assert named(app.button, "how_previous").disabled
    press(app, "how_next")
    assert how(app).patch == 1
    press(app, "how_previous")
    assert how(app).patch == 0
    app = launched(patch=10**6)
    assert how(app).patch == len(how(app).trace.patches) - 1
    assert named(app.button, "how_next").disabled


@pytest.mark.slow
def test_it_plays_on_and_stops_at_the_end_and_at_a_touch():
    app = launched(patch=2)
    press(app, "how_play")
    assert how(app).playing
    assert named(app.button, "how_stop").label == "Stop"
    how(app).ticked = -10.0
    seen(app.run())
    assert (how(app).patch, how(app).playing) == (3, True)
    press(app, "how_next")
    assert (how(app).patch, how(app).playing) == (4, False)

    n = len(how(app).trace.patches)
    app = launched(patch=n - 2, playing=True, ticked=-10.0)
    assert (how(app).patch, how(app).playing) == (n - 1, False)
    press(app, "how_play")  # starts again at the first patch
    assert how(app).patch in (0, 1)
    assert how(app).playing
    press(app, "how_stop")
    assert not how(app).playing
    assert named(app.button, "how_play").label == "Play"


def test_the_setting_is_the_pages_own_until_it_is_used():
    app = launched(patch=4)
    first = how(app).trace
    named(app.selectbox, "how_level").select(2).run()
    named(app.number_input, "how_candidates").set_value(5).run()
    seen(app)
    assert app.session_state[KEY].choices.parameters == OWN
    assert how(app).parameters.wavelet_level == 2
    assert how(app).parameters.n_candidates == 5
    assert how(app).trace is not first
    assert "K = 5 locations" in text(app)
    assert "cA₂" in text(app)
    press(app, "how_use")
    assert app.session_state[KEY].choices.parameters.wavelet_level == 2
    assert how(app).parameters is None

    named(app.selectbox, "how_overlap").select(8).run()
    press(app, "how_back")
    assert how(app).parameters is None


@pytest.mark.slow
def test_level_0_has_no_sub_bands_and_another_realization_another_path():
    app = launched(replace(SMALL, parameters=Parameters(16, 4, 0)))
    assert "At level 0 the cells of the image are compared" in text(app)
    assert "cH" not in text(app)
    origins = set()
    for number in range(1, 6):
        named(app.number_input, "how_number").set_value(number).run()
        assert how(seen(app)).trace.number == number - 1
        origin = "-".join(how(app).trace.grid_frame.faces())
        origins.add(origin)
        assert f"starts in the {origin}" in text(app)
    assert len(origins) > 1


def referred(app: AppTest) -> Iterator[tuple[str, str]]:
    """Yield each text of the page with its reference to the paper."""
    for said in re.findall(r'<p class="say">(.*?)</p>', html(app), re.S):
        for words, source in re.findall(r'(.*?)<span class="ref">(.*?)</span>', said, re.S):
            yield re.sub("<[^>]*>", "", words), source


def source_of(app: AppTest, words: str) -> str:
    found = [source for said, source in referred(app) if words in said]
    assert len(found) == 1, (words, found)
    return found[0]


@pytest.mark.slow
def test_each_step_stands_beside_its_place_in_the_paper():
    app = seen(opened("how_it_works").run())  # a patch with an overlap on two sides
    for words, places in {
        "The path starts": ("section 4.1", "Algorithm 1, lines 3 and 4"),
        "Haar approximation at level": ("section 4.2", "lines 8 and 9"),
        "The coefficients B of the overlap": ("section 4.3", "line 10"),
        "Drawn: CCW": ("section 4.4", "line 12"),
        "cheapest boundary": ("section 2 (the cut)", "line 14 (the paste)"),
        "gives one number per band": ("sections 3.1 and 4.2", "line 2"),
        "The inverse DWT restores": ("sections 3.1 and 4.4", "line 13"),
    }.items():
        for place in places:
            assert place in source_of(app, words), words
    named(app.slider, "how_patch").set_value(1).run()
    assert source_of(seen(app), "Drawn: CCW") == "Algorithm 1, lines 5 and 6"


def test_the_score_is_set_beside_the_papers():
    said = text(launched())
    assert "The paper uses the cross-correlation ΣA·B, whose largest value is best" in said
    assert "The authors' code also uses the squared difference" in said
    plain = replace(SMALL, parameters=replace(OWN, similarity="correlation"))
    assert "the paper's CCW (cross-correlation) ΣA·B; the largest is best" in text(launched(plain))


def test_what_is_not_in_the_paper_is_marked():
    app = launched(WITH_DATA)
    trace = trace_of(WITH_DATA)
    number = next(p.number for p in trace.patches if trace.at(p.number).data is not None)
    named(app.slider, "how_patch").set_value(number + 1).run()
    assert source_of(seen(app), "cells more than the cheapest") == "not in the paper"
    assert source_of(app, "Of 5 data:").startswith("not in the paper")
    moved = next(
        p.number
        for p in trace.patches
        if not np.array_equal(trace.at(p.number).drawn_place, trace.at(p.number).place)
    )
    named(app.slider, "how_patch").set_value(moved + 1).run()
    assert source_of(seen(app), "Refinement shifted the patch by") == "not in the paper"


def test_ms_ccsim_is_declined_in_words_with_a_way_out():
    app = launched(replace(SMALL, parameters=replace(OWN, method="ms-ccsim")))
    assert "places each patch once per scale" in app.warning[0].value
    press(app, "how_ccwsim")
    assert not app.warning
    assert app.session_state[KEY].choices.parameters.method == "ms-ccsim"


def test_a_study_that_cannot_be_simulated_is_said():
    bad = replace(SMALL, data=DataChoice("placed", placed=HardData([[99, 2]], [1])))
    app = opened("how_it_works", State(choices=bad)).run()
    assert not app.exception
    assert len(app.error) == 1


@pytest.mark.slow
def test_local_resimulation_is_shown_datum_by_datum():
    by_datum = windows_by_datum(trace_of(MANY).windows)
    assert by_datum
    app = launched(MANY)
    chosen = named(app.selectbox, "how_datum")
    assert len(chosen.options) == len(by_datum)
    chosen.select(len(by_datum) - 1).run()
    windows = by_datum[list(by_datum)[-1]]
    for window in windows:
        kind = "Forced" if window.size == 1 else f"Window of {window.size} cells"
        assert kind in text(seen(app))
    assert "nothing to correct" in text(launched(SMALL))
    off = replace(WITH_DATA, parameters=replace(OWN, exact_data=False))
    assert "“Honour data exactly” is off" in text(launched(off))


def test_three_facies_choose_whose_coefficients_are_shown():
    name = next(n for n in datasets.names() if datasets.load(n).n_facies == 3)
    choices = replace(SMALL, image=replace(SMALL.image, bundled=name))
    app = launched(choices)
    named(app.selectbox, "how_facies").select(2).run()
    assert how(seen(app)).facies == 2


@pytest.mark.parametrize("number", range(4))
def test_the_maps_are_the_arrays_of_the_core_in_the_world(number):
    theme, trace = LIGHT, trace_of(WITH_DATA, number)
    colours = ["#000000", "#ffffff"]
    for patch in (0, 3, 8, len(trace.patches) - 1):
        step = trace.at(patch)
        locations = fates(step)
        view = PatchView(trace, colours, theme, step, locations)
        shown = grid_map(view)
        assert shown.indices.shape == trace.study.grid.shape
        world = trace.grid_frame.to_grid(step.before)
        lit = shown.indices < 2
        assert np.array_equal(shown.indices[lit], world[lit])
        assert np.array_equal(shown.indices == 2, world == 255)
        n_lit = trace.grid_frame.to_grid(_in_overlap(step)).sum()
        assert lit.sum() == n_lit
        assert shown.marks[0]["row"] == view.part_of_grid[0].start

        scored = score_map(view, with_costs=False)
        assert np.count_nonzero(scored.indices <= N_STEPS) == step.scores.size
        marks = location_marks(view, view.block_frame, 1, ["said"] * len(locations))
        assert marks[-1]["kind"] == "disc"
        at = scored.indices[marks[-1]["row"], marks[-1]["column"]]
        low, high = step.ccw.min(), step.ccw.max()
        wanted = (locations[0].ccw - low) / (high - low) * N_STEPS if high > low else 0
        assert at == round(wanted)


def _in_overlap(step) -> np.ndarray:
    whole = np.zeros(step.before.shape, bool)
    y, x, size = step.patch.y0, step.patch.x0, step.patch.size
    whole[y : y + size, x : x + size] = step.in_overlap & (step.old != 255)
    return whole


def test_the_browser_remembers_messages_for_as_long_as_a_player_needs():
    """Test that the browser keeps messages long enough for automatic play.

    Streamlit forgets a message after two finished runs of the page.
    """
    settings = tomllib.loads((ROOT / ".streamlit" / "config.toml").read_text("utf-8"))
    assert settings["global"]["maxCachedMessageAge"] * PLAY_SECONDS > 5


def test_the_image_and_the_angle_of_a_patch_are_named():
    east = ((32.0, -1.0), (65.0, -1.0), (65.0, 49.0), (32.0, 49.0))
    guides = GuideChoice(images=(ImageChoice("stone_wall"),), zones=(east,), angle=30.0)
    app = launched(replace(SMALL, guides=guides), patch=0, ground="image")
    found = set()
    for _ in range(len(app.session_state[KEY].page(How).trace.patches) - 1):
        found |= set(re.findall("The patch is from ([^.]*), turned to 30°", text(app)))
        if len(found) == 2:
            break
        named(app.button, "how_next").click().run()
    assert found == {"channels", "stone wall"}
    app.session_state[KEY].change(guides=GuideChoice())  # the trace is made anew
    assert "The patch is from" not in text(seen(app.run()))


def test_the_rules_of_the_paper_with_data_are_refused_and_ours_can_be_followed():
    study = replace(WITH_DATA, parameters=OWN.as_in("paper"))
    app = launched(study)
    assert "one after another" in app.warning[0].value
    press(app, "how_ccwsim")
    assert not app.warning
    assert how(app).parameters == OWN
    assert app.session_state[KEY].choices == study
    assert not launched(replace(SMALL, parameters=OWN.as_in("paper"))).warning
