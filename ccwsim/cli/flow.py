"""The command `flow`: effective conductivity of realizations, and files for flow programs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from ccwsim.cli.inputs import options_in
from ccwsim.cli.options import EPILOGS, check_writable, quiet
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.extras import check_installed

if TYPE_CHECKING:
    from ccwsim.flow import EffectiveK


@click.command(epilog=EPILOGS["flow"], options_metavar="-k FACIES=K … [OPTIONS]")
@click.argument("realizations", metavar="FILE")
@options_in({"Other options": ["flow"]})
@quiet
def command(
    realizations: str, conductivity: tuple[tuple[int | str, float], ...], unit: str | None,
    axis: str | None, anisotropy: float, modflow: str | None, grdecl: str | None,
    output: str | None, quiet: bool,
) -> None:  # fmt: skip
    """Solve steady flow through the realizations of FILE, written by `ccwsim simulate`.

    Prints the effective conductivity of the realizations along an axis, with its bounds and that
    of the training image.
    """
    values, unit, axis = dict(conductivity), unit or "m/s", axis or "x"
    if modflow is not None and axis == "z":
        raise CCWSIMError("--modflow writes models with heads along x or y; leave out --axis z")
    if modflow is not None:
        check_installed("flopy")
    for path in filter(None, (output, grdecl)):
        check_writable(path)
    from ccwsim import flow, io
    from ccwsim.flow.answers import HEADS_ALONG
    from ccwsim.io.atomic import write_bytes
    from ccwsim.io.formats.csv_table import csv_as_bytes

    e = io.read_realizations(realizations)
    effective = flow.effective_k(e, values, axis, anisotropy=anisotropy)
    if not quiet:
        click.echo(summary(effective, unit))
    written = [path for path in (output, modflow) if path is not None]
    options: dict[str, Any] = {"unit": unit, "anisotropy": anisotropy}
    if output is not None:
        head, lines = effective.table()
        write_bytes(output, csv_as_bytes(head, lines))
    if modflow is not None:
        io.to_flopy(e, values, modflow, **{HEADS_ALONG[axis]: (1.0, 0.0)}, **options)
    if grdecl is not None:
        written += map(str, io.write_grdecl(grdecl, e, values, **options))
    if not quiet:
        for path in written:
            click.echo(f"Written: {path}", err=True)


def summary(effective: EffectiveK, unit: str) -> str:
    """Return a text: quantiles and bounds of the effective conductivity, and that of the image."""
    import numpy as np

    low, middle, high = np.quantile(effective.each, [0.1, 0.5, 0.9])
    return (
        f"Effective conductivity of {len(effective.each)} realizations: P10 {low:.4g}, P50 "
        f"{middle:.4g}, P90 {high:.4g} {unit}.\n"
        f"Bounds (harmonic and arithmetic mean): {effective.harmonic.mean():.4g} and "
        f"{effective.arithmetic.mean():.4g} {unit}. Training image: {effective.image:.4g} {unit}."
    )
