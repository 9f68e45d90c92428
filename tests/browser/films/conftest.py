"""Fixtures of the films: a browser that has not seen the program, and pictures of each step."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.browser.all_pages.test_console import BASE
from tests.browser.hands import GLANCE, SLOW, SOON, at_rest, soon, until
from tests.browser.screenshots import SIZES

FORMS = {"desktop": (1440, "light"), "phone": (390, "dark")}
if os.environ.get("CCWSIM_FILMS") == "all":
    FORMS |= {"desktop-dark": (1440, "dark"), "phone-light": (390, "light")}
CALM = "[data-testid=stException], [data-testid=stAlertContentError]"
DONE = """() => [...document.querySelectorAll('.st-key-progress, [data-testid=stSkeleton]')].every(
  (e) => !e.getClientRects().length || e.getBoundingClientRect().top > innerHeight)"""
OF_DRIVER = "GL Driver Message"  # logged if a picture is saved without a graphics card


class Film:
    """A window whose screen is taken after each step, in the folder of the test.

    ``pytest --basetemp=DIR tests/browser/films -m slow`` keeps the pictures in DIR; with
    ``CCWSIM_FILMS=all`` in the environment, each film has all widths and themes.
    """

    def __init__(self, page, address: str, folder: Path) -> None:
        self.page, self.address, self.folder, self.n_taken = page, address, folder, 0

    @property
    def width(self) -> int:
        return self.page.viewport_size["width"]

    def open(self, path: str = "") -> None:
        """Open an address of the dashboard."""
        self.page.goto(self.address + path)

    def see(self, what, wait: int = SLOW) -> None:
        """Wait until an element, or a text, is visible."""
        from playwright.sync_api import expect

        found = self.page.get_by_text(what) if isinstance(what, str) else what
        expect(found.locator("visible=true").first).to_be_visible(timeout=wait)

    def press(self, button, seen) -> None:
        """Click a button, again if the page was drawn anew, until the effect is visible."""
        at_rest(self.page)
        found = button.locator("visible=true")
        until(
            lambda: found.first.click(timeout=GLANCE) if found.count() else None,
            lambda wait: self.see(seen, wait),
        )

    def picture(self, name: str) -> None:
        """Take the screen, which may show an error."""
        self.page.wait_for_function(DONE, timeout=SLOW)
        at_rest(self.page)
        self.n_taken += 1
        self.page.screenshot(path=self.folder / f"{self.n_taken:02}-{name}.png")

    def take(self, name: str) -> None:
        """Take the screen; no error is shown, and nothing is wider than the window."""
        self.picture(name)
        wide = "document.scrollingElement.scrollWidth"

        def calm() -> None:
            assert not self.page.locator(CALM).count()
            assert self.page.evaluate(wide) <= self.width

        soon(calm, SOON)


@pytest.fixture(params=FORMS)
def film(request, chromium, address, tmp_path) -> Iterator[Film]:
    """Yield a film in a new window of each form; its last screen must be accessible.

    The console must be empty at the end.
    """
    from tests.browser.all_pages.test_accessibility import findings  # skips if axe is missing

    width, theme = FORMS[request.param]
    context = chromium.new_context(
        viewport={"width": width, "height": SIZES[width]},
        color_scheme=theme,
        accept_downloads=True,
    )
    page, said = context.new_page(), []
    page.on("console", lambda m: said.append((m.text, m.location["url"])))
    page.on("pageerror", lambda error: said.append((str(error), "")))
    yield Film(page, address, tmp_path)

    def accessible() -> None:
        assert findings(page) == []

    soon(accessible, SOON)
    context.close()
    ours = [text for text, url in said if not BASE.search(url) and OF_DRIVER not in text]
    assert ours == []
