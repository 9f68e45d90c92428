"""A child process that answers requests, and ends with the process that started it.

Requests and answers are pickles on the standard input and output of the child. The system
closes the child's input even if the parent is killed, and a child ends as soon as its input ends.
"""

import os
import pickle
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from queue import SimpleQueue
from typing import Any, BinaryIO
from weakref import WeakSet

FOLDER = Path(__file__).parents[2]  # the folder that contains the package
END_SECONDS = 10.0  # seconds that a process has to end after its input was closed


def can_start() -> bool:
    """Return whether this Python can start another Python."""
    return bool(sys.executable) and not getattr(sys, "frozen", False)


class ChildProcess:
    """A process of this Python that runs a function, which calls `connect_to_parent`."""

    def __init__(
        self, function: Callable[[], None], environment: Mapping[str, str] | None = None
    ) -> None:
        paths = [str(FOLDER), *filter(None, [os.environ.get("PYTHONPATH")])]
        module, name = function.__module__, function.__name__
        self._process = subprocess.Popen(
            [sys.executable, "-c", f"from {module} import {name}; {name}()"],
            env={**os.environ, "PYTHONPATH": os.pathsep.join(paths), **(environment or {})},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self.pid = self._process.pid
        self._requests, self.answers = self._process.stdin, self._process.stdout
        _started.add(self)

    def send(self, request: object) -> None:
        """Send a request; raise `OSError` if the process has ended."""
        pickle.dump(request, self._requests, protocol=5)
        self._requests.flush()

    def runs(self) -> bool:
        """Return whether the process has not ended."""
        return self._process.poll() is None

    def kill(self) -> None:
        """End the process at once; reading its answers then raises `EOFError`."""
        self._process.kill()

    def forget(self) -> None:
        """In a fork, drop the pipes without closing: another thread may have been writing."""
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


_started: WeakSet[ChildProcess] = WeakSet()


def _forget_all() -> None:
    """In a fork, forget every child, also those that other threads were talking to."""
    for process in list(_started):
        process.forget()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget_all)


def connect_to_parent() -> tuple[SimpleQueue[Any], BinaryIO]:
    """Return the queue of requests, read by a thread that can end the child, and the answers."""
    if hasattr(os, "nice"):
        os.nice(5)  # the dashboard and its browser have priority
    answers = os.fdopen(os.dup(1), "wb", 0)
    os.dup2(2, 1)  # output of libraries is not sent to the parent
    requests: SimpleQueue[Any] = SimpleQueue()
    threading.Thread(target=_read, args=(sys.stdin.buffer, requests), daemon=True).start()
    return requests, answers


def _read(stream: BinaryIO, requests: SimpleQueue[Any]) -> None:
    """Read requests until the end of the stream, then end this process."""
    with suppress(EOFError, OSError, pickle.UnpicklingError):
        while True:
            requests.put(pickle.load(stream))
    os._exit(0)
