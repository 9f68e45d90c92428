"""The first run on a fresh machine: ``python -m benchmarks.startup``.

Runs the default study with a copy of the package without compiled kernels, then with a copy of this
copy, and then after a change of the dates of the files. The columns:

- CPU seconds of all processes
- CPU seconds of the longest path: the simulating process plus the busiest compiling process
- wall seconds, which mean little on a busy machine
- functions compiled in the simulating process
- functions newly stored on disk

With --against DIR, two checkouts are measured alternately. The benchmark needs Linux, because /proc
has the CPU time of each process.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).parents[1]
LOOK_SECONDS = 0.2
"""Seconds between two measurements of the CPU time of processes."""
FIRST_RUN = """
from numba.core import event
from ccwsim import Parameters, simulate
from ccwsim.datasets import load, load_hard_data
data = load_hard_data("channels_400_data")
with event.install_recorder("numba:compile") as compiled:
    e = simulate(load("channels"), (512, 512), Parameters(), data, n_realizations=12, seed=0)
print(len(compiled.buffer) // 2, e.digest)
"""


@dataclass(frozen=True)
class Measured:
    """Measurements of a first run."""

    cpu: float
    longest_path: float
    wall: float
    n_here: int
    n_kept: int
    digest: str


def first_run(folder: Path) -> Measured:
    """Simulate the default study with the package in a folder."""
    own = {"PYTHONPATH": str(folder), "XDG_CACHE_HOME": str(folder / "home")}
    before, start = _kept(folder), time.perf_counter()
    with subprocess.Popen(
        [sys.executable, "-c", FIRST_RUN],
        cwd=folder,
        env={**os.environ, **own},
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        seconds: dict[int, float] = {}
        while process.poll() is None:
            seconds |= _cpu_seconds(process.pid)
            time.sleep(LOOK_SECONDS)
        assert process.stdout is not None
        n_here, digest = process.stdout.read().split()
    wall = time.perf_counter() - start
    others = [t for number, t in seconds.items() if number != process.pid]
    longest = seconds[process.pid] + max(others, default=0.0)
    n_kept = len(_kept(folder) - before)
    return Measured(sum(seconds.values()), longest, wall, int(n_here), n_kept, digest)


def _cpu_seconds(number: int) -> dict[int, float]:
    """Return the CPU seconds of a process and its child processes, by process number."""
    seconds = {}
    for file in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = file.read_text().rpartition(")")[2].split()
        except OSError:  # the process has ended
            continue
        if int(file.parent.name) == number or int(fields[1]) == number:
            ticks = int(fields[11]) + int(fields[12])
            seconds[int(file.parent.name)] = ticks / os.sysconf("SC_CLK_TCK")
    return seconds


def _kept(folder: Path) -> set[tuple[str, int]]:
    """Return the files of compiled kernels, with their dates."""
    return {(str(file), file.stat().st_mtime_ns) for file in folder.rglob("*.nbc")}


def measure(checkout: Path) -> dict[str, Measured]:
    """Return rows for a fresh copy, for a copy of the fresh copy, and for changed file dates."""
    with TemporaryDirectory() as temporary:
        fresh, copy = Path(temporary, "fresh"), Path(temporary, "copy")
        ignored = shutil.ignore_patterns("__pycache__")
        shutil.copytree(checkout / "ccwsim", fresh / "ccwsim", ignore=ignored)
        rows = {"nothing compiled": first_run(fresh)}
        shutil.copytree(fresh, copy)
        rows["copied"] = first_run(copy)
        for file in copy.rglob("*.py"):
            os.utime(file)
        rows["other dates"] = first_run(copy)
        return rows


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.startup", description=__doc__)
    parser.add_argument("--against", type=Path, metavar="DIR", help="another checkout")
    parser.add_argument("--rounds", type=int, default=1, metavar="N")
    options = parser.parse_args(arguments)
    print("| checkout | kernels | CPU s | longest path, CPU s | wall s | compiled here | kept |")
    print("|---|---|---|---|---|---|---|")
    for _ in range(options.rounds):
        for checkout in filter(None, (ROOT, options.against)):
            for name, row in measure(checkout).items():
                print(
                    f"| {checkout.name} | {name} | {row.cpu:.1f} | {row.longest_path:.1f} "
                    f"| {row.wall:.1f} | {row.n_here} | {row.n_kept} |",
                    flush=True,
                )


if __name__ == "__main__":
    main()
