"""The settings on the page Compare, the run that compares them, and the state of the page."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from math import prod
from typing import Any, Final

import numpy as np

from ccwsim import Cancelled, CCWSIMError, Ensemble
from ccwsim.experiments import comparison
from ccwsim.experiments.trials import Trial
from ccwsim.experiments.two_point import simulate_two_point
from ccwsim.jobs.job import NO_DEMAND, Job
from ccwsim.jobs.limits import Demand
from ccwsim.model import (
    MAX_SETTINGS,
    METHODS,
    MIN_SETTINGS,
    Parameters,
    Shape,
    fitted,
    levels,
    listing,
    readonly,
)
from ccwsim.run.footprint import demand_of
from ccwsim.sharing.choices import Beside, ImageChoice
from ccwsim.ui.session import RunState, State, image_of
from ccwsim.ui.study.changes import image_name
from ccwsim.ui.study.study_column import set_parameters
from ccwsim.ui.study.trials import TrialsRun, shown_in, study_key, trials_of

N_USUAL, N_USUAL_VOLUME = 12, 4
"""Default number of realizations per setting, for maps and for volumes."""
LETTERS: tuple[str, ...] = ("A", "B", "C", "D")
"""Names of the settings; A is the setting of the study."""
TWO_POINT: Final = "two-point"
"""Name of the two-point simulation, which is not CCWSIM, among the compared settings."""
BYTES_OF_FIELD = 80
"""Bytes per cell of the periodic Gaussian field from which the two-point simulation is cut."""


@dataclass(kw_only=True)
class ComparisonRun(TrialsRun[comparison.Comparison, comparison.Comparison]):
    """A run that compares settings, or adds curves of `facies` to the comparison `base`.

    The last of `rows` is the comparison so far. `second` is setting A with the second training
    image, if there is one; `second_ensemble` are its realizations.
    """

    beside: Beside
    base: comparison.Comparison | None = None
    second: Trial | None = None
    second_ensemble: Ensemble | None = None
    unit = "realizations"

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the settings and, after them, of the two-point simulation."""
        return setting_names(self.trials, self.beside)

    @property
    def n_pieces(self) -> int:
        """Total number of realizations of all settings."""
        return self.n_realizations * len(self.names)

    @property
    def latest_result(self) -> comparison.Comparison | None:
        """The comparison so far; None if the run failed, or was stopped before two settings."""
        latest = self.result or (self.rows[-1] if self.rows else None)
        if latest is None or not self.error:
            return latest
        enough = len(latest.names) >= MIN_SETTINGS
        return latest if enough and isinstance(self.error, Cancelled) else None

    def demand(self) -> Demand:
        """Return the resources that the run needs, including memory for all realizations."""
        if self.base is not None:
            return NO_DEMAND
        demands = self.demands()
        n_bytes = sum(demand.n_bytes for demand in demands)
        if self.second is not None:
            n_bytes += demand_of(self.second.fitting(), self.n_realizations).n_bytes
        if self.beside == TWO_POINT:
            sides = zip(self.grid.shape, self.training_image.shape, strict=True)
            n_bytes += BYTES_OF_FIELD * prod(n + side // 2 for n, side in sides)
        return Demand(sum(demand.n_cells for demand in demands), self.first.n_data, n_bytes)

    def describe_stop(self) -> str:
        """Return how many settings were simulated before the run was stopped."""
        if (latest := self.latest_result) is None:
            return "Stopped before two settings were simulated."
        n, n_done = len(self.names), len(latest.names)
        all_ = "all" if n_done == n else f"{n_done} of {n}"
        return f"Stopped after {all_} settings were simulated; the results so far are shown."

    def label(self) -> str:
        """Return the name of the step that follows the simulation; empty during the simulation."""
        if self.job is None or self.job.n_done < self.n_pieces:
            return ""
        latest = self.latest_result
        if self.second is not None and latest and (latest.anodi or latest.problem):
            return "Simulating with the second image"
        return "Comparing patterns" if latest and latest.curves else "Comparing curves"

    def work(self, job: Job[comparison.Comparison]) -> comparison.Comparison:
        """Run the comparison, publish partial results, and return the comparison."""
        first, n, inputs = self.first, self.n_realizations, self.inputs(job)
        if self.base is not None:
            return comparison.add_curves(self.base, inputs["facies"], job.report, job.is_cancelled)
        settings: dict[str, Parameters | Ensemble] = {
            name: trial.parameters for name, trial in zip(LETTERS, self.trials, strict=False)
        }
        if self.beside == TWO_POINT:
            settings[TWO_POINT] = simulate_two_point(
                first.training_image, first.grid, n, first.seed
            )
        result = comparison.compare(settings=settings, on_partial=self.rows.append, **inputs)
        if self.second is not None:
            self.second_ensemble = self.second.simulate(n, cancel=job.is_cancelled)
        return result


@dataclass
class ComparePageState(RunState[ComparisonRun]):
    """The state of the page.

    `earlier` is a run whose results are shown until `run` has results.
    """

    earlier: ComparisonRun | None = None
    shown: int = 0

    @property
    def shown_run(self) -> ComparisonRun | None:
        """The latest run with results."""
        run = self.run
        return run if run is not None and run.latest_result is not None else self.earlier

    @property
    def kept_run(self) -> ComparisonRun | None:
        """The latest run that ended with results."""
        return self.earlier if self.going else self.shown_run


def compared_settings(state: State) -> tuple[Parameters, ...]:
    """Return all settings, with the nearest sizes that fit the training image."""
    shape = state.image.shape
    study_setting = fitted(state.choices.parameters, shape)
    usual = usual_others(study_setting, shape)
    others = (usual[k] if p is None else p for k, p in enumerate(state.compare.others))
    return study_setting, *(fitted(p, shape) for p in others)


def usual_others(study_setting: Parameters, shape: Shape) -> list[Parameters]:
    """Return default settings for a comparison with the setting of the study."""
    usual_levels: list[Any] = [k for k in (3, 1, 2) if k in levels(shape)]
    if len(shape) == 3:  # volumes are thin, so the level along z is at most the level in layers
        usual_levels = [
            (z, k, k) for k in usual_levels for z in (k - 1, k) if z in levels(shape, True)
        ]
    tried: list[dict[str, Any]] = [
        {"method": "ccsim"},
        *({"method": "ccwsim", "wavelet_level": level} for level in usual_levels),
        *({"method": method} for method in METHODS),
        {"n_candidates": 5},
        {"n_candidates": 50},
        {"refine": not study_setting.refine},
        {"random_path": not study_setting.random_path},
    ]
    distinct = dict.fromkeys(fitted(study_setting, shape, **changes) for changes in tried)
    return [p for p in distinct if p != study_setting]


def change_setting(state: State, k: int, **changes: object) -> None:
    """Replace setting `k`; setting 0 is the setting of the study."""
    if k == 0:
        set_parameters(state, **changes)
        return
    others = [*state.compare.others]
    others[k - 1] = fitted(compared_settings(state)[k], state.image.shape, **changes)
    state.change_compare(others=tuple(others))


def copy_setting(state: State, k: int, source: int) -> None:
    """Copy setting `source` to setting `k`."""
    change_setting(state, k, **asdict(compared_settings(state)[source]))


def add_setting(state: State) -> None:
    """Add a default setting that is not in the list yet."""
    present = compared_settings(state)
    if len(present) < MAX_SETTINGS:
        usual = usual_others(present[0], state.image.shape)
        new = next((p for p in usual if p not in present), present[0])
        state.change_compare(others=(*state.compare.others, new))


def remove_setting(state: State, k: int) -> None:
    """Remove setting `k`; the letters of later settings move up by one."""
    present = list(compared_settings(state))
    if 0 < k < len(present) and len(present) > MIN_SETTINGS:
        del present[k]
        state.change_compare(others=tuple(present[1:]))


def swap_setting(state: State, k: int) -> None:
    """Swap setting `k` with the setting of the study, so that neither is lost."""
    present = list(compared_settings(state))
    present[0], present[k] = present[k], present[0]
    state.change(parameters=present[0])
    if k:
        state.change_compare(others=tuple(present[1:]))


def setting_names(settings: Sequence[object], beside: Beside) -> tuple[str, ...]:
    """Return the names of settings and, after them, of a two-point simulation beside them."""
    letters = LETTERS[: len(settings)]
    return (*letters, TWO_POINT) if beside == TWO_POINT else letters


def key_of(state: State) -> tuple:
    """Return a key of the page's inputs; two comparisons with equal keys look equal."""
    c, beside = state.choices, state.compare.beside
    return (
        *study_key(c),
        c.seed,
        c.image.names,
        n_per_setting(state),
        compared_settings(state),
        getattr(beside, "digest", beside),
    )


def n_per_setting(state: State) -> int:
    """Return the number of realizations per setting; volumes have a smaller default than maps."""
    usual = N_USUAL_VOLUME if state.grid.is_volume else N_USUAL
    return state.compare.n or usual


def second_trial(state: State) -> Trial | None:
    """Return setting A with the second image, or None without one; raise if facies differ."""
    beside, c = state.compare.beside, state.choices
    if not isinstance(beside, ImageChoice):
        return None
    image, codes = image_of(beside), image_of(c.image).codes
    if not np.array_equal(image.codes, codes):
        raise CCWSIMError(
            f"{image_name(beside)} has the facies {listing(map(str, image.codes))}, and the "
            f"training image of the study has {listing(map(str, codes))}. Choose an image with the "
            "same facies."
        )
    (trial,) = trials_of(c, [fitted(compared_settings(state)[0], image.shape)])
    return replace(trial, training_image=image)


def both_images(first: Ensemble, second: Ensemble) -> Ensemble:
    """Return the realizations of two ensembles with equal facies as one ensemble."""
    names = ("indices", "cpu_seconds", "data_status", "numbers")
    pairs = {name: (getattr(first, name), getattr(second, name)) for name in names}
    return replace(first, **{name: readonly(np.concatenate(pair)) for name, pair in pairs.items()})


def start_comparison(state: State) -> None:
    """Start comparing the current settings; a running comparison is stopped."""
    page_state = state.page(ComparePageState)

    def make() -> ComparisonRun:
        run = ComparisonRun(
            trials=trials_of(state.choices, compared_settings(state)),
            n_realizations=n_per_setting(state),
            key=key_of(state),
            beside=state.compare.beside,
            second=second_trial(state),
            **shown_in(state),
        )
        page_state.earlier = page_state.kept_run
        if page_state.run is not None:
            page_state.run.stop()
            page_state.run = None
        return run

    page_state.start(make)


def want_curves(state: State) -> None:
    """Start computing the curves of the chosen facies if the comparison lacks these curves."""
    page_state = state.page(ComparePageState)
    shown_run = page_state.shown_run
    if page_state.going or shown_run is None:
        return
    latest = shown_run.latest_result
    if latest is None or has_curves(latest, state.facies):
        return
    page_state.earlier, page_state.run = (
        shown_run,
        replace(shown_run, base=latest, rows=[latest], facies=state.facies, second=None).start(),
    )


def has_curves(compared: comparison.Comparison, facies: int) -> bool:
    """Return whether the comparison contains the curves of a facies."""
    code = compared_code(compared, facies)
    return any(key[0] == code for key in compared.curves)


def compared_code(compared: comparison.Comparison, facies: int) -> int:
    """Return the code of a facies by its index."""
    return int(compared.first.training_image.codes[facies])
