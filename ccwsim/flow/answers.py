"""Flow results of ensembles: effective conductivity, travel times, capture."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, TypeVar, cast

import numpy as np

from ccwsim import Ensemble, Grid
from ccwsim.flow.boundary import Edge
from ccwsim.flow.darcy import Ends, Floats, Flow, array_axis, checked_cell, darcy
from ccwsim.flow.tracks import IN_WELL, LEFT_GRID, MAX_PARTICLES, cells_at, starts_at_inflow, tracks
from ccwsim.jobs.workers import run_all
from ccwsim.model import (
    MAX_CONTRAST,
    MAX_MAGNITUDE,
    ArrayLike,
    Cancel,
    Cancelled,
    CCWSIMError,
    Cells,
    FaciesValues,
    FromValues,
    Ints,
    Mask,
    Progress,
    PropertyValues,
    Shape,
    Watch,
    as_array,
    as_floats,
    cell_values,
    cells_of,
    check_callable,
    check_int,
    check_number,
    check_type,
    refused,
    shown,
    values_by_facies,
)
from ccwsim.system.machine import n_cores

Heads = tuple[float, float] | Edge
"""Heads at both ends of an axis, or along the outline of the active cells."""
HEADS_ALONG = {"x": "west_east", "y": "south_north", "z": "bottom_top"}
CONTRAST = 1e4  # ratio of conductivities of a facies to all others in the flow efficiency
Result = TypeVar("Result")


@dataclass(frozen=True, eq=False)
class EffectiveK:
    """Effective conductivity along one axis, of n realizations and of the training image."""

    each: Floats
    """Effective conductivity of each realization, shape (n,)."""
    harmonic: Floats
    """Lower bound of each realization, shape (n,): the harmonic mean of the cells in lines along
    the axis without inactive cells, times their share of the active cells."""
    arithmetic: Floats
    """Upper bound of each realization, shape (n,): the arithmetic mean of the active cells."""
    image: float
    """Effective conductivity of the training image."""
    image_harmonic: float
    image_arithmetic: float

    @property
    def efficiency(self) -> Floats:
        """Flow efficiency E of each realization: effective conductivity / arithmetic mean."""
        return self.each / self.arithmetic

    def table(self) -> tuple[list[str], list[list[object]]]:
        """Return the head and the lines of a table with a line for each realization."""
        head = ["realization", "effective_k", "harmonic_mean", "arithmetic_mean"]
        rows = np.column_stack([self.each, self.harmonic, self.arithmetic])
        rows = np.vstack([rows, [self.image, self.image_harmonic, self.image_arithmetic]])
        names = [*range(1, len(rows)), "training_image"]
        lines = zip(names, rows.tolist(), strict=True)
        return head, [[name, *(float(f"{v:.9g}") for v in line)] for name, line in lines]


@dataclass(frozen=True, eq=False)
class Capture:
    """Starts whose particles end in a well."""

    starts: Floats  # shape (m, dimensions): starts in world units
    shape: Shape  # starts along y and x; m is their product
    captured: Mask  # shape (n, m)
    active: Mask | None = None  # shape (m,): starts in active cells; None if all are

    @property
    def probability(self) -> Floats:
        """Share of the realizations in which a particle of each start is captured, `shape`.

        Inactive cells have NaN.
        """
        shares = self.captured.mean(axis=0)
        return np.where(True if self.active is None else self.active, shares, np.nan).reshape(
            self.shape
        )

    def brier(self, truth: Mask | None = None) -> tuple[float, float]:
        """Return the Brier scores of the probability and of one constant probability.

        Scores are computed for `truth`, shape (m,); without it, they are means over realizations,
        each predicted by all others. A probability is useful only if its score is clearly smaller.
        Only starts in active cells count.
        """
        n, total = len(self.captured), self.captured.sum(axis=0)
        if truth is None and n < 2:
            raise CCWSIMError("a Brier score needs at least two realizations, or the truth")
        outcomes = self.captured if truth is None else as_array(truth, "truth")
        if truth is not None and (outcomes.dtype != np.bool_ or outcomes.shape != total.shape):
            raise CCWSIMError(f"truth must be an array of True and False, shape {total.shape}")
        predicted = (total - self.captured) / (n - 1) if truth is None else total / n
        if self.active is not None:
            predicted, outcomes = predicted[..., self.active], outcomes[..., self.active]
        constant = predicted.mean(axis=-1, keepdims=True)
        score, of_constant = (np.mean((p - outcomes) ** 2) for p in (predicted, constant))
        return float(score), float(of_constant)


def effective_k(
    ensemble: Ensemble,
    values: FaciesValues,
    axis: str = "x",
    *,
    heads: Heads | None = None,
    anisotropy: float = 1.0,
    **run: Any,
) -> EffectiveK:
    """Return the effective conductivity of each realization and of the image, with bounds.

    The bounds hold for any active cells; sections count with the area of their active cells. Heads
    along an outline need an axis or line along which they change; the image has heads at its sides.
    Raises `CCWSIMError` for a facies without a conductivity, and an axis that the grid lacks.

    Examples
    --------
    >>> from ccwsim import simulate
    >>> e = simulate(np.tile([[0], [0], [1], [1]], (16, 64)), (40, 50), n_realizations=2)
    >>> effective = effective_k(e, {0: 1e-6, 1: 1e-4})
    >>> bool((effective.each <= effective.arithmetic * 1.000001).all())
    True
    """
    k = _values(ensemble, values, axis)
    if isinstance(heads, Edge):
        axis = heads.axis
    solve = partial(_k_of, k=k, grid=ensemble.grid, axis=axis, heads=heads, anisotropy=anisotropy)
    each = np.array(over(ensemble, solve, **run))
    return with_bounds(ensemble, k, axis, each, heads=heads, anisotropy=anisotropy)


def with_bounds(
    ensemble: Ensemble,
    k: PropertyValues,
    axis: str,
    each: Floats,
    *,
    heads: Heads | None = None,
    anisotropy: float = 1.0,
) -> EffectiveK:
    """Return the effective conductivities `each`, their bounds, and the values of the image."""
    image, along = ensemble.training_image, anisotropy if axis == "z" else 1.0
    grid = replace(Grid.of(image.shape), cell_size=ensemble.grid.cell_size)
    number = array_axis(axis, grid)
    cells = (cells_of(ensemble, r) for r in range(ensemble.n))
    lower, upper = np.array([_bounds(along * cell_values(k, part), number) for part in cells]).T
    if isinstance(heads, Edge) and not isinstance(heads.along, str):
        lower = np.zeros(ensemble.n)  # heads need not change along whole lines of cells
    least, most = _bounds(along * cell_values(k, cells_of(image)), number)
    of_image = _k_of(cells_of(image), k, grid, axis, anisotropy=anisotropy)
    return EffectiveK(each, lower, upper, of_image, image_harmonic=least, image_arithmetic=most)


def _bounds(k: Floats, axis: int) -> tuple[float, float]:
    """Return bounds of the effective conductivity along an axis; k is NaN in inactive cells.

    The lower bound assumes equal flow in all lines of cells along the axis without inactive cells,
    and no flow between lines. The upper bound assumes heads that fall evenly.
    """
    active = k[np.isfinite(k)]
    lines = np.moveaxis(k, axis, 0)[:, np.isfinite(k).all(axis=axis)]
    lower = lines.size**2 / (active.size * float(np.sum(1 / lines))) if lines.size else 0.0
    return lower, float(active.mean())


def _k_of(cells: Cells, k: PropertyValues, grid: Grid, axis: str, **options: Any) -> float:
    """Return the effective conductivity of cells; a function that executors can send."""
    return _along(axis, cell_values(k, cells), grid, **options).effective_k


def _along(
    axis: str, k: Floats, grid: Grid | None = None, heads: Heads | None = None, **options: Any
) -> Flow:
    """Return the flow between heads; None are heads of 1 and 0."""
    if heads is None:
        heads = usual_heads(~np.isnan(k), axis)
    return darcy(k, grid, **heads_option(heads, axis), **options)


def usual_heads(active: Mask, axis: str = "x") -> Heads:
    """Return heads of 1 and 0 at both sides, or along the outline if a side has no active cell."""
    number = active.ndim - 1 - "xyz".index(axis)
    sides = [active.take(end, number).any() for end in (0, -1)]
    return (1.0, 0.0) if axis == "z" or all(sides) else Edge((1.0, 0.0), axis)


def heads_option(heads: Heads, axis: str) -> dict[str, Any]:
    """Return the argument of `darcy` for heads at both ends of an axis, or along an outline."""
    return {"edge" if isinstance(heads, Edge) else HEADS_ALONG[axis]: heads}


def flow_efficiency(inside: Mask, axis: int, contrast: float = CONTRAST) -> float:
    """Return E, effective conductivity / arithmetic mean, of a facies along an array axis.

    The facies conducts `contrast` times as well as all other facies. Diagonal contacts of cells
    carry no flow. E is 1 for layers along the flow, and about 1 / (p · contrast) for a facies of
    proportion p that does not connect the sides.

    Examples
    --------
    >>> inside = np.array([[True, True], [False, False]])
    >>> round(flow_efficiency(inside, 1), 4), round(flow_efficiency(inside, 0), 4)
    (1.0, 0.0004)
    """
    contrast = check_number("contrast", contrast, 1.0, MAX_CONTRAST)
    k = np.where(as_floats(inside, "inside"), 1.0, 1 / contrast)
    name = "xyz"[k.ndim - 1 - check_int("axis", axis, 0, Grid.of(k.shape).n_dimensions - 1)]
    return _along(name, k, tolerance=1e-3).effective_k / float(k.mean())


def travel_times(
    ensemble: Ensemble,
    values: FaciesValues,
    porosity: FaciesValues | float = 0.25,
    axis: str = "x",
    *,
    heads: Heads | None = None,
    n_particles: int = 200,
    **run: Any,
) -> Floats:
    """Return the breakthrough of each realization: sorted travel times, shape (n, n_particles).

    Particles start on the inflow side, or on the parts of an outline with inflow, each with the
    same share of the inflow. Particles that do not arrive have the time inf.

    Examples
    --------
    >>> from ccwsim import simulate
    >>> e = simulate(np.tile([[0], [0], [1], [1]], (16, 64)), (40, 50))
    >>> travel_times(e, {0: 1.0, 1: 1.0}, 0.5, n_particles=2).round(3)
    array([[1250., 1250.]])
    """
    k = _values(ensemble, values, axis)
    shares = porosities(ensemble, porosity)
    n = check_int("n_particles", n_particles, 1, MAX_PARTICLES)
    solve = partial(_times_of, k=k, shares=shares, grid=ensemble.grid, axis=axis, heads=heads, n=n)
    return np.array(over(ensemble, solve, **run))


def porosities(ensemble: Ensemble, porosity: FaciesValues | float) -> PropertyValues:
    """Return the porosity of each facies, or raise `CCWSIMError`."""
    image, values = ensemble.training_image, cast(Any, porosity)
    if not isinstance(values, Mapping | FromValues):
        values = dict.fromkeys(image.facies_names, values)
    return values_by_facies(image, values, "porosity", 1.0)


def breakthrough(flow: Flow, porosity: Floats | float, axis: str, n: int) -> Floats:
    """Return sorted travel times of n particles from the inflow side; inf if they end inside."""
    axis = "edge" if "edge" in flow.fixed else axis
    particles = tracks(flow, starts_at_inflow(flow, n, axis), porosity=porosity, keep_paths=False)
    return np.sort(np.where(particles.status == LEFT_GRID, particles.times, np.inf))


def _times_of(
    cells: Cells,
    k: PropertyValues,
    shares: PropertyValues,
    grid: Grid,
    axis: str,
    heads: Any,
    n: int,
) -> Floats:
    flow = _along(axis, cell_values(k, cells), grid, heads=heads)
    return breakthrough(flow, cell_values(shares, cells), axis, n)


def capture_probability(
    ensemble: Ensemble,
    values: FaciesValues,
    well: tuple[int, ...],
    rate: float,
    *,
    west_east: Ends | None = None,
    south_north: Ends | None = None,
    edge: Edge | None = None,
    thickness: float = 1.0,
    porosity: FaciesValues | float = 0.25,
    within: float = np.inf,
    step: int = 4,
    **run: Any,
) -> Capture:
    """Return the starts from which particles reach a well in time, in each realization.

    The well in a cell ((layer,) row, column) pumps `rate` (above 0) volumes per time. Starts are
    `step` cells apart, in volumes in the layer of the well.

    Examples
    --------
    >>> from ccwsim import simulate
    >>> e = simulate(np.tile([[0], [0], [1], [1]], (16, 64)), (40, 50), n_realizations=2)
    >>> capture = capture_probability(e, {0: 1, 1: 1}, (20, 25), 1.0, west_east=(1.0, 0.0))
    >>> capture.probability.shape, capture.probability.max()
    ((10, 12), np.float64(1.0))
    """
    k, step = _values(ensemble, values, "x"), check_int("step", step, 1)
    grid, within = ensemble.grid, check_number("within", within, 0.0, np.inf)
    rate = check_number("rate", rate, 0.0, MAX_MAGNITUDE, open_below=True)
    well = checked_cell(well, grid.shape)
    starts, shape = starts_on_grid(grid, step, well[0] if grid.is_volume else None)
    solve = partial(
        _captured_in, k=k, shares=porosities(ensemble, porosity), grid=grid, starts=starts,
        within=within, wells={well: -rate}, west_east=west_east, south_north=south_north,
        edge=edge, thickness=thickness,
    )  # fmt: skip
    captured = over(ensemble, solve, **run)
    return Capture(starts, shape, np.array(captured), active_starts(ensemble, starts))


def active_starts(ensemble: Ensemble, starts: Floats) -> Mask:
    """Return which starts are in active cells."""
    return ensemble.study.active_mask[tuple(cells_at(starts, ensemble.grid).T)]


def starts_on_grid(grid: Grid, step: int, layer: int | None = None) -> tuple[Floats, Shape]:
    """Return starts in every `step`-th row and column, and their numbers along y and x."""
    lines = [np.arange(min(step // 2, n - 1), n, step) for n in grid.shape[-2:]]
    shape = tuple(map(len, lines))
    lines = lines if layer is None else [np.array([layer]), *lines]
    cells = np.stack(np.meshgrid(*lines, indexing="ij"), -1).reshape(-1, grid.n_dimensions)
    return grid.centers_of(cells), shape


def _captured_in(
    cells: Cells, k: PropertyValues, shares: PropertyValues, grid: Grid, starts: Floats,
    within: float, **conditions: Any,
) -> Mask:  # fmt: skip
    flow = darcy(cell_values(k, cells), grid, **conditions)
    return captured_by_wells(flow, starts, cell_values(shares, cells), within)


def captured_by_wells(flow: Flow, starts: Floats, porosity: Floats, within: float = np.inf) -> Mask:
    """Return which particles reach a well in time; none does from an inactive cell."""
    captured = ~np.isnan(flow.heads[tuple(cells_at(starts, flow.grid).T)])
    particles = tracks(flow, starts[captured], porosity=porosity, keep_paths=False)
    captured[captured] = (particles.status == IN_WELL) & (particles.times <= within)
    return captured


def at_percentiles(each: ArrayLike, percentiles: Sequence[float] = (10, 50, 90)) -> Ints:
    """Return the indices of the values nearest in rank to percentiles.

    Realizations at percentiles of the effective conductivity represent an ensemble.

    Examples
    --------
    >>> at_percentiles(np.array([3e-5, 1e-5, 2e-5]), [0, 50, 100])
    array([1, 2, 0])
    """
    numbers, wanted = as_floats(each, "each"), as_floats(percentiles, "percentiles")
    if not numbers.size or numbers.ndim != 1 or np.isnan(numbers).any():
        raise CCWSIMError(f"each = {shown(each)} must be one number for each realization")
    if wanted.ndim != 1 or not ((wanted >= 0) & (wanted <= 100)).all():
        raise CCWSIMError(f"percentiles = {shown(percentiles)} must be numbers from 0 to 100")
    order = np.argsort(numbers, kind="stable")
    return order[np.rint(wanted / 100 * (len(order) - 1)).astype(int)]


def _values(ensemble: Ensemble, values: FaciesValues, axis: str) -> PropertyValues:
    """Return the conductivities; raise `CCWSIMError` for an axis the grid lacks."""
    check_type("ensemble", ensemble, Ensemble)
    array_axis(axis, ensemble.grid)
    return values_by_facies(ensemble.training_image, values)


def over(
    ensemble: Ensemble,
    function: Callable[[Cells], Result],
    n_workers: int | None = None,
    progress: Progress | None = None,
    cancel: Cancel | None = None,
    executor: Any = None,
) -> list[Result]:
    """Return function(cells) of each realization, on threads or on the given executor.

    `cells` has the facies `indices` and, of a continuous variable, the `values` of a realization.
    An executor of processes needs a function of a module.

    Examples
    --------
    >>> from ccwsim import simulate
    >>> e = simulate(np.tile([[0], [0], [1], [1]], (16, 64)), (40, 50), n_realizations=2)
    >>> over(e, lambda cells: cells.indices.shape)
    [(40, 50), (40, 50)]
    """
    check_type("ensemble", ensemble, Ensemble)
    check_type("function", function, Callable)
    check_callable("progress", progress)
    check_callable("cancel", cancel)
    if executor is not None and not hasattr(executor, "submit"):
        raise refused("executor", given=shown(executor))
    results: list[Any] = [None] * ensemble.n

    def task(r: int, watch: Watch) -> None:
        watch.check()
        cells = cells_of(ensemble, r)
        results[r] = (
            function(cells) if executor is None else executor.submit(function, cells).result()
        )
        watch.tell(1.0)

    workers = n_cores() if n_workers is None else check_int("n_workers", n_workers, 1)
    done = run_all(task, ensemble.n, workers, Watch(progress, cancel))
    if len(done) < ensemble.n:
        raise Cancelled(f"stopped after {len(done)} of {ensemble.n} realizations")
    return results
