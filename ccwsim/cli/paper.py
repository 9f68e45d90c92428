"""The command `paper`: the experiments of the paper, run again, to one report."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path
from typing import Any

from ccwsim.cli.progress import ProgressLine
from ccwsim.cli.stopping import stop_on_interrupt
from ccwsim.model.errors import CCWSIMError
from ccwsim.paper import (
    EXPERIMENTS,
    FULL,
    QUICK,
    Finished,
    document_of,
    inputs_in,
    reproduce,
    summary,
    verdict_of,
    with_largest_grid,
)
from ccwsim.report import write_report

EXAMPLES = """\
examples:
  python -m ccwsim paper --output report.html
  python -m ccwsim paper --data DIR --output report.html --largest-grid 5000
  python -m ccwsim paper --quick --output quick.html
"""


def add_command(commands: Any) -> None:
    """Add `paper` and its options to the commands."""
    parser = commands.add_parser(
        "paper", help="run the paper's experiments and write a report",
        usage="python -m ccwsim paper --output FILE [options]",
        description="Run the experiments of the paper (sections 5.1 to 5.9) and write one HTML "
        "report: each figure and table next to what the paper says, with agreement or difference "
        "in words. It takes some minutes.",
        epilog=EXAMPLES, formatter_class=argparse.RawDescriptionHelpFormatter, allow_abbrev=False,
    )  # fmt: skip
    parser.add_argument(
        "--data", metavar="DIR",
        help="folder with the authors' files, in folders paper and reference (default: the bundled "
        "training images and data)",
    )  # fmt: skip
    parser.add_argument("-o", "--output", required=True, metavar="FILE", help="the report, .html")
    parser.add_argument(
        "--quick", action="store_true",
        help="fewer realizations and smaller grids: seconds instead of minutes",
    )  # fmt: skip
    parser.add_argument(
        "--largest-grid", type=int, metavar="N",
        help="time grids up to N × N cells (default: 2500; the paper's largest is 5000)",
    )  # fmt: skip
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="default: 0")
    parser.add_argument(
        "-q", "--quiet", action="store_true", help="say nothing unless something is wrong"
    )
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Run the experiments and write the report; return 0, or 130 where Ctrl-C stopped it.

    Raises
    ------
    CCWSIMError
        For a folder without the authors' files and a report that cannot be written.
    """
    check_report(options.output)
    inputs = inputs_in(options.data)
    extent = with_largest_grid(QUICK if options.quick else FULL, options.largest_grid)
    progress = None
    if not options.quiet:
        progress = ProgressLine(len(EXPERIMENTS), sys.stderr, "experiments")

    def tell(finished: Finished) -> None:
        if progress:
            progress.clear()
            print(f"{finished.experiment.title}: {verdict_of(finished)}", file=sys.stderr)

    with stop_on_interrupt() as stopped:
        try:
            found = reproduce(
                inputs, extent, options.seed, progress, stopped, on_finished=tell
            )  # fmt: skip
        finally:
            if progress:
                progress.clear()
    if found.finished:
        write_report(options.output, document_of(found))
    if found.stopped:
        left = f"; written: {options.output}" if found.finished else "; nothing is written"
        done = f"stopped after {len(found.finished)} of {len(EXPERIMENTS)} experiments"
        print(f"ccwsim: {done}{left}", file=sys.stderr)
        return 130
    if not options.quiet:
        print(f"{summary(found)}\nWritten: {options.output}", file=sys.stderr)
    return 0


def check_report(path: str) -> None:
    """Say before a long run that the report could not be written after it.

    Raises
    ------
    CCWSIMError
        For another ending than .html, or a folder that is not there or may not be written.

    Examples
    --------
    >>> check_report("report.pdf")
    Traceback (most recent call last):
        ...
    ccwsim.model.errors.CCWSIMError: report.pdf: the report is HTML; call it report.html
    """
    if Path(path).suffix.lower() not in (".html", ".htm"):
        raise CCWSIMError(f"{path}: the report is HTML; call it {Path(path).stem or 'report'}.html")
    folder = Path(path).parent
    if not folder.is_dir():
        raise CCWSIMError(f"{path}: there is no folder {folder}; make it first")
    if Path(path).is_dir() or not os.access(folder, os.W_OK):
        raise CCWSIMError(f"{path} cannot be written; choose another place")
