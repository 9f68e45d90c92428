"""What the editor of hard data remembers besides the study itself."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

from ccwsim.model.choices import ImageChoice
from ccwsim.model.ensemble import Ensemble
from ccwsim.ui.hard_data.history import History

Ground = Literal["realization", "e_type", "empty"]
Way = Literal["random", "N-S", "E-W", "grid"]


@dataclass(frozen=True)
class Sampling:
    """How a known field is to be sampled.

    Attributes
    ----------
    way : str
        At random, along wells N–S or E–W, or on a regular grid.
    n : int
        How many data, or wells.
    every : int
        Cells from one datum to the next, along a well or on the grid.
    seed : int
    """

    way: Way = "random"
    n: int = 100
    every: int = 8
    seed: int = 1


@dataclass
class Table:
    """The table of data: what it started from, and what the user's edits of it gave.

    Attributes
    ----------
    world : bool
        Whether places are x and y, else row and column.
    base : DataFrame or None
        The rows before the edits that the widget holds.
    of : tuple
        What `base` and its edits stand for; another one means a new base.
    version : int
        Counts the bases.
    notes : list of str
        What was wrong in the rows.
    """

    world: bool = True
    base: Any = None
    of: tuple = ()
    version: int = 0
    notes: list[str] = field(default_factory=list)


@dataclass
class Editor:
    """What the page of hard data remembers.

    Attributes
    ----------
    ground : str
        What lies under the data.
    history : History
    taken : int
        The number of the last edit of the canvas that was taken.
    answered : Ensemble or None
        The last ensemble that was mended around edits instead of simulated.
    reference_choice : ImageChoice or None
        An image of the user's to sample, None for the shown realization.
    message : str
        What went wrong with the last edit.
    """

    ground: Ground = "realization"
    history: History = field(default_factory=History)
    sampling: Sampling = Sampling()
    reference_choice: ImageChoice | None = None
    table: Table = field(default_factory=Table)
    taken: int = 0
    answered: Ensemble | None = None
    message: str = ""
