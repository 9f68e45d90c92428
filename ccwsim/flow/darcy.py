"""Steady single-phase flow through a map or a volume: heads, fluxes and effective conductivity."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy import ndimage, sparse
from scipy.sparse.linalg import spsolve

from ccwsim import Grid
from ccwsim.flow.boundary import Edge, FixedFaces, fixed_faces, side_faces
from ccwsim.jobs.workers import check_stop
from ccwsim.model import (
    MAX_CONTRAST,
    MAX_MAGNITUDE,
    Array,
    ArrayLike,
    CCWSIMError,
    Floats,
    Int32s,
    Shape,
    as_array,
    as_floats,
    as_integers,
    check_choice,
    check_magnitudes,
    check_number,
    check_type,
    describe_shape,
    readonly,
    refused,
    shown,
)

SIDES = {"x": ("west", "east"), "y": ("south", "north"), "z": ("bottom", "top")}
"""Sides of the grid at both ends of each axis."""
RESIDUAL_TOLERANCE = 3e-7  # default sum of the residuals of all cells, relative to the flows
MAX_ITERATIONS = 300  # maximum number of iterations; 10 to 30 are usual
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
    """Mean heads at both ends of each axis ("x", "y", "z") with fixed heads, NaN if not fixed, or
    the two heads along the outline ("edge")."""
    fixed_faces: FixedFaces
    """Faces of cells with fixed heads, and the flow through them."""
    gradient: float
    """Fall of the fixed heads per length, along one axis or along the line of an edge."""
    thickness: float
    """Thickness of a map; a volume has the thickness of its layers."""
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
        inflow, outflow = self._flows(1), self._flows(-1)
        return (inflow - outflow) / max(inflow, outflow, 1e-300)

    @property
    def inflow(self) -> float:
        """Volume per time that flows in through faces with fixed heads and from wells."""
        return self._flows(1)

    def _flows(self, sign: int) -> float:
        """Return the flow in (sign 1) or out (sign −1) through fixed heads and wells."""
        rates = np.concatenate([self.fixed_faces.inflows, [*self.wells.values()]])
        return float(np.maximum(sign * rates, 0).sum())

    @property
    def effective_k(self) -> float:
        """Conductivity of the homogeneous grid with the same flow, Q L / (A Δh).

        A is the mean area of the active cells in the sections across the flow. Between heads along
        an outline, it is the conductivity that loses the same energy, Σ Q h / (V J²), with the flow
        Q into each face, its head h, the volume V and the gradient J; between two heads at sides,
        both are equal. Raises `CCWSIMError` unless two different heads are fixed along one axis or
        line and nowhere else.
        """
        faces, gradient = self.fixed_faces, self.gradient
        middle = np.nanmean(list(self.fixed.values()))
        energy = float(np.sum(faces.inflows * (faces.heads - middle)))
        if self.wells or not (energy and np.isfinite(gradient) and gradient):
            raise refused("effective_k")
        return energy / float(
            np.prod(cell_sizes(self.grid, self.thickness)) * self.n_active * gradient**2
        )


def darcy(
    conductivity: ArrayLike,
    grid: Grid | None = None,
    *,
    west_east: Ends | None = None,
    south_north: Ends | None = None,
    bottom_top: Ends | None = None,
    edge: Edge | None = None,
    wells: Wells | None = None,
    anisotropy: float = 1.0,
    thickness: float = 1.0,
    active: ArrayLike | None = None,
    tolerance: float = RESIDUAL_TOLERANCE,
) -> Flow:
    """Solve ∇·(K ∇h) = −q by finite volumes, with harmonic means at the faces between cells.

    Heads are fixed at sides, or along the outline of the active cells (`edge`); all other faces to
    the outside are no-flow. A fixed head acts on the outer face of a cell. The solver
    is conjugate gradients with an algebraic multigrid preconditioner (PyAMG; Bell et al. 2023), or
    sparse elimination if it does not converge. The datum of the heads does not matter, because only
    differences of heads are computed. Raises `CCWSIMError` if conductivity, heads or wells do not
    fit the grid, a well is in an inactive cell or cut off from all fixed heads, or no path connects
    two sides with heads.

    `conductivity`, shape of the grid, has positive numbers, such as m/s, and NaN in inactive cells,
    through which nothing flows; `active` can mask cells, too. Cell sizes have the same unit of
    length, as has the `thickness` of a map; without a grid, they are 1. Iterations end if the
    residuals of the cells, the volumes per time that are lost or gained, sum to at most `tolerance`
    of the flows through fixed heads and wells.

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
    if not grid.is_volume and bottom_top is not None:
        raise CCWSIMError("bottom_top: a map has no layers; give west_east or south_north")
    ends = [_heads(heads[name], name, np.delete(k.shape, axis)) for axis, name in enumerate(names)]
    mask = np.isfinite(k)
    labels: Int32s = ndimage.label(mask)[0]  # type: ignore[index]
    sizes = cell_sizes(grid, thickness)
    check_magnitudes("cell size", np.array(sizes))
    faces, k_along = [], []
    for axis, name in enumerate(names):
        # K · area of a face / distance of centres
        along = (anisotropy if name == "z" else 1.0) * np.where(mask, k, 0.0)
        k_along.append(along * np.prod(sizes) / sizes["xyz".index(name)] ** 2)
        low, high = (np.delete(k_along[-1], end, axis) for end in (-1, 0))
        with np.errstate(invalid="ignore", divide="ignore"):
            faces.append(np.nan_to_num(2 * low * high / (low + high)))
    fixed = {
        name: (float(low.mean()), float(high.mean()))
        for name, (low, high) in zip(names, ends, strict=True)
        if np.isfinite([low.mean(), high.mean()]).any()
    }
    if edge is not None:
        check_type("edge", edge, Edge)
        if fixed:
            raise CCWSIMError(
                "heads are fixed at sides and along the outline; leave one of them out"
            )
    at_faces = side_faces(ends, k.shape) if edge is None else edge.at_faces(mask, grid)
    held_faces = fixed_faces(at_faces, mask, k_along)
    datum = _datum(labels, held_faces)
    held = np.isfinite(datum)
    _check_paths(labels, datum, fixed, names)
    rates = _checked_wells({} if wells is None else wells, mask, held)
    outer, rhs = np.zeros(k.shape), np.zeros(k.shape)
    index, conductances = tuple(held_faces.cells.T), held_faces.conductances
    face_heads = held_faces.heads - datum[index]
    np.add.at(outer, index, conductances)
    np.add.at(rhs, index, conductances * face_heads)
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
    inflows = readonly(conductances * (face_heads - above[index]))
    held_faces, n_active = replace(held_faces, inflows=inflows), int(np.count_nonzero(mask))
    return Flow(
        grid=grid,
        heads=readonly(datum + above),
        fluxes=_fluxes(above, faces, held_faces),
        wells=rates,
        fixed=fixed if edge is None else {"edge": edge.heads},
        fixed_faces=held_faces,
        gradient=_side_gradient(fixed, grid) if edge is None else edge.gradient(mask, grid),
        thickness=thickness,
        n_active=n_active,
        iterations=iterations,
    )


def _side_gradient(fixed: Mapping[str, tuple[float, float]], grid: Grid) -> float:
    """Return the fall of the heads per length between two sides; NaN for more or fewer sides."""
    if len(fixed) != 1:
        return np.nan
    ((name, (low, high)),) = fixed.items()
    number = "xyz".index(name)
    return (low - high) / (grid.shape[::-1][number] * grid.cell_size[number])


def cell_sizes(grid: Grid, thickness: float = 1.0) -> tuple[float, ...]:
    """Return the sizes of a cell along x, y and z; raise `CCWSIMError` for a wrong thickness."""
    thickness = check_number("thickness", thickness, 0.0, MAX_MAGNITUDE, open_below=True)
    if grid.is_volume and thickness != 1:
        raise CCWSIMError("thickness is for maps; a volume has that of its layers: leave it out")
    return (*grid.cell_size, thickness)[:3]


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


def _heads(ends: Ends | None, name: str, shape: Array) -> list[Floats]:
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


def _datum(labels: Array, held_faces: FixedFaces) -> Floats:
    """Return the middle of the fixed heads of each connected set of cells; NaN without heads."""
    low, high = np.full((2, labels.max() + 1), np.nan)
    parts = labels[tuple(held_faces.cells.T)]
    np.fmin.at(low, parts, held_faces.heads)
    np.fmax.at(high, parts, held_faces.heads)
    middle = (low + high) / 2  # exact for equal heads, between which nothing flows
    return np.where(labels > 0, middle[labels], np.nan)


def _check_paths(labels: Array, datum: Floats, fixed: dict, names: str) -> None:
    """Raise an error if no path of active cells connects two sides whose heads are fixed."""
    if np.isnan(datum).all():
        raise refused("no_head")
    for name, heads in fixed.items():
        axis = names.index(name)
        low, high = (np.unique(labels.take(end, axis)) for end in (0, -1))
        if not (np.isnan(heads).any() or np.intersect1d(low, high).any()):
            raise CCWSIMError(
                f"no active cells connect the {' and '.join(SIDES[name])} sides; nothing can flow "
                "between their heads, so fix heads along the outline instead"
            )


def array_axis(axis: str, grid: Grid) -> int:
    """Return the axis of arrays along x, y or z; raise `CCWSIMError` if the grid lacks it."""
    names = "xyz"[: grid.n_dimensions]
    return len(names) - 1 - names.index(check_choice("axis", axis, names))


def checked_cell(cell: ArrayLike, shape: Shape) -> tuple[int, ...]:
    """Return the indices of the cell of a well, or raise `CCWSIMError`."""
    indices = as_integers(cell, "cell of a well", remedy="give (row, column) of a cell")
    if indices.shape != (len(shape),) or not ((indices >= 0) & (indices < shape)).all():
        raise CCWSIMError(f"well in cell {shown(cell)} is outside the grid of {shape}")
    return tuple(indices.tolist())


def _checked_wells(wells: Wells, mask: Array, held: Array) -> dict[tuple[int, ...], float]:
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


def _fluxes(above: Floats, faces: Sequence[Floats], held_faces: FixedFaces) -> tuple[Floats, ...]:
    """Return the flux through each face, from heads above the datum and conductances of faces."""
    fluxes = []
    for axis, face in enumerate(faces):
        inner = -face * np.diff(above, axis=axis)
        flux = np.pad(inner, [(int(a == axis),) * 2 for a in range(above.ndim)])
        across = held_faces.axes == axis
        ends, places = held_faces.ends[across], held_faces.cells[across].T.copy()
        places[axis] += ends
        flux[tuple(places)] = np.where(ends, -1, 1) * held_faces.inflows[across]
        fluxes.append(readonly(flux))
    return tuple(fluxes)
