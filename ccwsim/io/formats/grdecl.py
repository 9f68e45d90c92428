"""Read and write Eclipse GRDECL, and read IRAP ASCII: grids of reservoir programs."""

import re
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ccwsim import CCWSIMError, Grid
from ccwsim.io.data_file import DataFile, broken
from ccwsim.io.formats.text_tables import numbers_in
from ccwsim.io.limits import check, check_cells
from ccwsim.model.errors import refused

_KEYWORD = re.compile(rb"^[ \t]*([A-Za-z][A-Za-z0-9_+-]{0,31})\b([-\s\d.*+eEdD]*+)/", re.MULTILINE)
_SIZES = re.compile(rb"^[ \t]*(SPECGRID|DIMENS)\s+(\d{1,9})\s+(\d{1,9})\s+(\d{1,9})", re.M | re.I)
_REPEATED = re.compile(rb"(\d{1,9})\*(\S*)")
_PLACE = ("COORD", "ZCORN", "MAPAXES", "DXV", "DYV", "DZV", "DX", "DY", "DZ", "TOPS")
"""Keywords of the geometry; the last four have a value per cell."""
_PER_LINE = 5  # values in a line of a file; Eclipse reads 128 characters of a line
IRAP_UNKNOWN = 9999900.0  # value of an unknown cell in an IRAP ASCII grid


def is_grdecl(content: bytes) -> bool:
    """Return whether a text has the grid size of an Eclipse file."""
    return _SIZES.search(_bare(content[:65536])) is not None


def read_grdecl(content: bytes, name: str) -> DataFile:
    """Return the properties of an Eclipse file with one value per cell, from the top."""
    content = _bare(content)
    sizes = _SIZES.search(content)
    if sizes is None:
        raise CCWSIMError(f"{name} has no SPECGRID or DIMENS; add the size of the grid")
    nx, ny, nz = shape = tuple(int(size) for size in sizes.groups()[1:])
    n = check_cells(name, (nz, ny, nx))
    variables: dict[str, NDArray] = {}
    place: dict[str, NDArray] = {}
    for n_keywords, keyword in enumerate(_KEYWORD.finditer(content), start=1):
        check(name, variables=n_keywords)
        key, label = keyword[1].decode().upper(), f"{name}, {keyword[1].decode()}"
        if key in ("SPECGRID", "DIMENS"):
            continue
        values, counts = _values(keyword[2], label)
        if key in _PLACE:
            expands = key == "COORD" and counts.sum() == (nx + 1) * (ny + 1) * 6
            place[key] = np.repeat(values, counts) if expands else values
        elif counts.sum() == n:
            check_cells(name, (len(variables) + 1, nz, ny, nx))
            variables[key] = np.repeat(values, counts).reshape(nz, ny, nx)[::-1]
    active = variables.pop("ACTNUM", None) if len(variables) > 1 else None
    if not variables:
        raise CCWSIMError(f"{name} has no keyword with {n} values, one per cell")
    if active is not None:
        variables = {key: np.where(active == 0, np.nan, v) for key, v in variables.items()}
    file = DataFile("Eclipse GRDECL", name, variables, south_first=False)
    with broken(f"{name}: the geometry is broken; save the grid again", (ValueError, IndexError)):
        return _placed(file, place, shape)


def _placed(file: DataFile, place: Mapping[str, NDArray], shape: tuple[int, ...]) -> DataFile:
    """Return a file with the cell size and origin of its keywords, if the cells are equal."""
    nx, ny, nz = shape
    if "COORD" in place:
        pillars = place["COORD"].reshape(ny + 1, nx + 1, 6)
        x, y, z = pillars[0, :, 0], pillars[:, 0, 1], np.unique(place.get("ZCORN", np.zeros(1)))
        vertical = _pillars(x, y, np.zeros(6))
        if not np.array_equal(pillars[..., (0, 1, 3, 4)], vertical[..., (0, 1, 3, 4)]):
            return file
    else:
        steps = [place.get(f"D{a}V", place.get(f"D{a}", np.zeros(1))) for a in "XYZ"]
        top = np.unique(place.get("TOPS", np.zeros(1)))
        starts = np.zeros(1), np.zeros(1), top if len(top) == 1 else np.array([np.nan])
        steps = [step if len(np.unique(step)) == 1 else np.zeros(1) for step in steps]
        x, y, z = (
            a[0] + s[0] * np.arange(m + 1) for a, s, m in zip(starts, steps, shape, strict=True)
        )
    north, ox, oy, east = 1.0, 0.0, 0.0, 1.0
    if "MAPAXES" in place:
        yx, yy, ox, oy, xx, xy = place["MAPAXES"].tolist()
        north, east = np.sign(yy - oy), np.sign(xx - ox)
        if yx != ox or xy != oy:  # rotated
            return file
    x, y = ox + east * x, oy + north * y
    if not _regular(x, nx) or not _regular(y, ny):
        return file
    if x[-1] < x[0]:
        flipped = {key: values[..., ::-1] for key, values in file.variables.items()}
        file = replace(file, variables=flipped)
    if place.keys() & {"COORD", "MAPAXES"}:
        file = replace(file, south_first=bool(y[-1] > y[0]))
    size = [abs(x[-1] - x[0]) / nx, abs(y[-1] - y[0]) / ny]
    corner = [min(x[0], x[-1]), min(y[0], y[-1])]
    if _regular(z, nz) and z[-1] > z[0]:
        size, corner = [*size, (z[-1] - z[0]) / nz], [*corner, -z[-1]]
    return file.at([float(f"{s:.12g}") for s in size], [float(f"{c:.12g}") for c in corner])


def _regular(edges: NDArray, n: int) -> bool:
    """Return whether edges of n cells are equally spaced."""
    step = (edges[-1] - edges[0]) / n
    return len(edges) == n + 1 and step != 0 and np.allclose(np.diff(edges), step, 1e-3, 0)


def read_irap(content: bytes, name: str) -> DataFile:
    """Return the values of an IRAP ASCII grid, whose nodes are the centres of cells."""
    head = numbers_in(b" ".join(content.split(None, 19)[:19]), name).tolist()
    if len(head) < 19:
        raise CCWSIMError(f"{name}: the header is incomplete; get the complete file")
    n = check_cells(name, (head[1], head[8]))
    ny, nx, dx, dy = int(head[1]), int(head[8]), head[2], head[3]
    values = numbers_in(content, name)[19:]
    if len(values) != n or head[9]:
        raise refused("grdecl_rotation", name=name, n=n, there=len(values), rotation=head[9])
    origin = head[4] - dx / 2, head[6] - dy / 2
    grid = {"grid": values.reshape(1, ny, nx)}
    file = DataFile("IRAP ASCII grid", name, grid, missing=(IRAP_UNKNOWN,))
    return file.at((dx, dy), origin)


def grdecl_as_bytes(maps: Mapping[str, NDArray], grid: Grid) -> bytes:
    """Return maps (one layer of depths from 0 to 1) or volumes as an Eclipse GRDECL text."""
    return geometry_as_bytes(grid) + keywords_as_bytes(maps)


def geometry_as_bytes(grid: Grid) -> bytes:
    """Return the keywords SPECGRID, COORD and ZCORN of a grid."""
    nz, (ny, nx) = grid.nz or 1, grid.shape[-2:]
    (sx, sy, *along_z), (ox, oy, *bottom) = grid.cell_size, grid.origin
    sz, top = (along_z or [1.0])[0], -(bottom[0] + nz * along_z[0]) if along_z else 0.0
    x, y = ox + sx * np.arange(nx + 1), oy + sy * np.arange(ny + 1)[::-1]
    z = top + sz * np.arange(nz + 1)
    ends = np.array([0, 0, z[0], 0, 0, z[-1]])
    pillars = "\n".join(
        " ".join(map(repr, p)) for p in _pillars(x, y, ends).reshape(-1, 6).tolist()
    )
    layers = [f"{4 * nx * ny}*{depth!r}" for k in range(nz) for depth in z[k : k + 2].tolist()]
    parts = [f"SPECGRID\n{nx} {ny} {nz} 1 F /\n", f"COORD\n{pillars}\n/\n"]
    parts.append("ZCORN\n" + "\n".join(layers) + "\n/\n")
    return "".join(parts).encode()


def keywords_as_bytes(maps: Mapping[str, NDArray]) -> bytes:
    """Return maps or volumes as keywords with one value per cell."""
    parts: list[str] = []
    keywords: dict[str, None] = {}
    for name, values in maps.items():
        keyword = _keyword(name, keywords)
        keywords[keyword] = None
        layers = values if values.ndim == 3 else values[None]
        words = _repeated(layers[::-1, ::-1].ravel())
        lines = (" ".join(words[k : k + _PER_LINE]) for k in range(0, len(words), _PER_LINE))
        note = "" if keyword == name.upper() else f"-- {name}\n"
        parts.append(f"{note}{keyword}\n" + "\n".join(lines) + "\n/\n")
    return "".join(parts).encode()


def _pillars(x: NDArray, y: NDArray, ends: NDArray) -> NDArray[np.float64]:
    """Return the ends of vertical pillars at x and y, with the depths of the given pillar."""
    pillars = np.broadcast_to(ends, (len(y), len(x), 6)).copy()
    pillars[..., 0] = pillars[..., 3] = x
    pillars[..., 1] = pillars[..., 4] = y[:, None]
    return pillars


def _keyword(name: str, used: Mapping[str, None]) -> str:
    """Return an unused keyword of at most 8 letters and digits; keep a number at its end."""
    word = re.sub(r"[^A-Z0-9]+", "_", name.upper())
    stem = word.rstrip("0123456789")
    number, stem = word[len(stem) :], stem if stem[:1].isalpha() else f"P{stem}"
    for k in range(len(used) + 2):
        end = number if not k else f"{number}_{k}"
        keyword = f"{stem[: max(8 - len(end), 1)]}{end}"
        if keyword not in used and keyword not in (*_PLACE, "SPECGRID", "DIMENS", "ACTNUM"):
            return keyword
    raise AssertionError("more names than maps")


def _repeated(values: NDArray) -> list[str]:
    """Return numbers as words with repeat counts, such as 24*0."""
    starts = np.flatnonzero(np.r_[True, values[1:] != values[:-1]])
    counts = np.diff(np.r_[starts, values.size])
    numbers = values[starts].tolist()
    return [f"{n}*{v}" if n > 1 else f"{v}" for n, v in zip(counts, numbers, strict=True)]


def _bare(content: bytes) -> bytes:
    """Return a text without comments."""
    return re.sub(rb"--[^\n]*", b"", content)


def _values(text: bytes, name: str) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return the values of a keyword, and how often each is repeated."""
    words = text.split()
    counts = np.ones(len(words), np.int64)
    if b"*" in text:
        for k, word in enumerate(words):
            if repeated := _REPEATED.fullmatch(word):
                counts[k], words[k] = int(repeated[1]), repeated[2] or b"nan"
    return numbers_in(b" ".join(words), name), counts
