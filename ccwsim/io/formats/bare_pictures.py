"""Pictures without what is not needed to see them: the decoder is given as little as can be.

Remarks, colour profiles, camera data and further frames of a picture may be larger than itself, and
made to take hours. They are taken out before the picture is decoded, and what no program writes,
such as thousands of scans, is refused.
"""

from __future__ import annotations

import struct
from math import prod

import numpy as np

from ccwsim.io.limits import check_time, limits
from ccwsim.model.errors import CCWSIMError

MAX_PARTS = 100_000
"""Most chunks, segments or blocks of a picture; a block of a GIF has up to 255 bytes."""

MAX_SCANS = 100
"""Most scans of a JPEG; each goes over the whole picture, and programs write about ten."""

MAX_STRIPS = 20_000
"""Most strips or tiles of a TIFF; each is decoded by itself."""

_PNG_CHUNKS = (b"IHDR", b"PLTE", b"tRNS", b"IDAT", b"IEND")
_JPEG_LEFT_OUT = (*range(0xE1, 0xEE), 0xEF, 0xFE)
"""Application segments but JFIF (E0) and Adobe (EE), which say what the colours are; remarks."""
_TIFF_PACKINGS = (1, 2, 3, 4, 5, 8, 32773, 32946)
"""None, the fax ones, LZW, Deflate, PackBits; not JPEG, WebP and others within a TIFF."""
_TIFF_SIZES = {1: 1, 2: 1, 3: 2, 4: 4, 5: 8, 6: 1, 7: 1, 8: 2, 9: 4, 10: 8, 11: 4, 12: 8}


def bare_picture(content: bytes, name: str, keep_text: bytes = b"") -> bytes:
    """Return a picture in the same format, with its first frame only.

    Parameters
    ----------
    content : bytes
    name : str
        What to call the file in messages.
    keep_text : bytes
        The start of a text of a PNG that is kept.

    Raises
    ------
    CCWSIMError
        For a picture whose parts are broken or too many.

    Examples
    --------
    >>> from io import BytesIO
    >>> from PIL import Image
    >>> file = BytesIO()
    >>> Image.new("L", (2, 2)).save(file, "GIF", comment=b"a" * 1000)
    >>> len(bare_picture(file.getvalue(), "a.gif")) < 1000
    True
    """
    try:
        if content.startswith(b"\x89PNG"):
            return _png(content, name, keep_text)
        if content.startswith(b"\xff\xd8"):
            return _jpeg(content, name)
        if content.startswith(b"GIF"):
            return _gif(content, name)
        if content.startswith(b"BM"):
            return _bmp(content, name)
        return _tiff(content, name)
    except (struct.error, IndexError, ValueError, OverflowError) as error:
        if isinstance(error, CCWSIMError):
            raise
        raise CCWSIMError(f"{name}: the picture is broken; save it again as PNG") from error


def _png(content: bytes, name: str, keep_text: bytes) -> bytes:
    parts, at = [content[:8]], 8
    for _ in range(MAX_PARTS):
        if at + 12 > len(content):
            return b"".join(parts)
        (size,) = struct.unpack_from(">I", content, at)
        kind, end = content[at + 4 : at + 8], at + 12 + size
        own = kind == b"tEXt" and size < 200 and content.startswith(keep_text, at + 8)
        if kind in _PNG_CHUNKS or (own and keep_text):
            parts.append(content[at:end])
        if kind == b"IEND":
            return b"".join(parts)
        at = end
    raise _too_many(name, "chunks", MAX_PARTS)


def _jpeg(content: bytes, name: str) -> bytes:
    parts, at = [content[:2]], 2
    for _ in range(MAX_PARTS):
        at = content.index(b"\xff", at)
        while content[at + 1] == 0xFF:
            at += 1
        marker = content[at + 1]
        if marker == 0xDA:  # the first scan: nothing but tables and scans follow
            scans = content.count(b"\xff\xda", at)
            if scans > MAX_SCANS:
                raise _too_many(name, "scans", MAX_SCANS)
            return b"".join([*parts, content[at:]])
        if marker in (0x00, 0x01, 0xD8, *range(0xD0, 0xD8)):
            at += 2
            continue
        (size,) = struct.unpack_from(">H", content, at + 2)
        if marker not in _JPEG_LEFT_OUT:
            parts.append(content[at : at + 2 + size])
        at += 2 + size
    raise _too_many(name, "segments", MAX_PARTS)


def _gif(content: bytes, name: str) -> bytes:
    """Sizes, colours and the first frame with what says its transparent colour."""
    start = 13 + _colours_of_gif(content[10])
    parts, at = [content[:start]], start
    control = b""
    for _ in range(MAX_PARTS):
        kind = content[at]
        if kind == 0x2C:
            data = at + 10 + _colours_of_gif(content[at + 9]) + 1
            end = _end_of_blocks(content, data, name)
            return b"".join([*parts, control, content[at:end], b";"])
        if kind == 0x21:
            end = _end_of_blocks(content, at + 2, name)
            control = content[at:end] if content[at + 1] == 0xF9 else control
            at = end
        elif kind == 0x3B:
            raise CCWSIMError(f"{name}: the picture has no frame; save it again as PNG")
        else:
            at += 1
    raise _too_many(name, "blocks", MAX_PARTS)


def _colours_of_gif(flags: int) -> int:
    """Bytes of a table of colours."""
    return 3 << ((flags & 7) + 1) if flags & 0x80 else 0


def _end_of_blocks(content: bytes, at: int, name: str) -> int:
    """Where a row of blocks ends; one that is cut ends with the file."""
    for k in range(len(content)):
        if k % MAX_PARTS == 0:
            check_time(name)
        size = content[at] if at < len(content) else 0
        at += 1 + size
        if size == 0:
            break
    return min(at, len(content))


def _bmp(content: bytes, name: str) -> bytes:
    packing = struct.unpack_from("<I", content, 30)[0] if content[14] >= 40 else 0
    if packing in (1, 2):
        raise CCWSIMError(f"{name}: run-length packed BMP files are not read; save it as PNG")
    return content


def _tiff(content: bytes, name: str) -> bytes:
    order = "<" if content.startswith(b"II") else ">"
    (start,) = struct.unpack_from(f"{order}I", content, 4)
    (n,) = struct.unpack_from(f"{order}H", content, start)
    entries = np.frombuffer(
        content, [("tag", f"{order}u2"), ("kind", f"{order}u2"), ("count", f"{order}u4"),
                  ("at", f"{order}u4")], count=n, offset=start + 2,
    )  # fmt: skip
    sizes = [_TIFF_SIZES.get(int(e["kind"]), 0) * int(e["count"]) for e in entries]
    if sum(sizes) > len(content) + 4 * n:
        raise CCWSIMError(f"{name}: the picture promises more than it has; save it again as PNG")
    values = {int(e["tag"]): _tiff_values(content, order, e) for e in entries}
    strips = values.get(279, values.get(325, []))
    tile = [*values.get(322, []), *values.get(323, [])]
    if set(values.get(259, [])) - set(_TIFF_PACKINGS):
        raise CCWSIMError(f"{name}: it is packed in a way not read; save it as PNG")
    if len(strips) > MAX_STRIPS:
        raise _too_many(name, "strips", MAX_STRIPS)
    if sum(strips) > len(content) or prod(tile or [1]) > limits().cells:
        raise CCWSIMError(f"{name}: the picture promises more than it has; save it again as PNG")
    return content


def _tiff_values(content: bytes, order: str, entry: np.void) -> list[int]:
    """The whole numbers of an entry that sizes are made of; none of any other kind."""
    kind, count = int(entry["kind"]), int(entry["count"])
    if kind not in (3, 4) or int(entry["tag"]) not in (259, 279, 322, 323, 325):
        return []
    dtype = np.dtype(f"{order}u{_TIFF_SIZES[kind]}")
    if count * dtype.itemsize <= 4:
        return np.frombuffer(entry["at"].tobytes(), dtype, count).tolist()
    return np.frombuffer(content, dtype, count, int(entry["at"])).tolist()


def _too_many(name: str, what: str, most: int) -> CCWSIMError:
    return CCWSIMError(f"{name}: more than {most} {what} in a picture; save it again as PNG")
