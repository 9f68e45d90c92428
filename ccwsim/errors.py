"""What can go wrong, said so that the user can mend it."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ccwsim.ensemble import Ensemble


class CCWSIMError(ValueError):
    """Bad input: the message names the value and what to do about it."""


class Cancelled(CCWSIMError):
    """The user stopped a simulation.

    Attributes
    ----------
    ensemble : Ensemble or None
        The realizations that were finished before, None where there was none.
    """

    def __init__(self, message: str, ensemble: Ensemble | None = None) -> None:
        super().__init__(message)
        self.ensemble = ensemble
