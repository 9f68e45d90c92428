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
from ccwsim.model.arrays import as_array, as_floats, describe_shape, is_whole, readonly
from ccwsim.model.errors import CCWSIMError, shown
from ccwsim.model.grid import Grid

SIDES = {"x": ("west", "east"), "y": ("south", "north"), "z": ("bottom", "top")}
"""Sides of the grid at both ends of each axis."""
TOLERANCE = 1e-10  # default norm of the residual, relative to that of the fixed heads and wells
MAX_ITERATIONS = 300  # maximum number of iterations; usual are 10 to 30
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
    """Mean heads at both ends of each axis ("x", "y", "z") whose two heads are fixed."""
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
        """Inflow minus outflow, relative to the larger of both; 0 for an exact solution."""
        rates = list(self.wells.values())
        for axis, flux in enumerate(self.fluxes):
            rates += [*flux.take(0, axis).ravel(), *-flux.take(-1, axis).ravel()]
        inflow, outflow = (sum(max(sign * r, 0.0) for r in rates) for sign in (1, -1))
        return float((inflow - outflow) / max(inflow, outflow, 1e-300))

    @property
    def effective_k(self) -> float:
        """Conductivity of the homogeneous grid with the same flow, Q L / (A Δh).

        Raises `CCWSIMError` unless two different heads are fixed along one axis and nowhere else.
        """
        if len(self.fixed) != 1 or self.wells:
            raise CCWSIMError(
                "effective_k needs heads on two opposite sides and no wells; solve without wells"
            )
        ((name, (low, high)),) = self.fixed.items()
        if low == high:
            raise CCWSIMError(f"effective_k needs two different heads, not twice {low:g}")
        axis = "xyz".index(name)
        sizes = _cell(self.grid)
        length = self.heads.shape[::-1][axis] * sizes[axis]
        area = np.prod(sizes) * self.heads.size / length
        begin, end = SIDES[name]
        flow = (self.through[begin] - self.through[end]) / 2
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
    sparse elimination if PyAMG is missing or does not converge. Raises `CCWSIMError` if
    conductivity, heads or wells do not fit the grid, a well is in an inactive cell or cut off from
    all fixed heads, or no path connects two sides with heads.

    `conductivity`, shape of the grid, has positive numbers, such as m/s, and NaN in inactive cells,
    through which nothing flows; `active` can mask cells, too. Cell sizes have the same unit of
    length; without a grid, they are 1, and a map is 1 thick. Iterations end at a relative residual
    of `tolerance`.

    Examples
    --------
    >>> flow = darcy([[1.0, 1.0, 4.0]], west_east=(1.0, 0.0))
    >>> flow.heads.round(4).tolist(), round(flow.effective_k, 4)
    ([[0.7778, 0.3333, 0.0556]], 1.3333)
    """
    k, grid = _checked_k(conductivity, grid, active)
    if not (np.isfinite(anisotropy) and anisotropy > 0):
        raise CCWSIMError(f"anisotropy = {shown(anisotropy)} must be a number above 0")
    given = {"x": west_east, "y": south_north, "z": bottom_top}
    names = "xyz"[: grid.n_dimensions][::-1]
    if grid.nz is None and bottom_top is not None:
        raise CCWSIMError("bottom_top: a map has no layers; give west_east or south_north")
    mask = np.isfinite(k)
    sizes = _cell(grid)
    diagonal, rhs = np.zeros(k.shape), np.zeros(k.shape)
    faces, sides, fixed = [], [], {}
    for axis, name in enumerate(names):
        size = sizes["xyz".index(name)]
        own = (anisotropy if name == "z" else 1.0) * np.where(mask, k, 0.0)
        own *= np.prod(sizes) / size**2  # area of a face / distance of centres
        low, high = (np.delete(own, end, axis) for end in (-1, 0))
        with np.errstate(invalid="ignore", divide="ignore"):
            faces.append(np.nan_to_num(2 * low * high / (low + high)))
        ends = _heads(given[name], name, np.delete(k.shape, axis))
        for end, head in zip((0, -1), ends, strict=True):
            if head is None:
                sides.append(None)
                continue
            at = (*[slice(None)] * axis, end)
            conductance = 2 * own[at]
            diagonal[at] += conductance
            rhs[at] += conductance * head
            sides.append((conductance, head))
        means = tuple(float(np.mean(head)) for head in ends if head is not None)
        if len(means) == 2:
            fixed[name] = means
    labels: NDArray[np.int32] = ndimage.label(mask)[0]  # type: ignore[index]
    held = np.isin(labels, np.unique(labels[diagonal > 0])) & mask
    _check_paths(labels, diagonal, fixed, names)
    rates = _checked_wells(wells or {}, mask, held)
    for cell, rate in rates.items():
        rhs[cell] += rate
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
    heads, use = np.full(k.size, np.nan), held.ravel()
    if not use.all():
        matrix = matrix[use][:, use]
    heads[use], iterations = _solve(matrix, rhs.ravel()[use], tolerance)
    heads = heads.reshape(k.shape)
    fluxes = _fluxes(heads, faces, sides)
    return Flow(grid, readonly(heads), fluxes, rates, fixed, iterations)


def _cell(grid: Grid) -> tuple[float, ...]:
    """Return the sizes of a cell along x, y and z; a map is 1 thick."""
    return (*grid.cell_size, 1.0)[:3]


def _checked_k(
    conductivity: ArrayLike, grid: Grid | None, active: ArrayLike | None
) -> tuple[Floats, Grid]:
    k = as_floats(conductivity, "conductivity")
    grid = Grid.of(k.shape) if grid is None else grid
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
    known = k[~np.isnan(k)]
    if not known.size or not (np.isfinite(known) & (known > 0)).all():
        bad = f"{known[~(np.isfinite(known) & (known > 0))][0]:g}" if known.size else "NaN"
        raise CCWSIMError(
            f"conductivity {bad} must be above 0; use NaN for some inactive cells, or a small value"
        )
    return k, grid


def _heads(ends: Ends | None, name: str, shape: NDArray) -> list[Floats | None]:
    """Return the heads at both ends of an axis as numbers or arrays over the side."""
    sides = " and ".join(SIDES[name])
    if ends is None:
        return [None, None]
    if not isinstance(ends, Sequence) or len(ends) != 2:
        raise CCWSIMError(f"heads of {sides} = {shown(ends)} must be a pair of heads")
    found = []
    for head in ends:
        values = None if head is None else as_floats(head, f"heads of {sides}")
        if values is not None and not (
            np.isfinite(values).all() and values.shape in ((), tuple(shape))
        ):
            raise CCWSIMError(f"heads of {sides} must be finite: a number, or an array of {shape}")
        found.append(values)
    return found


def _check_paths(labels: NDArray, diagonal: Floats, fixed: dict, names: str) -> None:
    """Raise an error if no path of active cells connects two sides whose heads are fixed."""
    if not diagonal.any():
        raise CCWSIMError("no head is fixed at an active cell; give west_east or south_north")
    for name in fixed:
        axis = names.index(name)
        low, high = (np.unique(labels.take(end, axis)) for end in (0, -1))
        if not np.intersect1d(low, high).any():
            raise CCWSIMError(
                f"no active cells connect the {' and '.join(SIDES[name])} sides; nothing can flow "
                "between their heads"
            )


def _checked_wells(wells: Wells, mask: NDArray, held: NDArray) -> dict[tuple[int, ...], float]:
    found = {}
    for cell, rate in wells.items():
        inside = len(cell) == mask.ndim and all(is_whole(c) for c in cell)
        if not inside or not all(0 <= c < n for c, n in zip(cell, mask.shape, strict=True)):
            raise CCWSIMError(f"well in cell {shown(cell)} is outside the grid of {mask.shape}")
        if not mask[cell]:
            raise CCWSIMError(f"well in cell {shown(cell)} is inactive; move it to an active cell")
        if not held[cell]:
            raise CCWSIMError(
                f"well in cell {shown(cell)} is cut off from all fixed heads; move it"
            )
        if not np.isfinite(rate):
            raise CCWSIMError(f"rate of the well in {shown(cell)} must be a finite number")
        found[tuple(int(c) for c in cell)] = float(rate)
    return found


def _solve(matrix: sparse.csr_matrix, rhs: Floats, tolerance: float) -> tuple[Floats, int]:
    """Return the solution of a symmetric system and the number of iterations, 0 if direct."""
    x, residual, size = np.zeros(len(rhs)), rhs.copy(), _product(rhs, rhs)
    with suppress(ImportError):
        from pyamg import ruge_stuben_solver

        # a sweep forward and one backward keep the cycle symmetric at half the default's work
        before, after = (("gauss_seidel", {"sweep": s}) for s in ("forward", "backward"))
        multigrid = ruge_stuben_solver(
            matrix, interpolation="direct", presmoother=before, postsmoother=after
        )
        way, last = np.zeros(len(rhs)), 1.0
        for iteration in range(MAX_ITERATIONS + 1):
            check_stop()
            if _product(residual, residual) <= tolerance**2 * size:
                return x, iteration
            better = _cycle(multigrid, residual, 0)
            product = _product(residual, better)
            way, last = better + product / last * way, product
            image = matrix @ way
            length = product / _product(way, image)
            x += length * way
            residual -= length * image
    return np.asarray(spsolve(matrix.tocsc(), rhs, "MMD_AT_PLUS_A")), 0


def _product(a: Floats, b: Floats) -> float:
    """Return the inner product without BLAS, whose threads cost more than they gain here."""
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


def _fluxes(heads: Floats, faces: Sequence[Floats], sides: Sequence) -> tuple[Floats, ...]:
    """Return the flux through each face, from the heads and the conductances of faces."""
    found = []
    for axis, face in enumerate(faces):
        flux = np.zeros([n + (a == axis) for a, n in enumerate(heads.shape)])
        inner = (*[slice(None)] * axis, slice(1, -1))
        flux[inner] = -np.nan_to_num(face * np.diff(heads, axis=axis))
        for end, side in zip((0, -1), sides[2 * axis : 2 * axis + 2], strict=True):
            if side is not None:
                conductance, head = side
                inflow = np.nan_to_num(conductance * (head - heads.take(end, axis)))
                flux[(*[slice(None)] * axis, end)] = inflow if end == 0 else -inflow
        found.append(readonly(flux))
    return tuple(found)
