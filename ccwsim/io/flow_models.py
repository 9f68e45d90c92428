"""Hand-over of realizations to programs for flow: MODFLOW 6 and Eclipse."""

import os
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from zipfile import ZIP_DEFLATED, ZipFile

import numpy as np

from ccwsim.flow.darcy import Ends, Wells, darcy
from ccwsim.io.atomic import write_bytes
from ccwsim.io.data_file import printable
from ccwsim.io.formats.grdecl import geometry_as_bytes, keywords_as_bytes
from ccwsim.model.arrays import (
    Floats,
    as_floats,
    check_choice,
    check_int,
    check_number,
    check_type,
)
from ccwsim.model.bounds import MAX_CONTRAST
from ccwsim.model.ensemble import Ensemble
from ccwsim.model.errors import CCWSIMError, shown
from ccwsim.model.extras import needs
from ccwsim.model.facies_property import FaciesValues, cell_values, values_by_facies
from ccwsim.system.whole_files import unwritable

VISCOSITY, DENSITY, GRAVITY = 1.002e-3, 998.2, 9.80665
"""Viscosity (Pa s) and density (kg/m³) of water at 20 °C, and gravity (m/s²)."""
MILLIDARCY = 9.869233e-16  # one millidarcy in m²
TIGHT = 1e-10  # closure of heads and residuals; MODFLOW's defaults lose some percent of the flow
MODEL = "flow"  # name of the MODFLOW model and of its files
PER_DAY = {"m/s": 86400.0, "m/d": 1.0}


def millidarcy(conductivity: Floats, unit: str = "m/s") -> Floats:
    """Return permeability in millidarcy, K μ / (ρ g), for water at 20 °C.

    `unit` of the conductivity is "m/s", "m/d", or "mD", which is returned unchanged.

    Examples
    --------
    >>> millidarcy(np.array([1e-4])).round()
    array([10372.])
    """
    conductivity = as_floats(conductivity, "conductivity")
    if check_choice("unit", unit, [*PER_DAY, "mD"]) == "mD":
        return conductivity
    per_second = conductivity * (PER_DAY[unit] / PER_DAY["m/s"])
    return per_second * VISCOSITY / (DENSITY * GRAVITY) / MILLIDARCY


def _grdecl_files(
    ensemble: Ensemble, values: FaciesValues, unit: str = "m/s", anisotropy: float = 1.0
) -> dict[str, bytes]:
    """Return endings and contents of the files that `write_grdecl` writes."""
    check_type("ensemble", ensemble, Ensemble)
    anisotropy = check_number("anisotropy", anisotropy, 1 / MAX_CONTRAST, MAX_CONTRAST)
    k = millidarcy(values_by_facies(ensemble.training_image, values), unit)
    files = {".grdecl": geometry_as_bytes(ensemble.grid)}
    for number, facies, indices in zip(ensemble.numbers, ensemble, ensemble.indices, strict=True):
        horizontal = np.nan_to_num(cell_values(k, indices))
        maps = {"FACIES": np.nan_to_num(facies), "PERMX": horizontal, "PERMY": horizontal}
        if ensemble.active is not None:
            maps["ACTNUM"] = ensemble.active.astype(int)
        files[f"_{number + 1}.inc"] = keywords_as_bytes(maps | {"PERMZ": anisotropy * horizontal})
    return files


def write_grdecl(
    path: str | os.PathLike[str],
    ensemble: Ensemble,
    values: FaciesValues,
    *,
    unit: str = "m/s",
    anisotropy: float = 1.0,
) -> list[Path]:
    """Write the grid once, and facies and permeability of each realization, for Eclipse or OPM.

    The path, which ends in `.grdecl`, is that of the geometry. Realization 1 is in `…_1.inc` beside
    it, with the keywords FACIES, PERMX, PERMY and PERMZ in millidarcy, and so on; the paths of all
    files are returned. `values` has the hydraulic conductivity of each facies, by name or code, in
    the `unit` "m/s", "m/d" or "mD"; `anisotropy` is PERMZ / PERMX. Raises `CCWSIMError` for a
    facies without a value, or an unknown unit.

    Examples
    --------
    >>> from ccwsim import simulate
    >>> e = simulate(np.tile([[0], [0], [1], [1]], (16, 64)), (40, 50))
    >>> with TemporaryDirectory() as folder:
    ...     files = write_grdecl(Path(folder) / "grid.grdecl", e, {0: 1e-8, 1: 1e-4})
    >>> [file.name for file in files]
    ['grid.grdecl', 'grid_1.inc']
    """
    check_type("path", path, str, os.PathLike)
    stem = Path(path)
    if stem.suffix.lower() != ".grdecl":
        raise CCWSIMError(
            f"{shown(stem.name)} must end in .grdecl; other files get their name from it"
        )
    written = []
    for ending, content in _grdecl_files(ensemble, values, unit, anisotropy).items():
        written.append(stem.with_name(stem.stem + ending))
        write_bytes(written[-1], content)
    return written


def to_flopy(
    ensemble: Ensemble,
    values: FaciesValues,
    workspace: str | os.PathLike[str],
    *,
    realization: int = 0,
    west_east: Ends | None = None,
    south_north: Ends | None = None,
    wells: Wells | None = None,
    anisotropy: float = 1.0,
    unit: str = "m/s",
) -> Any:
    """Write a steady MODFLOW 6 model of a realization, and return the flopy simulation.

    Layer 1 is at the top and row 1 in the north. A head on a side is a general-head boundary half a
    cell away from the centre of a cell. The program `mf6` is not needed; flopy's `get-modflow`
    installs it, and `simulation.run_simulation()` runs the model. Other arguments are those of
    `ccwsim.flow.darcy`, which computes the same heads. Raises `CCWSIMError` if flopy is not
    installed, a facies has no value, or the heads and wells do not suit.

    `values` has the hydraulic conductivity of each facies, by name or code, in the `unit` "m/s" or
    "m/d", which is also the unit of time of wells. The model is in days, because the solver of
    MODFLOW loses digits if conductances are tiny. `workspace` is the folder of the model.

    Examples
    --------
    >>> from ccwsim import simulate
    >>> e = simulate(np.tile([[0], [0], [1], [1]], (16, 64)), (40, 50))
    >>> with TemporaryDirectory() as folder:
    ...     model = to_flopy(e, {0: 1e-6, 1: 1e-4}, folder, west_east=(1, 0)).get_model()
    >>> model.modelgrid.shape
    (1, 40, 50)
    """
    mf6 = needs("flopy").mf6
    check_type("ensemble", ensemble, Ensemble)
    check_type("workspace", workspace, str, os.PathLike)
    check_choice("unit", unit, PER_DAY)
    r = check_int("realization", realization, 0, ensemble.n - 1)
    k, grid = ensemble.property(values)[r], ensemble.grid
    # our solution checks heads and wells; MODFLOW starts from its heads
    solution = darcy(
        k, grid, west_east=west_east, south_north=south_north, wells=wells, anisotropy=anisotropy
    )
    volume = (lambda a: a) if grid.nz is not None else (lambda a: a[None])
    k, heads = volume(k) * PER_DAY[unit], np.nan_to_num(volume(solution.heads))
    active, k = ~np.isnan(k), np.nan_to_num(k, nan=1.0)
    nz, ny, nx = k.shape
    dx, dy, dz = (*grid.cell_size, 1.0)[:3]
    bottom = (*grid.origin, 0.0)[2]
    rows: list[list[Any]] = []
    active_cells = np.argwhere(active)
    for axis, ends, factor in ((2, west_east, dy * dz / dx), (1, south_north, dx * dz / dy)):
        for end, head in zip((0, k.shape[axis] - 1), ends or (None, None), strict=True):
            if head is not None:
                side = active_cells[active_cells[:, axis] == end]
                each = np.broadcast_to(np.asarray(head, float), np.delete(k.shape, axis))
                for (z, y, x), position in zip(
                    side.tolist(), np.delete(side, axis, 1), strict=True
                ):
                    numbers = float(each[tuple(position)]), float(2 * factor * k[z, y, x])
                    rows.append([(nz - 1 - z, ny - 1 - y, x), *numbers])
    simulation = mf6.MFSimulation(sim_name=MODEL, sim_ws=os.fspath(workspace), verbosity_level=0)
    mf6.ModflowTdis(simulation, time_units="days")
    mf6.ModflowIms(
        simulation, linear_acceleration="CG", inner_dvclose=TIGHT, outer_dvclose=TIGHT,
        rcloserecord=[(TIGHT, "RELATIVE_RCLOSE")], inner_maximum=5000, outer_maximum=20,
    )  # fmt: skip
    model = mf6.ModflowGwf(simulation, modelname=MODEL, save_flows=True)
    botm: Any = [bottom + layer * dz for layer in range(nz - 1, -1, -1)]
    mf6.ModflowGwfdis(
        model, nlay=nz, nrow=ny, ncol=nx, delr=dx, delc=dy, top=bottom + nz * dz,
        botm=botm, idomain=active[::-1, ::-1].astype(int),
        xorigin=grid.origin[0], yorigin=grid.origin[1], length_units="meters",
    )  # fmt: skip
    mf6.ModflowGwfic(model, strt=heads[::-1, ::-1])
    flipped = k[::-1, ::-1]
    mf6.ModflowGwfnpf(model, k=flipped, k33=anisotropy * flipped, icelltype=0)
    mf6.ModflowGwfghb(model, stress_period_data=rows, maxbound=len(rows))
    if solution.wells:
        rates = [((0, *cell)[-3:], rate * PER_DAY[unit]) for cell, rate in solution.wells.items()]
        pumped = [[(nz - 1 - z, ny - 1 - y, x), rate] for (z, y, x), rate in rates]
        mf6.ModflowGwfwel(model, stress_period_data=pumped)
    saved: Any = [("HEAD", "ALL"), ("BUDGET", "ALL")]
    mf6.ModflowGwfoc(
        model, head_filerecord=f"{MODEL}.hds", budget_filerecord=f"{MODEL}.cbc", saverecord=saved
    )
    with unwritable(workspace):
        simulation.write_simulation(silent=True)
    return simulation


def _zipped(files: dict[str, bytes]) -> bytes:
    """Return files, by name, as one zip file."""
    buffer = BytesIO()
    with ZipFile(buffer, "w", ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return buffer.getvalue()


def grdecl_as_zip(name: str, ensemble: Ensemble, values: FaciesValues, **options: Any) -> bytes:
    """Return the files that `write_grdecl` writes to name.grdecl as a zip file, for a download."""
    check_type("name", name, str)
    files = _grdecl_files(ensemble, values, **options)
    return _zipped({f"{printable(name)}{ending}": content for ending, content in files.items()})


def flopy_as_zip(ensemble: Ensemble, values: FaciesValues, **options: Any) -> bytes:
    """Return the files that `to_flopy` writes as a zip file, for a download."""
    with TemporaryDirectory() as folder:
        to_flopy(ensemble, values, folder, **options)
        return _zipped({file.name: file.read_bytes() for file in sorted(Path(folder).iterdir())})
