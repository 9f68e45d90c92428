"""Many simultaneous users: ``python -m benchmarks.soak --sessions 30 --minutes 10``.

Sessions do mixed work on a local server: runs with other seeds, levels and sizes, Live, Validate,
Compare, How it works, uploads, and opening and closing tabs. One session opens links with extreme
values and leaves large files. Every picture is compared with a realization computed by the engine.
The report has errors, response times (median and 95 %), the longest time without an answer, and the
server's memory after warming up, at its peak, and after all sessions have expired.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import threading
import time
import urllib.request
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Self

import numpy as np

from benchmarks.visitor import HostileVisitor, Visitor
from ccwsim.system.memory import used_memory
from tests.browser.served import ROOT, Server, started
from tests.ui.sessions import Session

TIME_TO_LIVE = 20
"""Seconds that the server keeps the session of a closed tab (the server's default is 120)."""
WARMING = 60.0
"""Seconds of work before the first measurement of memory, in which modules are loaded."""
EVERY = 0.5
"""Seconds between two measurements of the server's memory."""
PULSE = 0.1
"""Seconds between an answer to a health check and the next check."""
BACK_WITHIN = 0.1
"""Allowed growth of the server's memory from start to end, relative to the start."""


@dataclass
class Tally:
    """Observations of all visitors.

    Attributes
    ----------
    seconds : dict of str to list of float
        Response times by kind of request.
    errors : Counter of str
    wrong : int
        Number of pictures that differ from those of the engine.
    """

    seconds: dict[str, list[float]] = field(default_factory=dict)
    errors: Counter[str] = field(default_factory=Counter)
    wrong: int = 0
    checked: int = 0
    tabs: int = 0
    lock: threading.Lock = field(default_factory=threading.Lock)

    def took(self, what: str, seconds: float) -> None:
        """Add a response time."""
        with self.lock:
            self.seconds.setdefault(what, []).append(seconds)

    def looked(self, right: bool) -> None:
        """Count a picture, and count it as wrong if it differs from that of the engine."""
        with self.lock:
            self.checked += 1
            self.wrong += not right

    def failed(self, why: str) -> None:
        """Count an error."""
        with self.lock:
            self.errors[why] += 1

    def opened(self) -> None:
        """Count a tab."""
        with self.lock:
            self.tabs += 1


class Watcher:
    """Context manager that checks a server at regular intervals on a thread."""

    def __init__(self, every: float) -> None:
        self._every = every
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._over.set()
        self._thread.join()

    def look(self) -> None:
        """Check the server once."""
        raise NotImplementedError

    def _watch(self) -> None:
        while not self._over.wait(self._every):
            self.look()


class Pulse(Watcher):
    """Measures the response times of the health check of a server."""

    def __init__(self, address: str, every: float = PULSE) -> None:
        super().__init__(every)
        self._url = f"{address}/_stcore/health"
        self.seconds: list[float] = []

    def look(self) -> None:
        """Send one health check and measure its response time."""
        start = time.monotonic()
        with urllib.request.urlopen(self._url, timeout=60):
            self.seconds.append(time.monotonic() - start)


class Memory(Watcher):
    """Watches the resident memory of a process, in MB."""

    def __init__(self, pid: int) -> None:
        super().__init__(EVERY)
        self._pid, self.peak = pid, 0.0

    def now(self) -> float:
        """Return the current memory in MB, 0 if the process has ended."""
        return (used_memory(process=self._pid) or 0) / 2**20

    def look(self) -> None:
        """Update the peak."""
        self.peak = max(self.peak, self.now())


@dataclass(frozen=True)
class Outcome:
    """Results of a soak test."""

    tally: Tally
    sessions: int
    minutes: float
    start: float
    peak: float
    end: float
    tracebacks: int
    troubles: int
    pulse: list[float]  # response times of health checks in seconds

    @property
    def back(self) -> bool:
        """Whether the final memory exceeds the initial memory by less than a tenth."""
        return self.end <= (1 + BACK_WITHIN) * self.start

    @property
    def good(self) -> bool:
        """Whether there was no error, no wrong picture and no lost memory."""
        seen = sum(self.tally.errors.values()) + self.tally.wrong
        return not seen + self.tracebacks + self.troubles and self.back and self.tally.checked > 0


def soak(
    sessions: int,
    minutes: float,
    seed: int = 0,
    log: Path | None = None,
    ttl: int = TIME_TO_LIVE,
    warming: float = WARMING,
) -> Outcome:
    """Let visitors work for some minutes and return the results.

    Parameters
    ----------
    sessions : int
    minutes : float
    seed : int
        Seed of the visitors' actions.
    log : Path, optional
        File for the output of the server.
    ttl : int
        Seconds that the server keeps the session of a closed tab.
    warming : float
        Seconds of work before memory is first measured.
    """
    tally = Tally()
    with tempfile.TemporaryDirectory() as folder:
        log = log or Path(folder) / "log"
        log.write_bytes(b"")  # do not count the log of an earlier soak test
        options = (f"--server.disconnectedSessionTTL={ttl}",)
        with started(ROOT, *options, log=log) as server, Memory(server.process.pid) as memory:
            _warm_up(server, sessions, seed, warming)
            _all_forgotten(server, ttl)
            begin = memory.now()
            memory.peak = begin
            with Pulse(server.address) as pulse:
                _visit(server, sessions, 60 * minutes, seed, tally)
            _all_forgotten(server, ttl)
            end = memory.now()
        said = log.read_text("utf-8", "replace")
    return Outcome(
        tally,
        sessions,
        minutes,
        begin,
        memory.peak,
        end,
        said.count("Traceback (most recent call last)"),
        said.count("trouble "),
        pulse.seconds,
    )


def _warm_up(server: Server, sessions: int, seed: int, seconds: float) -> None:
    """Let the same number of sessions do each kind of work, to load modules and fill caches."""
    _visit(server, sessions, seconds, seed + 10_000, Tally(), whole=True)


def _visit(
    server: Server, sessions: int, seconds: float, seed: int, tally: Tally, whole: bool = False
) -> None:
    end = time.monotonic() + seconds
    kinds = [Visitor if k else HostileVisitor for k in range(sessions)]
    visitors = [
        kind(server.address, tally, np.random.default_rng([seed, k]), end, k, whole)
        for k, kind in enumerate(kinds)
    ]
    threads = [threading.Thread(target=one.stay, daemon=True) for one in visitors]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


def _all_forgotten(server: Server, ttl: int) -> None:
    """Wait until the server has dropped all sessions of closed tabs."""
    time.sleep(ttl + 2)
    with Session(server.address, "paper") as last:
        last.open()
    time.sleep(ttl + 2)
    with urllib.request.urlopen(f"{server.address}/_stcore/metrics", timeout=60):
        time.sleep(2)


def rows(outcome: Outcome) -> list[tuple[str, ...]]:
    """Return the lines of the table of times, slowest kind first."""
    found = []
    everything = [s for times in outcome.tally.seconds.values() for s in times]
    kinds = sorted(outcome.tally.seconds.items(), key=lambda pair: -float(np.median(pair[1])))
    for what, times in [*kinds, ("**all**", everything)]:
        middle, most = np.percentile(times, [50, 95]) if times else (np.nan, np.nan)
        found.append((what, str(len(times)), f"{middle:.2f}", f"{most:.2f}", f"{max(times):.2f}"))
    return found


def report(outcome: Outcome) -> str:
    """Return the results as Markdown."""
    tally = outcome.tally
    lines = [
        "| request | times | median (s) | 95 % (s) | longest (s) |",
        "|---|---:|---:|---:|---:|",
        *(f"| {' | '.join(row)} |" for row in rows(outcome)),
        "",
        f"{outcome.sessions} sessions for {outcome.minutes:g} minutes, {tally.tabs} tabs. "
        f"{tally.checked} pictures compared with the engine, {tally.wrong} wrong. "
        f"{sum(tally.errors.values())} errors seen by users, {outcome.tracebacks} tracebacks and "
        f"{outcome.troubles} internal errors in the server's log. Memory of the server: "
        f"{outcome.start:.0f} MB at the start, {outcome.peak:.0f} MB at most, {outcome.end:.0f} MB "
        f"at the end ({100 * (outcome.end / outcome.start - 1):+.0f} %). {alive(outcome.pulse)}",
    ]
    lines += [f"- {count} × {why}" for why, count in tally.errors.most_common(12)]
    return "\n".join(lines)


def alive(seconds: Sequence[float]) -> str:
    """Describe the response times of the health check."""
    most, longest = np.percentile(seconds, 99), max(seconds)
    return f"99 % of health checks took less than {most:.2f} s, the longest {longest:.2f} s."


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a soak test and print the results; return 1 for any error."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.soak",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--sessions", type=int, default=30)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--seed", type=int, default=0, help="seed of the visitors' actions")
    parser.add_argument("--log", type=Path, help="file for the output of the server")
    options = parser.parse_args(arguments)
    outcome = soak(options.sessions, options.minutes, options.seed, options.log)
    print(report(outcome))
    return 0 if outcome.good else 1


if __name__ == "__main__":
    sys.exit(main())
