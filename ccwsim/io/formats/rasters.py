"""Read rasters with coordinates by GDAL (GeoTIFF, Surfer, ZMap, GRASS), and write GeoTIFF."""

import warnings
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ccwsim.io.data_file import DataFile, Geometry, broken, distinct_names
from ccwsim.io.limits import check, check_cells
from ccwsim.model.errors import CCWSIMError, shown
from ccwsim.model.extras import needs
from ccwsim.model.grid import Grid

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
        return DataFile(DRIVERS[kind][0], name, variables, missing=missing, **_geometry(first))


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


def _geometry(page: Any) -> dict[str, Any]:
    """Return CRS, first row, cell size and origin; a rotated raster has no cell size."""
    transform = page.transform
    place = Geometry(crs="" if page.crs is None else _code_of(page.crs))
    if not (
        transform.is_identity or transform.b or transform.d or transform.a <= 0 or not transform.e
    ):
        origin = transform.c, min(transform.f, transform.f + page.height * transform.e)
        place = Geometry((transform.a, abs(transform.e)), origin, place.crs)
    return {"geometry": place, "south_first": not transform.is_identity and transform.e > 0}


def code_and_wkt(crs_text: str) -> tuple[str, str]:
    """Return a coordinate system as the authority's code and as WKT; otherwise the given text."""
    with suppress(Exception):
        crs = needs("rasterio").CRS.from_user_input(crs_text)
        return _code_of(crs), crs.to_wkt()
    return crs_text, crs_text


def _code_of(crs: Any) -> str:
    """Return the authority's code of a coordinate system if it has one, otherwise its WKT."""
    code = crs.to_string()
    return code if len(code) <= MAX_DIGITS else crs.to_wkt()


def geotiff_as_bytes(maps: Mapping[str, NDArray], grid: Grid) -> bytes:
    """Return maps as a GeoTIFF, north up, with one named band per map and a common data type."""
    if grid.nz is not None:
        raise CCWSIMError("a GeoTIFF can show maps, not volumes; write vti, npz or gslib")
    rasterio = needs("rasterio")
    (sx, sy), (ox, oy) = grid.cell_size, grid.origin
    kind = _common_type(maps)
    north_west = rasterio.Affine(sx, 0, ox, 0, -sy, oy + grid.ny * sy)
    profile: dict[str, Any] = {"height": grid.ny, "width": grid.nx, "count": len(maps)}
    if any(np.isnan(values).any() for values in maps.values()):
        profile["nodata"] = np.nan
    profile |= {"dtype": kind, "transform": north_west, "compress": "deflate"}
    if grid.crs:
        with broken(f"crs = {shown(grid.crs)} is unknown to GDAL", remedy="correct it"):
            profile["crs"] = rasterio.CRS.from_user_input(grid.crs)
    with rasterio.MemoryFile() as memory:
        with memory.open(driver="GTiff", interleave="band", **profile) as file:
            for band, (name, values) in enumerate(maps.items(), start=1):
                file.write(values[::-1].astype(kind), band)
                file.set_band_description(band, name)
        return memory.read()


def _common_type(maps: Mapping[str, NDArray]) -> str:
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
