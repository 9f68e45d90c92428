"""Parameter sweeps, which simulate, judge and compare many settings of one study."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from math import prod
from typing import Any

import numpy as np

from ccwsim import Cancelled, CCWSIMError, Grid, Parameters, Secondary, TrainingImage
from ccwsim.experiments.plan import label, varied
from ccwsim.experiments.timing import typical
from ccwsim.experiments.trials import Trial, TrialResult, run_trials
from ccwsim.metrics import Quality, judge
from ccwsim.metrics.diagnosis import MIN_ACROSS, resolving_levels, templates_that_fit
from ccwsim.model import (
    ArrayLike,
    Cancel,
    Floats,
    Integers,
    Ints,
    Progress,
    Shape,
    Watch,
    check_int,
    duration,
    frozen,
    read_toml,
)

_SENTENCES = read_toml("experiments/sweep.toml")
SWEEP_ERRORS = {
    "patterns": lambda quality: quality.pattern_distance,
    "connection": lambda quality: quality.tau_error,
    "proportions": lambda quality: abs(quality.proportion_error),
    "copying": lambda quality: quality.largest_copied,
    "mended": lambda quality: quality.n_resimulated + quality.n_forced,
}
"""Functions that return an error of a setting, given its `Quality`; a smaller error is better."""
SPREADS = {
    "patterns": lambda quality: quality.pattern_spread,
    "connection": lambda quality: quality.tau_spread,
    "proportions": lambda quality: quality.proportion_spread,
    "copying": lambda quality: quality.copied_spread,
}
"""Functions that return the standard deviation of an error over realizations."""
TOLERANCES = {"proportions": 0.1, "patterns": 0.1, "connection": 0.03}
"""Differences that count as equal, in order of comparison; patterns are relative to the least."""
MAX_COPIED = 4  # largest copied piece in templates; 5 to 13 are usual for K = 1, 3 for K = 5
MAX_NAMED = 4  # maximum number of settings that a sentence names
DOUBT = 2.0  # two settings are different if they differ by at least these standard errors


@dataclass(frozen=True, eq=False)
class SweepRow(TrialResult):
    """One setting of a sweep, with the setting's result."""

    quality: Quality
    # facies codes, shape (n_kept, ny, nx) or (n_kept, nz, ny, nx)
    realizations: Integers


@dataclass(frozen=True, eq=False)
class Sweep:
    """The result of a sweep."""

    rows: tuple[SweepRow, ...]  # the finished settings, in the order of `settings`
    failed: tuple[tuple[Parameters, str], ...]  # settings that failed, with the reason
    n_asked: int  # number of settings requested
    image_shape: Shape

    @property
    def stopped(self) -> bool:
        """Whether the sweep was cancelled before all settings were finished."""
        return len(self.rows) + len(self.failed) < self.n_asked

    @property
    def times(self) -> Floats:
        """Mean CPU seconds of a realization of each setting."""
        return np.array([row.quality.cpu_seconds for row in self.rows])

    def errors(self, kind: str = "patterns") -> Floats:
        """Return the error `kind` (a key of `SWEEP_ERRORS`) of each setting."""
        return np.array([SWEEP_ERRORS[kind](row.quality) for row in self.rows], dtype=float)

    def spreads(self, kind: str) -> Floats:
        """Return the spread of the error `kind` of each setting; NaN if unknown."""
        spread = SPREADS.get(kind, lambda _: np.nan)
        return np.array([spread(row.quality) for row in self.rows], dtype=float)

    def alike(self, kind: str, among: Ints, tolerance: float) -> Ints:
        """Return the settings whose error is the smallest up to `tolerance` or `DOUBT` errors."""
        n = np.array([row.quality.n for row in self.rows])
        errors, doubts = self.errors(kind), np.nan_to_num(self.spreads(kind)) / np.sqrt(n)
        valid = among[~np.isnan(errors[among])]
        if not len(valid):
            return among
        best = valid[np.argmin(errors[valid])]
        apart = DOUBT * np.hypot(doubts[valid], doubts[best])
        return valid[errors[valid] <= errors[best] + np.maximum(tolerance, apart)]


def sweep(
    training_image: TrainingImage | ArrayLike,
    grid_shape: Shape | Grid,
    settings: Sequence[Parameters],
    hard_data: Any = None,
    n_realizations: int = 4,
    seed: int = 0,
    progress: Progress | None = None,
    cancel: Cancel | None = None,
    found: Callable[[SweepRow], None] | None = None,
    n_kept: int = 2,
    facies: int | str | None = None,
    secondary: Secondary | None = None,
) -> Sweep:
    """Simulate and judge each setting with the same seed, on one thread for comparable times.

    Settings, such as the result of `plan_sweep`, are simulated as by `simulate`. If `cancel`
    returns True, the sweep stops and returns the finished settings. Raises `CCWSIMError` if there
    is no setting, or the training image lacks the facies.

    `progress` is called with the fraction of the expected time and the number of finished settings,
    and `found` with each finished `SweepRow`, which stores `n_kept` realizations. `facies` is the
    code of the facies whose connectivity is judged; by default the last.

    Examples
    --------
    >>> stripes = TrainingImage(np.tile([[0], [0], [1], [1]], (16, 64)))
    >>> tried = [Parameters(8, 2, 1), Parameters(16, 4, 1)]
    >>> sweep(stripes, (40, 50), tried, n_realizations=2).errors().shape
    (2,)
    """
    if not len(settings):
        raise CCWSIMError("there is no setting to try: give ranges with a valid combination")
    n = check_int("n_realizations", n_realizations, 1)
    base = Trial.of(training_image, grid_shape, None, hard_data, seed=seed, secondary=secondary)
    trials = [replace(base, parameters=parameters) for parameters in settings]
    if facies is not None:
        facies = base.training_image.code_of(facies)

    def tried(trial: Trial, part: Watch) -> SweepRow | str:
        """Return the result of a setting, or the reason why it has none."""
        try:
            ensemble = trial.simulate(
                n,
                n_workers=1,
                keep_sources=True,
                progress=part.progress,
                cancel=part.cancel,
            )
            return SweepRow(
                trial,
                ensemble.cpu_seconds,
                ensemble.n_mismatched,
                quality=judge(ensemble, facies),
                realizations=frozen(ensemble.realizations[: max(n_kept, 1)]),  # frees the others
            )
        except Cancelled:
            raise
        except CCWSIMError as error:
            return str(error)

    seconds = [typical(trial, judged=True) for trial in trials]
    rows: list[SweepRow] = []
    failed: list[tuple[Parameters, str]] = []
    with suppress(Cancelled):
        outcomes = run_trials(trials, tried, seconds, Watch(progress, cancel))
        for parameters, outcome in zip(settings, outcomes, strict=True):
            if isinstance(outcome, str):
                failed.append((parameters, outcome))
                continue
            rows.append(outcome)
            if found:
                found(outcome)
    return Sweep(tuple(rows), tuple(failed), len(settings), base.training_image.shape)


@dataclass(frozen=True)
class Recommendation:
    """The setting that a sweep recommends."""

    index: int  # index of the recommended row of the sweep
    reason: str  # reason, as a sentence
    # equally good rows, including `best`, the fastest
    alike: tuple[int, ...] = ()


def pareto_front(times: ArrayLike, errors: ArrayLike) -> Ints:
    """Return the indices of the points on the Pareto front, which no other point beats."""
    t, e = np.asarray(times, dtype=float), np.asarray(errors, dtype=float)
    if t.shape != e.shape or t.ndim != 1:
        raise CCWSIMError(f"{t.size} times and {e.size} errors: give one pair per setting")
    at_least_equal = np.less_equal.outer(t, t) & np.less_equal.outer(e, e)
    better_in_one = np.less.outer(t, t) | np.less.outer(e, e)
    beaten = np.any(at_least_equal & better_in_one, axis=0)
    order = np.lexsort((e, t))
    return order[~beaten[order] & np.isfinite((t + e)[order])]


def recommended(sweep: Sweep) -> Recommendation:
    """Return the fastest of the settings that are about as good as the best setting.

    Settings are excluded in this order if they miss more data than others; if their blocks are
    larger than the thinnest facies of the image is thick (`resolving_levels`); if their template is
    too large for the image; if they copy pieces larger than four templates; if they are worse than
    the best by `TOLERANCES` and by two standard errors, which are computed from the spread between
    realizations. Raises `CCWSIMError` if no setting is finished.
    """
    among, why = _admissible(sweep)
    for kind, tolerance in TOLERANCES.items():
        if kind == "patterns":
            tolerance *= sweep.errors("patterns")[among].min()
        good = sweep.alike(kind, among, tolerance)
        if len(good) < len(among):
            why.append(_left_behind(sweep, kind, good, np.setdiff1d(among, good)))
        among = good
    among = among[np.argsort(sweep.times[among], kind="stable")]
    first = _first_reason(sweep, among.tolist())
    return Recommendation(int(among[0]), " ".join([first, *why]), tuple(among.tolist()))


def nearest_on_front(sweep: Sweep, n: int = 3) -> list[int]:
    """Return the settings on the Pareto front that are nearest to the recommended, fastest first.

    The front is that of time and pattern distance, without settings that `recommended` excludes for
    data, level, template or copies. Distances are those of logarithms of time and pattern distance.
    """
    among, _ = _admissible(sweep)
    front = among[pareto_front(sweep.times[among], sweep.errors()[among])]
    logs = np.log(np.maximum([sweep.times, sweep.errors()], 1e-9))
    apart = np.hypot(*(logs[:, front] - logs[:, [recommended(sweep).index]]))
    nearest = front[np.argsort(apart, kind="stable")[:n]]
    return nearest[np.argsort(sweep.times[nearest], kind="stable")].tolist()


def _admissible(sweep: Sweep) -> tuple[Ints, list[str]]:
    """Return the settings that no rule excludes, and sentences on the others."""
    if not sweep.rows:
        raise CCWSIMError("no setting is finished yet: wait for the sweep")
    wrong = np.array([row.quality.n_mismatched for row in sweep.rows])
    among = np.flatnonzero(wrong == wrong.min())
    why = ["No setting honours all data."] if wrong.min() > 0 else []
    shape, tried = sweep.image_shape, [row.parameters for row in sweep.rows]
    levels = np.array([p.along(shape).level for p in tried])
    n_fit = np.array([templates_that_fit(shape, p.template_size) for p in tried])
    allowed = np.array([MAX_COPIED * prod(p.along(shape).template) for p in tried])
    copied = sweep.errors("copying")
    excluded = {
        "coarse": (levels > resolving_levels(sweep.rows[0].trial.training_image)).any(axis=1),
        "large": n_fit < MIN_ACROSS**2,
        "copies": copied > allowed,  # False for NaN
    }
    for rule, mask in excluded.items():
        kept, out = among[~mask[among]], among[mask[among]]
        if not len(out):
            continue
        form = "all"
        if len(kept):
            among, form = kept, "one" if len(out) == 1 else "several"
        elif rule == "copies":
            among = out = out[[np.argmin((copied / allowed)[out])]]
        cells = f"{copied[out].max():,.0f}".replace(",", "\u202f")
        limits = {"fewest": MIN_ACROSS**2, "most": MAX_COPIED}
        why.append(_SENTENCES[rule][form].format(n=len(out), cells=cells, **limits))
    return among, why


def _left_behind(sweep: Sweep, kind: str, good: Ints, out: Ints) -> str:
    """Return a sentence that compares the excluded settings with the best setting by one error."""
    errors = sweep.errors(kind)
    best, other = np.nanmin(errors[good]), errors[out]
    defined = other[~np.isnan(other)]
    n = "1 setting is" if len(out) == 1 else f"{len(out)} settings are"
    if not len(defined):
        return f"{n} left out, because their connectivity is undefined."
    unit = 100 if kind == "proportions" else 1  # percent
    return _SENTENCES[kind].format(n=n, least=unit * defined.min(), best=unit * best)


def _first_reason(sweep: Sweep, alike: list[int]) -> str:
    """Return a sentence on the settings that are about as good as the best, the fastest first."""
    if len(sweep.rows) == 1:
        return "This is the only finished setting."
    k, n = alike[0], sweep.rows[alike[0]].quality.n
    if len(alike) == 1:
        return "No other setting is as good."
    names = varied(row.parameters for row in sweep.rows)
    labels = [label(sweep.rows[j].parameters, names) for j in alike]
    more = f" and {len(labels) - MAX_NAMED} more" if len(labels) > MAX_NAMED else ""
    rows = np.array(alike)
    same = n > 1 and all(len(sweep.alike(kind, rows, 0.0)) == len(rows) for kind in TOLERANCES)
    limits = {name: 100 * TOLERANCES[name] for name in ("patterns", "proportions")}
    alike_by = _SENTENCES["alike"].format(tau=TOLERANCES["connection"], **limits)
    are = f"cannot be told apart by {n} realizations each" if same else alike_by
    named, fastest = f"{'; '.join(labels[:MAX_NAMED])}{more}", duration(sweep.times[k])
    return f"These {are}: {named}. The fastest setting is {labels[0]}, {fastest}."
