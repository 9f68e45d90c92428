"""Build broken and oversized files byte by byte, which no ordinary program writes."""

from __future__ import annotations

import base64
import io
import os
import sqlite3
import struct
import zipfile
import zlib
from collections.abc import Iterable
from contextlib import closing
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from PIL import Image

from tests.fuzz.mutations import png_chunk, zipped
from tests.io import sample_files as sample

MIB = 2**20
SPRUNG = "sprung"
"""Name of the folder that the code in a hostile file creates if it is executed."""
LAUGHS = (
    b"<!DOCTYPE a [<!ENTITY l0 'ha'>"
    + b"".join(b'<!ENTITY l%d "%s">' % (k, b"&l%d;" % (k - 1) * 10) for k in range(1, 12))
    + b"]>"
)
"""A document type declaration whose entity l11 expands to 200 GB."""


def sgems_header(nx: int, ny: int, nz: int, n: int = 1) -> bytes:
    """Return the beginning of a binary grid of SGeMS with `n` variables, without values."""
    kind = struct.pack(">I6s", 6, b"Cgrid\0") + struct.pack(">I2s", 2, b"g\0")
    grid = struct.pack(">I3I6fI", 100, nx, ny, nz, *(1.0,) * 3, *(0.0,) * 3, n)
    return b"\xb2\x11\x17\x5d" + kind + grid + struct.pack(">I2s", 2, b"v\0")


def npy_header(shape: str, descr: str = "'<f8'", version: int = 1) -> bytes:
    """Return an npy file without values."""
    header = f"{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}".encode()
    header = header.ljust(117) + b"\n"
    size = struct.pack("<H" if version == 1 else "<I", len(header))
    return b"\x93NUMPY" + bytes([version, 0]) + size + header


def pickled() -> bytes:
    """Return an npy file with a pickle that creates a folder if it is loaded."""

    class Trap:
        def __reduce__(self):
            return os.mkdir, (SPRUNG,)

    content = io.BytesIO()
    np.save(content, np.array([[Trap()]], dtype=object))
    return content.getvalue()


def overlapping_zip() -> bytes:
    """Return a zip with many entries that share the same packed data."""
    one = zipped([("0000.npy", npy_header("(1000, 1000)") + bytes(8 * MIB))])
    end = one.rindex(b"PK\x05\x06")
    start = struct.unpack_from("<I", one, end + 16)[0]
    entry = one[start:end]
    entries = b"".join(entry.replace(b"0000.npy", b"%04d.npy" % k) for k in range(1500))
    tail = struct.pack("<IHHHHIIH", 0x06054B50, 0, 0, 1500, 1500, len(entries), start, 0)
    return one[:start] + entries + tail


def many_members(n: int) -> bytes:
    """Return a zip whose directory has n entries."""
    entry = struct.pack("<IHHHHHHIIIHHHHHII", 0x02014B50, *[20] * 2, *[0] * 7, 1, *[0] * 6) + b"a"
    tail = struct.pack("<IHHHHIIH", 0x06054B50, 0, 0, 65535, 65535, len(entry) * n, 0, 0)
    return b"PK\x03\x04" + entry * n + tail


def png(width: int, height: int, *extra: bytes, data: bytes | None = None) -> bytes:
    """Return a grey PNG with given chunks before its values."""
    head = png_chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0))
    values = zlib.compress(bytes((width + 1) * height)) if data is None else data
    tail = png_chunk(b"IDAT", values) + png_chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + head + b"".join(extra) + tail


def png_of_remarks() -> bytes:
    bomb = zlib.compress(bytes(200 * MIB), 1)
    return png(9, 9, png_chunk(b"zTXt", b"a\0\0" + bomb), png_chunk(b"iCCP", b"a\0\0" + bomb))


def png_of_chunks() -> bytes:
    return png(9, 9, png_chunk(b"tEXt", b"a\0b") * 2_000_000)


def jpeg_of_scans(n: int) -> bytes:
    """Return a progressive JPEG that repeats its last scan n times."""
    content = io.BytesIO()
    Image.fromarray(np.zeros((1500, 1500), np.uint8)).save(content, "JPEG", progressive=True)
    own = content.getvalue()
    last = own[own.rindex(b"\xff\xda") : -2]
    return own[:-2] + last * n + b"\xff\xd9"


def jpeg_of_camera_data() -> bytes:
    own = sample.picture("JPEG")
    tags = b"".join(struct.pack("<HHII", k, 1, 60_000, 8) for k in range(60_000))
    exif = b"II*\0\x08\0\0\0" + struct.pack("<H", 60_000) + tags
    segments = b"".join(
        b"\xff\xe1" + struct.pack(">H", len(part) + 8) + b"Exif\0\0" + part
        for part in (exif[k : k + 65_000] for k in range(0, len(exif), 65_000))
    )
    return own[:2] + segments * 60 + own[2:]


def gif_of_remarks() -> bytes:
    own = sample.picture("GIF")
    at = 13 + (3 << ((own[10] & 7) + 1))
    return own[:at] + b"\x21\xfe" + (b"\xff" + b"a" * 255) * 200_000 + b"\0" + own[at:]


def gif_of_frames() -> bytes:
    own = sample.picture("GIF")
    return own[:-1] + own[own.index(b",") : -1] * 20_000 + b";"


def large_gif() -> bytes:
    own = bytearray(sample.picture("GIF"))
    own[6:10] = struct.pack("<HH", 65535, 65535)
    at = own.index(b",")
    own[at + 5 : at + 9] = struct.pack("<HH", 65535, 65535)
    return bytes(own)


def packed_bmp(side: int) -> bytes:
    """Return a run-length packed BMP with runs of one pixel."""
    head = struct.pack("<IiiHHIIiiII", 40, side, side, 1, 8, 1, 0, 0, 0, 2, 0)
    runs = b"\x01\x00" * (side * side)
    start = 14 + len(head) + 8
    return b"BM" + struct.pack("<IHHI", start + len(runs), 0, 0, start) + head + bytes(8) + runs


def tiff(*tags: tuple[int, int, int, int], tail: bytes = b"") -> bytes:
    """Return a TIFF with tags (number, type, count, value or offset); `tail` begins at byte 8."""
    start = 8 + len(tail)
    entries = b"".join(struct.pack("<HHII", *tag) for tag in tags)
    return (
        b"II*\0"
        + struct.pack("<I", start)
        + tail
        + struct.pack("<H", len(tags))
        + entries
        + bytes(4)
    )


TIFF = ((256, 4, 1, 2000), (257, 4, 1, 2000), (258, 3, 1, 8), (259, 3, 1, 1), (262, 3, 1, 1))


def tiff_of_tags() -> bytes:
    many = tuple((700 + k, 1, 30 * MIB, 8) for k in range(500))
    return tiff(*TIFF, *many, tail=bytes(30 * MIB))


def tiff_of_strips() -> bytes:
    n = 2_000_000
    counts, offsets = np.full(n, 30 * MIB, "<u4"), np.full(n, 8, "<u4")
    tail = counts.tobytes() + offsets.tobytes() + bytes(30 * MIB)
    own = (273, 4, n, 8 + counts.nbytes), (278, 4, 1, 1), (279, 4, n, 8)
    return tiff((256, 4, 1, 1), (257, 4, 1, n), *TIFF[2:], *own, tail=tail)


def large_tile() -> bytes:
    tile = (322, 4, 1, 30_000), (323, 4, 1, 30_000), (324, 4, 1, 8), (325, 4, 1, 100)
    return tiff(*TIFF[:3], (259, 3, 1, 8), TIFF[4], *tile, tail=zlib.compress(bytes(10 * MIB)))


def mat(*elements: bytes) -> bytes:
    """Return a MATLAB file with top-level elements."""
    return b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM" + b"".join(elements)


def element(kind: int, data: bytes) -> bytes:
    """Return an element of a MATLAB file."""
    return struct.pack("<II", kind, len(data)) + data + bytes(-len(data) % 8)


def matrix(sizes: bytes, values: bytes, kind: int = 6) -> bytes:
    """Return a matrix element of a MATLAB file."""
    flags = element(6, struct.pack("<II", kind, 0))
    return element(14, flags + element(5, sizes) + element(1, b"ti") + element(9, values))


def nested_cells(depth: int) -> bytes:
    own = matrix(struct.pack("<ii", 2, 2), bytes(32))
    for _ in range(depth):
        flags = element(6, struct.pack("<II", 1, 0))
        own = element(14, flags + element(5, struct.pack("<ii", 1, 1)) + element(1, b"c") + own)
    return mat(own)


def packed_mat(start: bytes, n_zeros: int) -> bytes:
    packed = zlib.compress(start + bytes(n_zeros), 1)
    return mat(struct.pack("<II", 15, len(packed)) + packed)


def packed_promise(rows: int, columns: int, n_zeros: int) -> bytes:
    own = matrix(struct.pack("<ii", rows, columns), b"")[8:-8]
    start = struct.pack("<II", 14, min(len(own) + 8 + n_zeros, 2**32 - 1)) + own
    return packed_mat(start + struct.pack("<II", 9, min(n_zeros, 2**32 - 1)), n_zeros)


def colliding_points(n: int) -> bytes:
    cells = np.arange(n) // 2
    rows = (b"%d,%d,%d" % (k // 1000, k % 1000, j % 2) for j, k in enumerate(cells.tolist()))
    return b"row,col,facies\n" + b"\n".join(rows)


def project_of(settings: bytes, image: bytes = b"", data: bytes = b"") -> bytes:
    """Return a project file with the given members."""
    members = [("study.json", settings), ("training_image.npy", image)]
    members += [("hard_cells.npy", data), ("hard_facies.npy", data)]
    return zipped(members)


def lzma_zip() -> bytes:
    return zipped([("0.npy", npy_header("(9, 9)") + bytes(648))], zipfile.ZIP_LZMA)


def locked_zip() -> bytes:
    own = bytearray(zipped([("0.npy", npy_header("(9, 9)") + bytes(648))]))
    own[6] |= 1
    own[own.index(b"PK\x01\x02") + 8] |= 1
    return bytes(own)


def vti(elements: bytes, doctype: bytes = b"") -> bytes:
    """Return VTK XML with given elements instead of the piece."""
    head = b'<VTKFile type="ImageData"><ImageData WholeExtent="0 2 0 2 0 0">'
    return doctype + head + elements + b"</ImageData></VTKFile>"


def vti_of(arrays: bytes) -> bytes:
    """Return VTK XML with given arrays in a piece of 2 × 2 cells."""
    return vti(b'<Piece Extent="0 2 0 2 0 0"><CellData>' + arrays + b"</CellData></Piece>")


def utf16_entities() -> bytes:
    """Return VTK XML in UTF-16 with expanding entities, and `<VTKFile` as plain bytes."""
    text = '<?xml version="1.0" encoding="utf-16"?>' + vti(b"&l11;", LAUGHS).decode()
    return (
        text.replace("?>", "?><!--", 1)
        .encode("utf-16-le")
        .replace(
            "<!--".encode("utf-16-le"),
            "<!--".encode("utf-16-le") + b"<VTKFile" + "-->".encode("utf-16-le"),
            1,
        )
    )


def packed_vti() -> bytes:
    """Return VTK XML of 2000 × 2000 cells, whose array unpacks to 30 times the stated size."""
    blocks = [zlib.compress(bytes(4 * MIB))] * 30
    sizes = np.array([len(blocks), 4 * MIB, 0, *map(len, blocks)], "<u4")
    text = base64.b64encode(sizes.tobytes()) + base64.b64encode(b"".join(blocks))
    array = b'<DataArray type="Int8" Name="a" format="binary">' + text + b"</DataArray>"
    own = vti_of(array).replace(b"0 2 0 2 0 0", b"0 2000 0 2000 0 0")
    return own.replace(b"<VTKFile ", b'<VTKFile compressor="vtkZLibDataCompressor" ')


def geojson_of(features: Iterable[bytes]) -> bytes:
    return b'{"features": [' + b",".join(features) + b"]}"


def _geopackage(*statements: str) -> bytes:
    """Return the points of `tests.io.sample_files` as a GeoPackage changed by SQL statements."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "wells.gpkg"
        path.write_bytes(sample.gis("gpkg"))
        with closing(sqlite3.connect(path)) as database:
            for statement in statements:
                database.execute(statement)
            database.commit()
        return path.read_bytes()


_WITHOUT_TRIGGERS = (
    "DROP TRIGGER IF EXISTS trigger_insert_feature_count_wells",
    "DROP TRIGGER IF EXISTS trigger_delete_feature_count_wells",
    "DELETE FROM gpkg_extensions",
    "DELETE FROM gpkg_ogr_contents",
)


def endless_geopackage() -> bytes:
    """Return a GeoPackage whose table of points is a query that never ends."""
    return _geopackage(
        *_WITHOUT_TRIGGERS,
        "ALTER TABLE wells RENAME TO points",
        "CREATE VIEW wells AS WITH RECURSIVE c(k) AS (SELECT 1 UNION ALL SELECT k + 1 FROM c) "
        "SELECT k AS fid, geom, well, facies FROM c, points",
    )


def geopackage_of_blobs() -> bytes:
    """Return a GeoPackage whose table of points is a query for texts of 100 MB."""
    return _geopackage(
        *_WITHOUT_TRIGGERS,
        "ALTER TABLE wells RENAME TO points",
        "CREATE VIEW wells AS WITH RECURSIVE c(k) AS (SELECT 1 UNION ALL SELECT k + 1 FROM c LIMIT "
        "99) SELECT k AS fid, geom, hex(zeroblob(50000000)) AS well, facies FROM c, points",
    )


def _shapefile(n: int, size: int, dbf: bytes) -> bytes:
    """Return a zipped Shapefile of n points; each record states `size` bytes."""
    records = b"".join(
        struct.pack(">2i", k + 1, size // 2) + struct.pack("<idd", 1, k, 0) for k in range(n)
    )
    index = b"".join(struct.pack(">2i", 50 + 14 * k, size // 2) for k in range(n))

    def file(content: bytes, length: int) -> bytes:
        words = [9994, *[0] * 5, min(length // 2, 2**31 - 1)]
        return struct.pack(">7i", *words) + struct.pack("<2i8d", 1000, 1, *[0] * 8) + content

    shp = file(records, 100 + (8 + size) * n)
    return zipped([("a.shp", shp), ("a.shx", file(index, 100 + 8 * n)), ("a.dbf", dbf)])


def promising_shapefile() -> bytes:
    """Return a Shapefile whose records state a size of 2 GB."""
    return _shapefile(50_000, 2**31 - 2, _dbf(2**31 - 1, 1))


def wide_shapefile() -> bytes:
    """Return a Shapefile of 2000 points with a table of 250 columns of 254 characters."""
    return _shapefile(2000, 20, _dbf(2000, 250))


def _dbf(n_rows: int, n_columns: int) -> bytes:
    """Return a table with columns of 254 characters, which contains only the first 10,000 rows."""
    start, width = 33 + 32 * n_columns, 1 + 254 * n_columns
    head = struct.pack("<4BIHH20x", 3, 126, 1, 1, n_rows, start, width)
    columns = b"".join(
        struct.pack("<11sc4xBB14x", b"C%d" % k, b"C", 254, 0) for k in range(n_columns)
    )
    return head + columns + b"\r" + (b" " + b"sand".ljust(width - 1)) * min(n_rows, 10_000)


def pages(n: int, side: int = 1) -> bytes:
    """Return a TIFF of n pages with 16-bit numbers."""
    content = io.BytesIO()
    page = Image.fromarray(np.zeros((side, side), np.uint16))
    page.save(content, "TIFF", save_all=True, append_images=[page] * (n - 1))
    return content.getvalue()
