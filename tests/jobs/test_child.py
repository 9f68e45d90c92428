"""Test that a child process ends when its input is closed, even if others started later."""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
import sys
import time

import pytest

from ccwsim.jobs import child
from ccwsim.jobs.child import ChildProcess, connect_to_parent


def echo() -> None:
    """Answer each request with the request."""
    requests, answers = connect_to_parent()
    while True:
        answers.write(pickle.dumps(requests.get()))


def look_away() -> None:
    """Answer once, then ignore the input, like a process inside a long call."""
    answers = os.fdopen(os.dup(1), "wb", 0)
    answers.write(pickle.dumps(pickle.load(sys.stdin.buffer)))
    time.sleep(600)


def answered(process: ChildProcess) -> ChildProcess:
    process.send("hello")
    assert pickle.load(process.answers) == "hello"
    return process


def test_a_child_ends_when_its_input_is_closed():
    assert answered(ChildProcess(echo)).end() == 0


@pytest.mark.skipif(not hasattr(os, "fork"), reason="the system has no fork")
@pytest.mark.filterwarnings("ignore:.*multi-threaded.*:DeprecationWarning")
def test_a_fork_does_not_hold_the_input_of_a_child(monkeypatch):
    monkeypatch.setattr(child, "END_SECONDS", 60.0)
    process = answered(ChildProcess(echo))
    fork = multiprocessing.get_context("fork").Process(target=time.sleep, args=(600,), daemon=True)
    fork.start()
    try:
        assert answered(process).end() == 0
    finally:
        fork.kill()


def test_a_child_that_does_not_end_is_killed(monkeypatch):
    monkeypatch.setattr(child, "END_SECONDS", 0.2)
    assert answered(ChildProcess(look_away)).end() == -signal.SIGKILL
