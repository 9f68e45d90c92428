"""Read untrusted files in separate processes, with bounded memory and time.

A decoder that reads hostile bytes can hold the interpreter lock for minutes, fill the memory or
end its process. Such a decoder runs in a child process, which is killed and replaced. Results and
errors are cached by file content, so that the same content is read only once.
"""

import os
import pickle
import signal
import threading
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache, partial
from io import BytesIO
from typing import Any, NamedTuple, TypeVar

from ccwsim import CCWSIMError
from ccwsim.io.data_file import printable
from ccwsim.io.limits import MIB, FileLimits, limited
from ccwsim.jobs.child import (
    ChildProcess,
    WarmProcesses,
    bound,
    can_start,
    connect_to_parent,
    send_answer,
)
from ccwsim.jobs.memo import Memo
from ccwsim.jobs.scheduler import PAGE_TURNS
from ccwsim.system.memory import free_memory, give_back_memory

Result = TypeVar("Result")

MAX_READERS = 8  # maximum number of files that are read at the same time
N_WARM = 2  # number of processes that are kept for the next files
WALL_FACTOR = 6  # limits of wall time / processor time; above 1 because a process may wait
LOST = (OSError, EOFError, pickle.UnpicklingError, MemoryError)
"""Errors of a parent that does not receive the answer, or has no memory for it."""
MAX_RESULTS, MAX_RESULTS_BYTES = 256, 256 * MIB
"""Maximum number of cached results, and maximum total size of these results in bytes."""


class IsolatedFile:
    """A file that the readers of this package read in a separate process, within `limits`."""

    def __init__(self, content: bytes, name: str, digest: str, limits: FileLimits) -> None:
        self.content, self.name, self.digest, self.limits = content, name, digest, limits

    def read_with(self, reader: Callable[..., Result], *options: Any) -> Result:
        """Return `reader(file, *options)` from another process, or raise its `CCWSIMError`."""
        request = _Request(reader, options, self.content, self.name, self.limits)
        key = reader.__module__, reader.__qualname__, repr(options), self.digest, self.limits
        result = _answers().value(key, partial(_read_apart, request))
        if isinstance(result, Exception):
            raise type(result)(*result.args)
        return result


class _Request(NamedTuple):
    reader: Callable[..., Any]
    options: tuple[Any, ...]
    content: bytes
    name: str
    limits: FileLimits


@cache
def _answers() -> Memo[Any]:
    """Return the results and errors of requests."""
    return Memo(MAX_RESULTS, MAX_RESULTS_BYTES)


def forget_results() -> None:
    """Remove all cached results of files."""
    _answers.cache_clear()


@cache
def _places(memory: int) -> threading.Semaphore:
    """Return a semaphore for as many processes as fit into half of the free memory, at least 2."""
    n = (free_memory() or 2 * memory * MAX_READERS) // (2 * memory)
    return threading.Semaphore(min(max(n, 2), MAX_READERS))


_warm = WarmProcesses(N_WARM)


def _forget_processes() -> None:
    """In a fork of this process, forget its results and locks."""
    _answers.cache_clear()
    _places.cache_clear()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget_processes)


def _read_apart(request: _Request) -> Any:
    """Return the result of a request, or an exception, from a child process."""
    if not can_start():
        return _answer(request)
    limits = request.limits
    with PAGE_TURNS.paused(), _places(limits.memory):
        wall_seconds = WALL_FACTOR * limits.seconds
        start, process = time.monotonic(), None
        try:
            with _warm.process(_start_process) as process, _killed_after(process, wall_seconds):
                process.send(request)
                return pickle.load(process.answers)
        except LOST:
            if process is None:  # the system could not start a process
                raise
            if time.monotonic() - start >= wall_seconds:  # not kept: the file may be innocent
                raise CCWSIMError(
                    f"{printable(request.name)} takes longer than {wall_seconds:g} s to read on "
                    "this busy server; try again later, or cut a smaller piece"
                ) from None
            return _refusal(request, process.end())


@contextmanager
def _killed_after(process: ChildProcess, seconds: float) -> Iterator[None]:
    """Kill a process unless the context ends within some seconds."""
    alarm = threading.Timer(seconds, process.kill)
    alarm.daemon = True
    alarm.start()
    try:
        yield
    finally:
        alarm.cancel()


def _start_process() -> ChildProcess:
    return ChildProcess(serve_readers, {"OPENBLAS_NUM_THREADS": "1"})


def _refusal(request: _Request, code: int = 0) -> CCWSIMError:
    """Return the error for a request during which the process ended with this exit code."""
    name, limits = printable(request.name), request.limits
    if -code == getattr(signal, "SIGXCPU", None):
        problem = f"takes longer than {limits.seconds:g} s to read"
    else:
        problem = f"ends the process that reads it, or needs more than {limits.memory // MIB} MB"
    return CCWSIMError(f"{name} {problem}; cut a smaller piece, or save it as npy or CSV")


def serve_readers() -> None:
    """Answer the requests of the parent process until it ends."""
    requests, answers = connect_to_parent()
    while True:
        request = requests.get()
        bound(request.limits.memory, request.limits.seconds)
        answer = _answer(request)
        bound()
        send_answer(answers, answer)
        del request, answer
        give_back_memory()


def _answer(request: _Request) -> Any:
    """Return the result of a request, or the exception that the reader raises."""
    file = BytesIO(request.content)
    file.name = request.name
    try:
        with limited(request.limits):
            return request.reader(file, *request.options)
    except CCWSIMError as error:
        return error
    except MemoryError:
        return _refusal(request)
    except Exception:
        return RuntimeError(traceback.format_exc())
