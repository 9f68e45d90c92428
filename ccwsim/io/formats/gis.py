"""Read points from GeoJSON and, with the package pyogrio, from GeoPackage and Shapefile."""

from __future__ import annotations

import json
import struct
from dataclasses import replace
from io import BytesIO
from typing import Any, NamedTuple
from zipfile import ZipFile

import numpy as np

from ccwsim.io.archive import opened_archive
from ccwsim.io.data_file import DataFile, broken, distinct_names, printable
from ccwsim.io.limits import MAX_VARIABLES, check_cells, limits
from ccwsim.model.errors import CCWSIMError

GIS_FILES = {"geopackage": "GeoPackage", "shapefile": "Shapefile", "shp": "Shapefile"}
"""Names of the formats that pyogrio reads."""


class Point(NamedTuple):
    """A point, its properties, and the number of its feature, counted from 1."""

    number: int
    x: float
    y: float
    values: dict[str, Any]


def is_geojson(text: bytes) -> bool:
    """Return whether a text looks like GeoJSON.

    Examples
    --------
    >>> is_geojson(b'{"type": "FeatureCollection", "features": []}'), is_geojson(b"{1}")
    (True, False)
    """
    return text[:64].lstrip().startswith(b"{") and b'"features"' in text


def read_geojson(text: bytes, name: str) -> DataFile:
    """Return the points of a GeoJSON text as a table of x, y and one column per property.

    Examples
    --------
    >>> text = b'{"features": [{"geometry": {"type": "Point", "coordinates": [1, 2]}, '
    >>> file = read_geojson(text + b'"properties": {"facies": "sand"}}]}', "a.geojson")
    >>> file.names, file.words
    (('x', 'y', 'facies'), {'facies': ('sand',)})
    """
    n = text.count(b",") + text.count(b"[") + text.count(b"{")  # estimate of the number of objects
    if n > 2 * limits().fields:
        raise CCWSIMError(f"{name}: {n} values in JSON are too many; save the points as CSV")
    kinds = ValueError, TypeError, KeyError, AttributeError, RecursionError
    with broken(f"{name} is not a GeoJSON file of points; save points as GeoJSON", *kinds):
        features = enumerate(json.loads(text)["features"], start=1)
        points = [point for k, feature in features for point in _points(feature, name, k)]
    return _table("GeoJSON points", name, points)


def _points(feature: Any, name: str, number: int) -> list[Point]:
    geometry, values = feature["geometry"], feature.get("properties") or {}
    if geometry is None:
        return [Point(number, float("nan"), float("nan"), dict(values))]
    kind = geometry["type"]
    if kind not in ("Point", "MultiPoint"):
        raise CCWSIMError(
            f"{name}, feature {number}: the geometry is a {printable(str(kind)[:30])}, not a "
            "Point; save points"
        )
    places = [geometry["coordinates"]] if kind == "Point" else geometry["coordinates"]
    return [Point(number, _finite(x), _finite(y), dict(values)) for x, y, *_ in places]


def _finite(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise TypeError("a coordinate is not a number")
    try:
        return float(value)
    except OverflowError:
        return float("inf")


def is_shapefile_zip(content: bytes) -> bool:
    """Return whether the directory of a zip lists a .shp file, without unpacking the zip."""
    entries = content[-(2**20) :].lower()
    return b"pk\x01\x02" in entries and b".shp" in entries.split(b"pk\x01\x02", 1)[1]


def read_gis(content: bytes, name: str, kind: str) -> DataFile:
    """Return the points of a GeoPackage or a zipped Shapefile as a table.

    Raises `CCWSIMError` if pyogrio is not installed, or if the file contains no points.
    """
    if kind == "shp":
        raise CCWSIMError(
            f"{name}: a .shp file is not enough without its table (.dbf); put all files of the "
            "Shapefile into one zip"
        )
    try:
        from pyogrio import raw, read_info
    except ImportError as error:
        raise CCWSIMError(
            f"{name}: {GIS_FILES[kind]} files need the package pyogrio; install it "
            "(pip install 'ccwsim[files]'), or save the points as GeoJSON or CSV"
        ) from error
    if kind == "shapefile":
        content = _parts(content, name)
    with broken(f"{name}: the file cannot be read", remedy="save it again"):
        info = read_info(content)
        n, fields = int(info["features"]), list(info["fields"])
        if n > limits().points or len(fields) > MAX_VARIABLES:
            raise CCWSIMError(
                f"{name}: {n} points with {len(fields)} columns exceed the limits of "
                f"{limits().points} points or {MAX_VARIABLES} columns; leave some out"
            )
        check_cells(name, (max(n, 1) * (len(fields) + 2),))
        meta, _, shapes, columns = raw.read(content, max_features=limits().points + 1)
        places = [_point(shape, name, k) for k, shape in enumerate(shapes, start=1)]
    keys = [str(key) for key in meta["fields"]]
    rows = zip(*(column.tolist() for column in columns), strict=True) if keys else [()] * n
    points = [
        Point(k, x, y, dict(zip(keys, row, strict=True)))
        for k, ((x, y), row) in enumerate(zip(places, rows, strict=True), start=1)
    ]
    return _table(f"{GIS_FILES[kind]} points", name, points)


def _parts(content: bytes, name: str) -> bytes:
    """Return a zip of the required files of one Shapefile; apply size limits when unpacking.

    The coordinate system is omitted, because reading an invalid coordinate system takes seconds.
    """
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
        return float("nan"), float("nan")
    if len(shape) >= 21:
        order = "<" if shape[0] == 1 else ">"
        kind, x, y = struct.unpack_from(f"{order}Idd", shape, 1)
        if kind & 0xFFFF in (1, 1001, 2001, 3001):
            return x, y
        n = struct.unpack_from(f"{order}I", shape, 5)[0]
        if kind & 0xFFFF in (4, 1004, 2004, 3004) and n == 1:
            return _point(shape[9:], name, number)
    raise CCWSIMError(f"{name}, feature {number}: a single point is needed; save points")


def _table(kind: str, name: str, points: list[Point]) -> DataFile:
    if not points:
        raise CCWSIMError(f"{name}: the file contains no points")
    properties = dict.fromkeys(str(key) for point in points for key in point.values)
    keys = distinct_names(["x", "y", *properties])
    if len(keys) > MAX_VARIABLES:
        raise CCWSIMError(f"{name}: {len(keys)} columns exceed the limit of {MAX_VARIABLES}")
    check_cells(name, (len(points) * len(keys),))
    variables = {"x": np.array([p.x for p in points]), "y": np.array([p.y for p in points])}
    words: dict[str, tuple[str, ...]] = {}
    for key, label in zip(keys[2:], properties, strict=True):
        fields = [point.values.get(label) for point in points]
        if all(value is None or isinstance(value, (bool, int, float)) for value in fields):
            variables[key] = np.array([np.nan if v is None else _finite(+v) for v in fields])
        else:
            words[key] = tuple("" if value is None else str(value)[:200] for value in fields)
    lines = np.array([point.number for point in points], dtype=np.int64)
    table = DataFile(kind, name, variables, is_table=True, lines=lines, words=words)
    return replace(table, columns=tuple(keys), counted="feature")
