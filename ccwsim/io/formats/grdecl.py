"""Read and write Eclipse GRDECL, and read IRAP ASCII: grids of reservoir programs."""

import re
from collections.abc import Mapping

import numpy as np

from ccwsim import CCWSIMError, Grid, TrainingImage
from ccwsim.io.data_file import DataFile, broken, first_of, printable
from ccwsim.io.formats.text_tables import numbers_in
from ccwsim.io.limits import check, check_cells
from ccwsim.model import UNKNOWN, Array, Bytes, Floats, Ints, Mask, Shape, refused

_KEYWORD = re.compile(rb"^[ \t]*([A-Za-z][A-Za-z0-9_+-]{0,31})\b([-\s\d.*+eEdD]*+)/", re.MULTILINE)
_SIZES = re.compile(
    rb"^[ \t]*(?:SPECGRID|DIMENS)(?:\s|--[^\n]*)++(\d{1,9})\s+(\d{1,9})\s+(\d{1,9})", re.M | re.I
)
# the start of a text whose first line, apart from comments, is a keyword
_FIRST = re.compile(rb"(?:\s|--[^\n]*)*+[A-Z][A-Z0-9_]{1,15}[ \t]*(--[^\n]*|/[^\n]*)?\r?\n", re.I)
_REPEATED = re.compile(rb"(\d{1,9})\*(\S*)")
_PLACE = ("COORD", "ZCORN", "MAPAXES", "DXV", "DYV", "DZV", "DX", "DY", "DZ", "TOPS")
"""Keywords of the geometry; the last four have a value per cell."""
# keywords that set values without listing them, and names of files with the values
_ELSEWHERE = re.compile(
    rb"^[ \t\x27]*(INCLUDE|EQUALS|COPY|[^\s/\x27]+\.\w+(?=[\x27\s]*/))", re.M | re.I
)
_REGION = re.compile(rb"^-- region (\d{1,3}) = code (-?\d{1,19}),", re.MULTILINE)
_PER_LINE = 3  # values in a line of a file; Eclipse reads 128 characters of a line
_MAP_AXES = np.array([0.0, 1, 0, 0, 1, 0])  # a point on the y axis, the origin, one on the x axis
EQUAL = 1e-3  # maximum difference between equal cells, in cells
IRAP_UNKNOWN = 9999900.0  # value of an unknown cell in an IRAP ASCII grid


def is_grdecl(content: bytes) -> bool:
    """Return whether a text has the grid size of an Eclipse file, or starts with a keyword."""
    if _FIRST.match(content) is not None and _KEYWORD.search(_bare(content)) is not None:
        return True
    return _SIZES.search(content[:65536]) is not None


def read_grdecl(content: bytes, name: str) -> DataFile:
    """Return the properties of an Eclipse file with one value per cell, from the top."""
    codes = {int(region): float(code) for region, code in _REGION.findall(content)}
    content = _bare(content)
    sizes = _SIZES.search(content)
    if sizes is None:
        raise CCWSIMError(f"{name} has no SPECGRID or DIMENS; add the size of the grid")
    nx, ny, nz = shape = tuple(int(size) for size in sizes.groups())
    n = check_cells(name, (nz, ny, nx))
    variables: dict[str, Array] = {}
    place: dict[str, Array] = {}
    top_first = True
    for n_keywords, keyword in enumerate(_KEYWORD.finditer(content), start=1):
        check(name, variables=n_keywords)
        key, label = keyword[1].decode().upper(), f"{name}, {keyword[1].decode()}"
        if key in ("SPECGRID", "DIMENS"):
            continue
        values, counts = _values(keyword[2], label)
        if key == "ZCORN":
            ends = np.cumsum(counts)  # depths in the first half of the corners are smaller
            in_first = np.clip(ends[-1] / 2 - ends + counts, 0, counts)
            top_first = bool(2 * (values @ in_first) <= values @ counts)
        if key in _PLACE:
            expands = key == "COORD" and counts.sum() == (nx + 1) * (ny + 1) * 6
            place[key] = np.repeat(values, counts) if expands else values
        elif counts.sum() == n:
            check_cells(name, (len(variables) + 1, nz, ny, nx))
            if codes and key.startswith("FIP"):
                values = np.array([*map(codes.get, values.tolist())], float)
            variables[key] = np.repeat(values, counts).reshape(nz, ny, nx)
    active = variables.pop("ACTNUM", None) if len(variables) > 1 else None
    if not variables:
        words = dict.fromkeys(w.decode("utf-8", "replace") for w in _ELSEWHERE.findall(content))
        reason = f"; put the values in place of {first_of([*words])}" if words else ""
        raise CCWSIMError(f"{name} has no keyword with {n} values, one per cell{reason}")
    if active is not None:
        variables = {key: np.where(active == 0, np.nan, v) for key, v in variables.items()}
    upward = {key: v[::-1] if top_first else v for key, v in variables.items()}
    file = DataFile("Eclipse GRDECL", name, upward, south_first=False, bottom_first=not top_first)
    with broken(f"{name}: the geometry is broken; save the grid again", (ValueError, IndexError)):
        return _placed(file, place, shape)


def _placed(file: DataFile, place: Mapping[str, Array], shape: Shape) -> DataFile:
    """Return a file with the directions of its keywords, and the cell size if all are equal."""
    nx, ny, nz = shape
    north, corner, east = place.get("MAPAXES", _MAP_AXES).reshape(3, 2)
    axes = np.array([(end - corner) / np.hypot(*(end - corner)) for end in (east, north)])
    if "COORD" in place:
        pillars = place["COORD"].reshape(ny + 1, nx + 1, 2, 3)[..., :2]
        z = np.unique(place.get("ZCORN", np.zeros(1)))
    else:
        steps = [np.unique(place.get(f"D{a}V", place.get(f"D{a}", np.zeros(1)))) for a in "XYZ"]
        edges = [
            (s[0] if len(s) == 1 else 0) * np.arange(n + 1)
            for s, n in zip(steps, shape, strict=True)
        ]
        pillars = np.stack(np.meshgrid(*edges[:2]), axis=-1)[:, :, None]
        top = np.unique(place.get("TOPS", np.zeros(1)))
        z = edges[2] + (top[0] if len(top) == 1 else np.nan)
    pillars = corner + pillars @ axes
    along_i = (pillars[:, -1] - pillars[:, 0]).mean(axis=(0, 1))
    along_j = (pillars[-1] - pillars[0]).mean(axis=(0, 1))
    if place.keys() & {"COORD", "MAPAXES"}:
        file = file.along(along_i, along_j)
    steps = np.multiply.outer(np.arange(nx + 1) / nx, along_i)
    equal = pillars[0, 0, 0] + np.multiply.outer(np.arange(ny + 1) / ny, along_j)[:, None] + steps
    size = [abs(along_i[0]) / nx, abs(along_j[1]) / ny]
    is_equal = np.allclose(pillars, equal[:, :, None], rtol=0, atol=EQUAL * min(size))
    if file.geometry.azimuth != 90 or not min(size) or not is_equal:
        return file
    start = pillars.min(axis=(0, 1, 2)).tolist()
    if np.allclose(np.diff(z), (z[-1] - z[0]) / nz, EQUAL, 0) and len(z) == nz + 1 and z[-1] > z[0]:
        size, start = [*size, (z[-1] - z[0]) / nz], [*start, -z[-1]]
    return file.at([float(f"{s:.12g}") for s in size], [float(f"{c:.12g}") for c in start])


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


def grdecl_as_bytes(maps: Mapping[str, Array], grid: Grid) -> bytes:
    """Return maps (one layer of depths from 0 to 1) or volumes as an Eclipse GRDECL text.

    Each map is a keyword made of its name, for programs that read properties by their name.
    """
    keywords: dict[str, str] = {}
    for k, name in enumerate(maps, 1):
        word = re.sub(r"[^A-Z0-9]+", "_", name.upper())[:8]
        taken = *keywords, *_PLACE, "SPECGRID", "DIMENS", "ACTNUM"
        keywords[f"MAP-{k}" if word in taken or not word[:1].isalpha() else word] = name
    notes = [f"-- {key} is {name[:80]}\n" for key, name in keywords.items()]
    values = dict(zip(keywords, maps.values(), strict=True))
    return geometry_as_bytes(grid) + "".join(notes).encode() + keywords_as_bytes(values)


def regions_as_bytes(indices: Mapping[str, Bytes], image: TrainingImage) -> bytes:
    """Return facies indices as region keywords, which count from 1, with a table of the facies."""
    table = [
        f"-- region {k + 1} = code {code}, {printable(image.facies_names[k])}\n"
        for k, code in enumerate(image.codes)
    ]
    regions = {key: np.where(one == UNKNOWN, 0, one) + 1 for key, one in indices.items()}
    return "".join(table).encode() + keywords_as_bytes(regions)


def geometry_as_bytes(grid: Grid, active: Mask | None = None, thickness: float = 1.0) -> bytes:
    """Return SPECGRID, COORD, ZCORN and ACTNUM of a grid; a map has the `thickness`."""
    nz, (ny, nx) = grid.nz or 1, grid.shape[-2:]
    (sx, sy, *along_z), (ox, oy, *bottom) = grid.cell_size, grid.origin
    sz, top = (along_z or [thickness])[0], -(bottom[0] + nz * along_z[0]) if along_z else 0.0
    x, y = ox + sx * np.arange(nx + 1), oy + sy * np.arange(ny + 1)[::-1]
    z = top + sz * np.arange(nz + 1)
    ends = np.array([0, 0, z[0], 0, 0, z[-1]])
    pillars = "\n".join(
        " ".join(map(repr, end)) for end in _pillars(x, y, ends).reshape(-1, 3).tolist()
    )
    layers = [f"{4 * nx * ny}*{depth!r}" for k in range(nz) for depth in z[k : k + 2].tolist()]
    parts = [f"SPECGRID\n{nx} {ny} {nz} 1 F /\n", f"COORD\n{pillars}\n/\n"]
    parts.append("ZCORN\n" + "\n".join(layers) + "\n/\n")
    return "".join(parts).encode() + keywords_as_bytes({"ACTNUM": active})


def keywords_as_bytes(maps: Mapping[str, Array | None]) -> bytes:
    """Return maps or volumes, by keyword, with one value per cell; None is left out."""
    parts: list[str] = []
    for keyword, values in maps.items():
        if values is None:
            continue
        layers = (values if values.ndim == 3 else values[None]) * 1  # a mask becomes numbers
        words = _repeated(layers[::-1, ::-1].ravel())
        lines = (" ".join(words[k : k + _PER_LINE]) for k in range(0, len(words), _PER_LINE))
        parts.append(f"{keyword}\n" + "\n".join(lines) + "\n/\n")
    return "".join(parts).encode()


def _pillars(x: Array, y: Array, ends: Array) -> Floats:
    """Return the ends of vertical pillars at x and y, with the depths of the given pillar."""
    pillars = np.broadcast_to(ends, (len(y), len(x), 6)).copy()
    pillars[..., 0] = pillars[..., 3] = x
    pillars[..., 1] = pillars[..., 4] = y[:, None]
    return pillars


def _repeated(values: Array) -> list[str]:
    """Return numbers as words with repeat counts, such as 24*0."""
    starts = np.flatnonzero(np.r_[True, values[1:] != values[:-1]])
    counts = np.diff(np.r_[starts, values.size])
    numbers = values[starts].tolist()
    return [f"{n}*{v}" if n > 1 else f"{v}" for n, v in zip(counts, numbers, strict=True)]


def _bare(content: bytes) -> bytes:
    """Return a text without comments."""
    return re.sub(rb"--[^\n]*", b"", content)


def _values(text: bytes, name: str) -> tuple[Floats, Ints]:
    """Return the values of a keyword, and how often each is repeated."""
    words = text.split()
    counts = np.ones(len(words), np.int64)
    if b"*" in text:
        for k, word in enumerate(words):
            if repeated := _REPEATED.fullmatch(word):
                counts[k], words[k] = int(repeated[1]), repeated[2] or b"nan"
    return numbers_in(b" ".join(words), name), counts
