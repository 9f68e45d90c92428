"""Test that statistics are computed once, in order, in the background, and can be stopped."""

from __future__ import annotations

import threading
from threading import Event

import pytest

from ccwsim import CCWSIMError
from ccwsim.jobs.memo import Memo
from ccwsim.jobs.statistics import Failure, StatisticsWorker, Task


def of(key, work):
    return Task((key,), work)


def value(bench, statistic, seconds=5.0):
    bench.ask(statistic)
    return bench.wait_for(statistic, seconds)


def test_a_statistic_is_worked_out_once_for_all_who_ask():
    calls = []
    shelf = Memo()
    one = of("a", lambda progress: calls.append(1) or 7)
    same = of("a", lambda progress: calls.append(2) or 8)
    assert value(StatisticsWorker(shelf), one) == 7
    assert value(StatisticsWorker(shelf), same) == 7
    assert calls == [1]


def test_they_are_worked_out_in_order_on_another_thread():
    order, threads = [], set()

    def work(name):
        def run(progress):
            order.append(name)
            threads.add(threading.current_thread())
            return name

        return run

    bench = StatisticsWorker(Memo())
    asked = [of(name, work(name)) for name in "abcd"]
    for statistic in asked:
        bench.ask(statistic)
    assert bench.wait_for(asked[-1], 5.0) == "d"
    assert order == list("abcd")
    assert threading.main_thread() not in threads


def test_waiting_ends_with_nothing_where_it_takes_longer():
    go = Event()
    bench = StatisticsWorker(Memo())
    slow = of("slow", lambda progress: progress(0.25) or go.wait(5) or 1)
    assert value(bench, slow, 0.05) is None
    assert bench.share_of(slow) == 0.25
    assert bench.share_of(of("other", lambda p: 1)) is None
    go.set()
    assert bench.wait_for(slow, 5.0) is True


def test_what_was_not_begun_can_be_forgotten():
    begun, go, done = Event(), Event(), []
    bench = StatisticsWorker(Memo())
    first = of("first", lambda progress: begun.set() or go.wait(5))
    second = of("second", lambda progress: done.append(1) or 2)
    bench.ask(first)
    bench.ask(second)
    assert begun.wait(5)
    bench.forget()
    go.set()
    assert bench.wait_for(first, 5.0)
    assert bench.wait_for(second, 0.1) is None
    assert value(bench, second) == 2
    assert done == [1]


@pytest.mark.slow
def test_a_stop_ends_what_is_at_work_and_it_can_go_on():
    begun = Event()

    def work(progress):
        for k in range(10_000):
            begun.set()
            Event().wait(0.002)
            progress(k / 10_000)
        return 1

    bench = StatisticsWorker(Memo())
    long, next_one = of("long", work), of("next", lambda progress: 5)
    bench.ask(long)
    bench.ask(next_one)
    assert begun.wait(5)
    bench.stop()
    assert bench.stopped
    assert bench.wait_for(long, 0.2) is None
    assert value(bench, next_one, 0.1) is None
    bench.go_on()
    assert value(bench, next_one) == 5


@pytest.mark.parametrize(
    ("error", "said"),
    [(CCWSIMError("too small"), "too small"), (ZeroDivisionError("x"), "number"),
     (MemoryError(), "memory")],
)  # fmt: skip
def test_an_error_is_an_answer_and_the_next_is_worked_out(error, said):
    def work(progress):
        raise error

    bench = StatisticsWorker(Memo())
    found = value(bench, of("bad", work))
    assert isinstance(found, Failure)
    assert said in found.reason
    assert value(bench, of("good", lambda progress: 3)) == 3


def test_the_shelf_forgets_what_was_not_used_for_longest():
    shelf = Memo(max_values=2)
    shelf.put(("a",), 1)
    shelf.put(("b",), 2)
    assert shelf.get(("a",)) == 1
    shelf.put(("c",), 3)
    assert (shelf.get(("a",)), shelf.get(("b",)), shelf.get(("c",))) == (1, None, 3)
