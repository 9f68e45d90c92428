"""What an experiment of the paper is, what it is given, and what comes out of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from ccwsim.model.ensemble import Ensemble
from ccwsim.model.errors import Cancelled
from ccwsim.model.hard_data import HardData
from ccwsim.model.parameters import Parameters
from ccwsim.model.training_image import TrainingImage
from ccwsim.paper.extent import Extent
from ccwsim.paper.inputs import Inputs
from ccwsim.report import Block, Judgement
from ccwsim.run.simulation import simulate


@dataclass
class Run:
    """What an experiment is given: inputs, sizes, seed, and a way to tell and to be stopped.

    Attributes
    ----------
    inputs : Inputs
    extent : Extent
    seed : int
    progress : callable
        Called with the share of the experiment that is done.
    cancel : callable
        Says whether to stop.
    """

    inputs: Inputs
    extent: Extent
    seed: int
    progress: Callable[[float], None] = lambda share: None
    cancel: Callable[[], bool] = lambda: False
    _steps: int = field(default=1, init=False)
    _done: int = field(default=0, init=False)

    def expect(self, steps: int) -> None:
        """Say in how many steps the experiment will be done; each simulation is one."""
        self._steps, self._done = max(steps, 1), 0

    def step(self) -> None:
        """Note that a step is done.

        Raises
        ------
        Cancelled
            Where the user has asked to stop.
        """
        self._done += 1
        self.progress(min(self._done / self._steps, 1.0))
        self.check()

    def check(self) -> None:
        """Stop here where the user has asked to.

        Raises
        ------
        Cancelled
        """
        if self.cancel():
            raise Cancelled("stopped")

    def simulate(
        self,
        image: TrainingImage,
        shape: tuple[int, int],
        parameters: Parameters,
        data: HardData | None = None,
        n: int = 1,
        workers: int | None = None,
    ) -> Ensemble:
        """Simulate as one step of the experiment."""

        def inside(fraction: float, n_done: int) -> None:
            self.progress(min((self._done + fraction) / self._steps, 1.0))

        ensemble = simulate(
            image, shape, parameters, data, n, self.seed, workers, inside, self.cancel
        )
        self.step()
        return ensemble


@dataclass(frozen=True, eq=False)
class Outcome:
    """What an experiment gave: blocks of the report, and judgements of the paper's statements."""

    blocks: tuple[Block, ...]
    judgements: tuple[Judgement, ...]


@dataclass(frozen=True)
class Experiment:
    """One experiment of the paper.

    Attributes
    ----------
    name : str
        Short, for tests and files.
    title : str
        What it shows.
    place : str
        Section, figure or table of the paper, as far as they are known.
    shows : str
        What the paper's figure or table shows; nothing that is not known.
    run : callable
        Called as run(Run), returns an Outcome.
    weight : float
        How long it takes relative to most others, for the progress.
    """

    name: str
    title: str
    place: str
    shows: str
    run: Callable[[Run], Outcome]
    weight: float = 1.0
