"""A small valid file of every format that is read, made in code."""

from __future__ import annotations

import json
import struct
from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy.io import savemat

import ccwsim.io as cio
from ccwsim import Ensemble, Grid, HardData, Parameters, TrainingImage

FACIES = np.array([[0, 0, 1, 2], [0, 1, 1, 2], [2, 1, 0, 0]])
"""Shape (3, 4), row 0 at the south, without any symmetry."""

POINTS = np.array([[0, 3, 2], [1, 1, 1], [2, 0, 2], [2, 3, 0]])
"""Row, col, facies; they agree with FACIES."""


def text_values(values: NDArray) -> bytes:
    return b"\n".join(b" %.7e" % v for v in np.ravel(values)) + b"\n"


def sgems(grid: NDArray = FACIES, header: bytes | None = None) -> bytes:
    sizes = header or b"%d %d 1" % grid.shape[::-1]
    return sizes + b"\n1\nfacies\n" + text_values(grid)


def gslib_table(grid: NDArray = FACIES) -> bytes:
    return b"a title of the file\n1\nfacies\n" + text_values(grid)


def two_variables() -> bytes:
    rows = np.stack([FACIES.ravel() / 10, FACIES.ravel()], axis=1)
    lines = b"\n".join(b"%g %g" % tuple(row) for row in rows)
    return b"4 3 1\n2\nporosity\nfacies\n" + lines + b"\n"


def ensemble() -> Ensemble:
    image = TrainingImage(FACIES, name="sample", facies_names=["mud", "sand", "lime"])
    grid = Grid(3, 4, cell_size=(10.0, 20.0), origin=(350000.0, 4505000.0))
    data = HardData(POINTS[:, :2], POINTS[:, 2])
    stack = np.stack([FACIES, (FACIES + 1) % 3]).astype(np.uint8)
    status = np.array([[0, 0, -1, 8], [-2, -2, -2, -2]], np.int16)
    given = image, grid, Parameters(template_size=16, refine=False), data, 42
    return Ensemble(*given, stack, np.array([0.1, 0.2]), 0.5, status, np.array([3, 5]))


def realizations(kind: str) -> bytes:
    return cio.realizations_as_bytes(ensemble(), kind)


def esri(grid: NDArray = FACIES) -> bytes:
    head = b"ncols %d\nnrows %d\nxllcorner 10\nyllcorner 20\n" % grid.shape[::-1]
    rows = "\n".join(" ".join(map(str, row)) for row in grid[::-1])
    return head + b"cellsize 5\nNODATA_value -9999\n" + rows.encode() + b"\n"


def matrix(grid: NDArray = FACIES, separator: str = " ") -> bytes:
    return "\n".join(separator.join(map(str, row)) for row in grid[::-1]).encode() + b"\n"


def npy(array: NDArray = FACIES) -> bytes:
    content = BytesIO()
    np.save(content, array)
    return content.getvalue()


def npz(**arrays: NDArray) -> bytes:
    content = BytesIO()
    np.savez_compressed(content, **(arrays or {"ti": FACIES}))
    return content.getvalue()


def mat(compress: bool = False, **arrays: object) -> bytes:
    content = BytesIO()
    savemat(content, arrays or {"ti": FACIES.astype(float)}, do_compression=compress)
    return content.getvalue()


def picture(format: str = "PNG", grid: NDArray = FACIES, **options: object) -> bytes:
    """RGB: black, a middle green, white, the south at the bottom."""
    colours = np.array([[0, 0, 0], [40, 160, 60], [255, 255, 255]], np.uint8)
    content = BytesIO()
    Image.fromarray(colours[grid][::-1]).save(content, format, **options)
    return content.getvalue()


def grey_tiff() -> bytes:
    content = BytesIO()
    Image.fromarray(FACIES[::-1].astype(np.float32)).save(content, "TIFF")
    return content.getvalue()


def csv(header: str = "row,col,facies", rows: NDArray = POINTS, separator: str = ",") -> bytes:
    lines = [header.replace(",", separator)]
    lines += [separator.join(f"{v:g}" for v in row) for row in rows]
    return "\n".join(lines).encode() + b"\n"


def geo_eas_points(title: bytes = b"data", origin: tuple[float, float] = (0.5, 0.5)) -> bytes:
    rows = [(c + origin[0], r + origin[1], 0, code) for r, c, code in POINTS]
    lines = b"\n".join(b"%g %g %g %g" % row for row in rows)
    return title + b"\n4\nX\nY\nZ\nvar\n" + lines + b"\n"


def geojson(codes: Sequence[object] = tuple(POINTS[:, 2].tolist())) -> bytes:
    features = [
        {
            "type": "Feature",
            "geometry": {"type": "Point", "coordinates": [c + 0.5, r + 0.5, 12.5]},
            "properties": {"name": f"W{r}", "facies": code},
        }
        for (r, c, _), code in zip(POINTS.tolist(), codes, strict=True)
    ]
    return json.dumps({"type": "FeatureCollection", "features": features}).encode()


def petrel() -> bytes:
    rows = "\n".join(f"{c + 0.5} {r + 0.5} -1500.0 {code}" for r, c, code in POINTS)
    head = "# Petrel Points with attributes\nVERSION 1\nBEGIN HEADER\nX\nY\nZ\nfacies\nEND HEADER\n"
    return f"{head}{rows}\n".encode()


def las() -> bytes:
    rows = "\n".join(f"  {c + 0.5}  {r + 0.5}  100.0  {code}" for r, c, code in POINTS)
    head = """~VERSION INFORMATION
 VERS.   2.0 : CWLS LOG ASCII STANDARD
~WELL INFORMATION
 NULL.  -999.25 : NULL VALUE
~CURVE INFORMATION
 X   .M  : EASTING
 Y   .M  : NORTHING
 DEPT.M  : DEPTH
 FACIES. : CODE
~A
"""
    return f"{head}{rows}\n  0.5 0.5 101.0 -999.25\n".encode()


def in_utm() -> bytes:
    """Wells as a German spreadsheet saves them: names, thousands, units, decimal commas."""
    rows = (
        ("B 1", "436.120,5", "4.505.250,0", "1.012,5", "Sand"),
        ("B 2", "439.880,0", "4.509.100,5", "998,0", "Ton"),
        ("B 3", "437.500,0", "4.507.000,0", "1.001,25", "sand"),
        ("B 4", "438.000,0", "4.506.000,0", "", ""),
    )
    lines = ["Bohrung;Rechtswert;Hochwert;Höhe;Fazies", ";[m];[m];[m];", *map(";".join, rows)]
    return "\r\n".join([*lines, ""]).encode("cp1252")


def with_gaps(missing: float = np.nan) -> NDArray:
    grid = np.full(FACIES.shape, missing)
    grid[POINTS[:, 0], POINTS[:, 1]] = POINTS[:, 2]
    return grid


def crlf(content: bytes) -> bytes:
    return content.replace(b"\n", b"\r\n")


def training_images() -> dict[str, bytes]:
    """One file a format, all of them FACIES and readable without a choice."""
    ti = TrainingImage(FACIES)
    return {
        "sgems": sgems(),
        "sgems written": cio.training_image_as_bytes(ti, "sgems"),
        "geone": sgems(header=b"4 3 1 2.0 2.0 1.0 100 200 0"),
        "sized gslib": b"title\n1 4 3 1\nfacies\n" + text_values(FACIES),
        "esri": esri(),
        "matrix": matrix(),
        "comma matrix": matrix(separator=","),
        "npy": npy(),
        "npy by columns": npy(np.asfortranarray(FACIES.astype(">f8"))),
        "npz": npz(),
        "mat": mat(),
        "packed mat": mat(compress=True),
        "png": picture(),
        "png written": cio.training_image_as_bytes(ti, "png"),
        "bmp": picture("BMP"),
        "gif": picture("GIF"),
        "tiff": picture("TIFF", compression="tiff_lzw"),
        "tiff of numbers": grey_tiff(),
        "several variables": npz(ti=FACIES, other=FACIES.T),
    }


def hard_data() -> dict[str, bytes]:
    """One file a format, all of them POINTS and readable without a choice."""
    world = np.stack([POINTS[:, 1] + 0.5, POINTS[:, 0] + 0.5, POINTS[:, 2]], axis=1)
    return {
        "row col": csv(),
        "x y": csv("X,Y,Code", world),
        "semicolons, decimal commas": csv("x,y,facies", world, ";").replace(b".", b","),
        "tabs": csv("Easting [m],Northing [m],value", world, "\t"),
        "spaces": csv("x,y,code", world, " "),
        "units below": csv("x,y,code", world, "\t").replace(b"\n", b"\nm\tm\t-\n", 1),
        "geojson": geojson(),
        "petrel": petrel(),
        "las": las(),
        "no header": csv("", world).lstrip(b"\n"),
        "names": csv("well,x,y,facies", world)
        .replace(b"\n", b"\nW,")
        .replace(b"\nW,\n", b"\n")[:-2],
        "geo-eas": geo_eas_points(),
        "geo-eas counted": geo_eas_points(b"4"),
        "grid": sgems(with_gaps(-999)),
        "esri grid": esri(with_gaps(-9999)),
        "npy list": npy(POINTS),
        "npy grid": npy(with_gaps()),
        "npz of cells and facies": npz(cells=POINTS[:, :2], facies=POINTS[:, 2]),
        "npz grid": npz(hd=with_gaps(-99), ti=FACIES),
        "mat": mat(hd=with_gaps(), ti=FACIES.astype(float)),
        "packed mat": mat(compress=True, hd=with_gaps()),
    }


def gis(ending: str) -> bytes:
    """POINTS as pyogrio writes them, which must be installed: `gpkg`, or `shz` for a Shapefile."""
    import pyogrio

    shapes = [struct.pack("<BIdd", 1, 1, c + 0.5, r + 0.5) for r, c, _ in POINTS]
    fields = [np.array(["B 1", "B 2", "B 3", "B 4"], object), POINTS[:, 2].astype(np.int32)]
    with TemporaryDirectory() as folder:
        path = Path(folder) / f"wells.{ending}"
        named = {"field_data": fields, "fields": ["well", "facies"], "crs": "EPSG:25832"}
        pyogrio.raw.write(path, np.array(shapes, object), geometry_type="Point", **named)
        return path.read_bytes()
