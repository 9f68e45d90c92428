"""The command `warm-up`, which compiles the kernels before the first run."""

import sys
import time

import click

from ccwsim.cli.options import quiet


@click.command("warm-up")
@quiet
def command(quiet: bool) -> None:
    """Compile the kernels now, for instance while an image is built.

    Compiles and stores all kernels that usual studies and the dashboard's first screen need, on up
    to three cores. Stored kernels are not compiled again.
    """
    from ccwsim.cli.progress import ProgressLine
    from ccwsim.engine import compilation
    from ccwsim.engine.kernel_cache import KERNEL_FOLDER
    from ccwsim.experiments.warm_up import usual_work

    start = time.perf_counter()
    requests = []
    for name, work in usual_work().items():
        needed = compilation.ask_for(work, compilation.SOON)
        requests += [request for request in needed if request not in requests]
        if not quiet:
            click.echo(f"{len(needed):3} kernels to compile  {name}", err=True)
    line = None if quiet else ProgressLine(1, sys.stderr)
    compilation.await_all(requests, lambda: line(0.0, 0) if line else None)
    if line is not None:
        line.close()
        seconds = time.perf_counter() - start
        click.echo(
            f"{len(requests)} compiled in {seconds:.1f} s; compiled kernels are stored in "
            f"{KERNEL_FOLDER}",
            err=True,
        )
