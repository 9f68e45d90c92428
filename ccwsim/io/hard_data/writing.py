"""Hard data written to files that `read_hard_data` and other programs read."""

from __future__ import annotations

from typing import Any

from ccwsim.io.atomic import format_of, write_bytes
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.grid import Grid
from ccwsim.model.hard_data import HardData

FORMATS = ("csv", "gslib", "dat")


def write_hard_data(
    path_or_file: Any, hard_data: HardData, grid: Grid | None = None, *, format: str | None = None
) -> None:
    """Write hard data as points at the centres of their cells.

    Parameters
    ----------
    path_or_file : path or binary file
        A path is replaced whole or not at all.
    hard_data : HardData
    grid : Grid, optional
        Places the cells in the world; without it a cell has size 1 and the first starts at (0, 0).
    format : "csv", "gslib" or "dat", optional
        The ending of the path where not given.

    Raises
    ------
    CCWSIMError
        As `hard_data_as_bytes`, and for a place that cannot be written.

    Examples
    --------
    >>> from io import BytesIO
    >>> file = BytesIO()
    >>> write_hard_data(file, HardData([[3, 4]], [1]), format="csv")
    >>> file.getvalue()
    b'x,y,facies\\n4.5,3.5,1\\n'
    """
    kind = format_of(path_or_file, format, FORMATS)
    write_bytes(path_or_file, hard_data_as_bytes(hard_data, kind, grid))


def hard_data_as_bytes(hard_data: HardData, format: str, grid: Grid | None = None) -> bytes:
    """Return hard data as the content of a file, for a download.

    `csv` has the columns x, y, facies; `gslib` and `dat` are a Geo-EAS table of x, y, z (0) and
    facies, as SGeMS and GSLIB programs take point sets.

    Raises
    ------
    CCWSIMError
        For another format, or no data.

    Examples
    --------
    >>> hard_data_as_bytes(HardData([[3, 4]], [1]), "gslib")
    b'1 hard data\\n4\\nx\\ny\\nz\\nfacies\\n4.5 3.5 0 1\\n'
    """
    kind = format_of(None, format, FORMATS)
    if not hard_data.n:
        raise CCWSIMError("there are no hard data to write; place some first")
    places = (grid or Grid(1, 1)).centers_of(hard_data.cells).tolist()
    rows = zip(places, hard_data.facies.tolist(), strict=True)
    if kind == "csv":
        lines = ["x,y,facies", *(f"{x!r},{y!r},{code}" for (x, y), code in rows)]
    else:
        head = [f"{hard_data.n} hard data", "4", "x", "y", "z", "facies"]
        lines = [*head, *(f"{x!r} {y!r} 0 {code}" for (x, y), code in rows)]
    return "\n".join([*lines, ""]).encode()
