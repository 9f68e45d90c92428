"""Test sharing a study: as a link, as a project after a restart, and as a report offline."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np
import pytest
from streamlit.proto.BackMsg_pb2 import BackMsg

from tests.browser.hands import (
    SLOW,
    SOON,
    at_rest,
    choose,
    fill,
    follow,
    menu,
    run,
    settled,
    soon,
    switch_on,
    to_page,
    until,
    upload,
)
from tests.browser.served import CHROMIUM, served

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no {CHROMIUM}"),
]

SMALL = "grid=64x48&data=none&template=16&overlap=4&realizations=3"
PIXELS = """(key) => {
  const find = (root) => root.querySelector('canvas') || [...root.querySelectorAll('*')]
    .map((e) => e.shadowRoot && find(e.shadowRoot)).find((c) => c);
  const canvas = find(document.querySelector(`.st-key-${key}`));
  if (!canvas || !canvas.width) return '';
  return canvas.width + ' ' + canvas.toDataURL();
}"""


def context_of(chromium, width: int = 1440):
    return chromium.new_context(viewport={"width": width, "height": 900}, accept_downloads=True)


def opened(context, address: str):
    page = context.new_page()
    page.goto(address)
    page.wait_for_selector(".st-key-map_realization canvas", timeout=SLOW)
    at_rest(page)
    return page


def large(page, number: int, of: int) -> None:
    """Wait until a realization is shown large."""
    page.locator(".panel", has_text=f"Realization {number} of {of}").wait_for(timeout=SLOW)


def open_share(page) -> None:
    body = page.locator(".st-key-share_body")
    at_rest(page)
    until(
        lambda: None if body.count() else page.locator(".st-key-share button").first.click(),
        lambda wait: body.locator(".stCode").first.wait_for(timeout=wait),
    )
    at_rest(page)


def taken(page, key: str, path: Path) -> Path:
    """Click a download button, save the file at `path`, and return `path`."""
    button = page.locator(f".st-key-{key} button:visible").first
    with page.expect_download(timeout=SLOW) as download:
        button.click(timeout=SOON)
    download.value.save_as(path)
    return path


def cells(page, folder: Path) -> str:
    """Return a digest of all realizations on a page."""
    at_rest(page)
    button = page.locator(".st-key-downloads button").first
    file = page.locator(".st-key-download_realizations_npz button:visible").first
    until(
        lambda: None if file.count() else button.click(timeout=SOON),
        lambda wait: file.wait_for(timeout=wait),
    )
    with np.load(taken(page, "download_realizations_npz", folder / "out.npz")) as saved:
        found = hashlib.sha256(saved["realizations"].tobytes()).hexdigest()
    page.keyboard.press("Escape")
    return found


def picture(page) -> str:
    """Return the pixels of the large realization once it no longer changes."""
    return settled(page, lambda: page.evaluate(PIXELS, "map_realization"), pause=700)


def run_to(page, number: int, of: int) -> None:
    run(page)
    large(page, number, of)
    at_rest(page)


def test_an_opened_link_shows_the_same_picture(chromium, desktop, address, tmp_path):
    from playwright.sync_api import expect

    other = context_of(chromium)
    page = opened(desktop, f"{address}/simulate?{SMALL}")
    menu(page, "image_row")
    follow(page, page.get_by_role("link", name="Facies, colours, turns, advice"), "import")
    page.locator(".st-key-image_flip_ew label").first.wait_for(timeout=SLOW)
    switch_on(page, "image_flip_ew")
    page.wait_for_function("() => location.search.includes('turn=ew')", timeout=SLOW)
    to_page(page, "Simulate")
    page.wait_for_selector(".st-key-map_realization canvas", timeout=SLOW)
    at_rest(page)
    entries = page.evaluate("history.length")
    choose(page, "template_size", "24")
    fill(page, "seed", 31)
    fill(page, "n_realizations", 4)
    run_to(page, 1, 4)
    show_third(page)
    for part in ("template=24", "seed=31", "realizations=4", "turn=ew", "show=3", "grid=64x48"):
        page.wait_for_function("(part) => location.search.includes(part)", arg=part, timeout=SOON)
    link = page.url
    assert page.evaluate("history.length") == entries
    again = opened(other, link)
    large(again, 3, 4)
    assert again.url == link

    def alike() -> None:
        assert picture(again) == picture(page)

    soon(alike)
    assert cells(again, tmp_path) == cells(page, tmp_path)
    open_share(again)
    said = again.locator(".st-key-share_body .stCode code").first
    expect(said).to_have_text(link, timeout=SOON)
    page.close()
    other.close()


def show_third(page) -> None:
    """Choose a realization in the contact sheet, which redraws only a part of the page."""
    until(
        lambda: page.get_by_role("button", name="Realization 3").first.click(timeout=SOON),
        lambda wait: page.wait_for_function(
            "() => location.search.includes('show=3')", timeout=wait
        ),
    )
    large(page, 3, 4)


def test_a_change_asks_for_the_page_once_and_data_by_hand_are_in_the_address(chromium, address):
    context = context_of(chromium)
    page = context.new_page()
    asked: list[BackMsg] = []  # requests of the user; active runs send requests by themselves

    def sent(frame) -> None:
        message = BackMsg.FromString(frame)
        if message.HasField("rerun_script") and not message.rerun_script.is_auto_rerun:
            asked.append(message)

    page.on("websocket", lambda socket: socket.on("framesent", sent))
    page.goto(f"{address}/data?{SMALL}")
    canvas = page.locator(".st-key-editor canvas")
    canvas.wait_for(timeout=SLOW)
    at_rest(page)
    page.locator(".st-key-editor .brushes button").first.click(timeout=SOON)
    before = len(asked)
    canvas.click(timeout=SOON)
    page.wait_for_function("() => location.search.includes('points=')", timeout=SLOW)
    at_rest(page)
    page.wait_for_timeout(1000)
    assert len(asked) - before == 1
    link = page.url
    page.close()
    again = context.new_page()
    again.goto(link)
    again.locator(".facts", has_text="1 of 1 data honoured").wait_for(timeout=SLOW)
    context.close()


def test_live_changes_are_in_the_address_and_back_leads_to_the_page_before(desktop, address):
    page = opened(desktop, f"{address}/simulate?{SMALL}")
    switch_on(page, "live")
    for seed in (3, 14, 15):
        fill(page, "seed", seed)
        page.wait_for_function(f"() => location.search.includes('seed={seed}')", timeout=SLOW)
    at_rest(page)
    there = "() => location.pathname.endsWith('validate') && location.search.includes('seed=15')"
    to_page(page, "Validate")
    page.wait_for_function(there, timeout=SLOW)
    at_rest(page)
    page.go_back()
    page.wait_for_function("() => location.pathname.endsWith('simulate')", timeout=SLOW)
    page.wait_for_function("() => location.search.includes('seed=15')", timeout=SLOW)
    page.close()


def test_a_project_opened_after_a_restart_gives_the_same_numbers(desktop, tmp_path):
    from playwright.sync_api import expect

    array = np.kron(np.random.default_rng(2).integers(0, 2, (10, 12)) * 5, np.ones((5, 5), int))
    np.save(tmp_path / "wall.npy", array)
    lines = [f"{k % 8 * 7},{k // 8 * 5},{k % 2 * 5}" for k in range(40)]
    (tmp_path / "wells.csv").write_text("\n".join(["col,row,facies", *lines, ""]))
    file = tmp_path / "study.ccwsim"
    with served() as before:
        page = opened(desktop, f"{before}/simulate?{SMALL}&seed=5")
        upload(page, "image", tmp_path / "wall.npy", "wall")
        upload(page, "data", tmp_path / "wells.csv", "40 data")
        run_to(page, 1, 3)
        page.locator(".facts", has_text="40 of 40 data honoured").wait_for(timeout=SLOW)
        numbers = cells(page, tmp_path)
        open_share(page)
        words = "cannot contain the training image wall.npy and the hard data wells.csv"
        expect(page.locator(".st-key-share_body")).to_contain_text(words, timeout=SOON)
        taken(page, "share_save", file)
        page.close()
    with served() as after:
        page = opened(desktop, f"{after}/simulate?{SMALL}")
        box = page.locator(".st-key-share_open input[type=file]")
        until(
            lambda: None if box.count() else page.locator(".st-key-open button").first.click(),
            lambda wait: box.wait_for(state="attached", timeout=wait),
        )
        box.set_input_files(file, timeout=SLOW)
        page.locator(".facts", has_text="40 of 40 data honoured").wait_for(timeout=SLOW)
        page.locator(".st-key-image_row .note", has_text="wall").wait_for(timeout=SLOW)
        page.keyboard.press("Escape")
        assert cells(page, tmp_path) == numbers
        page.wait_for_function("() => location.search.includes('seed=5')", timeout=SOON)
        page.close()


def test_the_report_opens_offline_with_all_its_figures(chromium, address, tmp_path):
    from playwright.sync_api import expect

    width = 390
    context = context_of(chromium, width)
    page = opened(context, f"{address}/simulate?{SMALL}&show=2")
    open_share(page)

    def fits() -> None:
        box = page.locator(".st-key-share_body").bounding_box()
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= width
        assert page.evaluate("document.documentElement.scrollWidth") <= width

    soon(fits)
    file = taken(page, "share_report", tmp_path / "report.html")
    context.close()
    offline = chromium.new_context(viewport={"width": width, "height": 900}, offline=True)
    report, asked = offline.new_page(), []
    report.on("request", lambda request: asked.append(request.url)
              if not request.url.startswith(("file:", "data:", "blob:")) else None)  # fmt: skip
    report.goto(file.as_uri())
    expect(report.locator(".plot .main-svg").first).to_be_visible(timeout=SLOW)
    expect(report.locator(".plot:has(.main-svg)")).to_have_count(6, timeout=SLOW)
    drawn = "() => [...document.images].filter((i) => i.complete && i.naturalWidth > 0).length"
    report.wait_for_function(f"() => ({drawn})() === 2 + 3 + 2", timeout=SOON)
    shown = report.locator("figcaption", has_text="Realization 2 of 3")
    expect(shown).to_have_count(1, timeout=SOON)
    assert file.stat().st_size < 3_000_000
    narrow = f"() => document.documentElement.scrollWidth <= {width}"
    report.wait_for_function(narrow, timeout=SOON)
    assert asked == []
    offline.close()


def test_the_report_can_be_read_on_the_page(desktop, address):
    from playwright.sync_api import expect

    page = opened(desktop, f"{address}/simulate?{SMALL}&show=2")
    open_share(page)
    read, dialog = page.locator(".st-key-share_read button"), page.locator("[role=dialog] iframe")
    until(
        lambda: None if dialog.count() else read.click(timeout=SOON),
        lambda wait: dialog.wait_for(timeout=wait),
    )
    shown = page.frame_locator("[role=dialog] iframe")
    expect(shown.locator(".plot:has(.main-svg)")).to_have_count(6, timeout=SLOW)
    expect(shown.locator("figcaption", has_text="Realization 2 of 3")).to_have_count(
        1, timeout=SLOW
    )
    until(
        lambda: page.keyboard.press("Escape"),
        lambda wait: expect(dialog).to_have_count(0, timeout=wait),
    )
    expect(page.locator(".st-key-map_realization canvas")).to_be_visible(timeout=SLOW)
    page.close()
