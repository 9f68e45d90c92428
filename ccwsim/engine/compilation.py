"""Compile kernels in other processes, in parallel, and read the code from disk.

Numba holds the interpreter lock while compiling, so a server that compiled in a thread could not
answer requests. A call of a kernel that is not on disk waits until a compiling process has written
the kernel. `ask_for` requests all kernels of a computation at once. If no process can be started,
or no file can be written, the calling process compiles the kernel.
"""

import gc
import heapq
import multiprocessing
import os
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from importlib import import_module
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

from numba import config
from numba.core import event

from ccwsim.engine import numba_hooks
from ccwsim.engine.kernel_cache import (
    FOLDER_VARIABLE,
    KERNEL_FOLDER,
    KERNEL_FOLDER_NAME,
    note_use,
    remove_unused,
)
from ccwsim.jobs.child import ChildProcess, can_start, connect_to_parent
from ccwsim.jobs.workers import without_cores
from ccwsim.system.machine import n_cores

MAX_COMPILERS = 3
"""Maximum number of compiling processes. More processes would not finish earlier, because compiling
the largest kernel takes a third of the total time."""
IDLE_SECONDS = 5.0  # time in seconds after which a compiling process without requests ends
COMPILER_POLL_SECONDS = 0.1
NOW, SOON, LATER = 0, 1, 2
"""Urgency of a request: a call waits for the kernel, will soon need it, or may need it later."""
ENTRY_KERNELS = {"simulate_patches", "resimulate_windows", "repair_windows", "change_cells"}
"""Names of the kernels of a realization that take longest to compile."""
OPTIMIZING = 0.5  # time to optimize a kernel, divided by the time to infer the types in the kernel


AnyKernel = Any
"""The class `kernels.Kernel`; it cannot be imported here, because `kernels` imports this file."""
_walking = threading.Lock()
"""Lock held by `list_missing_kernels`, because Numba's table of types is not thread-safe."""
_walk: ContextVar[Callable[[AnyKernel, tuple[Any, ...]], None] | None] = ContextVar(
    "list_missing_kernels", default=None
)


class MissingKernelError(Exception):
    """Raised inside `list_missing_kernels` to end the call of a missing kernel."""


@contextmanager
def list_missing_kernels(
    on_missing: Callable[[AnyKernel, tuple[Any, ...]], None],
) -> Iterator[None]:
    """Run a computation only to list its missing kernels.

    `on_missing(kernel, signature)` is called for each missing kernel. Kernels are not run: each
    call returns 0 and leaves the arrays unchanged. Only kernels that allocate arrays are run, in
    plain Python. With small arrays, the computation therefore takes almost no time.
    """
    token = _walk.set(on_missing)
    try:
        yield
    finally:
        _walk.reset(token)


def is_walking() -> bool:
    """Return whether the caller runs inside `list_missing_kernels`."""
    return _walk.get() is not None


def compile_missing(kernel: AnyKernel, signature: tuple[Any, ...]) -> None:
    """Wait until another process has compiled a kernel, if other processes can compile kernels.

    Raises
    ------
    MissingKernelError
        If called inside `list_missing_kernels`, which only records missing kernels.
    """
    if on_missing := _walk.get():
        on_missing(kernel, signature)
        raise MissingKernelError
    if kernel.__module__.startswith("ccwsim.") and _can_compile_apart():
        compilers = _of_this_process()
        compilers.await_all([compilers.ask(kernel, signature, NOW)], lambda: None)


class CompilationProgress(NamedTuple):
    """Progress of compiling the kernels for which calls are waiting."""

    n_done: int
    n: int
    seconds_left: float | None
    modules: tuple[str, ...] = ()  # modules of the kernels that are missing, with repetitions


class CompileRequest:
    """A request to compile a kernel for one signature, that is, for given types of arguments."""

    def __init__(self, kernel: AnyKernel, signature: tuple[Any, ...], urgency: int) -> None:
        self.kernel, self.signature, self.urgency = kernel, signature, urgency
        self.n_functions, self.n_typed = kernel.n_functions, 0
        self.is_taken, self.ended = False, threading.Event()

    @property
    def share(self) -> float:
        """Share of the compilation that is finished, 0 … 1."""
        if self.ended.is_set():
            return 1.0
        return min(self.n_typed / self.n_functions, 1.0) / (1 + OPTIMIZING)


class _Compilers:
    """The processes that compile kernels for this process, with one communicating thread each."""

    def __init__(self) -> None:
        self.pid = os.getpid()
        self.awaited: list[CompileRequest] = []
        self.since = 0.0
        self._changed = threading.Condition()
        self._requests: dict[tuple[str, tuple[Any, ...]], CompileRequest] = {}
        self._queue: list[tuple[int, int, int, CompileRequest]] = []
        self._n_asked = self._n_running = self._n_idle = 0

    def ask(self, kernel: AnyKernel, signature: tuple[Any, ...], urgency: int) -> CompileRequest:
        """Return the request for a kernel; add a new request to the queue if necessary."""
        with self._changed:
            key = f"{kernel.__module__}.{kernel.__name__}", signature
            request = self._requests.get(key)
            if request is None or request.ended.is_set():
                request = self._requests[key] = CompileRequest(kernel, signature, LATER + 1)
            if urgency < request.urgency and not request.is_taken:
                request.urgency, self._n_asked = urgency, self._n_asked + 1
                heapq.heappush(self._queue, (urgency, -request.n_functions, self._n_asked, request))
                more = len(self._queue) > self._n_idle
                if more and self._n_running < min(n_cores(), MAX_COMPILERS):
                    self._start()
                self._changed.notify()
            return request

    def await_all(self, requests: list[CompileRequest], check: Callable[[], None]) -> None:
        """Wait until all requests have ended; `check` is called regularly and may raise errors."""
        with self._changed:
            if all(request.ended.is_set() for request in self.awaited):
                self.awaited, self.since = [], time.monotonic()
            self.awaited += [request for request in requests if request not in self.awaited]
        for request in requests:
            while not request.ended.wait(COMPILER_POLL_SECONDS):
                check()

    def _start(self) -> None:
        try:
            threading.Thread(target=self._serve, daemon=True).start()
            self._n_running += 1
        except RuntimeError:  # the system allows no more threads
            self._give_up()

    def _serve(self) -> None:
        """Send requests to one process until the queue is empty or the process ends."""
        process = None
        try:
            process = _start_process()
            while request := self._next():
                try:
                    _let_compile(process, request)
                finally:
                    request.ended.set()
        except Exception:  # the process did not start or has ended, or a type cannot be sent
            with self._changed:
                self._n_running -= 1
                if not self._n_running:
                    self._give_up()
        finally:
            if process is not None:
                process.end()

    def _next(self) -> CompileRequest | None:
        """Return the most urgent request, or None if there is no request within IDLE_SECONDS."""
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
        """End all requests if no compiling process runs; this process then compiles kernels."""
        while self._queue:
            heapq.heappop(self._queue)[-1].ended.set()


_compilers = _Compilers()


def _of_this_process() -> _Compilers:
    """Return the `_Compilers` of this process; a forked process gets a new object."""
    global _compilers
    if _compilers.pid != os.getpid():
        _compilers = _Compilers()
    return _compilers


def _can_compile_apart() -> bool:
    """Return whether other processes may compile kernels for this process.

    Worker processes compile kernels themselves; otherwise each would start several processes.
    """
    is_main = multiprocessing.parent_process() is None and FOLDER_VARIABLE not in os.environ
    kept = bool(KERNEL_FOLDER) and numba_hooks.are_known() and not getattr(config, "DISABLE_JIT", 0)
    return is_main and kept and can_start()


def ask_for(work: Callable[[], object], urgency: int = LATER) -> list[CompileRequest]:
    """Find all missing kernels of a computation, and return requests to compile them.

    If no other process can compile kernels, run the computation, which compiles its kernels.
    """
    if not _can_compile_apart():
        work()
        return []
    requests: dict[CompileRequest, None] = {}  # a dictionary as an ordered set
    compilers = _of_this_process()

    def ask(kernel: AnyKernel, signature: tuple[Any, ...]) -> None:
        requests[compilers.ask(kernel, signature, urgency)] = None

    with _walking, without_cores(), list_missing_kernels(ask):
        work()
    return list(requests)


def await_all(requests: list[CompileRequest], check: Callable[[], None] = lambda: None) -> None:
    """Wait until kernels are compiled; `check` is called regularly and may raise errors."""
    if requests:
        _of_this_process().await_all(requests, check)


def compilation() -> CompilationProgress | None:
    """Return the progress of the compilation if calls wait for kernels; otherwise None."""
    compilers = _of_this_process()
    requests = list(compilers.awaited)
    n_done = sum(request.ended.is_set() for request in requests)
    if n_done == len(requests):
        return None
    n = sum(request.n_functions for request in requests)
    done = sum(request.n_functions * request.share for request in requests) / n
    seconds = time.monotonic() - compilers.since
    modules = (r.kernel.__module__ for r in requests if not r.ended.is_set())
    seconds_left = seconds * (1 - done) / done if done > 0 else None
    return CompilationProgress(n_done, len(requests), seconds_left, tuple(modules))


def must_compile() -> bool:
    """Return whether any kernel that every study needs is missing or damaged on disk."""
    files = Path(KERNEL_FOLDER).rglob("*.nbc") if KERNEL_FOLDER else ()
    names = ((file, file.name.split(".")[1].rsplit("-", 1)[0]) for file in files)
    entries = ((file, name) for file, name in names if name in ENTRY_KERNELS)
    return (
        not {name for file, name in entries if numba_hooks.is_complete_file(file)} >= ENTRY_KERNELS
    )


def _start_process() -> ChildProcess:
    """Start a process that runs `serve_compilation`."""
    note_use(KERNEL_FOLDER)
    remove_unused(KERNEL_FOLDER)
    return ChildProcess(serve_compilation, {FOLDER_VARIABLE: KERNEL_FOLDER})


def _let_compile(process: ChildProcess, request: CompileRequest) -> None:
    """Send a request; then read one byte per compiled function until a line end."""
    kernel = request.kernel
    process.send((kernel.__module__, kernel.__name__, request.signature))
    while (byte := process.answers.read(1)) != b"\n":
        if not byte:
            raise BrokenPipeError("the compiling process has ended")
        request.n_typed += 1


def serve_compilation() -> None:
    """Compile kernels requested by another process, until that process ends or closes the input."""
    if os.path.basename(KERNEL_FOLDER) != KERNEL_FOLDER_NAME:
        return  # the source has changed since the other process was started
    requests, answers = connect_to_parent()
    gc.freeze()
    gc.set_threshold(100_000, 20, 20)  # none would be 4 % faster, but take 1.7 times the memory
    with event.install_listener("numba:compile", _Listener(answers)):
        while True:
            module, name, signature = requests.get()
            with suppress(Exception):  # the requesting process gets the error too
                getattr(import_module(module), name).dispatcher.compile(signature)
            answers.write(b"\n")


class _Listener(event.Listener):
    """Listener that writes one byte for each compiled function."""

    def __init__(self, stream: BinaryIO) -> None:
        self.stream = stream

    def on_start(self, event: event.Event) -> None:
        self.stream.write(b".")

    def on_end(self, event: event.Event) -> None:
        pass
