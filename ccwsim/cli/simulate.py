"""The command `simulate`, which writes realizations of a training image to files."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from statistics import median
from tempfile import gettempdir
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import click

from ccwsim.cli.inputs import image_and_data_options, inputs_of, options_in_messages
from ccwsim.cli.options import EPILOGS, GroupedCommand, output_file, quiet
from ccwsim.model import Cancelled, CCWSIMError, check_installed, refused

if TYPE_CHECKING:
    from ccwsim.model import Ensemble, Shape

STREAMED = "npy"  # file ending of the only format that is written during the run


@click.command(
    cls=GroupedCommand, epilog=EPILOGS["simulate"], options_metavar="[OPTIONS] --output FILE"
)
@image_and_data_options
@quiet
@options_in_messages(["guides", "parameters", "run"])
def command(**values: Any) -> int:
    """Simulate realizations that resemble a training image and honour hard data.

    TI is a file (picture, GeoTIFF, NetCDF, SGeMS, GSLIB, GRDECL, ESRI, CSV, NumPy, MATLAB, VTK and
    others) or the name of a bundled training image; --project reads all inputs of a study from a
    project file instead.

    Numbers along several axes are always in the order x, y, z: 640x480 means 640 columns along x
    and 480 rows along y, and a third number is the layers of a volume. x runs east, y north, z up.
    """
    options = SimpleNamespace(**values)
    check_outputs(options.output)
    streamed = streamed_output(options.output)
    if options.scheduler is not None:
        check_installed("distributed")
    inputs = inputs_of(options)
    shape, of_values = (
        (inputs.n_realizations, *inputs.grid.shape),
        bool(inputs.training_image.values),
    )
    check_outputs(options.output, shape, of_values)
    secondary = inputs.secondary
    _say(options, [*inputs.notes, *([f"Guides: {secondary.describe()}."] if secondary else [])])
    from ccwsim.cli.progress import ProgressLine, stop_on_signals
    from ccwsim.run.simulation import simulate

    progress = None if options.quiet else ProgressLine(inputs.n_realizations, sys.stderr)
    with executor_of(options) as executor, stop_on_signals() as stopped:
        ensemble, message = None, ""
        try:
            ensemble = simulate(
                inputs.training_image,
                inputs.grid,
                inputs.parameters,
                inputs.hard_data,
                n_realizations=inputs.n_realizations,
                seed=inputs.seed,
                n_workers=options.n_workers,
                progress=progress,
                cancel=stopped,
                executor=executor,
                out=streamed,
                secondary=secondary,
            )
        except Cancelled as cancelled:
            ensemble, message = cancelled.ensemble, str(cancelled)
        finally:
            if progress:
                progress.close()
        if message:
            click.echo(f"ccwsim: {message}", err=True)
        if ensemble is not None:
            others = [path for path in options.output if path != streamed]
            _write(others, ensemble, streamed is not None)
            if options.as_json:
                names = inputs.training_image.facies_names
                results = {
                    "seed": ensemble.seed,
                    "not_honoured": ensemble.n_mismatched.tolist(),
                    "proportions": dict(zip(names, ensemble.proportions.T.tolist(), strict=True)),
                }
                click.echo(json.dumps(results))
            _say(
                options,
                [ensemble_summary(ensemble), *(f"Written: {path}" for path in options.output)],
            )
    return stopped.exit_code if message else 0


@contextmanager
def executor_of(options: Any) -> Iterator[Any]:
    """Yield a client of the scheduler given in the command line, or None without a scheduler."""
    if options.scheduler is None:
        yield None
        return
    if options.n_workers is not None:
        raise CCWSIMError("--workers is a number of local threads; leave it out with --scheduler")
    from ccwsim.run.executors import connect

    client = connect(options.scheduler)
    try:
        yield client
    finally:
        client.close()


def check_outputs(
    paths: Sequence[str], shape: Shape | None = None, of_values: bool = False
) -> None:
    """Raise an error if n grids, `shape` (n, (nz,) ny, nx), cannot be written to some file."""
    from ccwsim.io.atomic import check_output, format_of
    from ccwsim.io.realizations import REALIZATION_FORMATS

    for path in filter("-".__ne__, paths):
        kind = format_of(path, None, (*REALIZATION_FORMATS, STREAMED))
        check_output(path, kind, shape, of_values)


def streamed_output(paths: Sequence[str]) -> str | None:
    """Return the file to which realizations are written during the run, or None."""
    streamed = [path for path in paths if path.lower().endswith("." + STREAMED)]
    if len(streamed) > 1:
        raise refused("one_npy_file", n=len(streamed))
    return streamed[0] if streamed else None


def ensemble_summary(e: Ensemble) -> str:
    """Return a summary of an ensemble: size, times, honoured data and proportions."""
    import numpy as np

    from ccwsim.model import describe_shape

    ti, n = e.training_image, e.hard_data.n
    milliseconds = 1e3 * median(e.cpu_seconds)
    size = describe_shape(e.grid.shape)
    lines = [
        f"{e.n} realization{'s' if e.n > 1 else ''} of {size} cells "
        f"({ti.name or 'training image'}, seed {e.seed}): {milliseconds:.0f} ms of CPU time each, "
        f"{e.wall_seconds:.1f} s in all."
    ]
    missed, forced = (int(counts.max(initial=0)) for counts in (e.n_mismatched, e.n_forced))
    if missed:
        mean = e.n_mismatched.mean()
        lines.append(f"Hard data: {mean:.1f} of {n} NOT honoured on average, at most {missed}.")
    elif n:
        tail = f"; at most {forced} of these data were forced as single cells" if forced else ""
        lines.append(f"Hard data: {n} of {n} honoured in every realization{tail}.")
    if e.values:
        image, values = ti.sorted_values, e.values_of()
        return "\n".join(
            [
                *lines,
                f"{ti.variable} (training image): mean {np.nanmean(values):.4g} "
                f"({image.mean():.4g}), standard deviation {np.nanstd(values):.4g} "
                f"({image.std():.4g}).",
            ]
        )
    shares = zip(ti.facies_names, e.proportions.mean(axis=0), ti.proportions, strict=True)
    parts = [
        f"{name} {100 * share:.1f} % ({100 * share_of_image:.1f} %)"
        for name, share, share_of_image in shares
    ]
    return "\n".join([*lines, f"Proportions (training image): {', '.join(parts)}."])


def _write(paths: Sequence[str], ensemble: Ensemble, is_saved: bool) -> None:
    """Write all files; if some cannot be written, save an npz and raise an error at the end."""
    from ccwsim.io import write_realizations

    errors = []
    for path in paths:
        try:
            write_realizations(output_file(path), ensemble, format="npz" if path == "-" else None)
            is_saved |= path.lower().endswith(("-", ".npz"))
        except Exception as error:
            errors.append(str(error) or f"{path}: {type(error).__name__}")
    if errors and not is_saved:
        rescue = Path(gettempdir(), f"{Path(paths[0]).stem}_rescue.npz")
        with suppress(CCWSIMError):
            write_realizations(rescue, ensemble)
            errors.append(f"all realizations are in {rescue}, which read_realizations reads")
    if errors:
        raise CCWSIMError("; ".join(errors))


def _say(options: Any, lines: Iterable[str]) -> None:
    if not options.quiet:
        for line in lines:
            click.echo(line, err=True)
