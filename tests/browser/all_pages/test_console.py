"""Test that a first visit to a page logs nothing in the browser console or on the server."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

from tests.browser.hands import SLOW, at_rest
from tests.browser.served import CHROMIUM, ROOT, started
from tests.ui.sessions import Session

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no {CHROMIUM}"),
]
PAGES = sorted(path.stem for path in (ROOT / "pages").glob("*.py"))
LOGGED = re.compile(r"^(?:\d{4}-\d\d-\d\d (?!.*server started)|Traceback|\w+Error).*", re.M)
"""Log lines, except the greeting of a server that starts."""
BASE = re.compile(r"/\w+/_stcore/(health|host-config)$")
"""Requests below the path of a page, which fail: Streamlit tries them before the root of the
app."""


@pytest.fixture(scope="module")
def server(tmp_path_factory) -> Iterator[tuple[str, Path]]:
    log = tmp_path_factory.mktemp("console") / "server.log"
    with started(log=log) as own:
        with Session(own.address) as first:  # waits longer for kernels than a browser does
            first.open("simulate")
        yield own.address, log


@pytest.mark.parametrize("page", ["", *PAGES])
def test_a_first_visit_leaves_the_consoles_empty(chromium, server, page):
    address, log = server
    said = []
    with closing(chromium.new_context()) as profile:  # a new profile with empty storage
        tab = profile.new_page()
        tab.on("console", lambda message: said.append((message.text, message.location["url"])))
        tab.on("pageerror", lambda error: said.append((str(error), "")))
        tab.goto(f"{address}/{page}", timeout=SLOW)
        at_rest(tab)
        tab.wait_for_timeout(3000)  # so that timers run
        at_rest(tab)
    assert [(text, url) for text, url in said if not BASE.search(url)] == []
    assert LOGGED.findall(log.read_text()) == []


def test_a_late_tick_of_a_timer_is_not_logged(server):
    address, log = server
    with Session(address) as session:
        session.open("benchmark")
        session._ask(fragment="0" * 32)
        session.open("benchmark")  # answered after the tick
        assert session.errors == []
    assert LOGGED.findall(log.read_text()) == []
