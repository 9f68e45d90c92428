"""What the page that follows a realization remembers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ccwsim.engine.trace import Trace
from ccwsim.model.parameters import Parameters


@dataclass
class How:
    """What the page remembers.

    Attributes
    ----------
    parameters : Parameters or None
        The page's own setting; None is the study's, and follows it.
    number : int
        Which realization is followed.
    patch : int
        Which patch is shown.
    playing : bool
        Whether it goes on by itself.
    ticked : float
        When it last did.
    ground : str
        What lies under the marked places: "score", "costs" (with those of data), or "image".
    facies : int
        Whose coefficients are shown.
    datum : int
        Which of the mended data is shown.
    trace : Trace or None
        The latest one, and what was `traced`; None where the study cannot be followed.
    mended : optional
        What was `traced` when the part on mending was drawn.
    """

    parameters: Parameters | None = None
    number: int = 0
    patch: int = -1
    playing: bool = False
    ticked: float = 0.0
    ground: str = "score"
    facies: int = 1
    datum: int = 0
    trace: Trace | None = None
    traced: Any = None
    mended: Any = None

    def go(self, patch: int) -> None:
        """Show another patch; whatever the user does stops the play."""
        self.patch, self.playing = patch, False

    def leave(self) -> None:
        """Follow nothing."""
        self.trace = self.traced = None
        self.playing = False

    def look_at(self, datum: int) -> None:
        """Show how another datum was mended."""
        self.datum, self.playing = datum, False

    def show(self, ground: str) -> None:
        """Show other things under the marked places."""
        self.ground, self.playing = ground, False
