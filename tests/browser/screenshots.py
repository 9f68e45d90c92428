"""Take pictures of pages: python -m tests.browser.screenshots [--volume] OUT [PAGE ...]

Pictures are taken of the named pages, by default of all pages, at widths of 1440, 1024 and 390
pixels, light and dark. They show the empty page (before any results), the first screen with
results, and the whole page. With --volume, the study is a volume with wells.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from contextlib import suppress
from itertools import product
from pathlib import Path
from urllib.parse import urlencode

import numpy as np

from tests.browser.hands import GLANCE, choose, until
from tests.browser.served import browser, served

SIZES = {1440: 900, 1024: 768, 390: 844}
PHONE = 640  # maximum width at which the study is a sheet over the page
SLOW = 180_000
VOLUME = {
    "ti": "sinuous_channels", "data": "sinuous_channels_10_wells", "grid": "100x100x48",
    "template": "32x32x16", "overlap": "8x8x4", "level": "2x2x1", "realizations": "4",
}  # fmt: skip
SETTLED = "() => !document.querySelector('.st-key-progress, .ghost')"
WHOLE = "() => !document.querySelector('.working, [data-testid=stSkeleton]')"
HEIGHT = "document.querySelector('[data-testid=stMain]').scrollHeight"


def fill_with_maps(page) -> None:
    """Wait for the maps of a page that fills itself."""
    page.wait_for_selector(":is(.st-key-results, .st-key-editing) canvas", timeout=SLOW)


def press(page, button: str, begun: str) -> None:
    """Click a button until the effect of the click is visible."""
    found = page.locator(button).locator("visible=true").first
    found.wait_for(timeout=SLOW)
    until(
        lambda: None if page.locator(begun).count() else found.click(timeout=GLANCE),
        lambda wait: page.locator(begun).first.wait_for(timeout=wait),
    )


def fill_with_times(page) -> None:
    """Run the measurement of the page Benchmark."""
    end = ".st-key-results .note:has-text('median of')"
    press(page, ".st-key-measure button:not([disabled])", f".st-key-benchmark_cancel, {end}")
    # times are measured when no other run is going, which may be a while on a busy server
    page.wait_for_selector(end, timeout=2 * SLOW)
    page.wait_for_selector(".st-key-measure button:not([disabled])", timeout=2 * SLOW)


def fill_with_experiments(page) -> None:
    """Run the quick version of the paper's experiments."""
    page.locator(".st-key-paper_extent button", has_text="Quick").click(timeout=SLOW)
    page.wait_for_function("() => /about \\d+ s on/.test(document.body.innerText)", timeout=SLOW)
    press(page, ".st-key-paper_start button", ".st-key-paper_cancel, .st-key-download_paper")
    page.wait_for_selector(".st-key-download_paper", timeout=SLOW)


def fill_with_settings(page) -> None:
    """Sweep the suggested settings of the study."""
    start = ".st-key-sweep_first button, .st-key-sweep_below button"
    press(page, start, ".st-key-sweep_progress, .st-key-sweep_table")
    page.wait_for_selector(".st-key-sweep_table", timeout=SLOW)


def fill_with_pictures(page) -> None:
    """Wait for the pictures of all examples."""
    page.wait_for_selector(".pictures", timeout=SLOW)
    page.wait_for_function("() => !document.querySelector('.pictures[aria-busy]')", timeout=SLOW)


def fill_with_file(page) -> None:
    """Upload a file of grey values, about which the page asks a question."""
    values = np.add.outer(np.sin(np.arange(60) / 5), np.cos(np.arange(80) / 7))
    lines = "\n".join(f"{value:.3f}" for value in values.ravel())
    content = f"80 60 1\n1\ngrey\n{lines}\n".encode()
    file = {"name": "grey.sgems", "mimeType": "text/plain", "buffer": content}
    box = page.locator(".st-key-import_image_file input[type=file]")
    box.set_input_files(file, timeout=SLOW)  # type: ignore[arg-type]
    page.wait_for_selector(".st-key-image_histogram canvas", timeout=SLOW)


def fill_with_flow(page) -> None:
    """Place a well, and solve all realizations."""
    page.wait_for_selector(".st-key-flow_maps canvas", timeout=SLOW)
    if page.locator(".st-key-map_flow canvas").count():
        canvas, well = page.locator(".st-key-map_flow canvas").first, ".st-key-flow_remove"
        until(
            lambda: None if page.locator(well).count() else canvas.click(timeout=GLANCE),
            lambda wait: page.locator(well).first.wait_for(state="attached", timeout=wait),
        )
    is_narrow = page.viewport_size["width"] <= PHONE
    if is_narrow:  # the button is in the sheet with the study
        page.locator("[data-testid=stExpandSidebarButton]").first.click(timeout=SLOW)
    press(
        page, ".st-key-flow_all button:not([disabled])", ".st-key-flow_cancel, .st-key-flow_below"
    )
    page.wait_for_selector(".st-key-flow_below", timeout=SLOW)
    if is_narrow:
        page.locator("[data-testid=stSidebarCollapseButton] button").click(timeout=SLOW)


def fill_with_steps(page) -> None:
    """Wait for the table of the paper's steps."""
    page.wait_for_selector(".st-key-method_text table", timeout=SLOW)


def fill_with_guides(page) -> None:
    """Let the probability of a facies change across the grid."""
    fill_with_maps(page)
    page.locator(".st-key-guides_task button", has_text="What is likely where").click(timeout=SLOW)
    page.wait_for_selector(".st-key-guides_probabilities", timeout=SLOW)
    choose(page, "guides_probabilities", "a gradient")
    page.wait_for_selector("i.results-current", state="attached", timeout=SLOW)


FILLED = {
    "benchmark": fill_with_times,
    "examples": fill_with_pictures,
    "flow": fill_with_flow,
    "guides": fill_with_guides,
    "import": fill_with_file,
    "paper": fill_with_experiments,
    "paper_and_ours": fill_with_steps,
    "sweep": fill_with_settings,
}
"""Functions that fill pages that do not fill themselves with maps, by the name of the page's
file."""


def take_share(page, path: Path) -> None:
    """Take a picture of the menu that shares a study, and close the menu."""
    page.locator(".st-key-share button").first.click(timeout=SLOW)
    page.wait_for_selector(".st-key-share_body .stCode", timeout=SLOW)
    page.wait_for_timeout(500)
    page.screenshot(path=path)
    page.keyboard.press("Escape")
    page.evaluate("document.activeElement.blur()")
    page.wait_for_timeout(500)


def take_whole(page, width: int, path: Path) -> None:
    """Take a picture of the whole page after the parts outside the screen are drawn."""
    from playwright.sync_api import TimeoutError as Overdue

    tall = 0
    while tall != (now := page.evaluate(HEIGHT)):
        tall = now
        page.set_viewport_size({"width": width, "height": max(tall, SIZES[width])})
        page.wait_for_timeout(800)
        with suppress(Overdue):  # a section that does not apply to this study stays empty
            page.wait_for_function(WHOLE, timeout=60_000)
        page.wait_for_timeout(1200)
    page.screenshot(path=path)


def take_all(out: Path, names: Sequence[str] = (), volume: bool = False) -> None:
    """Write pictures of each page, width and theme into a folder; without names, of all pages."""
    from ccwsim.ui.page import OFF_MENU, PAGES

    out.mkdir(parents=True, exist_ok=True)
    with served() as address, browser() as chromium:
        pages = [page for page in (*PAGES, *OFF_MENU) if not names or Path(page[1]).stem in names]
        for (title, path), width, theme in product(pages, SIZES, ("light", "dark")):
            context = chromium.new_context(
                viewport={"width": width, "height": SIZES[width]}, color_scheme=theme,
                device_scale_factor=1 if width > PHONE else 2,
            )  # fmt: skip
            page = context.new_page()
            study = f"?{urlencode(VOLUME)}" if volume else ""
            page.goto(f"{address}/{Path(path).stem}{study}")
            name = f"{Path(path).stem}-{width}-{theme}"
            page.wait_for_selector(".st-key-menu", timeout=60_000)
            page.screenshot(path=out / f"{name}-empty.png")
            FILLED.get(Path(path).stem, fill_with_maps)(page)
            page.wait_for_function(SETTLED, timeout=SLOW)
            page.wait_for_timeout(1500)
            page.screenshot(path=out / f"{name}-first.png")
            if Path(path).stem == "simulate":
                take_share(page, out / f"{name}-share.png")
            take_whole(page, width, out / f"{name}.png")
            print(f"{title}: {name}")
            context.close()


if __name__ == "__main__":
    given = [word for word in sys.argv[1:] if word != "--volume"]
    if not given:
        sys.exit("usage: python -m tests.browser.screenshots [--volume] OUT [PAGE ...]")
    take_all(Path(given[0]), given[1:], "--volume" in sys.argv)
