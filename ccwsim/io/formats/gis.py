"""Read points from GeoJSON and, with the package pyogrio, from GeoPackage and Shapefile."""

import json
import struct
from io import BytesIO
from itertools import chain
from math import inf, nan
from typing import Any
from zipfile import ZipFile

import numpy as np

from ccwsim.io.archive import opened_archive
from ccwsim.io.data_file import DataFile, broken, printable
from ccwsim.io.formats.tables import table_of
from ccwsim.io.limits import check, check_table, limits
from ccwsim.model.errors import CCWSIMError, refused
from ccwsim.model.extras import needs

GIS_FILES = {"geopackage": "GeoPackage", "shapefile": "Shapefile", "shp": "Shapefile"}
"""Names of the formats that pyogrio reads."""


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
    return table_of("GeoJSON points", name, names, columns, numbers, counted="feature")


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
    if kind == "shp":
        raise refused("shapefile_without_table", name=name)
    pyogrio = needs("pyogrio")
    if kind == "shapefile":
        content = _parts(content, name)
    with broken(f"{name}: the file cannot be read", remedy="save it again"):
        info = pyogrio.read_info(content)
        check(name, points=int(info["features"]))
        check_table(name, max(int(info["features"]), 1), len(info["fields"]) + 2)
        most = limits().points + 1
        meta, _, shapes, columns = pyogrio.raw.read(content, max_features=most)
        places = [_point(shape, name, k) for k, shape in enumerate(shapes, start=1)]
    names, columns = ["x", "y", *meta["fields"]], [*np.array(places).reshape(-1, 2).T, *columns]
    numbers = np.arange(1, len(places) + 1)
    kind_name = f"{GIS_FILES[kind]} points"
    return table_of(kind_name, name, names, columns, numbers, counted="feature")


def _parts(content: bytes, name: str) -> bytes:
    """Return a zip of one Shapefile without its coordinate system, whose reading can be slow."""
    with opened_archive(content, name) as archive:
        stem = next(m[:-4] for m in archive.infos if m.lower().endswith(".shp"))
        parts = {m: m[-4:].lower() for m in archive.infos if m[:-4] == stem}
        parts = {m: end for m, end in parts.items() if end in (".shp", ".shx", ".dbf", ".cpg")}
        archive.check(list(parts))
        packed = BytesIO()
        with ZipFile(packed, "w") as shapefile:
            for member, end in parts.items():
                shapefile.writestr(f"points{end}", archive.read(member))
    return packed.getvalue()


def _point(shape: bytes | None, name: str, number: int) -> tuple[float, float]:
    """Return x and y of a point in well-known binary; z and m may follow and are ignored."""
    if shape is None:
        return nan, nan
    if len(shape) >= 21:
        order = "<" if shape[0] == 1 else ">"
        kind, x, y = struct.unpack_from(f"{order}Idd", shape, 1)
        if kind & 0xFFFF in (1, 1001, 2001, 3001):
            return x, y
        n = struct.unpack_from(f"{order}I", shape, 5)[0]
        if kind & 0xFFFF in (4, 1004, 2004, 3004) and n == 1:
            return _point(shape[9:], name, number)
    raise CCWSIMError(f"{name}, feature {number}: a single point is needed; save points")
