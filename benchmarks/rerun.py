"""Cost of a change of the study on the server: ``python -m benchmarks.rerun``.

A session without a browser changes the seed and the level on the page Simulate, with Live on, and
then draws data on the page Hard data. The study has 12 realizations of 256 × 256 cells. The table
has the processor time of the server (median, minimum), and the bytes that the server sends. A
changed seed or level includes the simulation, until the page is at rest. A datum includes the local
re-simulation of all realizations, until these are drawn. With --against DIR, two checkouts are
measured alternately.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path

import numpy as np

from benchmarks.opening import cpu_seconds
from tests.browser.served import ROOT, Server, started
from tests.ui.sessions import Session

STUDY = "grid=256x256&data=none&realizations=12"
WARM_UP = 3  # first changes, which are not measured
HEADER = "| change | checkout | CPU ms | minimum | kB |\n|---|---|--:|--:|--:|"


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.rerun", description=__doc__)
    parser.add_argument("--against", type=Path, metavar="DIR", help="another checkout")
    parser.add_argument("--changes", type=int, default=9, metavar="N", help="default: %(default)s")
    options = parser.parse_args(arguments)
    roots = {"this": ROOT, **({"other": options.against.resolve()} if options.against else {})}
    kinds = {"seed": new_seed, "level": new_level, "datum": new_datum}
    with ExitStack() as stack:
        servers = {name: stack.enter_context(started(root)) for name, root in roots.items()}
        print(HEADER, flush=True)
        tabs = {
            name: stack.enter_context(Session(server.address, query=STUDY)).open()
            for name, server in servers.items()
        }
        for tab in tabs.values():
            tab.change(live=True)
        for kind, change in kinds.items():
            if kind == "datum":
                for tab in tabs.values():
                    tab.open("data")
            rows: dict[str, list[tuple[float, float]]] = {name: [] for name in servers}
            for k in range(options.changes + WARM_UP):
                for name, server in servers.items():
                    rows[name].append(cost(server, tabs[name], change, k + 1))
            for name, values in rows.items():
                cpu, sent = np.array(values[WARM_UP:]).T
                cells = 1000 * np.median(cpu), 1000 * cpu.min(), np.median(sent) / 1000
                print(f"| {kind} | {name} | {' | '.join(f'{c:.0f}' for c in cells)} |", flush=True)


def cost(
    server: Server, tab: Session, change: Callable[[Session, int], object], k: int
) -> tuple[float, float]:
    """Return processor seconds of the server and bytes sent for the change number k."""
    before, tab.received = cpu_seconds(server.process.pid), []
    change(tab, k)
    spent = cpu_seconds(server.process.pid) - before, sum(map(len, tab.received))
    tab.settle()  # after a datum, a run with all data
    return spent


def new_seed(tab: Session, k: int) -> None:
    """Change the seed."""
    tab.change(seed=k)


def new_level(tab: Session, k: int) -> None:
    """Change the wavelet level, with a seed whose results are not kept yet."""
    tab.change(wavelet_level=str(1 + k % 3), seed=1000 + k)


def new_datum(tab: Session, k: int) -> None:
    """Draw a datum in a new cell, as the canvas does."""
    edit = {"seq": tab.part("editor")["ack"] + 1, "set": [[19 * k % 256, 101 * k % 256, k % 2]]}
    tab.report("editor", "edits", [edit])


if __name__ == "__main__":
    sys.exit(main())
