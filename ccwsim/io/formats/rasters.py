"""Read rasters with coordinates by GDAL (GeoTIFF, Surfer, ZMap, GRASS), and write GeoTIFF."""

import re
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import replace
from typing import Any

import numpy as np
from PIL.ImageColor import getrgb

from ccwsim import Grid
from ccwsim.io.data_file import DataFile, Geometry, broken, distinct_names
from ccwsim.io.limits import check, check_cells
from ccwsim.model import UNKNOWN, Array, CCWSIMError, Floats, needs, refused, shown

DRIVERS = {
    "tiff": ("GeoTIFF", "GTiff"),
    "surfer text": ("Surfer grid", "GSAG"),
    "surfer 6": ("Surfer grid", "GSBG"),
    "surfer 7": ("Surfer grid", "GS7BG"),
    "zmap": ("ZMap grid", "ZMap"),
    "grass": ("GRASS ASCII grid", "GRASSASCIIGrid"),
}
"""The name and the GDAL driver of each kind of raster."""
MAX_DIGITS = 40  # maximum number of letters of the code of a coordinate system, such as EPSG:32632


def is_map(content: bytes, name: str) -> bool:
    """Return whether a TIFF contains numbers on a map or several pages, and is not a picture."""
    with suppress(CCWSIMError), _opened_raster(content, name, "tiff") as file:
        placed = not file.transform.is_identity or file.crs is not None
        plain = set(file.dtypes) == {"uint8"} and file.count in (1, 3, 4)
        gaps = file.nodata is not None or (file.count == 1 and _has_mask(file))
        return len(file.subdatasets) > 1 or placed or not plain or gaps
    return False


def read_raster(content: bytes, name: str, kind: str) -> DataFile:
    """Return the bands of a raster as variables, or its pages as the layers of volumes."""
    if kind == "grass":  # GDAL reads an unknown cell, marked by an asterisk, as 0
        content = content.replace(b"*", b"-9999")
    if kind == "zmap":  # programs write remarks between header and values
        content = re.sub(rb"(?m)^\+[^\n]*\n", b"", content)
    with _opened_raster(content, name, kind) as first, ExitStack() as opened:
        check(name, variables=max(len(first.subdatasets), first.count))
        pages = [opened.enter_context(_page(part)) for part in first.subdatasets] or [first]
        if any(
            (p.shape, p.count, p.dtypes) != (first.shape, first.count, first.dtypes) for p in pages
        ):
            raise CCWSIMError(f"{name}: its {len(pages)} pages differ in size; save one of them")
        check_cells(name, (first.count, len(pages), *first.shape))
        with broken(f"{name}: the raster cannot be read", remedy="save it without compression"):
            bands = np.stack([page.read() for page in pages], axis=1)
            if any(map(_has_mask, pages)):
                valid = np.stack([page.read_masks() for page in pages], axis=1)
                bands = np.where(valid, bands, np.nan)
        missing = tuple({float(v) for p in pages for v in p.nodatavals if v is not None and v == v})
        names = [text or f"band {k}" for k, text in enumerate(first.descriptions, start=1)]
        variables = dict(zip(distinct_names(names), bands, strict=True))
        file = DataFile(DRIVERS[kind][0], name, variables, south_first=False, missing=missing)
        if any(band.name == "palette" for band in first.colorinterp):
            file = replace(file, numbering="colours")
        return _located(file, first)


@contextmanager
def _opened_raster(content: bytes, name: str, kind: str) -> Iterator[Any]:
    """Yield a raster, with the bands of its first page, as an open dataset of rasterio."""
    rasterio = needs("rasterio")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", rasterio.errors.NotGeoreferencedWarning)
        with (
            broken(f"{name}: the raster cannot be read", remedy="save it again"),
            rasterio.Env(GDAL_PAM_ENABLED="NO"),
            rasterio.MemoryFile(content) as memory,
            rasterio.open(memory.name, driver=DRIVERS[kind][1]) as file,
        ):
            yield file


def _page(part: str) -> Any:
    """Return a page of an opened TIFF as an open dataset of rasterio."""
    return needs("rasterio").open(part, driver="GTiff")


def _has_mask(page: Any) -> bool:
    """Whether a mask or a transparency band marks unknown cells."""
    return any("per_dataset" in str(flags) for flags in page.mask_flag_enums)


def _located(file: DataFile, page: Any) -> DataFile:
    """Return a file with directions, cell size and origin of a raster."""
    transform, crs = page.transform, "" if page.crs is None else _code_of(page.crs)
    file = replace(file, geometry=Geometry(crs=crs))
    if transform.is_identity or transform.is_degenerate:
        return file
    if page.driver == "ZMap" and page.width > 1 < page.height:
        transform = _of_nodes(transform, page.width, page.height)
    a, b, c, d, e, f, *_ = transform
    if not (b or d):
        file = file.at((abs(a), abs(e)), (min(c, c + page.width * a), min(f, f + page.height * e)))
    return file.along((a, d), (b, e))


def code_and_wkt(crs_text: str) -> tuple[str, str]:
    """Return a coordinate system as the authority's code and as WKT; otherwise the given text."""
    with suppress(Exception):
        crs = needs("rasterio").CRS.from_user_input(crs_text)
        return _code_of(crs), crs.to_wkt()
    return crs_text, crs_text


def _of_nodes(transform: Any, nx: int, ny: int) -> Any:
    """Return the transform of a grid whose extent is that of the nodes, unless cells are round."""
    scale = type(transform).scale(nx / (nx - 1), ny / (ny - 1))
    numbers = [*transform @ scale @ type(transform).translation(-0.5, -0.5)][:6]
    of_nodes = type(transform)(*(float(f"{number:.12g}") for number in numbers))
    return min((of_nodes, transform), key=lambda t: len(f"{t.a:.10g}{t.e:.10g}"))


def moved(points: Floats, crs: str, other: str) -> Floats:
    """Return points (x, y) of a coordinate system in another one, unless one is unknown."""
    if not (crs and other) or crs == other:
        return points
    with broken(f"{shown(crs)} cannot be converted to {shown(other)}", remedy="convert the file"):
        x, y = needs("rasterio.warp").transform(crs, other, *points.T)
    return np.column_stack([x, y])


def metres_per_unit(crs_text: str) -> float:
    """Return the length of a coordinate system's unit; 1 if it is unknown, or rasterio is missing.

    Raises `CCWSIMError` for degrees.

    Examples
    --------
    >>> metres_per_unit("EPSG:32632")
    1.0
    """
    unit, metres = "", 1.0
    with suppress(Exception):
        unit, metres = needs("rasterio").CRS.from_user_input(crs_text).units_factor
    if unit == "degree":
        raise refused("crs_in_degrees", crs=shown(crs_text))
    return metres


def _code_of(crs: Any) -> str:
    """Return the authority's code of a coordinate system if it has one, otherwise its WKT."""
    code = crs.to_string()
    return code if len(code) <= MAX_DIGITS else crs.to_wkt()


def geotiff_as_bytes(
    maps: Mapping[str, Array],
    grid: Grid,
    facies: Mapping[int, str] | None = None,
    colours: Sequence[str] | None = None,
    kind: str = "",
) -> bytes:
    """Return maps as a GeoTIFF, north up, with one named band per map and a common data type.

    With `facies`, names by code from 0 to 254, the type is bytes, and 255 means no value. Tags of
    the bands have the names; a single band also has a table of the `colours` of the facies. Else
    `kind` is the data type, by default the smallest that shows the maps.
    """
    if grid.is_volume:
        raise CCWSIMError("a GeoTIFF can show maps, not volumes; write vti, npz or gslib")
    rasterio = needs("rasterio")
    (sx, sy), (ox, oy) = grid.cell_size, grid.origin
    facies = facies if facies and min(facies) >= 0 and max(facies) < UNKNOWN else {}
    kind = "uint8" if facies else kind or _common_type(maps)
    north_west = rasterio.Affine(sx, 0, ox, 0, -sy, oy + grid.ny * sy)
    # without this photometric interpretation, four bands of bytes would be colours
    profile: dict[str, Any] = {"count": len(maps), "photometric": "minisblack"}
    if facies or any(np.isnan(values).any() for values in maps.values()):
        profile["nodata"] = UNKNOWN if facies else np.nan
    profile |= {
        "height": grid.ny,
        "width": grid.nx,
        "dtype": kind,
        "transform": north_west,
        "compress": "deflate",
    }
    if grid.crs:
        with broken(f"crs = {shown(grid.crs)} is unknown to GDAL", remedy="correct it"):
            profile["crs"] = rasterio.CRS.from_user_input(grid.crs)
    with rasterio.MemoryFile() as memory:
        with memory.open(driver="GTiff", interleave="band", **profile) as file:
            for band, (name, values) in enumerate(maps.items(), start=1):
                values = np.nan_to_num(values, nan=UNKNOWN) if facies else values
                file.write(values[::-1].astype(kind), band)
                file.set_band_description(band, name)
                file.update_tags(band, **{f"facies_{code}": facies[code] for code in facies})
            if facies and colours and len(maps) == 1:  # TIFF has none for several bands
                file.write_colormap(1, dict(zip(facies, map(getrgb, colours), strict=True)))
        return memory.read()


def _common_type(maps: Mapping[str, Array]) -> str:
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


def _fit(maps: Mapping[str, Array], most: int) -> bool:
    """Return whether the values of all integer maps fit into a smaller type."""
    whole = [values for values in maps.values() if values.dtype.kind in "ui"]
    return all(-most < int(v.min()) and int(v.max()) < most for v in whole)
