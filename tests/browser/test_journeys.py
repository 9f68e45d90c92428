"""Test the dashboard as a whole, with a real browser and a real server."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from ccwsim import Parameters, datasets, read_hard_data, read_training_image, simulate
from ccwsim.io import write_training_image
from ccwsim.model.grid import Grid
from tests.browser.hands import (
    GLANCE,
    SLOW,
    SOON,
    at_rest,
    choose,
    close_menu,
    downloaded,
    fill,
    menu,
    run,
    settled,
    soon,
    switch_on,
    until,
    upload,
)
from tests.browser.served import CHROMIUM, served

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no {CHROMIUM}")

SIDE, N = 256, 16  # at level 0, the run takes long enough to show its progress


@pytest.fixture
def page(tab):
    return tab


def opened(page, address, path="/simulate?grid=200x150&data=none"):
    page.goto(address + path)
    page.wait_for_selector(".facts", timeout=SLOW)
    page.wait_for_selector(".st-key-map_e_type canvas", timeout=SLOW)
    at_rest(page)
    return page


def facts(page, pattern, timeout=SLOW):
    from playwright.sync_api import expect

    # While the page is redrawn, old facts may be shown beside new facts for a moment.
    now = page.locator(".facts", has_text=re.compile(pattern)).first
    expect(now).to_be_visible(timeout=timeout)


def sees(locator, timeout=SOON):
    from playwright.sync_api import expect

    expect(locator.first).to_be_visible(timeout=timeout)


@pytest.fixture
def image_file(request, tmp_path) -> Path:
    """Return a published training image, or a bundled image in the same format."""
    folder = Path(__file__).resolve().parents[3] / "shared" / "data"
    try:
        folder = request.getfixturevalue("data_dir")
    except (pytest.FixtureLookupError, pytest.skip.Exception):
        folder = tmp_path / "nowhere"
    file = folder / "formats" / "ti_strebelle_250_250_1.dat"
    if not file.exists():
        file = tmp_path / "from_a_file.dat"
        write_training_image(file, datasets.load("channels"), format="sgems")
    return file


@pytest.fixture
def data_file(tmp_path) -> Path:
    """Return a file of sixty wells on `SIDE` × `SIDE` cells."""
    rng = np.random.default_rng(5)
    cells = rng.choice(SIDE * SIDE, 60, replace=False)
    rows = [f"{c // SIDE},{c % SIDE},{rng.integers(2)}" for c in cells]
    file = tmp_path / "wells.csv"
    file.write_text("\n".join(["row,col,facies", *rows]))
    return file


@pytest.mark.slow
def test_the_first_page_introduces_the_program_until_it_is_used(chromium, address):
    from playwright.sync_api import expect

    context = chromium.new_context()
    page = context.new_page()

    def introduced(times: int) -> None:
        page.goto(f"{address}/simulate")
        page.wait_for_selector(".st-key-map_e_type canvas", timeout=SLOW)
        at_rest(page)
        expect(page.locator(".st-key-welcome")).to_have_count(times, timeout=SOON)

    introduced(1)
    introduced(1)  # a reload is no use
    larger = "(e) => parseFloat(getComputedStyle(e).fontSize)"
    title = page.locator(".panel").first.evaluate(larger)
    assert page.locator(".facts").first.evaluate(larger) <= title
    wells = page.get_by_role("button", name="Bring wells")
    until(
        lambda: wells.click(timeout=GLANCE) if wells.count() else None,
        lambda wait: page.wait_for_url("**/import*", timeout=wait),
    )
    sees(page.get_by_text("Points or a grid with gaps"))
    page.wait_for_function("() => document.cookie.includes('ccwsim_used')", timeout=SLOW)
    introduced(0)
    context.close()


def test_own_image_and_data_to_realizations_and_back_home(page, address, image_file, data_file):
    opened(page, address, f"/simulate?grid={SIDE}x{SIDE}&data=none")
    upload(page, "image", image_file, note=image_file.stem)
    upload(page, "data", data_file, note="60 data")
    page.evaluate(
        """() => {
          window.seen = [];
          new MutationObserver(() => {
            const bar = document.querySelector('.st-key-progress');
            if (bar) window.seen.push(bar.innerText);
          }).observe(document.body, {subtree: true, childList: true, characterData: true});
        }"""
    )
    fill(page, "n_realizations", N)
    fill(page, "seed", 42)
    choose(page, "wavelet_level", "0")
    run(page)
    facts(page, f"60 of 60 data honoured.*{N} realizations in .* CPU each")
    assert any(f"{N} realizations" in text for text in page.evaluate("window.seen"))

    tiles = page.get_by_role("button", name=re.compile(r"^Realization \d+$"))
    from playwright.sync_api import expect

    expect(tiles).to_have_count(N, timeout=SOON)  # the old tiles remain for a moment
    until(
        lambda: tiles.nth(2).click(timeout=GLANCE),
        lambda wait: sees(page.get_by_text(f"Realization 3 of {N}"), wait),
    )
    fourth = page.get_by_text(f"Realization 4 of {N}")
    until(
        lambda: None if fourth.count() else page.keyboard.press("ArrowRight"),
        lambda wait: sees(fourth, wait),
    )
    sees(page.locator(".st-key-map_e_type canvas"))
    sees(page.locator(".st-key-chart_times .js-plotly-plot"))

    at_rest(page)
    saved = np.load(downloaded(page, "realizations_npz").path())
    assert int(saved["seed"]) == 42
    assert '"wavelet_level": 0' in str(saved["parameters"])
    image = read_training_image(image_file)
    own = simulate(
        image, (SIDE, SIDE), Parameters(wavelet_level=0), n_realizations=N, seed=42,
        hard_data=read_hard_data(data_file, Grid(SIDE, SIDE), image),
    )  # fmt: skip
    assert np.array_equal(saved["realizations"], own.realizations)

    page.reload()
    sees(page.locator(".st-key-image_row .note", has_text=image_file.stem))
    sees(page.locator(".st-key-data_row .note", has_text="60 data"))
    assert not page.locator("[data-testid=stAlert]").count()


@pytest.mark.slow
def test_a_big_run_shows_progress_and_can_be_cancelled(page, address):
    opened(page, address, "/simulate")
    before = page.locator(".facts").inner_text()
    fill(page, "n_realizations", 1000)
    run(page)
    sees(page.locator(".st-key-progress", has_text="of 1,000 realizations"))
    page.wait_for_selector("i.results-partly", state="attached", timeout=SLOW)
    cancel, stopped = page.get_by_role("button", name="Cancel"), re.compile("[Ss]topped")
    until(
        lambda: cancel.click(timeout=GLANCE) if cancel.count() else None,
        lambda wait: sees(page.get_by_text(stopped), wait),
    )

    def keeps_what_there_is() -> None:
        after = page.locator(".facts").inner_text()
        assert after == before or re.search(r"\b\d{1,3} realizations? in", after)

    soon(keeps_what_there_is)
    page.wait_for_selector("i.results-current", state="attached", timeout=SOON)


@pytest.mark.slow
def test_a_broken_file_is_said_and_nothing_is_lost(page, address, tmp_path):
    opened(page, address)
    fill(page, "seed", 7)
    before = page.locator(".facts").inner_text()
    broken = tmp_path / "broken.dat"
    broken.write_text("250 250 1\n1\nfacies\n0\n1\nnot a number\n")
    menu(page, "image_row")
    page.locator(".st-key-image_file input[type=file]").set_input_files(broken)
    sees(page.locator("[data-testid=stAlert]", has_text="broken.dat"))
    sees(page.locator("[data-testid=stAlert]", has_text="keeps its present image"))
    close_menu(page)

    def nothing_is_lost() -> None:
        assert "channels" in page.locator(".st-key-image_row .note").first.inner_text()
        assert page.locator(".st-key-seed input").input_value() == "7"
        assert page.locator(".facts").inner_text() == before

    soon(nothing_is_lost)
    run(page)
    facts(page, "12 realizations in")


@pytest.mark.slow
def test_a_menu_opens_with_what_the_study_says_and_changes_nothing(page, address):
    from playwright.sync_api import expect

    opened(page, address, "/simulate")
    menu(page, "data_row")
    source, bundled = (page.locator(f".st-key-data_{key} input") for key in ("source", "bundled"))
    expect(source).to_have_value("bundled", timeout=SOON)
    expect(bundled).to_have_value("channels 400 data", timeout=SOON)
    close_menu(page)
    advanced = page.get_by_role("button", name="Advanced")
    path = page.locator(".st-key-p_random_path input")
    until(
        lambda: None if path.count() else advanced.click(timeout=GLANCE),
        lambda wait: expect(path).to_be_checked(timeout=wait),
    )
    expect(page.locator(".st-key-p_refine input")).to_be_checked(timeout=SOON)
    close_menu(page)
    switch_on(page, "live")
    fill(page, "n_realizations", 4)
    facts(page, "400 of 400 data honoured.*4 realizations in")


@pytest.mark.slow
def test_quick_changes_are_all_kept(page, address):
    from playwright.sync_api import expect

    opened(page, address)
    edits = {"grid_nx": 300, "grid_ny": 200, "n_candidates": 5, "n_realizations": 2, "seed": 99}
    for key, value in edits.items():
        box = page.locator(f".st-key-{key} input")
        box.fill(str(value))
        box.press("Enter")
        page.wait_for_timeout(250)  # as fast as a user

    def boxes() -> list[str]:
        return [page.locator(f".st-key-{key} input").input_value() for key in edits]

    at_rest(page)
    settled(page, boxes)  # no change is reverted
    for key, value in edits.items():
        expect(page.locator(f".st-key-{key} input")).to_have_value(str(value), timeout=SOON)


@pytest.mark.slow
def test_hover_says_cell_and_facies(page, address):
    opened(page, address)
    canvas = page.locator(".st-key-map_realization canvas")
    canvas.scroll_into_view_if_needed()

    def both_say_the_cell() -> None:
        box = canvas.bounding_box()
        page.mouse.move(box["x"] + box["width"] * 0.6, box["y"] + box["height"] * 0.4)
        readout = page.locator(".st-key-map_realization .readout").inner_text()
        assert re.fullmatch(r"\(\d+, \d+\) (mud|sand)", readout)
        linked = page.locator(".st-key-map_e_type .readout").inner_text()
        assert linked.split(") ")[0] == readout.split(") ")[0]
        assert re.search(r"P\((mud|sand)\) = [01]\.\d\d", linked)

    soon(both_say_the_cell)


@pytest.mark.slow
def test_the_plain_address_opens_cold_and_nothing_leaves_the_machine(chromium):
    from playwright.sync_api import expect

    asked: list[str] = []
    with served() as fresh:
        context = chromium.new_context()
        context.on("request", lambda request: asked.append(request.url))
        page = opened(context.new_page(), fresh, "/")
        expect(page).to_have_title("Simulate · CCWSIM", timeout=SOON)
        sees(page.locator(".st-key-menu", has_text="Simulate"))
        sees(page.locator(".st-key-run").get_by_role("button", name="Run"))
        page.wait_for_load_state("networkidle", timeout=SLOW)
        context.close()
    assert asked
    assert not [url for url in asked if not url.startswith((fresh, "data:", "blob:"))]


@pytest.mark.slow
def test_on_a_phone_the_study_is_a_sheet_and_run_is_in_reach(phone, address):
    page = opened(phone, address)
    narrow = "() => document.scrollingElement.scrollWidth <= 390"
    page.wait_for_function(narrow, timeout=SOON)
    sees(page.locator(".st-key-run_bar").get_by_role("button", name="Run"))
    expand = page.locator("[data-testid=stExpandSidebarButton]")
    until(
        lambda: expand.click(timeout=GLANCE) if expand.is_visible() else None,
        lambda wait: sees(page.locator(".st-key-n_realizations input"), wait),
    )


@pytest.mark.slow
def test_ctrl_z_restores_the_study_before_the_change(page, address):
    opened(page, address)
    fill(page, "seed", 5)
    page.wait_for_function("() => location.search.includes('seed=5')", timeout=SLOW)
    at_rest(page)
    back = "() => !location.search.includes('seed=')"
    until(
        lambda: None if page.evaluate(back) else page.keyboard.press("Control+z"),
        lambda wait: page.wait_for_function(back, timeout=wait),
    )
    sees(page.locator(".st-key-seed input"))
    page.wait_for_function("() => document.querySelector('.st-key-seed input').value === '0'")
