"""Write maps of one grid for other programs: VTK ImageData, GeoTIFF, NetCDF."""

from __future__ import annotations

import base64
import zlib
from collections.abc import Mapping
from importlib.util import find_spec
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from ccwsim.io.data_file import broken, optional_package
from ccwsim.io.formats.rasters import code_and_wkt
from ccwsim.io.formats.vti import TYPES
from ccwsim.model.arrays import AXES
from ccwsim.model.errors import CCWSIMError, shown
from ccwsim.model.grid import Grid

NEEDS = {"tif": "rasterio", "nc": "xarray"}
"""Optional package that is needed to write each format."""
CRS_VARIABLE = "spatial_ref"
"""Name of the NetCDF variable whose attributes state the coordinate system."""
_VTK_TYPES = {kind: name for name, kind in TYPES.items()}
_BLOCK = 2**20
"""Number of uncompressed bytes in each compressed block of a VTK file."""


def can_write(kind: str) -> bool:
    """Return whether the package that a format needs is installed.

    Examples
    --------
    >>> can_write("vti")
    True
    """
    return kind not in NEEDS or find_spec(NEEDS[kind]) is not None


def vti_as_bytes(maps: Mapping[str, NDArray], grid: Grid) -> bytes:
    """Return maps or volumes (row 0 at the south) as VTK XML ImageData, one array per map.

    A map becomes one layer of cells between z = 0 and z = 1.
    """
    extent = f'"0 {grid.nx} 0 {grid.ny} 0 {grid.nz or 1}"'
    spacing = " ".join((*map(repr, grid.cell_size), "1")[:3])
    origin = " ".join((*map(repr, grid.origin), "0")[:3])
    parts = [
        b'<?xml version="1.0"?>\n<VTKFile type="ImageData" version="1.0" byte_order="LittleEndian"'
        b' header_type="UInt64" compressor="vtkZLibDataCompressor">\n',
        f'<ImageData WholeExtent={extent} Origin="{origin}" '
        f'Spacing="{spacing}">\n<Piece Extent={extent}>\n<CellData>\n'.encode(),
    ]
    for name, values in maps.items():
        little = np.ascontiguousarray(values, values.dtype.newbyteorder("<"))
        head = f'<DataArray type="{_VTK_TYPES[little.dtype.str[1:]]}" Name={quoteattr(name)} '
        parts += [head.encode(), b'format="binary">', _packed(little), b"</DataArray>\n"]
    return b"".join([*parts, b"</CellData>\n</Piece>\n</ImageData>\n</VTKFile>\n"])


def _packed(values: NDArray) -> bytes:
    """Return values in the layout of VTK: compressed blocks, preceded by their sizes."""
    raw = memoryview(values.tobytes())
    blocks = [zlib.compress(raw[k : k + _BLOCK], 6) for k in range(0, len(raw), _BLOCK)]
    sizes = [len(blocks), _BLOCK, len(raw) % _BLOCK, *map(len, blocks)]
    return base64.b64encode(np.array(sizes, "<u8").tobytes()) + base64.b64encode(b"".join(blocks))


def geotiff_as_bytes(maps: Mapping[str, NDArray], grid: Grid) -> bytes:
    """Return maps as a GeoTIFF, north up, with one named band per map and a common data type.

    Raises `CCWSIMError` if rasterio is missing, codes do not fit a GeoTIFF, or maps are volumes.
    """
    if grid.nz is not None:
        raise CCWSIMError("a GeoTIFF can show maps, not volumes; write vti, npz or gslib")
    rasterio = _package("tif")
    from rasterio.io import MemoryFile

    (sx, sy), (ox, oy) = grid.cell_size, grid.origin
    kind = _tiff_type(maps)
    north_west = rasterio.Affine(sx, 0, ox, 0, -sy, oy + grid.ny * sy)
    profile: dict[str, Any] = {"height": grid.ny, "width": grid.nx, "count": len(maps)}
    profile |= {"dtype": kind, "transform": north_west, "compress": "deflate"}
    if grid.crs:
        with broken(f"crs = {shown(grid.crs)} is unknown to GDAL", remedy="correct it"):
            profile["crs"] = rasterio.CRS.from_user_input(grid.crs)
    with MemoryFile() as memory:
        with memory.open(driver="GTiff", interleave="band", **profile) as file:
            for band, (name, values) in enumerate(maps.items(), start=1):
                file.write(values[::-1].astype(kind), band)
                file.set_band_description(band, name)
        return memory.read()


def _tiff_type(maps: Mapping[str, NDArray]) -> str:
    kind = np.result_type(*maps.values())
    if kind == np.int8:
        return "int16"  # older programs cannot read signed bytes
    if kind.kind == "f":
        return "float32" if kind.itemsize < 8 or _fit(maps, 2**24) else "float64"
    if kind.itemsize == 8:
        if not _fit(maps, 2**31):
            raise CCWSIMError("facies codes in a GeoTIFF must be below 2³¹; renumber them")
        return "int32"
    return kind.name


def _fit(maps: Mapping[str, NDArray], most: int) -> bool:
    """Return whether the values of all integer maps fit into a smaller type."""
    whole = [values for values in maps.values() if values.dtype.kind in "ui"]
    return all(-most < int(v.min()) and int(v.max()) < most for v in whole)


def netcdf_as_bytes(maps: Mapping[str, NDArray], grid: Grid) -> bytes:
    """Return maps as NetCDF variables; coordinates (z,) y, x are cell centres in world units.

    Raises `CCWSIMError` if xarray is not installed, or codes do not fit NetCDF.
    """
    xarray = _package("nc")
    axes = dict(reversed(list(zip(AXES, grid.axes, strict=False))))
    variables = {name: (tuple(axes), netcdf_integers(values)) for name, values in maps.items()}
    return _netcdf(xarray.Dataset(variables, axes), grid.crs)


def realizations_as_netcdf(array: Any) -> bytes:
    """Return the DataArray of an ensemble as NetCDF; integers have at most 32 bits."""
    _package("nc")
    codes = netcdf_integers(np.asarray(array.attrs["flag_values"]))
    small = array.astype(codes.dtype)
    small.attrs |= {"flag_values": codes, "seed": str(array.attrs["seed"])}
    return _netcdf(small.to_dataset(), small.attrs.get("crs", ""))


def _netcdf(dataset: Any, crs: str) -> bytes:
    """Return a dataset as a file, with the coordinate system as in the CF conventions."""
    if crs:
        for variable in dataset.data_vars.values():
            variable.attrs["grid_mapping"] = CRS_VARIABLE
        for axis in ("x", "y"):
            dataset[axis].attrs["standard_name"] = f"projection_{axis}_coordinate"
        said = {"crs": crs, "crs_wkt": code_and_wkt(crs)[1]}
        dataset = dataset.assign({CRS_VARIABLE: ((), np.int32(0), said)})
    return bytes(dataset.to_netcdf(engine="scipy"))


def netcdf_integers(values: NDArray) -> NDArray:
    """Convert integers to the smallest sufficient NetCDF type; return other values unchanged."""
    if values.dtype.kind not in "ui":
        return values
    low, high = int(values.min()), int(values.max())
    for kind in (np.int8, np.int16, np.int32):
        if np.iinfo(kind).min <= low and high <= np.iinfo(kind).max:
            return values.astype(kind)
    raise CCWSIMError("facies codes in NetCDF must be below 2³¹; renumber them")


def _package(kind: str) -> Any:
    return optional_package(NEEDS[kind], f".{kind} files", "ccwsim[files]")
