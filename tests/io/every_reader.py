"""The same cells as a file of every kind, by the name of the reader."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from importlib.util import find_spec
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy.io import savemat

from ccwsim import Grid
from ccwsim.io import maps_as_bytes
from tests.io import sample_files as sample

CELLS = np.arange(48).reshape(6, 8) % 3
"""Shape (6, 8), row 0 in the south."""
GRID = Grid(*CELLS.shape)
NEEDS = {
    **{"excel": "openpyxl", "netcdf": "xarray", "hdf5": "h5py", "tiff": "rasterio"},
    **dict.fromkeys(("surfer text", "surfer 6", "surfer 7", "zmap", "grass"), "rasterio"),
    **dict.fromkeys(("geopackage", "shapefile"), "pyogrio"),
}
"""Packages that readers need."""


def _places(values: NDArray) -> list[tuple[float, float, float]]:
    return [(x + 0.5, y + 0.5, float(values[y, x])) for y, x in np.ndindex(*values.shape)]


def _words(values: NDArray) -> str:
    return "\n".join(" ".join(f"{v:.9g}" for v in row) for row in values)


def _matlab4(values: NDArray) -> bytes:
    content = BytesIO()
    savemat(content, {"ti": values}, format="4")
    return content.getvalue()


def _map(kind: str) -> Callable[[NDArray], bytes]:
    return lambda values: maps_as_bytes({"facies": values}, GRID, kind)


def _hdf5(values: NDArray) -> bytes:
    import h5py

    content = BytesIO()
    with h5py.File(content, "w") as file:
        file["facies"] = values
    return content.getvalue()


def _excel(values: NDArray) -> bytes:
    import openpyxl

    book, content = openpyxl.Workbook(), BytesIO()
    sheet = book.active
    assert sheet is not None
    for row in [("x", "y", "facies"), *_places(values)]:
        sheet.append(row)
    book.save(content)
    return content.getvalue()


def _surfer(values: NDArray) -> bytes:
    head = b"DSBB" + struct.pack("<hh6d", 8, 6, 0.5, 7.5, 0.5, 5.5, 0, 2)
    return head + values.astype("<f4").tobytes()


def _surfer7(values: NDArray) -> bytes:
    grid = struct.pack("<ii8d", 6, 8, 0.5, 0.5, 1, 1, 0, 2, 0, 1.70141e38)
    head = b"DSRB" + struct.pack("<ii", 4, 2) + b"GRID" + struct.pack("<i", len(grid)) + grid
    return head + b"DATA" + struct.pack("<i", values.size * 8) + values.astype("<f8").tobytes()


def _sgems_text(text: str) -> bytes:
    return struct.pack(">I", len(text) + 1) + text.encode() + b"\0"


def sgems(values: NDArray, cell: float = 1.0, centre: float = 0.5) -> bytes:
    """Return values (ny, nx) as a binary grid of SGeMS, in which the origin is a cell centre."""
    words = (_sgems_text("Cgrid"), _sgems_text("grid"), struct.pack(">i", 100))
    sizes = struct.pack(">3I6fI", *values.shape[::-1], 1, *[cell] * 3, *[centre] * 3, 1)
    content = b"\xb2\x11\x17\x5d" + b"".join(words) + sizes + _sgems_text("facies")
    return content + np.where(np.isnan(values), -9966699, values).astype(">f4").tobytes()


def sgems_points(values: NDArray) -> bytes:
    """Return values (ny, nx) as a binary set of points of SGeMS, at the centres of cells."""
    words = (_sgems_text("Point_set"), _sgems_text("wells"), struct.pack(">i", 100))
    places = np.array(_places(values))
    content = b"\xb2\x11\x17\x5d" + b"".join(words) + struct.pack(">2I", len(places), 1)
    content += _sgems_text("facies") + (places * [1, 1, 0]).astype(">f4").tobytes()
    return content + places[:, 2].astype(">f4").tobytes()


def _zmap(values: NDArray) -> bytes:
    head = "! facies\n@FACIES, GRID, 8\n20, 1E+30, , 4, 1\n6, 8, 0.5, 7.5, 0.5, 5.5\n0, 0, 0\n@\n"
    columns = ("".join(f"{v:20.7E}" for v in values[::-1, k]) for k in range(8))
    return (head + "\n".join(columns) + "\n").encode()


def _gis(ending: str) -> Callable[[NDArray], bytes]:
    def written(values: NDArray) -> bytes:
        from pyogrio import raw

        x, y, codes = zip(*_places(values), strict=True)
        shapes = np.array([struct.pack("<BIdd", 1, 1, *place) for place in zip(x, y, strict=True)])
        with TemporaryDirectory() as folder:
            path = Path(folder) / f"points.{ending}"
            columns = {"field_data": [np.array(codes)], "fields": ["facies"], "crs": "EPSG:32632"}
            raw.write(path, shapes.astype(object), geometry_type="Point", **columns)
            return path.read_bytes()

    return written


def _geojson(values: NDArray) -> bytes:
    features = [
        {
            "type": "Feature",
            "geometry": {"type": "Point", "coordinates": place},
            "properties": {"facies": code},
        }
        for *place, code in _places(values)
    ]
    return json.dumps({"type": "FeatureCollection", "features": features}).encode()


def _holed(values: NDArray) -> bytes:
    """Return a picture in which all cells without a facies are transparent."""
    known = np.isin(values, (0, 1, 2))
    grey = np.where(known, values, 0).astype(np.uint8) * 100
    content = BytesIO()
    pixels = np.stack([grey, grey, grey, known.astype(np.uint8) * 255], axis=-1)
    Image.fromarray(pixels[::-1]).save(content, "PNG")
    return content.getvalue()


FILES: dict[str, Callable[[NDArray], bytes]] = {
    "picture": _holed,
    "npy": sample.npy,
    "npz": lambda values: sample.npz(ti=values),
    "matlab": lambda values: sample.mat(ti=values),
    "matlab 4": _matlab4,
    "vti": _map("vti"),
    "excel": _excel,
    "netcdf": _map("nc"),
    "hdf5": _hdf5,
    "tiff": _map("tif"),
    "surfer text": lambda v: f"DSAA\n8 6\n0.5 7.5\n0.5 5.5\n0 2\n{_words(v)}\n".encode(),
    "surfer 6": _surfer,
    "surfer 7": _surfer7,
    "zmap": _zmap,
    "grass": lambda v: (
        f"north: 6\nsouth: 0\neast: 8\nwest: 0\nrows: 6\ncols: 8\n{_words(v[::-1])}\n".encode()
    ),
    "geopackage": _gis("gpkg"),
    "shapefile": _gis("shz"),
    "esri": lambda v: f"ncols 8\nnrows 6\ncellsize 1\n{_words(v[::-1])}\n".encode(),
    "grdecl": lambda v: f"SPECGRID\n8 6 1 1 F /\nFACIES\n{_words(v[::-1])}\n/\n".encode(),
    "irap": lambda v: (
        f"-996 6 1 1\n0.5 7.5 0.5 5.5\n8 0 0 0\n0 0 0 0 0 0 0\n{_words(v)}\n".encode()
    ),
    "gslib": lambda v: f"8 6 1\n1\nfacies\n{_words(v.reshape(-1, 1))}\n".encode(),
    "sgems": sgems,
    "geojson": _geojson,
    "table": lambda v: b"x,y,facies\n" + b"\n".join(b"%g,%g,%.9g" % p for p in _places(v)),
}
"""For each reader, a function that writes values (6, 8) as a file; a "shp" file is always
refused."""


def files() -> dict[str, bytes]:
    """Return a file of each kind whose required package is installed."""
    there = {kind for kind in FILES if kind not in NEEDS or find_spec(NEEDS[kind])}
    return {kind: FILES[kind](CELLS.astype(float)) for kind in FILES if kind in there}
