"""The settings on the page Compare, the run that compares them, and the state of the page."""

from dataclasses import asdict, dataclass, field, replace
from math import prod
from typing import Any

import numpy as np

from ccwsim.experiments import comparison
from ccwsim.experiments.two_point import simulate_two_point
from ccwsim.jobs.job import NOTHING, Job
from ccwsim.jobs.limits import Demand
from ccwsim.model.arrays import Shape, listing, readonly
from ccwsim.model.ensemble import Ensemble
from ccwsim.model.errors import Cancelled, CCWSIMError
from ccwsim.model.grid import Grid
from ccwsim.model.hard_data import HardData
from ccwsim.model.parameters import METHODS, Parameters
from ccwsim.model.secondary import Secondary
from ccwsim.model.study import Study
from ccwsim.model.training_image import TrainingImage
from ccwsim.run.footprint import demand_of
from ccwsim.run.simulation import simulate
from ccwsim.sharing.choices import DataChoice, ImageChoice
from ccwsim.ui.session.fragments import follow
from ccwsim.ui.session.resolve import data_of, fitted, image_of, levels, secondary_of
from ccwsim.ui.session.state import PageRun, State, start_page_run
from ccwsim.ui.study.changes import image_name
from ccwsim.ui.study.run import failed
from ccwsim.ui.study.study_column import set_parameters

N_USUAL, N_USUAL_VOLUME = 12, 4
"""Default number of realizations per setting, for maps and for volumes."""
LETTERS: tuple[str, ...] = ("A", "B", "C", "D")
"""Names of the settings; A is the setting of the study."""
TWO_POINT = "two-point"
"""Name of the two-point simulation, which is not CCWSIM, among the compared settings."""
Beside = str | ImageChoice
"""What is shown beside the settings: nothing (""), TWO_POINT, or a second training image."""
BYTES_OF_FIELD = 80
"""Bytes per cell of the periodic Gaussian field from which the two-point simulation is cut."""


@dataclass(frozen=True)
class ComparisonRequest:
    """The inputs of a comparison; the results are outdated if the inputs on the page differ."""

    image: ImageChoice
    data: DataChoice
    grid: Grid
    seed: int
    n: int
    settings: tuple[Parameters, ...]
    beside: Beside = ""

    @property
    def key(self) -> tuple:
        """Key that two requests share if their results are equal; colours of facies are ignored."""
        inputs = self.image.digest, self.data, self.grid, self.seed, self.n
        return *inputs, self.settings, getattr(self.beside, "digest", self.beside)

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the settings and, after them, of the two-point simulation."""
        letters = LETTERS[: len(self.settings)]
        return (*letters, TWO_POINT) if self.beside == TWO_POINT else letters


@dataclass
class ComparisonRun(PageRun[comparison.Comparison]):
    """A run that compares settings, or adds curves of `facies` (a code) to a known comparison.

    `second` is the study of setting A with the second training image, if there is one;
    `of_second` are its realizations.
    """

    request: ComparisonRequest
    training_image: TrainingImage
    hard_data: HardData
    facies: int
    known: comparison.Comparison | None = None
    partial: comparison.Comparison | None = None
    n_parts: int = 0
    second: Study | None = None
    of_second: Ensemble | None = None
    secondary: Secondary | None = None

    @property
    def n_pieces(self) -> int:
        """Total number of realizations of all settings."""
        return self.request.n * len(self.request.names)

    def demand(self) -> Demand:
        """Return the resources that the run needs, including memory for all realizations."""
        if self.known is not None:
            return NOTHING
        r, image, data = self.request, self.training_image, self.hard_data
        studies = [Study(image, r.grid, p, data, r.seed, self.secondary) for p in r.settings]
        studies += [self.second] if self.second else []
        each = [demand_of(study, r.n) for study in studies]
        n_bytes = sum(demand.n_bytes for demand in each)
        if r.beside == TWO_POINT:
            sides = zip(r.grid.shape, image.shape, strict=True)
            n_bytes += BYTES_OF_FIELD * prod(n + side // 2 for n, side in sides)
        return Demand(sum(demand.n_cells for demand in each), data.n, n_bytes)

    def work(self, job: Job[comparison.Comparison]) -> comparison.Comparison:
        """Run the comparison, publish partial results, and return the comparison."""
        r, options = self.request, (job.report, job.is_cancelled)
        if self.known is not None:
            return comparison.add_curves(self.known, self.facies, *options)
        image, settings = self.training_image, dict(zip(LETTERS, r.settings, strict=False))
        if r.beside == TWO_POINT:
            settings |= {TWO_POINT: simulate_two_point(image, r.grid, r.n, r.seed)}
        run = (self.hard_data, r.n, r.seed, *options)
        how: Any = {"facies": self.facies, "on_partial": self._take, "secondary": self.secondary}
        found = comparison.compare(image, r.grid, settings, *run, **how)
        if (s := self.second) is not None:
            study = s.training_image, s.grid, s.parameters, s.hard_data
            self.of_second = simulate(
                *study, r.n, r.seed, cancel=job.is_cancelled, secondary=s.secondary
            )
        return found

    def _take(self, partial: comparison.Comparison) -> None:
        self.partial = partial
        self.n_parts += 1


@dataclass
class ComparePageState:
    """The state of the page.

    `others` are the settings besides the setting of the study; an element None stands for a default
    setting, derived from the study. `n` is the number of realizations per setting, or None until
    the page is first drawn. `run` is the running comparison, `found` and `of_second` are the latest
    results, and `request` has their inputs.
    """

    others: list[Parameters | None] = field(default_factory=lambda: [None, None])
    n: int | None = None
    beside: Beside = ""
    run: ComparisonRun | None = None
    found: comparison.Comparison | None = None
    of_second: Ensemble | None = None
    request: ComparisonRequest | None = None
    message: str = ""
    shown: int = 0


def settings_of(state: State) -> tuple[Parameters, ...]:
    """Return all settings, with the nearest sizes that fit the training image."""
    shape = image_of(state.choices.image).shape
    own = fitted(state.choices.parameters, shape)
    usual = usual_others(own, shape)
    chosen = state.page(ComparePageState).others
    others = (usual[k] if p is None else p for k, p in enumerate(chosen))
    return own, *(fitted(p, shape) for p in others)


def usual_others(own: Parameters, shape: Shape) -> list[Parameters]:
    """Return default settings for a comparison with the setting of the study."""
    wanted: list[Any] = [k for k in (3, 1, 2) if k in levels(shape)]
    if len(shape) == 3:  # volumes are thin, so the level along z is at most the level in layers
        wanted = [(z, k, k) for k in wanted for z in (k - 1, k) if z in levels(shape, True)]
    tried: list[dict] = [{"method": "ccsim"}]
    tried += [{"method": "ccwsim", "wavelet_level": level} for level in wanted]
    tried += [{"method": method} for method in METHODS]
    tried += [{"n_candidates": 5}, {"n_candidates": 50}, {"refine": not own.refine}]
    tried += [{"random_path": not own.random_path}]
    usual: list[Parameters] = []
    for changes in tried:
        p = fitted(own, shape, **changes)
        if p != own and p not in usual:
            usual.append(p)
    return usual


def change_setting(state: State, k: int, **changes: object) -> None:
    """Replace setting `k`; setting 0 is the setting of the study."""
    if k == 0:
        set_parameters(state, **changes)
        return
    shape = image_of(state.choices.image).shape
    state.page(ComparePageState).others[k - 1] = fitted(settings_of(state)[k], shape, **changes)


def copy_setting(state: State, k: int, source: int) -> None:
    """Copy setting `source` to setting `k`."""
    change_setting(state, k, **asdict(settings_of(state)[source]))


def add_setting(state: State) -> None:
    """Add a default setting that is not in the list yet."""
    present = settings_of(state)
    if len(present) < comparison.MAX_SETTINGS:
        usual = usual_others(present[0], image_of(state.choices.image).shape)
        new = next((p for p in usual if p not in present), present[0])
        state.page(ComparePageState).others.append(new)


def remove_setting(state: State, k: int) -> None:
    """Remove setting `k`; the letters of later settings move up by one."""
    present = list(settings_of(state))
    if 0 < k < len(present) and len(present) > comparison.MIN_SETTINGS:
        del present[k]
        state.page(ComparePageState).others[:] = present[1:]


def use_setting(state: State, k: int) -> None:
    """Swap setting `k` with the setting of the study, so that neither is lost."""
    present = list(settings_of(state))
    present[0], present[k] = present[k], present[0]
    state.change(parameters=present[0])
    if k:
        state.page(ComparePageState).others[:] = present[1:]


def request_of(state: State) -> ComparisonRequest:
    """Return the inputs of a comparison from the present state of the page."""
    c, n, beside = state.choices, n_of(state), state.page(ComparePageState).beside
    return ComparisonRequest(c.image, c.data, c.grid, c.seed, n, settings_of(state), beside)


def n_of(state: State) -> int:
    """Return the number of realizations per setting; volumes have a smaller default than maps."""
    page_state = state.page(ComparePageState)
    if page_state.n is None:
        page_state.n = N_USUAL if state.choices.grid.nz is None else N_USUAL_VOLUME
    return page_state.n


def second_study(state: State) -> Study | None:
    """Return setting A with the second image, or None without one; raise if facies differ."""
    beside, c = state.page(ComparePageState).beside, state.choices
    if not isinstance(beside, ImageChoice):
        return None
    image, codes = image_of(beside), image_of(c.image).codes
    if not np.array_equal(image.codes, codes):
        raise CCWSIMError(
            f"{image_name(beside)} has the facies {listing(map(str, image.codes))}, and the "
            f"training image of the study has {listing(map(str, codes))}. Choose an image with the "
            "same facies."
        )
    parameters = fitted(settings_of(state)[0], image.shape)
    return Study(image, c.grid, parameters, data_of(c), c.seed, secondary_of(c))


def both_images(first: Ensemble, second: Ensemble) -> Ensemble:
    """Return the realizations of two ensembles with equal facies as one ensemble."""
    names = ("indices", "cpu_seconds", "data_status", "numbers")
    each = {name: (getattr(first, name), getattr(second, name)) for name in names}
    return replace(first, **{name: readonly(np.concatenate(two)) for name, two in each.items()})


def start_comparison(state: State) -> None:
    """Start comparing the current settings; a running comparison is stopped."""
    page_state = state.page(ComparePageState)

    def make() -> ComparisonRun:
        image, data = image_of(state.choices.image), data_of(state.choices)
        code = int(image.codes[min(state.facies, image.n_facies - 1)])
        run = ComparisonRun(request_of(state), image, data, code, second=second_study(state))
        run.secondary = secondary_of(state.choices)
        if page_state.run is not None:
            page_state.run.stop()
            page_state.run = None
        return run

    start_page_run(page_state, "run", make)


def want_curves(state: State) -> None:
    """Start computing the curves of the chosen facies if the comparison lacks these curves."""
    page_state = state.page(ComparePageState)
    found = page_state.found
    if page_state.run is not None or found is None or has_curves(found, state.facies):
        return
    assert page_state.request is not None
    first, code = found.ensembles[0], code_of(found, state.facies)
    study = first.training_image, first.hard_data
    run = ComparisonRun(page_state.request, *study, code, found, found)
    run.of_second = page_state.of_second
    page_state.run = run.start()


def has_curves(found: comparison.Comparison, facies: int) -> bool:
    """Return whether the comparison contains the curves of a facies."""
    code = code_of(found, facies)
    return any(key[0] == code for key in found.curves)


def code_of(found: comparison.Comparison, facies: int) -> int:
    """Return the code of a facies by its index."""
    return int(found.ensembles[0].training_image.codes[facies])


def collect_comparison(state: State) -> None:
    """Store the result of a finished run; earlier results stay if the run has no result."""
    page_state = state.page(ComparePageState)
    run = page_state.run
    if run is None or run.going:
        return
    page_state.run = None
    found = run.result
    if isinstance(run.error, Cancelled):
        found = run.partial
        if found is not None and len(found.names) < comparison.MIN_SETTINGS:
            found = None
        n = len(run.request.names)
        page_state.message = _stopped(found, n, page_state.found is not None)
    elif run.error is not None:
        page_state.message = failed(run.error)
    if found is not None:
        page_state.found, page_state.request = found, run.request
        page_state.of_second = run.of_second


def _stopped(found: comparison.Comparison | None, n: int, has_older: bool) -> str:
    if found is not None:
        all_ = "all" if len(found.names) == n else f"{len(found.names)} of {n}"
        return f"Stopped after {all_} settings were simulated; the results so far are shown."
    return "Stopped before two settings were simulated." + (
        " The earlier comparison is still shown." if has_older else ""
    )


def follow_comparison(state: State, run: ComparisonRun) -> None:
    """Show the progress of the run; redraw the page for new partial results and at the end."""
    job, n_parts = run.job, run.n_parts
    if job is not None:
        follow(
            job,
            on_finished=lambda: collect_comparison(state),
            has_news=lambda: run.n_parts != n_parts,
            label=lambda: progress_label(run),
        )


def progress_label(run: ComparisonRun) -> str:
    """Return the name of the step that follows the simulation; empty during the simulation."""
    if run.job is None or run.job.n_done < run.n_pieces:
        return ""
    if run.second is not None and run.partial and (run.partial.anodi or run.partial.problem):
        return "Simulating with the second image"
    return "Comparing patterns" if run.partial and run.partial.curves else "Comparing curves"
