"""Test headers of real files, and headers that state impossible sizes."""

from __future__ import annotations

from io import BytesIO

import numpy as np
import pytest

from ccwsim import CCWSIMError, Grid
from ccwsim.io import (
    inspect,
    read_geometry,
    read_grid,
    read_realizations,
    read_training_image,
)
from ccwsim.io.data_file import DataFile

CODES = np.array([[0, 0, 1, 2], [0, 1, 1, 2], [2, 1, 0, 0]])
VALUES = "\n".join(map(str, CODES.ravel()))
ROWS = "\n".join(" ".join(map(str, row)) for row in CODES[::-1])
ESRI = "ncols 4\nnrows 3\nxllcorner 100\nyllcorner 200\ncellsize 10\nNODATA_value -9999\n" + ROWS
IRAP = f"-996 3 10.0 10.0\n105 135 205 225\n4 0.0 105 205\n0 0 0 0 0 0 0\n{VALUES}\n"
AT_100_200 = Grid(3, 4, cell_size=(10.0, 10.0), origin=(100.0, 200.0))
CENTRES = "105 205 0.5 10 10 1"
"""Centre of the first cell and cell size, in the order of the GSLIB programs."""

IN_THE_FIELD = {
    "a leading blank": f" 4 3 1\n 1\n facies\n{VALUES}\n",
    "words after the count": f"4 3 1\n1 (number of variables)\nfacies\n{VALUES}\n",
    "sizes after the count": f"title\n1 4 3 1\nfacies\n{VALUES}\n",
    "cells after the count": f"title\n1 4 3 1 {CENTRES} 1\nfacies\n{VALUES}\n",
    "words after the sizes": f"title\n1 4 3 1 {CENTRES} 1 (nvar nx ny nz)\nfacies\n{VALUES}\n",
    "the size in the title": f"channels (4x3x1)\n1\nfacies\n{VALUES}\n",
    "the end of DOS": f"4 3 1\n1\nfacies\n{VALUES}\n\x1a\x1a".replace("\n", "\r\n"),
    "exponents of Fortran": f"4 3 1\n1\nfacies\n{VALUES}\n".replace("\n2\n", "\n0.2D+01\n"),
    "ESRI with colons": ESRI.replace(" 4", ": 4"),
    "ESRI with a byte order": ESRI.replace("NODATA", "byteorder LSBFIRST\nNODATA"),
    "ESRI with xdim and ydim": ESRI.replace("cellsize 10", "xdim 10\nydim 10"),
    "ESRI with a centre and a corner": ESRI.replace("xllcorner 100", "xllcenter 105"),
    "ESRI with decimal commas": ESRI.replace("ize 10", "ize 10,0").replace("9999", "9999,0"),
    "IRAP ASCII": IRAP,
}


@pytest.mark.parametrize("name", IN_THE_FIELD)
def test_a_header_as_met_in_the_field_is_read(name):
    content = IN_THE_FIELD[name].encode()
    assert np.array_equal(read_grid(BytesIO(content)), CODES)
    stated = AT_100_200 if "00" in IN_THE_FIELD[name] or "105" in IN_THE_FIELD[name] else None
    assert read_geometry(BytesIO(content)) == stated


def test_realizations_that_follow_each_other_are_apart():
    text = f"sisim\n2 4 3 1 {CENTRES} 2\nfacies\nother\n"
    rows = [f"{code} {other}" for code, other in zip(CODES.ravel(), CODES.ravel() + 5, strict=True)]
    content = (text + "\n".join(rows + rows[::-1]) + "\n").encode()
    first = read_grid(BytesIO(content), variable="facies (1)")
    second = read_grid(BytesIO(content), variable="other (2)")
    assert np.array_equal(first, CODES)
    assert np.array_equal(second.ravel(), CODES.ravel()[::-1] + 5)
    one = f"sisim\n1 4 3 1 {CENTRES} 2\nfacies\n{VALUES}\n{VALUES}\n".encode()
    ensemble = read_realizations(BytesIO(one))
    assert ensemble.n == 2
    assert ensemble.grid == AT_100_200


IMPOSSIBLE = {
    "gslib 0": ("4 3 1 0 10 1 0 0 0\n1\nfacies\n", "cells of 0 along x"),
    "gslib -10": ("4 3 1 10 -10 1 0 0 0\n1\nfacies\n", "cells of -10 along y"),
    "gslib nan": ("4 3 1 10 10 nan 0 0 0\n1\nfacies\n", "cells of nan along z"),
    "gslib nowhere": ("4 3 1 10 10 1 nan 0 0\n1\nfacies\n", "along x from nan"),
    "gslib -3 rows": ("4 -3 1\n1\nfacies\n", "4 × .* impossible|-3 × 4"),
    "gslib no realization": ("t\n1 4 3 1 0\nfacies\n", "empty or impossible"),
    "gslib overflow": ("99999999999 99999999999 1\n1\nfacies\n", "are more than"),
    "esri 0": (ESRI.replace("cellsize 10", "cellsize 0"), "cells of 0 along x"),
    "esri -10": (ESRI.replace("cellsize 10", "dx 10\ndy -10"), "cells of -10 along y"),
    "esri nan": (ESRI.replace("cellsize 10", "cellsize nan"), "cells of nan"),
    "esri 4.5 columns": (ESRI.replace("ncols 4", "ncols 4.5"), "must be a whole number"),
    "esri inf columns": (ESRI.replace("ncols 4", "ncols 1e999"), "must be a whole number"),
    "irap -10": (IRAP.replace("10.0 10.0", "-10.0 10.0"), "cells of -10 along x"),
    "irap nan": (IRAP.replace("10.0 10.0", "nan 10.0"), "cells of nan along x"),
    "irap nan rows": (IRAP.replace("-996 3", "-996 nan"), "must be a whole number"),
    "irap overflow": (IRAP.replace("-996 3", "-996 1e300"), "are more than"),
    "vti 0": (
        '<VTKFile type="ImageData"><ImageData WholeExtent="0 2 0 1 0 1" Spacing="0 1 1">'
        '<Piece Extent="0 2 0 1 0 1"><CellData><DataArray type="Int8" Name="f" format="ascii">'
        "0 1</DataArray></CellData></Piece></ImageData></VTKFile>",
        "cells of 0 along x",
    ),
}


@pytest.mark.parametrize("name", IMPOSSIBLE)
def test_an_impossible_size_is_named(name):
    header, said = IMPOSSIBLE[name]
    content = header + (VALUES + "\n" if header.endswith("facies\n") else "")
    with pytest.raises(CCWSIMError, match=said):
        read_training_image(BytesIO(content.encode()))


@pytest.mark.parametrize("place", [((0, 1), ()), ((1, np.nan), ()), ((1, 1), (np.inf, 0))])
def test_no_reader_returns_impossible_cells(place):
    with pytest.raises(CCWSIMError, match="impossible; correct cell size and origin"):
        DataFile("any", "a", {"f": CODES[None]}).at(*place)


MATRIX = np.random.default_rng(5).integers(0, 2, (10, 8))


def numbered(head: str, index: bool, cells: object = MATRIX) -> bytes:
    """Return a matrix below a line of names, with or without a number before each row."""
    rows = [",".join(map(str, row)) for row in np.asarray(cells)[::-1]]
    rows = [f"{k},{row}" if index else row for k, row in enumerate(rows)]
    return "\n".join([head, *rows] if head else rows).encode()


HEADS = {
    "pandas without index": ",".join(map(str, range(8))),
    "pandas with a named index": "x," + ",".join(map(str, range(8))),
    "R": '"",' + ",".join(f'"V{k}"' for k in range(1, 9)),
    "names": ",".join(f"c{k}" for k in range(8)),
    "title": "Facies of the delta",
}


@pytest.mark.parametrize("kind", [*HEADS, "index only"])
def test_numbers_of_rows_and_columns_are_no_facies(kind):
    head = HEADS.get(kind, "")
    index = kind in ("pandas with a named index", "R", "index only")
    assert np.array_equal(read_grid(BytesIO(numbered(head, index))), MATRIX)
    words = np.array(["mud", "sand"])[MATRIX]
    read = read_training_image(BytesIO(numbered(head, index, words)))
    assert read.facies_names == ("mud", "sand")
    assert np.array_equal(read.array, MATRIX)


def test_a_matrix_may_count_up_without_losing_a_row():
    cells = np.arange(64).reshape(8, 8)
    assert np.array_equal(read_grid(BytesIO(numbered("", False, cells))), cells)
    few = np.array([[0, 1, 2], [1, 0, 0]])
    assert np.array_equal(read_grid(BytesIO(numbered("", False, few))), few)


def test_the_index_of_pandas_is_no_variable():
    rows = b",x,y,porosity,facies\n0,1.5,2.5,0.1,1\n1,3.5,2.5,0.2,0\n"
    names = [one.name for one in inspect(BytesIO(rows)).variables]
    assert names == ["x", "y", "porosity", "facies"]
