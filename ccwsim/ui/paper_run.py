"""The paper's experiments in the background, and the report of those that are finished."""

from __future__ import annotations

import os
from dataclasses import dataclass, field

from ccwsim.errors import CCWSIMError
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
from ccwsim.ui.jobs import BackgroundRun, Cancel, Job, Progress

VARIABLE = "CCWSIM_DATA"
"""Environment variable of the server that names the folder of the authors' files."""


@dataclass
class PaperRun(BackgroundRun):
    """A run that is going on, or has come to an end.

    Attributes
    ----------
    inputs : Inputs
    quick : bool
    seed : int
    finished : list of Finished
        The experiments so far.
    result : Reproduction or None
        None until the end.
    report : bytes
        The HTML of the result; empty where no experiment was finished.
    """

    inputs: Inputs
    quick: bool
    seed: int
    finished: list[Finished] = field(default_factory=list)
    result: Reproduction | None = None
    report: bytes = b""
    job: Job | None = None

    def _work(self, progress: Progress, cancel: Cancel) -> None:
        extent = QUICK if self.quick else FULL
        found = reproduce(
            self.inputs, extent, self.seed, progress, cancel, EXPERIMENTS, self.finished.append
        )
        if found.finished:
            self.report = report_html(document_of(found)).encode()
        self.result = found


@dataclass
class PaperState:
    """What the page remembers.

    Attributes
    ----------
    quick : bool
        Whether the next run is the small one.
    seed : int
    run : PaperRun, optional
        The latest.
    """

    quick: bool = False
    seed: int = 0
    run: PaperRun | None = None


def server_inputs() -> tuple[Inputs, str]:
    """Return the inputs of the server, and what is wrong with its folder, if anything is."""
    folder = os.environ.get(VARIABLE)
    try:
        return inputs_in(folder or None), ""
    except CCWSIMError as error:
        return Inputs(), f"{VARIABLE} of the server: {error}. The bundled images are used."
