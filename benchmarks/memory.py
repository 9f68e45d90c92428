"""Memory of a hosted demo on one core: ``python -m benchmarks.memory``.

A server with the limits of a hosted demo (`HOSTED`) starts on one core without compiled kernels. A
browser on the other cores opens the first page, runs a study with other parameters, and then keeps
several tabs open at once, each with its own study, a run and the page Validate. The table has the
peak memory of all processes of the server and the seconds of each part. Memory is the proportional
set size (PSS), read several times a second. The benchmark needs Linux and chromium.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

HOSTED = {
    "CCWSIM_MEMORY_MB": "900",
    "CCWSIM_MAX_CELLS": "2e7",
    "CCWSIM_MAX_DATA": "10000",
    "CCWSIM_HISTORY_MB": "32",
    "CCWSIM_UPLOADS_MB": "64",
}
"""Environment of a hosted demo with 1 GB of memory; docs/server.md lists the same variables."""
STUDIES = (
    "ti=channels&grid=512x512&seed=11",
    "ti=channels&grid=200x150&data=none&seed=12",
    "ti=fractures&grid=256x256&data=none&seed=13",
    "ti=barchans&grid=300x200&data=none&seed=14",
    "ti=stone_wall&grid=256x256&data=none&seed=15",
)
"""Studies of the tabs that are open at once."""
CURRENT = "() => !document.querySelector('i.results-outdated')"
"""Whether the results belong to the study."""
EVERY = 0.2
"""Seconds between two measurements of memory."""


def peak_megabytes() -> float | None:
    """Return the peak of the resident memory in MB, or None if the system does not report a peak.

    Examples
    --------
    >>> peak_megabytes() is None or peak_megabytes() > 10
    True
    """
    status = Path("/proc/self/status")
    if status.exists():  # ru_maxrss would include the memory of the parent process
        lines = [line for line in status.read_text().splitlines() if line.startswith("VmHWM")]
        if lines:
            return int(lines[0].split()[1]) / 1024
    try:
        import resource
    except ImportError:
        return None
    unit = 2**20 if sys.platform == "darwin" else 2**10
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / unit


def processes_of(number: int) -> list[int]:
    """Return the numbers of a process and of all processes that it has started."""
    parents = {}
    for file in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = file.read_text().rpartition(")")[2].split()
        except OSError:  # the process has ended
            continue
        parents[int(file.parent.name)] = int(fields[1])
    family = [number]
    for member in family:
        family += [child for child, parent in parents.items() if parent == member]
    return family


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.memory", description=__doc__)
    parser.add_argument(
        "--tabs", type=int, default=len(STUDIES), metavar="N", help="default: %(default)s"
    )
    parser.add_argument("--compiled", action="store_true", help="use the kernels of this user")
    options = parser.parse_args(arguments)
    print("| part | peak MB | processes | s |\n|---|--:|--:|--:|", flush=True)
    with hosted(options.compiled) as (address, watcher):
        for name, action in parts(address, options.tabs):
            watcher.restart()
            start = time.monotonic()
            action()
            seconds = time.monotonic() - start
            peak, n_processes = watcher.peak()
            print(f"| {name} | {peak:.0f} | {n_processes} | {seconds:.1f} |", flush=True)


@contextmanager
def hosted(compiled: bool) -> Iterator[tuple[str, Any]]:
    """Start the server of a hosted demo; yield its address and the watcher of its memory."""
    from benchmarks.soak import Watcher
    from ccwsim.system.memory import proportional_memory
    from tests.browser.served import started

    class MemoryWatcher(Watcher):
        """Records the peak memory of a process with all processes that it has started."""

        def __init__(self, number: int) -> None:
            super().__init__(EVERY)
            self._number = number
            self.restart()

        def restart(self) -> None:
            self._peak = 0, 0
            self.look()

        def look(self) -> None:
            family = processes_of(self._number)
            used = sum(proportional_memory(member) for member in family)
            self._peak = max(self._peak, (used, len(family)))

        def peak(self) -> tuple[float, int]:
            """Return the peak in MB, and the number of processes at that time."""
            used, n_processes = self._peak
            return used / 1e6, n_processes

    first, *others = sorted(os.sched_getaffinity(0))
    with TemporaryDirectory() as folder:
        os.environ.update(HOSTED)
        if not compiled:
            os.environ["XDG_CACHE_HOME"] = folder
        os.sched_setaffinity(0, {first})
        with started() as server:
            os.sched_setaffinity(0, others or {first})
            with MemoryWatcher(server.process.pid) as watcher:
                yield server.address, watcher


def parts(address: str, n_tabs: int) -> Iterator[tuple[str, Any]]:
    """Yield name and function of each part of the visit."""
    from benchmarks.browser import DRAWN
    from tests.browser.hands import SLOW, at_rest, fill
    from tests.browser.served import browser

    with browser() as chromium:
        # Five pages on busy cores take longer than a test waits.
        patience = 5 * SLOW

        def opened(query: str = "") -> Any:
            page = chromium.new_context().new_page()
            page.goto(f"{address}/simulate?{query}", wait_until="commit", timeout=patience)
            return page

        def wait(page: Any, condition: str) -> None:
            page.bring_to_front()  # a page behind others is not drawn
            page.wait_for_function(condition, timeout=patience)

        def run(page: Any) -> None:
            at_rest(page)
            if page.locator("i.results-outdated").count():  # a short run begins without the button
                page.locator(".st-key-run").get_by_role("button", name="Run").click()
            wait(page, CURRENT)
            wait(page, DRAWN)

        def first_picture() -> None:
            pages.append(opened())
            pages[0].wait_for_selector(".st-key-map_e_type canvas", timeout=patience)

        def computed() -> None:
            wait(pages[0], DRAWN)

        def other_parameters() -> None:
            fill(pages[0], "template_size", 40)
            fill(pages[0], "n_realizations", 20)
            run(pages[0])

        def together() -> None:
            tabs.extend(opened(query) for query in STUDIES[:n_tabs])
            for tab in tabs:
                wait(tab, DRAWN)

        def runs_together() -> None:
            for k, tab in enumerate(tabs):
                tab.bring_to_front()
                fill(tab, "seed", 100 + k)
                at_rest(tab)
                button = tab.locator(".st-key-run").get_by_role("button", name="Run")
                if tab.locator("i.results-outdated").count():
                    button.click()
            for tab in tabs:
                run(tab)

        def validated_together() -> None:
            for tab in tabs:
                tab.goto(tab.url.replace("/simulate", "/validate"), wait_until="commit")
            for tab in tabs:
                wait(tab, DRAWN.replace(".st-key-charts ", ""))

        pages: list[Any] = []
        tabs: list[Any] = []
        yield "first picture", first_picture
        yield "kernels compiled, charts drawn", computed
        yield "own run: template 40, 20 realizations", other_parameters
        yield f"{n_tabs} tabs opened at once", together
        yield f"{n_tabs} tabs, a run in each", runs_together
        yield f"{n_tabs} tabs, *Validate* in each", validated_together


if __name__ == "__main__":
    main()
