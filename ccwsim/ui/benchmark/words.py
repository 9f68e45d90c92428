"""What the measured times say, in words, and what they cannot say."""

from __future__ import annotations

from collections.abc import Sequence

from ccwsim.experiments.timing import Timing, growth
from ccwsim.model.errors import Cancelled
from ccwsim.model.parameters import Parameters
from ccwsim.paper import published_times as published
from ccwsim.ui.benchmark.run import TimingRun
from ccwsim.ui.results.facies import pretty
from ccwsim.ui.study.run import failed
from ccwsim.ui.widgets.facts import three_digits

NAMES = {"ccwsim": "CCWSIM", "ccsim": "CCSIM", "ms-ccsim": "MS-CCSIM"}
TEACHING = (
    "Press Measure: a line for each level will show how the time of one realization grows with "
    "the grid. Straight at slope one, and flat in the time a cell, is linear growth. The red "
    "markers are the paper's times, on another machine."
)
WHAT_CAN_BE_COMPARED = (
    "The paper's times are of MATLAB on its authors' machine, the times here are of compiled "
    "kernels on this one. Seconds of one cannot be set against seconds of the other, and no "
    "speed-up follows from them. What can be compared are ratios within one machine: of two "
    "levels, of two methods, of two numbers of data, and whether time grows with the cells."
)
DISTURBED = (
    "Others were computing on this server at the same time: CPU times are longer than they would "
    "be on a quiet machine. Measure again when it is."
)
TABLE_2_NOTE = (
    "wrong: data that a realization does not honour, here. paper: Table 2, channel training "
    "image, 512 × 512 cells, MATLAB on another machine; compare the last two columns. Here both "
    "methods are this program's own and compiled alike, and both re-simulate locally until the "
    "data are honoured, unless the study turns that off."
)
Setting = tuple[str, int]
"""Method and level."""


def by_setting(timings: Sequence[Timing]) -> dict[Setting, list[Timing]]:
    """Return the times of each method and level, in the order they came."""
    found: dict[Setting, list[Timing]] = {}
    for timing in timings:
        found.setdefault(setting_of(timing.parameters), []).append(timing)
    return found


def setting_of(p: Parameters) -> Setting:
    """Return the method and level of parameters."""
    return p.method, p.level


def name_of(setting: Setting, settings: Sequence[Setting]) -> str:
    """Return what a setting is called among others: the method only where there are several.

    Examples
    --------
    >>> name_of(("ccwsim", 2), [("ccwsim", 1), ("ccwsim", 2)])
    'level 2'
    """
    method, level = setting
    several = len({method for method, _ in settings}) > 1
    return f"{NAMES.get(method, method)} level {level}" if several else f"level {level}"


def describe_growth(name: str, timings: Sequence[Timing]) -> str:
    """Return how the time of a setting grows with the cells; empty for a single size.

    Examples
    --------
    >>> import numpy as np
    >>> took = [Timing(Parameters(), (n, n), 0, np.array([1e-7 * n * n]), np.zeros(1, int))
    ...         for n in (256, 512)]
    >>> describe_growth("level 2", took)
    'Level 2: 0.1 µs a cell from 256² to 512²: linear (cells to the power 1.00).'
    """
    if len({t.n_cells for t in timings}) < 2:
        return ""
    found = growth(timings)
    low, high = (f(round(t.n_cells**0.5) for t in timings) for f in (min, max))
    how, why = "linear", ""
    if not found.linear:
        how = "more than linear" if found.exponent > 1 else "less than linear"
    if found.exponent < 1 and not found.linear:
        why = ": preparing the training image weighs more on small grids"
    return (
        f"{name[:1].upper()}{name[1:]}: {three_digits(found.seconds_per_million)} µs a cell from "
        f"{low}² to {high}²: {how} (cells to the power {found.exponent:.2f}){why}."
    )


def describe_levels(timings: Sequence[Timing]) -> str:
    """Return what the finest wavelet level costs against the coarsest, here and in the paper."""
    paper = {t.level: t.cpu_seconds or 0.0 for t in published.FIGURE_13}
    own = {t.parameters.level: t for t in timings if t.parameters.method == "ccwsim"}
    sides = {level: t for level, t in own.items() if level in paper}
    if len(sides) < 2:
        return ""
    low, high = min(sides), max(sides)
    if sides[low].n_cells != sides[high].n_cells:
        return ""
    ratio = sides[low].seconds / sides[high].seconds
    return (
        f"Level {low} takes {ratio:.1f} times as long as level {high} at "
        f"{round(sides[low].n_cells ** 0.5)}² here, {paper[low] / paper[high]:.1f} times at 25 "
        "million cells in the paper."
    )


def describe_plan(n_cases: int, n_realizations: int, seconds: float) -> str:
    """Return what a run will do and about how long it will take.

    Examples
    --------
    >>> describe_plan(12, 3, 4.2)
    '12 settings × 3 realizations on one thread: about 4 s.'
    """
    each = "realization" if n_realizations == 1 else "realizations"
    return f"{n_cases} settings × {n_realizations} {each} on one thread: {about(seconds)}."


def about(seconds: float) -> str:
    """Return a rough time.

    Examples
    --------
    >>> about(0.2), about(34.0), about(400.0)
    ('about 1 s', 'about 34 s', 'about 7 min')
    """
    if seconds < 100:
        return f"about {max(round(seconds), 1)} s"
    return f"about {round(seconds / 60)} min"


def why_ended(run: TimingRun) -> str:
    """Return why a run ended early, or an empty text."""
    error = run.job.error if run.job else None
    if isinstance(error, Cancelled):
        n = len(run.timings)
        kept = "; these are shown." if n else ": nothing was measured."
        return f"Stopped after {n} of {len(run.cases)} settings{kept}"
    return failed(error) if error else ""


def describe_run(run: TimingRun | None) -> str:
    """Return what was timed."""
    if run is None:
        return ""
    image, p = run.training_image, run.cases[0].parameters
    ny, nx = image.shape
    off = "" if p.exact_data else "; data condition the search only, wrong ones are not corrected"
    return (
        f"Training image {pretty(image.name)}, {nx} × {ny} cells, {image.n_facies} facies; "
        f"template {p.template_size}, overlap {p.overlap_size}, K {p.n_candidates}; median of "
        f"{run.n_realizations}, preparation of the training image included; one thread; seed "
        f"{run.seed}{off}."
    )


def progress_label(run: TimingRun) -> str:
    """Return how many settings are timed, and which one is now."""
    n = len(run.timings)
    text = f"{n} of {len(run.cases)} settings"
    if n < len(run.cases):
        case = run.cases[n]
        data = f", {case.n_data} data" if case.n_data else ""
        text += f" · now {case.grid_shape[0]}², level {case.parameters.level}{data}"
    return text
