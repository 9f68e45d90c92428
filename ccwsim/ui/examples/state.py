"""What the page of examples remembers: the study that was there before, and the quiz."""

from __future__ import annotations

from dataclasses import dataclass, field
from secrets import randbelow
from typing import Literal

from ccwsim.model.choices import Choices
from ccwsim.model.ensemble import Ensemble
from ccwsim.model.parameters import Parameters
from ccwsim.model.training_image import TrainingImage
from ccwsim.ui.examples.quiz_rounds import Round
from ccwsim.ui.jobs.job import Job

View = Literal["studies", "quiz"]


@dataclass
class Quiz:
    """What the quiz remembers.

    Attributes
    ----------
    image : str
        A bundled training image, or an empty text for the study's own.
    level, n_candidates, refine
        What the realizations are simulated with.
    seed : int
        Of the first round; drawn once a session.
    n_rounds : int
        How many rounds were begun.
    job : Job or None
        What draws the round; its `about` is what was asked.
    round : Round or None
        What is shown, and the `asked` that it answers.
    picked : int or None
        Which picture the reader picked.
    tallies : dict
        By setting in words, how often the training image was found, and of how many tries.
    message : str
        Why there is no round.
    """

    image: str = "channels"
    level: int = 2
    n_candidates: int = 20
    refine: bool = True
    seed: int = field(default_factory=lambda: randbelow(2**31))
    n_rounds: int = 0
    job: Job[Round] | None = None
    round: Round | None = None
    asked: tuple | None = None
    picked: int | None = None
    tallies: dict[str, tuple[int, int]] = field(default_factory=dict)
    message: str = ""


@dataclass(frozen=True, eq=False)
class Kept:
    """The reader's own study, put aside while examples are looked at."""

    choices: Choices
    ensemble: Ensemble | None
    ran: Choices | None
    reference: TrainingImage | None
    others: tuple[Parameters | None, ...]
    n_compared: int


@dataclass
class Examples:
    """What the page remembers.

    Attributes
    ----------
    view : str
        "studies" or "quiz".
    opened : str
        Name of the example that was opened last, empty where none is.
    kept : Kept or None
        What was there before the first one.
    quiz : Quiz
    """

    view: View = "studies"
    opened: str = ""
    kept: Kept | None = None
    quiz: Quiz = field(default_factory=Quiz)
