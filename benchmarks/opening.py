"""Sessions that open the page Simulate at the same time: ``python -m benchmarks.opening``.

One session warms up a local server. Then 1, 6 and 30 sessions open the first study at once and stay
connected. For each number of sessions, the table has the processor time of the server for one
opening, the times to the first picture and to the complete page (median and maximum), and the
response times of the health check, which is sent every 50 ms (median, 99 % and maximum). With
--against DIR, two checkouts are measured alternately.
"""

from __future__ import annotations

import argparse
import os
import sys
import threading
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from benchmarks.soak import Pulse
from tests.browser.served import ROOT, Server, started
from tests.ui.sessions import Session, Stuck

PULSE = 0.05
"""Seconds between two health checks."""
HEADER = (
    "| sessions | checkout | CPU s | picture s | max | complete s | max | health s | 99 % | max |"
    "\n|--:|---|--:|--:|--:|--:|--:|--:|--:|--:|"
)


@dataclass
class Openings:
    """Measurements of all rounds with the same number of sessions."""

    cpu: list[float] = field(default_factory=list)  # processor seconds of each opening
    picture: list[float] = field(default_factory=list)
    complete: list[float] = field(default_factory=list)
    health: list[float] = field(default_factory=list)


class TimedSession(Session):
    """A session that records when the first picture of a realization arrives."""

    def timed_open(self, together: threading.Barrier, stack: ExitStack) -> tuple[float, float]:
        """Connect, open the page and stay connected until `stack` ends.

        Return the seconds to the first picture and to the complete page.
        """
        self.first = 0.0
        together.wait()
        start = time.monotonic()
        stack.enter_context(self).open()
        end = time.monotonic()
        if self.errors or not self.first:
            raise Stuck(f"the page has no picture; {self.errors or self.words()}")
        return self.first - start, end - start

    def _draw(self, message) -> None:
        super()._draw(message)
        element = message.delta.new_element
        if not self.first and element.bidi_component.id.rstrip().endswith("-map_realization"):
            self.first = time.monotonic()


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.opening", description=__doc__)
    parser.add_argument("--against", type=Path, metavar="DIR", help="another checkout")
    counts = {"nargs": "+", "type": int, "default": [1, 6, 30]}
    parser.add_argument("--sessions", metavar="N", **counts, help="default: %(default)s")
    parser.add_argument("--rounds", type=int, default=3, metavar="N", help="default: %(default)s")
    options = parser.parse_args(arguments)
    roots = {"this": ROOT, **({"other": options.against.resolve()} if options.against else {})}
    with ExitStack() as stack:
        servers = {name: stack.enter_context(started(root)) for name, root in roots.items()}
        for server in servers.values():
            open_at_once(server, 1, Openings())
        print(HEADER, flush=True)
        for n in options.sessions:
            measured = {name: Openings() for name in servers}
            for _ in range(options.rounds):
                for name, server in servers.items():
                    open_at_once(server, n, measured[name])
            for name, openings in measured.items():
                print(row(n, name, openings), flush=True)


def open_at_once(server: Server, n: int, openings: Openings) -> None:
    """Let n sessions open the page at the same time, and add the measurements."""
    together = threading.Barrier(n)
    with ExitStack() as stack, ThreadPoolExecutor(n) as threads:
        tabs = [TimedSession(server.address) for _ in range(n)]
        before = cpu_seconds(server.process.pid)
        with Pulse(server.address, PULSE) as pulse:
            times = list(threads.map(lambda tab: tab.timed_open(together, stack), tabs))
        openings.cpu.append((cpu_seconds(server.process.pid) - before) / n)
    openings.picture += [first for first, _ in times]
    openings.complete += [end for _, end in times]
    openings.health += as_if_asked_regularly(pulse.seconds)


def as_if_asked_regularly(seconds: Sequence[float]) -> list[float]:
    """Return the response times as if a check were sent every `PULSE` seconds without waiting."""
    return [float(rest) for each in seconds for rest in np.arange(each, 0.0, -PULSE)]


def cpu_seconds(process: int) -> float:
    """Return the processor time of all threads of a process."""
    values = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(values[11]) + int(values[12])) / os.sysconf("SC_CLK_TCK")


def row(n: int, name: str, openings: Openings) -> str:
    """Return a line of the table."""
    cells = [np.median(openings.cpu)]
    for each in (openings.picture, openings.complete):
        cells += [np.median(each), np.max(each)]
    cells += [*np.quantile(openings.health, (0.5, 0.99)), np.max(openings.health)]
    return f"| {n} | {name} | {' | '.join(f'{value:.2f}' for value in cells)} |"


if __name__ == "__main__":
    sys.exit(main())
