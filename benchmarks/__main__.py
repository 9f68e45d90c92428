"""Time and memory of a realization: ``python -m benchmarks``.

Each value is the median of several realizations of channels on 512 × 512 cells, with T 32, OR 8, K
20 and one thread. The same algorithm in plain NumPy and Python is measured in the same run. Rows
with data have 400 hard data and are compared with the row without data at the same level.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

from benchmarks.cases import (
    CASES,
    N_REALIZATIONS,
    N_REFERENCE,
    Row,
    compile_kernels,
    load_study,
    measure as measure_case,
)
from benchmarks.table import load, machine, save, table, warnings


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure the cases, print the table, and store the table if the user names a file."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog="To compare two checkouts: run with --json FILE in one, --against FILE in the other."
        " With CCWSIM_DATA set to a folder of published data, the paper's image and data are used.",
    )
    parser.add_argument("--json", type=Path, metavar="FILE", help="store the measurements")
    parser.add_argument("--against", type=Path, metavar="FILE", help="compare with a stored file")
    parser.add_argument(
        "--realizations",
        type=int,
        default=N_REALIZATIONS,
        metavar="N",
        help="number of realizations in each row (default: %(default)s)",
    )
    options = parser.parse_args(arguments)
    if options.realizations < 1:
        parser.error("--realizations must be at least 1")
    try:
        other, before = load(options.against) if options.against else ("", [])
    except (OSError, ValueError, KeyError, TypeError) as error:
        parser.error(f"{options.against} has no measurements; give a file of --json ({error})")
    image = load_study()[0]
    name = f"{image.name} ({image.digest})"
    print(f"{name}; {machine()}", flush=True)
    rows = measured(options.realizations)
    print(table(rows, before))
    for line in warnings(name, rows, other, before) if before else ():
        print(line)
    if options.json:
        save(options.json, name, rows)
    return 0


def measured(n_realizations: int) -> list[Row]:
    """Return one row for each case, each measured in a separate process."""
    with ProcessPoolExecutor(1, get_context("spawn"), max_tasks_per_child=1) as fresh:
        fresh.submit(compile_kernels).result()
        rows = []
        for k, case in enumerate(CASES):
            if sys.stderr.isatty():
                print(f"\rmeasuring {k + 1} of {len(CASES)}", end="\r", file=sys.stderr, flush=True)
            rows.append(fresh.submit(measure_case, case, n_realizations, N_REFERENCE).result())
        return rows


if __name__ == "__main__":
    sys.exit(main())
