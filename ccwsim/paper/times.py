"""Experiments on CPU time by level, grid size and number of data (section 5.6)."""

from collections.abc import Iterator, Sequence
from itertools import pairwise, product

import numpy as np

from ccwsim.experiments.plan import value_of
from ccwsim.experiments.timing import data_trials, growth, time_trials
from ccwsim.experiments.trials import Trial, TrialResult
from ccwsim.figures import LIGHT, TimeSeries, timings_chart
from ccwsim.model import Method, Variant, duration, minus
from ccwsim.paper import methods, verdicts
from ccwsim.paper.experiment import PAPER_TEXTS, ExperimentRun, Outcome, said
from ccwsim.paper.methods import AUTHORS_SETTINGS, COLUMNS, COMPARED, TITLES
from ccwsim.paper.published_times import (
    ALL_TIMES,
    FIGURE_13,
    LEVEL_CHANGES,
    TABLE_2,
    TABLE_2_DATA,
)
from ccwsim.paper.verdicts import AGREES, DIFFERENT, IN_PART, NOISE
from ccwsim.report.document import Chart, Judgement, PictureRow, Table, Text

TIMED_LEVELS = (1, 2, 3)
LEVELS_OF_TABLE_2 = (1, 3)
METHODS_OF_TABLE_2: tuple[Method, ...] = ("ms-ccsim", "ccwsim")
PAPER_SIDE = 5000
SMALLEST_TIME = 1e-6  # in seconds, for logarithmic axes
N_TIMED = 3
MAX_EXPONENT_ERROR = 0.15
"""Growth of time is called linear if the exponent differs from 1 by at most this."""
PAPER_CELLS = 512 * 512
DATA_OF_FIGURE_13 = 400  # number of data on 512 × 512 cells; the paper's number is unknown

Times = dict[tuple[str, int, Variant, int], TrialResult]
"""Times of an image by the key (method, level, variant, index in `TABLE_2_DATA`)."""
GridTimes = dict[tuple[Variant, int], list[TrialResult]]
"""Times on all grids by variant and level."""


def grid_size(run: ExperimentRun) -> Outcome:
    """Measure CPU times of conditional channel realizations on square grids, on one thread."""
    image, sides = run.inputs.image("channel"), run.extent.timed_sides
    n = min(N_TIMED, run.extent.n_timed)
    keys = [*product(COMPARED, TIMED_LEVELS)]
    settings = [methods.paper_parameters("ccwsim", level, variant) for variant, level in keys]
    trials: list[Trial] = []
    for side in sides:
        n_data = max(round(DATA_OF_FIGURE_13 * side * side / PAPER_CELLS), 1)
        trials += data_trials(image, (side, side), [n_data], settings, run.seed)
    results = list(time_trials(trials, n, run.watch.progress, run.watch.cancel))
    times: GridTimes = {key: results[k :: len(keys)] for k, key in enumerate(keys)}
    paper = {p.level: p.cpu_seconds for p in FIGURE_13}
    stated = [duration(paper[level]) for level in TIMED_LEVELS]
    rows = []
    for k, side in enumerate(sides):
        seconds = (duration(times[key][k].seconds) for key in keys)
        theirs = stated if side == PAPER_SIDE else ["–"] * len(stated)
        rows.append((f"{side} × {side}", f"{side * side:,}", *seconds, *theirs))
    if PAPER_SIDE not in sides:
        not_run = ("–" for _ in keys)
        rows.append((f"{PAPER_SIDE} × {PAPER_SIDE}", f"{PAPER_SIDE**2:,}", *not_run, *stated))
    columns = (f"{COLUMNS[variant]}, level {level}" for variant, level in keys)
    header = ("grid", "cells", *columns, *(f"the paper, level {level}" for level in TIMED_LEVELS))
    caption = said("grids", n=n, n_data=DATA_OF_FIGURE_13)
    about = said(
        "grids_chart",
        image=image.name,
        n_data=DATA_OF_FIGURE_13,
        settings=AUTHORS_SETTINGS,
        n=n,
        seed=run.seed,
    )
    blocks = (PictureRow((_grid_chart(times, sides),), about), Table(header, tuple(rows), caption))
    judgements = [j for variant in COMPARED for j in _grid_judgements(times, variant)]
    return Outcome(blocks, tuple(judgements))


def _grid_chart(times: GridTimes, sides: tuple[int, ...]) -> Chart:
    """Return the chart of the published method's times, beside the paper's."""
    results = [result for level in TIMED_LEVELS for result in times["paper", level]]
    ticks = {side**2: f"{side}²" for side in sorted({*sides, PAPER_SIDE})}
    figure = timings_chart(
        measured_series(results), paper_series(), ticks, LIGHT, x_title="cells of the grid"
    )
    title = "Fig. 13 · CPU time of a realization against the number of cells"
    legend = (
        ("as published, measured here", LIGHT.ink),
        ("the paper, another machine", LIGHT.reference),
    )
    return Chart(figure, title, title, legend)


def measured_series(results: Sequence[TrialResult], quantity: str = "n_cells") -> list[TimeSeries]:
    """Return times by level against "n_cells", "n_data" or a parameter (a name in `RANGED`)."""
    points: dict[int, list[tuple[float, float]]] = {}
    for result in results:
        trial, p = result.trial, result.parameters
        sizes = {"n_cells": trial.grid.n_cells, "n_data": trial.n_data}
        size = sizes[quantity] if quantity in sizes else value_of(p, quantity)
        seconds = max(result.seconds, SMALLEST_TIME)
        points.setdefault(value_of(p, "wavelet_level"), []).append((size, seconds))
    return [
        TimeSeries(f"level {level}", level, *np.array(points[level], float).T)
        for level in sorted(points)
    ]


def paper_series(quantity: str = "n_cells", method: str = "ccwsim") -> list[TimeSeries]:
    """Return the paper's times of channels by level, if it states times against a quantity."""
    where = {"n_cells": "Fig. 13", "n_data": "Table 2"}.get(quantity)
    series = []
    for level in TIMED_LEVELS:
        points = [
            (getattr(t, quantity), t.cpu_seconds)
            for t in ALL_TIMES
            if (t.where, t.image, t.method, t.level) == (where, "channel", method, level)
        ]
        if points:
            series.append(TimeSeries(f"paper, level {level}", level, *np.array(points, float).T))
    return series


def _grid_judgements(times: GridTimes, variant: Variant) -> Iterator[Judgement]:
    """Judge the times of a variant by level and size of the grid."""
    title = COLUMNS[variant].capitalize()
    taken = {level: [t.seconds for t in times[variant, level]] for level in TIMED_LEVELS}
    for a, b in pairwise(TIMED_LEVELS):
        yield level_change(taken, a, b, title)
    yield verdicts.judge_levels({level: each[-1] for level, each in taken.items()}, title)
    results = [result for level in TIMED_LEVELS for result in times[variant, level]]
    powers = {each.level: growth(each.sizes, each.values) for each in measured_series(results)}
    each = ", ".join(f"{power:.2f} (level {level})" for level, power in powers.items())
    worst = max(abs(power - 1) for power in powers.values())
    claim = "Fig. 13: CPU times of five grids; only the time of the largest grid is available."
    finding = f"{title}: time is proportional to the number of cells to the power {each}."
    yield verdicts.judged(claim, finding, "linear" if worst <= MAX_EXPONENT_ERROR else "not linear")
    largest = times[variant, 1][-1]
    side, seconds = largest.trial.grid.nx, largest.seconds
    if side == PAPER_SIDE:
        paper = next(p.cpu_seconds for p in FIGURE_13 if p.level == 1)
        what = f"25 million cells, level 1 ({COLUMNS[variant]})"
        yield verdicts.judge_time(what, seconds, paper, "Fig. 13")
        return
    whole = duration(25e6 / largest.trial.grid.n_cells * seconds)
    finding = said("largest", title=title, seconds=duration(seconds), side=side, whole=whole)
    yield verdicts.judged(PAPER_TEXTS["claims"]["largest"], finding, verdicts.NOT_COMPARABLE)


def level_change(taken: dict[int, list[float]], a: int, b: int, title: str) -> Judgement:
    """Judge the change of CPU time from one level to the next, averaged over the grids."""
    ours = float(np.mean(np.divide(taken[b], taken[a]))) - 1
    each = " and ".join(
        f"{_change(v)} from level {m} to {n}" for (m, n), v in LEVEL_CHANGES.items()
    )
    claim = f"Fig. 13: the CPU time changes by {each}, averaged over five sizes."
    largest = f"{duration(taken[a][-1])} and {duration(taken[b][-1])} at the largest"
    sizes = f"averaged over {len(taken[a])} sizes"
    finding = f"{title}, level {a} to {b}: {_change(ours)}, {sizes}; {largest}."
    return verdicts.judge_ratio(claim, finding, 1 + ours, 1 + LEVEL_CHANGES[a, b])


def _change(share: float) -> str:
    return minus(f"{100 * share:+.1f} %")


def times_with_data(run: ExperimentRun) -> Outcome:
    """Measure the CPU times of Table 2, as published and with our method."""
    side = run.extent.side(512)
    numbers = [max(round(n * side**2 / PAPER_CELLS), k + 1) for k, n in enumerate(TABLE_2_DATA)]
    cases = [*product(METHODS_OF_TABLE_2, LEVELS_OF_TABLE_2, COMPARED)]
    settings = [methods.paper_parameters(*case) for case in cases]
    names = list(dict.fromkeys(t.image for t in TABLE_2))
    trials = [
        trial
        for name in names
        for trial in data_trials(run.inputs.image(name), (side, side), numbers, settings, run.seed)
    ]
    results = iter(time_trials(trials, run.extent.n_timed, run.watch.progress, run.watch.cancel))
    blocks: list[Table | Text] = []
    judgements: list[Judgement] = []
    for name in names:
        times: Times = {
            (*case, k): next(results) for k, case in product(range(len(numbers)), cases)
        }
        blocks.append(_table_2(run, name, times))
        judgements += [*_methods_timed(name, times), *_ratios(name, times)]
        stated = _paper(name, "ccwsim", 1, 1)
        what = f"{name}, CCWSIM, level 1, 2000 data"
        seconds = times["ccwsim", 1, "paper", 1].seconds
        judgements.append(verdicts.judge_time(what, seconds, stated, "Table 2", run.extent.is_full))
    blocks.append(Text(PAPER_TEXTS["ms_ccsim"]))
    return Outcome(tuple(blocks), tuple(judgements))


def _table_2(run: ExperimentRun, name: str, times: Times) -> Table:
    """Return Table 2 for one image: the paper's times, as published, and ours."""
    rows = []
    for method, level in product(METHODS_OF_TABLE_2, LEVELS_OF_TABLE_2):
        cells = [TITLES[method], str(level)]
        for k in range(len(TABLE_2_DATA)):
            cells.append(f"{_paper(name, method, level, k):.2f} s")
            for variant in COMPARED:
                t = times[method, level, variant, k]
                wrong = 100 * float(t.n_mismatched.mean()) / max(t.trial.n_data, 1)
                cells.append(f"{duration(t.seconds)}, {wrong:.1f} %")
        rows.append(tuple(cells))
    titles = ("the paper", *(f"{COLUMNS[variant]}, data wrong" for variant in COMPARED))
    columns = (f"{n_data} data: {title}" for n_data in TABLE_2_DATA for title in titles)
    some = times["ccwsim", 1, "paper", 1].trial
    caption = said(
        "times",
        n=run.extent.n_timed,
        side=some.grid.nx,
        n_data=some.n_data,
        image=run.inputs.describe(name),
    )
    return Table(("method", "level", *columns), tuple(rows), caption)


def _paper(image: str, method: str, level: int, k: int) -> float:
    """Return the time in Table 2 for the number of data with index k."""
    case = image, method, level, TABLE_2_DATA[k]
    return next(t.cpu_seconds for t in TABLE_2 if (t.image, t.method, t.level, t.n_data) == case)


def _methods_timed(name: str, times: Times) -> Iterator[Judgement]:
    """Judge whether CCWSIM or MS-CCSIM is faster at levels 1 and 3."""
    claim = PAPER_TEXTS["claims"]["faster"]
    for variant in COMPARED:
        ratios = []
        for level, (k, n_data) in product(LEVELS_OF_TABLE_2, enumerate(TABLE_2_DATA)):
            theirs = _paper(name, "ccwsim", level, k) / _paper(name, "ms-ccsim", level, k)
            ours = _quotient(times, variant, ("ccwsim", level, k), ("ms-ccsim", level, k))
            ratios.append((f"level {level}, {n_data} data", ours, theirs))
        title = f"{COLUMNS[variant].capitalize()}, {name}"
        yield verdicts.judge_ratios(claim, title, ratios)
        ours = [share for _, share, _ in ratios]
        finding = said("efficient", title=title, low=min(ours), high=max(ours))
        word = AGREES if max(ours) < 1 / NOISE else IN_PART if min(ours) < 1 / NOISE else DIFFERENT
        yield verdicts.judged(PAPER_TEXTS["claims"]["efficient"], finding, word)


def _quotient(
    times: Times, variant: Variant, first: tuple[str, int, int], second: tuple[str, int, int]
) -> float:
    """Return the ratio of the CPU times of two cases (method, level, k) of a variant."""
    seconds = [times[method, level, variant, k].seconds for method, level, k in (first, second)]
    return seconds[0] / seconds[1]


def _ratios(name: str, times: Times) -> Iterator[Judgement]:
    """Judge the cost of twice the data and the gain of level 3."""
    twice = [
        (f"{TITLES[method]}, level {level}", (method, level, 1), (method, level, 0))
        for method in METHODS_OF_TABLE_2
        for level in LEVELS_OF_TABLE_2
    ]
    coarser = [
        (f"{n} data", ("ccwsim", 1, k), ("ccwsim", 3, k)) for k, n in enumerate(TABLE_2_DATA)
    ]
    for variant, (claim, cases) in product(COMPARED, (("twice", twice), ("coarser", coarser))):
        ratios = [
            (
                case,
                _quotient(times, variant, first, second),
                _paper(name, *first) / _paper(name, *second),
            )
            for case, first, second in cases
        ]
        title = f"{COLUMNS[variant].capitalize()}, {name}"
        yield verdicts.judge_ratios(PAPER_TEXTS["claims"][claim], title, ratios)
