"""Hand-over of realizations to programs for flow: MODFLOW 6 and Eclipse."""

import os
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from zipfile import ZIP_DEFLATED, ZipFile

import numpy as np

from ccwsim import Ensemble
from ccwsim.flow.boundary import Edge
from ccwsim.flow.darcy import Ends, Wells, cell_sizes, darcy
from ccwsim.io.atomic import format_of, write_bytes
from ccwsim.io.data_file import printable
from ccwsim.io.formats.grdecl import geometry_as_bytes, keywords_as_bytes, regions_as_bytes
from ccwsim.io.formats.rasters import metres_per_unit
from ccwsim.model import (
    MAX_CONTRAST,
    FaciesValues,
    Floats,
    as_floats,
    check_choice,
    check_int,
    check_number,
    check_type,
    needs,
)
from ccwsim.system.whole_files import unwritable

VISCOSITY, DENSITY, GRAVITY = 1.002e-3, 998.2, 9.80665
"""Viscosity (Pa s) and density (kg/m³) of water at 20 °C, and gravity (m/s²)."""
MILLIDARCY = 9.869233e-16  # one millidarcy in m²
TIGHT = 1e-10  # closure of heads and residuals; MODFLOW's defaults lose some percent of the flow
MODEL = "flow"  # name of the MODFLOW model and of its files
LENGTH_UNITS = {1.0: "meters", 0.3048: "feet"}  # MODFLOW's names of units, by their length in m
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
    ensemble: Ensemble,
    values: FaciesValues,
    unit: str = "m/s",
    anisotropy: float = 1.0,
    thickness: float = 1.0,
) -> dict[str, bytes]:
    """Return endings and contents of the files that `write_grdecl` writes."""
    check_type("ensemble", ensemble, Ensemble)
    anisotropy = check_number("anisotropy", anisotropy, 1 / MAX_CONTRAST, MAX_CONTRAST)
    conductivity = ensemble.property(values)
    height = cell_sizes(ensemble.grid, thickness)[2]
    metres_per_unit(ensemble.grid.crs)  # refuses degrees
    files = {".grdecl": geometry_as_bytes(ensemble.grid, thickness=height)}
    for number, k, indices in zip(ensemble.numbers, conductivity, ensemble.indices, strict=True):
        k_x = millidarcy(np.nan_to_num(k), unit)
        maps = {"ACTNUM": ensemble.active, "PERMX": k_x, "PERMY": k_x, "PERMZ": anisotropy * k_x}
        files[f"_{number + 1}.inc"] = keywords_as_bytes(maps)
        regions = regions_as_bytes({"FIPNUM": indices}, ensemble.training_image)
        files[f"_{number + 1}_facies.inc"] = regions
    return files


def write_grdecl(
    path: str | os.PathLike[str],
    ensemble: Ensemble,
    values: FaciesValues,
    *,
    unit: str = "m/s",
    anisotropy: float = 1.0,
    thickness: float = 1.0,
) -> list[Path]:
    """Write the grid once, and facies and permeability of each realization, for Eclipse or OPM.

    The path, which ends in `.grdecl`, is that of the geometry. Beside it, for the section GRID,
    `…_1.inc` has ACTNUM, and PERMX, PERMY and PERMZ of realization 1 in millidarcy, and
    `…_1_facies.inc` its facies for the section REGIONS: FIPNUM, which counts from 1, and comments
    with the code and name of each region. Lengths are those of the grid: use the units METRIC in a
    deck of a grid in metres, and FIELD for feet. The paths of all files are returned. `values` has
    the hydraulic conductivity of each facies, by name or code, in the `unit` "m/s", "m/d" or "mD";
    `anisotropy` is PERMZ / PERMX, and `thickness` that of a map.

    Raises `CCWSIMError` for a facies without a value, or an unknown unit.

    Examples
    --------
    >>> from ccwsim import simulate
    >>> e = simulate(np.tile([[0], [0], [1], [1]], (16, 64)), (40, 50))
    >>> with TemporaryDirectory() as folder:
    ...     files = write_grdecl(Path(folder) / "grid.grdecl", e, {0: 1e-8, 1: 1e-4})
    >>> [file.name for file in files]
    ['grid.grdecl', 'grid_1.inc', 'grid_1_facies.inc']
    """
    check_type("path", path, str, os.PathLike)
    stem = Path(path)
    format_of(stem, None, ["grdecl"])  # names of other files are made from it
    written = []
    for ending, content in _grdecl_files(ensemble, values, unit, anisotropy, thickness).items():
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
    edge: Edge | None = None,
    wells: Wells | None = None,
    anisotropy: float = 1.0,
    thickness: float = 1.0,
    unit: str = "m/s",
) -> Any:
    """Write a steady MODFLOW 6 model of a realization, and return the flopy simulation.

    Layer 1 is at the top and row 1 in the north. A head at a side or along the outline (`edge`) is
    a general-head boundary half a cell away from the centre of a cell. The program `mf6` is not
    needed; flopy's `get-modflow` installs it, and `simulation.run_simulation()` runs the model.
    Other arguments are those of `ccwsim.flow.darcy`, which computes the same heads. Raises
    `CCWSIMError` if flopy is not installed, a facies has no value, or heads or wells do not suit.

    `values` has the hydraulic conductivity of each facies, by name or code, in the `unit` "m/s" or
    "m/d", which is also the unit of time of wells (m³/s or m³/d). Heads and `thickness` are in the
    unit of the grid, metres or, by its coordinate system, feet; degrees are refused. The model is
    in days, because the solver of MODFLOW loses digits if conductances are tiny. `workspace` is the
    folder of the model.

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
    metres = metres_per_unit(ensemble.grid.crs)
    k, grid = ensemble.property(values)[r] / metres, ensemble.grid
    if metres != 1 and isinstance(wells, Mapping):
        wells = {cell: rate / metres**3 for cell, rate in wells.items()}
    # our solution checks heads and wells; MODFLOW starts from its heads
    solution = darcy(
        k, grid, west_east=west_east, south_north=south_north, edge=edge, wells=wells,
        anisotropy=anisotropy, thickness=thickness,
    )  # fmt: skip
    volume = (lambda a: a) if grid.is_volume else (lambda a: a[None])
    k, heads = volume(k) * PER_DAY[unit], np.nan_to_num(volume(solution.heads))
    active, k = ~np.isnan(k), np.nan_to_num(k, nan=1.0)
    nz, ny, nx = k.shape
    dx, dy, dz = cell_sizes(grid, thickness)
    bottom = (*grid.origin, 0.0)[2]
    faces = solution.fixed_faces
    conductances = (faces.conductances * PER_DAY[unit]).tolist()
    rows: list[list[Any]] = []
    for cell, head, conductance in zip(
        faces.cells.tolist(), faces.heads.tolist(), conductances, strict=True
    ):
        z, y, x = (0, *cell)[-3:]
        rows.append([(nz - 1 - z, ny - 1 - y, x), head, conductance])
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
        xorigin=grid.origin[0], yorigin=grid.origin[1],
        length_units=LENGTH_UNITS.get(round(metres, 4)),
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
