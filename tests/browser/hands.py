"""User actions in a browser: open a menu, choose an option, type, upload a file.

A page that is redrawn under the mouse may lose a click, especially on a slow machine. A user then
repeats the click, and so do these functions.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from time import monotonic, sleep
from typing import Any

from ccwsim.ui.page import MENU, PAGES

SOON, SLOW = 30_000, 180_000
"""Milliseconds to wait for an immediate effect, and for the result of a computation."""
GLANCE = 8_000
"""Milliseconds after which an action without effect is repeated."""
TRIES = 4


def at_rest(page) -> None:
    """Wait until the page has been redrawn after the last action."""
    page.wait_for_timeout(150)  # until the message is sent
    page.wait_for_selector("[data-test-script-state=notRunning]", timeout=SLOW)


def until(act: Callable[[], None], seen: Callable[[int], None]) -> None:
    """Repeat an action until its effect is seen; `seen(milliseconds)` raises without the effect."""
    from playwright.sync_api import Error

    for attempt in range(TRIES):
        try:
            act()
            seen(GLANCE if attempt + 1 < TRIES else SOON)
            return
        except (AssertionError, Error, TypeError):  # an element that is being replaced has no box
            if attempt + 1 == TRIES:
                raise


def soon(holds: Callable[[], object], within: float = SOON) -> None:
    """Repeat a function with assertions until all hold, because pages are drawn with a delay."""
    from playwright.sync_api import Error

    end = monotonic() + within / 1000
    while True:
        try:
            holds()
            return
        except (AssertionError, Error, TypeError):  # an element that is being replaced has no box
            if monotonic() > end:
                raise
        sleep(0.1)


def settled(page, read: Callable[[], Any], pause: float = 500) -> Any:
    """Return the result of `read` once it is not empty and does not change for a moment."""
    found: list[Any] = [None]

    def stays() -> None:
        found.append(read())
        page.wait_for_timeout(pause)
        assert found[-1]
        assert found[-1] == read()

    soon(stays, SLOW)
    return found[-1]


def run(page) -> None:
    """Press Run until the results are no longer out of date."""
    from playwright.sync_api import expect

    outdated = page.locator("i.results-outdated")
    button = page.locator(".st-key-run").get_by_role("button", name="Run")
    at_rest(page)  # a short run has begun without the button
    until(
        lambda: button.click(timeout=SOON) if outdated.count() else None,
        lambda wait: expect(outdated).to_have_count(0, timeout=wait),
    )


def fits_a_phone(page, title: str) -> None:
    """Check that a page with this title is not wider than a phone and shows no warning."""

    def fits() -> None:
        assert page.title() == title
        assert page.evaluate("document.scrollingElement.scrollWidth") <= 390
        assert not page.locator("[data-testid=stException], [data-testid=stAlert]").count()

    soon(fits)


def menu(page, key: str) -> None:
    """Open one of the menus of the study column."""
    opened = page.locator(f".st-key-{key.removesuffix('_row')}_menu [aria-expanded=true]")
    button = page.locator(f".st-key-{key}").get_by_role("button", name="Change")
    at_rest(page)
    until(
        lambda: None if opened.count() else button.click(timeout=SOON),
        lambda wait: opened.first.wait_for(timeout=wait),
    )


def close_menu(page) -> None:
    """Close the menu that is open."""
    at_rest(page)
    page.keyboard.press("Escape")


def choose(page, key: str, option: str) -> None:
    """Choose an option of a list."""
    from playwright.sync_api import expect

    box = page.locator(f".st-key-{key} input").first

    def pick() -> None:
        if box.input_value() != option:
            box.click(timeout=GLANCE)
            page.get_by_role("option", name=option, exact=True).click(timeout=GLANCE)

    at_rest(page)
    until(pick, lambda wait: expect(box).to_have_value(option, timeout=wait))
    at_rest(page)


def switch_on(page, key: str) -> None:
    """Switch a toggle on."""
    from playwright.sync_api import expect

    box, label = page.locator(f".st-key-{key} input"), page.locator(f".st-key-{key} label")
    at_rest(page)
    until(
        lambda: None if box.is_checked() else label.first.click(timeout=SOON),
        lambda wait: expect(box).to_be_checked(timeout=wait),
    )
    at_rest(page)


def follow(page, link, to: str) -> None:
    """Click a link until the page with the name `to` is open."""
    until(
        lambda: None if f"/{to}" in page.url else link.click(timeout=SOON),
        lambda wait: page.wait_for_url(f"**/{to}*", timeout=wait),
    )


def to_page(page, title: str) -> None:
    """Open a page with the menu at the top of all pages."""
    row = page.locator(".st-key-menu")
    lists = page.locator("[data-testid=stPopoverBody]")
    link = row.or_(lists).get_by_role("link", name=title, exact=True)
    groups = [name for name, pages in MENU.items() if title in dict(pages) and len(pages) > 1]

    def click() -> None:
        for name in groups:
            button = row.get_by_role("button", name=name, exact=True)
            if button.is_visible() and not link.count():
                button.click(timeout=GLANCE)
        link.click(timeout=SOON)

    path = Path(dict(PAGES)[title]).stem
    until(
        lambda: None if f"/{path}" in page.url else click(),
        lambda wait: page.wait_for_url(f"**/{path}*", timeout=wait),
    )


def fill(page, key: str, value: object) -> None:
    """Type a value into a box, press Enter, and check that the value stays."""
    from playwright.sync_api import expect

    box = page.locator(f".st-key-{key} input").first

    def write() -> None:
        at_rest(page)
        box.fill(str(value))
        box.press("Enter")

    def stays(wait: int) -> None:
        at_rest(page)
        expect(box).to_have_value(str(value), timeout=wait)

    until(write, stays)


def upload(page, key: str, file: Path, note: str) -> None:
    """Upload the image or the data of the study, and wait until the note contains `note`."""
    menu(page, f"{key}_row")
    page.locator(f".st-key-{key}_file input[type=file]").set_input_files(file, timeout=SLOW)
    said = page.locator(f".st-key-{key}_row .note", has_text=note)
    said.first.wait_for(timeout=SLOW)
    close_menu(page)


def downloaded(page, key: str):
    """Open the menu of downloads above the results, and return the download with a key."""
    opens = page.locator(".st-key-facts_row").get_by_role("button", name="Download")
    file = page.locator(f".st-key-download_{key} button").first
    until(
        lambda: None if file.is_visible() else opens.click(timeout=GLANCE),
        lambda wait: file.wait_for(timeout=wait),
    )
    with page.expect_download(timeout=SLOW) as waiting:
        file.click(timeout=SLOW)
    return waiting.value
