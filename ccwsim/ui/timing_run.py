"""Settings that are timed one after another in the background."""

from __future__ import annotations

from dataclasses import dataclass, field

from ccwsim.timing import Timing, time_cases
from ccwsim.timing_case import TimingCase
from ccwsim.training_image import TrainingImage
from ccwsim.ui.jobs import BackgroundRun, Cancel, Job, Progress


@dataclass
class TimingRun(BackgroundRun):
    """A run that is going on, or has come to an end.

    Attributes
    ----------
    training_image, cases, n_realizations, seed
        What is timed.
    timings : list of Timing
        What is finished, in the order of the cases.
    """

    training_image: TrainingImage
    cases: list[TimingCase]
    n_realizations: int
    seed: int
    timings: list[Timing] = field(default_factory=list)
    job: Job | None = None

    def _work(self, progress: Progress, cancel: Cancel) -> None:
        for timing in time_cases(
            self.training_image, self.cases, self.n_realizations, self.seed, progress, cancel
        ):
            self.timings.append(timing)
