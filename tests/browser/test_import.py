"""Test the page Import in a browser: a picture is divided into facies and simulated."""

from __future__ import annotations

from io import BytesIO

import numpy as np
import pytest
from PIL import Image, ImageFilter
from scipy.ndimage import gaussian_filter

from tests.browser.hands import (
    GLANCE,
    SLOW,
    at_rest,
    follow,
    menu,
    settled,
    soon,
    until,
)
from tests.browser.served import CHROMIUM

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no {CHROMIUM}"),
]

STUDY = "grid=64x48&data=none&template=16&overlap=4&realizations=2"
SMOOTH = gaussian_filter(np.random.default_rng(5).normal(size=(72, 96)), 4)
FIELD = (SMOOTH - SMOOTH.min()) / np.ptp(SMOOTH)
COLOURS = np.array([(40, 60, 150), (235, 200, 90), (60, 150, 80)], np.uint8)


def sgems() -> bytes:
    values = "\n".join(f"{value:.4f}" for value in FIELD.ravel())
    return f"96 72 1\n1\nporosity\n{values}\n".encode()


def map_in_colours() -> bytes:
    image = Image.fromarray(COLOURS[np.digitize(FIELD, [0.4, 0.6])])
    file = BytesIO()
    image.filter(ImageFilter.GaussianBlur(1)).save(file, "JPEG", quality=80)
    return file.getvalue()


def test_a_file_reaches_a_simulation(tab, address, tmp_path):
    file = tmp_path / "map.jpg"
    file.write_bytes(map_in_colours())
    tab.goto(f"{address}/simulate?{STUDY}")
    tab.wait_for_selector(".st-key-map_e_type canvas", timeout=SLOW)
    menu(tab, "image_row")
    tab.locator(".st-key-image_file input[type=file]").set_input_files(file, timeout=SLOW)
    tab.wait_for_url("**/import*", timeout=SLOW)  # the page opens by itself
    tab.wait_for_selector(".st-key-map_import canvas", timeout=SLOW)
    at_rest(tab)
    tab.screenshot(path=tmp_path / "asked.png")
    use = tab.get_by_role("button", name="Use this image")
    on = tab.get_by_role("button", name="Simulate", exact=True)
    until(
        lambda: None if on.count() else use.click(timeout=GLANCE),
        lambda wait: on.wait_for(timeout=wait),
    )
    follow(tab, on, "simulate")
    note = tab.locator(".st-key-image_row .note", has_text="3 facies")
    note.first.wait_for(timeout=SLOW)
    tab.wait_for_function(
        "() => !document.querySelector('.st-key-progress, i.results-outdated, .ghost')",
        timeout=SLOW,
    )
    tab.wait_for_selector(".st-key-map_realization canvas", timeout=SLOW)
    tab.screenshot(path=tmp_path / "simulated.png")


def bring_wells(tab, file) -> None:
    """Upload a file of hard data on the page Import."""
    kind = tab.locator(".st-key-import_subject").get_by_text("Hard data", exact=True)
    given = tab.locator(".st-key-wells_file input[type=file]")
    kind.wait_for(timeout=SLOW)
    until(
        lambda: None if given.count() else kind.click(timeout=GLANCE),
        lambda wait: given.wait_for(state="attached", timeout=wait),
    )
    at_rest(tab)  # a field that is drawn anew loses its file
    given.set_input_files(file, timeout=SLOW)


def test_a_bundled_image_is_chosen_by_its_picture(tab, address):
    tab.goto(f"{address}/simulate?{STUDY}")
    tab.wait_for_selector(".st-key-map_realization canvas", timeout=SLOW)
    menu(tab, "image_row")
    picture = tab.locator(".st-key-image_sheet").get_by_role("button", name="barchans")
    picture.wait_for(timeout=SLOW)
    note = tab.locator(".st-key-image_row .note", has_text="400 × 400, 3 facies")
    until(lambda: picture.click(timeout=GLANCE), lambda wait: note.wait_for(timeout=wait))


def test_the_line_on_the_histogram_is_dragged_and_moved_with_a_key(tab, address):
    tab.goto(f"{address}/import?{STUDY}")
    box = tab.locator(".st-key-import_image_file input[type=file]")
    content = {"name": "grey.sgems", "mimeType": "text/plain", "buffer": sgems()}
    box.set_input_files(content, timeout=SLOW)
    line = tab.locator(".st-key-image_histogram [role=slider]")
    line.wait_for(timeout=SLOW)
    at_rest(tab)
    number = tab.locator(".st-key-ask_threshold input").first
    guessed = float(settled(tab, number.input_value))

    def is_at_the_guess() -> None:
        assert float(line.get_attribute("aria-valuenow")) == pytest.approx(guessed, rel=1e-3)

    soon(is_at_the_guess)

    def drag() -> None:
        at_rest(tab)
        place = line.bounding_box()
        x, y = place["x"] + place["width"] / 2, place["y"] + place["height"] / 2
        tab.mouse.move(x, y)
        tab.mouse.down()
        tab.mouse.move(x + 60, y, steps=4)
        tab.mouse.up()

    more = f"() => {NUMBER} > {guessed} + 0.02"
    until(drag, lambda wait: tab.wait_for_function(more, timeout=wait))
    at_rest(tab)
    dragged = float(settled(tab, number.input_value))
    less = f"() => {NUMBER} < {dragged}"
    until(
        lambda: line.press("ArrowLeft"),
        lambda wait: tab.wait_for_function(less, timeout=wait),
    )


NUMBER = "Number(document.querySelector('[class*=st-key-ask_threshold] input').value)"
