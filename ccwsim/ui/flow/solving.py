"""State and computation of the page Flow: the flow through one realization, and through all."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, cast

import numpy as np

from ccwsim import CCWSIMError, Ensemble, TrainingImage
from ccwsim.flow import Capture, Edge, EffectiveK, Flow, Tracks, answers, darcy, over, tracks
from ccwsim.flow.darcy import SIDES
from ccwsim.flow.tracks import starts_at_inflow
from ccwsim.io import flopy_as_zip, grdecl_as_zip
from ccwsim.jobs.job import Job
from ccwsim.jobs.limits import Demand
from ccwsim.jobs.statistics import StatisticsWorker
from ccwsim.model import (
    Array,
    Cells,
    Floats,
    Fraction,
    FromValues,
    Mask,
    PropertyValues,
    cell_values,
    cells_of,
    describe_rocks,
    is_installed,
    three_digits,
)
from ccwsim.sharing.choices import FlowChoice
from ccwsim.system.machine import n_cores
from ccwsim.ui.session import PageRun, RunState, State, as_task, shared_values, study_part
from ccwsim.ui.widgets import Download

# memory per cell of a solution in bytes, mostly the levels of the solver
SOLVER_BYTES_PER_CELL = 1200
ROCKS = (1e-4, 1e-7)  # first conductivity in m/s of all other, and of the most frequent facies
POROSITY = 0.25
DAY = 86400.0
N_TRACKS, N_PARTICLES, MAX_STARTS = 32, 200, 1024
CONDUCTIVITY_UNITS = {"m/s": 1.0, "m/d": DAY}
K_BY_VALUES = ("K", "log K")  # values from which conductivities follow


@dataclass(frozen=True)
class FlowSettings:
    """Settings that determine the flow through a realization; lengths in m, times in s."""

    conductivity: PropertyValues  # m/s
    porosity: PropertyValues
    axis: str  # "x", "y" or "z"
    ends: answers.Heads  # at the low and the high end of the axis, or along the outline, m
    anisotropy: float
    thickness: float  # of a map, m
    well: tuple[int, ...] | None  # cell of the well
    rate: float  # pumped, m³/s

    def solve(self, ensemble: Ensemble, cells: Cells, *, well: bool = True) -> Flow:
        """Return the flow through a realization, without the well if `well` is false."""
        k = cell_values(self.conductivity, cells)
        options: dict[str, Any] = self.options if well else self.options | {"wells": {}}
        return darcy(k, ensemble.grid, active=ensemble.active, **options)

    @property
    def options(self) -> dict[str, Any]:
        """Heads, wells, anisotropy and thickness, as arguments of `darcy` and `to_flopy`."""
        options = {"anisotropy": self.anisotropy, "thickness": self.thickness, "wells": self.wells}
        return answers.heads_option(self.ends, self.axis) | options

    @property
    def heads(self) -> tuple[float, float]:
        """The two heads; they are equal if the head along the outline is constant."""
        return self.ends.heads if isinstance(self.ends, Edge) else self.ends

    @property
    def has_ends(self) -> bool:
        """Whether two heads belong to two sides, or to two ends of the outline."""
        differ = self.heads[0] != self.heads[1]
        return not isinstance(self.ends, Edge) or (self.ends.along in ("x", "y") and differ)

    @property
    def wells(self) -> dict[tuple[int, ...], float]:
        """The rate of the well by its cell, negative for pumping; empty without a well."""
        return {self.well: -self.rate} if self.well is not None and self.rate > 0 else {}


@dataclass(frozen=True, eq=False)
class Solution:
    """The flow through one realization, and tracks from the inflow side."""

    flow: Flow
    tracks: Tracks
    to_well: Tracks | None  # tracks that lead to the well, followed upstream


@as_task
def solution(
    progress: Fraction, ensemble: Ensemble, realization: int, settings: FlowSettings
) -> Solution:
    """Return the flow through a realization."""
    cells = cells_of(ensemble, realization)
    flow = settings.solve(ensemble, cells)
    shares = cell_values(settings.porosity, cells)
    starts = starts_at_inflow(flow, N_TRACKS, "edge" if "edge" in flow.fixed else settings.axis)
    inflow_tracks, to_well = tracks(flow, starts, porosity=shares), None
    for well in settings.wells:
        grid, angle = flow.grid, np.linspace(0, 2 * np.pi, 24, endpoint=False)
        (centre,) = grid.centers_of(np.array([well]))
        # just outside the sides of the cell of the well, where upstream tracks begin
        steps = np.column_stack([np.cos(angle), np.sin(angle)])
        steps *= 0.51 / np.abs(steps).max(axis=1, keepdims=True)
        ring = np.repeat(centre[None], len(angle), axis=0)
        ring[:, :2] += steps * grid.cell_size[:2]
        ring = ring[grid.holds(grid.cells_of(*ring.T))]
        ring = ring[~np.isnan(flow.heads[tuple(grid.cells_of(*ring.T).T)])]
        to_well = tracks(flow, ring, porosity=shares, backward=True)
    return Solution(flow, inflow_tracks, to_well)


@dataclass(frozen=True, eq=False)
class FlowAnswers:
    """Effective conductivities, travel times and capture of all realizations of an ensemble."""

    k: EffectiveK | None  # None if nothing flows without the well
    times: Floats  # sorted travel times in s, (n, N_PARTICLES); inf if not arrived
    capture: Capture | None  # starts captured by the well, if there is one


@dataclass
class AnswersRun(PageRun[FlowAnswers]):
    """The solution of all realizations of an ensemble."""

    ensemble: Ensemble
    settings: FlowSettings

    @property
    def n_pieces(self) -> int:
        """Number of realizations."""
        return self.ensemble.n

    def demand(self) -> Demand:
        n_cells = self.ensemble.grid.n_cells
        at_once = min(n_cores(), self.ensemble.n)
        return Demand(n_cells * self.ensemble.n, 0, SOLVER_BYTES_PER_CELL * n_cells * at_once)

    def work(self, job: Job[FlowAnswers]) -> FlowAnswers:
        ensemble, settings = self.ensemble, self.settings
        n = int(np.prod(ensemble.grid.shape[-2:]))
        step = max(4, int(np.ceil(np.sqrt(n / MAX_STARTS))))
        layer = settings.well[0] if settings.well and ensemble.grid.is_volume else None
        starts, shape = answers.starts_on_grid(ensemble.grid, step, layer)
        solve = partial(_answer, ensemble=ensemble, settings=settings, starts=starts)
        each = over(ensemble, solve, progress=job.report, cancel=job.is_cancelled)
        k, times, captured = zip(*each, strict=True)
        active = answers.active_starts(ensemble, starts)
        capture = Capture(starts, shape, np.array(captured), active) if settings.wells else None
        effective_k = None
        if settings.heads[0] != settings.heads[1]:
            effective_k = answers.with_bounds(
                ensemble, settings.conductivity, settings.axis, np.array(k),
                heads=settings.ends, anisotropy=settings.anisotropy,
            )  # fmt: skip
        return FlowAnswers(effective_k, np.array(times), capture)


def _answer(
    cells: Cells, ensemble: Ensemble, settings: FlowSettings, starts: Array
) -> tuple[float, Floats, Mask]:
    """Return effective K and breakthrough without the well, and whether each start is captured."""
    shares = cell_values(settings.porosity, cells)
    k, times = np.nan, np.full(N_PARTICLES, np.inf)
    if settings.heads[0] != settings.heads[1]:
        flow = settings.solve(ensemble, cells, well=False)
        k, times = flow.effective_k, answers.breakthrough(flow, shares, settings.axis, N_PARTICLES)
    captured = np.zeros(len(starts), bool)
    if settings.wells:
        pumped = settings.solve(ensemble, cells)
        captured = answers.captured_by_wells(pumped, starts, shares)
    return k, times, captured


@dataclass
class FlowState(RunState[AnswersRun]):
    """The state of the page, except the settings, which are in `State.flow`."""

    particles: int = 0  # travel time at which particles are shown, % of the median travel time
    latest: tuple[Ensemble, Solution] | None = None  # drawn until the next solution is known
    follows: bool = True  # whether the well of a volume follows the cross hairs
    ack: int = 0  # number of the last stroke in a slice that was applied
    worker: StatisticsWorker = field(default_factory=lambda: StatisticsWorker(shared_values()))


def rock_name(image: TrainingImage, k: int) -> str:
    """Return the name of a facies; if codes are only numbers, the name is of this image alone."""
    name = image.facies_names[k]
    return name if image.numbering == "codes" else f"{name} {image.digest}"


def rock_of(choice: FlowChoice, image: TrainingImage, k: int) -> tuple[float, float]:
    """Return the conductivity in m/s and the porosity of a facies, chosen or at first.

    The first conductivities of classes of values rise with the values.
    """
    first = ROCKS[k == int(np.argmax(image.proportions))]
    if image.values:
        first = float(np.geomspace(ROCKS[1], ROCKS[0], image.n_facies)[k])
    return dict(choice.rocks).get(rock_name(image, k), (first, POROSITY))


def flow_settings(choice: FlowChoice, ensemble: Ensemble) -> FlowSettings:
    """Return the settings on the page for an ensemble; a well outside the grid is ignored."""
    image, grid = ensemble.training_image, ensemble.grid
    rocks = [rock_of(choice, image, k) for k in range(image.n_facies)]
    conductivity, porosity = zip(*rocks, strict=True)
    if image.values and choice.values_are in K_BY_VALUES:
        factor = 1 / CONDUCTIVITY_UNITS[choice.unit]
        conductivity = FromValues(choice.values_are == "log K", factor)
    elif image.values and choice.values_are == "porosity":
        porosity = FromValues()
    well = choice.well
    if well is not None and (len(well) != grid.n_dimensions or not grid.holds(np.array([well]))[0]):
        well = None
    heads: answers.Heads = choice.high, choice.low
    axis = heads_place(choice, ensemble)
    if axis == "edge":
        along: Any = choice.along
        if along == "points":
            along = np.reshape(outline_points(choice, ensemble), (2, 2))
        elif along == "constant":
            along, heads = "x", (choice.high, choice.high)
        heads = Edge(heads, along)
        axis = heads.axis
    anisotropy = choice.anisotropy if grid.is_volume else 1.0
    return FlowSettings(
        conductivity=conductivity,
        porosity=porosity,
        axis=axis,
        ends=heads,
        anisotropy=anisotropy,
        thickness=1.0 if grid.is_volume else choice.thickness,
        well=well,
        rate=choice.rate / DAY,
    )


def heads_place(choice: FlowChoice, ensemble: Ensemble) -> str:
    """Return the axis with heads at both sides, or "edge" for heads along the outline."""
    if choice.axis in ("edge", *"xyz"[: ensemble.grid.n_dimensions]):
        return choice.axis
    usual = answers.usual_heads(ensemble.study.active_mask)
    return "edge" if isinstance(usual, Edge) else "x"


def outline_points(choice: FlowChoice, ensemble: Ensemble) -> list[float]:
    """Return x, y, x and y of the points between which heads are linear; at first, grid corners."""
    grid = ensemble.grid
    (x, y), (dx, dy) = grid.origin[:2], grid.cell_size[:2]
    first = [x, y, x + dx * grid.nx, y + dy * grid.ny]
    return first if choice.points[:2] == choice.points[2:] else list(choice.points)


def set_well(state: State, ensemble: Ensemble, cell: Sequence[int]) -> None:
    """Place the well; the first rate is a third of the flow through a layered grid."""
    state.change_flow(well=tuple(cell))
    if not state.flow.rate:
        settings, grid = flow_settings(state.flow, ensemble), ensemble.grid
        cells = (cells_of(ensemble, r) for r in range(ensemble.n))
        k = np.mean([np.nanmean(cell_values(settings.conductivity, part)) for part in cells])
        dx, dy, dz = (*grid.cell_size, settings.thickness)[:3]
        area = grid.ny * dy * (grid.nz or 1) * dz
        flow = k * area * (abs(state.flow.high - state.flow.low) or 1.0) / (grid.nx * dx)
        state.change_flow(rate=float(f"{flow * DAY / 3:.2g}"))


def take_choice(state: State, ensemble: Ensemble, choice: dict[str, Any]) -> None:
    """Take the well and the heads that the user chose on a map."""
    if choice["well"]:
        set_well(state, ensemble, [int(k) for k in choice["well"]])
    if choice["heads"]:
        high, low = map(float, choice["heads"])
        state.change_flow(high=high, low=low)


def take_strokes(state: State, ensemble: Ensemble, edits: list[dict[str, Any]]) -> None:
    """Move the well to the end of the latest stroke of the cross hairs in a volume."""
    page_state = state.page(FlowState)
    for edit in edits:
        page_state.ack = max(page_state.ack, edit["seq"])
        if edit.get("cells"):
            set_well(state, ensemble, [int(k) for k in edit["cells"][-1]])


def start_answers(state: State) -> None:
    """Solve all realizations of the latest results."""
    page_state, ensemble = state.page(FlowState), state.ensemble
    if ensemble is not None:
        settings = flow_settings(state.flow, ensemble)
        page_state.start(lambda: AnswersRun(ensemble, settings))


def flow_problem(settings: FlowSettings) -> str:
    """Return the reason why nothing can be solved, or an empty text."""
    head, other = settings.heads
    if head != other or (isinstance(settings.ends, Edge) and settings.wells):
        return ""
    if isinstance(settings.ends, Edge):
        return (
            f"The head is {head:g} m along the whole outline, so nothing flows: click the map to \
place a well, or choose heads that change."
        )
    return f"Both heads are {head:g} m, so nothing flows: choose different heads."


def model_downloads(
    choice: FlowChoice, ensemble: Ensemble, realization: int
) -> dict[str, list[Download]]:
    """Return models for other programs, below a title with the values of the page Flow."""
    settings, image = flow_settings(choice, ensemble), ensemble.training_image
    rocks, k = settings.conductivity, cast(Any, settings.conductivity)
    if not isinstance(rocks, FromValues):
        k = dict(zip(image.codes.tolist(), rocks, strict=True))
    content = partial(
        grdecl_as_zip, study_part(ensemble), ensemble, k,
        anisotropy=settings.anisotropy, thickness=settings.thickness,
    )  # fmt: skip
    files = [Download("GRDECL with permeability", "models_grdecl", "_grdecl.zip", content)]
    values = [f"K in m/s: {describe_rocks(rocks, image)}"]
    if settings.axis != "z" and is_installed("flopy"):
        values += ["heads along the outline"] * isinstance(settings.ends, Edge)
        if settings.thickness != 1:
            values.append(f"thickness {settings.thickness:g} m")
        ends = zip(SIDES[settings.axis], settings.heads, strict=True)
        values += [
            *(f"head {head:g} m {side}" for side, head in ends),
            *["a well" for _ in settings.wells],
        ]
        content = partial(flopy_as_zip, ensemble, k, realization=realization, **settings.options)
        label = f"MODFLOW 6, realization {realization + 1}"
        files.append(Download(label, "models_modflow", "_modflow.zip", content))
    return {f"Models for flow programs, with the values of Flow: {', '.join(values)}": files}


def worth(capture: Capture, truth: Mask | None) -> str:
    """Return a sentence on the Brier score of the capture probability against climatology."""
    try:
        score, constant = capture.brier(truth)
    except CCWSIMError as error:
        return f"{error}."
    against = "the reference field" if truth is not None else "one realization left out in turn"
    better = "hardly better than" if score > 0.8 * constant else "better than"
    better = "no better than" if score >= 0.98 * constant else better
    return (
        f"Brier score {three_digits(score)} against {against}; one constant probability scores "
        f"{three_digits(constant)}. The map is {better} a constant."
    )


def captured_in(state: State, run: AnswersRun) -> Mask | None:
    """Return the starts that the well captures in the reference field, if it is known."""
    reference, result = state.reference, run.result
    if result is None or result.capture is None or reference is None:
        return None
    if reference.shape != run.ensemble.grid.shape:
        return None
    if not np.array_equal(reference.codes, run.ensemble.training_image.codes):
        return None
    if reference.variable != run.ensemble.training_image.variable:
        return None
    starts = result.capture.starts
    return _answer(cells_of(reference), run.ensemble, run.settings, starts)[2]
