"""Detect the format of a file from its content (not its name), open it and summarize it."""

import os
import re
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from stat import S_ISREG
from typing import Any, BinaryIO, Protocol

import numpy as np
from numpy.typing import NDArray

from ccwsim.io.data_file import DataFile, broken, printable
from ccwsim.io.formats import pictures
from ccwsim.io.formats.gis import (
    GIS_FILES,
    is_shapefile_zip,
    pack_shapefile,
    read_geojson,
    read_gis,
)
from ccwsim.io.formats.grdecl import is_grdecl, read_grdecl, read_irap
from ccwsim.io.formats.labelled import read_hdf5, read_netcdf
from ccwsim.io.formats.matlab import is_matlab4, read_matlab, read_matlab4
from ccwsim.io.formats.numpy_files import read_npy, read_npz
from ccwsim.io.formats.rasters import DRIVERS, is_map, read_raster
from ccwsim.io.formats.sgems import read_sgems
from ccwsim.io.formats.tables import is_excel, read_excel, read_memory_table
from ccwsim.io.formats.text_grids import is_gslib, read_esri, read_gslib
from ccwsim.io.formats.text_tables import read_delimited
from ccwsim.io.formats.vti import is_vti, read_vti
from ccwsim.io.gridding import FilePart, as_grid, part_of_grid
from ccwsim.io.isolated import IsolatedFile
from ccwsim.io.limits import check, check_arrays, limited, limits
from ccwsim.model import Array, CCWSIMError, Shape, are_codes, is_installed, is_table, refused


class Readable(Protocol):
    """A binary file object, such as an upload or `io.BytesIO`."""

    def read(self, size: int = ..., /) -> bytes: ...


class MemoryTable(Protocol):
    """A table in memory, such as a DataFrame."""

    @property
    def columns(self) -> Any: ...
    def __getitem__(self, key: Any, /) -> Any: ...


_InMemory = MemoryTable | Mapping[str, Any] | NDArray[np.void]
PathOrFile = str | os.PathLike[str] | Readable | BinaryIO | IsolatedFile | _InMemory
"""A file, or a table in memory, which is read like a file."""

_FILE = Path(__file__).parents[1] / "assets" / "file_formats.toml"
_FORMATS = tomllib.loads(_FILE.read_text("utf-8"))
_MAGIC = {start.encode("latin-1"): kind for start, kind in _FORMATS["read"].items()}
"""Kinds of files by their first bytes."""
UNREAD = _FORMATS["unread"]["formats"]
"""Name, regular expression that the start matches, and remedy of formats that are not read."""
_START, _DIRECTORY = 4096, 65536
"""Number of bytes at the start, and at the end of a zip (names of its files), that are searched."""


def read_bytes(path_or_file: PathOrFile) -> tuple[bytes, str]:
    """Return the content of a file, and the name of the file in messages."""
    is_path = isinstance(path_or_file, (str, os.PathLike))
    content, name = _of_path(Path(path_or_file)) if is_path else _of_object(path_or_file)
    check(name, bytes=len(content))
    if not content.strip(b"\x00 \t\r\n"):
        raise CCWSIMError(f"{name}: the file is empty")
    return content, name


def kind_of(content: bytes) -> str:
    """Detect the kind of a file: npy, npz, picture, matlab, vti, text or unknown."""
    for magic, kind in _MAGIC.items():
        if content.startswith(magic):
            if kind == "npz" and is_excel(content):
                return "excel"
            return "shapefile" if kind == "npz" and is_shapefile_zip(content) else kind
    if is_matlab4(content):
        return "matlab 4"
    if is_vti(content):
        return "vti"
    if content.startswith(b"BM") and content[6:10] == bytes(4):
        return "picture"
    return "unknown" if b"\x00" in content[:65536] and not _utf16(content) else "text"


def _utf16(content: bytes) -> str:
    """Return the codec of a text in UTF-16, with a byte order mark or without; empty for others."""
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "utf-16"
    halves = {"utf-16-le": content[1:200:2], "utf-16-be": content[:200:2]}
    return next((codec for codec, zeros in halves.items() if not zeros.strip(b"\x00")), "")


def _of_path(path: Path) -> tuple[bytes, str]:
    with broken(f"{path} cannot be read", (OSError, ValueError), remedy="check the path"):
        if not S_ISREG(path.stat().st_mode):
            raise CCWSIMError(f"{path} is not a file")
        check(path.name, bytes=path.stat().st_size)
        with path.open("rb") as file:
            content = file.read(limits().bytes + 1)
        if kind_of(content) == "shp":
            content = pack_shapefile(path)
        return content, printable(path.name) or "file"


def _of_object(file: Any) -> tuple[bytes, str]:
    if not hasattr(file, "read"):
        raise CCWSIMError(f"a path or an open binary file is needed, not {type(file).__name__}")
    name = getattr(file, "name", None)
    base = name.replace("\\", "/").rsplit("/", 1)[-1] if isinstance(name, str) else ""
    name = printable(base) or "file"  # used only in messages
    with broken(f"{name} cannot be read", (OSError, ValueError), remedy="open it again"):
        if hasattr(file, "seek"):
            file.seek(0)
        content = file.read(limits().bytes + 1)
    if isinstance(content, str):
        raise CCWSIMError(f"{name} was opened as text; open it in binary mode")
    return bytes(content), name


READERS: dict[str, Callable[..., DataFile | pictures.PictureFile]] = {
    "picture": pictures.read_picture,
    "npy": read_npy,
    "npz": read_npz,
    "matlab": read_matlab,
    "matlab 4": read_matlab4,
    "vti": read_vti,
    "excel": read_excel,
    "netcdf": read_netcdf,
    "hdf5": read_hdf5,
    **{kind: partial(read_raster, kind=kind) for kind in DRIVERS},
    **{kind: partial(read_gis, kind=kind) for kind in GIS_FILES},
    "esri": read_esri,
    "grdecl": read_grdecl,
    "irap": read_irap,
    "gslib": read_gslib,
    "sgems": read_sgems,
    "geojson": read_geojson,
    "table": read_delimited,
}
"""For each kind of file, the function that reads its content; the kinds in `_TEXTS` are texts."""
_LAST = ("table", "npz", "unknown")  # kinds that may have a format that is recognized but not read
_STARTS = {kind: re.compile(mark.encode(), re.DOTALL) for kind, mark in _FORMATS["texts"].items()}
_TEXTS = {kind: start.match for kind, start in _STARTS.items()}
_TEXTS |= {"grdecl": is_grdecl, "gslib": is_gslib}


def open_file(
    path_or_file: PathOrFile, part: FilePart | None = None, **options: Any
) -> DataFile | pictures.PictureFile:
    """Return variables, colours or columns of a file or of a part; the limit is that of the part.

    Options are keywords of `part_of_grid`; they have no effect without a part.
    """
    pairs = () if part is None else tuple(options.items())
    if isinstance(path_or_file, IsolatedFile):
        return path_or_file.read_with(_open_file, part, pairs)
    return _open_file(path_or_file, part, pairs)


def _open_file(
    path_or_file: PathOrFile, part: FilePart | None, pairs: tuple[tuple[str, Any], ...]
) -> DataFile | pictures.PictureFile:
    options = dict(pairs)
    now = limits()  # a part may be of a file with more cells
    with limited(now if part is None else replace(now, cells=now.whole)):
        if is_table(path_or_file):
            file = read_memory_table(path_or_file)
        else:
            content, name = read_bytes(path_or_file)
            file = open_content(content, name, part, up=options.get("up"))
        if part is None:
            return file
        if isinstance(file, DataFile) and file.kind != pictures.PICTURE_OF_NUMBERS:
            file = part_of_grid(as_grid(file, options.get("shape")), part, **options)
    arrays = (
        [file.rgb[..., 0]] if isinstance(file, pictures.PictureFile) else file.variables.values()
    )
    check_arrays(file.name, [array.shape for array in arrays])
    return file


def open_content(
    content: bytes, name: str, part: FilePart | None = None, *, up: bool | None = None
) -> DataFile | pictures.PictureFile:
    """Return the variables or the colours in the content of a file."""
    kind, content = recognized(content, name)
    if kind in _LAST and (format_name := refusal(content)):
        raise CCWSIMError(f"{name} is {format_name}")
    if kind in READERS:
        options = {"part": part, "up": up} if kind == "picture" else {}
        return READERS[kind](content, name, **options)
    raise refused("unknown_format", name=name)


def refusal(content: bytes) -> str:
    """Return the name of a format that is not read, and a remedy; empty for unknown formats."""
    start = content[:_START] + (content[-_DIRECTORY:] if content.startswith(b"PK") else b"")
    fits = (f"{n}; {fix}" for n, mark, fix in UNREAD if re.match(mark.encode(), start, re.DOTALL))
    return next(fits, "")


def recognized(content: bytes, name: str) -> tuple[str, bytes]:
    """Return the kind of a file, a key of `READERS` if it can be read, and texts in UTF-8."""
    kind = kind_of(content)
    if kind == "tiff" and not (is_installed("rasterio") and is_map(content, name)):
        kind = "picture"
    if kind != "text":
        return kind, content
    text = _plain_text(content, name)
    return next((kind for kind, fits in _TEXTS.items() if fits(text)), "table"), text


def _plain_text(content: bytes, name: str) -> bytes:
    """Return a text in UTF-8 without byte order mark and with LF or CRLF line ends."""
    if codec := _utf16(content):
        with broken(f"{name}: the UTF-16 text is broken; save it as UTF-8", UnicodeError):
            content = content.decode(codec).encode()
    content = content.removeprefix(b"\xef\xbb\xbf").rstrip(b"\x1a\r\n\t ")
    try:
        if not content.isascii():
            content.decode()
    except UnicodeError:
        content = content.decode("cp1252", "replace").encode()  # Excel's usual encoding of CSV
    content = content.replace(b"\r", b"\n") if b"\n" not in content else content
    return content + b"\n"


MAX_COUNTED_VALUES = 1000  # maximum number of distinct values that are counted


@dataclass(frozen=True)
class VariableSummary:
    """Summary of one variable in a file."""

    name: str
    shape: Shape
    """Shape of the variable: (nz, ny, nx) for a grid, (n,) for a column."""
    n_known: int
    """Number of cells or rows with a value."""
    n_distinct: int
    """Number of distinct values, counted up to `MAX_COUNTED_VALUES`."""
    minimum: float
    maximum: float
    """Minimum and maximum of the values; NaN if all values are missing."""
    continuous: bool
    """Whether the variable needs classes or a threshold to become facies."""


@dataclass(frozen=True)
class FileSummary:
    """Summary of a file, and choices that the user must make to read it."""

    kind: str
    """Name of the format."""
    name: str
    variables: tuple[VariableSummary, ...]
    """All variables; a picture has only "grey", `continuous` if it has too many colours."""
    is_table: bool
    """Whether the file is a table: points, or a grid that needs `shape`."""
    is_picture: bool
    """Whether the file is a picture, whose colours become facies."""
    asks_up: bool
    """Whether the format does not define which row is the north."""
    bottom_first: bool
    """Whether the first layer in the file is the bottom."""
    cell_size: tuple[float, ...] | None
    origin: tuple[float, ...] | None
    """Cell size and origin in the file, if it has them."""

    @property
    def n_slices(self) -> int:
        """The number of slices to choose from; 1 for tables and vertical sections."""
        sizes = [v.shape for v in self.variables if len(v.shape) == 3 and 1 not in v.shape[1:]]
        return max((size[0] for size in sizes), default=1)


def inspect(path_or_file: PathOrFile, part: FilePart | None = None) -> FileSummary:
    """Summarize a file or a part of it: format, variables, sizes, whether values are continuous.

    Raises `CCWSIMError` for a file that cannot be read.

    Examples
    --------
    >>> from io import BytesIO
    >>> summary = inspect(BytesIO(b"2 1 1\\n1\\nporosity\\n0.25\\n-999\\n"))
    >>> summary.kind, summary.variables[0].n_known, summary.variables[0].continuous
    ('SGeMS/GSLIB grid', 1, True)
    """
    opened = open_file(path_or_file, part)
    is_picture = isinstance(opened, pictures.PictureFile)
    file = opened.grid() if is_picture else opened
    variables = [_variable(file, key) for key in file.variables]
    if is_picture:
        n = min(len(pictures.distinct_colours(opened.rgb)[0]), MAX_COUNTED_VALUES)
        continuous = n > pictures.MAX_COLOURS and not opened.says_codes
        variables = [replace(variables[0], n_distinct=n, continuous=continuous)]
    return FileSummary(
        kind=file.kind,
        name=file.name,
        variables=tuple(variables),
        is_table=file.is_table,
        is_picture=is_picture,
        asks_up=file.asks_up,
        bottom_first=file.bottom_first,
        cell_size=file.geometry.cell_size[:2] or None,
        origin=file.geometry.origin[:2] or None,
    )


def _variable(file: DataFile, key: str) -> VariableSummary:
    values = file.variables[key]
    present = values[file.known(values)]
    return VariableSummary(
        name=key,
        shape=values.shape,
        n_known=present.size,
        n_distinct=_n_distinct(present),
        minimum=float(present.min()) if present.size else np.nan,
        maximum=float(present.max()) if present.size else np.nan,
        continuous=present.size > 0 and not are_codes(present),
    )


def _n_distinct(values: Array) -> int:
    seen = values[:0]
    for start in range(0, values.size, 2**20):
        seen = np.union1d(seen, values[start : start + 2**20])
        if len(seen) >= MAX_COUNTED_VALUES:
            return MAX_COUNTED_VALUES
    return len(seen)
