"""Steady single-phase flow through a map or a volume: heads, fluxes and effective conductivity."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import ndimage, sparse
from scipy.sparse.linalg import spsolve

from ccwsim.jobs.workers import check_stop
from ccwsim.model.arrays import (
    as_array,
    as_floats,
    as_integers,
    check_choice,
    check_number,
    check_type,
    describe_shape,
    readonly,
)
from ccwsim.model.bounds import MAX_CONTRAST, MAX_MAGNITUDE
from ccwsim.model.errors import CCWSIMError, refused, shown
from ccwsim.model.facies_property import check_magnitudes
from ccwsim.model.grid import Grid

SIDES = {"x": ("west", "east"), "y": ("south", "north"), "z": ("bottom", "top")}
"""Sides of the grid at both ends of each axis."""
TOLERANCE = 3e-7  # default sum of the residuals of all cells, relative to the flows
MAX_ITERATIONS = 300  # maximum number of iterations; 10 to 30 are usual
Floats = NDArray[np.float64]
Ends = tuple[ArrayLike | None, ArrayLike | None]
"""Heads at the low and at the high end of an axis: a number, an array over the side, or None."""
Wells = Mapping[tuple[int, ...], float]
"""Rate (volume per time, negative for pumping) of the well in each cell ((layer,) row, column)."""


@dataclass(frozen=True, eq=False)
class Flow:
    """Steady flow; arrays have the axes (z,) y, x."""

    grid: Grid
    heads: Floats
    """Head in each cell, shape of the grid; NaN in inactive and in isolated cells."""
    fluxes: tuple[Floats, ...]
    """Volume per time through the n + 1 faces along each axis, positive to larger indices."""
    wells: dict[tuple[int, ...], float]
    fixed: dict[str, tuple[float, float]]
    """Mean heads at both ends of each axis ("x", "y", "z") with fixed heads; NaN if not fixed."""
    n_active: int
    """Number of active cells."""
    iterations: int
    """Number of iterations of the solver; 0 for a direct solution."""

    @cached_property
    def through(self) -> dict[str, float]:
        """Net flow into the grid through each side, in volume per time."""
        sides = {}
        for axis, flux in enumerate(self.fluxes):
            low, high = SIDES["xyz"[len(self.fluxes) - 1 - axis]]
            sides[low] = float(flux.take(0, axis).sum())
            sides[high] = -float(flux.take(-1, axis).sum())
        return sides

    @property
    def balance(self) -> float:
        """Inflow minus outflow, relative to the larger of both; 0 for an exact solution.

        It is 0 if nothing flows, too. A value above 1e-6 in size warns of an inaccurate solution.
        """
        parts = [np.array([*self.wells.values()])]
        for axis, flux in enumerate(self.fluxes):
            parts += [flux.take(0, axis).ravel(), -flux.take(-1, axis).ravel()]
        inflow, outflow = (np.maximum(sign * np.concatenate(parts), 0).sum() for sign in (1, -1))
        return float((inflow - outflow) / max(inflow, outflow, 1e-300))

    @property
    def effective_k(self) -> float:
        """Conductivity of the homogeneous grid with the same flow, Q L / (A Δh).

        A is the mean area of the active cells in the sections across the flow. Raises `CCWSIMError`
        unless two different heads are fixed along one axis and nowhere else.
        """
        name, (low, high) = next(iter(self.fixed.items()))
        begin, end = SIDES[name]
        flow = (self.through[begin] - self.through[end]) / 2
        if len(self.fixed) > 1 or self.wells or not (flow and abs(low - high) > 0):
            raise refused("effective_k")
        axis = "xyz".index(name)
        sizes = _cell(self.grid)
        length = self.heads.shape[::-1][axis] * sizes[axis]
        area = np.prod(sizes) * self.n_active / length
        return float(flow * length / (area * (low - high)))


def darcy(
    conductivity: ArrayLike,
    grid: Grid | None = None,
    *,
    west_east: Ends | None = None,
    south_north: Ends | None = None,
    bottom_top: Ends | None = None,
    wells: Wells | None = None,
    anisotropy: float = 1.0,
    active: ArrayLike | None = None,
    tolerance: float = TOLERANCE,
) -> Flow:
    """Solve ∇·(K ∇h) = −q by finite volumes, with harmonic means at the faces between cells.

    Sides without fixed heads are no-flow. A fixed head acts on the outer face of a cell. The solver
    is conjugate gradients with an algebraic multigrid preconditioner (PyAMG; Bell et al. 2023), or
    sparse elimination if it does not converge. The datum of the heads does not matter, because only
    differences of heads are computed. Raises `CCWSIMError` if conductivity, heads or wells do not
    fit the grid, a well is in an inactive cell or cut off from all fixed heads, or no path connects
    two sides with heads.

    `conductivity`, shape of the grid, has positive numbers, such as m/s, and NaN in inactive cells,
    through which nothing flows; `active` can mask cells, too. Cell sizes have the same unit of
    length; without a grid, they are 1, and a map is 1 thick. Iterations end if the residuals of the
    cells, the volumes per time that are lost or gained, sum to at most `tolerance` of the flows
    through sides and wells.

    Examples
    --------
    >>> flow = darcy([[1.0, 1.0, 4.0]], west_east=(1.0, 0.0))
    >>> flow.heads.round(4).tolist(), round(flow.effective_k, 4)
    ([[0.7778, 0.3333, 0.0556]], 1.3333)
    """
    k, grid = _checked_k(conductivity, grid, active)
    anisotropy = check_number("anisotropy", anisotropy, 1 / MAX_CONTRAST, MAX_CONTRAST)
    tolerance = check_number("tolerance", tolerance, 1e-15, 0.1)
    heads = {"x": west_east, "y": south_north, "z": bottom_top}
    names = "xyz"[: grid.n_dimensions][::-1]
    if grid.nz is None and bottom_top is not None:
        raise CCWSIMError("bottom_top: a map has no layers; give west_east or south_north")
    ends = [_heads(heads[name], name, np.delete(k.shape, axis)) for axis, name in enumerate(names)]
    mask = np.isfinite(k)
    labels: NDArray[np.int32] = ndimage.label(mask)[0]  # type: ignore[index]
    datum = _datum(labels, ends)
    held = np.isfinite(datum)
    fixed = {
        name: (float(low.mean()), float(high.mean()))
        for name, (low, high) in zip(names, ends, strict=True)
        if np.isfinite([low.mean(), high.mean()]).any()
    }
    _check_paths(labels, datum, fixed, names)
    rates = _checked_wells({} if wells is None else wells, mask, held)
    sizes = _cell(grid)
    check_magnitudes("cell size", np.array(sizes))
    outer, rhs = np.zeros(k.shape), np.zeros(k.shape)
    faces, sides = [], []
    for axis, name in enumerate(names):
        size = sizes["xyz".index(name)]
        k_along = (anisotropy if name == "z" else 1.0) * np.where(mask, k, 0.0)
        k_along *= np.prod(sizes) / size**2  # area of a face / distance of centres
        low, high = (np.delete(k_along, end, axis) for end in (-1, 0))
        with np.errstate(invalid="ignore", divide="ignore"):
            faces.append(np.nan_to_num(2 * low * high / (low + high)))
        for end, head in zip((0, -1), ends[axis], strict=True):
            face_cells = (*[slice(None)] * axis, end)
            conductance = np.where(np.isnan(head), 0.0, 2 * k_along[face_cells])
            above = np.nan_to_num(head - datum[face_cells])
            outer[face_cells] += conductance
            rhs[face_cells] += conductance * above
            sides.append((conductance, above))
    for cell, rate in rates.items():
        rhs[cell] += rate
    diagonal = outer.copy()
    bands = {}  # diagonals of the matrix above the main diagonal
    for axis, face in enumerate(faces):
        if face.size:
            band = np.pad(face, [(0, a == axis) for a in range(k.ndim)])
            diagonal += band + np.roll(band, 1, axis)
            step = k[(0,) * (axis + 1)].size
            bands[step] = -band.ravel()[:-step]
    diagonals = [diagonal.ravel(), *bands.values(), *bands.values()]
    offsets: Any = [0, *bands, *(-step for step in bands)]
    matrix: Any = sparse.diags(diagonals, offsets, format="csr")
    use = held.ravel()
    if not use.all():
        matrix = matrix[use][:, use]
    above = np.zeros(k.shape)  # heads above the datum, whose differences lose no digits
    above[held], iterations = _solve(matrix, rhs[held], outer[held], tolerance)
    fluxes, n_active = _fluxes(above, faces, sides), int(np.count_nonzero(mask))
    return Flow(
        grid=grid,
        heads=readonly(datum + above),
        fluxes=fluxes,
        wells=rates,
        fixed=fixed,
        n_active=n_active,
        iterations=iterations,
    )


def _cell(grid: Grid) -> tuple[float, ...]:
    """Return the sizes of a cell along x, y and z; a map is 1 thick."""
    return (*grid.cell_size, 1.0)[:3]


def _checked_k(
    conductivity: ArrayLike, grid: Grid | None, active: ArrayLike | None
) -> tuple[Floats, Grid]:
    k = as_floats(conductivity, "conductivity")
    grid = Grid.of(k.shape if grid is None else grid)
    if k.shape != grid.shape:
        raise CCWSIMError(
            f"conductivity of shape {k.shape} does not suit a grid of "
            f"{describe_shape(grid.shape)} cells; give one value per cell"
        )
    if active is not None:
        mask = as_array(active, "active")
        if mask.shape != k.shape or mask.dtype != np.bool_:
            raise CCWSIMError(f"active must be an array of True and False of shape {k.shape}")
        k = np.where(mask, k, np.nan)
    values = k[~np.isnan(k)]
    if not values.size:
        raise CCWSIMError("conductivity: no cell is active; NaN is for some inactive cells only")
    check_magnitudes(
        "conductivity", values, ", NaN in inactive cells, and a small value where little flows"
    )
    return k, grid


def _heads(ends: Ends | None, name: str, shape: NDArray) -> list[Floats]:
    """Return the heads at both ends of an axis as numbers or arrays over the side; NaN for None."""
    sides = " and ".join(SIDES[name])
    ends = (None, None) if ends is None else ends
    if not isinstance(ends, Sequence) or len(ends) != 2:
        raise CCWSIMError(f"heads of {sides} = {shown(ends)} must be a pair of heads")
    heads = []
    for head in ends:
        values = np.array(np.nan) if head is None else as_floats(head, f"heads of {sides}")
        right = (np.abs(values) <= MAX_MAGNITUDE).all() and values.shape in ((), tuple(shape))
        if head is not None and not right:
            raise refused("heads", sides=sides, most=MAX_MAGNITUDE, shape=shape)
        heads.append(values)
    return heads


def _datum(labels: NDArray, ends: Sequence[Sequence[Floats]]) -> Floats:
    """Return the middle of the fixed heads of each connected set of cells; NaN without heads."""
    low, high = np.full((2, labels.max() + 1), np.nan)
    for axis, heads in enumerate(ends):
        for end, head in zip((0, -1), heads, strict=True):
            np.fmin.at(low, labels.take(end, axis), head)
            np.fmax.at(high, labels.take(end, axis), head)
    middle = (low + high) / 2  # exact for equal heads, between which nothing flows
    return np.where(labels > 0, middle[labels], np.nan)


def _check_paths(labels: NDArray, datum: Floats, fixed: dict, names: str) -> None:
    """Raise an error if no path of active cells connects two sides whose heads are fixed."""
    if np.isnan(datum).all():
        raise CCWSIMError("no head is fixed at an active cell; give west_east or south_north")
    for name, heads in fixed.items():
        axis = names.index(name)
        low, high = (np.unique(labels.take(end, axis)) for end in (0, -1))
        if not (np.isnan(heads).any() or np.intersect1d(low, high).any()):
            raise CCWSIMError(
                f"no active cells connect the {' and '.join(SIDES[name])} sides; nothing can flow "
                "between their heads"
            )


def array_axis(axis: str, grid: Grid) -> int:
    """Return the axis of arrays along x, y or z; raise `CCWSIMError` if the grid lacks it."""
    names = "xyz"[: grid.n_dimensions]
    return len(names) - 1 - names.index(check_choice("axis", axis, names))


def checked_cell(cell: ArrayLike, shape: tuple[int, ...]) -> tuple[int, ...]:
    """Return the indices of the cell of a well, or raise `CCWSIMError`."""
    indices = as_integers(cell, "cell of a well", remedy="give (row, column) of a cell")
    if indices.shape != (len(shape),) or not ((indices >= 0) & (indices < shape)).all():
        raise CCWSIMError(f"well in cell {shown(cell)} is outside the grid of {shape}")
    return tuple(indices.tolist())


def _checked_wells(wells: Wells, mask: NDArray, held: NDArray) -> dict[tuple[int, ...], float]:
    check_type("wells", wells, Mapping)
    rates = {}
    for key, rate in wells.items():
        cell = checked_cell(key, mask.shape)
        if not mask[cell]:
            raise CCWSIMError(f"well in cell {cell} is inactive; move it to an active cell")
        if not held[cell]:
            raise CCWSIMError(f"well in cell {cell} is cut off from all fixed heads; move it")
        rates[cell] = check_number(
            f"rate of the well in {cell}", rate, -MAX_MAGNITUDE, MAX_MAGNITUDE
        )
    return rates


def _solve(
    matrix: sparse.csr_matrix, rhs: Floats, outer: Floats, tolerance: float
) -> tuple[Floats, int]:
    """Return the solution of a symmetric system and the number of iterations, 0 if direct.

    `outer` has the conductance between each cell and the fixed heads, whose datum is 0.
    """
    from pyamg import ruge_stuben_solver  # slow to import

    x, residual = np.zeros(len(rhs)), rhs.copy()
    beside = np.flatnonzero((outer > 0) | (rhs != 0))  # cells beside fixed heads, and with wells
    sources, outer = rhs[beside], outer[beside]
    with suppress(ZeroDivisionError):
        # a sweep forward and one backward keep the cycle symmetric at half the default's work
        before, after = (("gauss_seidel", {"sweep": s}) for s in ("forward", "backward"))
        multigrid = ruge_stuben_solver(
            matrix, interpolation="direct", presmoother=before, postsmoother=after
        )
        direction, last = np.zeros(len(rhs)), 1.0
        for iteration in range(MAX_ITERATIONS + 1):
            check_stop()
            if np.abs(residual).sum() <= tolerance * np.abs(sources - outer * x[beside]).sum():
                return x, iteration
            better = _cycle(multigrid, residual, 0)
            product = _product(residual, better)
            direction, last = better + product / last * direction, product
            applied = matrix @ direction
            length = product / _product(direction, applied)
            x += length * direction
            residual -= length * applied
    return np.asarray(spsolve(matrix.tocsc(), rhs, "MMD_AT_PLUS_A")), 0


def _product(a: Floats, b: Floats) -> float:
    """Return the inner product without BLAS, whose threads would slow it down here."""
    return float(np.einsum("i,i->", a, b))


def _cycle(multigrid: Any, rhs: Floats, n: int) -> Floats:
    """Return an approximate solution on level n, by one V-cycle."""
    level, x = multigrid.levels[n], np.zeros(len(rhs))
    if n == len(multigrid.levels) - 1:
        return multigrid.coarse_solver(level.A, rhs)
    level.presmoother(level.A, x, rhs)
    x += level.P @ _cycle(multigrid, level.R @ (rhs - level.A @ x), n + 1)
    level.postsmoother(level.A, x, rhs)
    return x


def _fluxes(above: Floats, faces: Sequence[Floats], sides: Sequence) -> tuple[Floats, ...]:
    """Return the flux through each face, from heads above the datum and conductances of faces."""
    fluxes = []
    for axis, face in enumerate(faces):
        inner = -face * np.diff(above, axis=axis)
        flux = np.pad(inner, [(int(a == axis),) * 2 for a in range(above.ndim)])
        for end, (conductance, head) in zip((0, -1), sides[2 * axis : 2 * axis + 2], strict=True):
            inflow = conductance * (head - above.take(end, axis))
            flux[(*[slice(None)] * axis, end)] = inflow if end == 0 else -inflow
        fluxes.append(readonly(flux))
    return tuple(fluxes)
