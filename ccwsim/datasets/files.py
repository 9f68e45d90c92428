"""The bundled files: where they are and how they are written and read.

Images are indexed PNG, so that any viewer shows them and the indices are the facies codes. Rows
are stored from the north, as pictures have them. Hard data are CSV with x, y (of cell centres, in
cells from the south-west corner) and facies.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ccwsim.model.errors import CCWSIMError
from ccwsim.model.grid import Grid
from ccwsim.model.hard_data import HardData

ASSETS = Path(__file__).parents[1] / "assets"
PALETTE = [(235, 225, 200), (60, 90, 150), (190, 90, 50), (80, 140, 80)]


def image_path(name: str) -> Path:
    """Return where the training image of this name is stored."""
    return ASSETS / "training_images" / f"{name}.png"


def hard_data_path(name: str) -> Path:
    """Return where the hard data of this name are stored."""
    return ASSETS / "hard_data" / f"{name}.csv"


def write_image(path: Path, facies: NDArray[np.uint8]) -> None:
    """Write facies codes 0, 1, … of shape (ny, nx), row 0 at the south, as an indexed PNG."""
    image = Image.fromarray(np.ascontiguousarray(facies[::-1], np.uint8))
    image.putpalette([channel for colour in PALETTE for channel in colour])
    path.parent.mkdir(parents=True, exist_ok=True)
    image.save(path, optimize=True, bits=2)


def read_image(path: Path) -> NDArray[np.uint8]:
    """Read what `write_image` wrote."""
    with Image.open(_present(path)) as image:
        return np.asarray(image, np.uint8)[::-1]


def write_hard_data(path: Path, data: HardData, grid: Grid) -> None:
    """Write hard data as x, y, facies."""
    rows = np.column_stack([grid.centers_of(data.cells), data.facies])
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savetxt(
        path, rows, fmt=("%.1f", "%.1f", "%d"), delimiter=",", header="x,y,facies", comments=""
    )


def read_hard_data(path: Path, grid: Grid) -> HardData:
    """Read what `write_hard_data` wrote."""
    x, y, facies = np.loadtxt(_present(path), delimiter=",", skiprows=1, unpack=True)
    return HardData(grid.cells_of(x, y), facies)


def _present(path: Path) -> Path:
    if not path.is_file():
        raise CCWSIMError(
            f"bundled file {path} is missing; write it again with: python -m ccwsim.datasets"
        )
    return path
