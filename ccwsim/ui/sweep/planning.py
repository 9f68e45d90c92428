"""The settings of a sweep, the run of the sweep on a thread, and the state of the page."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ccwsim import CCWSIMError, Parameters
from ccwsim.experiments.plan import ALONG_Z, SweepPlan, plan_sweep
from ccwsim.experiments.timing import expected_seconds
from ccwsim.experiments.trials import Trial, TrialResult
from ccwsim.jobs.limits import Demand, limits_of_environment
from ccwsim.model import MAX_TEMPLATE, METHODS, describe_shape, fitted, levels
from ccwsim.sharing.choices import Choices
from ccwsim.ui.results.maps import pretty
from ccwsim.ui.session import RunState, State, cached, data_of, image_of
from ccwsim.ui.study.trials import (
    SweepRun,
    describe_work,
    ranges_around,
    shown_in,
    study_key,
    trials_of,
)
from ccwsim.ui.widgets import if_possible, page_labels, problem_in

REDRAW_SECONDS = 1.5  # minimum number of seconds between two redraws that show new settings
MAX_SWEPT = 64  # maximum number of settings in one sweep
TEMPLATES = (8, 12, 16, 24, 32, 40, 48, 64, 96, 128, 192, 256)
OVERLAPS = (2, 4, 6, 8, 12, 16, 24, 32, 48, 64)
CANDIDATES = (1, 5, 10, 20, 50, 100)
SEARCH_FRACTIONS = (0.01, 0.05, 0.1, 0.25, 0.5, 1.0)
RANGE_LABELS = page_labels("ranges_of_sweep")
_planned = cached(max_entries=16)(plan_sweep)


@dataclass
class SweepState(RunState[SweepRun]):
    """The state of the page.

    `chosen` is the number of the setting shown large (None for the recommended setting), and
    `shown` is the index of its realization.
    """

    chosen: int | None = None
    shown: int = 0


def values_on_offer(choices: Choices) -> dict[str, list[Any]]:
    """Return the values that each range offers: common values and those of the suggested range."""
    image = image_of(choices.image)
    shape, suggested = image.shape, ranges_around(choices.parameters, image)
    usual: dict[str, Sequence[Any]] = {"n_candidates": CANDIDATES, "method": METHODS}
    if _n_data(choices) != 0:
        usual["search_fraction"] = SEARCH_FRACTIONS
    for end, side in (("", min(shape[-2:])), (ALONG_Z, shape[0])):
        longest = min(side, MAX_TEMPLATE)
        usual |= {
            "template_size" + end: [t for t in TEMPLATES if t <= longest],
            "wavelet_level" + end: levels(shape, along_z=bool(end)),
            "overlap_size" + end: [o for o in OVERLAPS if o <= longest // 2],
        }
    # only volumes have suggested ranges along z; methods have their usual order
    return {
        name: [*METHODS] if name == "method" else sorted({*usual[name], *suggested[name]})
        for name in RANGE_LABELS
        if name in usual and name in suggested
    }


def ranges_of(state: State) -> dict[str, list[Any]]:
    """Return the ranges that the user chose; other parameters get their suggested range."""
    choices, chosen = state.choices, dict(state.sweep.ranges)
    suited, ranges = ranges_around(choices.parameters, image_of(choices.image)), {}
    for name, values in values_on_offer(choices).items():
        kept = [value for value in chosen.get(name, suited[name]) if value in values]
        is_empty = chosen.get(name) == ()  # no value is a choice, too
        ranges[name] = kept if kept or is_empty else suited[name]
    return ranges


def plan_of(state: State) -> SweepPlan:
    """Return all settings in the chosen ranges, rounded; raise an error if a range is empty."""
    shape = state.image.shape
    # pills return values in the order of clicks; methods are sorted in the usual order
    ranges = {
        name: values if name == "method" else sorted(values)
        for name, values in ranges_of(state).items()
    }
    return _planned(fitted(state.choices.parameters, shape), ranges, shape)


def seconds_of(state: State, plan: SweepPlan) -> float:
    """Return the expected seconds of a plan, scaled by the speed of the latest run."""
    trials, measured, e = trials_of(state.choices, plan), [], state.ensemble
    if e is not None and not e.is_stored:
        ran = Trial(e.training_image, e.grid, e.parameters, e.hard_data, secondary=e.secondary)
        measured = [TrialResult(ran, e.cpu_seconds, e.n_mismatched)]
    return expected_seconds(trials, state.sweep.n_realizations, measured, judged=True)


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
    """Describe a plan: number of settings, duration, and the number of repetitions."""
    text = describe_work(len(plan), state.sweep.n_realizations, seconds_of(state, plan))
    if plan.n_equal:
        text += f"\n{plan.n_equal} omitted: rounded to their level, they equal others."
    return text


def sweep_problem(state: State) -> str:
    """Return the reason why a sweep cannot start, or an empty text."""
    for name, values in ranges_of(state).items():
        if not values:
            return f"{RANGE_LABELS[name].split(' ')[0]} has no value to try: give at least one."

    def check() -> None:
        data, n = data_of(state.choices), len(plan_of(state))
        if n > MAX_SWEPT:
            raise CCWSIMError(f"{n} settings, but a sweep tries at most {MAX_SWEPT}: choose fewer.")
        n_cells = n * state.sweep.n_realizations * state.grid.n_cells
        limits_of_environment().check(Demand(n_cells, data.n))

    return problem_in(check)


def start_sweep(state: State) -> None:
    """Start the planned sweep, which replaces the earlier sweep."""
    page_state = state.page(SweepState)
    if sweep_problem(state):
        return

    def make() -> SweepRun:
        return SweepRun(
            trials=trials_of(state.choices, plan_of(state)),
            n_realizations=state.sweep.n_realizations,
            key=study_key(state.choices),
            **shown_in(state),
        )

    if page_state.start(make):
        page_state.chosen, page_state.shown = None, 0


def use_swept_setting(state: State, parameters: Parameters) -> None:
    """Apply a setting to the study, with the nearest values that the training image allows."""
    state.change(parameters=fitted(parameters, state.image.shape))


def _n_data(choices: Choices) -> int | None:
    """Return the number of hard data, or None if the data do not fit the study."""
    return if_possible(lambda: data_of(choices).n)
