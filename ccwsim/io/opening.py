"""From any file to what it holds, by looking at its content, never at its name."""

from __future__ import annotations

from ccwsim.io.data_file import DataFile
from ccwsim.io.formats.delimited import read_delimited
from ccwsim.io.formats.esri import is_esri, read_esri
from ccwsim.io.formats.gslib import is_gslib, read_gslib
from ccwsim.io.formats.matlab import read_matlab
from ccwsim.io.formats.numpy_files import read_npy, read_npz
from ccwsim.io.formats.pictures import Picture, read_picture
from ccwsim.io.source import PathOrFile, kind_of, read_bytes
from ccwsim.model.errors import CCWSIMError

_READERS = {
    "npy": read_npy,
    "npz": read_npz,
    "picture": read_picture,
    "matlab": read_matlab,
}


def open_file(path_or_file: PathOrFile) -> DataFile | Picture:
    """Return the variables or the colours of a file.

    Raises
    ------
    CCWSIMError
        For a file that cannot be read, is of an unknown kind, broken, or too large.

    Examples
    --------
    >>> from io import BytesIO
    >>> open_file(BytesIO(b"2 1 1\\n1\\nfacies\\n0\\n1\\n")).kind
    'SGeMS/GSLIB grid'
    """
    content, name = read_bytes(path_or_file)
    kind = kind_of(content)
    if kind in _READERS:
        return _READERS[kind](content, name)
    if kind == "matlab 7.3":
        raise CCWSIMError(f"{name}: MATLAB 7.3 (HDF5) files are not read; save it with -v7")
    if kind == "unknown":
        raise CCWSIMError(
            f"{name} is of no known kind; bring a picture, an SGeMS or GSLIB file, a CSV table, "
            "or a NumPy or MATLAB file"
        )
    return _read_text(_plain_text(content, name), name)


def _read_text(text: bytes, name: str) -> DataFile:
    if is_esri(text):
        return read_esri(text, name)
    if is_gslib(text):
        return read_gslib(text, name)
    return read_delimited(text, name)


def _plain_text(content: bytes, name: str) -> bytes:
    """UTF-8 without a mark at its start, lines ended by LF or CRLF."""
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        try:
            content = content.decode("utf-16").encode()
        except UnicodeError as error:
            raise CCWSIMError(f"{name}: the UTF-16 text is broken; save it as UTF-8") from error
    content = content.removeprefix(b"\xef\xbb\xbf")
    return content.replace(b"\r", b"\n") if b"\n" not in content else content
