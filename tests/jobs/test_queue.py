"""Test the queue of a server: fair to all sessions, never blocked for ever, finally empty."""

from __future__ import annotations

import gc
import random
import weakref
from math import inf
from threading import Event

import pytest

from ccwsim import Cancelled
from ccwsim.jobs import job as jobs
from ccwsim.jobs.job import MAX_COUNTED_SECONDS, Job, Queue
from ccwsim.jobs.scheduler import Lease, Usage
from ccwsim.system.memory import give_back_memory
from ccwsim.ui.session.progress import delay_text
from ccwsim.ui.session.server import GRACE, SessionMonitor

SLOW = 60


class Waiting(Lease):
    """A job in the queue; functions are called when it begins, is stopped or is abandoned."""

    def __init__(self, usage: Usage, answer, abandon=lambda: None) -> None:
        super().__init__(usage)
        self.answer, self.abandon = answer, abandon


class Clock:
    """A clock that stands still until a test moves it."""

    now = 0.0

    def __call__(self) -> float:
        return self.now


class Log:
    """A queue with `n_places` active jobs, and the order in which its jobs begin."""

    def __init__(self, n_places: int) -> None:
        self.clock = Clock()
        self.queue = Queue(n_places, self.clock)
        self.begun: list[str] = []
        self.places: dict[str, Waiting] = {}

    def enter(self, *names: str) -> None:
        """Add jobs to the queue; the first letter of a name is the session of the job."""
        for name in names:
            usage = self.queue.usage_of(name[0])
            place = Waiting(usage, lambda name=name: self.begun.append(name))
            self.places[name] = place
            self.queue.request(place)

    def leave(self, *names: str) -> None:
        for name in names:
            self.queue.release(self.places[name])

    def is_active(self, name: str) -> bool:
        return self.places[name] in self.queue._active

    def let_the_next_begin(self) -> None:
        """Let time pass until the active jobs do not count any more."""
        self.clock.now += MAX_COUNTED_SECONDS + 0.1
        self.queue.look()

    def position(self, name: str) -> int:
        return self.queue.position(self.places[name])


def test_where_there_is_room_a_job_begins_at_once():
    log = Log(2)
    log.enter("a1", "b1")
    assert log.begun == ["a1", "b1"]
    assert log.position("a1") == log.position("b1") == 0


def test_a_session_with_fewer_active_jobs_goes_first_then_who_came_first():
    log = Log(2)
    log.enter("a1", "a2", "a3", "a4", "b1", "c1", "b2")
    assert [log.position(name) for name in ("b1", "c1", "b2", "a3", "a4")] == [1, 2, 3, 4, 5]
    log.leave("a1", "a2")
    assert log.begun == ["a1", "a2", "b1", "c1"]  # no session has active jobs; c is new
    log.leave("c1")
    assert log.begun[-1] == "a3"  # b has one active job
    log.leave("b1", "a3")
    assert log.begun[-2:] == ["b2", "a4"]
    assert not log.queue._waiting


def test_the_positions_are_the_order_in_which_jobs_begin():
    log = Log(1)
    log.enter("a1", "a2", "a3", "b1", "b2", "c1")
    said = {name: log.position(name) for name in log.places}
    while log.queue.n_active:
        log.leave(log.begun[-1])
    assert log.begun == ["a1", "b1", "c1", "a2", "b2", "a3"]
    assert sorted(said, key=said.__getitem__) == log.begun


@pytest.mark.parametrize("seed", range(20))
def test_positions_are_the_order_of_any_jobs_of_which_none_ends(seed):
    log, rng = Log(1), random.Random(seed)
    for k in range(rng.randint(5, 20)):
        log.enter(f"{rng.choice('abcd')}{k}")
        if rng.random() < 0.3:
            log.leave(rng.choice([name for name in log.begun if log.is_active(name)]))
        if rng.random() < 0.3:
            log.let_the_next_begin()
    waiting = [name for name in log.places if log.position(name)]
    expected = sorted(waiting, key=log.position)
    n_begun = len(log.begun)
    for _ in expected:
        log.let_the_next_begin()
    assert log.begun[n_begun:] == expected


def test_a_long_job_does_not_count_where_others_wait():
    log = Log(1)
    log.enter("a1", "b1", "c1")
    assert log.begun == ["a1"]
    log.clock.now = MAX_COUNTED_SECONDS + 0.1
    log.queue.look()
    assert log.begun == ["a1", "b1"]  # c1 waits, because b1 still counts as a short job
    assert log.position("c1") == 1
    log.leave("b1")
    assert log.begun[-1] == "c1"


def test_who_waits_can_be_stopped_and_who_has_begun_goes_on():
    log = Log(1)
    log.enter("a1", "b1", "c1")
    stopped = log.places["b1"]
    for name in ("a1", "b1"):
        log.places[name].stop.set()
        log.queue.look()
    assert log.begun == ["a1", "b1"]
    assert stopped.since == inf
    assert log.queue.jobs() == [log.places["a1"], log.places["c1"]]
    log.leave("a1")
    assert log.begun == ["a1", "b1", "c1"]


@pytest.fixture
def one_at_a_time(monkeypatch) -> Queue:
    """Yield a server with one active job, which waits for an event until the end of the test."""
    queue = Queue(1, Clock())
    monkeypatch.setattr(jobs, "server_queue", lambda: queue)
    return queue


def test_a_job_waits_says_so_and_can_be_stopped(one_at_a_time):
    go = Event()
    first = Job(lambda job: go.wait(SLOW))
    second, third = (Job(lambda job: "done") for _ in range(2))
    assert (first.position, second.position, third.position) == (0, 1, 2)
    assert delay_text(third) == "Waiting: 2nd in the queue"
    assert third.seconds == 0
    second.cancel()
    assert second.finished
    assert isinstance(second.error, Cancelled)
    assert delay_text(third) == "Waiting: 1st in the queue"
    go.set()
    assert third.wait(SLOW)
    assert third.result == "done"
    assert first.wait(SLOW)
    assert one_at_a_time.n_active == 0


@pytest.mark.parametrize("error", [MemoryError(), ValueError("no"), Cancelled("stopped")])
def test_whatever_a_job_raises_its_place_is_given_back(one_at_a_time, error):
    def work(job):
        raise error

    job, after = Job(work), Job(lambda job: "done")
    assert job.wait(SLOW)
    assert job.error is error
    assert after.wait(SLOW)
    assert after.result == "done"


def test_a_thread_that_cannot_start_is_an_error_of_its_job(one_at_a_time, monkeypatch):
    def no_thread(*_, **__):
        raise RuntimeError("can't start new thread")

    with monkeypatch.context() as patch:
        patch.setattr(jobs, "Thread", no_thread)
        job = Job(lambda job: "done")
    assert job.finished
    assert "thread" in str(job.error)
    after = Job(lambda job: "done")
    assert after.wait(SLOW)


class Big:
    """An object that stands for a large amount of memory."""


def test_an_error_keeps_nothing_of_what_its_work_held(one_at_a_time):
    held = []

    def work(job):
        big = Big()
        held.append(weakref.ref(big))
        raise MemoryError("too much")

    job = Job(work)
    assert job.wait(SLOW)
    gc.collect()
    assert held[0]() is None
    assert job.error.__traceback__ is not None


class Room:
    """A server with two sessions, which may close."""

    def __init__(self) -> None:
        self.clock, self.queue = Clock(), Queue(1, Clock())
        self.open: set[str] = {"a", "b"}
        self.forgotten: list[str] = []
        self.dropped: list[str] = []
        self.attendance = SessionMonitor(
            self.queue, self.open.__contains__, self.forgotten.append, self.clock
        )
        self.attendance._thread = object()  # the test checks the sessions itself
        for session in "ab":
            self.attendance.note(session)

    def enter(self, name: str) -> None:
        def abandon() -> None:
            self.dropped.append(name)

        self.queue.request(Waiting(self.queue.usage_of(name[0]), lambda: None, abandon))

    def look(self, now: float) -> None:
        self.clock.now = now
        self.attendance.look()


def test_the_jobs_of_a_closed_tab_end_after_a_grace_and_those_of_others_go_on():
    room = Room()
    for name in ("a1", "a2", "b1"):
        room.enter(name)
    room.open.remove("a")
    room.look(0)
    room.look(GRACE - 1)
    assert room.dropped == []
    room.look(GRACE)
    assert room.dropped == ["a1", "a2"]
    assert room.forgotten == []
    room.look(120)
    assert room.forgotten == ["a"]


def test_a_tab_that_comes_back_keeps_its_jobs():
    room = Room()
    room.enter("a1")
    room.open.remove("a")
    room.look(0)
    room.open.add("a")
    room.look(GRACE - 1)
    room.open.remove("a")
    room.look(GRACE + 1)
    assert room.dropped == []


def test_memory_is_given_back_once_and_what_all_shared_goes_with_the_last(monkeypatch):
    given, cleared = [], []
    monkeypatch.setattr("ccwsim.ui.session.server.give_back_memory", lambda: given.append(True))
    monkeypatch.setattr("streamlit.cache_data.clear", lambda: cleared.append("data"))
    monkeypatch.setattr("streamlit.cache_resource.clear", lambda: cleared.append("resource"))
    monkeypatch.setattr("ccwsim.ui.session.server.forget_results", lambda: cleared.append("files"))
    room = Room()
    room.attendance.give_back()
    assert not given
    for session, expected in (("a", []), ("b", ["data", "resource", "files"])):
        room.open.remove(session)
        room.look(room.clock.now)
        room.look(room.clock.now + 120)
        room.attendance.give_back()
        room.attendance.give_back()
        assert cleared == expected
    assert len(given) == 2


def test_giving_memory_back_harms_nothing():
    give_back_memory()


def test_a_abandoned_job_keeps_nothing():
    begun, held = Event(), []

    def work(job):
        big = Big()
        held.append(weakref.ref(big))
        job.publish_partial(big)
        begun.set()
        while not job.is_cancelled():
            Event().wait(0.001)
        return big

    job: Job = Job(work)
    assert begun.wait(SLOW)
    assert job.partial is not None
    job.abandon()
    assert job.wait(SLOW)
    gc.collect()
    assert job.result is None
    assert job.partial is None
    assert held[0]() is None
    assert "closed" in str(job.error)
