"""Classes that describe an experiment of the paper: its extent, its run and its outcome."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from ccwsim.model.ensemble import Ensemble
from ccwsim.model.errors import Cancelled
from ccwsim.model.hard_data import HardData
from ccwsim.model.parameters import Parameters
from ccwsim.model.training_image import TrainingImage
from ccwsim.paper.inputs import PaperInputs
from ccwsim.report.document import Block, Judgement
from ccwsim.run.simulation import simulate


@dataclass(frozen=True)
class Extent:
    """Size of the experiments, which is full (takes minutes) or quick (takes seconds)."""

    name: str  # "full" or "quick"
    n_many: int  # number of realizations if the paper has 100
    n_few: int  # number of realizations for comparing methods in pictures and curves
    n_anodi: int  # number of realizations per method for the analysis of distances
    n_timed: int  # number of realizations that are timed
    largest_side: int  # maximum side in cells of grids that are not timed
    timed_sides: tuple[int, ...]  # sides in cells of the timed square grids
    largest_lag: int  # largest lag of variograms and connectivity, in cells

    @property
    def is_full(self) -> bool:
        """Whether grids are as large as in the paper; only then can times be compared."""
        return self.name != "quick"

    def side(self, wanted: int) -> int:
        """Return `side`, the side of one of the paper's grids, but at most `largest_side`."""
        return min(wanted, self.largest_side)


FULL = Extent("full", 100, 10, 50, 9, 1000, (500, 1000, 1500, 2000, 2500), 100)
QUICK = Extent("quick", 6, 3, 4, 2, 144, (64, 128, 192), 40)


@dataclass
class ExperimentRun:
    """Inputs, extent, seed and callbacks of an experiment that runs.

    `progress` is called with the finished share; `cancel` returns True to stop the run.
    """

    inputs: PaperInputs
    extent: Extent
    seed: int
    progress: Callable[[float], None] = lambda share: None
    cancel: Callable[[], bool] = lambda: False
    _steps: int = field(default=1, init=False)
    _done: int = field(default=0, init=False)

    def expect(self, steps: int) -> None:
        """Set the number of steps of the experiment; each simulation counts as one step."""
        self._steps, self._done = max(steps, 1), 0

    def step(self) -> None:
        """Count a step as done; raise `Cancelled` if `cancel` returns True."""
        self._done += 1
        self.progress(min(self._done / self._steps, 1.0))
        if self.cancel():
            raise Cancelled("stopped")

    def report(self, share: float, n_done: int) -> None:
        """Report the finished share of an experiment that does not count steps."""
        self.progress(share)

    def simulate(
        self,
        image: TrainingImage,
        shape: tuple[int, int],
        parameters: Parameters,
        data: HardData | None = None,
        n: int = 1,
        workers: int | None = None,
    ) -> Ensemble:
        """Simulate realizations and count the simulation as one step of the experiment."""

        def inside(fraction: float, n_done: int) -> None:
            self.progress(min((self._done + fraction) / self._steps, 1.0))

        ensemble = simulate(
            image, shape, parameters, data, n, self.seed, workers, inside, self.cancel
        )
        self.step()
        return ensemble


@dataclass(frozen=True, eq=False)
class Outcome:
    """Result of an experiment: blocks for the report, and judgements of the paper's statements."""

    blocks: tuple[Block, ...]
    judgements: tuple[Judgement, ...]


@dataclass(frozen=True)
class Experiment:
    """One experiment of the paper, with the function that runs it."""

    title: str
    place: str  # the section, figure or table of the paper
    shows: str  # the results that the paper shows there
    run: Callable[[ExperimentRun], Outcome]
    weight: float = 1.0  # duration relative to a typical experiment, used for progress
