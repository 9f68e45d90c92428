"""Experiments on CPU time by level, grid size and number of data (section 5.6)."""

from collections.abc import Iterator
from itertools import pairwise, product

import numpy as np

from ccwsim.experiments.timing import data_trials, grid_trials, growth, time_trials
from ccwsim.experiments.trials import TrialResult
from ccwsim.figures import LIGHT, TimeSeries, timings_chart
from ccwsim.model.numbers import duration, minus
from ccwsim.model.parameters import Method, Parameters
from ccwsim.paper import methods, verdicts
from ccwsim.paper.experiment import ExperimentRun, Outcome, said
from ccwsim.paper.methods import SETTINGS, TITLES
from ccwsim.paper.published_times import (
    FIGURE_13,
    LEVEL_CHANGES,
    OCTAVE,
    PAPER,
    TABLE_2,
    TABLE_2_DATA,
    Source,
    published_time,
)
from ccwsim.paper.verdicts import AGREES, DIFFERS, NOISE, PART
from ccwsim.report.document import Chart, Judgement, Row, Table, Text

LEVELS = (1, 2, 3)
LEVELS_OF_TABLE_2 = (1, 3)
PAPER_SIDE = 5000
N_TIMED = 3
LINEAR = 0.15  # growth of time is called linear if the exponent differs from 1 by at most this
PAPER_CELLS = 512 * 512

Times = dict[tuple[str, int, bool, int], TrialResult]
"""Times by the key (method, level, whether data are exact, index in `TABLE_2_DATA`)."""


def grid_size(run: ExperimentRun) -> Outcome:
    """Measure CPU times of unconditional channel realizations on square grids, on one thread."""
    image, sides = run.inputs.image("channel"), run.extent.timed_sides
    parameters = [methods.paper_parameters("ccwsim", level) for level in LEVELS]
    n = min(N_TIMED, run.extent.n_timed)
    trials = grid_trials(image, [(side, side) for side in sides], parameters, run.seed)
    times = list(time_trials(trials, n, run.watch.progress, run.watch.cancel))
    by_level = {level: [t for t in times if t.parameters.level == level] for level in LEVELS}
    paper = {p.level: p.cpu_seconds for p in FIGURE_13}
    rows = []
    for k, side in enumerate(sides):
        each = (duration(by_level[level][k].seconds) for level in LEVELS)
        rows.append((f"{side} × {side}", f"{side * side:,}", *each))
    theirs = (duration(paper[level] or 0.0) for level in LEVELS)
    rows.append((f"paper, {PAPER_SIDE} × {PAPER_SIDE}", f"{PAPER_SIDE**2:,}", *theirs))
    header = ("grid", "cells", *(f"level {level}" for level in LEVELS))
    caption = said("grids", n=n)
    of_chart = (
        f"{image.name}, no hard data; {SETTINGS}; median of {n} realizations, seed {run.seed}."
    )
    chart = Row((_grid_chart(by_level, sides),), of_chart)
    blocks = (chart, Table(header, tuple(rows), caption))
    return Outcome(blocks, tuple(_grid_judgements(by_level)))


def _grid_chart(by_level: dict[int, list[TrialResult]], sides: tuple[int, ...]) -> Chart:
    measured = []
    for level, times in by_level.items():
        n_cells, values = np.array([(t.trial.grid.n_cells, t.seconds) for t in times], float).T
        measured.append(TimeSeries(f"level {level}", level, n_cells, values))
    named = sorted({*sides, PAPER_SIDE})
    ticks = {side**2: f"{side}²" for side in named}
    figure = timings_chart(measured, paper_series(), ticks, LIGHT, y_title="CPU time (s)", unit="s")
    title = "Fig. 13 · CPU time of a realization against the number of cells"
    legend = (("measured here", LIGHT.ink), ("the paper, another machine", LIGHT.reference))
    return Chart(figure, title, title, legend)


def paper_series(per_cell: bool = False) -> list[TimeSeries]:
    """Return the paper's times for the largest grid by level, in seconds or in µs per cell."""
    series = []
    for t in FIGURE_13:
        n_cells, taken = np.array([t.n_cells], float), np.array([t.cpu_seconds], float)
        values = 1e6 * taken / n_cells if per_cell else taken
        series.append(TimeSeries(f"paper, level {t.level}", t.level or 0, n_cells, values))
    return series


def _grid_judgements(by_level: dict[int, list[TrialResult]]) -> Iterator[Judgement]:
    taken = {level: [t.seconds for t in times] for level, times in by_level.items()}
    for a, b in pairwise(LEVELS):
        yield level_change(taken, a, b)
    yield verdicts.of_levels({level: each[-1] for level, each in taken.items()})
    powers = {level: growth(times).exponent for level, times in by_level.items()}
    each = ", ".join(f"{power:.2f} (level {level})" for level, power in powers.items())
    worst = max(abs(power - 1) for power in powers.values())
    claim = "Fig. 13: CPU times of five grids; only the time of the largest grid is available."
    finding = f"Time is proportional to the number of cells to the power {each}."
    yield verdicts.judged(claim, finding, "linear" if worst <= LINEAR else "not linear")
    largest = by_level[1][-1]
    side, taken_here = largest.trial.grid.nx, largest.seconds
    if side == PAPER_SIDE:
        paper = next(p.cpu_seconds or 0.0 for p in FIGURE_13 if p.level == 1)
        yield verdicts.of_time("25 million cells, level 1", taken_here, paper, "Fig. 13")
        return
    claim = "Fig. 13: 56 s for 25 million cells at level 1."
    whole = duration(25e6 / largest.trial.grid.n_cells * taken_here)
    finding = said("largest", here=duration(taken_here), side=side, whole=whole)
    yield verdicts.judged(claim, finding, verdicts.OPEN)


def level_change(taken: dict[int, list[float]], a: int, b: int) -> Judgement:
    """Judge the change of CPU time from one level to the next, averaged over the grids."""
    theirs = LEVEL_CHANGES[a, b]
    ours = float(np.mean(np.divide(taken[b], taken[a]))) - 1
    each = " and ".join(
        f"{_change(v)} from level {m} to {n}" for (m, n), v in LEVEL_CHANGES.items()
    )
    claim = f"Fig. 13: the CPU time changes by {each}, averaged over five sizes."
    largest = f"{duration(taken[a][-1])} and {duration(taken[b][-1])} at the largest"
    finding = f"Level {a} to {b}: {_change(ours)}, averaged over {len(taken[a])} sizes; {largest}."
    return verdicts.of_ratio(claim, finding, 1 + ours, 1 + theirs)


def _change(share: float) -> str:
    return minus(f"{100 * share:+.1f} %")


def times_with_data(run: ExperimentRun) -> Outcome:
    """Measure CPU times of the three methods, with published settings and with exact data."""
    image, side = run.inputs.image("channel"), run.extent.side(512)
    numbers = [max(round(n * side * side / PAPER_CELLS), k + 1) for k, n in enumerate(TABLE_2_DATA)]
    levels_of: dict[Method, tuple[int, ...]]
    levels_of = {"ms-ccsim": LEVELS, "ccwsim": LEVELS, "ccsim": (0,)}
    settings = [
        methods.paper_parameters(method, level, exact=exact)
        for exact in (False, True)
        for method, levels in levels_of.items()
        for level in levels
    ]
    n = run.extent.n_timed
    trials = data_trials(image, (side, side), numbers, settings, run.seed)
    measured = time_trials(trials, n, run.watch.progress, run.watch.cancel)
    times: Times = {(*_key(t.parameters), numbers.index(t.trial.n_data)): t for t in measured}
    ours = (column for n_data in numbers for column in (f"{n_data} data", "wrong"))
    others = (f"{source}, {n_data}" for source in ("paper", "Octave") for n_data in TABLE_2_DATA)
    header = ("method", "level", "data", *ours, *others)
    caption = said("times", n=n, side=side)
    remark = f"Octave: {OCTAVE.reference}; {OCTAVE.machine}. The paper: {PAPER.machine}."
    table = Table(header, tuple(_row(p, times) for p in settings), caption)
    measured, what = times["ccwsim", 1, False, 1].seconds, "CCWSIM, level 1, 2000 data"
    theirs = _paper("ccwsim", 1, 1)
    time = verdicts.of_time(what, measured, theirs, "Table 2", run.extent.is_full)
    blocks = table, _table_2(), Text(remark, quiet=True)
    return Outcome(blocks, (*_time_judgements(times), *_ratios(times), time))


def _table_2() -> Table:
    """Return all of the paper's Table 2."""
    images = list(dict.fromkeys(t.image for t in TABLE_2))
    taken = {(t.method, t.level, t.image, t.n_data): t.cpu_seconds for t in TABLE_2}
    rows = []
    for method, level in dict.fromkeys((t.method, t.level) for t in TABLE_2):
        each = (taken[method, level, image, n] for image in images for n in TABLE_2_DATA)
        rows.append((TITLES[method], str(level), *(f"{s:.2f} s" for s in each)))
    header = ("method", "level", *(f"{image}, {n}" for image in images for n in TABLE_2_DATA))
    caption = said("table_2")
    return Table(header, tuple(rows), caption)


def _key(p: Parameters) -> tuple[str, int, bool]:
    return p.method, p.along((1, 1)).level[-1], p.exact_data


def _row(p: Parameters, times: Times) -> tuple[str, ...]:
    method, level, exact = _key(p)
    texts = [TITLES[method], str(level), "exact" if exact else "as published"]
    for k in (0, 1):
        t = times[method, level, exact, k]
        wrong = 100 * float(t.n_mismatched.mean()) / max(t.trial.n_data, 1)
        texts += [duration(t.seconds), f"{wrong:.1f} %"]
    for source, n in product((PAPER, OCTAVE), TABLE_2_DATA):
        taken = None if exact else _published(source, method, level, n)
        texts.append("–" if taken is None else duration(taken))
    return tuple(texts)


def _published(source: Source, method: str, level: int, n_data: int) -> float | None:
    stated = published_time(source, method, level, PAPER_CELLS, n_data)
    return None if stated is None else stated.cpu_seconds


def _paper(method: str, level: int, k: int) -> float:
    taken = _published(PAPER, method, level, TABLE_2_DATA[k])
    assert taken is not None
    return taken


def _ratio(
    times: Times, first: tuple[str, int, int], second: tuple[str, int, int]
) -> tuple[float, float]:
    """Return our and the paper's ratio of the CPU times of two cases (method, level, k)."""
    cases = first, second
    ours = [times[method, level, True, k].seconds for method, level, k in cases]
    theirs = [_paper(method, level, k) for method, level, k in cases]
    return ours[0] / ours[1], theirs[0] / theirs[1]


def _time_judgements(times: Times) -> Iterator[Judgement]:
    """Judge whether CCWSIM or MS-CCSIM is faster at levels 1 and 3, with all data honoured."""
    claim = "Table 2: CCWSIM takes less time than MS-CCSIM at level 1, about the same at level 3."
    shares = []
    for level, (k, n) in product(LEVELS_OF_TABLE_2, enumerate(TABLE_2_DATA)):
        ours, theirs = _ratio(times, ("ccwsim", level, k), ("ms-ccsim", level, k))
        shares.append(ours)
        finding = f"Level {level}, {n} data: {ours:.2f} times as long, in the paper {theirs:.2f}."
        yield verdicts.of_ratio(claim, finding, ours, theirs)
    less = [f"{share:.2f}" for share in shares]
    efficient = said("efficient", ratios=", ".join(less[:-1]), last=less[-1])
    word = AGREES if max(shares) < 1 / NOISE else PART if min(shares) < 1 / NOISE else DIFFERS
    claim = "CCWSIM is efficient: it takes less time than MS-CCSIM (title, section 5.6)."
    yield verdicts.judged(claim, efficient, word)


def _ratios(times: Times) -> Iterator[Judgement]:
    """Judge the cost of twice the data and the gain of level 3, with all data honoured."""
    twice = "Table 2: cost of twice the data, 2000 instead of 1000."
    coarser = "Table 2: CPU time of CCWSIM at level 1 relative to level 3."
    pairs = [
        (twice, f"{TITLES[method]}, level {level}", (method, level, 1), (method, level, 0))
        for method in ("ccwsim", "ms-ccsim")
        for level in LEVELS_OF_TABLE_2
    ]
    pairs += [
        (coarser, f"{n} data", ("ccwsim", 1, k), ("ccwsim", 3, k))
        for k, n in enumerate(TABLE_2_DATA)
    ]
    for claim, case, first, second in pairs:
        ours, theirs = _ratio(times, first, second)
        finding = f"{case}: {ours:.2f} times, in the paper {theirs:.2f}."
        yield verdicts.of_ratio(claim, finding, ours, theirs)
