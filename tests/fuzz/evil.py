"""Handmade files that use all memory or all time, or that try to execute their content."""

from __future__ import annotations

import struct
from collections.abc import Callable

import numpy as np

from tests.fuzz.builders import (
    LAUGHS,
    MIB,
    SPRUNG,
    TIFF,
    colliding_points,
    element,
    endless_geopackage,
    geojson_of,
    geopackage_of_blobs,
    gif_of_frames,
    gif_of_remarks,
    jpeg_of_camera_data,
    jpeg_of_scans,
    large_gif,
    large_tile,
    locked_zip,
    lzma_zip,
    many_members,
    mat,
    matrix,
    nested_cells,
    npy_header,
    overlapping_zip,
    packed_bmp,
    packed_mat,
    packed_promise,
    packed_vti,
    pages,
    pickled,
    png,
    png_of_chunks,
    png_of_remarks,
    project_of,
    promising_shapefile,
    sgems_header,
    tiff,
    tiff_of_strips,
    tiff_of_tags,
    utf16_entities,
    vti,
    vti_of,
    wide_shapefile,
)
from tests.fuzz.mutations import zipped
from tests.io import sample_files as sample

_BLANK = (64 * MIB - 100) * b"\n"

EVIL_OF: dict[str, dict[str, Callable[[], bytes]]] = {
    "npy": {
        "npy of 10^9 cells": lambda: npy_header("(1000000, 1000)"),
        "npy of 10^30 cells": lambda: npy_header(
            "(10**10, 10**20)".replace("10**10", "1" + "0" * 10)
        ),
        "npy of negative size": lambda: npy_header("(-1, 5)"),
        "npy of 70 axes": lambda: npy_header(f"({'1,' * 70})") + bytes(8),
        "npy of digits": lambda: npy_header(f"({'9' * 5000}, 1)"),
        "npy of brackets": lambda: npy_header("(" * 9000),
        "npy of an expression": lambda: npy_header(f"(__import__('os').mkdir('{SPRUNG}'), 2)"),
        "npy of records": lambda: npy_header("(2, 2)", "[('a', '<f8'), ('b', '<i4')]") + bytes(48),
        "npy of arrays": lambda: npy_header("(2, 2)", "('<f8', (9999, 9999))") + bytes(64),
        "npy of long words": lambda: npy_header("(2, 2)", "'<U100000000'"),
        "npy of a long header": lambda: b"\x93NUMPY\x02\x00\xff\xff\xff\xff" + b"{" * 1000,
        "npy of long doubles": lambda: npy_header("(3, 3)", "'<f16'") + b"\xff" * 144,
        "npy at the limit": lambda: npy_header("(2000, 2000)", "'<f8'") + bytes(32_000_000),
        "npy over the limit": lambda: npy_header("(2001, 2000)", "'|u1'") + bytes(4_002_000),
        "pickle": pickled,
    },
    "npz": {
        "pickle in npz": lambda: zipped([("ti.npy", pickled())]),
        "zip bomb": lambda: zipped(
            [(f"{k}.npy", npy_header("(2000, 2000)") + bytes(60 * MIB)) for k in range(4)]
        ),
        "zip of one's own": lambda: zipped([("a.npy", zipped([("b.npy", bytes(MIB))]))]),
        "overlapping zip": overlapping_zip,
        "zip of a million members": lambda: many_members(1_000_000),
        "zip of paths": lambda: zipped([("../../ti.npy", sample.npy()), ("/ti.npy", sample.npy())]),
        "zip of long names": lambda: zipped(
            [("x" * 60_000 + ".npy", sample.npy()), ("\x07\n.npy", sample.npy())]
        ),
        "zip by lzma": lzma_zip,
        "locked zip": locked_zip,
    },
    "picture": {
        "png of 3.6e9 pixels": lambda: png(60_000, 60_000, data=b""),
        "png of no pixels": lambda: png(0, 5, data=b""),
        "png over the limit": lambda: png(2001, 2000),
        "png at the limit": lambda: png(2000, 2000),
        "png of remarks": png_of_remarks,
        "png of chunks": png_of_chunks,
        "jpeg of scans": lambda: jpeg_of_scans(20_000),
        "jpeg of camera data": jpeg_of_camera_data,
        "gif of remarks": gif_of_remarks,
        "gif of frames": gif_of_frames,
        "gif of 4e9 pixels": large_gif,
        "gif without frames": lambda: b"GIF89a" + bytes(7) + b";",
        "bmp of runs": lambda: packed_bmp(2000),
        "tiff of tags": tiff_of_tags,
        "tiff of strips": tiff_of_strips,
        "tiff of a large tile": large_tile,
        "tiff that leads to itself": lambda: tiff(*TIFF)[:-4] + struct.pack("<I", 8),
        "tiff of jpeg": lambda: tiff(*TIFF[:3], (259, 3, 1, 7), TIFF[4]),
    },
    "matlab": {
        "mat of 10^18 cells": lambda: mat(matrix(struct.pack("<ii", 2**30, 2**30), b"")),
        "mat of a million axes": lambda: mat(matrix(struct.pack("<i", 2**30) * 10**6, b"")),
        "mat of negative size": lambda: mat(matrix(struct.pack("<ii", -3, -4), bytes(96))),
        "mat of many elements": lambda: mat(element(9, b"") * 2_000_000),
        "nested mat": lambda: nested_cells(3000),
        "packed mat that is a bomb": lambda: packed_promise(2, 2, 256 * MIB),
        "packed mat that promises": lambda: packed_promise(2**30, 2**30, 1000),
        "packed mat of another kind": lambda: packed_mat(struct.pack("<II", 9, 2**31), 200 * MIB),
        "packed mat in itself": lambda: packed_mat(struct.pack("<II", 15, 1000), 1000),
    },
    "sgems": {
        "sgems of 10^18 cells": lambda: sgems_header(10**6, 10**6, 10**6),
        "sgems of many variables": lambda: sgems_header(2, 2, 2, n=2**31 - 1),
        "sgems of a long text": lambda: sgems_header(2, 2, 2)[:4] + b"\x7f\0\0\0Cgrid",
    },
    "vti": {
        "vti of elements": lambda: vti(b'<a b=""/>' * 7_000_000),
        "vti of nested elements": lambda: vti(b"<a>" * 20_000_000),
        "vti of attributes": lambda: vti(
            b"<a %s/>" % b" ".join(b'b%d=""' % k for k in range(4_000_000))
        ),
        "vti of a long attribute": lambda: vti(b'<a b="%s"/>' % (b"1 " * (30 * MIB))),
        "vti of pieces": lambda: vti(b"<Piece/>" * 7_000_000),
        "vti of arrays": lambda: vti_of(b'<DataArray type="Int8" Name="a"/>' * 1_500_000),
        "vti of words": lambda: vti_of(
            b'<DataArray type="Int8">%s</DataArray>' % (b"0 " * (30 * MIB))
        ),
        "vti of entities": lambda: vti(b"&l11;", LAUGHS),
        "vti of utf-16 entities": utf16_entities,
        "vti of another encoding": lambda: (
            b'<?xml version="1.0" encoding="utf-7"?>' + vti(b"+ADw-a+AD4-")
        ),
        "vti that unpacks": packed_vti,
    },
    "geopackage": {
        "geopackage without end": endless_geopackage,
        "geopackage of blobs": geopackage_of_blobs,
        "geopackage of zeros": lambda: b"SQLite format 3\0" + bytes(30 * MIB),
    },
    "shapefile": {
        "shapefile that promises": promising_shapefile,
        "shapefile of a wide table": wide_shapefile,
        "shapefile of zeros": lambda: zipped(
            [("a.shp", bytes(100 * MIB)), ("a.dbf", bytes(20 * MIB))]
        ),
    },
    "shp": {
        "shp alone": lambda: b"\0\0\x27\x0a" + b"\xff" * (60 * MIB),
    },
    "esri": {
        "esri of blank lines": lambda: b"ncols 4" + _BLANK,
        "esri of one name": lambda: b"ncols 4\n" * 8_000_000,
    },
    "gslib": {
        "text of many numbers": lambda: b"4000 4000 1\n1\na\n" + b"0\n" * 16_000_000,
        "text at the limit": lambda: b"2000 2000 1\n1\na\n" + b"0.5000000e+000\n" * 4_000_000,
        "text that promises": lambda: b"100000 100000 100\n1\nfacies\n0\n",
        "text that is wrong at its end": lambda: (
            b"2000 2000 1\n1\na\n" + b"0\n" * 3_999_999 + b"sand"
        ),
    },
    "geojson": {
        "geojson of brackets": lambda: b'{"features": ' + b"[" * 900_000,
        "geojson of features": lambda: b'{"features": [' + b"{}," * 300_000 + b"{}]}",
        "geojson of corners": lambda: geojson_of(
            [
                b'{"geometry": {"type": "Polygon", "coordinates": [[%s[1, 1]]]}}'
                % (b"[0, 0], " * 500_000)
            ]
        ),
        "geojson of polygons": lambda: geojson_of(
            [b'{"geometry": {"type": "Polygon", "coordinates": [[[0, 0], [9, 0], [0, 9]]]}}']
            * 20_000
        ),
        "geojson of collections": lambda: geojson_of([b'{"geometries": [' * 900 + b"]}" * 900]),
        "geojson of columns": lambda: geojson_of(
            b'{"geometry": {"type": "Point", "coordinates": [%d, 2]}, "properties": {"p%d": 1}}'
            % (k, k)
            for k in range(90_000)
        ),
        "geojson of points": lambda: geojson_of(
            b'{"geometry": {"type": "Point", "coordinates": [%d, 2]}, "properties": {"p": "%d"}}'
            % (k, k)
            for k in range(99_000)
        ),
        "geojson of digits": lambda: geojson_of(
            [b'{"geometry": {"type": "Point", "coordinates": [%s, 2]}}' % (b"9" * (16 * MIB))]
        ),
        "geojson of a word": lambda: geojson_of(
            [b'{"geometry": {"type": "%s"}}' % (b"\\ud800" * (10 * MIB))]
        ),
    },
    "table": {
        "text of one line": lambda: b"1 " * (32 * MIB - 1),
        "text of one word": lambda: b"1" * (64 * MIB - 1),
        "text of line ends": lambda: b"0" + _BLANK,
        "text of columns": lambda: b"x," * 2_000_000 + b"\n" + b"1," * 2_000_000,
        "matrix at the limit": lambda: (b"0 1 " * 1000 + b"\n") * 2000,
        "matrix of one column": lambda: b"0\n" * 4_000_000,
        "matrix with a word": lambda: (b"0 1 " * 1000 + b"\n") * 1999 + b"sand " * 2000,
        "table of words": lambda: b"a,b,c\n" + b"sand,1,2\n" * 160_000,
        "table of too many words": lambda: b"a,b,c\n" + b"sand,1,2\n" * 499_000,
        "table of colliding points": lambda: colliding_points(100_000),
        "table of far points": lambda: b"x,y,facies\n" + b"1e308,-1e308,1\n" * 50_000,
        "utf-16 of 60 MB": lambda: b"\xff\xfe" + "\U00010348".encode("utf-16-le") * (15 * MIB),
        "billion laughs": lambda: LAUGHS + b"<svg>&l11;</svg>",
        "brackets": lambda: b"[" * 5_000_000,
    },
    "project": {
        "project of brackets": lambda: project_of(b"[" * 900_000),
        "project of digits": lambda: project_of(
            b'{"format": "CCWSIM project", "version": ' + b"9" * 9**5 + b"}"
        ),
        "project of half letters": lambda: project_of(
            b'{"format": "CCWSIM project", "version": 1, "training_image": {"name": "\\ud800", '
            b'"facies_names": ["\\ud800"]}, "settings": {"grid": ["9x9"], "template": ["8"], '
            b'"overlap": ["4"], "level": ["1"], "realizations": ["1"], "seed": ["1"], '
            b'"name": ["\\ud800"], "ti": ["\\ud800"]}, "n_hard_data": 0, '
            b'"made_with": {"Program": "\\ud800"}, "digest": "\\ud800"}',
            sample.npy(np.zeros((40, 40), int)),
            sample.npy(np.empty((0, 2), int)),
        ),
        "project of a large image": lambda: project_of(
            b"{}", npy_header("(9, 9)") + bytes(200 * MIB)
        ),
    },
    "unknown": {},
    "matlab 4": {
        "mat 4": lambda: struct.pack("<IIIII", 0, 10**9, 10**9, 0, 3) + b"ti\0",
        "mat 4 of many variables": lambda: (
            (struct.pack("<IIIII", 0, 1, 1, 0, 3) + b"ti\0" + bytes(8)) * 2_000_000
        ),
    },
    "hdf5": {
        "mat 7.3": lambda: b"MATLAB 7.3 MAT-file".ljust(512) + b"\x89HDF\r\n\x1a\n",
        "hdf5 of zeros": lambda: b"\x89HDF\r\n\x1a\n" + bytes(60 * MIB),
    },
    "netcdf": {"netcdf without end": lambda: b"CDF\x02" + b"\xff" * 10**6},
    "excel": {
        "excel bomb": lambda: zipped(
            [("xl/workbook.xml", b""), ("xl/worksheets/sheet1.xml", bytes(200 * MIB))]
        )
    },
    "tiff": {
        "tiff of pages": lambda: pages(1200),
        "tiff of a large map": lambda: pages(1, 3000),
    },
    "surfer text": {"surfer of 10^9 cells": lambda: b"DSAA\n32000 32000\n0 1\n0 1\n0 1\n0 1\n"},
    "surfer 6": {
        "surfer 6 of 10^9 cells": lambda: b"DSBB" + struct.pack("<hh6d", 32000, 32000, *[1.0] * 6)
    },
    "surfer 7": {"surfer 7 of nothing": lambda: b"DSRB" + bytes(1000)},
    "zmap": {"zmap of nothing": lambda: b"@a, GRID, 4\n15, 1e30, , 4, 1\n"},
    "grass": {
        "grass of 10^10 cells": lambda: (
            b"north: 1\nsouth: 0\neast: 1\nwest: 0\nrows: 100000\ncols: 100000\n0 1\n"
        )
    },
    "grdecl": {
        "grdecl of repeats": lambda: b"DIMENS\n 2000 2000 1 /\nA\n 4000000*1 /\n" * 1000,
        "grdecl of 10^11 cells": lambda: b"DIMENS\n 99999 99999 9 /\nA\n 1 /\n",
        "grdecl of keywords": lambda: b"DIMENS\n 2 1 1 /\n" + b"A\n 1 1 /\n" * 5_000_000,
    },
    "irap": {
        "irap of 10^9 cells": lambda: b"-996 32000 1 1\n0 1 0 1\n32000 0 0 0\n0 0 0 0 0 0 0\n"
    },
}
"""Functions that make hostile files, by reader (a key of `READERS`) and by name."""
EVIL = {name: make for files in EVIL_OF.values() for name, make in files.items()}
WORST = {
    "npy": "npy at the limit",
    "npz": "zip of a million members",
    "picture": "jpeg of scans",
    "matlab": "mat of many elements",
    "sgems": "sgems of many variables",
    "vti": "vti of nested elements",
    "geopackage": "geopackage without end",
    "shapefile": "shapefile of a wide table",
    "shp": "shp alone",
    "esri": "esri of blank lines",
    "gslib": "text that is wrong at its end",
    "geojson": "geojson of columns",
    "table": "table of words",
    "project": "project of a large image",
    "matlab 4": "mat 4 of many variables",
    "hdf5": "hdf5 of zeros",
    "netcdf": "netcdf without end",
    "excel": "excel bomb",
    "tiff": "tiff of pages",
    "surfer text": "surfer of 10^9 cells",
    "surfer 6": "surfer 6 of 10^9 cells",
    "surfer 7": "surfer 7 of nothing",
    "zmap": "zmap of nothing",
    "grass": "grass of 10^10 cells",
    "grdecl": "grdecl of keywords",
    "irap": "irap of 10^9 cells",
}
"""Name of the slowest file for each reader."""
