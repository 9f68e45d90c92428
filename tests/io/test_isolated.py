"""Test that another process reads uploads, and that a file that crashes this process is refused."""

from __future__ import annotations

import io
import multiprocessing
import os
import signal
import threading
import time
from dataclasses import replace

import numpy as np
import pytest

from ccwsim import CCWSIMError
from ccwsim.io import inspect, isolated, read_training_image
from ccwsim.io.data_file import broken as broken_file
from ccwsim.io.isolated import IsolatedFile
from ccwsim.io.limits import MIB, UPLOAD_LIMITS, TooManyCells
from ccwsim.io.opening import open_file

CSV = b"x,y,facies\n1,2,0\n3,4,1\n"
SMALL = replace(UPLOAD_LIMITS, memory=200 * MIB, seconds=3.0)


def isolated_file(content: bytes = CSV, name: str = "a.csv", limits=SMALL) -> IsolatedFile:
    return IsolatedFile(content, name, f"{name} {os.urandom(4).hex()}", limits)


def endless(file):
    while True:
        sum(range(1000))


def large(file):
    return len(np.ones(400 * MIB, np.uint8))


def falls(file):
    os._exit(7)


def broken(file):
    raise KeyError("a fault of the program")


def n_calls(file):
    with open(file.read().decode(), "a") as log:
        log.write("x")
    time.sleep(0.3)
    return "read"


def refuses(file):
    n_calls(file)
    raise CCWSIMError("the file is refused")


def too_large(file):
    try:
        open_file(file)
    except TooManyCells as error:
        return error.grid()
    return None


def test_a_file_is_read_as_in_this_process():
    buffer = io.BytesIO()
    np.save(buffer, np.arange(12).reshape(3, 4) % 3)
    apart = isolated_file(buffer.getvalue(), "ti.npy")
    assert np.array_equal(read_training_image(apart).array, read_training_image(buffer).array)
    few = isolated_file(buffer.getvalue(), "ti.npy", replace(UPLOAD_LIMITS, cells=6))
    assert too_large(apart) is None
    assert too_large(few) == ((3, 4), 1.0)
    assert inspect(isolated_file()) == replace(inspect(io.BytesIO(CSV)), name="a.csv")


def test_an_error_of_a_reader_is_the_same_error():
    with pytest.raises(CCWSIMError, match=r"a\.bin has an unknown format"):
        open_file(isolated_file(b"%PDF\x00\x01", "a.bin"))
    with pytest.raises(CCWSIMError, match="more than 3"):
        open_file(isolated_file(limits=replace(SMALL, cells=3)))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("reader", "said"),
    [
        (endless, "takes longer than .* s to read"),
        (large, "needs more than 200 MB"),
        (falls, "ends the process that reads it"),
    ],
)
def test_a_file_that_its_reader_does_not_survive_is_refused(reader, said):
    with pytest.raises(CCWSIMError, match=f"^a.csv .*{said}.* cut"):
        isolated_file().read_with(reader)
    assert inspect(isolated_file()).is_table  # a new process reads the next file


@pytest.mark.slow
def test_a_file_that_a_busy_server_could_not_read_is_not_refused_for_ever(tmp_path, monkeypatch):
    file = isolated_file(str(tmp_path / "log").encode())
    with monkeypatch.context() as busy:
        busy.setattr(isolated, "WALL_FACTOR", 0)
        with pytest.raises(CCWSIMError, match=r"longer than 0 s to read on this busy server"):
            file.read_with(n_calls)
    assert file.read_with(n_calls) == "read"


def test_a_fault_of_the_program_is_told_as_one():
    with pytest.raises(RuntimeError, match="KeyError: 'a fault of the program'"):
        isolated_file().read_with(broken)


@pytest.mark.parametrize("reader", [n_calls, refuses])
def test_a_file_is_read_once_by_all_who_ask(reader, tmp_path):
    file = isolated_file(str(tmp_path / "log").encode())
    seen = []

    def ask():
        try:
            seen.append(file.read_with(reader))
        except CCWSIMError as error:
            seen.append(str(error))

    threads = [threading.Thread(target=ask) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    ask()
    assert len(seen) == 5
    assert len(set(seen)) == 1
    assert (tmp_path / "log").read_text() == "x"


@pytest.mark.slow
def test_other_files_are_read_while_one_takes_long():
    def read_long():
        with pytest.raises(CCWSIMError, match="takes longer"):
            isolated_file().read_with(endless)

    long = threading.Thread(target=read_long)
    long.start()
    assert inspect(isolated_file()).is_table
    assert long.is_alive()
    long.join()


def test_processes_are_kept_warm_and_used_again():
    isolated_file().read_with(os_pid)
    first = isolated_file().read_with(os_pid)
    assert isolated_file().read_with(os_pid) == first != os.getpid()


def os_pid(file):
    return os.getpid()


def test_a_process_that_ended_while_it_waited_is_replaced():
    pid = isolated_file().read_with(os_pid)
    os.kill(pid, signal.SIGKILL)
    os.waitid(os.P_PID, pid, os.WEXITED | os.WNOWAIT)
    assert inspect(isolated_file()).is_table


@pytest.mark.skipif(not hasattr(os, "fork"), reason="the system has no fork")
@pytest.mark.filterwarnings("ignore:.*multi-threaded.*:DeprecationWarning")
def test_a_fork_reads_with_processes_of_its_own():
    kept = isolated_file()
    first = kept.read_with(os_pid)
    isolated._answers()._lock.acquire()  # as if another thread held it
    try:
        forked = multiprocessing.get_context("fork").Pool(1)
        with forked:
            theirs = forked.apply_async(kept.read_with, (os_pid,)).get(60)
            again = forked.apply_async(isolated_file().read_with, (os_pid,)).get(60)
    finally:
        isolated._answers()._lock.release()
    assert theirs == again != first
    assert isolated_file().read_with(os_pid) == first


def test_a_lack_of_memory_is_told_as_one():
    def lacks(file):
        with broken_file("the file is broken"):
            raise MemoryError

    file = isolated_file()
    request = isolated._Request(lacks, (), file.content, file.name, file.limits)
    assert "needs more than 200 MB" in str(isolated._answer(request))


def test_without_another_process_files_are_read_here(monkeypatch):
    monkeypatch.setattr(isolated, "can_start", lambda: False)
    assert isolated_file().read_with(os_pid) == os.getpid()
    assert inspect(isolated_file()).is_table


class FailsToArrive:
    """An answer that the parent process cannot load."""

    def __init__(self, error: type[Exception]) -> None:
        self.error = error

    def __reduce__(self):
        return _fail, (self.error,)


def _fail(error: type[Exception]) -> None:
    raise error("the answer does not arrive")


def without_memory(file):
    return FailsToArrive(MemoryError)


def with_fault(file):
    return FailsToArrive(KeyError)


def test_a_process_whose_answer_does_not_arrive_is_not_used_again():
    for reader, error, words in (
        (without_memory, CCWSIMError, "needs more than 200 MB"),
        (with_fault, KeyError, "does not arrive"),
    ):
        assert isolated_file(CSV * 2).read_with(n_bytes) == 2 * len(CSV)
        latest = isolated._warm.idle[-1].pid
        with pytest.raises(error, match=words):
            isolated_file().read_with(reader)
        assert latest not in {process.pid for process in isolated._warm.idle}


def n_bytes(file):
    return len(file.read())
