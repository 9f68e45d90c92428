"""The settings of a sweep, the run of the sweep on a thread, and the state of the page."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from ccwsim import CCWSIMError, Ensemble, Parameters
from ccwsim.experiments.plan import ALONG_Z, SweepPlan, plan_sweep, value_of
from ccwsim.experiments.sweep import Sweep, SweepRow, sweep
from ccwsim.experiments.timing import PER_JUDGED_CELL, typical
from ccwsim.experiments.trials import Trial
from ccwsim.jobs.job import Job
from ccwsim.jobs.limits import Demand, limits_of_environment
from ccwsim.model.arrays import describe_shape
from ccwsim.model.bounds import MAX_TEMPLATE, MIN_TEMPLATE
from ccwsim.model.parameters import METHODS, fitted
from ccwsim.model.sizes import levels
from ccwsim.sharing.choices import Choices
from ccwsim.ui.results.maps import pretty
from ccwsim.ui.session.resolve import data_of, image_of
from ccwsim.ui.session.state import RunState, State
from ccwsim.ui.study.trials import TrialsRun, describe_work, shown_in, study_key, trial_of
from ccwsim.ui.widgets.errors import if_possible, problem_in
from ccwsim.ui.widgets.text import page_labels

CELLS_KEPT = 64_000_000
"""Maximum number of cells of the realizations that a sweep stores; a cell takes one byte."""
SOURCE_BYTES = 4  # number of bytes per cell that store the source of the cell in the training image
MAX_KEPT = 4
REDRAW_SECONDS = 1.5  # minimum number of seconds between two redraws that show new settings
MAX_SWEPT = 64  # maximum number of settings in one sweep
TEMPLATES = (8, 12, 16, 24, 32, 40, 48, 64, 96, 128, 192, 256)
OVERLAPS = (2, 4, 6, 8, 12, 16, 24, 32, 48, 64)
CANDIDATES = (1, 5, 10, 20, 50, 100)
FRACTIONS = (0.01, 0.05, 0.1, 0.25, 0.5, 1.0)
DEFAULT_LEVELS = (1, 2, 3)
LABELS = page_labels("ranges_of_sweep")


@dataclass(kw_only=True)
class SweepRun(TrialsRun[SweepRow, Sweep]):
    """A sweep with its finished rows, and pictures `tiles` of the rows drawn so far."""

    tiles: list[bytes] = field(default_factory=list)

    def demand(self) -> Demand:
        """Return the resources that the sweep needs for one setting and the stored realizations."""
        largest = max((demand.n_bytes for demand in self.demands(n_workers=1)), default=0)
        cells_per_realization = self.first.grid.n_cells
        n_cells = cells_per_realization * len(self.trials)
        kept = max(CELLS_KEPT, n_cells)  # at least one realization is stored
        sources = SOURCE_BYTES * cells_per_realization * self.n_realizations
        return Demand(n_cells * self.n_realizations, self.first.n_data, largest + sources + kept)

    def work(self, job: Job[Sweep]) -> Sweep:
        first = self.first
        n_kept = CELLS_KEPT // (first.grid.n_cells * len(self.trials))
        return sweep(
            first.training_image,
            first.grid,
            settings=[trial.parameters for trial in self.trials],
            hard_data=first.hard_data,
            n_realizations=self.n_realizations,
            seed=first.seed,
            progress=job.report,
            cancel=job.is_cancelled,
            found=self.rows.append,
            n_kept=min(max(n_kept, 1), MAX_KEPT),
            facies=int(first.training_image.codes[self.facies]),
            secondary=first.secondary,
        )

    @property
    def latest_result(self) -> Sweep:
        """The results of the settings that are finished."""
        shape = self.training_image.shape
        return self.result or Sweep(tuple(self.rows), (), len(self.trials), shape)

    def describe_end(self) -> str:
        """Describe settings without results in an ended sweep; empty if all have results."""
        if self.going or self.error is not None:
            return super().describe_end()
        results = self.latest_result
        sentences = [self.describe_stop()] if results.stopped else []
        if results.failed:
            n = len(results.failed)
            sentences.append(f"{n} could not be simulated: {results.failed[0][1]}.")
        return " ".join(sentences)


@dataclass
class SweepState(RunState[SweepRun]):
    """The state of the page.

    `ranges` contains the ranges that the user chose, by parameter; other ranges depend on the
    study. `error` names the error that the chart shows. `chosen` is the number of the setting shown
    large (None for the recommended setting), and `shown` is the index of its realization.
    """

    ranges: dict[str, list[Any]] = field(default_factory=dict)
    n_realizations: int = 4
    error: str = "patterns"  # name of one of the `ERRORS`
    chosen: int | None = None
    shown: int = 0


def values_on_offer(choices: Choices) -> dict[str, list[Any]]:
    """Return the values that each range offers: common values and the value of the study."""
    shape = image_of(choices.image).shape
    p = fitted(choices.parameters, shape)
    offered: dict[str, list[Any]] = {}
    for end, side in (("", min(shape[-2:])), *([(ALONG_Z, shape[0])] if len(shape) == 3 else [])):
        longest = min(side, MAX_TEMPLATE)
        usual = {
            "template_size": [t for t in TEMPLATES if t <= longest],
            "wavelet_level": levels(shape, along_z=bool(end)),
            "overlap_size": [o for o in OVERLAPS if o <= longest // 2],
        }
        offered |= {
            name + end: _with(usual_values, value_of(p, name + end))
            for name, usual_values in usual.items()
        }
    offered = {name: offered[name] for name in LABELS if name in offered}  # ordered as in `LABELS`
    offered |= {"n_candidates": _with(CANDIDATES, p.n_candidates), "method": list(METHODS)}
    if _n_data(choices) != 0:
        offered["search_fraction"] = _with(FRACTIONS, p.search_fraction)
    return offered


def ranges_of(state: State) -> dict[str, list[Any]]:
    """Return the ranges that the user chose; other parameters get their suggested range."""
    offered = values_on_offer(state.choices)
    suited = suited_ranges(state.choices)
    ranges = {}
    for name, values in offered.items():
        chosen = state.page(SweepState).ranges.get(name)
        kept = None if chosen is None else [value for value in chosen if value in values]
        ranges[name] = suited[name] if kept is None or (chosen and not kept) else kept
    return ranges


def suited_ranges(choices: Choices) -> dict[str, list[Any]]:
    """Return suggested ranges: the values of the study, and nearby templates and levels."""
    shape = image_of(choices.image).shape
    p, offered = fitted(choices.parameters, shape), values_on_offer(choices)
    suited = {name: [value_of(p, name)] for name in LABELS if value_of(p, name) is not None}
    size, own_level = value_of(p, "template_size"), value_of(p, "wavelet_level")
    near = (size // 2, size, size * 3 // 2)
    templates = [t for t in near if t >= MIN_TEMPLATE and t in offered["template_size"]]
    tried = [level for level in levels(shape) if level in DEFAULT_LEVELS]
    if len(shape) == 3:  # volumes take longer, so try fewer settings; levels along z are separate
        templates, tried = templates[:2], [k for k in tried if k <= own_level]
        along_z = [k for k in offered["wavelet_level_z"] if k <= suited["wavelet_level_z"][0]]
        suited["wavelet_level_z"] = along_z or suited["wavelet_level_z"]
    suited["template_size"] = templates or [size]
    if p.method != "ccsim":
        suited["wavelet_level"] = tried or [own_level]
    return suited


def plan_of(state: State) -> SweepPlan:
    """Return the plan of all settings in the chosen ranges; raise an error if a range is empty."""
    shape = image_of(state.choices.image).shape
    # pills return values in the order of clicks; methods are sorted in the usual order
    ranges = {
        name: values if name == "method" else sorted(values)
        for name, values in ranges_of(state).items()
    }
    return plan_sweep(fitted(state.choices.parameters, shape), ranges, shape)


def trials_of(state: State, plan: SweepPlan) -> list[Trial]:
    """Return the study with each setting of a plan."""
    study_trial = trial_of(state.choices)
    return [replace(study_trial, parameters=parameters) for parameters in plan]


def seconds_of(state: State, plan: SweepPlan) -> float:
    """Return the expected seconds of a plan, scaled by the speed of the latest run."""
    each = sum(typical(trial, judged=True) for trial in trials_of(state, plan))
    return each * state.page(SweepState).n_realizations * pace(state.ensemble)


def pace(ensemble: Ensemble | None) -> float:
    """Return the ratio of actual to expected time of an ensemble, or 1 without an ensemble."""
    if ensemble is None:
        return 1.0
    e = ensemble
    expected = typical(Trial(e.training_image, e.grid, e.parameters, e.hard_data), judged=True)
    took = float(e.cpu_seconds.mean()) + e.grid.n_cells * PER_JUDGED_CELL
    return min(max(took / expected, 0.3), 10.0)


def describe_study(state: State) -> str:
    """Describe the study for which settings are compared."""
    choices = state.choices
    image = image_of(choices.image)
    data_text = "hard data that do not fit"
    if (n := _n_data(choices)) is not None:
        data_text = f"{n} hard data" if n else "no hard data"
    return (
        f"{pretty(image.name)}, {describe_shape(image.shape)}, {image.n_facies} facies\n"
        f"{data_text}, grid {describe_shape(choices.grid.shape)}, seed {choices.seed}"
    )


def describe_plan(state: State, plan: SweepPlan) -> str:
    """Describe a plan: number of settings, duration, and the reason why settings are omitted."""
    text = describe_work(len(plan), state.page(SweepState).n_realizations, seconds_of(state, plan))
    if plan.left_out:
        n = len(plan.left_out)
        text += f"\n{n} omitted: {plan.left_out[0][1]}" + (" …" if n > 1 else ".")
    if plan.n_equal:
        text += f"\n{plan.n_equal} omitted because CCSIM has no level."
    return text


def problem_of(state: State) -> str:
    """Return the reason why a sweep cannot start, or an empty text."""
    try:
        data, plan = data_of(state.choices), plan_of(state)
    except CCWSIMError as error:
        text = str(error)
        for name, label in LABELS.items():
            text = text.replace(f"{name} has no value", f"{label.split(' ')[0]} has no value")
        return text
    if not len(plan):
        return f"No combination of the values is valid. {plan.left_out[0][1]}."
    if len(plan) > MAX_SWEPT:
        return f"{len(plan)} settings, but a sweep tries at most {MAX_SWEPT}: choose fewer values."
    n_cells = len(plan) * state.page(SweepState).n_realizations * state.choices.grid.n_cells
    return problem_in(lambda: limits_of_environment().check(Demand(n_cells, data.n)))


def start(state: State) -> None:
    """Start the planned sweep, which replaces the earlier sweep."""
    page_state = state.page(SweepState)
    if problem_of(state):
        return

    def make() -> SweepRun:
        return SweepRun(
            trials=trials_of(state, plan_of(state)),
            n_realizations=page_state.n_realizations,
            key=study_key(state.choices),
            **shown_in(state),
        )

    if page_state.start(make):
        page_state.chosen, page_state.shown = None, 0


def use_setting(state: State, parameters: Parameters) -> None:
    """Apply a setting to the study, with the nearest values that the training image allows."""
    state.change(parameters=fitted(parameters, image_of(state.choices.image).shape))


def _n_data(choices: Choices) -> int | None:
    """Return the number of hard data, or None if the data do not fit the study."""
    return if_possible(lambda: data_of(choices).n)


def _with(values: Sequence[Any], study_value: Any) -> list[Any]:
    return sorted({*values, study_value})
