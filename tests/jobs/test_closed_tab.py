"""Test that closing a tab ends its job and releases all memory of its session."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from tests.browser.served import ROOT, started
from tests.ui.sessions import Session, resident
from tests.waiting import wait_until

SLOW = 180.0
APP = f"""
import gc
import sys

sys.path.insert(0, {str(ROOT)!r})

import streamlit as st

from ccwsim import Grid
from ccwsim.ui.session import server
from ccwsim.sharing.choices import Choices
from ccwsim.jobs.job import Job
from ccwsim.jobs.job import server_queue
from ccwsim.ui.study.run import start_run
from ccwsim.ui.session.state import State, session_state

server.GRACE, server.LOOK_SECONDS, server.EARLY = 1.0, 0.1, 1e9
server.settle_server()

if "look" not in st.query_params:
    state = session_state()
    if state.job is None:
        state.choices = Choices(grid=Grid(5000, 5000), n_realizations=40)
        start_run(state)
    st.html(f"<p>{{'begun' if state.job else state.message}}</p>")
else:
    gc.collect()
    kinds = [type(each) for each in gc.get_objects()]
    n_active, n_waiting = server_queue().n_active, len(server_queue()._waiting)
    st.html(f"<p>{{n_active + n_waiting}} jobs, {{kinds.count(State)}} states, "
            f"{{kinds.count(Job)}} kept</p>")
"""


@pytest.fixture
def address(tmp_path: Path):
    (tmp_path / "app.py").write_text(APP)
    with started(tmp_path) as server:
        yield server.address


def wait_for(looking: Session, wanted: str) -> None:
    """Wait until the server gives the expected answer."""
    end, said = time.monotonic() + SLOW, ""
    while said != wanted:
        assert time.monotonic() < end, f"the server says {said!r}"
        said = looking.open(query="look=1").words()[0].removeprefix("<p>").removesuffix("</p>")


@pytest.mark.slow
def test_the_job_of_a_closed_tab_ends_and_its_memory_is_given_back(address):
    with Session(address, page="") as looking:
        with Session(address, page="") as working:
            assert "begun" in working.open().words()[0]
            wait_for(looking, "1 jobs, 1 states, 1 kept")
        wait_for(looking, "0 jobs, 0 states, 0 kept")


@pytest.mark.slow
def test_the_last_tab_leaves_no_memory_behind():
    small = "grid=64x64&data=none&template=16&overlap=4&realizations=1"
    with started(ROOT, "--server.disconnectedSessionTTL=20") as server:

        def visit(query: str) -> int:
            with Session(server.address, "simulate", query) as tab:
                tab.open()
                return resident(server.process.pid)

        visit(small)
        before = visit(small)
        held = visit("grid=3000x3000&data=none&realizations=2")
        assert held > before + 100 * 10**6
        wait_until(
            lambda: resident(server.process.pid) < before + 50 * 10**6,
            f"memory to go back to {before} bytes, from {held} while the tab was open",
            every=1,
        )
