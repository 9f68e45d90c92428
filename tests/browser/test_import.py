"""Test in a browser that files of several programs can be simulated after at most three answers."""

from __future__ import annotations

import re
from io import BytesIO

import numpy as np
import pytest
from PIL import Image, ImageFilter
from scipy.io import savemat
from scipy.ndimage import gaussian_filter

from tests.browser.hands import (
    GLANCE,
    SLOW,
    at_rest,
    choose,
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


def matlab() -> bytes:
    file = BytesIO()
    volume = np.stack([share < FIELD for share in (0.4, 0.5, 0.6)], axis=-1).astype(float)
    savemat(file, {"facies": volume, "porosity": FIELD})
    return file.getvalue()


def large() -> bytes:
    file = BytesIO()
    codes = np.kron(FIELD > 0.5, np.ones((36, 36), bool)).astype(np.uint8)
    Image.fromarray(codes * 255).save(file, "PNG")
    return file.getvalue()


FILES = {
    "map.jpg": (map_in_colours, 3),
    "volume.mat": (matlab, 2),
    "large.png": (large, 2),
}


@pytest.mark.parametrize("name", FILES)
def test_a_file_reaches_a_simulation(tab, address, name, tmp_path):
    made, n_facies = FILES[name]
    kind = "volume" if name == "volume.mat" else "map"  # all layers are used
    file = tmp_path / name
    file.write_bytes(made())
    tab.goto(f"{address}/simulate?{STUDY}")
    tab.wait_for_selector(".st-key-map_e_type canvas", timeout=SLOW)
    menu(tab, "image_row")
    tab.locator(".st-key-image_file input[type=file]").set_input_files(file, timeout=SLOW)
    tab.wait_for_url("**/import*", timeout=SLOW)  # the page opens by itself
    tab.wait_for_selector(f".st-key-{kind}_import canvas", timeout=SLOW)
    at_rest(tab)
    tab.screenshot(path=tmp_path / "asked.png")
    use = tab.get_by_role("button", name="Use this image")
    on = tab.get_by_role("button", name="Simulate", exact=True)
    until(
        lambda: None if on.count() else use.click(timeout=GLANCE),
        lambda wait: on.wait_for(timeout=wait),
    )
    follow(tab, on, "simulate")
    note = tab.locator(".st-key-image_row .note", has_text=f"{n_facies} facies")
    note.first.wait_for(timeout=SLOW)
    tab.wait_for_function(
        "() => !document.querySelector('.st-key-progress, i.results-outdated, .ghost')",
        timeout=SLOW,
    )
    tab.wait_for_selector(f".st-key-{kind}_realization canvas", timeout=SLOW)
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
    given.set_input_files(file, timeout=SLOW)


def test_boreholes_in_utm_with_names_reach_a_simulation(tab, address, tmp_path):
    rng = np.random.default_rng(8)
    corners = np.indices((6, 5)).reshape(2, -1).T * (500.0, 400.0) + np.array((436000, 4505000))
    places = (corners + rng.uniform(0, 200, (30, 2))).round(1).tolist()
    rows = [f"B {k};{x};{y};{rng.choice(['Sand', 'mud'])}" for k, (x, y) in enumerate(places)]
    text = "\n".join(["Well;Easting [m];Northing [m];Lithology", *rows])
    file = {"name": "log.csv", "mimeType": "text/csv", "buffer": text.encode()}
    tab.goto(f"{address}/import?{STUDY}")
    bring_wells(tab, file)
    fit = tab.locator(".st-key-ask_fit").get_by_role("button")
    fit.wait_for(timeout=SLOW)
    at_rest(tab)
    tab.reload()  # the file and its questions wait here
    fit.wait_for(timeout=SLOW)
    at_rest(tab)
    tab.screenshot(path=tmp_path / "asked.png", full_page=True)
    until(
        lambda: fit.click(timeout=GLANCE) if fit.count() else None,
        lambda wait: tab.get_by_text("30 data of log.csv are in the study").wait_for(timeout=wait),
    )
    tab.screenshot(path=tmp_path / "fitted.png", full_page=True)
    follow(tab, tab.get_by_role("button", name="Simulate", exact=True), "simulate")
    honoured = re.compile(r"30 of 30 data honoured")
    tab.locator(".facts", has_text=honoured).first.wait_for(timeout=SLOW)
    tab.wait_for_selector(".st-key-map_realization canvas", timeout=SLOW)
    at_rest(tab)
    tab.screenshot(path=tmp_path / "simulated.png", full_page=True)


WELLS = {
    "collars": "hole_id,x,y,elevation,depth\nW1,20.5,20.5,24,24\nW2,70.5,30.5,24,24\n"
    "W3,50.5,40.5,24,24\n",
    "intervals": "hole_id,from,to,lith\nW1,0,8,0\nW1,8,14,1\nW1,14,24,0\nW2,0,5,0\nW2,5,24,1\n"
    "W3,0,10,0\nW3,10,22,1\nW3,20,24,0\nW5,0,10,1\n",
    "surveys": "hole_id,depth,azimuth,dip\nW3,0,90,-60\nW3,24,90,-50\n",
}
OF_VOLUME = "ti=sinuous_channels&grid=96x64x24&data=none&realizations=1"


def test_problems_of_tables_of_wells_are_said_at_once_each_with_a_choice(tab, address, tmp_path):
    tab.goto(f"{address}/import?{OF_VOLUME}")
    given = tab.locator(".st-key-wells_collars input[type=file]")
    for key, label in (("import_subject", "Hard data"), ("import_tables", "tables of collars")):
        kind = tab.locator(f".st-key-{key}").get_by_text(label)
        kind.wait_for(timeout=SLOW)
        at_rest(tab)
        kind.click(timeout=SLOW)
    given.wait_for(state="attached", timeout=SLOW)
    for name, text in WELLS.items():
        file = {"name": f"{name}.csv", "mimeType": "text/csv", "buffer": text.encode()}
        box = tab.locator(f".st-key-wells_{name} input[type=file]")
        box.set_input_files(file, timeout=SLOW)
        tab.locator(f".st-key-wells_{name}").get_by_text(f"{name}.csv").wait_for(timeout=SLOW)
        at_rest(tab)
    said = "pairs of intervals that overlap: 1, wells without a collar: 1"
    tab.get_by_text(said).first.wait_for(timeout=SLOW)
    at_rest(tab)
    tab.screenshot(path=tmp_path / "asked.png", full_page=True)
    choose(tab, "ask_on_overlap", "keep the upper interval whole")
    choose(tab, "ask_on_no_collar", "leave them out")
    tab.get_by_text("collars.csv, surveys.csv are in the study").wait_for(timeout=SLOW)
    tab.screenshot(path=tmp_path / "answered.png", full_page=True)
    follow(tab, tab.get_by_role("button", name="Simulate", exact=True), "simulate")
    tab.wait_for_selector(".st-key-volume_realization canvas", timeout=SLOW)
    at_rest(tab)
    tab.screenshot(path=tmp_path / "simulated.png", full_page=True)


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
