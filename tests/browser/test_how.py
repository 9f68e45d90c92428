"""Test that How it works shows, for each patch, the values that the engine computes."""

from __future__ import annotations

import re
from functools import partial

import pytest

from ccwsim.engine.stages.path import LEFT, TOP
from ccwsim.engine.trace import Frame, Trace, fates
from ccwsim.figures import LIGHT
from ccwsim.model.parameters import Parameters
from ccwsim.model.study import Study
from ccwsim.sharing.choices import Choices, DataChoice
from ccwsim.ui.how_it_works.maps import PatchView
from ccwsim.ui.how_it_works.resimulation import windows_by_datum
from ccwsim.ui.how_it_works.words import describe_fate, describe_sides
from ccwsim.ui.session.resolve import data_of, image_of
from tests.browser.hands import GLANCE, SLOW, SOON, at_rest, choose, fill, soon, to_page, until
from tests.browser.served import CHROMIUM

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no {CHROMIUM}"),
]

AXES, EDGE = 40, 1
"""Pixels to the left of a map with coordinates, and around a map without coordinates."""
WHERE = ".st-key-how_player .where"


def trace_of(number: int = 0, parameters: Parameters | None = None) -> Trace:
    choices = Choices()
    image, data = image_of(choices.image), data_of(choices)
    own = parameters or choices.parameters
    return Trace(Study(image, choices.grid, own, data, choices.seed), number)


@pytest.fixture(scope="module")
def trace():
    """Return the trace of the realization that the page shows first; this also compiles kernels."""
    assert Choices().data != DataChoice()
    return trace_of()


@pytest.fixture
def page(tab, address):
    tab.goto(f"{address}/how_it_works")
    tab.locator(".st-key-map_how_mended canvas").wait_for(timeout=SLOW)
    at_rest(tab)
    return tab


def shows(page, number: int, n: int):
    """Return a function that waits until a patch is shown."""
    from playwright.sync_api import expect

    said = page.locator(WHERE)
    return lambda wait: expect(said).to_contain_text(f"Patch {number + 1} of {n} ", timeout=wait)


def number_of(page) -> int:
    numbers: list[str] = []

    def said() -> None:
        numbers[:] = re.findall(r"Patch (\d+) of", page.locator(WHERE).inner_text())
        assert len(numbers) == 1

    soon(said)
    return int(numbers[0]) - 1


def move(page, act, number: int, n: int) -> None:
    """Act until a patch is shown."""
    at_rest(page)
    before = page.locator(WHERE).inner_text()

    def once() -> None:
        at_rest(page)
        if page.locator(WHERE).inner_text() == before:
            act()

    until(once, shows(page, number, n))
    at_rest(page)


def own_cell(trace: Trace, number: int) -> tuple[int, int]:
    """Return row and column of a cell of the grid that a patch simulates first."""
    p = trace.patches[number]
    y, x = p.y0 + p.size - 4, p.x0 + p.size - 4
    ends = zip((y, x), trace.path.offset[1:], trace.path.shape[1:], strict=True)
    y, x = (min(max(at, first), first + n - 1) for at, first, n in ends)
    row, column = trace.grid_frame.cells_to_grid([y, x])[0].tolist()
    assert trace.patch_of_cell(row, column) == number
    return row, column


def click_grid(page, trace: Trace, number: int) -> None:
    """Click a cell of the grid to jump to the patch of this cell."""
    row, column = own_cell(trace, number)
    canvas = page.locator(".st-key-map_how_grid canvas")

    def click() -> None:
        at_rest(page)
        canvas.scroll_into_view_if_needed()
        box = canvas.bounding_box()
        cell = (box["width"] - AXES - EDGE) / trace.study.grid.nx
        y = EDGE + (trace.study.grid.ny - row - 0.5) * cell
        canvas.click(position={"x": AXES + (column + 0.5) * cell, "y": y})

    until(click, shows(page, number, len(trace.patches)))
    at_rest(page)


def beyond(page, number: float):
    """Return a function that waits until a patch with a larger number is shown."""
    return lambda wait: page.wait_for_function(
        "([where, k]) => +document.querySelector(where)?.innerText.match(/Patch (\\d+)/)?.[1] > k",
        arg=[WHERE, number], timeout=wait,
    )  # fmt: skip


def kinds(trace: Trace) -> dict[str, int]:
    """Return one patch of each kind."""
    shapes = [p.shape for p in trace.patches]
    inner = [k for k, shape in enumerate(shapes) if shape == LEFT | TOP]
    steps = ((k, trace.at(k)) for k in inner[30:])
    return {
        "corner": 0,
        "edge beside": shapes.index(LEFT) + 2,
        "edge behind": shapes.index(TOP),
        "inner": inner[25],
        "conditioned": next(
            k for k, step in steps if step.data is not None
            and any(datum.inside for datum in step.data.seen)
            and {"data", "fraction"} & {place.fate for place in fates(step)}
        ),
    }  # fmt: skip


def text_of(page, selector: str) -> str:
    return page.locator(selector).inner_text().replace("\u202f", "")


def check_step(page, trace: Trace, number: int) -> None:
    """Compare all values on the page for a patch with the engine; point at the drawn location."""
    step = trace.at(number)
    soon(lambda: says_step(page, trace, number, step), SLOW)
    hover_drawn(page, trace, number)


def says_step(page, trace: Trace, number: int, step) -> None:
    told = fates(step)
    view = PatchView(trace, [], LIGHT, step, told)
    assert describe_sides(trace, step.patch.shape) in page.locator(WHERE).inner_text()
    said = text_of(page, ".st-key-how_steps")
    assert f"starts in the {'-'.join(trace.grid_frame.faces())}" in said
    assert f"Drawn: CCW {told[0].ccw:.4g}." in said
    if step.patch.shape:
        n = int((step.approximation[0] == step.approximation[0]).sum())
        assert f"{n} coefficients instead of {int(step.in_overlap.sum())} numbers" in said
        assert f"The best value is {step.ccw.min():.4g}" in said
        assert f"differ in {int(step.error.sum())} of {int(step.in_overlap.sum())} cells" in said
        assert f"Before the boundary, {int(step.keep_mask.sum())} cell" in said
    else:
        assert "no overlap to compare" in said
    rows = page.locator("table.fates tbody tr").all_inner_texts()
    share = trace.study.parameters.search_fraction
    kinds_told = {place.fate for place in told}
    for line in rows:
        words = [word.strip() for word in line.split("\t")]
        places = [place for place in told if view.where(place) == words[0]]
        assert places
        place = places[0]
        assert words[1] == f"{place.ccw:.4g}"
        assert words[-1] == describe_fate(place, step, share)
        if step.data is not None:
            assert words[2:4] == [str(place.missed + place.held), str(place.ahead)]
    assert len(rows) == min(len(told), 24)
    if kinds_told - {"drawn", "candidate"}:
        assert any("rejected" in line for line in rows)


def hover_drawn(page, trace: Trace, number: int) -> None:
    """Point at the drawn location on the score map and return the tooltip."""
    from playwright.sync_api import expect

    step = trace.at(number)
    place = fates(step)[0]
    ny, nx = trace.oriented.pyramid.phases.shape[4:]
    frame = Frame(trace.path.orientation, (ny, nx))
    row, column = frame.cells_to_grid([place.row, place.column])[0].tolist()
    rows, columns = frame.original_shape
    canvas = page.locator(".st-key-map_how_score canvas")
    readout = page.locator(".st-key-map_how_score .readout")

    def point() -> None:
        box = canvas.bounding_box()
        cell = (box["width"] - 2 * EDGE) / columns
        y = EDGE + (rows - row - 0.5) * cell
        canvas.hover(position={"x": 2, "y": 2}, timeout=SLOW)
        canvas.hover(position={"x": EDGE + (column + 0.5) * cell, "y": y}, timeout=SLOW)

    said = f"CCW {place.ccw:.4g}, drawn"
    until(point, lambda wait: expect(readout).to_contain_text(said, timeout=wait))
    expect(readout).to_contain_text(f"({column}, {row})", timeout=SOON)


def test_every_kind_of_patch_says_what_the_core_says(page, trace):
    for number in kinds(trace).values():
        click_grid(page, trace, number)
        check_step(page, trace, number)


def test_scrub_step_play_and_stop(page, trace):
    from playwright.sync_api import expect

    n, first = len(trace.patches), number_of(page)
    move(page, page.locator(".st-key-how_next button").click, first + 1, n)
    move(page, page.locator(".st-key-how_previous button").click, first, n)
    move(page, lambda: page.keyboard.press("ArrowRight"), first + 1, n)
    move(page, lambda: page.keyboard.press("ArrowLeft"), first, n)
    slider = page.locator(".st-key-how_patch input[type=range]")
    move(page, lambda: slider.press("ArrowRight"), first + 1, n)  # one patch, not two

    def scrub() -> None:
        at_rest(page)
        now = number_of(page)
        track = page.locator(".st-key-how_patch [role=group] > div").first.bounding_box()
        y = track["y"] + track["height"] / 2
        page.mouse.move(track["x"] + track["width"] * now / (n - 1), y)
        page.mouse.down()
        page.mouse.move(track["x"] + 0.7 * track["width"], y, steps=4)
        page.mouse.up()

    until(scrub, beyond(page, 0.6 * n))
    at_rest(page)
    check_step(page, trace, number_of(page))

    start, play = number_of(page), page.locator(".st-key-how_play button")
    stop = page.locator(".st-key-how_stop button")
    until(
        lambda: None if stop.count() else play.click(timeout=GLANCE),
        lambda wait: expect(stop).to_be_visible(timeout=wait),
    )
    beyond(page, start + 2)(SLOW)
    until(
        lambda: stop.click(timeout=GLANCE) if stop.count() else None,
        lambda wait: expect(play).to_be_visible(timeout=wait),
    )
    at_rest(page)
    check_step(page, trace, number_of(page))

    click_grid(page, trace, n - 2)
    move(page, play.click, n - 1, n)
    expect(play).to_be_visible(timeout=SLOW)


def test_another_level_changes_the_score_map_and_may_be_used(page, trace):
    from playwright.sync_api import expect

    number = kinds(trace)["inner"]
    click_grid(page, trace, number)
    choose(page, "how_level", "1")
    expect(page.locator(".st-key-how_steps")).to_contain_text("cA₁", timeout=SLOW)
    at_rest(page)
    own = trace_of(parameters=Parameters(wavelet_level=1))
    check_step(page, own, number)
    fill(page, "how_candidates", 3)
    expect(page.locator(".st-key-how_more")).to_contain_text("K = 3", timeout=SLOW)
    at_rest(page)
    check_step(page, trace_of(parameters=Parameters(wavelet_level=1, n_candidates=3)), number)
    use = page.locator(".st-key-how_use").get_by_role("button")
    until(
        lambda: use.click(timeout=GLANCE) if use.count() else None,
        lambda wait: expect(page.locator(".st-key-how_use")).to_have_count(0, timeout=wait),
    )
    at_rest(page)
    to_page(page, "Simulate")
    expect(page.locator(".st-key-wavelet_level input")).to_have_value("1", timeout=SLOW)
    expect(page.locator(".st-key-n_candidates input")).to_have_value("3", timeout=SLOW)


def test_local_resimulation_is_told_window_by_window(page, trace):
    from playwright.sync_api import expect

    windows = next(iter(windows_by_datum(trace.windows).values()))
    row, column = trace.study.hard_data.cells[windows[0].datum]
    expect(page.locator(".st-key-how_datum input")).to_have_value(
        re.compile(rf"at \({column}, {row}\)"), timeout=SLOW
    )
    n_honoured = int((trace.realization.data_status == 0).sum())

    def told_by_window() -> None:
        said = page.locator(".st-key-how_mending .caption").all_inner_texts()
        told = [text for text in said if text.startswith("Window of")]
        assert len(told) == len([w for w in windows if w.size > 1])
        for text, window in zip(told, windows, strict=False):
            assert text.startswith(f"Window of {window.size} cells")
            assert ("no patch" not in text) == window.fits
        after = text_of(page, ".st-key-how_after")
        assert f"{n_honoured} honoured in the raster pass" in after

    soon(told_by_window, SLOW)


def test_it_works_on_a_phone(phone, address, trace):
    page = phone
    page.goto(f"{address}/how_it_works")
    page.locator(".st-key-map_how_mended canvas").wait_for(timeout=SLOW)
    at_rest(page)
    first = number_of(page)
    move(page, page.locator(".st-key-how_next button").click, first + 1, len(trace.patches))
    narrow = "() => document.scrollingElement.scrollWidth <= 390"
    page.wait_for_function(narrow, timeout=SOON)
    click_grid(page, trace, first - 40)


def test_the_maps_of_all_steps_are_above_the_fold_of_a_projector(page):
    page.set_viewport_size({"width": 1024, "height": 768})

    def is_seen_whole(name: str) -> None:
        box = page.locator(f".st-key-map_how_{name} canvas").bounding_box()
        assert box["y"] + box["height"] <= 768
        assert box["x"] + box["width"] <= 1024
        assert box["width"] > 96

    for name in ("grid", "overlap", "approximation", "score", "error_surface", "cut", "pasted"):
        soon(partial(is_seen_whole, name))
