"""The bytes of a file, from a path or an upload, and what kind of file they are."""

from __future__ import annotations

import os
from pathlib import Path
from stat import S_ISREG
from typing import Any, BinaryIO, Protocol

from ccwsim.io.data_file import printable
from ccwsim.io.limits import check_bytes, limits
from ccwsim.model.errors import CCWSIMError


class Readable(Protocol):
    """A binary file object, such as an upload or `io.BytesIO`."""

    def read(self, size: int = ..., /) -> bytes: ...


PathOrFile = str | os.PathLike[str] | Readable | BinaryIO

_MAGIC = (
    (b"\x93NUMPY", "npy"),
    (b"PK\x03\x04", "npz"),
    (b"PK\x05\x06", "npz"),
    (b"\x89PNG\r\n\x1a\n", "picture"),
    (b"\xff\xd8\xff", "picture"),
    (b"GIF87a", "picture"),
    (b"GIF89a", "picture"),
    (b"II*\x00", "picture"),
    (b"MM\x00*", "picture"),
    (b"MATLAB 5.0 MAT-file", "matlab"),
    (b"MATLAB 7.3 MAT-file", "matlab 7.3"),
    (b"\x89HDF\r\n\x1a\n", "matlab 7.3"),
)


def read_bytes(path_or_file: PathOrFile) -> tuple[bytes, str]:
    """Return the content of a file and the name to call it by in messages.

    Parameters
    ----------
    path_or_file : str, Path or binary file
        A file object is read from its start where it can go back there.

    Raises
    ------
    CCWSIMError
        For a file that cannot be read, is empty, or is larger than it may be.

    Examples
    --------
    >>> from io import BytesIO
    >>> read_bytes(BytesIO(b"0 1"))
    (b'0 1', 'file')
    """
    if isinstance(path_or_file, (str, os.PathLike)):
        content, name = _of_path(Path(path_or_file))
    else:
        content, name = _of_object(path_or_file)
    check_bytes(name, len(content))
    if not content.strip(b"\x00 \t\r\n"):
        raise CCWSIMError(f"{name}: the file is empty")
    return content, name


def kind_of(content: bytes) -> str:
    """Return the kind of file by its first bytes: npy, npz, picture, matlab, text or unknown.

    Examples
    --------
    >>> kind_of(b"250 250 1")
    'text'
    """
    for magic, kind in _MAGIC:
        if content.startswith(magic):
            return kind
    if content.startswith(b"BM") and content[6:10] == bytes(4):
        return "picture"
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "text"
    return "unknown" if b"\x00" in content[:65536] else "text"


def stem(name: str) -> str:
    """Return a file's name without its ending.

    Examples
    --------
    >>> stem("ti.v2.png")
    'ti.v2'
    """
    return Path(name).stem


def _of_path(path: Path) -> tuple[bytes, str]:
    try:
        if not S_ISREG(path.stat().st_mode):
            raise CCWSIMError(f"{path} is not a file")
        check_bytes(path.name, path.stat().st_size)
        with path.open("rb") as file:
            return file.read(limits().bytes + 1), printable(path.name) or "file"
    except (OSError, ValueError) as error:
        if isinstance(error, CCWSIMError):
            raise
        reason = getattr(error, "strerror", None) or error
        raise CCWSIMError(f"{path} cannot be read: {reason}") from error


def _of_object(file: Any) -> tuple[bytes, str]:
    if not hasattr(file, "read"):
        raise CCWSIMError(f"a path or an open binary file is needed, not {type(file).__name__}")
    name = _shown(getattr(file, "name", None))
    try:
        if hasattr(file, "seek"):
            file.seek(0)
        content = file.read(limits().bytes + 1)
    except (OSError, ValueError) as error:
        raise CCWSIMError(f"{name} cannot be read: {error}") from error
    if isinstance(content, str):
        raise CCWSIMError(f"{name} was opened as text; open it in binary mode")
    return bytes(content), name


def _shown(name: object) -> str:
    """A client's file name, for messages only: no folders, no control characters, short."""
    if not isinstance(name, str):
        return "file"
    base = name.replace("\\", "/").rsplit("/", 1)[-1]
    return printable(base) or "file"
