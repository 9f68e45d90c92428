"""The command `simulate`: realizations of a training image, to files."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ccwsim.cli.data_options import add_data_options, add_grid_options
from ccwsim.cli.image_options import add_image_options
from ccwsim.cli.parameter_options import add_parameter_options
from ccwsim.cli.progress import ProgressLine
from ccwsim.cli.project_option import add_project_option, inputs_of
from ccwsim.cli.scheduler_option import add_scheduler_option, executor_of
from ccwsim.cli.stopping import stop_on_interrupt
from ccwsim.cli.summary import summary
from ccwsim.io import FORMATS, write_realizations
from ccwsim.io.atomic import format_of
from ccwsim.model.ensemble import Ensemble
from ccwsim.model.errors import Cancelled, CCWSIMError
from ccwsim.run.simulation import simulate

STREAMED = "npy"
"""The format that is written during the run instead of after it."""

EXAMPLES = """\
examples:
  python -m ccwsim simulate channels --grid 512x512 --output out.npz
  python -m ccwsim simulate channels --hard-data channels_400_data --realizations 20 \\
      --workers 2 --output out.npz --output out.png
  python -m ccwsim simulate ti.png --grid 640x480 --cell-size 10 10 --origin 5000 0 \\
      --hard-data wells.csv --on-outside drop --template 48 --output out.sgems
  python -m ccwsim simulate --project study.ccwsim --output out.npz
"""


def add_command(commands: Any) -> None:
    """Add `simulate` and its options to the commands."""
    parser = commands.add_parser(
        "simulate", help="simulate realizations of a training image",
        usage="python -m ccwsim simulate (TI | --project FILE) [options]",
        description="Simulate realizations that look like a training image and honour hard data.",
        epilog=EXAMPLES, formatter_class=argparse.RawDescriptionHelpFormatter, allow_abbrev=False,
    )  # fmt: skip
    add_image_options(parser)
    add_project_option(parser)
    add_grid_options(parser)
    add_data_options(parser)
    add_parameter_options(parser)
    group = parser.add_argument_group("run")
    group.add_argument("--realizations", type=int, metavar="N", help="how many (default: 1)")
    group.add_argument(
        "--seed", type=int, metavar="N",
        help="the same seed gives the same realizations, for any number of workers (default: 0)",
    )  # fmt: skip
    group.add_argument(
        "--workers", type=int, metavar="N", help="threads (default: as many as there are cores)"
    )
    add_scheduler_option(group)
    group.add_argument(
        "-o", "--output", action="append", default=[], metavar="FILE",
        help="where to write them, in the format of the ending: npz (everything), sgems, gslib or "
        "dat (one column a realization), png (all maps side by side), npy (facies codes, straight "
        "to disk: for more than memory holds); may be given several times",
    )  # fmt: skip
    group.add_argument(
        "-q", "--quiet", action="store_true", help="say nothing unless something is wrong"
    )
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Simulate, write and sum up; return 0, or 130 where Ctrl-C stopped it.

    Raises
    ------
    CCWSIMError
        For inputs that do not fit and files that cannot be read or written.
    """
    for output in options.output:
        check_output(output)
    streamed = streamed_output(options.output)
    given = inputs_of(options)
    _say(options, *given.notes)
    progress = None if options.quiet else ProgressLine(given.n_realizations, sys.stderr)
    with executor_of(options) as executor, stop_on_interrupt() as stopped:
        ensemble, message = None, ""
        try:
            ensemble = simulate(
                given.training_image, given.grid, given.parameters, given.hard_data,
                given.n_realizations, given.seed, options.workers, progress, stopped,
                executor=executor, out=streamed,
            )  # fmt: skip
        except Cancelled as cancelled:
            ensemble, message = cancelled.ensemble, str(cancelled)
        finally:
            if progress:
                progress.clear()
        if message:
            print(f"ccwsim: {message}", file=sys.stderr)
        if ensemble is not None:
            _write([path for path in options.output if path != streamed], ensemble)
            _say(options, summary(ensemble), *(f"Written: {path}" for path in options.output))
    return 130 if message else 0


def check_output(path: str) -> None:
    """Say before a long run that a file could not be written after it.

    Raises
    ------
    CCWSIMError
        For an ending that is no format, or a folder that is not there or may not be written.

    Examples
    --------
    >>> check_output("out.bmp")
    Traceback (most recent call last):
        ...
    ccwsim.model.errors.CCWSIMError: format 'bmp' cannot be written; choose one of dat, ...
    """
    format_of(path, None, (*FORMATS, STREAMED))
    folder = Path(path).parent
    if not folder.is_dir():
        raise CCWSIMError(f"{path}: there is no folder {folder}; make it first")
    if Path(path).is_dir() or not os.access(folder, os.W_OK):
        raise CCWSIMError(f"{path} cannot be written; choose another place")


def streamed_output(paths: Sequence[str]) -> str | None:
    """Return which file realizations go to as they are finished, if any does.

    Examples
    --------
    >>> streamed_output(["out.png", "out.npy"])
    'out.npy'
    """
    found = [path for path in paths if path.lower().endswith("." + STREAMED)]
    if len(found) > 1:
        raise CCWSIMError(f"give one .npy file, not {len(found)}: it is written during the run")
    return found[0] if found else None


def _write(paths: Sequence[str], ensemble: Ensemble) -> None:
    """Write all files that can be written, then complain of the others."""
    errors = []
    for path in paths:
        try:
            write_realizations(path, ensemble)
        except CCWSIMError as error:
            errors.append(str(error))
    if errors:
        raise CCWSIMError("; ".join(errors))


def _say(options: argparse.Namespace, *lines: str) -> None:
    if not options.quiet:
        for line in lines:
            print(line, file=sys.stderr)
