"""The command `paper`, which repeats the experiments of the paper and writes one report."""

import os
import sys
from pathlib import Path

import click

from ccwsim import CCWSIMError
from ccwsim.cli.inputs import options_in
from ccwsim.cli.options import EPILOGS, quiet
from ccwsim.model import duration
from ccwsim.system.whole_files import check_writable


@click.command(epilog=EPILOGS["paper"])
@options_in({"Other options": ["paper"]})
@quiet
def command(
    data: str | None,
    output: str,
    quick: bool,
    largest_grid: int | None,
    seed: int | None,
    quiet: bool,
) -> int:
    """Run the paper's experiments and write a report.

    Runs the experiments of the paper (sections 5.1 to 5.9) in some minutes. For each figure and
    table, the HTML report shows our result beside the paper's, with a verdict.
    """
    if (path := Path(output)).suffix.lower() not in (".html", ".htm"):
        raise CCWSIMError(f"{path}: the report is HTML; call it {path.stem or 'report'}.html")
    check_writable(output)
    from ccwsim.cli.progress import ProgressLine, stop_on_signals
    from ccwsim.paper import reproduction as paper
    from ccwsim.paper.experiment import FILES_VARIABLE, FULL, QUICK, inputs_in
    from ccwsim.report.document import write_report

    inputs = inputs_in(data or os.environ.get(FILES_VARIABLE) or None)
    extent = paper.with_largest_grid(QUICK if quick else FULL, largest_grid)
    n = len(paper.EXPERIMENTS)
    progress = None if quiet else ProgressLine(n, sys.stderr, "experiments")

    def report(finished: paper.Finished) -> None:
        if progress:
            progress.write(f"{finished.experiment.title}: {paper.verdict_of(finished)}")

    with stop_on_signals() as stopped:
        try:
            if progress:
                expected = duration(paper.expected_duration(inputs, extent), rough=True)
                progress.write(f"{n} experiments, about {expected} on this machine")
            reproduction = paper.reproduce(
                inputs, extent, seed or 0, progress, stopped, on_finished=report
            )
        finally:
            if progress:
                progress.close()
    if reproduction.finished:
        write_report(output, paper.document_of(reproduction))
    if reproduction.stopped:
        output_note = f"; written: {output}" if reproduction.finished else "; nothing is written"
        done = f"stopped after {len(reproduction.finished)} of {n} experiments"
        click.echo(f"ccwsim: {done}{output_note}", err=True)
        return stopped.exit_code
    if not quiet:
        click.echo(f"{paper.reproduction_summary(reproduction)}\nWritten: {output}", err=True)
    return 0
