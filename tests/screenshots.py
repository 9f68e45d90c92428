"""Take pictures of every page: python -m tests.screenshots OUT

At 1440 and 390 pixels, light and dark: empty (as the page first shows itself), the first screen
with results, and the whole page.
"""

from __future__ import annotations

import sys
from itertools import product
from pathlib import Path

from tests.served import browser, served

SIZES = {1440: 900, 390: 844}
SLOW = 180_000
SETTLED = "() => !document.querySelector('.st-key-progress, .ghost')"


def fill_with_maps(page) -> None:
    """Wait for the maps of a page that fills itself."""
    page.wait_for_selector(".st-key-results canvas", timeout=SLOW)


def fill_with_times(page) -> None:
    """Take both measurements of the page of times."""
    for kind, end in (
        ("grids", ".st-key-download_times"),
        ("data", ".st-key-part_data .note:has-text('median of')"),
    ):
        page.locator(f".st-key-measure_{kind} button:not([disabled])").click(timeout=SLOW)
        page.wait_for_selector(end, timeout=SLOW)
    page.wait_for_selector(".st-key-measure_data button:not([disabled])", timeout=SLOW)


def fill_with_experiments(page) -> None:
    """Run the paper's experiments, quickly."""
    page.locator(".st-key-paper_extent button", has_text="Quick").click(timeout=SLOW)
    page.wait_for_function("() => document.body.innerText.includes('under a minute')", timeout=SLOW)
    page.locator(".st-key-paper_start button").click(timeout=SLOW)
    page.wait_for_selector(".st-key-download_paper", timeout=SLOW)


def fill_with_settings(page) -> None:
    """Sweep the settings that suit the study."""
    page.locator(".st-key-sweep_first button, .st-key-sweep_below button").locator(
        "visible=true"
    ).first.click(timeout=SLOW)
    page.wait_for_selector(".st-key-sweep_table", timeout=SLOW)


def fill_with_pictures(page) -> None:
    """Wait for the pictures of all examples."""
    page.wait_for_selector(".pictures", timeout=SLOW)
    page.wait_for_function("() => !document.querySelector('.pictures[aria-busy]')", timeout=SLOW)


FILLED = {
    "benchmark": fill_with_times,
    "examples": fill_with_pictures,
    "paper": fill_with_experiments,
    "sweep": fill_with_settings,
}
"""What fills a page that does not fill itself with maps, by the name of its file."""


def take_share(page, path: Path) -> None:
    """Take a picture of the menu to share a study, and close it again."""
    page.locator(".st-key-share button").first.click(timeout=SLOW)
    page.wait_for_selector(".st-key-share_body .stCode", timeout=SLOW)
    page.wait_for_timeout(500)
    page.screenshot(path=path)
    page.keyboard.press("Escape")
    page.wait_for_timeout(500)


def take_all(out: Path) -> None:
    """Write one PNG a page, width and theme into a folder."""
    from ccwsim.ui.page import PAGES

    out.mkdir(parents=True, exist_ok=True)
    with served() as address, browser() as chromium:
        for (title, path), width, theme in product(PAGES, SIZES, ("light", "dark")):
            context = chromium.new_context(
                viewport={"width": width, "height": SIZES[width]}, color_scheme=theme,
                device_scale_factor=1 if width > 640 else 2,
            )  # fmt: skip
            page = context.new_page()
            page.goto(f"{address}/{Path(path).stem}")
            name = f"{Path(path).stem}-{width}-{theme}"
            page.wait_for_selector(".st-key-menu", timeout=60_000)
            page.screenshot(path=out / f"{name}-empty.png")
            FILLED.get(Path(path).stem, fill_with_maps)(page)
            page.wait_for_function(SETTLED, timeout=SLOW)
            page.wait_for_timeout(1500)
            page.screenshot(path=out / f"{name}-first.png")
            if Path(path).stem == "simulate":
                take_share(page, out / f"{name}-share.png")
            tall = page.evaluate("document.querySelector('[data-testid=stMain]').scrollHeight")
            page.set_viewport_size({"width": width, "height": max(tall, SIZES[width])})
            page.wait_for_timeout(800)
            page.screenshot(path=out / f"{name}.png")
            print(f"{title}: {name}")
            context.close()


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: python -m tests.screenshots OUT")
    take_all(Path(sys.argv[1]))
