"""Files that are replaced whole or not at all."""

from __future__ import annotations

import os
import secrets
from collections.abc import Collection
from contextlib import suppress
from pathlib import Path
from typing import Any

from ccwsim.model.errors import CCWSIMError


def write_bytes(path_or_file: Any, content: bytes) -> None:
    """Write to a path, by a temporary file beside it and a rename, or to an open binary file."""
    if not isinstance(path_or_file, (str, os.PathLike)):
        path_or_file.write(content)
        return
    path = Path(path_or_file)
    beside = path.parent / f".{path.name[:100]}.{secrets.token_hex(6)}.tmp"
    try:
        with beside.open("xb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        beside.replace(path)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise CCWSIMError(f"{path} cannot be written: {reason}") from error
    finally:
        with suppress(OSError, ValueError):
            beside.unlink(missing_ok=True)


def format_of(path_or_file: Any, format: str | None, allowed: Collection[str]) -> str:
    """Return the format to write: the one asked for, else the ending of the path.

    Examples
    --------
    >>> format_of("out.NPZ", None, {"npz", "png"})
    'npz'
    """
    is_path = isinstance(path_or_file, (str, os.PathLike))
    ending = Path(path_or_file).suffix if is_path else ""
    kind = (format or ending).lower().removeprefix(".")
    if kind not in allowed:
        there = ", ".join(sorted(allowed))
        raise CCWSIMError(f"format {kind or 'none'!r} cannot be written; choose one of {there}")
    return kind
