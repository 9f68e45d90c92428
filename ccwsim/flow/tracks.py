"""Tracks of particles that move with steady flow (Pollock 1988)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ccwsim import CCWSIMError, Grid
from ccwsim.flow.darcy import Floats, Flow, array_axis, cell_sizes
from ccwsim.jobs.workers import check_stop
from ccwsim.model import ArrayLike, Ints, as_floats, check_int, check_type

LEFT_GRID, IN_WELL, STUCK = 0, 1, 2
"""End of a track: it left the grid, entered the cell of a well, or stopped in a cell."""
MAX_CROSSINGS = 5  # maximum number of cells of a track, in sums of the sides of the grid
STEPS_BETWEEN_CHECKS = 64
# distance of starts from a face, in cells, so that rounding keeps them in the cell
START_INSET = 1e-6
MAX_PARTICLES = 1_000_000  # maximum number of particles, which are all followed at once


@dataclass(frozen=True, eq=False)
class Tracks:
    """Tracks of n particles."""

    times: Floats
    """Travel time to the end of each track, shape (n,)."""
    status: NDArray[np.int8]
    """LEFT (0), IN_WELL (1) or STUCK (2), shape (n,)."""
    paths: list[Floats]
    """Points of each track, (m, 1 + dimensions): time, x, y (and z); empty if not kept."""


def tracks(
    flow: Flow,
    starts: ArrayLike,
    *,
    porosity: ArrayLike = 0.25,
    backward: bool = False,
    keep_paths: bool = True,
) -> Tracks:
    """Follow particles through the cells; velocities are linear in each cell along each axis.

    Within a cell, v = v₀ + A x along an axis, and the time to the face is ln(v₁ / v) / A. Raises
    `CCWSIMError` if a start is outside the grid or in an inactive cell, or a porosity is out of
    range.

    `starts` in world units have the columns x, y (and z). `backward` follows the particles
    upstream, and `keep_paths` stores the points at which they enter cells.

    Examples
    --------
    >>> from ccwsim.flow import darcy
    >>> paths = tracks(darcy([[1.0, 1.0]], west_east=(2.0, 0.0)), [[0.5, 0.5]], porosity=0.5)
    >>> paths.times, paths.paths[0].round(6).tolist()
    (array([0.75]), [[0.0, 0.5, 0.5], [0.25, 1.0, 0.5], [0.75, 2.0, 0.5]])
    """
    check_type("flow", flow, Flow)
    check_type("backward", backward, bool, np.bool_)
    check_type("keep_paths", keep_paths, bool, np.bool_)
    grid, points = flow.grid, as_floats(starts, "starts")
    n_axes = grid.n_dimensions
    if points.ndim != 2 or points.shape[1] != n_axes:
        raise CCWSIMError(f"starts of shape {points.shape} must be (n, {n_axes})")
    shares = as_floats(porosity, "porosity")
    if (
        shares.shape not in ((), grid.shape)
        or not (((shares > 0) & (shares <= 1)) | np.isnan(flow.heads)).all()
    ):
        raise CCWSIMError("porosity must be above 0 and at most 1: a number, or one for each cell")
    cells = cells_at(points, grid)
    if not grid.holds(cells).all() or np.isnan(flow.heads[tuple(cells.T)]).any():
        raise CCWSIMError("a start is outside the grid or in an inactive cell; move it")
    shares = np.broadcast_to(shares, grid.shape)
    size = np.array(grid.cell_size[:n_axes][::-1])
    volume, sign = float(np.prod(cell_sizes(grid, flow.thickness))), -1.0 if backward else 1.0
    sinks = np.zeros(grid.shape, bool)
    for cell, rate in flow.wells.items():
        sinks[cell] = sign * rate < 0
    n, shape = len(points), np.array(grid.shape)
    corner = np.array(grid.origin[:n_axes][::-1])
    position = (points[:, ::-1] - corner) / size - cells  # position in the cell, from 0 to 1
    times, status = np.zeros(n), np.full(n, STUCK, np.int8)
    who = np.arange(n)
    log = [(who, times.copy(), cells + position)] if keep_paths else []
    for step in range(MAX_CROSSINGS * int(shape.sum())):
        inside = sinks[tuple(cells.T)]
        status[who[inside]] = IN_WELL
        who, cells, position = who[~inside], cells[~inside], position[~inside]
        if not len(who):
            break
        if step % STEPS_BETWEEN_CHECKS == 0:
            check_stop()
        v0, v1 = np.empty(position.shape), np.empty(position.shape)
        for axis, flux in enumerate(flow.fluxes):
            v0[:, axis] = flux[tuple(cells.T)]
            ahead = cells.copy()
            ahead[:, axis] += 1
            v1[:, axis] = flux[tuple(ahead.T)]
        scale = sign / (volume * shares[tuple(cells.T)])[:, None]  # cells per time
        v0, v1 = v0 * scale, v1 * scale
        slope = v1 - v0
        v = v0 + slope * position
        exit_v, way = np.where(v > 0, v1, v0), np.where(v > 0, 1.0 - position, -position)
        with np.errstate(all="ignore"):
            even = np.abs(slope) < 1e-9 * np.maximum(np.abs(v0), np.abs(v1))
            dt = np.where(even, way / v, np.log(exit_v / v) / slope)
            dt[(v == 0) | (exit_v * v <= 0) | ~(dt >= 0)] = np.inf
            axis = dt.argmin(axis=1)
            row = np.arange(len(who))
            dt = dt[row, axis]
            moves = np.isfinite(dt)
            grown = slope * dt[:, None]
            position = position + np.where(
                np.abs(grown) < 1e-9, v * dt[:, None], v * np.expm1(grown) / slope
            )
        position = np.clip(position, 0.0, 1.0)
        upward = v[row, axis] > 0
        position[row, axis] = np.where(upward, 0.0, 1.0)
        cells[row, axis] += np.where(upward, 1, -1)
        who, cells, position, dt = who[moves], cells[moves], position[moves], dt[moves]
        times[who] += dt
        if keep_paths:
            log.append((who, times[who], cells + position))
        out = np.any((cells < 0) | (cells >= shape), axis=1)
        out[~out] = np.isnan(flow.heads[tuple(cells[~out].T)])  # across the outline
        status[who[out]] = LEFT_GRID
        who, cells, position = who[~out], cells[~out], position[~out]
    return Tracks(times, status, _paths(log, n, corner, size))


def cells_at(points: Floats, grid: Grid) -> Ints:
    """Return the (layer,) row and column of points with the columns x, y (and z)."""
    return grid.cells_of(*points.T)


def _paths(log: list, n: int, corner: Floats, size: Floats) -> list[Floats]:
    """Return the points of each track, in world units."""
    if not log:
        return []
    who, times, cells = (np.concatenate([entry[k] for entry in log]) for k in range(3))
    points = np.column_stack([times, (cells * size + corner)[:, ::-1]])
    order = np.argsort(who, kind="stable")
    return np.split(points[order], np.cumsum(np.bincount(who, minlength=n))[:-1])


def starts_at_inflow(flow: Flow, n: int, axis: str = "x") -> Floats:
    """Return n starts on the inflow side of an axis, each with the same share of the inflow.

    The axis "edge" is for heads along an outline, where starts are on all faces with inflow. Raises
    `CCWSIMError` if nothing flows in.

    Examples
    --------
    >>> from ccwsim.flow import darcy
    >>> starts_at_inflow(darcy([[1.0], [3.0]], west_east=(1.0, 0.0)), 2).round(2).tolist()
    [[0.0, 1.0], [0.0, 1.67]]
    """
    check_type("flow", flow, Flow)
    faces, grid, n_axes = flow.fixed_faces, flow.grid, flow.grid.n_dimensions
    n, inflow = check_int("n", n, 1, MAX_PARTICLES), np.maximum(faces.inflows, 0)
    if not (isinstance(axis, str) and axis == "edge"):
        across = faces.axes == array_axis(axis, grid)
        low, high = (inflow[across & (faces.ends == end)].sum() for end in (0, 1))
        inflow = np.where(across & (faces.ends == int(high > low)), inflow, 0)
    total = np.cumsum(inflow)
    if not (len(total) and total[-1] > 0):
        raise CCWSIMError(f"nothing flows into the grid along {axis}; fix two different heads")
    wanted = (np.arange(n) + 0.5) / n * total[-1]
    face = np.searchsorted(total, wanted)
    row, number = np.arange(n), faces.axes[face]
    places = np.full((n, n_axes), 0.5)  # in the cell
    last = np.where(number == n_axes - 1, n_axes - 2, n_axes - 1)  # an axis along the face
    places[row, last] = 1 - (total[face] - wanted) / inflow[face]
    places[row, number] = np.clip(faces.ends[face], START_INSET, 1 - START_INSET)
    places += faces.cells[face]
    return places[:, ::-1] * grid.cell_size[:n_axes] + grid.origin[:n_axes]
