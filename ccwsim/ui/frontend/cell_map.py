"""Content of maps and volumes: cells with colours and labels, with data and marks on top."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ccwsim.figures import CIVIDIS, ramp
from ccwsim.model.grid import Grid
from ccwsim.model.hard_data import HardData
from ccwsim.model.training_image import TrainingImage
from ccwsim.sharing.choices import CellsOfWells

N_STEPS = 200
"""Number of colour steps of a probability map; shares of 200 realizations are not rounded."""


@dataclass(frozen=True)
class CellMap:
    """A map or volume to draw: indices with a colour and a label for each value."""

    indices: NDArray[np.uint8]  # (ny, nx) or (nz, ny, nx)
    colours: Sequence[str]  # colour "#rrggbb" of each value of `indices`
    labels: Sequence[str]  # label of each value, shown on hovering
    alt: str
    keys: Sequence[tuple[str, str]] = ()  # (label, colour) pairs of the legend
    strip: dict[str, Any] | None = None  # replaces the legend; keys: colours, low, high
    # each point has (layer,) row, column, colour index, and whether the datum is wrong
    points: list[list[int]] = field(default_factory=list)
    point_colours: Sequence[str] = ()
    points_are: tuple[str, str] = ("datum", "data")  # name of a point, in singular and plural
    # marks on a map; each has a kind ("box", "ring", "disc", "cross"), row, column, height,
    # width, colour and label
    marks: list[dict[str, Any]] = field(default_factory=list)
    trail: list[list[float]] = field(default_factory=list)  # line of cells with an arrow
    wells: CellsOfWells = ()  # named wells of a volume


def facies_map(
    indices: NDArray[np.uint8], training_image: TrainingImage, colours: Sequence[str], alt: str
) -> CellMap:
    """Return a map or volume of facies indices in the colours of the facies."""
    names = training_image.facies_names
    keys = list(zip(names, colours, strict=True))[:8]
    return CellMap(indices, colours, names, alt, keys=keys, point_colours=colours)


def share_map(
    shares: NDArray[np.float64],
    name: str,
    alt: str,
    *,
    colours: Sequence[str] = CIVIDIS,
    point_colours: Sequence[str] = (),
) -> CellMap:
    """Return a map or volume of numbers from 0 to 1, such as probabilities."""
    steps = ramp(colours, N_STEPS + 1)
    labels = [f"{name} {k / N_STEPS:.2f}" for k in range(N_STEPS + 1)]
    indices = np.rint(shares * N_STEPS).astype(np.uint8)
    strip = {"colours": list(colours), "low": "0", "high": "1"}
    return CellMap(indices, steps, labels, alt, strip=strip, point_colours=point_colours)


def points_of(
    data: HardData, training_image: TrainingImage, realization: NDArray[np.integer] | None = None
) -> list[list[int]]:
    """Return hard data as [(layer,) row, column, facies index, wrong].

    A datum is wrong if `realization` (facies codes) has another facies in the cell of the datum.
    """
    if not data.n:
        return []
    places = np.searchsorted(training_image.codes, data.facies)
    wrong = np.zeros(data.n, bool)
    if realization is not None:
        wrong = realization[tuple(data.cells.T)] != data.facies
    return np.column_stack([data.cells, places, wrong]).astype(int).tolist()


def shared_content(cell_map: CellMap, grid: Grid | None) -> dict[str, Any]:
    """Return the content that the components of maps and of volumes have in common."""
    n_dimensions = cell_map.indices.ndim
    n_wrong = sum(point[n_dimensions + 1] for point in cell_map.points)
    return {
        "lut": list(cell_map.colours),
        "labels": list(cell_map.labels),
        "keys": [list(pair) for pair in cell_map.keys],
        "strip": cell_map.strip,
        "points": cell_map.points,
        "point_lut": list(cell_map.point_colours) or None,
        "points_are": list(cell_map.points_are),
        "wrong_label": f"{n_wrong} not honoured" if n_wrong else "",
        "alt": cell_map.alt,
        "axes": grid is not None,
        "cell_size": list(grid.cell_size) if grid else [1.0] * n_dimensions,
        "origin": list(grid.origin) if grid else [0.0] * n_dimensions,
    }
