"""The command `flow`: effective conductivity of realizations, and files for flow programs."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import click

from ccwsim.cli.options import check_writable, quiet
from ccwsim.model.errors import CCWSIMError

if TYPE_CHECKING:
    from ccwsim.flow import EffectiveK

EPILOG = """\
\b
examples:
  ccwsim flow out.npz -k sand=1e-4 -k mud=1e-8
  ccwsim flow out.npz -k sand=1e-4 -k mud=1e-8 --axis y --output k.csv
  ccwsim flow out.npz -k 1=1e-4 -k 0=1e-8 --modflow model --grdecl grid.grdecl
"""


@click.command(epilog=EPILOG, options_metavar="-k FACIES=K … [OPTIONS]")
@click.argument("realizations", metavar="FILE")
@click.option(
    "-k",
    "--conductivity",
    multiple=True,
    required=True,
    metavar="FACIES=K",
    help="conductivity of a facies, by name or code; repeat the option for each facies",
)
@click.option(
    "--unit", type=click.Choice(["m/s", "m/d"]), default="m/s", help="unit of K (default m/s)"
)
@click.option("--axis", type=click.Choice(["x", "y", "z"]), default="x", help="direction of flow")
@click.option(
    "--anisotropy", type=float, default=1.0, metavar="RATIO", help="vertical / horizontal K"
)
@click.option(
    "--modflow",
    metavar="FOLDER",
    help="write a MODFLOW 6 model of the first realization, with heads of 1 and 0 at the sides "
    "across the axis x or y (needs the extra modflow)",
)
@click.option(
    "--grdecl",
    metavar="FILE",
    help="write the grid to FILE, and facies and permeability of each realization to files beside",
)
@click.option("-o", "--output", metavar="FILE", help="write the effective conductivities as CSV")
@quiet
def command(
    realizations: str,
    conductivity: tuple[str, ...],
    unit: str,
    axis: str,
    anisotropy: float,
    modflow: str | None,
    grdecl: str | None,
    output: str | None,
    quiet: bool,
) -> None:
    """Solve steady flow through the realizations of FILE, written by `ccwsim simulate`.

    Prints the effective conductivity of the realizations along an axis, with its bounds and that
    of the training image.
    """
    values = dict(map(_value, conductivity))
    if modflow is not None and axis == "z":
        raise CCWSIMError("--modflow writes models with heads along x or y; leave out --axis z")
    for path in filter(None, (output, grdecl)):
        check_writable(path)
    from ccwsim import flow, io
    from ccwsim.io.atomic import write_bytes
    from ccwsim.io.formats.csv_table import csv_as_bytes

    e = io.read_realizations(realizations)
    found = flow.effective_k(e, values, axis, anisotropy=anisotropy)
    if not quiet:
        click.echo(summary(found, unit))
    written = [path for path in (output, modflow) if path is not None]
    if output is not None:
        write_bytes(output, csv_as_bytes(*found.table()))
    if modflow is not None:
        ends: dict[str, Any] = {"west_east" if axis == "x" else "south_north": (1.0, 0.0)}
        io.to_flopy(e, values, modflow, unit=unit, anisotropy=anisotropy, **ends)
    if grdecl is not None:
        options = {"unit": unit, "anisotropy": anisotropy}
        written += map(str, io.write_grdecl(grdecl, e, values, **options))
    if not quiet:
        for path in written:
            click.echo(f"Written: {path}", err=True)


def _value(text: str) -> tuple[int | str, float]:
    """Convert the text FACIES=K to a name or code and a number."""
    name, _, number = text.rpartition("=")
    try:
        value = float(number)
    except ValueError:
        value = float("nan")
    if not name.strip() or value != value:
        raise click.BadParameter(f"{text!r} must be a facies and its conductivity: sand=1e-4")
    name = name.strip()
    return int(name) if re.fullmatch(r"-?\d{1,15}", name, re.ASCII) else name, value


def summary(found: EffectiveK, unit: str) -> str:
    """Return the quantiles of the effective conductivity, with bounds and image."""
    import numpy as np

    low, middle, high = np.quantile(found.each, [0.1, 0.5, 0.9])
    return (
        f"Effective conductivity of {len(found.each)} realizations: P10 {low:.4g}, P50 "
        f"{middle:.4g}, P90 {high:.4g} {unit}.\n"
        f"Bounds (harmonic and arithmetic mean): {found.harmonic.mean():.4g} and "
        f"{found.arithmetic.mean():.4g} {unit}. Training image: {found.image:.4g} {unit}."
    )
