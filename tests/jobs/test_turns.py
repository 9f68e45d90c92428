"""Test that a few pages are drawn at a time, in order, without waiting for slow pages."""

from __future__ import annotations

from threading import Event, Thread

import pytest

from ccwsim.jobs.scheduler import Turns
from tests.waiting import wait_until

SLOW = 60


class Clock:
    """A clock that stands still until a test moves it."""

    now = 0.0

    def __call__(self) -> float:
        return self.now


class Page(Thread):
    """A thread that draws a page until it is told to end, with a pause if requested."""

    def __init__(self, turns: Turns, began: list[str], name: str) -> None:
        super().__init__(daemon=True)
        self.turns, self.began, self.name = turns, began, name
        self.pause, self.reply, self.end = Event(), Event(), Event()
        self.start()

    def run(self) -> None:
        with self.turns.turn():
            self.began.append(self.name)
            while not self.end.wait(0.005):
                if self.pause.is_set():
                    self.pause.clear()
                    self.turns.wait(self.reply, SLOW)
                    self.began.append(f"{self.name} again")

    def finish(self) -> None:
        self.end.set()
        self.join(SLOW)


def pages(turns: Turns, names: str) -> tuple[dict[str, Page], list[str]]:
    """Return threads that start one after another, and the names in the order of their start."""
    began: list[str] = []
    here = {}
    for k, name in enumerate(names):
        here[name] = Page(turns, began, name)
        wait_until(lambda k=k: turns.n_active + len(turns._waiting) == k + 1, name)
    return here, began


def test_a_few_work_at_a_time_in_the_order_in_which_they_come():
    turns = Turns(2, SLOW)
    here, began = pages(turns, "abcd")
    wait_until(lambda: sorted(began) == ["a", "b"], "two pages")
    assert turns.n_active == 2
    here["b"].finish()
    wait_until(lambda: began[2:] == ["c"], "the third")
    here["a"].finish()
    wait_until(lambda: began[2:] == ["c", "d"], "the fourth")
    here["c"].finish()
    here["d"].finish()
    assert turns.n_active == 0


def test_a_page_that_waits_lets_another_work_and_comes_next():
    turns = Turns(1, SLOW)
    here, began = pages(turns, "abc")
    here["a"].pause.set()
    wait_until(lambda: began == ["a", "b"], "the second")
    here["a"].reply.set()
    wait_until(lambda: len(turns._waiting) == 2, "the first, which has its answer")
    here["b"].finish()
    wait_until(lambda: began == ["a", "b", "a again"], "the first")
    here["a"].finish()
    wait_until(lambda: began[-1] == "c", "the third")
    here["c"].finish()


def test_a_page_that_takes_long_lets_another_begin():
    clock = Clock()
    turns = Turns(1, 0.01, clock)
    here, began = pages(turns, "ab")
    assert began == ["a"]
    clock.now = 1.0
    wait_until(lambda: began == ["a", "b"], "the second")
    here["a"].finish()
    here["b"].finish()


def test_an_error_ends_the_turn():
    turns = Turns(1)
    with pytest.raises(ZeroDivisionError), turns.turn():
        raise ZeroDivisionError
    assert turns.n_active == 0


def test_a_thread_without_a_turn_only_waits():
    turns, event = Turns(1), Event()
    assert not turns.wait(event, 0.0)
    event.set()
    assert turns.wait(event, 0.0)
    assert turns.n_active == 0
