"""Hostile uploads for every reader: ``python -m benchmarks.safety``.

For each reader, the worst file of tests/fuzz/evil.py is read like an upload to the dashboard. The
columns:

- CPU, memory: of the process that reads the file; maximum over the rounds
- delay: longest delay of a thread of the main process that is due every 5 ms, which is the time
  that other visitors wait; minimum over the rounds, because other programs also cause delays
- server: growth of the main process; minimum over the rounds
- answer: the message to the user

The table replaces the table in docs/safety.md. The benchmark needs Linux, and an idle machine.
"""

from __future__ import annotations

import argparse
import os
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from benchmarks.memory import peak_megabytes
from ccwsim.io import isolated
from ccwsim.io.atomic import write_bytes
from ccwsim.model.errors import CCWSIMError
from tests.fuzz.evil import EVIL, WORST
from tests.fuzz.reading import uploads

SAFETY = Path(__file__).parents[1] / "docs" / "safety.md"
BEGIN, END = "<!-- python -m benchmarks.safety -->", "<!-- end of the table -->"
"""Lines before and after the table in the document."""
HEADER = """
| reader | file | CPU, s | memory, MB | delay, ms | server, MB | answer |
|---|---|--:|--:|--:|--:|---|
"""
TICK = 0.005
"""Seconds between two moments at which the ticking thread is due."""
LOOK = 0.02
"""Seconds between two measurements of the reading process."""


@dataclass(frozen=True)
class Measured:
    """Measurements of one file."""

    answer: str
    cpu: float
    memory: float
    delay: float
    growth: float


class _Repeated(threading.Thread):
    """A thread that acts repeatedly until it is stopped."""

    def __init__(self) -> None:
        super().__init__(daemon=True)
        self.stopped = False

    def run(self) -> None:
        while not self.stopped:
            self.act()

    def act(self) -> None:
        raise NotImplementedError


class _Ticker(_Repeated):
    """Records the longest delay of a thread that is due every `TICK` seconds."""

    longest = 0.0

    def act(self) -> None:
        start = time.perf_counter()
        time.sleep(TICK)
        self.longest = max(self.longest, time.perf_counter() - start - TICK)


class _Watch(_Repeated):
    """Records the processor seconds and the peak memory of another process since the start."""

    def __init__(self, pid: int) -> None:
        super().__init__()
        self._folder = Path("/proc", str(pid))
        self._start = self._last = self._look()

    def act(self) -> None:
        with suppress(OSError, StopIteration, IndexError):  # the process has ended
            self._last = self._look()
        time.sleep(LOOK)

    def used(self) -> tuple[float, float]:
        cpu, memory = (now - before for now, before in zip(self._last, self._start, strict=True))
        return cpu, memory

    def _look(self) -> tuple[float, float]:
        words = (self._folder / "stat").read_text().rpartition(")")[2].split()
        lines = (self._folder / "status").read_text().splitlines()
        peak = next(line for line in lines if line.startswith("VmHWM")).split()[1]
        seconds = (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")
        return seconds, int(peak) / 1024


@contextmanager
def _running(*threads: _Repeated) -> Iterator[None]:
    for thread in threads:
        thread.start()
    yield
    for thread in threads:
        thread.stopped = True
        thread.join()


def measure(reader: str, name: str, content: bytes) -> Measured:
    """Read one file as an upload, in a new process."""
    while isolated._warm.idle:
        isolated._warm.idle.pop().end()
    _answer(*next(uploads(b"x,y,facies\n1,2,0\n", f"{time.time()}.csv")))  # starts a process
    watch, ticker = _Watch(isolated._warm.idle[0].pid), _Ticker()
    acts = dict(uploads(content, name))
    words = ("project",) if reader == "project" else ("inspect", "image", "points")
    Path("/proc/self/clear_refs").write_text("5")  # the peak is measured anew
    before = peak_megabytes() or 0.0
    with _running(watch, ticker):
        answers = [_answer(word, acts[word]) for word in words]
    growth = (peak_megabytes() or 0.0) - before
    return Measured(answers[0], *watch.used(), ticker.longest, growth)


def _answer(word: str, act: Callable[[], object]) -> str:
    """Return the message of an operation without the name of the file, or "is read"."""
    try:
        act()
        return "is read"
    except CCWSIMError as error:
        return str(error).split(": ", 1)[-1]


def row(reader: str, rounds: int) -> str:
    """Return the row of a reader."""
    name = WORST[reader]
    content = EVIL[name]()
    again = [measure(reader, f"{name}-{k}", content) for k in range(rounds)]
    cpu, memory = (max(getattr(one, key) for one in again) for key in ("cpu", "memory"))
    delay, growth = (min(getattr(one, key) for one in again) for key in ("delay", "growth"))
    answer = again[-1].answer.removeprefix(f"{name}-{rounds - 1} ")
    cells = f"{cpu:.1f} | {memory:.0f} | {1000 * delay:.0f} | {growth:.0f}"
    return f"| {reader} | {name} | {cells} | {answer} |"


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure all readers, print the table and write it into the document."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.safety", description=__doc__)
    parser.add_argument("--rounds", type=int, default=3, metavar="N")
    rounds = parser.parse_args(arguments).rounds
    print(HEADER.strip())
    rows = []
    for reader in WORST:
        rows.append(row(reader, rounds))
        print(rows[-1], flush=True)
    text = SAFETY.read_text("utf-8")
    head, tail = text.split(BEGIN)[0], text.split(END)[1]
    load = f"Measured at a load of {os.getloadavg()[0]:.0f} on {os.cpu_count()} cores."
    table = HEADER + "\n".join(rows) + f"\n\n{load}\n"
    write_bytes(SAFETY, f"{head}{BEGIN}\n{table}\n{END}{tail}".encode())


if __name__ == "__main__":
    main()
