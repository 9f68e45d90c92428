"""A child process that answers requests, and ends with the process that started it.

Requests and answers are pickles on the standard input and output of the child. The system
closes the child's input even if the parent is killed, and a child ends as soon as its input ends.
A `ProcessTemplate` forks such processes in milliseconds.
"""

import gc
import os
import pickle
import select
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import cached_property
from math import ceil
from multiprocessing import connection, reduction
from pathlib import Path
from queue import SimpleQueue
from typing import Any, BinaryIO
from weakref import WeakSet

from ccwsim.system.memory import address_space, proportional_memory

FOLDER = Path(__file__).parents[2]  # the folder that contains the package
END_SECONDS = 10.0  # seconds that a process has to end after its input was closed
CAN_FORK = hasattr(os, "pidfd_open") and hasattr(reduction, "send_handle")
"""Whether a `ProcessTemplate` can be used, as on Linux; macOS has no safe fork."""
BROKEN = (OSError, EOFError, pickle.UnpicklingError)
"""Errors of reading from and writing to a process that has ended."""


def can_start() -> bool:
    """Return whether this Python can start another Python."""
    return bool(sys.executable) and not getattr(sys, "frozen", False)


class ChildProcess:
    """A process of this Python that runs a function, which calls `connect_to_parent`."""

    def __init__(
        self,
        function: Callable[[], None],
        environment: Mapping[str, str] | None = None,
        stdin: Any = subprocess.PIPE,
    ) -> None:
        paths = [str(FOLDER), *filter(None, [os.environ.get("PYTHONPATH")])]
        module, name = function.__module__, function.__name__
        self._process: Any = subprocess.Popen(
            [sys.executable, "-c", f"from {module} import {name}; {name}()"],
            env={**os.environ, "PYTHONPATH": os.pathsep.join(paths), **(environment or {})},
            stdin=stdin,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )
        self._start(self._process.pid, self._process.stdin or stdin, self._process.stdout)

    def _start(self, pid: int, requests: Any, answers: Any) -> None:
        self.pid, self._requests, self.answers = pid, requests, answers
        _started.add(self)

    def send(self, request: object) -> None:
        """Send a request; raise `OSError` if the process has ended."""
        pickle.dump(request, self._requests, protocol=5)
        self._requests.flush()

    @cached_property
    def received(self) -> SimpleQueue[Any]:
        """Queue of the answers, which a thread reads; the last one is the error at the end."""
        messages = _received(self.answers, lambda error: messages.put(error))
        return messages

    def runs(self) -> bool:
        """Return whether the process has not ended."""
        return self._process.poll() is None

    def kill(self) -> None:
        """End the process at once; reading its answers then raises `EOFError`."""
        self._process.kill()

    def forget(self) -> None:
        """In a fork, drop the pipes without closing them; another thread may have been writing."""
        if self._process is not None:
            self._process.returncode = 0  # only the parent can wait for the process
        null = os.open(os.devnull, os.O_RDWR)
        for stream in (self._requests, self.answers):
            with suppress(OSError, ValueError):
                os.dup2(null, stream.fileno())
        os.close(null)

    def end(self) -> int:
        """Close the input, wait `END_SECONDS`, then kill the process; return its exit code."""
        with self._process:
            with suppress(OSError):
                self._requests.close()
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(END_SECONDS)
            self._process.kill()
        return self._process.returncode


class ForkedProcess(ChildProcess):
    """A process that a template has forked; only the template could wait for its exit."""

    def __init__(self, pid: int, pipe: socket.socket) -> None:
        self._process = None
        # the handle identifies this process even if its number is used again
        self._handle = os.fdopen(os.pidfd_open(pid), "rb", 0)
        self._start(pid, pipe.makefile("wb"), pipe.makefile("rb"))
        pipe.close()

    def runs(self) -> bool:
        """Return whether the process has not ended."""
        return not self._handle.closed and not select.select([self._handle], [], [], 0)[0]

    def kill(self) -> None:
        """End the process at once; reading its answers then raises `EOFError`."""
        with suppress(ProcessLookupError):
            signal.pidfd_send_signal(self._handle.fileno(), signal.SIGKILL)

    def end(self) -> int:
        """Kill the process, which is idle or broken, and wait; its exit code is not known."""
        if self.runs():
            self.kill()
            select.select([self._handle], [], [], END_SECONDS)
        with suppress(OSError):
            self._requests.close()
        self._handle.close()
        return 0


class ProcessTemplate:
    """A process with one thread, which forks processes that share its loaded code.

    It runs a function, which calls `fork_on_request`.
    """

    def __init__(
        self, function: Callable[[], None], environment: Mapping[str, str] | None = None
    ) -> None:
        self._door, theirs = connection.Pipe()
        self._process = ChildProcess(function, environment, theirs)
        self._process._requests = self._door
        theirs.close()

    def runs(self) -> bool:
        """Return whether the template has not ended."""
        return self._process.runs()

    def fork(self, request: object) -> ForkedProcess:
        """Return a fork for a request; called by one thread at a time."""
        ours, theirs = socket.socketpair()
        with theirs:
            self._door.send(request)
            reduction.send_handle(self._door, theirs.fileno(), self._process.pid)
            return ForkedProcess(self._door.recv(), ours)


def fork_on_request(load: Callable[[Any], None], function: Callable[[], None]) -> None:
    """Call load(request) for each request of the parent process, then run `function` in a fork."""
    door, pid = connection.Connection(os.dup(0)), 1
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # the system removes forks that have ended
    while pid:
        request = door.recv()
        pipe = reduction.recv_handle(door)
        with suppress(Exception):  # the same error occurs in the fork, which reports it
            load(request)
        gc.freeze()  # forks share the pages of these objects
        if pid := os.fork():
            os.close(pipe)
            door.send(pid)
    door.close()
    os.dup2(pipe, 0)
    os.dup2(pipe, 1)
    os.close(pipe)
    function()


class WarmProcesses:
    """Processes that wait for requests, at most `n`; each serves one thread at a time."""

    def __init__(self, n: int) -> None:
        self._n = n
        self.idle: list[ChildProcess] = []
        _started.add(self)

    @contextmanager
    def process(self, start: Callable[[], ChildProcess]) -> Iterator[ChildProcess]:
        """Yield a process, which ends and is replaced if an error is raised in the context."""
        process = self._idle() or start()
        try:
            yield process
        except BaseException:
            process.kill()  # its further answers would belong to no request
            process.end()
            process = start()
            raise
        finally:
            if len(self.idle) < self._n:
                self.idle.append(process)
            else:
                process.end()

    def _idle(self) -> ChildProcess | None:
        """Return a waiting process that still runs; the system may have ended some processes."""
        with suppress(IndexError):
            while not (process := self.idle.pop()).runs():
                process.end()
            return process
        return None

    def forget(self) -> None:
        """In a fork, forget the processes."""
        self.idle.clear()


_started: WeakSet[Any] = WeakSet()


def memory_of_children() -> int:
    """Return the bytes of memory that all child processes use."""
    processes = [process for process in list(_started) if isinstance(process, ChildProcess)]
    return sum(proportional_memory(process.pid) for process in processes if process.runs())


def _forget_all() -> None:
    """In a fork, forget every child, also those with which other threads communicated."""
    for process in list(_started):
        process.forget()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget_all)


def connect_to_parent(niceness: int = 5) -> tuple[SimpleQueue[Any], BinaryIO]:
    """Return the queue of requests, read by a thread that can end the child, and the answers."""
    with suppress(AttributeError, OSError):  # Windows, or a service without this right
        os.nice(niceness)  # the dashboard and its browser have priority
    answers = os.fdopen(os.dup(1), "wb", 0)
    os.dup2(2, 1)  # output of libraries is not sent to the parent
    return _received(sys.stdin.buffer, lambda error: os._exit(0)), answers


def send_answer(answers: BinaryIO, answer: object) -> None:
    """Send an answer of any size to the parent process."""
    with os.fdopen(os.dup(answers.fileno()), "wb") as stream:
        pickle.dump(answer, stream, protocol=5)


def _received(stream: BinaryIO, at_end: Callable[[Exception], None]) -> SimpleQueue[Any]:
    """Return a queue of messages, which a thread reads; `at_end` gets the error at the end."""
    messages: SimpleQueue[Any] = SimpleQueue()

    def read() -> None:
        try:
            while True:
                messages.put(pickle.load(stream))
        except Exception as error:
            at_end(error)

    threading.Thread(target=read, daemon=True).start()
    return messages


def bound(memory: int | None = None, seconds: float | None = None) -> None:
    """Limit the further memory and processor time of this process, if the system can.

    None removes a limit.
    """
    try:
        import resource
    except ImportError:  # Windows: only the wall time is limited
        return
    size = seconds_used = resource.RLIM_INFINITY
    if seconds is not None:
        used = resource.getrusage(resource.RUSAGE_SELF)
        seconds_used = ceil(used.ru_utime + used.ru_stime + seconds)
    if memory is not None and (now := address_space()) is not None:
        size = now + memory
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    for limit, soft in ((resource.RLIMIT_AS, size), (resource.RLIMIT_CPU, seconds_used)):
        hard = resource.getrlimit(limit)[1]
        with suppress(ValueError, OSError):  # the administrator has set a lower limit
            resource.setrlimit(limit, (soft, hard))
