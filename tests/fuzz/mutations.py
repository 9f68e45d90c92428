"""Damage valid files: change any bytes, or the packed content inside a file."""

from __future__ import annotations

import random
import re
import struct
import zipfile
import zlib
from io import BytesIO

WORDS = (
    b"-1", b"0", b"1", b"99999999999999999999", b"nan", b"inf", b"-inf", b"1e308", b"1e999",
    b"-1e308", b"1e-320", b"1_0", b"0x10", b"\xc2\xb2", b"\xd9\xa3", b"\n", b"\r\n", b"\r",
    b"\x00", b",", b";", b"\t", b'"', b"'", b"#", b"(" * 50, b"[" * 300, b"{", b"\xff\xff\xff\xff",
    b"", b"\xef\xbb\xbf", b"\xff\xfe", b"<svg>", b"**x**", b"$x$", b"\xed\xa0\x80", b"True",
    b"None",    b"9" * 5000, b"a" * 5000, b" " * 5000, b"\n" * 5000, b"1 " * 3000, b"1," * 3000,
)  # fmt: skip
EXTREMES = (0, 1, 2, 0x7F, 0xFF, 0x7FFF, 0xFFFF, 2**24, 2**31 - 1, 2**31, 2**32 - 1)
_NUMBER = re.compile(rb"-?\d[\d.eE+-]*")


def mutated(content: bytes, source: random.Random, other: bytes = b"") -> bytes:
    """Return a file with changes; some changes insert pieces of the file `other`."""
    for _ in range(source.choice((1, 1, 1, 2, 3))):
        content = source.choice(_ways_of(content))(content, source, other)
    return content


def _ways_of(content: bytes) -> tuple:
    ways = (_cut, _bytes, _bytes, _words, _words, _repeat, _delete, _splice, _integer, _integer)
    if content.startswith(b"PK"):
        return (*ways[:3], _member, _member, _member, _member, _member, _member)
    if content.startswith(b"\x89PNG"):
        return (*ways, _chunk, _chunk, _chunk, _chunk, _chunk)
    if content.startswith(b"MATLAB 5") and content[128:129] == b"\x0f":
        return (*ways[:4], _packed_variable, _packed_variable, _packed_variable)
    if b"\x00" not in content[:1000]:
        return (*ways, _number, _number, _number, _lines, _lines, _line_ends)
    return ways


def _cut(content: bytes, source: random.Random, _: bytes) -> bytes:
    return content[: source.randrange(len(content) + 1)]


def _bytes(content: bytes, source: random.Random, _: bytes) -> bytes:
    data = bytearray(content or b"\0")
    near = source.random() < 0.5  # damage the header more often
    for _ in range(source.choice((1, 1, 2, 4, 16))):
        at = source.randrange(min(len(data), 200) if near else len(data))
        data[at] = source.choice((0, 1, 127, 128, 255, data[at] ^ (1 << source.randrange(8))))
    return bytes(data)


def _words(content: bytes, source: random.Random, _: bytes) -> bytes:
    at = source.randrange(min(len(content), source.choice((100, 10**9))) + 1)
    return content[:at] + source.choice(WORDS) + content[at + source.randrange(6) :]


def _repeat(content: bytes, source: random.Random, _: bytes) -> bytes:
    start = source.randrange(len(content) + 1)
    piece = content[start : start + source.choice((1, 4, 20, 200))]
    times = min(source.choice((1, 2, 10, 10_000)), 400_000 // (len(piece) or 1))
    return content[:start] + piece * times + content[start:]


def _delete(content: bytes, source: random.Random, _: bytes) -> bytes:
    start = source.randrange(len(content) + 1)
    return content[:start] + content[start + source.choice((1, 2, 8, 100)) :]


def _splice(content: bytes, source: random.Random, other: bytes) -> bytes:
    at, start = source.randrange(len(content) + 1), source.randrange(len(other) + 1)
    return content[:at] + other[start : start + 20_000]


def _integer(content: bytes, source: random.Random, _: bytes) -> bytes:
    """Return a file with an absurd size or offset, in either byte order."""
    if len(content) < 4:
        return content
    at = source.randrange(min(len(content), source.choice((250, 10**9))) - 3)
    value = struct.pack(source.choice("<>") + "I", source.choice(EXTREMES))
    width = source.choice((2, 4))
    return content[:at] + value[:width] + content[at + width :]


def _number(content: bytes, source: random.Random, _: bytes) -> bytes:
    head = content[: source.choice((100, 4000))]
    found = list(_NUMBER.finditer(head))
    if not found:
        return content
    number = source.choice(found)
    return content[: number.start()] + source.choice(WORDS[:16]) + content[number.end() :]


def _lines(content: bytes, source: random.Random, _: bytes) -> bytes:
    lines = content.split(b"\n")
    here, there = source.randrange(len(lines)), source.randrange(len(lines))
    if source.random() < 0.5:
        lines[here], lines[there] = lines[there], lines[here]
    else:
        lines[here:there] = []
    return b"\n".join(lines)


def _line_ends(content: bytes, source: random.Random, _: bytes) -> bytes:
    ends = (b"\r\n", b"\r", b"\n\r", b"\n\n", b" \n", b"\x0b", b"\xc2\x85", b"\n\x00")
    return content.replace(b"\n", source.choice(ends), source.choice((1, 5, -1)))


def _member(content: bytes, source: random.Random, other: bytes) -> bytes:
    """Return a valid zip in which a member is changed, renamed, repeated or removed."""
    try:
        with zipfile.ZipFile(BytesIO(content)) as old:
            members = [(info.filename, old.read(info)) for info in old.infolist()]
    except Exception:
        return _bytes(content, source, other)
    if not members:
        return content
    k = source.randrange(len(members))
    name, own = members[k]
    way = source.randrange(8)
    if way < 5:
        members[k] = (name, mutated(own, source, other) if own else other[:100])
    elif way == 5:
        members[k] = (source.choice(("../../x.npy", "/etc/x.npy", "a\x07\n.npy", "**x**.npy")), own)
    elif way == 6:
        members += [(f"{j}{name}", own[:300]) for j in range(source.choice((1, 20, 1500)))]
    else:
        members.pop(k)
    return zipped(members)


def zipped(members: list[tuple[str, bytes]], packing: int = zipfile.ZIP_DEFLATED) -> bytes:
    """Return a zip file with the given members."""
    written = BytesIO()
    with zipfile.ZipFile(written, "w", packing) as new:
        for name, own in members:
            new.writestr(zipfile.ZipInfo(name or "x"), own, packing)
    return written.getvalue()


def _chunk(content: bytes, source: random.Random, other: bytes) -> bytes:
    """Return a PNG with one chunk changed, moved, repeated or left out, with a correct checksum."""
    chunks, at = [], 8
    while at + 12 <= len(content):
        (size,) = struct.unpack_from(">I", content, at)
        chunks.append((content[at + 4 : at + 8], content[at + 8 : at + 8 + size]))
        at += 12 + size
    if not chunks:
        return content
    k = source.randrange(len(chunks))
    kind, data = chunks[k]
    way = source.randrange(5)
    if way == 0:
        chunks[k] = (kind, _bytes(data, source, other))
    elif way == 1:
        chunks[k] = (kind, _integer(data, source, other))
    elif way == 2:
        chunks.insert(source.randrange(len(chunks) + 1), chunks[k])
    elif way == 3:
        chunks.pop(k)
    else:
        new = source.choice(
            (b"tEXt", b"zTXt", b"iCCP", b"tRNS", b"PLTE", b"acTL", b"eXIf", b"IEND")
        )
        chunks.insert(k, (new, data[:300]))
    return content[:8] + b"".join(png_chunk(kind, data) for kind, data in chunks)


def png_chunk(kind: bytes, data: bytes) -> bytes:
    """Return a chunk of a PNG with its checksum."""
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def _packed_variable(content: bytes, source: random.Random, other: bytes) -> bytes:
    """Return a MATLAB file in which a packed variable is changed and packed again."""
    try:
        inside = zlib.decompress(content[136:])
    except zlib.error:
        return _bytes(content, source, other)
    way = source.choice((_bytes, _integer, _integer, _cut, _repeat))
    packed = zlib.compress(way(inside, source, other))
    return content[:128] + struct.pack("<II", 15, len(packed)) + packed
