"""Kernels are compiled by other processes, side by side, and read from disk by this one.

The compiler holds the interpreter lock: a server that compiled in a thread would send no page
meanwhile. A call of a kernel that is not on disk waits for these processes; `ask_for` asks for all
kernels of a computation at once. If no process can be started, or nothing can be written, the
call compiles in this process.
"""

from __future__ import annotations

import gc
import heapq
import multiprocessing
import os
import pickle
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from importlib import import_module
from pathlib import Path
from queue import SimpleQueue
from typing import Any, BinaryIO, NamedTuple

from numba import config
from numba.core import event

from ccwsim.engine import numba_hooks
from ccwsim.engine.kernel_cache import (
    FOLDER,
    FOLDER_VARIABLE,
    NAME,
    PACKAGE,
    note_use,
    remove_unused,
)
from ccwsim.system.machine import n_cores

MAX_PROCESSES = 3
"""More would finish no earlier: the largest kernel takes a third of the time by itself."""
IDLE_SECONDS = 5.0
"""A process ends if it has had nothing to compile for so long."""
POLL_SECONDS = 0.1
NOW, SOON, LATER = 0, 1, 2
"""Whether a call waits for a kernel, will need it, or may need it."""
ENTRY_KERNELS = {"simulate_patches", "resimulate_windows", "repair_windows", "change_cells"}
"""The kernels of a realization that take long to compile."""
OPTIMIZING = 0.5
"""The time to optimize a kernel, as a share of the time to type its functions."""


Kernel = Any
"""A `Kernel` of `kernels`, which imports this file."""
_walk: ContextVar[Callable[[Kernel, tuple[Any, ...]], None] | None] = ContextVar(
    "walk", default=None
)


class MissingKernelError(Exception):
    """Ends the call of a kernel that a walk found missing."""


@contextmanager
def walk(on_missing: Callable[[Kernel, tuple[Any, ...]], None]) -> Iterator[None]:
    """Only find out which kernels a computation needs: `on_missing(kernel, signature)` gets them.

    A missing kernel is not run but counts nothing and leaves its arrays as they are; one that makes
    arrays runs in plain Python. So a walk over small arrays takes no time.
    """
    token = _walk.set(on_missing)
    try:
        yield
    finally:
        _walk.reset(token)


def is_walking() -> bool:
    """Return whether this is a walk."""
    return _walk.get() is not None


def compile_missing(kernel: Kernel, signature: tuple[Any, ...]) -> None:
    """Let another process compile a kernel that a call needs, if it can, and wait.

    Raises
    ------
    MissingKernelError
        In a walk, which only notes the kernel.
    """
    if on_missing := _walk.get():
        on_missing(kernel, signature)
        raise MissingKernelError
    if kernel.__module__.startswith("ccwsim.") and _can_compile_apart():
        compilers = _of_this_process()
        compilers.await_all([compilers.ask(kernel, signature, NOW)], lambda: None)


class CompilationProgress(NamedTuple):
    """How far the compilation is that calls wait for."""

    n_done: int
    n: int
    seconds_left: float | None


class CompileRequest:
    """A kernel to be compiled for the types of some arguments."""

    def __init__(self, kernel: Kernel, signature: tuple[Any, ...], urgency: int) -> None:
        self.kernel, self.signature, self.urgency = kernel, signature, urgency
        self.n_functions, self.n_typed = kernel.n_functions, 0
        self.is_taken, self.ended = False, threading.Event()

    @property
    def share(self) -> float:
        """How much of the work is done, 0 … 1."""
        if self.ended.is_set():
            return 1.0
        return min(self.n_typed / self.n_functions, 1.0) / (1 + OPTIMIZING)


class _Compilers:
    """The processes that compile for this one, each with a thread that gives it work."""

    def __init__(self) -> None:
        self.pid = os.getpid()
        self.awaited: list[CompileRequest] = []
        self.since = 0.0
        self._changed = threading.Condition()
        self._requests: dict[tuple[str, tuple[Any, ...]], CompileRequest] = {}
        self._queue: list[tuple[int, int, int, CompileRequest]] = []
        self._n_asked = self._n_running = self._n_idle = 0

    def ask(self, kernel: Kernel, signature: tuple[Any, ...], urgency: int) -> CompileRequest:
        """Return the request for a kernel, which a process takes before less urgent ones."""
        with self._changed:
            key = f"{kernel.__module__}.{kernel.__name__}", signature
            request = self._requests.get(key)
            if request is None or request.ended.is_set():
                request = self._requests[key] = CompileRequest(kernel, signature, LATER + 1)
            if urgency < request.urgency and not request.is_taken:
                request.urgency, self._n_asked = urgency, self._n_asked + 1
                heapq.heappush(self._queue, (urgency, -request.n_functions, self._n_asked, request))
                more = len(self._queue) > self._n_idle
                if more and self._n_running < min(n_cores(), MAX_PROCESSES):
                    self._start()
                self._changed.notify()
            return request

    def await_all(self, requests: list[CompileRequest], check: Callable[[], None]) -> None:
        """Wait until all requests have ended; `check` is called now and then and may raise."""
        with self._changed:
            if all(request.ended.is_set() for request in self.awaited):
                self.awaited, self.since = [], time.monotonic()
            self.awaited += [request for request in requests if request not in self.awaited]
        for request in requests:
            while not request.ended.wait(POLL_SECONDS):
                check()

    def _start(self) -> None:
        try:
            threading.Thread(target=self._serve, daemon=True).start()
            self._n_running += 1
        except RuntimeError:  # the system gives no more threads
            self._give_up()

    def _serve(self) -> None:
        """Give requests to one process until none is left, or the process ends."""
        process = None
        try:
            process = _start_process()
            while request := self._next():
                try:
                    _let_compile(process, request)
                finally:
                    request.ended.set()
        except Exception:  # no process, one that has ended, or a type that cannot be sent
            with self._changed:
                self._n_running -= 1
                if not self._n_running:
                    self._give_up()
        finally:
            if process is not None:
                _end(process)

    def _next(self) -> CompileRequest | None:
        """Return the most urgent request, of these the largest; None if none comes for a while."""
        with self._changed:
            while True:
                while self._queue:
                    request = heapq.heappop(self._queue)[-1]
                    if not request.is_taken:
                        request.is_taken = True
                        return request
                self._n_idle += 1
                self._changed.wait(IDLE_SECONDS)
                self._n_idle -= 1
                if not self._queue:
                    self._n_running -= 1
                    return None

    def _give_up(self) -> None:
        """Let calls compile in this process, as no other one is there."""
        while self._queue:
            heapq.heappop(self._queue)[-1].ended.set()


_compilers = _Compilers()


def _of_this_process() -> _Compilers:
    """Return the compilers; after a fork they are those of the parent."""
    global _compilers
    if _compilers.pid != os.getpid():
        _compilers = _Compilers()
    return _compilers


def _can_compile_apart() -> bool:
    """Return whether other processes may compile for this one.

    A process that was started to work for another one compiles by itself: many of them would start
    many.
    """
    is_main = multiprocessing.parent_process() is None and FOLDER_VARIABLE not in os.environ
    kept = bool(FOLDER) and numba_hooks.are_known() and not getattr(config, "DISABLE_JIT", 0)
    return is_main and kept and bool(sys.executable) and not getattr(sys, "frozen", False)


def ask_for(work: Callable[[], object], urgency: int = LATER) -> list[CompileRequest]:
    """Walk through a computation and return requests for all kernels it needs that are missing.

    If no other process can compile them, the computation is done, which does.
    """
    if not _can_compile_apart():
        work()
        return []
    requests: dict[CompileRequest, None] = {}  # in their order, each once
    compilers = _of_this_process()

    def ask(kernel: Kernel, signature: tuple[Any, ...]) -> None:
        requests[compilers.ask(kernel, signature, urgency)] = None

    with walk(ask):
        work()
    return list(requests)


def await_all(requests: list[CompileRequest], check: Callable[[], None] = lambda: None) -> None:
    """Wait until kernels are compiled; `check` is called now and then, and may raise to stop."""
    if requests:
        _of_this_process().await_all(requests, check)


def compilation() -> CompilationProgress | None:
    """Return how far the compilation is that calls wait for; None if there is none."""
    compilers = _of_this_process()
    requests = list(compilers.awaited)
    n_done = sum(request.ended.is_set() for request in requests)
    if n_done == len(requests):
        return None
    n = sum(request.n_functions for request in requests)
    done = sum(request.n_functions * request.share for request in requests) / n
    seconds = time.monotonic() - compilers.since
    return CompilationProgress(
        n_done, len(requests), seconds * (1 - done) / done if done > 0 else None
    )


def must_compile() -> bool:
    """Return whether kernels that each study needs are missing on disk."""
    files = Path(FOLDER).rglob("*.nbc") if FOLDER else ()
    return not {file.name.split(".")[1].rsplit("-", 1)[0] for file in files} >= ENTRY_KERNELS


def _start_process() -> subprocess.Popen[bytes]:
    """Start a process that runs `serve`."""
    note_use(FOLDER)
    remove_unused(FOLDER)
    paths = [str(PACKAGE.parent), *filter(None, [os.environ.get("PYTHONPATH")])]
    own = {"PYTHONPATH": os.pathsep.join(paths), FOLDER_VARIABLE: FOLDER}
    return subprocess.Popen(
        [sys.executable, "-m", "ccwsim", "warm-up", "--serve"],
        env={**os.environ, **own},
        stdin=subprocess.PIPE,  # the system closes it however this process ends
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        bufsize=0,
    )


def _let_compile(process: subprocess.Popen[bytes], request: CompileRequest) -> None:
    """Send a request and read a byte for each function that is typed, until the line ends."""
    assert process.stdin is not None
    assert process.stdout is not None
    kernel = request.kernel
    content = pickle.dumps((kernel.__module__, kernel.__name__, request.signature))
    process.stdin.write(content)
    while (byte := process.stdout.read(1)) != b"\n":
        if not byte:
            raise BrokenPipeError("the process that compiles has ended")
        request.n_typed += 1


def _end(process: subprocess.Popen[bytes]) -> None:
    """Let a process end, which it does when its standard input is closed."""
    with process, suppress(OSError):
        assert process.stdin is not None
        process.stdin.close()


def serve() -> None:
    """Compile what another process asks for, until that closes standard input or ends.

    Neither waits for the compiler: another thread reads, and ends this process.
    """
    if os.path.basename(FOLDER) != NAME:
        return  # the source has changed since the other process was started
    if hasattr(os, "nice"):
        os.nice(5)  # pages and their browser go first
    answers = os.fdopen(os.dup(1), "wb", 0)
    os.dup2(2, 1)  # nothing else goes to the other process
    requests: SimpleQueue[tuple[str, str, tuple[Any, ...]]] = SimpleQueue()
    threading.Thread(target=_read, args=(sys.stdin.buffer, requests), daemon=True).start()
    gc.freeze()
    gc.disable()  # a tenth of the time; the process ends soon
    with event.install_listener("numba:compile", _Listener(answers)):
        while True:
            module, name, signature = requests.get()
            with suppress(Exception):  # the other process finds no code, and meets the error itself
                getattr(import_module(module), name).dispatcher.compile(signature)
            answers.write(b"\n")


def _read(stream: BinaryIO, requests: SimpleQueue[Any]) -> None:
    """Read requests until the end of the stream, and end this process then."""
    with suppress(EOFError, OSError, pickle.UnpicklingError):
        while True:
            requests.put(pickle.load(stream))
    os._exit(0)


class _Listener(event.Listener):
    """Writes a byte for each function that is compiled."""

    def __init__(self, stream: BinaryIO) -> None:
        self.stream = stream

    def on_start(self, event: event.Event) -> None:
        self.stream.write(b".")

    def on_end(self, event: event.Event) -> None:
        pass
