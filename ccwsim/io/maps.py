"""Write named maps of one grid, such as the maps of an E-type, for other programs."""

from collections.abc import Mapping
from io import BytesIO

import numpy as np

from ccwsim import Grid
from ccwsim.io.atomic import check_format, format_of, write_bytes
from ccwsim.io.data_file import printable
from ccwsim.io.formats.grdecl import grdecl_as_bytes
from ccwsim.io.formats.labelled import netcdf_as_bytes
from ccwsim.io.formats.numpy_files import place_arrays
from ccwsim.io.formats.rasters import geotiff_as_bytes
from ccwsim.io.formats.text_grids import grid_as_bytes
from ccwsim.io.formats.vti import vti_as_bytes
from ccwsim.io.opening import PathOrFile
from ccwsim.model import Array, ArrayLike, CCWSIMError, as_array, shown

MAP_FORMATS = ("npz", "gslib", "sgems", "dat", "grdecl", "vti", "tif", "nc")
"""Formats of maps, named by file ending."""

NO_VALUE = -9999.0
"""Code of a cell without a value in text files, because few programs read "nan"."""
DECIMALS = 6  # number of decimals of real numbers in text files


def write_maps(
    path_or_file: PathOrFile,
    maps: Mapping[str, ArrayLike],
    grid: Grid,
    *,
    format: str | None = None,
) -> None:
    """Write maps or volumes of a grid to a file, with cell size and origin in world units.

    `maps` has real numbers or integers, shape of the grid, by the name of the map, such as
    `metrics.etype(e).maps` for an ensemble e. Of `MAP_FORMATS`, `npz` has one array per map and
    arrays `cell_size`, `origin` and `crs`. `gslib`, `sgems` and `dat` have one column per map, and
    `grdecl` one keyword, with 6 decimals. `vti` has one array of cell data per map, `tif` one band
    per map, north up (needs rasterio), and `nc` one variable per map (needs xarray).

    Examples
    --------
    >>> file, grid = BytesIO(), Grid(1, 2, cell_size=(10.0, 10.0), origin=(500.0, 0.0))
    >>> write_maps(file, {"probability": [[0.25, 1.0]]}, grid, format="gslib")
    >>> file.getvalue()
    b'2 1 1 10.0 10.0 1 500.0 0.0 0\\n1\\nprobability\\n0.25\\n 1.0\\n'
    """
    kind = format_of(path_or_file, format, MAP_FORMATS)
    write_bytes(path_or_file, maps_as_bytes(maps, grid, kind))


def maps_as_bytes(
    maps: Mapping[str, ArrayLike], grid: Grid, format: str, decimals: int | None = DECIMALS
) -> bytes:
    """Return the file content that `write_maps` writes, for a download."""
    kind = format_of(None, format, MAP_FORMATS)
    check_format(kind, (len(maps), *grid.shape))
    checked = {name: _map(name, values, grid) for name, values in maps.items()}
    if not checked:
        raise CCWSIMError("there are no maps to write; give at least one")
    writers = {
        "npz": _maps_npz,
        "vti": vti_as_bytes,
        "tif": geotiff_as_bytes,
        "nc": netcdf_as_bytes,
    }
    if kind in writers:
        return writers[kind](checked, grid)
    rounded = {
        name: values if values.dtype.kind != "f" else np.nan_to_num(values, nan=NO_VALUE)
        for name, values in checked.items()
    }
    if decimals is not None:
        rounded = {name: values.round(decimals) for name, values in rounded.items()}
    if kind == "grdecl":
        return grdecl_as_bytes(rounded, grid)
    return grid_as_bytes([*rounded.values()], [*rounded], grid)


def _map(name: str, values: ArrayLike, grid: Grid) -> Array:
    if not isinstance(name, str) or not name or name != printable(name):
        raise CCWSIMError(f"{shown(name)} cannot be a map name; give a short text on one line")
    array = as_array(values, name)
    if array.shape != grid.shape or array.dtype.kind not in "buif" or array.dtype.itemsize > 8:
        raise CCWSIMError(
            f"{name}: an array of shape {array.shape} and type {array.dtype} is not numeric or "
            f"differs from the grid's {grid.shape}"
        )
    if array.dtype.kind == "b":
        return array.astype(np.uint8)
    return array.astype(np.float32) if array.dtype == np.float16 else array


def _maps_npz(maps: Mapping[str, Array], grid: Grid) -> bytes:
    content = BytesIO()
    place = place_arrays(grid)
    if place.keys() & maps.keys():
        raise CCWSIMError(f"{', '.join(place)} cannot be names of maps in an npz; rename them")
    np.savez_compressed(content, allow_pickle=False, **{**maps, **place})
    return content.getvalue()
