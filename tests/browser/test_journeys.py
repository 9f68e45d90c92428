"""Test the dashboard as a whole, with a real browser and a real server."""

from __future__ import annotations

import re

import pytest

from tests.browser.hands import (
    GLANCE,
    SLOW,
    SOON,
    at_rest,
    close_menu,
    fill,
    menu,
    run,
    settled,
    soon,
    switch_on,
    until,
)
from tests.browser.served import CHROMIUM, served

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no {CHROMIUM}")


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
    first = page.locator(".facts").inner_text()
    fill(page, "seed", 7)
    run(page)

    def is_new() -> None:
        words = page.locator(".facts").inner_text()
        assert words != first
        assert "12 realizations in" in words

    soon(is_new)
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
    fill(page, "seed", 8)
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
def test_a_number_typed_in_a_menu_is_kept_when_a_click_beside_the_menu_closes_it(page, address):
    from playwright.sync_api import expect

    opened(page, address)
    sidebar = page.get_by_test_id("stSidebarUserContent")  # run names contain changes too
    button = sidebar.get_by_role("button", name="Fit and coordinates")
    box = page.locator(".st-key-grid_cell_size_x input")

    def unfold() -> None:
        at_rest(page)
        until(
            lambda: None if box.count() else button.click(timeout=GLANCE),
            lambda wait: box.wait_for(timeout=wait),
        )

    unfold()
    expect(box).to_have_value("1", timeout=SOON)
    box.fill("25")
    page.locator(".facts").click(timeout=SOON)
    expect(box).to_have_count(0, timeout=SOON)
    unfold()
    expect(box).to_have_value("25", timeout=SOON)


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
