"""Realizations to files and downloads: npz, SGeMS/GSLIB grid, PNG."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from math import ceil, sqrt

import numpy as np
from numpy.typing import NDArray

from ccwsim.io.atomic import format_of, write_bytes
from ccwsim.io.formats.pictures import picture_as_bytes
from ccwsim.io.formats.text_grids import grid_as_bytes
from ccwsim.io.opening import PathOrFile
from ccwsim.io.project import parameters_to_json
from ccwsim.model.ensemble import Ensemble
from ccwsim.model.errors import CCWSIMError

FORMATS = ("npz", "gslib", "sgems", "dat", "png")
"""Formats of realizations, by their endings."""

MAX_PIXELS = 50_000_000
"""Of one picture of all realizations; programs that show pictures take no more."""

GAP = 4
"""White cells between the maps of a contact sheet."""


def write_realizations(
    path_or_file: PathOrFile,
    ensemble: Ensemble,
    *,
    format: str | None = None,
    colours: Sequence[str] | None = None,
) -> None:
    """Write realizations to a file, whole or not at all.

    Parameters
    ----------
    path_or_file : str, Path or binary file
        A path is replaced at once; a file object needs `format`.
    ensemble : Ensemble
        What to write.
    format : str, optional
        One of `FORMATS`; by the ending of the path by default.
    colours : sequence of str, optional
        For PNG: one `#rrggbb` a facies.

    Raises
    ------
    CCWSIMError
        For another format, or a place that cannot be written.

    Examples
    --------
    >>> from ccwsim import Grid, HardData, Parameters, TrainingImage
    >>> ti, data = TrainingImage([[0, 1]]), HardData()
    >>> one, none = np.array([[[0, 1], [1, 1]]], np.uint8), np.zeros((1, 0), np.int16)
    >>> e = Ensemble(ti, Grid(2, 2), Parameters(), data, 0, one, np.zeros(1), 0.0, none, [0])
    >>> file = BytesIO()
    >>> write_realizations(file, e, format="sgems")
    >>> file.getvalue()
    b'2 2 1\\n1\\nrealization_1\\n0\\n1\\n1\\n1\\n'
    """
    kind = format_of(path_or_file, format, FORMATS)
    write_bytes(path_or_file, realizations_as_bytes(ensemble, kind, colours=colours))


def realizations_as_bytes(
    ensemble: Ensemble, format: str, *, colours: Sequence[str] | None = None
) -> bytes:
    """Return realizations as the content of a file, for a download.

    `npz` holds `realizations` (n, ny, nx) in the training image's codes, `codes`, `parameters`
    (JSON), `seed`, `cpu_seconds`, `hard_cells`, `hard_facies`, `met_by`, `cell_size`, `origin`;
    `gslib`, `sgems` and `dat` hold one column a realization, from the south-west, x fastest, with
    size of the cells and origin in line 1; `png` is one map, or a contact sheet of all, north up.

    Raises
    ------
    CCWSIMError
        For another format, no realizations, or too many for one picture.

    Examples
    --------
    >>> from ccwsim import Grid, HardData, Parameters, TrainingImage
    >>> ti, data = TrainingImage([[0, 1]]), HardData()
    >>> one, none = np.array([[[0, 1], [1, 1]]], np.uint8), np.zeros((1, 0), np.int16)
    >>> e = Ensemble(ti, Grid(2, 2), Parameters(), data, 0, one, np.zeros(1), 0.0, none, [0])
    >>> with np.load(BytesIO(realizations_as_bytes(e, "npz"))) as saved:
    ...     saved["realizations"].tolist()
    [[[0, 1], [1, 1]]]
    """
    kind = format_of(None, format, FORMATS)
    if not ensemble.n:
        raise CCWSIMError("there are no realizations to write; simulate some first")
    if kind == "npz":
        return _npz(ensemble)
    if kind == "png":
        n_facies = ensemble.training_image.n_facies
        return picture_as_bytes(_sheet(ensemble.indices, n_facies), n_facies, colours)
    names = [f"realization_{k + 1}" for k in range(ensemble.n)]
    return grid_as_bytes(list(ensemble.realizations), names, ensemble.grid)


def _npz(ensemble: Ensemble) -> bytes:
    content = BytesIO()
    np.savez_compressed(
        content,
        allow_pickle=False,
        realizations=ensemble.realizations,
        codes=ensemble.training_image.codes,
        parameters=np.array(parameters_to_json(ensemble.parameters)),
        seed=np.array(ensemble.seed),
        cpu_seconds=ensemble.cpu_seconds,
        hard_cells=ensemble.hard_data.cells,
        hard_facies=ensemble.hard_data.facies,
        met_by=ensemble.data_status,
        numbers=ensemble.numbers,
        revised=np.array(ensemble.revised),
        cell_size=np.array(ensemble.grid.cell_size),
        origin=np.array(ensemble.grid.origin),
    )
    return content.getvalue()


def _sheet(indices: NDArray[np.uint8], white: int) -> NDArray[np.uint8]:
    """All maps side by side, the first at the top left once north is up."""
    n, ny, nx = indices.shape
    columns = min(n, max(1, ceil(sqrt(n * ny / nx))))
    rows = ceil(n / columns)
    shape = (rows * (ny + GAP) - GAP, columns * (nx + GAP) - GAP)
    if shape[0] * shape[1] > MAX_PIXELS or max(shape) > 65_000:
        raise CCWSIMError(f"{n} realizations make too large a picture; write fewer, or npz")
    sheet = np.full(shape, white, np.uint8)
    for k, one in enumerate(indices):
        row, column = rows - 1 - k // columns, k % columns
        south, west = row * (ny + GAP), column * (nx + GAP)
        sheet[south : south + ny, west : west + nx] = one
    return sheet
