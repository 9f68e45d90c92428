"""What runs in a worker that shares no memory with the caller."""

from __future__ import annotations

import time
from collections import OrderedDict
from contextlib import suppress
from dataclasses import dataclass
from threading import Lock

from ccwsim.engine.kernels import SOURCE
from ccwsim.engine.prepared_image import PreparedImage
from ccwsim.engine.realization import Realization, compile_kernels, simulate_realization
from ccwsim.model.errors import Cancelled, CCWSIMError
from ccwsim.model.study import Study
from ccwsim.run.executors.flags import POLL_SECONDS, Flag, PolledFlag
from ccwsim.run.executors.serialization import unpacked
from ccwsim.system.workers import Watch

MAX_STUDIES = 4
"""Studies that a worker remembers, the last ones it worked on."""


@dataclass(frozen=True)
class BatchRequest:
    """What a worker is asked to do.

    Attributes
    ----------
    name : str
        Of the study.
    numbers : tuple of int
        Which realizations.
    keep_sources : bool
    flag : Flag
        Raised where the work is not wanted any more.
    source : str
        Of which kernels: others would draw other realizations.
    """

    name: str
    numbers: tuple[int, ...]
    keep_sources: bool
    flag: Flag
    source: str = SOURCE


@dataclass(frozen=True)
class Reply:
    """What a worker answers.

    Attributes
    ----------
    known : bool
        Whether the worker knew the study; it must be sent with the order where it did not.
    realizations : list of Realization
        Fewer than ordered where the flag was raised.
    seconds : float
        Time for one of them, to size the next batches.
    """

    known: bool
    realizations: list[Realization]
    seconds: float = 0.0


class TellingWatch(Watch):
    """A watch that leaves word at a flag now and then how far a realization is."""

    def __init__(self, flag: Flag) -> None:
        super().__init__(PolledFlag(flag))
        self._flag = flag
        self._number: int | None = None
        self._next = 0.0

    def begin(self, number: int) -> None:
        """Say which realization is next."""
        self.check()
        self._number, self._next = number, time.monotonic() + POLL_SECONDS

    def report(self, share: float) -> None:
        """Say how much of it is done, 0 … 1."""
        super().report(share)
        if self._number is not None and time.monotonic() >= self._next:
            self._next = time.monotonic() + POLL_SECONDS
            with suppress(OSError):  # the realization is worth more than the word
                self._flag.tell(self._number, share)


_studies: OrderedDict[str, tuple[Study, PreparedImage]] = OrderedDict()
_lock = Lock()


def simulate_batch(order: BatchRequest, content: bytes | None) -> Reply:
    """Simulate some realizations of a study.

    Parameters
    ----------
    order : Order
    content : bytes or None
        The study, from `packed`; None where the worker may know it from before.
    """
    if order.source != SOURCE:
        raise CCWSIMError(
            "a worker has another version of ccwsim, which may draw other realizations; "
            "install the same one everywhere"
        )
    found = _recall(order.name, content)
    if found is None:
        return Reply(False, [])
    study, image = found
    watch = TellingWatch(order.flag)
    finished: list[Realization] = []
    start = time.perf_counter()
    try:
        compile_kernels(study, image, watch)
        start = time.perf_counter()
        for number in order.numbers:
            watch.begin(number)
            one = simulate_realization(study, number, image, order.keep_sources, watch)
            finished.append(one)
    except Cancelled:
        pass
    seconds = (time.perf_counter() - start) / max(len(finished), 1)
    return Reply(True, finished, seconds)


def _recall(name: str, content: bytes | None) -> tuple[Study, PreparedImage] | None:
    """Return a study and its prepared image, kept from before where they can be."""
    with _lock:
        if name not in _studies:
            if content is None:
                return None
            study = unpacked(content)
            _studies[name] = study, PreparedImage(study)
            while len(_studies) > MAX_STUDIES:
                _studies.popitem(last=False)
        _studies.move_to_end(name)
        return _studies[name]
