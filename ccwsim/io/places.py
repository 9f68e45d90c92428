"""Compare the places of maps, outlines and lines with the place of a grid."""

from collections.abc import Sequence

import numpy as np

from ccwsim import Grid
from ccwsim.io.data_file import Geometry
from ccwsim.io.formats.rasters import moved
from ccwsim.model import WORLD_AXES, Floats, refused, shown

TOLERANCE = 0.1  # maximum distance between corners of a map and of the grid, in cells
LONGITUDE_LATITUDE = "OGC:CRS84"  # the coordinate system of GeoJSON that names no other
Rings = list[Floats]  # the rings of a polygon, or a line, with points (x, y)


def check_place(name: str, place: Geometry, grid: Grid) -> None:
    """Raise an error if a file and a grid state different places over the extent of the grid."""
    if not any(grid.origin) and {*grid.cell_size} == {1.0}:  # the grid has no place
        return
    ends, tolerance = _corners(grid), TOLERANCE * np.array(grid.cell_size)
    shift = moved(ends[:, :2], place.crs, grid.crs) - ends[:, :2]
    if not (np.abs(shift) <= tolerance[:2]).all():
        raise refused("other_crs", name=name, crs=shown(place.crs), other=shown(grid.crs))
    if abs(np.cos(np.radians(place.azimuth))) * max(grid.shape) > 0.5:
        raise refused("rotated_map", name=name, azimuth=place.azimuth)
    k = min(len(place.cell_size), len(grid.shape))
    stated, ends = _corners(place.grid(grid.shape))[:, :k], ends[:, :k]
    if (np.abs(stated - ends) > tolerance[:k]).any():
        raise refused("other_place", name=name, extent=_extent(stated), grid=_extent(ends))


def on_grid(name: str, shapes: list[Rings], crs: str, grid: Grid) -> list[Rings]:
    """Return polygons or lines in the coordinate system of a grid, which some of them reach."""
    ends = _corners(grid)[:, :2]
    is_global = all((np.abs(points) <= (180, 90)).all() for shape in shapes for points in shape)
    if not crs and is_global and (np.abs(ends) > (180, 90)).all():
        crs = LONGITUDE_LATITUDE
    shapes = [[moved(points, crs, grid.crs) for points in shape] for shape in shapes]
    boxes = np.array([[ps.min(axis=0), ps.max(axis=0)] for shape in shapes for ps in shape])
    if not ((boxes[:, 0] <= ends[1]) & (boxes[:, 1] >= ends[0])).all(axis=1).any():
        extent = boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)
        raise refused("outside_grid", name=name, extent=_extent(extent), grid=_extent(ends))
    return shapes


def _corners(grid: Grid) -> Floats:
    """Return the lowest and the highest corner of a grid."""
    extent = np.multiply(grid.cell_size, grid.shape[::-1])
    return np.array([grid.origin, grid.origin + extent])


def _extent(ends: Sequence[Floats] | Floats) -> str:
    axes = zip(WORLD_AXES, *ends, strict=False)
    return ", ".join(f"{axis} from {low:.9g} to {high:.9g}" for axis, low, high in axes)
