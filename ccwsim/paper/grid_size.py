"""CPU time against the size of the grid, by level (Fig. 13)."""

from __future__ import annotations

import numpy as np

from ccwsim.experiments.timing import Timing, time_grids
from ccwsim.figures import LIGHT, TimeSeries, timings_chart
from ccwsim.paper.experiment import Experiment, Outcome, Run
from ccwsim.paper.methods import settings
from ccwsim.paper.published_times import FIGURE_13
from ccwsim.paper.verdicts import (
    AGREES,
    DIFFERS,
    OPEN,
    judged,
    of_order,
    of_ratio,
    of_time,
    seconds,
)
from ccwsim.report import Chart, Judgement, Row, Table

LEVELS = (1, 2, 3)
PAPER_SIDE = 5000
N_TIMED = 3
LINEAR = 0.15
"""How far the power of growth may be from 1 to be called linear."""


def grid_size(run: Run) -> Outcome:
    """Time unconditional realizations of the channel image on square grids, on one thread."""
    image, sides = run.inputs.image("channel"), run.extent.timed_sides
    parameters = [settings("ccwsim", level) for level in LEVELS]
    times = list(time_grids(
        image, sides, parameters, min(N_TIMED, run.extent.n_timed), run.seed,
        lambda share, n: run.progress(share), run.cancel,
    ))  # fmt: skip
    by_level = {level: [t for t in times if t.parameters.level == level] for level in LEVELS}
    paper = {p.level: p.cpu_seconds for p in FIGURE_13}
    rows = [
        (f"{side} × {side}", f"{side * side:,}", *(seconds(by_level[level][k].seconds) for level in
                                                   LEVELS))
        for k, side in enumerate(sides)
    ]  # fmt: skip
    rows.append((f"paper, {PAPER_SIDE} × {PAPER_SIDE}", f"{PAPER_SIDE**2:,}",
                 *(seconds(paper[level] or 0.0) for level in LEVELS)))  # fmt: skip
    table = Table(("grid", "cells", *(f"level {level}" for level in LEVELS)), tuple(rows),
                  f"CPU time of a realization, median of {min(N_TIMED, run.extent.n_timed)}, one "
                  "thread, no data.")  # fmt: skip
    return Outcome((_chart(by_level, sides), table), _judgements(by_level))


def _chart(by_level: dict[int, list[Timing]], sides: tuple[int, ...]) -> Row:
    measured = [
        TimeSeries(f"level {level}", level, np.array([t.n_cells for t in times], float),
                   np.array([t.seconds for t in times]))
        for level, times in by_level.items()
    ]  # fmt: skip
    published = [
        TimeSeries(f"paper, level {p.level}", int(p.level or 0), np.array([float(PAPER_SIDE**2)]),
                   np.array([p.cpu_seconds or 0.0]))
        for p in FIGURE_13
    ]  # fmt: skip
    figure = timings_chart(
        measured, published, sorted({*sides, PAPER_SIDE}), LIGHT, y_title="CPU time (s)", unit="s",
    )  # fmt: skip
    title = "Fig. 13 · CPU time of a realization against the cells of the grid"
    legend = (("measured here", LIGHT.ink), ("the paper, another machine", LIGHT.reference))
    return Row((Chart(figure, title, title, legend),))


def _judgements(by_level: dict[int, list[Timing]]) -> tuple[Judgement, ...]:
    largest = {level: times[-1] for level, times in by_level.items()}
    paper = {int(p.level or 0): p.cpu_seconds or 0.0 for p in FIGURE_13}
    judgements = []
    for a, b in ((1, 2), (2, 3)):
        claim = (
            f"Fig. 13, 25 million cells: level {a} {paper[a]:.0f} s, level {b} {paper[b]:.0f} s."
        )
        judgements.append(
            of_ratio(claim, largest[a].seconds / largest[b].seconds, paper[a] / paper[b])
        )
    found = ", ".join(f"level {level} {seconds(t.seconds)}" for level, t in largest.items())
    claim = "Higher levels take less time."
    judgements.append(
        of_order(claim, found, largest[3].seconds / largest[1].seconds, paper[3] / paper[1])
    )
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
    powers = []
    for times in by_level.values():
        cells, taken = ([f(t) for t in times] for f in (lambda t: t.n_cells, lambda t: t.seconds))
        powers.append(float(np.polyfit(np.log(cells), np.log(taken), 1)[0]))
    found = "Time grows with the power " + ", ".join(
        f"{power:.2f} (level {level})" for level, power in zip(by_level, powers, strict=True)
    )
    worst = max(abs(power - 1) for power in powers)
    claim = "Grids with millions of cells are simulated rapidly (the authors' page)."
    return judged(claim, f"{found} of the cells.", AGREES if worst <= LINEAR else DIFFERS)


GRID_SIZE = Experiment(
    "grid-size", "CPU time against grid size", "Fig. 13",
    "Fig. 13 shows mean CPU times of five grids up to 25 million cells at levels 1, 2 and 3: 56, "
    "32 and 31 s at the largest.", grid_size,
)  # fmt: skip
