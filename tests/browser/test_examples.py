"""Test that the page Examples fills its pictures in a browser."""

from __future__ import annotations

import pytest

from tests.browser.hands import SLOW, soon
from tests.browser.served import CHROMIUM

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no {CHROMIUM}"),
]


def test_pictures_come_and_stay_in_their_room(tab, address):
    tab.goto(f"{address}/examples")
    tab.wait_for_function(
        "() => document.querySelectorAll('.pictures').length >= 18"
        " && !document.querySelector('.pictures[aria-busy]')",
        timeout=SLOW,
    )
    loaded = "() => [...document.querySelectorAll('.pictures img')].map((i) => i.naturalWidth > 0)"

    def are_shown() -> None:
        shown = tab.evaluate(loaded)
        assert all(shown)
        assert len(shown) >= 18 * 3

    soon(are_shown)
