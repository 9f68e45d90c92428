"""The command `flow`: effective conductivity of realizations, and files for flow programs."""

from __future__ import annotations

import json
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import click

from ccwsim.cli.inputs import input_file, options_in, options_in_messages
from ccwsim.cli.options import EPILOGS, output_file, quiet
from ccwsim.model import CCWSIMError, FromValues, shown

if TYPE_CHECKING:
    from ccwsim.flow import EffectiveK
    from ccwsim.flow.answers import Heads

NO_SIDES = (
    "A side has no active cell, so heads are fixed along the outline of the active cells, linear "
    "along {axis} between its ends; --heads changes this."
)


@click.command(epilog=EPILOGS["flow"], options_metavar="-k FACIES=K … [OPTIONS]")
@click.argument("realizations", metavar="FILE", type=click.Path())
@options_in({"Other options": ["flow"]})
@quiet
@options_in_messages(["flow"])
def command(
    realizations: str, conductivity: tuple[tuple[int | str, float], ...], unit: str | None,
    values_are: str | None, axis: str | None, heads: str | None, thickness: float,
    anisotropy: float, modflow: str | None, grdecl: str | None, output: str | None,
    as_json: bool, quiet: bool,
) -> None:  # fmt: skip
    """Solve steady flow through the realizations of FILE, written by `ccwsim simulate`.

    Prints the effective conductivity of the realizations along an axis, with its bounds and that
    of the training image.
    """
    from ccwsim.io.atomic import check_output, format_of, write_bytes
    from ccwsim.io.formats.csv_table import csv_as_bytes
    from ccwsim.io.formats.rasters import metres_per_unit

    unit, axis = unit or "m/s", axis or "x"
    values = FromValues(values_are == "log-K") if values_are else dict(conductivity)
    if bool(values_are) == bool(conductivity):
        raise CCWSIMError("give either -k FACIES=K for each facies or --values-are, and not both")
    if modflow:
        if axis == "z":
            raise CCWSIMError("--modflow writes models with heads along x or y; leave out --axis z")
        check_output(modflow, "flopy")
    if grdecl:
        check_output(grdecl, format_of(grdecl, None, ["grdecl"]))
    if output and output != "-":
        check_output(output, "csv")

    from ccwsim import flow, io
    from ccwsim.flow.answers import heads_option, usual_heads

    e = io.read_realizations(input_file(realizations))
    if modflow or grdecl:
        metres_per_unit(e.grid.crs)  # refuses degrees
    ends = usual_heads(e.study.active_mask, axis) if heads is None else heads_of(heads, axis)
    effective = flow.effective_k(e, values, axis, heads=ends, anisotropy=anisotropy)
    if not quiet:
        if heads is None and isinstance(ends, flow.Edge):
            click.echo(NO_SIDES.format(axis=axis), err=True)
        if not as_json:
            click.echo(conductivity_summary(effective, unit), err=output == "-")
    written = [path for path in (output, modflow) if path]
    options: dict[str, Any] = {"unit": unit, "anisotropy": anisotropy, "thickness": thickness}
    head, lines = effective.table()
    if as_json:
        click.echo(json.dumps([dict(zip(head, line, strict=True)) for line in lines]))
    if output:
        write_bytes(output_file(output), csv_as_bytes(head, lines))
    if modflow:
        io.to_flopy(e, values, modflow, **heads_option(ends, axis), **options)
    if grdecl:
        written += map(str, io.write_grdecl(grdecl, e, values, **options))
    if not quiet:
        for path in written:
            click.echo(f"Written: {path}", err=True)


def heads_of(text: str, axis: str) -> Heads:
    """Convert the text `[edge,]H1,H2[,X1,Y1,X2,Y2]` to heads at sides or along the outline."""
    from ccwsim.flow import Edge

    first, *rest = (part.strip() for part in text.split(","))
    is_edge = first == "edge"
    with suppress(ValueError):
        numbers = [float(part) for part in (rest if is_edge else [first, *rest])]
        if is_edge and len(numbers) in (0, 1, 2):
            return Edge(numbers or (1.0, 0.0), axis)
        if is_edge and len(numbers) == 6:
            return Edge(numbers[:2], (numbers[2:4], numbers[4:]))
        if len(numbers) == 2:
            return numbers[0], numbers[1]
    raise CCWSIMError(
        f"--heads {shown(text)} must be two heads, such as 12,7, or edge,12,7 along the outline"
    )


def conductivity_summary(effective: EffectiveK, unit: str) -> str:
    """Return a text: quantiles and bounds of the effective conductivity, and that of the image."""
    import numpy as np

    low, middle, high = np.quantile(effective.each, [0.1, 0.5, 0.9])
    return (
        f"Effective conductivity of {len(effective.each)} realization"
        f"{'s' if len(effective.each) > 1 else ''}: 10 % are below {low:.4g}, 50 % below "
        f"{middle:.4g}, 90 % below {high:.4g} {unit}.\n"
        f"Bounds (harmonic and arithmetic mean): {effective.harmonic.mean():.4g} and "
        f"{effective.arithmetic.mean():.4g} {unit}. Training image: {effective.image:.4g} {unit}."
    )
