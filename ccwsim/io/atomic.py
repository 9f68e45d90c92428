"""Write a file completely or not at all, and derive a file's format from its name."""

import os
from collections.abc import Collection
from pathlib import Path
from typing import Any

from ccwsim.model.errors import CCWSIMError
from ccwsim.model.extras import check_installed, is_installed
from ccwsim.system.whole_files import WholeFile, unwritable

WRITERS = {"tif": "rasterio", "nc": "xarray"}
"""Optional packages that write files, by the ending of the files."""


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
    if kind in WRITERS:
        check_installed(WRITERS[kind])
    return kind


def can_write(kind: str) -> bool:
    """Return whether the package that writes a format is installed.

    Examples
    --------
    >>> can_write("vti")
    True
    """
    return kind not in WRITERS or is_installed(WRITERS[kind])
