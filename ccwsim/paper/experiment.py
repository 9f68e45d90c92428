"""What an experiment of the paper is, how much of it is run, and what comes out of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from ccwsim.model.ensemble import Ensemble
from ccwsim.model.errors import Cancelled
from ccwsim.model.hard_data import HardData
from ccwsim.model.parameters import Parameters
from ccwsim.model.training_image import TrainingImage
from ccwsim.paper.inputs import Inputs
from ccwsim.report import Block, Judgement
from ccwsim.run.simulation import simulate


@dataclass(frozen=True)
class Extent:
    """How much of the paper is run: everything in minutes, or a little of everything in seconds.

    Attributes
    ----------
    name : str
        "full" or "quick".
    n_many : int
        Realizations where the paper has 100.
    n_few : int
        Realizations where methods are compared in pictures and curves.
    n_anodi : int
        Realizations of each method for the analysis of distances.
    n_timed : int
        Realizations whose times are averaged.
    largest_side : int
        Longest side of a grid that is not about time, in cells.
    timed_sides : tuple of int
        Sides of the square grids whose time is measured.
    largest_lag : int
        Of variograms and connectivity, in cells.
    """

    name: str
    n_many: int
    n_few: int
    n_anodi: int
    n_timed: int
    largest_side: int
    timed_sides: tuple[int, ...]
    largest_lag: int

    @property
    def is_full(self) -> bool:
        """Whether grids are the paper's, so that its seconds can stand beside ours."""
        return self.name != "quick"

    def side(self, wanted: int) -> int:
        """Return a side that the paper uses, made smaller where this extent asks for it.

        Examples
        --------
        >>> FULL.side(512), QUICK.side(512)
        (512, 144)
        """
        return min(wanted, self.largest_side)


FULL = Extent("full", 100, 10, 50, 9, 1000, (500, 1000, 1500, 2000, 2500), 100)
QUICK = Extent("quick", 6, 3, 4, 2, 144, (64, 128, 192), 40)


@dataclass
class Run:
    """What an experiment is given: inputs, extent, seed, and ways to report and to be stopped.

    `progress` is called with the share of the experiment that is done; `cancel` says whether to
    stop.
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
        """Note that a step is done; raise Cancelled where the user has asked to stop."""
        self._done += 1
        self.progress(min(self._done / self._steps, 1.0))
        if self.cancel():
            raise Cancelled("stopped")

    def report(self, share: float, n_done: int) -> None:
        """Tell the share of an experiment that counts what is done by itself."""
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
        Section, figure or table of the paper.
    shows : str
        What the paper shows there; nothing that is not known.
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
