"""What can be undone: hard data and the ensemble that answered them, moment by moment."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from ccwsim.model.choices import DataChoice
from ccwsim.model.ensemble import Ensemble
from ccwsim.model.training_image import TrainingImage

MAX_MOMENTS = 200
MAX_BYTES = 200_000_000
"""Of realizations; older moments keep their data only."""


@dataclass(frozen=True, eq=False)
class Moment:
    """The data at one moment, with what was shown for them.

    Attributes
    ----------
    data : DataChoice
    ensemble : Ensemble or None
    reference : TrainingImage or None
        The hidden truth that the data were sampled from.
    revised : bool
        Whether the ensemble was mended around edits since it was simulated.
    """

    data: DataChoice
    ensemble: Ensemble | None = None
    reference: TrainingImage | None = None
    revised: bool = False


@dataclass
class History:
    """Moments before the present one, and those that were undone, the nearest last.

    Examples
    --------
    >>> history = History()
    >>> none, some = Moment(DataChoice("none")), Moment(DataChoice("placed"))
    >>> history.remember(none)
    >>> history.undo(some) is none, history.redo(none) is some, history.redo(some)
    (True, True, None)
    """

    past: list[Moment] = field(default_factory=list)
    future: list[Moment] = field(default_factory=list)

    def remember(self, now: Moment) -> None:
        """Keep a moment that is about to be changed; what was undone before is forgotten."""
        self.past.append(now)
        self.future.clear()
        self._forget()

    def undo(self, now: Moment) -> Moment | None:
        """Return the moment before, None where there is none."""
        return self._step(self.past, self.future, now)

    def redo(self, now: Moment) -> Moment | None:
        """Return the moment that was undone last, None where there is none."""
        return self._step(self.future, self.past, now)

    def _step(self, back: list[Moment], forth: list[Moment], now: Moment) -> Moment | None:
        if not back:
            return None
        forth.append(now)
        moment = back.pop()
        self._forget()
        return moment

    def _forget(self) -> None:
        del self.past[:-MAX_MOMENTS]
        for moments in (self.past, self.future):
            left, kept = MAX_BYTES // 2, set()
            for k in reversed(range(len(moments))):
                ensemble = moments[k].ensemble
                if ensemble is None or id(ensemble) in kept:
                    continue
                left -= ensemble.indices.nbytes
                kept.add(id(ensemble))
                if left < 0:
                    moments[k] = replace(moments[k], ensemble=None)
