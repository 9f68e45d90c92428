"""Read and write VTK XML ImageData (.vti), the format of ParaView and pyvista for regular grids."""

import base64
import binascii
import re
import zlib
from collections.abc import Mapping
from math import prod
from typing import NamedTuple, NoReturn
from xml.etree import ElementTree
from xml.sax.saxutils import quoteattr

import numpy as np

from ccwsim import Grid
from ccwsim.io.data_file import DataFile, broken, distinct_names, printable
from ccwsim.io.limits import check, check_arrays
from ccwsim.model import Array, CCWSIMError, Floats, shown

_VTK_DTYPES = {
    f"{name}{8 * size}": f"{kind}{size}"
    for name, kind in (("Int", "i"), ("UInt", "u"))
    for size in (1, 2, 4, 8)
} | {"Float32": "f4", "Float64": "f8"}
_NAMES_OF_TYPES = {kind: name for name, kind in _VTK_DTYPES.items()}
_HEADERS = {"UInt32": "u4", "UInt64": "u8"}
_MARKS = ("vtkGhostType", "vtkGhostLevels", "vtkOriginalCellIds")  # names of arrays that VTK adds
_NORTH_UP = "1 0 0 0 1 0 0 0 1"
_BLOCK = 2**20  # number of uncompressed bytes in each compressed block that is written
# number of bytes at the start of a file that are searched for the name of the format
_N_SEARCHED = 1000


class _Stored(NamedTuple):
    """Values as raw bytes or in base64, in an element or after all elements."""

    payload: memoryview | bytes
    raw: bool


def is_vti(content: bytes) -> bool:
    """Return whether a file starts with VTK XML."""
    return b"<VTKFile" in content[:_N_SEARCHED] and content.lstrip()[:1] == b"<"


def read_vti(content: bytes, name: str) -> DataFile:
    """Return the arrays of cell data as grids; if there are none, point data (as cells)."""
    root, appended = _tree(content, name)
    element = root.find("ImageData")
    pieces = [] if element is None else element.findall("Piece")
    if element is None or len(pieces) != 1:
        raise CCWSIMError(
            f"{name}: VTK {printable(root.get('type', ''), 30)} of {len(pieces)} pieces is not "
            "read; save one piece of ImageData (.vti), in ParaView by Resample To Image"
        )
    spacing = _numbers(element, "Spacing", "1 1 1", 3, name)
    origin = _numbers(element, "Origin", "0 0 0", 3, name)
    if _numbers(element, "Direction", _NORTH_UP, 9, name).tolist() != np.eye(3).ravel().tolist():
        raise CCWSIMError(f"{name}: rotated grids are not supported; resample the grid")
    extent = _numbers(pieces[0], "Extent", element.get("WholeExtent", ""), 6, name)
    low, n_points = extent[::2], extent[1::2] - extent[::2] + 1
    corner, shape = origin + low * spacing, np.maximum(n_points - 1, 1)
    arrays = pieces[0].findall("CellData/DataArray")
    if not arrays:
        arrays, shape = pieces[0].findall("PointData/DataArray"), n_points
        corner = corner - spacing / 2
    arrays = [a for a in arrays if a.get("NumberOfComponents", "1") == "1"]
    arrays = [a for a in arrays if a.get("type") in _VTK_DTYPES and a.get("Name") not in _MARKS]
    full = tuple(int(n) if abs(n) < 2**31 else 0 for n in shape[::-1])
    check(name, variables=len(arrays))
    check_arrays(name, [full] * len(arrays))
    reader = _Values(root, appended, name)
    grids = [reader.read(array, prod(full)).reshape(full) for array in arrays]
    names = distinct_names([array.get("Name", "") for array in arrays])
    file = DataFile("VTK ImageData", name, dict(zip(names, grids, strict=True)))
    return file.at(spacing.tolist(), corner.tolist())


def _tree(content: bytes, name: str) -> tuple[ElementTree.Element, _Stored]:
    """Return the XML elements of a file, and the appended data, which may not be XML."""
    appended = _Stored(b"", True)
    start = content.find(b"<AppendedData")
    if start >= 0:
        end = content.find(b">", start)
        mark = content.find(b"_", max(end, start))
        raw = b"base64" not in content[start:end]
        appended = _Stored(memoryview(content)[mark + 1 :] if mark >= 0 else b"", raw)
        content = content[:start] + b"</VTKFile>"
    kinds = ElementTree.ParseError, ValueError, LookupError
    with broken(f"{name}: the XML is broken", kinds, remedy="get the complete file"):
        parser = ElementTree.XMLParser(target=_Builder(name))
        return ElementTree.fromstring(content, parser), appended


class _Builder(ElementTree.TreeBuilder):
    """Builds elements; a document type raises an error, because its entities can grow freely."""

    def __init__(self, name: str) -> None:
        super().__init__()
        self._name = name

    def doctype(self, *_: object) -> None:
        raise CCWSIMError(f"{self._name}: a DOCTYPE is not allowed; save the file again as VTI")


def _numbers(element: ElementTree.Element, key: str, default: str, n: int, name: str) -> Floats:
    words = element.get(key, default).split()
    try:
        values = np.array([float(word) for word in words])
    except ValueError:
        values = np.empty(0)
    if len(values) != n or not np.isfinite(values).all():
        raise CCWSIMError(f"{name}: {key} = {shown(element.get(key))} must be {n} numbers")
    return values


class _Values:
    """Decoder of array values stored as text, base64 or raw bytes, compressed or uncompressed."""

    def __init__(self, root: ElementTree.Element, appended: _Stored, name: str) -> None:
        self._order = ">" if root.get("byte_order") == "BigEndian" else "<"
        self._packed = root.get("compressor", "")
        self._appended, self._name = appended, name
        header = _HEADERS.get(root.get("header_type", "UInt32"), "u4")
        self._header = np.dtype(self._order + header)
        if self._packed not in ("", "vtkZLibDataCompressor"):
            packed = self._packed[:40]
            raise CCWSIMError(f"{name}: compression by {packed} is not supported; use zlib")

    def read(self, array: ElementTree.Element, n: int) -> Array:
        """Return the n values of an array; raise an error if it does not have n values."""
        kind, form = np.dtype(self._order + _VTK_DTYPES[array.get("type", "")]), array.get("format")
        text = (array.text or "").encode()
        if form == "appended":
            offset = array.get("offset", "")
            first = (
                int(offset) if re.fullmatch(r"[0-9]{1,15}", offset) else len(self._appended.payload)
            )
            stored = self._appended._replace(payload=self._appended.payload[first:])
        elif form == "binary":
            stored = _Stored(b"".join(text.split()), raw=False)
        else:
            words = text.split()
            if len(words) != n:
                self._raise_count(n, len(words))
            with broken(f"{self._name}: an array has a word that is not a number", ValueError):
                return np.array(words, "S40").astype(np.float64)
        check(self._name, unpacked=n * kind.itemsize)
        payload = (self._unpacked if self._packed else self._plain)(stored, n * kind.itemsize)
        if len(payload) != n * kind.itemsize:
            self._raise_count(n, len(payload) // kind.itemsize)
        return np.frombuffer(payload, kind).astype(kind.newbyteorder("="))

    def _plain(self, stored: _Stored, n: int) -> bytes:
        """Return uncompressed bytes, at most n + 1, which follow their count."""
        size = self._header.itemsize
        return self._first(stored, size + min(self._counts(stored, 1)[0], n + 1))[size:]

    def _unpacked(self, stored: _Stored, n: int) -> bytes:
        """Unpack compressed blocks to at most n + 1 bytes; a header states the sizes of blocks."""
        n_blocks = self._counts(stored, 1)[0]
        sizes = self._counts(stored, 3 + n_blocks)[3:]
        start = (3 + n_blocks) * self._header.itemsize
        payload = self._first(stored, start + sum(sizes))[start:]
        blocks, position, n_free = [], 0, n
        for length in sizes:
            with broken(f"{self._name}: a packed array is broken", zlib.error):
                stream = zlib.decompressobj()
                blocks.append(stream.decompress(payload[position : position + length], n_free + 1))
            position, n_free = position + length, max(n_free - len(blocks[-1]), 0)
        return b"".join(blocks)

    def _counts(self, stored: _Stored, n: int) -> list[int]:
        """Return the first n numbers of a header."""
        payload = self._first(stored, n * self._header.itemsize)
        if len(payload) < n * self._header.itemsize:
            raise CCWSIMError(f"{self._name} ends in the middle of an array; get a complete file")
        return np.frombuffer(payload, self._header, count=n).tolist()

    def _first(self, stored: _Stored, n: int) -> bytes:
        """Return the first n bytes; in base64, header and values may be encoded separately."""
        if stored.raw:
            return bytes(stored.payload[:n])
        first, _, second = bytes(stored.payload[: _letters(n) + 4]).partition(b"=")
        second = second.removeprefix(b"=")
        with broken(f"{self._name}: an array is not base64; save it again", binascii.Error):
            payload = base64.b64decode(first[: _letters(n)] + b"==")
            second = second[: _letters(n - len(payload))]
            return (payload + base64.b64decode(second[: len(second) // 4 * 4]))[:n]

    def _raise_count(self, promised: int, n: int) -> NoReturn:
        more = "more than " if n > promised else ""
        raise CCWSIMError(
            f"{self._name} states {promised} cells, but {more}{min(n, promised)} values of an "
            "array follow; get the complete file"
        )


def _letters(n: int) -> int:
    """Return the number of letters of n bytes in base64."""
    return -(-max(n, 0) // 3) * 4


def vti_as_bytes(maps: Mapping[str, Array], grid: Grid) -> bytes:
    """Return maps (layers from z = 0 to 1) or volumes as VTK XML ImageData, one array per map."""
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
        head = f'<DataArray type="{_NAMES_OF_TYPES[little.dtype.str[1:]]}" Name={quoteattr(name)} '
        parts += [head.encode(), b'format="binary">', _vtk_blocks(little), b"</DataArray>\n"]
    return b"".join([*parts, b"</CellData>\n</Piece>\n</ImageData>\n</VTKFile>\n"])


def _vtk_blocks(values: Array) -> bytes:
    """Return values in the layout of VTK: compressed blocks, preceded by their sizes."""
    raw = memoryview(values.tobytes())
    blocks = [zlib.compress(raw[k : k + _BLOCK], 6) for k in range(0, len(raw), _BLOCK)]
    sizes = [len(blocks), _BLOCK, len(raw) % _BLOCK, *map(len, blocks)]
    return base64.b64encode(np.array(sizes, "<u8").tobytes()) + base64.b64encode(b"".join(blocks))
