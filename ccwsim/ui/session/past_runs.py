"""The runs of a session: the latest ones, as many as a limit of memory allows."""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import datetime

from ccwsim.model.choices import Choices
from ccwsim.model.ensemble import Ensemble
from ccwsim.model.training_image import TrainingImage
from ccwsim.ui.jobs.limits import limits_of_environment

MAX_RUNS = 12


@dataclass(frozen=True, eq=False)
class PastRun:
    """A run as it came out.

    Attributes
    ----------
    choices : Choices
        The study that was run.
    ensemble : Ensemble
    reference : TrainingImage or None
        The hidden truth of its hard data, where there is one.
    at : datetime
        When it was finished.
    """

    choices: Choices
    ensemble: Ensemble
    reference: TrainingImage | None
    at: datetime

    @classmethod
    def of(
        cls, choices: Choices, ensemble: Ensemble, reference: TrainingImage | None = None
    ) -> PastRun:
        """Return a run that has just come out."""
        return cls(choices, ensemble, reference, datetime.now().astimezone())

    @property
    def key(self) -> str:
        """What tells it from the other runs of the session."""
        return self.at.isoformat()

    @property
    def nbytes(self) -> int:
        """Memory of the realizations, in indices and, where they differ, in codes too."""
        ensemble = self.ensemble
        in_codes = ensemble.realizations
        own = 0 if in_codes is ensemble.indices else in_codes.nbytes
        return ensemble.indices.nbytes + own + ensemble.data_status.nbytes


@dataclass
class PastRuns:
    """The latest runs, newest first, in the memory that the server gives each session for them.

    Examples
    --------
    >>> PastRuns().runs
    []
    """

    runs: list[PastRun] = field(default_factory=list)
    most_runs: int = MAX_RUNS
    most_bytes: int | None = None

    def remember(self, run: PastRun) -> None:
        """Keep a run; the same study again takes the place of the newest, the oldest go.

        The newest is kept whatever it takes: it is on the page anyway.
        """
        if self.runs and self.runs[0].choices == run.choices:
            self.runs.pop(0)
        self.runs.insert(0, run)
        while len(self.runs) > 1 and (len(self.runs) > self.most_runs or self._too_large()):
            self.runs.pop()

    def _too_large(self) -> bool:
        own = self.most_bytes
        most = limits_of_environment().history if own is None else own
        return sum(run.nbytes for run in self.runs) > most
