"""What the page that compares settings remembers."""

from __future__ import annotations

from dataclasses import dataclass, field

from ccwsim.experiments.comparison import Comparison
from ccwsim.model.choices import DataChoice, ImageChoice
from ccwsim.model.grid import Grid
from ccwsim.model.parameters import Parameters
from ccwsim.ui.jobs.job import Job

LETTERS = ("A", "B", "C", "D")
"""What the settings are called; A is the study's own."""


@dataclass(frozen=True)
class Asked:
    """What a comparison is asked for: it is out of date where the page would ask another one."""

    image: ImageChoice
    data: DataChoice
    grid: Grid
    seed: int
    n: int
    settings: tuple[Parameters, ...]

    @property
    def key(self) -> tuple:
        """Equal where the same would come out: colours of the facies do not count."""
        return self.image.digest, self.data, self.grid, self.seed, self.n, self.settings


@dataclass
class Run:
    """A comparison that is going on.

    Attributes
    ----------
    asked : Asked
    so_far : Comparison or None
        What is known of it.
    n_parts : int
        How often there was more.
    """

    asked: Asked
    so_far: Comparison | None = None
    n_parts: int = 0

    def tell(self, found: Comparison) -> None:
        """Take what is known so far."""
        self.so_far = found
        self.n_parts += 1


@dataclass
class Comparing:
    """What the page remembers.

    Attributes
    ----------
    others : list of Parameters or None
        The settings beside the study's own; None is what is usual in that place, and follows the
        study.
    n : int
        Realizations of each setting.
    job : Job or None
        The comparison that runs now; its `about` is a `Run`.
    found : Comparison or None
        The latest one, and what was `asked` for it.
    message : str
        What went wrong or was stopped.
    shown : int
        Which realization of all settings is shown.
    """

    others: list[Parameters | None] = field(default_factory=lambda: [None, None])
    n: int = 12
    job: Job[Comparison] | None = None
    found: Comparison | None = None
    asked: Asked | None = None
    message: str = ""
    shown: int = 0
