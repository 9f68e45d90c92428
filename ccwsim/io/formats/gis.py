"""Read points from GeoJSON and, with the package pyogrio, from GeoPackage and Shapefile."""

import json
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace
from glob import escape
from io import BytesIO
from itertools import chain
from math import inf, nan
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np

from ccwsim.io.archive import opened_archive
from ccwsim.io.data_file import DataFile, broken, printable
from ccwsim.io.formats.tables import make_table
from ccwsim.io.limits import check, check_table, limits
from ccwsim.model import CCWSIMError, needs, refused

GIS_FILES = {"geopackage": "GeoPackage", "shapefile": "Shapefile", "shp": "Shapefile"}
"""Names of the formats that pyogrio reads."""
_PARTS = (".shp", ".shx", ".dbf", ".cpg", ".prj")  # ends of names of the parts that are read


def read_geojson(text: bytes, name: str) -> DataFile:
    """Return the points of a GeoJSON text as a table of x, y and one column per property."""
    n = text.count(b",") + text.count(b"[") + text.count(b"{")  # estimate of the number of objects
    check(name, fields=n // 2)
    kinds = ValueError, TypeError, KeyError, AttributeError, RecursionError
    with broken(f"{name} is not a GeoJSON file of points; save points as GeoJSON", kinds):
        features = json.loads(text)["features"]
        places = [_places(feature["geometry"], name, k) for k, feature in enumerate(features, 1)]
        values = [dict(feature.get("properties") or {}) for feature in features]
    counts = np.array([len(points) for points in places], np.int64)
    numbers = np.repeat(np.arange(1, len(features) + 1), counts)
    keys = list(dict.fromkeys(str(key) for properties in values for key in properties))
    x_and_y = np.array([place for points in places for place in points]).reshape(-1, 2).T
    columns = (
        np.fromiter((values[k - 1].get(key) for k in numbers), object, len(numbers)) for key in keys
    )
    columns = chain(x_and_y, columns)  # made one by one, after their number is checked
    names = ["x", "y", *keys]
    return make_table("GeoJSON points", name, names, columns, numbers, counted="feature")


def points_as_geojson(columns: Mapping[str, Sequence], crs: str) -> bytes:
    """Return points as GeoJSON with a CRS that GDAL reads, from columns x, y and properties."""
    features = [
        {
            "type": "Feature",
            "geometry": {"type": "Point", "coordinates": row[:2]},
            "properties": dict(zip([*columns][2:], row[2:], strict=True)),
        }
        for row in zip(*columns.values(), strict=True)
    ]
    system = {"crs": {"type": "name", "properties": {"name": crs}}} if crs else {}
    return json.dumps({"type": "FeatureCollection", **system, "features": features}).encode()


def _places(geometry: Any, name: str, number: int) -> list[tuple[float, float]]:
    """Return x and y of the points of a feature; a feature without any coordinates has one, NaN."""
    coordinates = geometry.get("coordinates", geometry.get("geometries")) if geometry else None
    if all(value is None for value in coordinates or ()):
        return [(nan, nan)]
    kind = geometry["type"]
    if kind not in ("Point", "MultiPoint"):
        raise CCWSIMError(
            f"{name}, feature {number}: the geometry is a {printable(str(kind)[:30])}, not a "
            "Point; save points"
        )
    places = [geometry["coordinates"]] if kind == "Point" else geometry["coordinates"]
    return [(_number(x), _number(y)) for x, y, *_ in places]


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise TypeError("a coordinate is not a number")
    try:
        return float(value)
    except OverflowError:
        return inf


def is_shapefile_zip(content: bytes) -> bool:
    """Return whether the directory of a zip lists a .shp file, without unpacking the zip."""
    entries = content[-(2**20) :].lower()
    return b"pk\x01\x02" in entries and b".shp" in entries.split(b"pk\x01\x02", 1)[1]


def read_gis(content: bytes, name: str, kind: str) -> DataFile:
    """Return the points of a GeoPackage or a zipped Shapefile as a table."""
    return replace(
        read_geojson(as_geojson(content, name, kind)[0], name), kind=f"{GIS_FILES[kind]} points"
    )


def as_geojson(content: bytes, name: str, kind: str) -> tuple[bytes, str]:
    """Return a GeoPackage or a zipped Shapefile as GeoJSON, and its coordinate system."""
    if kind == "shp":
        raise refused("shapefile_without_table", name=name)
    crs, text, pyogrio = "", BytesIO(), needs("pyogrio")
    if kind == "shapefile":
        content, crs = _parts(content, name)
    reading = broken(f"{name}: the file cannot be read", remedy="save it again")
    with reading, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of missing systems and unusual names of files
        info = pyogrio.read_info(content)
        check(name, points=int(info["features"]))
        check_table(name, max(int(info["features"]), 1), len(info["fields"]) + 2)
        most = limits().points + 1
        meta, _, shapes, columns = pyogrio.raw.read(content, max_features=most)
        look = {"driver": "GeoJSON", "geometry_type": "Unknown"}
        pyogrio.raw.write(text, shapes, columns, meta["fields"], **look)
    return text.getvalue(), crs or info["crs"] or ""


def pack_shapefile(path: Path) -> bytes:
    """Return a zip of a Shapefile and the files beside it that belong to it."""
    packed = BytesIO()
    with ZipFile(packed, "w") as shapefile:
        for part in path.parent.glob(f"{escape(path.stem)}.*"):
            if part.suffix.lower() in _PARTS:
                shapefile.write(part, f"{path.stem}{part.suffix.lower()}")
    return packed.getvalue()


def _parts(content: bytes, name: str) -> tuple[bytes, str]:
    """Return a zip of one Shapefile without its coordinate system, and the coordinate system.

    GDAL does not get the coordinate system, because reading it can be slow.
    """
    with opened_archive(content, name) as archive:
        stem = next(m[:-4] for m in archive.infos if m.lower().endswith(".shp"))
        parts = {m: m[-4:].lower() for m in archive.infos if m[:-4] == stem}
        parts = {m: end for m, end in parts.items() if end in _PARTS}
        archive.check(list(parts))
        contents = {end: archive.read(member) for member, end in parts.items()}
        crs = contents.pop(".prj", b"").decode("utf-8", "replace").strip()
        packed = BytesIO()
        with ZipFile(packed, "w") as shapefile:
            for end, part in contents.items():
                shapefile.writestr(f"points{end}", part)
    return packed.getvalue(), crs
