"""Parts of a run, a few realizations each, which are simulated in other processes or machines."""

from __future__ import annotations

import os
import pickle
import shutil
import socket
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Future, wait
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

from ccwsim.engine.kernel_cache import SOURCE
from ccwsim.engine.prepared_image import PreparedImage
from ccwsim.engine.realization import Realization
from ccwsim.jobs.workers import WORKER_POLL_SECONDS
from ccwsim.model import CCWSIMError, Watch, refused
from ccwsim.run.executors.threads import Take, ThreadRunner, Work

PART_SECONDS = 0.25
"""Intended duration of a part in seconds, which is long compared with the transfer of a part."""
PART_BYTES = 64_000_000
PARTS_PER_WORKER = 2
"""Number of parts sent to each worker at a time, so that no worker waits for its next part."""
REPORT_SECONDS = 0.2  # seconds between two reports of a worker, each of which may stop it
STOP_PARTS_SECONDS = 0.7
"""Seconds that running parts have after a stop to return their finished realizations."""
MAX_STUDIES = 4  # maximum number of recent studies that a worker keeps

Reply = dict[int, Realization]
"""The finished realizations of a part, by number; some are missing if the run was stopped."""


@dataclass(frozen=True)
class Folder:
    """A channel from workers to the caller: a folder of reports, which is removed to stop.

    Workers on other machines do not see the folder, and finish their parts.
    """

    path: str = field(default_factory=lambda: tempfile.mkdtemp(prefix="ccwsim-"))
    host: str = field(default_factory=socket.gethostname)

    def report(self, first: int, share: float) -> bool:
        """Append a share to the reports of a part; return whether to stop."""
        with suppress(OSError), open(Path(self.path, str(first)), "a") as reports:
            reports.write(f"{share}\n")  # a failed report must not end the part
        return self.host == socket.gethostname() and not os.path.exists(self.path)

    def share(self, first: int) -> float:
        """Return the latest reported share of a part."""
        with suppress(FileNotFoundError, IndexError):  # no report yet
            return float(Path(self.path, str(first)).read_text().split()[-1])
        return 0.0

    def stop(self) -> None:
        """Ask all workers to stop."""
        shutil.rmtree(self.path, ignore_errors=True)


def simulate_part(
    content: bytes, source: str, numbers: range, keep_sources: bool, channel: Any
) -> Reply:
    """Simulate realizations of the study that is pickled in `content`; called by a worker.

    `source` is the digest of the caller's kernels; other kernels may give different realizations.
    The `channel` is a `Folder` or an object with the same methods.
    """
    if source != SOURCE:
        raise refused("other_version")
    first, reply = numbers[0], Reply()
    share = next_report = 0.0

    def progress(fraction: float, n_done: int) -> None:
        nonlocal share
        share = fraction

    def cancel() -> bool:
        nonlocal next_report
        if time.monotonic() < next_report:
            return False
        next_report = time.monotonic() + REPORT_SECONDS
        return channel.report(first, share)

    prepared = _image_of(content)
    work = Work(prepared.study, first, len(numbers), keep_sources)
    runner = ThreadRunner(work, 1, prepared=prepared)
    watch = Watch(progress, cancel)
    if not cancel() and runner.prepare(Watch(cancel=cancel)):
        runner.run(lambda k, r: reply.update({numbers[k]: r}), watch)
    return reply


@lru_cache(MAX_STUDIES)
def _image_of(content: bytes) -> PreparedImage:
    """Return the prepared image of a pickled study, which is kept for its next parts."""
    return PreparedImage(pickle.loads(content))


class PartRunner:
    """Runs realizations in parts, a few at a time, on an executor, which stays open.

    `n_workers` applies only if the executor does not report its number of workers.
    """

    def __init__(self, work: Work, executor: Any, n_workers: int) -> None:
        self._work, self._executor = work, executor
        self._n_workers = getattr(executor, "_max_workers", None) or n_workers
        self._finished: list[int] = []
        self._seconds = 0.0

    def prepare(self, watch: Watch) -> bool:
        """Prepare to send parts, and return True."""
        watch.progress(0.0, 0)
        self._content, self._channel = self._send(pickle.dumps(self._work.study))
        return True

    def _send(self, content: bytes) -> tuple[Any, Any]:
        """Return the content that is sent with each part, and the channel of the workers."""
        return content, Folder()

    def n_workers(self) -> int:
        """Return the number of parts that run at a time."""
        return self._n_workers

    def run(self, take: Take, watch: Watch) -> list[int]:
        """Run the realizations like `ThreadRunner.run`; parts finish in any order."""
        n, channel = self._work.n, self._channel
        waiting = range(self._work.first, self._work.first + n)
        sent: dict[Future[Reply], range] = {}
        try:
            while waiting or sent:
                while waiting and len(sent) < PARTS_PER_WORKER * self.n_workers():
                    size = self._size_of_part(len(waiting))
                    sent[self._submit(waiting[:size])] = waiting[:size]
                    waiting = waiting[size:]
                for future in wait(sent, WORKER_POLL_SECONDS, FIRST_COMPLETED).done:
                    del sent[future]
                    self._keep(take, future)
                n_done = len(self._finished)
                begun = sum(len(part) * channel.share(part[0]) for part in sent.values())
                watch.progress((n_done + begun) / n, n_done)
                if n_done < n and watch.cancel():
                    break
        finally:
            channel.stop()
            running = [future for future in sent if not future.cancel()]
            for future in wait(running, STOP_PARTS_SECONDS).done:
                if future.exception() is None:
                    self._keep(take, future)
        return sorted(self._finished)

    def _size_of_part(self, n_left: int) -> int:
        """Return the number of realizations to send, based on the time of the latest one."""
        fit = PART_BYTES / self._work.study.grid.n_cells
        fit = min(fit, PART_SECONDS / self._seconds if self._seconds else 1)
        fair = -(-n_left // (PARTS_PER_WORKER * self.n_workers()))
        return max(min(int(fit), fair), 1)

    def _submit(self, numbers: range) -> Future[Reply]:
        keep_sources, channel = self._work.keep_sources, self._channel
        with self._explained():
            try:
                return self._executor.submit(
                    simulate_part, self._content, SOURCE, numbers, keep_sources, channel
                )
            except BrokenExecutor:
                raise
            except RuntimeError as error:
                raise CCWSIMError(f"the executor takes no work: {error}; use a new one") from error

    def _keep(self, take: Take, future: Future[Reply]) -> None:
        with self._explained():
            reply = future.result()
        for number, realization in reply.items():
            k = number - self._work.first
            take(k, realization)
            self._finished.append(k)
            self._seconds = realization.cpu_seconds

    @contextmanager
    def _explained(self) -> Iterator[None]:
        """Raise the known errors of workers with messages; other errors are raised unchanged."""
        try:
            yield
        except BrokenExecutor as error:
            raise refused("worker_ended") from error
        except CancelledError as error:
            raise refused("workers_lost") from error
        except ImportError as error:
            raise refused("worker_cannot_import", error=error) from error
