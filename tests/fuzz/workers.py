"""Run each case in a separate process that can be killed; measure its time and memory."""

from __future__ import annotations

import ctypes
import gc
import multiprocessing as mp
import os
import signal
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from importlib import import_module
from importlib.util import find_spec
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any

from ccwsim import CCWSIMError

resource: Any = import_module("resource") if find_spec("resource") else None
"""The module of POSIX; on Windows None, where `measured` still finds faults."""
SECONDS, MEGABYTES = 2.0, 500.0
"""Allowed seconds for each operation, and allowed megabytes for all operations of a case."""
PATIENCE = 60.0
"""Processor seconds of a case after which its process is killed."""
ROOM = 3 * 2**30
"""Bytes by which the address space of a process may grow, to protect the machine."""

Acts = Iterator[tuple[str, Callable[[], object]]]


@dataclass
class Outcome:
    """Outcome of a case.

    Attributes
    ----------
    case : object
        Identifier of the case.
    results, refusals : int
        Numbers of operations with a result and with a CCWSIMError.
    faults : list of str
        Other exceptions, invalid messages, and remaining files.
    seconds : float
        Time of the longest operation: processor or wall time, whichever is smaller.
    slowest : str
        Name of the longest operation.
    total : float
        Seconds of all operations.
    megabytes : float
        Maximum growth of the process.
    """

    case: Any
    results: int = 0
    refusals: int = 0
    faults: list[str] = field(default_factory=list)
    seconds: float = 0.0
    slowest: str = ""
    total: float = 0.0
    megabytes: float = 0.0

    @property
    def bad(self) -> bool:
        """Whether the case had a fault or exceeded a limit."""
        return bool(self.faults) or self.seconds > SECONDS or self.megabytes > MEGABYTES


def outcomes(
    cases: Sequence[Any], acts_of: Callable[[Any], Acts], n_workers: int
) -> Iterator[Outcome]:
    """Yield the outcome of each case, in any order.

    Parameters
    ----------
    cases : sequence
        Small values that identify the cases.
    acts_of : callable
        Prepares a case, which is not measured, and yields its operations; runs in the worker.
    n_workers : int
    """
    waiting = list(reversed(cases))
    running: dict[Connection, tuple[mp.Process, Any, float]] = {}
    try:
        while waiting or running:
            while waiting and len(running) < n_workers:
                connection, process = _started(acts_of)
                running[connection] = process, None, 0.0
                _give(connection, waiting, running)
            for connection in wait(list(running), timeout=1.0):
                yield from _taken(connection, waiting, running)  # type: ignore[arg-type]
            yield from _ended(running)
    finally:
        for process, _, _ in running.values():
            process.kill()


def _give(connection: Connection, waiting: list, running: dict) -> None:
    process, _, _ = running[connection]
    if not waiting:
        connection.send(None)
        del running[connection]
        return
    case = waiting.pop()
    running[connection] = process, case, _used(process)
    connection.send(case)


def _taken(connection: Connection, waiting: list, running: dict) -> Iterator[Outcome]:
    process, case, _ = running[connection]
    try:
        yield connection.recv()
    except (EOFError, OSError):
        process.join()
        del running[connection]
        yield Outcome(case, faults=[f"the process ended with {process.exitcode}"])
        return
    _give(connection, waiting, running)


def _ended(running: dict) -> Iterator[Outcome]:
    for connection, (process, case, since) in list(running.items()):
        if _used(process) - since > PATIENCE:
            os.kill(process.pid, signal.SIGKILL)
            process.join()
            del running[connection]
            yield Outcome(case, seconds=PATIENCE, slowest="never ended")


def _used(process: mp.Process) -> float:
    """Return the processor seconds that a process has used so far."""
    with suppress(OSError):
        words = Path(f"/proc/{process.pid}/stat").read_text().rsplit(")", 1)[1].split()
        return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")
    return 0.0


def _started(acts_of: Callable[[Any], Acts]) -> tuple[Connection, mp.Process]:
    here, there = mp.Pipe()
    process = mp.get_context("fork").Process(target=_work, args=(there, acts_of), daemon=True)
    process.start()
    there.close()
    return here, process  # type: ignore[return-value]


def _work(connection: Connection, acts_of: Callable[[Any], Acts]) -> None:
    warnings.simplefilter("ignore")
    hold_memory()
    gc.freeze()  # existing objects need no further garbage collection
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        while (case := connection.recv()) is not None:
            outcome = measured(case, acts_of(case))
            left = [path.name for path in Path(folder).iterdir()]
            outcome.faults += [f"left behind: {name!r}" for name in left]
            connection.send(outcome)
        os.chdir("/")


def hold_memory() -> None:
    """Limit the address space of this process to its present size plus `ROOM`."""
    soft, _ = resource.getrlimit(resource.RLIMIT_AS)
    if soft != resource.RLIM_INFINITY:
        return
    limit = 1024 * _status("VmSize") + ROOM
    resource.setrlimit(resource.RLIMIT_AS, (limit, resource.RLIM_INFINITY))


def measured(case: Any, acts: Acts) -> Outcome:
    """Return the outcome of the operations of a case in this process."""
    outcome = Outcome(case)
    before = 0
    while True:
        act = next(acts, None)
        if act is None:
            break
        if not before:
            before = _fresh()
        seconds = _done(*act, outcome)
        if seconds > SECONDS:  # repeat, because the first time may include compilation
            seconds = min(seconds, _done(*act, Outcome(case)))
        outcome.total += seconds
        if seconds > outcome.seconds:
            outcome.seconds, outcome.slowest = seconds, act[0]
    outcome.megabytes = max(0, _status("VmHWM") - before) / 1024 if before else 0.0
    return outcome


def _done(word: str, act: Callable[[], object], outcome: Outcome) -> float:
    start, cpu = time.perf_counter(), time.process_time()
    try:
        act()
        outcome.results += 1
    except CCWSIMError as error:
        outcome.refusals += 1
        said = str(error)
        problems = said.split("\n")  # all problems of hard data are listed, one a line
        if len(said) > 1000 or not all(line and line.isprintable() for line in problems):
            outcome.faults.append(f"{word}: unfit message {said[:200]!r}")
    except BaseException as error:
        where = _place(error)
        outcome.faults.append(f"{word}: {type(error).__name__}: {str(error)[:150]} at {where}")
    return min(time.perf_counter() - start, time.process_time() - cpu)


def _place(error: BaseException) -> str:
    """Return the last line of the package in the traceback of an error."""
    place, trace = "", error.__traceback__
    while trace is not None:
        code = trace.tb_frame.f_code
        if "ccwsim" in code.co_filename:
            place = f"{Path(code.co_filename).name}:{trace.tb_lineno}"
        trace = trace.tb_next
    return place


def _fresh() -> int:
    """Free memory, reset the measured peak, and return the present memory."""
    with suppress(OSError, AttributeError):
        ctypes.CDLL("libc.so.6").malloc_trim(0)
    with suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")
    return _status("VmRSS")


def _status(name: str) -> int:
    """Return the kilobytes in a line of the process's status; 0 if the system has no such file."""
    with suppress(OSError, StopIteration):
        lines = Path("/proc/self/status").read_text().splitlines()
        return int(next(line for line in lines if line.startswith(name)).split()[1])
    if resource is None:
        return 0
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak // 1024 if sys.platform == "darwin" else peak
