"""Make the pictures of the how-to pages, or some: python -m tests.browser.pictures [NAME ...]

Each picture is the part of a page that the text describes, in the light theme, as a PNG with few
colours in docs/images/how-to. Times in the pictures are those of this machine.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Sequence
from io import BytesIO
from typing import Any, NamedTuple
from urllib.parse import quote

from PIL import Image

from tests.browser.hands import until
from tests.browser.screenshots import FILLED, SETTLED, SLOW, fill_with_maps
from tests.browser.served import ROOT, browser, served

OUT = ROOT / "docs/images/how-to"
WIDTH = 1280
MAX_BYTES = 100_000
COLOURS = (160, 128, 96, 64, 48, 32, 24)
"""Numbers of colours to try, until the size of a picture is within its limit."""
REST = 2500
"""Milliseconds to wait until charts no longer move."""
WELLS = """well;easting;northing;top;lithology
W1;36,5;40,5;1210;sand
W2;120,5;88,5;1190;mud
W3;210,5;150,5;1205;mud
W4;95,5;230,5;1187;channel sand
W5;260,5;61,5;1201;mud
W6;301,5;402,5;1199;sand
W7;402,5;333,5;1215;mud
W8;440,5;120,5;1211;mud
W9;350,5;246,5;1208;sand
W10;655,5;90,5;1220;mud
"""


def fill_with_wells(page: Any) -> None:
    """Upload a table of wells with an unknown facies name and a row outside the grid."""
    page.locator(".st-key-import_subject button", has_text="Hard data").click(timeout=SLOW)
    file = {"name": "wells.csv", "mimeType": "text/csv", "buffer": WELLS.encode()}
    box = page.locator(".st-key-wells_file input[type=file]")
    box.set_input_files(file, timeout=SLOW)
    page.wait_for_selector("img[alt='Positions of the data in the grid']", timeout=SLOW)


def draw_a_well(page: Any) -> None:
    """Draw a line of data on the map, and wait for the run."""
    fill_with_maps(page)
    page.wait_for_function(SETTLED, timeout=SLOW)
    for choice in ("[data-tool=straight]", "[data-brush='-2']"):
        page.locator(f".st-key-editor {choice}").click(timeout=SLOW)
    canvas = page.locator(".st-key-editor canvas")
    box = canvas.bounding_box()
    assert box
    x, y, side = box["x"], box["y"], box["width"]
    page.mouse.move(x + 0.55 * side, y + 0.3 * side)
    page.mouse.down()
    page.mouse.move(x + 0.55 * side, y + 0.62 * side, steps=8)
    page.mouse.up()
    page.locator(".st-key-editor [data-tool=draw]").click(timeout=SLOW)
    page.mouse.move(5, 5)
    page.wait_for_selector(".panel:has-text('40 data')", state="detached", timeout=SLOW)
    page.wait_for_timeout(REST)


def choose_probabilities(page: Any) -> None:
    """Choose the task that draws probabilities on the map of the guides."""
    fill_with_maps(page)
    page.locator(".st-key-guides_task button", has_text="What is likely where").click(timeout=SLOW)
    page.wait_for_selector(".st-key-guides_facies", timeout=SLOW)


def play_quiz(page: Any) -> None:
    """Play a round of the quiz."""
    page.locator(".st-key-examples_view button", has_text="Quiz").click(timeout=SLOW)
    pictures = page.locator(".st-key-quiz_pictures button")
    until(
        lambda: pictures.nth(2).click(timeout=SLOW),
        lambda wait: page.locator(".verdict").wait_for(timeout=wait),
    )


def open_share(page: Any) -> None:
    """Open the menu that shares a study."""
    fill_with_maps(page)
    page.wait_for_selector(".panel:has-text('of 12')", timeout=SLOW)
    page.wait_for_timeout(REST)
    page.locator(".st-key-share button").first.click(timeout=SLOW)
    page.wait_for_selector(".st-key-share_body .stCode", timeout=SLOW)


def unfold_experiments(page: Any) -> None:
    """Run the quick version of the paper's experiments, and unfold two of them."""
    FILLED["paper"](page)
    for k in (0, 6):
        page.locator(".verdicts details summary").nth(k).click(timeout=SLOW)


class Picture(NamedTuple):
    """A picture: the address of its page, the function that fills the page, and the shown part.

    `top` is a selector of the element at the top of the picture; empty for the top of the page.
    `left` is the number of pixels cut off at the left, and `width` the width of the window.
    """

    address: str
    height: int
    fill: Callable[[Any], None] = fill_with_maps
    top: str = ""
    left: int = 0
    width: int = WIDTH


STUDY = "grid=256x256&data=sampled&data-n=40&data-seed=4"


def guides(**choices: Any) -> str:
    """Return guides as a part of an address."""
    return f"guides={quote(json.dumps(choices, separators=(',', ':')))}"


ZONES = guides(
    images=[{"bundled": "stone_wall"}],
    zones=[[[12, 140], [244, 140], [244, 250], [12, 250]]],
    angle=[[[12, 20], [60, 28], [120, 60], [170, 110], [200, 128]]],
    flow_azimuth=92,
)
"""A second image in an outline, and a line along which both images are turned."""
STROKES = (0.75, 0.5, [[60, 60], [120, 150], [200, 190]]), (0.05, 0.6, [[190, 60]])
GUIDES = guides(
    probabilities=[
        {"value": value, "radius": 25, "softness": softness, "points": points}
        for value, softness, points in STROKES
    ],
    active=[[20, 30], [130, 15], [235, 40], [245, 170], [190, 235], [90, 240], [25, 170]],
)
VOLUME = "ti=sinuous_channels&data=sinuous_channels_10_wells&grid=100x100x48&realizations=8"
PICTURES = {
    "simulate": Picture(f"simulate?{STUDY}", 830),
    "simulate-volume": Picture(
        f"simulate?{VOLUME}", 800, top=".st-key-facts_row", left=344, width=1700
    ),
    "import": Picture("import", 750, FILLED["import"]),
    "import-wells": Picture("import?data=none", 1030, fill_with_wells),
    "hard-data": Picture(f"data?{STUDY}", 790, draw_a_well),
    "guides": Picture(f"guides?{STUDY}&{GUIDES}", 860, choose_probabilities),
    "guides-zones": Picture(f"guides?data=none&grid=256x256&realizations=6&{ZONES}", 800),
    "validate": Picture(f"validate?{STUDY}&realizations=20", 930),
    "flow": Picture(f"flow?{STUDY}", 900, FILLED["flow"]),
    "compare": Picture(f"compare?{STUDY}", 960),
    "sweep": Picture(f"sweep?{STUDY}", 1000, FILLED["sweep"]),
    "how-it-works": Picture(f"how_it_works?{STUDY}", 900),
    "examples": Picture("examples", 560, FILLED["examples"]),
    "quiz": Picture("examples", 810, play_quiz),
    "benchmark": Picture("benchmark", 640, FILLED["benchmark"]),
    "paper-and-ours": Picture("paper_and_ours", 720, FILLED["paper_and_ours"]),
    "paper": Picture("paper", 800, unfold_experiments),
    "share": Picture(f"simulate?{STUDY}", 480, open_share, left=530),
}


def taken(page: Any, picture: Picture) -> bytes:
    """Return a screenshot of the part of a page as PNG."""
    page.wait_for_selector(".st-key-menu", timeout=60_000)
    picture.fill(page)
    page.wait_for_function(SETTLED, timeout=SLOW)
    page.wait_for_timeout(REST)
    page.evaluate("document.querySelector('[data-testid=stMain]').scrollTo(0, 0)")
    page.evaluate("document.activeElement.blur()")
    top = 0.0
    if picture.top:
        page.locator(picture.top).evaluate(
            "(part) => document.querySelector('[data-testid=stMain]')"
            ".scrollBy(0, part.getBoundingClientRect().top - 64)"
        )
        page.wait_for_timeout(REST)
        top = page.locator(picture.top).bounding_box()["y"] - 8
    width = picture.width - picture.left
    clip = {"x": picture.left, "y": top, "width": width, "height": picture.height}
    return page.screenshot(clip=clip)


def few_colours(png: bytes, max_bytes: int = MAX_BYTES) -> bytes:
    """Return a picture with a palette of fewer colours, at most `max_bytes` long if possible."""
    picture = Image.open(BytesIO(png)).convert("RGB")
    picture.thumbnail((WIDTH, picture.height), Image.Resampling.LANCZOS)
    content = b""
    for n in COLOURS:
        out = BytesIO()
        few = picture.quantize(n, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
        few.save(out, "PNG", optimize=True)
        content = out.getvalue()
        if len(content) <= max_bytes:
            break
    return content


def make(names: Sequence[str] = (), address: str = "") -> None:
    """Write pictures; without an address, start a dashboard first."""
    if not address:
        with served() as there:
            make(names, there)
        return
    OUT.mkdir(parents=True, exist_ok=True)
    with browser() as chromium:
        for name in names or PICTURES:
            picture = PICTURES[name]
            size = {"width": picture.width, "height": picture.height + (100 if picture.top else 0)}
            context = chromium.new_context(viewport=size, color_scheme="light")
            page = context.new_page()
            page.goto(f"{address}/{picture.address}")
            png = taken(page, picture)
            content = few_colours(png)
            (OUT / f"{name}.png").write_bytes(content)
            print(f"{name}: {len(content) / 1000:.0f} kB")
            context.close()


if __name__ == "__main__":
    make(sys.argv[1:])
