"""Test that a crash of a worker process ends the run of one visitor and disturbs no other."""

from __future__ import annotations

import os
import signal
import subprocess
from pathlib import Path

import pytest

from tests.browser.hands import GLANCE, at_rest, fill, run, until
from tests.browser.served import CHROMIUM, started
from tests.browser.test_share import context_of, large, opened
from tests.waiting import wait_until

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no {CHROMIUM}"),
    pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="processes are found in /proc"),
]
FEW, MANY = 4, 400
STUDY = f"grid=300x200&data=none&template=16&overlap=4&realizations={FEW}"


def children_of(pid: int) -> list[int]:
    """Return the processes that a process has started."""
    files = Path(f"/proc/{pid}/task").glob("*/children")
    return [int(child) for file in files for child in file.read_text().split()]


def workers_of(server: subprocess.Popen) -> list[int]:
    """Return the worker processes of a server, which are forks of one of its processes."""
    return [worker for process in children_of(server.pid) for worker in children_of(process)]


def start_many(page) -> None:
    """Start a run that takes long enough to be disturbed."""
    fill(page, "n_realizations", MANY)
    button, progress = page.locator(".st-key-run button").first, page.locator(".st-key-progress")
    until(
        lambda: None if progress.count() else button.click(timeout=GLANCE),
        lambda wait: progress.first.wait_for(timeout=wait),
    )


def test_a_killed_worker_is_a_message_to_its_visitor_alone(chromium, monkeypatch):
    monkeypatch.setenv("CCWSIM_PROCESSES", "1")
    ann, bob = context_of(chromium), context_of(chromium)
    with started() as server:
        pages = [
            opened(context, f"{server.address}/simulate?{STUDY}&seed={seed}")
            for seed, context in enumerate([ann, bob])
        ]
        for page in pages:
            large(page, 1, FEW)
        for page in pages:
            start_many(page)
        wait_until(lambda: len(workers_of(server.process)) == 2, "a worker for each run")
        victim = workers_of(server.process)[0]
        os.kill(victim, signal.SIGKILL)
        wait_until(lambda: any(alerts(page).count() for page in pages), "the message")
        struck, other = sorted(pages, key=lambda page: -alerts(page).count())
        assert struck.locator(".st-key-map_realization canvas").count()  # earlier results stay
        fill(struck, "n_realizations", FEW + 1)
        run(struck)
        large(struck, 1, FEW + 1)
        assert not alerts(struck).count()
        large(other, 1, MANY)
        at_rest(other)
        assert not alerts(other).count()
        workers = workers_of(server.process)
        assert victim not in workers
        server.process.kill()
        wait_until(lambda: not any(map(is_there, workers)), "the end of the workers")
    ann.close()
    bob.close()


def alerts(page):
    return page.locator("[data-testid=stAlert]", has_text="the process that simulated it")


def is_there(pid: int) -> bool:
    return Path(f"/proc/{pid}").exists()
