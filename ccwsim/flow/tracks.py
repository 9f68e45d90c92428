"""Tracks of particles that move with steady flow (Pollock 1988)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ccwsim.flow.darcy import Floats, Flow, _cell, array_axis
from ccwsim.jobs.workers import check_stop
from ccwsim.model.arrays import as_floats, check_int, check_type
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.grid import Grid

LEFT, IN_WELL, STUCK = 0, 1, 2
"""End of a track: it left the grid, entered the cell of a well, or stopped in a cell."""
MAX_CROSSINGS = 5  # maximum number of cells of a track, in sums of the sides of the grid
STEPS_BETWEEN_CHECKS = 64
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
    volume, sign = float(np.prod(_cell(grid))), -1.0 if backward else 1.0
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
        out = ((cells < 0) | (cells >= shape)).any(axis=1)
        status[who[out]] = LEFT
        who, cells, position = who[~out], cells[~out], position[~out]
    return Tracks(times, status, _paths(log, n, corner, size))


def cells_at(points: Floats, grid: Grid) -> NDArray[np.int64]:
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

    Raises `CCWSIMError` if nothing flows in through the two sides of the axis.

    Examples
    --------
    >>> from ccwsim.flow import darcy
    >>> starts_at_inflow(darcy([[1.0], [3.0]], west_east=(1.0, 0.0)), 2).round(2).tolist()
    [[0.0, 1.0], [0.0, 1.67]]
    """
    check_type("flow", flow, Flow)
    grid, number = flow.grid, array_axis(axis, flow.grid)
    n, n_axes = check_int("n", n, 1, MAX_PARTICLES), grid.n_dimensions
    ends = [np.maximum(s * flow.fluxes[number].take(e, number), 0) for e, s in ((0, 1), (-1, -1))]
    end = int(ends[1].sum() > ends[0].sum())
    inflow = ends[end]
    total = np.cumsum(inflow.ravel())
    if not total[-1] > 0:
        raise CCWSIMError(f"nothing flows into the grid along {axis}; fix two different heads")
    wanted = (np.arange(n) + 0.5) / n * total[-1]
    face = np.searchsorted(total, wanted)
    part = 1 - (total[face] - wanted) / inflow.ravel()[face]
    places = np.array(np.unravel_index(face, inflow.shape), float).T + 0.5
    places[:, -1] += part - 0.5
    places = np.insert(places, number, end * grid.shape[number], axis=1)
    return places[:, ::-1] * grid.cell_size[:n_axes] + grid.origin[:n_axes]
