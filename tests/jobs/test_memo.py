"""Test that a value is computed once for all threads, and that errors are not kept."""

from __future__ import annotations

from concurrent.futures import Future, ThreadPoolExecutor
from threading import Event

import pytest

from ccwsim import Cancelled, CCWSIMError
from ccwsim.jobs.memo import Memo
from ccwsim.jobs.workers import stoppable
from tests.waiting import wait_until

SLOW = 300


class Work:
    """Work that waits for permission to end; it counts its calls."""

    def __init__(self, error: Exception | None = None) -> None:
        self.error, self.go_on, self.n_calls = error, Event(), 0

    def __call__(self) -> int:
        self.n_calls += 1
        assert self.go_on.wait(SLOW)
        if self.error and self.n_calls == 1:
            raise self.error
        return 7


@pytest.fixture
def pool():
    with ThreadPoolExecutor(4) as pool:
        yield pool


def asked(pool, memo, work) -> list[Future[int]]:
    """Return the results for four threads, which all ask before the work may end."""
    waiting = [pool.submit(memo.value, "a", work) for _ in range(4)]
    wait_until(lambda: work.n_calls == 1, "the work")
    work.go_on.set()
    return waiting


def test_threads_that_need_a_value_compute_it_once(pool):
    memo, work = Memo[int](), Work()
    assert [future.result(SLOW) for future in asked(pool, memo, work)] == [7] * 4
    assert (work.n_calls, memo.get("a")) == (1, 7)


def test_an_error_is_not_kept(pool):
    memo, work = Memo[int](), Work(CCWSIMError("broken"))
    assert work.error in [future.exception(SLOW) for future in asked(pool, memo, work)]
    assert memo.value("a", work) == 7


def test_a_cancelled_thread_leaves_the_work_to_the_next_one(pool):
    memo, work = Memo[int](), Work(Cancelled("stopped"))
    errors = [future.exception(SLOW) for future in asked(pool, memo, work)]
    assert errors.count(None) == 3
    assert (work.n_calls, memo.get("a")) == (2, 7)


def test_a_thread_that_is_stopped_does_not_wait_for_others(pool):
    memo, work = Memo[int](), Work()
    first = pool.submit(memo.value, "a", work)
    wait_until(lambda: work.n_calls == 1, "the work")
    with stoppable(lambda: True), pytest.raises(Cancelled):
        memo.value("a", work)
    work.go_on.set()
    assert first.result(SLOW) == 7


def test_none_is_a_value_that_is_made_once():
    cache, made = Memo[None](), []
    for _ in range(3):
        assert cache.value("no trend", lambda: made.append(1)) is None
    assert made == [1]


def test_the_least_recent_value_is_dropped():
    cache = Memo[str](max_values=2)
    for key in "abc":
        cache.put(key, key.upper())
    assert (cache.get("a"), cache.get("c")) == (None, "C")
