"""The option `--scheduler`: on the workers of a Dask cluster instead of threads of this machine."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from ccwsim.model.errors import CCWSIMError
from ccwsim.run.executors import connect


def add_scheduler_option(group: Any) -> None:
    """Add `--scheduler` to the options of a run."""
    group.add_argument(
        "--scheduler", metavar="ADDRESS",
        help="simulate on the workers of a Dask cluster, such as tcp://host:8786, instead of "
        "threads of this machine (needs requirements-dask.txt)",
    )  # fmt: skip


@contextmanager
def executor_of(options: argparse.Namespace) -> Iterator[Any]:
    """Yield the client of the scheduler of a command line, None where it names none.

    Raises
    ------
    CCWSIMError
        Where Dask is not installed, the scheduler does not answer, or threads are asked for too.

    Examples
    --------
    >>> parser = argparse.ArgumentParser()
    >>> add_scheduler_option(parser)
    >>> with executor_of(parser.parse_args([])) as executor:
    ...     executor is None
    True
    """
    if options.scheduler is None:
        yield None
        return
    if options.workers is not None:
        raise CCWSIMError("--workers counts threads here; leave it out with --scheduler")
    client = connect(options.scheduler)
    try:
        yield client
    finally:
        client.close()
