"""The paper's experiments on a thread, and the report of those that are finished."""

from __future__ import annotations

import os
from dataclasses import dataclass, field

from ccwsim.model.errors import CCWSIMError
from ccwsim.paper import (
    EXPERIMENTS,
    FULL,
    QUICK,
    Finished,
    Inputs,
    Reproduction,
    document_of,
    inputs_in,
    reproduce,
)
from ccwsim.report import report_html
from ccwsim.ui.jobs.job import Job
from ccwsim.ui.jobs.limits import Demand

BYTES_PER_CELL = 8
"""Memory of an experiment for each cell of its realizations, with statistics and pictures."""
VARIABLE = "CCWSIM_DATA"
"""Environment variable of the server that names the folder of the authors' files."""


@dataclass
class PaperRun:
    """A run that is going on, or has come to an end.

    `finished` are the experiments so far; `result` is None and `report`, its HTML, empty until
    the end, the report also where no experiment was finished.
    """

    inputs: Inputs
    quick: bool
    seed: int
    finished: list[Finished] = field(default_factory=list)
    result: Reproduction | None = None
    report: bytes = b""
    job: Job | None = None

    def start(self) -> PaperRun:
        """Begin, on a thread; refused where the server does not have what it demands."""
        n = len(EXPERIMENTS)
        self.job = Job(self._work, demand=self.demand(), n=n, unit="experiments")
        return self

    @property
    def going(self) -> bool:
        """Whether it has begun and not come to an end."""
        return self.job is not None and not self.job.finished

    def demand(self) -> Demand:
        """Return what it asks of the server: its largest experiment, as they run one by one."""
        x = QUICK if self.quick else FULL
        many, few = x.side(512) ** 2 * x.n_many, x.largest_side**2 * x.n_few
        n_cells = max(many, few, max(x.timed_sides) ** 2 * x.n_timed)
        return Demand(n_cells, 0, BYTES_PER_CELL * n_cells)

    def _work(self, job: Job) -> None:
        extent, on_finished = QUICK if self.quick else FULL, self.finished.append
        report, cancel = job.report, job.is_cancelled
        found = reproduce(self.inputs, extent, self.seed, report, cancel, EXPERIMENTS, on_finished)
        if found.finished:
            self.report = report_html(document_of(found)).encode()
        self.result = found


@dataclass
class PaperState:
    """What the page remembers: whether the next run is the small one, its seed, the latest run."""

    quick: bool = False
    seed: int = 0
    run: PaperRun | None = None
    message: str = ""
    """Why a run was not started."""


def server_inputs() -> tuple[Inputs, str]:
    """Return the inputs of the server, and what is wrong with its folder, if anything is."""
    folder = os.environ.get(VARIABLE)
    try:
        return inputs_in(folder or None), ""
    except CCWSIMError as error:
        return Inputs(), f"{VARIABLE} of the server: {error}. The bundled images are used."
