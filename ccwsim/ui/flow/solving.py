"""State and computation of the page Flow: the flow through one realization, and through all."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ccwsim import CCWSIMError, Ensemble, TrainingImage
from ccwsim.flow import Capture, EffectiveK, Flow, Tracks, answers, darcy, over, tracks
from ccwsim.flow.darcy import SIDES
from ccwsim.flow.tracks import starts_at_inflow
from ccwsim.io import flopy_as_zip, grdecl_as_zip
from ccwsim.jobs.job import Job
from ccwsim.jobs.limits import Demand
from ccwsim.jobs.statistics import StatisticsWorker
from ccwsim.model.extras import is_installed
from ccwsim.model.facies_property import cell_values
from ccwsim.model.numbers import three_digits, with_power
from ccwsim.model.watch import Fraction
from ccwsim.system.machine import n_cores
from ccwsim.ui.session.cached import as_task, shared_values
from ccwsim.ui.session.file_names import study_part
from ccwsim.ui.session.state import PageRun, RunState, State
from ccwsim.ui.widgets.fields import Download

BYTES_PER_CELL = 1200  # memory per cell of a solution in bytes, mostly the levels of the solver
ROCKS = (1e-4, 1e-7)  # first conductivity in m/s of all other, and of the most frequent facies
POROSITY = 0.25
DAY = 86400.0
N_TRACKS, N_PARTICLES, MAX_STARTS = 32, 200, 1024
UNITS = {"m/s": 1.0, "m/d": DAY}


@dataclass(frozen=True)
class FlowSettings:
    """Settings that determine the flow through a realization; lengths in m, times in s."""

    conductivity: tuple[float, ...]  # of each facies, m/s
    porosity: tuple[float, ...]
    axis: str  # "x", "y" or "z"
    heads: tuple[float, float]  # at the low and the high end of the axis, m
    anisotropy: float
    well: tuple[int, ...] | None  # cell of the well
    rate: float  # pumped, m³/s

    def solve(self, ensemble: Ensemble, indices: NDArray[np.uint8], *, well: bool = True) -> Flow:
        """Return the flow through facies indices, without the well if `well` is false."""
        ends: dict[str, Any] = {answers.HEADS_ALONG[self.axis]: self.heads}
        wells = self.wells if well else {}
        k = cell_values(np.array(self.conductivity), indices)
        return darcy(k, ensemble.grid, wells=wells, anisotropy=self.anisotropy, **ends)

    @property
    def pumps(self) -> bool:
        """Whether there is a well that pumps."""
        return bool(self.wells)

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
    indices = ensemble.indices[realization]
    flow = settings.solve(ensemble, indices)
    shares = cell_values(np.array(settings.porosity), indices)
    starts = starts_at_inflow(flow, N_TRACKS, settings.axis)
    inflow_tracks, to_well = tracks(flow, starts, porosity=shares), None
    if settings.pumps:
        assert settings.well is not None
        grid, angle = flow.grid, np.linspace(0, 2 * np.pi, 24, endpoint=False)
        (centre,) = grid.centers_of(np.array([settings.well]))
        # just outside the sides of the cell of the well, where upstream tracks begin
        steps = np.column_stack([np.cos(angle), np.sin(angle)])
        steps *= 0.51 / np.abs(steps).max(axis=1, keepdims=True)
        ring = np.repeat(centre[None], len(angle), axis=0)
        ring[:, :2] += steps * grid.cell_size[:2]
        ring = ring[grid.holds(grid.cells_of(*ring.T))]
        to_well = tracks(flow, ring, porosity=shares, backward=True)
    return Solution(flow, inflow_tracks, to_well)


@dataclass(frozen=True, eq=False)
class Answers:
    """Effective conductivities, travel times and capture of all realizations of an ensemble."""

    k: EffectiveK
    times: NDArray[np.float64]  # sorted travel times in s, (n, N_PARTICLES); inf if not arrived
    capture: Capture | None  # starts captured by the well, if there is one


@dataclass
class AnswersRun(PageRun[Answers]):
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
        return Demand(n_cells * self.ensemble.n, 0, BYTES_PER_CELL * n_cells * at_once)

    def work(self, job: Job[Answers]) -> Answers:
        ensemble, settings = self.ensemble, self.settings
        n = int(np.prod(ensemble.grid.shape[-2:]))
        step = max(4, int(np.ceil(np.sqrt(n / MAX_STARTS))))
        layer = settings.well[0] if settings.well and ensemble.grid.nz is not None else None
        starts, shape = answers.starts_on_grid(ensemble.grid, step, layer)
        solve = partial(_answer, ensemble=ensemble, settings=settings, starts=starts)
        each = over(ensemble, solve, progress=job.report, cancel=job.is_cancelled)
        k, times, captured = zip(*each, strict=True)
        capture = Capture(starts, shape, np.array(captured)) if settings.pumps else None
        of_facies = np.array(settings.conductivity)
        effective_k = answers.with_bounds(
            ensemble, of_facies, settings.axis, np.array(k), settings.anisotropy
        )
        return Answers(effective_k, np.array(times), capture)


def _answer(
    indices: NDArray[np.uint8], ensemble: Ensemble, settings: FlowSettings, starts: NDArray
) -> tuple[float, NDArray[np.float64], NDArray[np.bool_]]:
    """Return effective K and breakthrough without the well, and whether each start is captured."""
    shares = cell_values(np.array(settings.porosity), indices)
    flow = settings.solve(ensemble, indices, well=False)
    times = answers.breakthrough(flow, shares, settings.axis, N_PARTICLES)
    captured = np.zeros(len(starts), bool)
    if settings.pumps:
        pumped = settings.solve(ensemble, indices)
        captured = answers.captured_by_wells(pumped, starts, shares)
    return flow.effective_k, times, captured


@dataclass
class FlowState(RunState[AnswersRun]):
    """The state of the page; conductivities and porosities are kept by the name of the facies."""

    conductivity: dict[str, float] = field(default_factory=dict)
    porosity: dict[str, float] = field(default_factory=dict)
    unit: str = "m/s"
    axis: str = "x"
    high: float = 1.0
    low: float = 0.0
    anisotropy: float = 1.0
    well: tuple[int, ...] | None = None
    rate: float = 0.0  # m³/d
    particles: int = 0  # travel time at which particles are shown, % of the median travel time
    latest: tuple[Ensemble, Solution] | None = None  # drawn until the next solution is known
    follows: bool = True  # whether the well of a volume follows the cross hairs
    ack: int = 0  # number of the last stroke in a slice that was applied
    worker: StatisticsWorker = field(default_factory=lambda: StatisticsWorker(shared_values()))


def rock_of(page_state: FlowState, image: TrainingImage, k: int) -> tuple[float, float]:
    """Return the conductivity in m/s and the porosity of a facies, chosen or at first."""
    name, matrix = image.facies_names[k], int(np.argmax(image.proportions))
    first = ROCKS[k == matrix]
    return page_state.conductivity.get(name, first), page_state.porosity.get(name, POROSITY)


def settings_of(page_state: FlowState, ensemble: Ensemble) -> FlowSettings:
    """Return the settings on the page for an ensemble; a well outside the grid is ignored."""
    image, grid = ensemble.training_image, ensemble.grid
    rocks = [rock_of(page_state, image, k) for k in range(image.n_facies)]
    conductivity, porosity = zip(*rocks, strict=True)
    well = page_state.well
    if well is not None and (len(well) != grid.n_dimensions or not grid.holds(np.array([well]))[0]):
        well = None
    axis = page_state.axis if page_state.axis in "xyz"[: grid.n_dimensions] else "x"
    heads = page_state.high, page_state.low
    anisotropy = page_state.anisotropy if grid.nz is not None else 1.0
    return FlowSettings(
        conductivity=conductivity,
        porosity=porosity,
        axis=axis,
        heads=heads,
        anisotropy=anisotropy,
        well=well,
        rate=page_state.rate / DAY,
    )


def set_well(page_state: FlowState, ensemble: Ensemble, cell: Sequence[int]) -> None:
    """Place the well; the first rate is a third of the flow through a layered grid."""
    page_state.well = tuple(cell)
    if not page_state.rate:
        settings, grid = settings_of(page_state, ensemble), ensemble.grid
        k = float(ensemble.proportions.mean(axis=0) @ settings.conductivity)
        dx, dy, dz = (*grid.cell_size, 1.0)[:3]
        area = grid.ny * dy * (grid.nz or 1) * dz
        flow = k * area * abs(page_state.high - page_state.low) / (grid.nx * dx)
        page_state.rate = float(f"{flow * DAY / 3:.2g}")


def take_choice(page_state: FlowState, ensemble: Ensemble, choice: dict[str, Any]) -> None:
    """Take the well and the heads that the user chose on a map."""
    if choice["well"]:
        set_well(page_state, ensemble, [int(k) for k in choice["well"]])
    if choice["heads"]:
        page_state.high, page_state.low = map(float, choice["heads"])


def take_strokes(page_state: FlowState, ensemble: Ensemble, edits: list[dict[str, Any]]) -> None:
    """Move the well to the end of the latest stroke of the cross hairs in a volume."""
    for edit in edits:
        page_state.ack = max(page_state.ack, edit["seq"])
        if edit.get("cells"):
            set_well(page_state, ensemble, [int(k) for k in edit["cells"][-1]])


def start_answers(state: State) -> None:
    """Solve all realizations of the latest results."""
    page_state, ensemble = state.page(FlowState), state.ensemble
    if ensemble is not None:
        settings = settings_of(page_state, ensemble)
        page_state.start(lambda: AnswersRun(ensemble, settings))


def problem_of(settings: FlowSettings) -> str:
    """Return the reason why nothing can be solved, or an empty text."""
    if settings.heads[0] == settings.heads[1]:
        return f"Both heads are {settings.heads[0]:g} m, so nothing flows: choose different heads."
    return ""


def model_downloads(
    page_state: FlowState, ensemble: Ensemble, realization: int
) -> dict[str, list[Download]]:
    """Return models for other programs, below a title with the values of the page Flow."""
    settings, image = settings_of(page_state, ensemble), ensemble.training_image
    k = dict(zip(image.codes.tolist(), settings.conductivity, strict=True))
    content = partial(
        grdecl_as_zip, study_part(ensemble), ensemble, k, anisotropy=settings.anisotropy
    )
    files = [Download("GRDECL with permeability", "models_grdecl", "_grdecl.zip", content)]
    named = zip(image.facies_names, settings.conductivity, strict=True)
    values = [f"K of {name} {with_power(value, 6)} m/s" for name, value in named]
    if settings.axis != "z" and is_installed("flopy"):
        ends = zip(SIDES[settings.axis], settings.heads, strict=True)
        values += [
            *(f"head {head:g} m {side}" for side, head in ends),
            *["a well"] * settings.pumps,
        ]
        content = partial(
            flopy_as_zip,
            ensemble,
            k,
            wells=settings.wells,
            anisotropy=settings.anisotropy,
            realization=realization,
            **{answers.HEADS_ALONG[settings.axis]: settings.heads},
        )
        label = f"MODFLOW 6, realization {realization + 1}"
        files.append(Download(label, "models_modflow", "_modflow.zip", content))
    return {f"Models for flow programs, with the values of Flow: {', '.join(values)}": files}


def worth(capture: Capture, truth: NDArray[np.bool_] | None) -> str:
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


def captured_in(state: State, run: AnswersRun) -> NDArray[np.bool_] | None:
    """Return the starts that the well captures in the reference field, if it is known."""
    reference, result = state.reference, run.result
    if result is None or result.capture is None or reference is None:
        return None
    if reference.shape != run.ensemble.grid.shape:
        return None
    if not np.array_equal(reference.codes, run.ensemble.training_image.codes):
        return None
    starts = result.capture.starts
    return _answer(reference.indices, run.ensemble, run.settings, starts)[2]
