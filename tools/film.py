"""Record the film of README.md: python -m tools.film [OUT]

Starts the dashboard and a browser, moves a slider, places wells, shows the E-type and the flow, and
writes the screenshots as an animated WebP (assets/film.webp). A frame is shown for a fixed time,
not for the time that the program took; the times on the screen are those of this machine.
"""

from __future__ import annotations

import sys
from io import BytesIO
from pathlib import Path
from typing import Any

from PIL import Image, ImageDraw, ImageFont

from tests.browser.hands import at_rest, choose, until
from tests.browser.screenshots import SETTLED, SLOW, fill_with_maps
from tests.browser.served import ROOT, browser, served

OUT = ROOT / "assets/film.webp"
WIDTH, HEIGHT, CAPTION_HEIGHT = 1200, 760, 44
FONT_SIZE = 20
MAX_BYTES = 2_000_000
QUALITY = 60
"""Quality of the compression, from 0 to 100."""
STUDY = "ti=channels&grid=256x256&data=none"
TEMPLATES = 16, 40
"""Template sizes to which the slider is moved, in cells."""
WELLS = (
    (1, 0.22, 0.30), (0, 0.50, 0.24), (1, 0.78, 0.36), (0, 0.30, 0.62), (1, 0.62, 0.62),
    (0, 0.70, 0.85), (0, 0.12, 0.80), (1, 0.40, 0.86),
)  # fmt: skip
"""Facies and position of wells, as fractions of the map from the left and from the top."""
PUMPED = 0.55, 0.45  # position of the well of the page Flow
REST = 700
"""Milliseconds to wait until a page no longer moves."""
SOLVED = "() => !document.body.innerText.includes('Solving')"
POINTER = ((0, 0), (0, 22), (5, 17), (9, 26), (13, 24), (9, 16), (16, 16))


class Recorder:
    """Frames of a film: screenshots of a page with the pointer of the mouse and a caption."""

    def __init__(self, page: Any) -> None:
        self.page = page
        self.caption = ""
        self.pointer = WIDTH * 0.6, HEIGHT * 0.9
        self.frames: list[Image.Image] = []
        self.durations: list[int] = []

    def take(self, milliseconds: int) -> None:
        """Add the present page, to be shown for some time."""
        screenshot = Image.open(BytesIO(self.page.screenshot())).convert("RGB")
        frame = Image.new("RGB", (WIDTH, HEIGHT + CAPTION_HEIGHT), "#1d1d1b")
        frame.paste(screenshot)
        drawn = ImageDraw.Draw(frame)
        x, y = self.pointer
        drawn.polygon([(x + dx, y + dy) for dx, dy in POINTER], "black", "white")
        font = ImageFont.load_default(FONT_SIZE)
        middle = WIDTH / 2, HEIGHT + CAPTION_HEIGHT / 2
        drawn.text(middle, self.caption, "white", font, anchor="mm")
        self.frames.append(frame)
        self.durations.append(milliseconds)

    def move(self, x: float, y: float) -> None:
        """Move the mouse."""
        self.page.mouse.move(x, y, steps=4)
        self.pointer = x, y

    def settle(self, has_run: bool = True) -> None:
        """Wait until nothing moves and, if the page has a run of the study, until it has ended."""
        at_rest(self.page)
        if has_run:
            self.page.wait_for_function(SETTLED, timeout=SLOW)
        self.page.wait_for_timeout(REST)

    def drag_to(self, slider: str, value: int) -> None:
        """Drag the thumb of a slider until it has a value, and release it."""
        number = self.page.locator(f"{slider} [data-testid=stSliderThumbValue]").first
        number.evaluate("e => e.scrollIntoView({ block: 'center' })")
        box = number.bounding_box()
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] + 6
        self.move(x, y)
        self.take(500)
        self.page.mouse.down()
        step = 1 if int(number.inner_text()) < value else -1
        shown = number.inner_text()
        for _ in range(WIDTH):
            if step * int(number.inner_text()) >= step * value:
                break
            x += step
            self.move(x, y)
            if number.inner_text() != shown:
                shown = number.inner_text()
                self.take(120)
        self.take(250)
        self.page.mouse.up()

    def write(self, path: Path) -> None:
        """Write the film."""
        first, *others = self.frames
        first.save(
            path, "WEBP", save_all=True, append_images=others, duration=self.durations, loop=0,
            quality=QUALITY, method=6, minimize_size=True,
        )  # fmt: skip
        seconds, size = sum(self.durations) / 1000, path.stat().st_size
        print(f"{path}: {len(self.frames)} frames, {seconds:.1f} s, {size / 1000:.0f} kB")
        assert size <= MAX_BYTES


def move_the_slider(film: Recorder) -> None:
    """Show the first study, and move the slider of the template."""
    film.caption = "A training image, realizations that look like it, and their E-type"
    film.settle()
    film.take(2000)
    film.caption = "Move a slider: all realizations are simulated again"
    for size in TEMPLATES:
        film.drag_to(".st-key-template_size_slider", size)
        film.settle()
        film.take(1100)


def place_wells(film: Recorder) -> None:
    """Place wells on the map of the page *Hard data*."""
    page = film.page
    page.locator(".st-key-menu button", has_text="Data").first.click(timeout=SLOW)
    page.get_by_role("link", name="Hard data").locator("visible=true").first.click(timeout=SLOW)
    fill_with_maps(page)
    film.settle()
    film.caption = "Place wells: each realization honours them at once"
    canvas = page.locator(".st-key-editor canvas").first
    for number, (facies, right, down) in enumerate(WELLS, 1):
        page.locator(f".st-key-editor [data-brush='{facies}']").click(timeout=SLOW)
        box = canvas.bounding_box()
        film.move(box["x"] + right * box["width"], box["y"] + down * box["height"])
        until(
            lambda: page.mouse.click(*film.pointer),
            lambda wait, text=f"{number} dat": page.wait_for_selector(
                f".panel:has-text('{text}')", timeout=wait
            ),
        )
        film.settle()
        film.take(650)
    film.take(700)


def show_uncertainty(film: Recorder) -> None:
    """Show maps of the ensemble with the wells."""
    page = film.page
    page.get_by_role("link", name="Simulate").first.click(timeout=SLOW)
    fill_with_maps(page)
    film.caption = "The E-type: the probability of sand in each cell"
    film.move(WIDTH - 150, HEIGHT * 0.35)
    film.settle()
    film.take(1800)
    choose(page, "e_type", "entropy")
    film.caption = "The entropy: where the wells leave most doubt"
    film.settle()
    film.take(1500)


def show_flow(film: Recorder) -> None:
    """Place a pumped well, and let particles move."""
    page = film.page
    page.get_by_role("link", name="Flow").first.click(timeout=SLOW)
    page.wait_for_selector(".st-key-flow_maps canvas", timeout=SLOW)
    film.caption = "Flow: heads, and tracks of particles"
    film.settle(has_run=False)
    film.take(1300)
    canvas = page.locator(".st-key-map_flow canvas").first
    box = canvas.bounding_box()
    film.move(box["x"] + PUMPED[0] * box["width"], box["y"] + PUMPED[1] * box["height"])
    until(
        lambda: page.mouse.click(*film.pointer),
        lambda wait: page.locator(".st-key-flow_remove").first.wait_for(
            state="attached", timeout=wait
        ),
    )
    film.caption = "A click places a pumped well: red tracks end in it"
    page.wait_for_function(SOLVED, timeout=SLOW)
    film.settle(has_run=False)
    page.wait_for_function(SOLVED, timeout=SLOW)
    film.settle(has_run=False)
    film.take(2200)


def main(out: Path = OUT) -> None:
    """Record the film."""
    with served() as address, browser() as chromium:
        size: Any = {"width": WIDTH, "height": HEIGHT}
        page = chromium.new_context(viewport=size, color_scheme="light").new_page()
        page.goto(f"{address}/simulate?{STUDY}")
        page.wait_for_selector(".st-key-menu", timeout=SLOW)
        fill_with_maps(page)
        film = Recorder(page)
        for scene in (move_the_slider, place_wells, show_uncertainty, show_flow):
            scene(film)
        film.write(out)


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:2]))
