"""Simulation by a worker that shares no memory with the caller, with requests and replies."""

import os
import pickle
import shutil
import socket
import tempfile
import time
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from threading import Event
from typing import Protocol

from ccwsim.engine.kernel_cache import SOURCE
from ccwsim.engine.prepared_image import PreparedImage
from ccwsim.engine.realization import Realization, compile_kernels, simulate_realization
from ccwsim.jobs.workers import Watch
from ccwsim.model.arrays import digest
from ccwsim.model.errors import Cancelled, refused
from ccwsim.model.hard_data import HardData
from ccwsim.model.study import Study
from ccwsim.model.training_image import TrainingImage
from ccwsim.system.lru_cache import LruCache

FLAG_SECONDS = 0.2
"""Seconds between two polls of the stop flag by a worker, which reports progress at each poll."""
MAX_STUDIES = 4  # maximum number of recent studies that a worker keeps


def serialized(study: Study) -> bytes:
    """Return a study as bytes, without cached attributes."""
    image, data = study.training_image, study.hard_data
    parts = (image.array, image.name, image.facies_names), (data.cells, data.facies)
    return pickle.dumps((*parts, study.grid, study.parameters, study.seed, study.secondary))


def deserialized(content: bytes) -> Study:
    """Return the study in these bytes, with the read-only arrays that kernels expect."""
    (array, name, facies_names), data, *settings, secondary = pickle.loads(content)
    grid, parameters, seed = settings
    image = TrainingImage(array, name=name, facies_names=facies_names)
    return Study(image, grid, parameters, HardData(*data), seed, secondary)


def study_key(study: Study) -> str:
    """Return a short key of a study; studies with equal realizations have equal keys."""
    image, data = study.training_image.digest, study.hard_data.digest
    secondary = study.secondary and study.secondary.digest
    return digest(image, study.grid, study.parameters, data, study.seed, secondary)


class Flag(Protocol):
    """Tells a worker to stop, and reports its progress to the caller."""

    def is_set(self) -> bool: ...

    def report(self, number: int, share: float) -> None:
        """Report which share of a realization is finished."""
        ...


@dataclass(frozen=True)
class FileFlag:
    """A folder of reports, removed to stop; workers elsewhere do not see it and go on."""

    path: str = field(default_factory=lambda: tempfile.mkdtemp(prefix="ccwsim-"))
    host: str = field(default_factory=socket.gethostname)

    def set(self) -> None:
        """Ask all workers to stop."""
        shutil.rmtree(self.path, ignore_errors=True)

    def is_set(self) -> bool:
        """Return whether the work should stop."""
        return self.host == socket.gethostname() and not os.path.exists(self.path)

    def report(self, number: int, share: float) -> None:
        """Write to the folder which share of a realization is finished, if the folder exists."""
        with suppress(FileNotFoundError):
            (Path(self.path) / str(number)).write_text(str(share))

    def shares(self, numbers: Iterable[int]) -> dict[int, float]:
        """Return which share of each realization is finished, as last reported."""
        shares = {}
        for number in numbers:
            with suppress(FileNotFoundError, ValueError):  # no report yet, or it is being written
                shares[number] = float((Path(self.path) / str(number)).read_text())
        return shares


@dataclass(frozen=True)
class BatchRequest:
    """A request for realizations of a study, identified by its key."""

    study: str
    numbers: tuple[int, ...]
    keep_sources: bool
    flag: Flag
    source: str = SOURCE
    """Digest of the caller's kernels; different kernels may give different realizations."""


@dataclass(frozen=True)
class Reply:
    """The realizations of a request; some of them are missing if the stop flag was set."""

    known: bool
    """False if the worker lacks the study; the request must then be resent with the study."""
    realizations: list[Realization]
    seconds: float = 0.0
    """Seconds per realization, from which the size of the next batches is computed."""


class FlagWatch(Watch):
    """A watch that polls a flag every `FLAG_SECONDS` and reports progress to the flag."""

    def __init__(self, flag: Flag) -> None:
        self._flag, self._raised = flag, Event()
        super().__init__(self._raised)
        self._number: int | None = None
        self._next = 0.0

    def begin(self, number: int) -> None:
        """Switch to reporting the progress of another realization."""
        self._number, self.share = number, 0.0
        self.check()

    def check(self) -> None:
        """Raise `Cancelled` if the flag was set at the latest poll."""
        if time.monotonic() >= self._next:
            if self._flag.is_set():
                self._raised.set()
            elif self._number is not None:
                with suppress(OSError):  # a failed report must not end the realization
                    self._flag.report(self._number, self.share)
            self._next = time.monotonic() + FLAG_SECONDS
        super().check()


_studies: LruCache[tuple[Study, PreparedImage]] = LruCache(MAX_STUDIES)


def simulate_batch(request: BatchRequest, content: bytes | None) -> Reply:
    """Simulate realizations. `content` is the study; it may be None if the worker has the study."""
    if request.source != SOURCE:
        raise refused("other_version")
    prepared = _recall(request.study, content)
    if prepared is None:
        return Reply(False, [])
    study, image = prepared
    watch = FlagWatch(request.flag)
    finished: list[Realization] = []
    start = time.perf_counter()
    try:
        compile_kernels(study, image, watch)
        start = time.perf_counter()
        for number in request.numbers:
            watch.begin(number)
            finished.append(simulate_realization(study, number, image, request.keep_sources, watch))
    except Cancelled:
        pass
    seconds = (time.perf_counter() - start) / max(len(finished), 1)
    return Reply(True, finished, seconds)


def _recall(key: str, content: bytes | None) -> tuple[Study, PreparedImage] | None:
    """Return a study and its prepared image, kept from an earlier request if possible."""
    prepared = _studies.get(key)
    if prepared is None and content is not None:
        study = deserialized(content)
        prepared = study, PreparedImage(study)
        _studies.put(key, prepared)
    return prepared
