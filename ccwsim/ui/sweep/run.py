"""A sweep on a thread, how it is followed, and what the page remembers of it."""

from __future__ import annotations

import time
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, Literal

from ccwsim.experiments.sweep import Row, Sweep, sweep
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.grid import Grid
from ccwsim.model.hard_data import HardData
from ccwsim.model.parameters import Parameters
from ccwsim.model.study import Study
from ccwsim.model.training_image import TrainingImage
from ccwsim.ui.jobs.job import Job
from ccwsim.ui.jobs.limits import Demand, demand_of
from ccwsim.ui.session.fragments import follow
from ccwsim.ui.session.state import State
from ccwsim.ui.widgets.errors import reason

CELLS_KEPT = 64_000_000
"""Cells of realizations that a sweep keeps, one byte each."""
MAX_KEPT = 4
REDRAW_SECONDS = 1.5
"""Seconds at least from one look at new settings to the next."""
Error = Literal["patterns", "connection", "mended"]


@dataclass
class SweepRun:
    """A sweep that is going on, or has come to an end.

    Attributes
    ----------
    training_image, grid, hard_data, seed, settings, n_realizations
        What is simulated.
    facies : int
        Index of the facies whose connectivity is judged.
    colours : list of str
        Of the facies, "#rrggbb".
    rows : list of Row
        The settings that are finished.
    job : Job or None
    n_drawn : int
        How many of them the page shows.
    tiles : list of bytes
        A small picture of each.
    """

    training_image: TrainingImage
    grid: Grid
    hard_data: HardData
    seed: int
    settings: tuple[Parameters, ...]
    n_realizations: int
    facies: int
    colours: list[str]
    rows: list[Row] = field(default_factory=list)
    job: Job[Sweep] | None = None
    n_drawn: int = 0
    tiles: list[bytes] = field(default_factory=list)

    def start(self) -> SweepRun:
        """Begin, on a thread; refused where the server does not have what it demands."""
        n = len(self.settings)
        self.job = Job(self._work, demand=self.demand(), n=n, unit="settings")
        return self

    @property
    def going(self) -> bool:
        """Whether it has begun and not come to an end."""
        return self.job is not None and not self.job.finished

    def demand(self) -> Demand:
        """Return what it asks of the server: one setting at a time, and what is kept of each."""
        largest = 0
        for p in self.settings:
            with suppress(CCWSIMError):  # one that does not fit is told about among the results
                study = Study(self.training_image, self.grid, p, self.hard_data, self.seed)
                needed = demand_of(study, self.n_realizations, n_workers=1).n_bytes
                largest = max(largest, needed)
        cells = self.grid.ny * self.grid.nx * len(self.settings)
        kept = max(CELLS_KEPT, cells)  # one realization at least
        return Demand(cells * self.n_realizations, self.hard_data.n, largest + kept)

    def _work(self, job: Job[Sweep]) -> Sweep:
        n_kept = CELLS_KEPT // (self.grid.ny * self.grid.nx * len(self.settings))
        return sweep(
            *(self.training_image, self.grid, self.settings, self.hard_data),
            *(self.n_realizations, self.seed, job.report, job.is_cancelled),
            found=self.rows.append,
            n_kept=min(max(n_kept, 1), MAX_KEPT),
            facies=self.facies,
        )

    @property
    def found(self) -> Sweep:
        """What is known so far."""
        if self.job is not None and self.job.result is not None:
            return self.job.result
        return Sweep(tuple(self.rows), (), len(self.settings), self.training_image.shape)


@dataclass
class SweepState:
    """What the page remembers.

    Attributes
    ----------
    ranges : dict
        The ranges that the user chose, by the name of the parameter; others follow the study.
    n_realizations : int
        Of each setting.
    error : str
        What the chart shows over time.
    run : SweepRun or None
        The latest sweep.
    chosen : int or None
        Which of its settings is large; None for the recommended one.
    shown : int
        Which of that setting's realizations.
    message : str
        Why a sweep was not started.
    """

    ranges: dict[str, list[Any]] = field(default_factory=dict)
    n_realizations: int = 4
    error: Error = "patterns"
    run: SweepRun | None = None
    chosen: int | None = None
    shown: int = 0
    message: str = ""


def follow_sweep(state: State, drawn_at: float) -> None:
    """Show how far the sweep is; draw the page again for new settings and at the end."""
    run = state.page(SweepState).run
    if run is None or run.job is None:
        return

    def has_news() -> bool:
        return len(run.rows) > run.n_drawn and time.monotonic() - drawn_at > REDRAW_SECONDS

    follow(run.job, has_news=has_news, keys=("sweep_progress", "sweep_cancel"))


def describe_end(run: SweepRun) -> str:
    """Say what is missing of a sweep that has come to its end, or nothing."""
    found, job = run.found, run.job
    sentences = []
    if job is not None and job.error is not None:
        sentences.append(f"The sweep ended early: {reason(job.error)}.")
    if found.stopped and not run.going:
        n = len(found.rows)
        shown = "; these are shown." if n else "."
        sentences.append(f"Stopped after {n} of {found.n_asked} settings{shown}")
    if found.failed:
        sentences.append(f"{len(found.failed)} could not be simulated: {found.failed[0][1]}.")
    return " ".join(sentences)
