"""Write a file completely or not at all, derive its format, and check what the format needs."""

import os
from collections.abc import Collection
from math import prod
from pathlib import Path
from typing import Any

from ccwsim.io.formats.pictures import sheet_layout
from ccwsim.model import CCWSIMError, Shape, check_installed, refused
from ccwsim.system.whole_files import WholeFile, check_writable, unwritable

PRECONDITIONS = {
    **dict.fromkeys(("npz", "grdecl", "csv", "vti", "geojson"), ("", 3, 0)),
    **dict.fromkeys(("gslib", "sgems", "dat"), ("", 3, 2)),
    "npy": ("", 3, 1),
    "png": ("", 2, 0),
    "tif": ("rasterio", 2, 0),
    "nc": ("xarray", 3, 1),
    "flopy": ("flopy", 3, 0),
}
"""What each writer needs, by the ending of its files ("flopy" writes a folder): the optional
package, the maximum dimension of grids, and the minimum bytes of a cell (0 if compressed)."""
FORMATS_OF_FACIES = ("png", "grdecl")
"""Formats of images and realizations that cannot contain a continuous variable."""


def write_bytes(path_or_file: Any, content: bytes) -> None:
    """Write to an open binary file or a path; for a path, write a temporary file and rename it."""
    if not isinstance(path_or_file, (str, os.PathLike)):
        path_or_file.write(content)
        return
    with unwritable(path_or_file):
        whole = WholeFile(path_or_file)
        try:
            whole.file.write(content)
            whole.commit()
        finally:
            whole.drop()


def format_of(path_or_file: Any, format: str | None, allowed: Collection[str]) -> str:
    """Return the requested format; by default, return the ending of the path.

    Raises `CCWSIMError` if the format is not allowed, or the package that writes it is missing.
    """
    is_path = isinstance(path_or_file, (str, os.PathLike))
    ending = Path(path_or_file).suffix if is_path else ""
    kind = (format or ending).lower().removeprefix(".")
    if kind not in allowed:
        choices = ", ".join(sorted(allowed))
        raise CCWSIMError(f"format {kind or 'none'!r} cannot be written; choose one of {choices}")
    check_format(kind)
    return kind


def check_format(kind: str, shape: Shape | None = None, of_values: bool = False) -> None:
    """Raise an error if a format cannot contain n grids, `shape` (n, (nz,) ny, nx), or at all.

    `of_values` says that the grids are those of a continuous variable.
    """
    package, n_dimensions, _ = PRECONDITIONS[kind]
    if of_values and kind in FORMATS_OF_FACIES:
        raise refused("format_of_values", kind=kind)
    if package:
        check_installed(package)
    if shape and len(shape) > n_dimensions + 1:
        raise refused("format_of_maps", kind=kind.upper())
    if shape and kind == "png":
        sheet_layout(*shape)


def can_write(kind: str, shape: Shape | None = None, of_values: bool = False) -> bool:
    """Return whether a format can contain n grids, `shape` (n, (nz,) ny, nx), or any at all.

    Examples
    --------
    >>> can_write("png", (4, 30, 40)), can_write("png", (400, 3000, 4000))
    (True, False)
    """
    try:
        check_format(kind, shape, of_values)
    except CCWSIMError:
        return False
    return True


def check_output(
    path: str | os.PathLike[str], kind: str, shape: Shape | None = None, of_values: bool = False
) -> None:
    """Raise an error if n grids, `shape` (n, (nz,) ny, nx), cannot be written; before a long run.

    The kind "flopy" is a folder, which is created.
    """
    check_format(kind, shape, of_values)
    if kind == "flopy":
        with unwritable(path):
            os.makedirs(path, exist_ok=True)
        path = Path(path) / "mfsim.nam"
    check_writable(path, PRECONDITIONS[kind][2] * prod(shape or (0,)))
