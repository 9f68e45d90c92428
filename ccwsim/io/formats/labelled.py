"""Read arrays with named axes from NetCDF and HDF5 files, and write NetCDF."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from io import BytesIO
from math import prod
from typing import Any

import numpy as np

from ccwsim import CCWSIMError, Grid
from ccwsim.io.data_file import DataFile, Geometry, broken
from ccwsim.io.formats.rasters import code_and_wkt
from ccwsim.io.limits import check, check_arrays, limits
from ccwsim.model import (
    MAX_FACIES,
    WORLD_AXES,
    Array,
    is_top_first,
    labelled_axes,
    needs,
    oriented_values,
)

_MATLAB = "MATLAB_class"
_CRS_VARIABLE = "spatial_ref"  # name of the variable whose attributes state the coordinate system
REALIZATION = "realization"  # name of the axis of realizations, as in files of this package


def read_netcdf(content: bytes, name: str) -> DataFile:
    """Return the variables of a NetCDF file that have at least two axes."""
    xarray = needs("xarray")
    engine = "scipy" if content.startswith(b"CDF") else "h5netcdf"
    if engine == "h5netcdf":
        needs("h5netcdf")
    with broken(f"{name}: the NetCDF file cannot be read", remedy="save it again"):
        opened = xarray.open_dataset(BytesIO(content), engine=engine, decode_times=False)
    with opened as dataset:
        arrays = {
            str(key): array
            for key, array in _apart(dataset)
            if array.ndim >= 2 and array.dtype.kind in "iufb"
        }
        return _file_of(arrays, name, _crs_of(dataset))


def _crs_of(dataset: Any) -> str:
    """Return the coordinate system in the attributes of a dataset or of one of its variables."""
    for place in (dataset, *dataset.variables.values()):
        for key in ("crs", "crs_wkt", "spatial_ref", "epsg_code", "epsg", "proj4"):
            if isinstance(crs := place.attrs.get(key), (str, int, np.integer)):
                return code_and_wkt(crs if isinstance(crs, str) else f"EPSG:{crs}")[0]
    return ""


def _apart(dataset: Any) -> Iterator[tuple[Any, Any]]:
    """Yield the variables of a dataset; each realization of a variable counts as a variable."""
    for key, array in dataset.data_vars.items():
        if REALIZATION not in array.dims:
            yield key, array
            continue
        for k in range(min(array.sizes[REALIZATION], limits().variables + 1)):
            yield f"{key} ({k + 1})", array.isel({REALIZATION: k})


def _file_of(arrays: dict[str, Any], name: str, crs: str) -> DataFile:
    check(name, variables=len(arrays))
    check_arrays(name, [array.shape for array in arrays.values()])
    with broken(f"{name}: the NetCDF file cannot be read", remedy="save it again"):
        grids = {key: oriented_values(array) for key, array in arrays.items()}
    if too_many := next((key for key, grid in grids.items() if grid.ndim > 3), None):
        raise CCWSIMError(f"{name}: {too_many} has {grids[too_many].ndim} axes; save at most 3")
    grids = {key: grid if grid.ndim == 3 else grid[None] for key, grid in grids.items()}
    first = next(iter(arrays.values()))
    labels = {key: names for key, array in arrays.items() if (names := _flag_names(array))}
    file = DataFile("NetCDF file", name, grids, geometry=Geometry(crs=crs), labels=labels)
    file = replace(file, bottom_first=not is_top_first(first))
    sizes, origins = zip(*labelled_axes(first), strict=True)
    return file.at(sizes, origins) if len(sizes) > 1 else file


def _flag_names(array: Any) -> tuple[str, ...]:
    """Return the names of the values 0, 1, … by the CF attributes of flags; else nothing."""
    meanings = str(array.attrs.get("flag_meanings", "")).split()
    values = np.atleast_1d(array.attrs.get("flag_values", np.arange(len(meanings)))).tolist()
    names = dict(zip(values, meanings, strict=False))
    n = max(names, default=-1) + 1 if {*names} <= {*range(MAX_FACIES + 1)} else 0
    return tuple(names.get(k, f"facies {k}") for k in range(n))


def read_hdf5(content: bytes, name: str) -> DataFile:
    """Return the arrays of an HDF5 file: MATLAB 7.3, NetCDF-4 or any other."""
    h5py = needs("h5py")
    with (
        broken(f"{name}: the HDF5 file cannot be read", remedy="save it again"),
        h5py.File(BytesIO(content)) as file,
    ):
        every = _arrays(file, h5py, name)
        if "_NCProperties" in file.attrs or any(
            "DIMENSION_LIST" in a.attrs for a in every.values()
        ):
            return read_netcdf(content, name)
        arrays = {k: a for k, a in every.items() if a.ndim in (2, 3) and a.dtype.kind in "iufb"}
        check(name, variables=len(arrays))
        is_matlab = any(_MATLAB in array.attrs for array in arrays.values())
        grids = {key: _grid(array[()], is_matlab) for key, array in arrays.items()}
    return DataFile("MATLAB 7.3 file" if is_matlab else "HDF5 file", name, grids, asks_up=True)


def _arrays(file: Any, h5py: Any, name: str) -> dict[str, Any]:
    """Return all arrays by their paths; refuse other files, which could be those of a server."""
    arrays: dict[str, Any] = {}
    sizes: list[tuple[int, ...]] = []

    def visit(key: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset) and not key.startswith("#"):  # groups of MATLAB itself
            arrays[key] = item

    file.visititems(visit)
    links = file.visititems_links(lambda _, link: isinstance(link, h5py.ExternalLink) or None)
    if links or any(array.external or array.is_virtual for array in arrays.values()):
        raise CCWSIMError(f"{name} refers to other files; save all arrays in one file")
    for array in arrays.values():  # a chunk may be larger than the array
        shape, chunk = array.shape or (1,), array.chunks or ()
        sizes.append(chunk if prod(chunk) > prod(shape) else tuple(max(side, 1) for side in shape))
    check_arrays(name, sizes)
    return arrays


def _grid(array: Array, is_matlab: bool) -> Array:
    """Return an array as layers, rows and columns; MATLAB stores axes in reverse order."""
    if is_matlab:
        array = np.swapaxes(array, -1, -2)
    return array if array.ndim == 3 else array[None]


def netcdf_as_bytes(maps: Mapping[str, Array], grid: Grid) -> bytes:
    """Return maps as NetCDF variables; coordinates (z,) y, x are cell centres in world units."""
    xarray = needs("xarray")
    axes = dict(reversed(list(zip(WORLD_AXES, grid.axes, strict=False))))
    variables = {name: (tuple(axes), netcdf_integers(values)) for name, values in maps.items()}
    return _netcdf(xarray.Dataset(variables, axes), grid.crs)


def realizations_as_netcdf(array: Any) -> bytes:
    """Return the DataArray of an ensemble as NetCDF; integers have at most 32 bits."""
    array = array.assign_attrs(seed=str(array.attrs["seed"]))
    if "flag_values" not in array.attrs:
        return _netcdf(array.to_dataset(), array.attrs.get("crs", ""))
    codes = netcdf_integers(np.asarray(array.attrs["flag_values"]))
    small = array.astype(codes.dtype if array.dtype.kind in "ui" else np.float64)
    small.attrs["flag_values"] = codes
    return _netcdf(small.to_dataset(), small.attrs.get("crs", ""))


def _netcdf(dataset: Any, crs: str) -> bytes:
    """Return a dataset as a file, with the coordinate system as in the CF conventions."""
    if crs:
        for variable in dataset.data_vars.values():
            variable.attrs["grid_mapping"] = _CRS_VARIABLE
        for axis in ("x", "y"):
            dataset[axis].attrs["standard_name"] = f"projection_{axis}_coordinate"
        attributes = {"crs": crs, "crs_wkt": code_and_wkt(crs)[1]}
        dataset = dataset.assign({_CRS_VARIABLE: ((), np.int32(0), attributes)})
    return bytes(dataset.to_netcdf(engine="scipy"))


def netcdf_integers(values: Array) -> Array:
    """Convert integers to the smallest sufficient NetCDF type; return other values unchanged."""
    if values.dtype.kind not in "ui":
        return values
    low, high = int(values.min()), int(values.max())
    for kind in (np.int8, np.int16, np.int32):
        if np.iinfo(kind).min <= low and high <= np.iinfo(kind).max:
            return values.astype(kind)
    raise CCWSIMError("facies codes in NetCDF must be below 2³¹; renumber them")
