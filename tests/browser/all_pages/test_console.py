"""Test that a first visit to a page logs nothing in the browser console or on the server."""

from __future__ import annotations

import re
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest
from streamlit.proto.ForwardMsg_pb2 import ForwardMsg

from tests.browser.hands import SLOW, at_rest
from tests.browser.served import CHROMIUM, ROOT, started
from tests.ui.sessions import Session

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no {CHROMIUM}"),
]
PAGES = sorted(path.stem for path in (ROOT / "pages").glob("*.py"))
FIRST = ("", "import", "validate")
"""Addresses opened in a browser; test_accessibility.py reads the console on the way to others."""
SMALL = "grid=96x64&data=none&template=16&overlap=4&realizations=2"
LOGGED = re.compile(r"^(?:\d{4}-\d\d-\d\d (?!.*server started)|Traceback|\w+Error).*", re.M)
"""Log lines, except the greeting of a server that starts."""
BASE = re.compile(r"/\w+/_stcore/(health|host-config)$")
"""Requests below the path of a page, which fail: Streamlit tries them before the root of the
app."""


@pytest.fixture(scope="module")
def server(tmp_path_factory) -> Iterator[tuple[str, Path]]:
    log = tmp_path_factory.mktemp("console") / "server.log"
    with started(log=log) as own:
        yield own.address, log


@pytest.fixture(scope="module")
def said(chromium, server) -> dict[str, list[tuple[str, str]]]:
    """Return the text and the address of each message in the console of each page.

    Cookies and storage are empty for each page, as on a first visit; the files of Streamlit are
    not loaded again. The pages are open side by side, because their timers need seconds.
    """
    address, _ = server
    found: dict[str, list[tuple[str, str]]] = {page: [] for page in FIRST}
    with closing(chromium.new_context()) as profile:
        profile.add_init_script("localStorage.clear(); sessionStorage.clear()")
        tabs = []
        for page, own in found.items():
            profile.clear_cookies()
            tab = profile.new_page()
            tab.on("console", lambda m, own=own: own.append((m.text, m.location["url"])))
            tab.on("pageerror", lambda error, own=own: own.append((str(error), "")))
            tab.goto(f"{address}/{page}", timeout=SLOW)
            at_rest(tab)
            tabs.append(tab)
        tabs[-1].wait_for_timeout(3000)  # so that timers run
        for tab in tabs:
            at_rest(tab)
    return found


@pytest.mark.parametrize("page", FIRST)
def test_a_first_visit_leaves_the_console_of_the_browser_empty(said, page):
    assert [(text, url) for text, url in said[page] if not BASE.search(url)] == []


def test_first_visits_leave_the_log_of_the_server_empty(said, server):
    address, log = server
    for page in PAGES:
        with Session(address, query=SMALL) as session:
            session.open(page)
            assert session.errors == []
    assert LOGGED.findall(log.read_text()) == []


def received(session: Session) -> list[ForwardMsg]:
    """Return the messages that a session has received since its list was emptied."""
    messages = []
    for content in session.received or ():
        messages.append(ForwardMsg())
        messages[-1].ParseFromString(content)
    return messages


def test_a_tick_of_the_page_before_begins_no_run_on_the_next_page(server):
    """Test that no run of the previous page is announced; a browser would remove the next page."""
    with Session(server[0], query=SMALL) as session:
        session.open("simulate")
        session.received = []
        session.open("simulate")
        before = session._script
        *_, fragment = (m.delta.fragment_id for m in received(session) if m.delta.fragment_id)
        session.received.clear()
        session.page, session._script = "compare", ""
        session._ask()
        session._script = before
        session._ask(fragment=fragment, repeats=True)
        session._until("script_finished")
        session._take_until(time.monotonic() + 2)
        begun = [
            m.metadata.run.fragment_ids for m in received(session) if m.HasField("new_session")
        ]
    assert begun
    assert not any(begun)


def test_a_late_tick_of_a_timer_is_not_logged(server):
    address, log = server
    with Session(address) as session:
        session.open("benchmark")
        session._ask(fragment="0" * 32)
        session.open("benchmark")  # answered after the tick
        assert session.errors == []
    assert LOGGED.findall(log.read_text()) == []
