"""Test that the study returns after the server dies during a run, or the client loses the page."""

from __future__ import annotations

import pytest

from tests.browser.hands import GLANCE, SLOW, at_rest, fill, until
from tests.browser.served import CHROMIUM, free_port, started
from tests.browser.test_share import PIXELS, context_of, large, opened, picture

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no {CHROMIUM}"),
]

FEW, MANY = 10, 300
"""Numbers of realizations: the second run takes seconds, so that *Live* does not start it."""
STUDY = f"grid=400x300&data=none&template=16&overlap=4&realizations={FEW}&seed=31"
SAME = f"(before) => ({PIXELS})('map_realization') === before"


def test_a_server_killed_in_mid_run_and_started_again_shows_the_same_picture(chromium):
    context, port = context_of(chromium), free_port()
    with started(port=port) as first:
        page = opened(context, f"{first.address}/simulate?{STUDY}")
        large(page, 1, FEW)
        before = picture(page)
        fill(page, "n_realizations", MANY)
        link = page.url
        button = page.locator(".st-key-run button").first
        progress = page.locator(".st-key-progress").first
        until(
            lambda: None if progress.count() else button.click(timeout=GLANCE),
            lambda wait: progress.wait_for(timeout=wait),
        )
        first.process.kill()
        first.process.wait(60)
        assert page.url == link
        assert page.locator(".st-key-map_realization canvas").count()  # the old map stays
    with started(port=port):
        again = opened(context, link)
        large(again, 1, MANY)
        assert again.url == link
        again.wait_for_function(SAME, arg=before, timeout=SLOW)
        again.close()
        # the open tab reconnects by itself
        page.wait_for_selector("[data-test-connection-state=CONNECTED]", timeout=SLOW)
        at_rest(page)
        large(page, 1, MANY)
        page.wait_for_function(SAME, arg=before, timeout=SLOW)
        assert page.url == link
    context.close()


def test_a_page_that_the_client_has_lost_is_opened_again_once(tab, address):
    study = f"{address}/simulate?grid=96x64&data=none&template=16&overlap=4&realizations=3"
    tab.goto(f"{study}&seed=8")
    large(tab, 1, 3)
    before = picture(tab)
    lose = """() => {
      window.lost = true;
      setTimeout(() => { throw Error('Bad delta path index 6 (should be between [0, 1])'); });
    }"""
    tab.evaluate(lose)
    tab.wait_for_function("() => !window.lost", timeout=SLOW)
    large(tab, 1, 3)
    tab.wait_for_function(SAME, arg=before, timeout=SLOW)
    tab.evaluate("sessionStorage.setItem('openedAgain', Date.now())")  # as if just opened
    tab.evaluate(lose)
    tab.wait_for_timeout(1000)
    assert tab.evaluate("window.lost")  # no endless loop
