"""CPU time by level, against the size of the grid and the number of data (section 5.6)."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from ccwsim.experiments.timing import Timing, time_data, time_grids
from ccwsim.figures import LIGHT, TimeSeries, timings_chart
from ccwsim.model.parameters import Parameters
from ccwsim.paper.experiment import Outcome, Run
from ccwsim.paper.methods import TITLES, settings
from ccwsim.paper.published_times import FIGURE_13, OCTAVE, PAPER, published_time
from ccwsim.paper.verdicts import (
    AGREES,
    DIFFERS,
    OPEN,
    judged,
    not_comparable,
    of_order,
    of_ratio,
    of_time,
    seconds,
)
from ccwsim.report import Chart, Judgement, Row, Table, Text

LEVELS = (1, 2, 3)
PAPER_SIDE = 5000
N_TIMED = 3
LINEAR = 0.15
"""How far the power of growth may be from 1 to be called linear."""
NUMBERS = (1000, 2000)
PAPER_CELLS = 512 * 512

Times = dict[tuple[str, int, bool, int], Timing]
"""By method, level, whether data are exact, and which of `NUMBERS`."""


def grid_size(run: Run) -> Outcome:
    """Time unconditional realizations of the channel image on square grids, on one thread."""
    image, sides = run.inputs.image("channel"), run.extent.timed_sides
    parameters = [settings("ccwsim", level) for level in LEVELS]
    n = min(N_TIMED, run.extent.n_timed)
    times = list(time_grids(image, sides, parameters, n, run.seed, run.report, run.cancel))
    by_level = {level: [t for t in times if t.parameters.level == level] for level in LEVELS}
    paper = {p.level: p.cpu_seconds for p in FIGURE_13}
    rows = []
    for k, side in enumerate(sides):
        each = (seconds(by_level[level][k].seconds) for level in LEVELS)
        rows.append((f"{side} × {side}", f"{side * side:,}", *each))
    theirs = (seconds(paper[level] or 0.0) for level in LEVELS)
    rows.append((f"paper, {PAPER_SIDE} × {PAPER_SIDE}", f"{PAPER_SIDE**2:,}", *theirs))
    header = ("grid", "cells", *(f"level {level}" for level in LEVELS))
    caption = f"CPU time of a realization, median of {n}, one thread, no data."
    blocks = (_grid_chart(by_level, sides), Table(header, tuple(rows), caption))
    return Outcome(blocks, _grid_judgements(by_level))


def _grid_chart(by_level: dict[int, list[Timing]], sides: tuple[int, ...]) -> Row:
    measured = []
    for level, times in by_level.items():
        cells, values = np.array([(t.n_cells, t.seconds) for t in times], float).T
        measured.append(TimeSeries(f"level {level}", level, cells, values))
    published = []
    for p in FIGURE_13:
        cells, values = np.array([float(PAPER_SIDE**2)]), np.array([p.cpu_seconds or 0.0])
        published.append(TimeSeries(f"paper, level {p.level}", int(p.level or 0), cells, values))
    named = sorted({*sides, PAPER_SIDE})
    figure = timings_chart(measured, published, named, LIGHT, y_title="CPU time (s)", unit="s")
    title = "Fig. 13 · CPU time of a realization against the cells of the grid"
    legend = (("measured here", LIGHT.ink), ("the paper, another machine", LIGHT.reference))
    return Row((Chart(figure, title, title, legend),))


def _grid_judgements(by_level: dict[int, list[Timing]]) -> tuple[Judgement, ...]:
    largest = {level: times[-1] for level, times in by_level.items()}
    paper = {int(p.level or 0): p.cpu_seconds or 0.0 for p in FIGURE_13}
    judgements = []
    for a, b in pairwise(LEVELS):
        claim = (
            f"Fig. 13, 25 million cells: level {a} {paper[a]:.0f} s, level {b} {paper[b]:.0f} s."
        )
        ratio = largest[a].seconds / largest[b].seconds
        judgements.append(of_ratio(claim, ratio, paper[a] / paper[b]))
    found = ", ".join(f"level {level} {seconds(t.seconds)}" for level, t in largest.items())
    ratio = largest[3].seconds / largest[1].seconds
    judgements.append(of_order("Higher levels take less time.", found, ratio, paper[3] / paper[1]))
    judgements.append(_linear(by_level))
    side = largest[1].grid_shape[0]
    if side == PAPER_SIDE:
        what = "25 million cells, level 1"
        judgements.append(of_time(what, largest[1].seconds, paper[1], "Fig. 13"))
    else:
        per = 25e6 / largest[1].n_cells
        words = (
            f"{seconds(largest[1].seconds)} for {side} × {side} cells at level 1; 25 million would "
            f"take {seconds(per * largest[1].seconds)} at the same rate (run it with "
            "--largest-grid 5000)."
        )
        judgements.append(judged("Fig. 13: 56 s for 25 million cells at level 1.", words, OPEN))
    return tuple(judgements)


def _linear(by_level: dict[int, list[Timing]]) -> Judgement:
    """Judge how the time grows: the slope of its logarithm over that of the cells."""
    powers = {}
    for level, times in by_level.items():
        cells, taken = np.log([(t.n_cells, t.seconds) for t in times]).T
        powers[level] = float(np.polyfit(cells, taken, 1)[0])
    each = ", ".join(f"{power:.2f} (level {level})" for level, power in powers.items())
    worst = max(abs(power - 1) for power in powers.values())
    claim = "Grids with millions of cells are simulated rapidly (the authors' page)."
    found = f"Time grows with the power {each} of the cells."
    return judged(claim, found, AGREES if worst <= LINEAR else DIFFERS)


def times_with_data(run: Run) -> Outcome:
    """Time the three methods as published and with exact data, on one thread."""
    image, side = run.inputs.image("channel"), run.extent.side(512)
    numbers = [max(round(n * side * side / PAPER_CELLS), k + 1) for k, n in enumerate(NUMBERS)]
    cases = [
        settings(method, level, exact=exact)
        for exact in (False, True)
        for method, levels in (("ms-ccsim", LEVELS), ("ccwsim", LEVELS), ("ccsim", (0,)))
        for level in levels
    ]
    n, shape = run.extent.n_timed, (side, side)
    measured = time_data(image, numbers, cases, shape, n, run.seed, run.report, run.cancel)
    times: Times = {(*_key(t.parameters), numbers.index(t.n_data)): t for t in measured}
    ours = (column for n_data in numbers for column in (f"{n_data} data", "wrong"))
    others = (f"{source}, {n_data}" for source in ("paper", "Octave") for n_data in NUMBERS)
    header = ("method", "level", "data", *ours, *others)
    caption = (
        f"CPU time of a realization (median of {n}, one thread), {side} × {side} cells, data "
        "sampled from an unconditional realization. “As published”: condition on data in the "
        "search only; “exact”: every datum honoured at full resolution."
    )
    remark = f"Octave: {OCTAVE.reference}; {OCTAVE.machine}. The paper: {PAPER.machine}."
    table = Table(header, tuple(_row(p, times) for p in cases), caption)
    return Outcome((table, Text(remark, quiet=True)), _data_judgements(run, times))


def _key(p: Parameters) -> tuple[str, int, bool]:
    return p.method, p.level if p.method == "ccsim" else p.wavelet_level, p.exact_data


def _row(p: Parameters, times: Times) -> tuple[str, ...]:
    method, level, exact = _key(p)
    cells = [TITLES[method], str(level), "exact" if exact else "as published"]
    for k in (0, 1):
        t = times[method, level, exact, k]
        wrong = 100 * float(t.n_mismatched.mean()) / max(t.n_data, 1)
        cells += [seconds(t.seconds), f"{wrong:.1f} %"]
    for source in (PAPER, OCTAVE):
        for n in NUMBERS:
            found = published_time(source, method, level, PAPER_CELLS, n)
            there = found is not None and found.cpu_seconds is not None and not exact
            cells.append(seconds(found.cpu_seconds) if there else "–")  # type: ignore[union-attr,arg-type]
    return tuple(cells)


def _data_judgements(run: Run, times: Times) -> tuple[Judgement, ...]:
    found = [*_methods(times), *_twice_the_data(times), *_levels(times)]
    ours = times["ccwsim", 1, False, 1].seconds
    if not run.extent.is_full:
        found.append(not_comparable("Table 2: 23.09 s at level 1 with 2000 data.", ours))
    else:
        found.append(of_time("CCWSIM, level 1, 2000 data", ours, _paper("ccwsim", 1, 1), "Table 2"))
    return tuple(found)


def _paper(method: str, level: int, k: int) -> float:
    found = published_time(PAPER, method, level, PAPER_CELLS, NUMBERS[k])
    assert found is not None
    assert found.cpu_seconds is not None
    return found.cpu_seconds


def _methods(times: Times) -> list[Judgement]:
    """Judge the order of the methods at levels 1 and 3."""
    judgements = []
    for level in (1, 3):
        for k, n in enumerate(NUMBERS):
            theirs = [_paper(method, level, k) for method in ("ms-ccsim", "ccwsim")]
            ours = [times[method, level, False, k].seconds for method in ("ms-ccsim", "ccwsim")]
            claim = (
                f"Table 2, level {level}, {n} data: MS-CCSIM {theirs[0]:.2f} s, CCWSIM "
                f"{theirs[1]:.2f} s, so CCWSIM takes {theirs[1] / theirs[0]:.2f} times as long."
            )
            exact = [times[method, level, True, k].seconds for method in ("ms-ccsim", "ccwsim")]
            found = (
                f"As published: MS-CCSIM {seconds(ours[0])}, CCWSIM {seconds(ours[1])}, "
                f"{ours[1] / ours[0]:.2f} times. Exact: {seconds(exact[0])} and "
                f"{seconds(exact[1])}, {exact[1] / exact[0]:.2f} times."
            )
            judgements.append(of_order(claim, found, ours[1] / ours[0], theirs[1] / theirs[0]))
    return judgements


def _twice_the_data(times: Times) -> list[Judgement]:
    """Judge what twice the data cost."""
    judgements = []
    for method in ("ccwsim", "ms-ccsim"):
        for level in (1, 3):
            ours = times[method, level, False, 1].seconds / times[method, level, False, 0].seconds
            theirs = _paper(method, level, 1) / _paper(method, level, 0)
            claim = f"Table 2: twice the data cost {TITLES[method]} at level {level} {theirs:.2f} "
            judgements.append(of_ratio(claim + "times the time.", ours, theirs))
    return judgements


def _levels(times: Times) -> list[Judgement]:
    """Judge the gain of level 3 over level 1, as published."""
    judgements = []
    for k, n in enumerate(NUMBERS):
        both = [times["ccwsim", level, False, k].seconds for level in LEVELS]
        ours = both[0] / both[2]
        theirs = _paper("ccwsim", 1, k) / _paper("ccwsim", 3, k)
        claim = f"Table 2: with {n} data CCWSIM at level 1 takes {theirs:.2f} times as long as at "
        judgement = of_ratio(claim + "level 3.", ours, theirs, alike=2.0)
        falling = all(b <= a for a, b in pairwise(both))
        if judgement.word != AGREES and falling:
            judgement = judged(judgement.claim, judgement.found, "same order")
        judgements.append(judgement)
    return judgements
