"""Runners of realizations on threads, in processes, on any executor, or on a Dask cluster."""

import sys
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import nullcontext
from threading import current_thread
from typing import Any, SupportsIndex

from ccwsim.model import check_int, refused, shown
from ccwsim.run.executors import processes
from ccwsim.run.executors.cluster import ClusterRunner, connect, executor_of_environment
from ccwsim.run.executors.parts import PartRunner
from ccwsim.run.executors.threads import Take, ThreadRunner, Work
from ccwsim.system.machine import n_cores

__all__ = ["Take", "Work", "connect", "executor_of_environment", "runner_of"]


def runner_of(
    work: Work, executor: Any = None, n_workers: SupportsIndex | None = None
) -> ThreadRunner | PartRunner:
    """Return a runner for an executor or a Dask client; without these, for this machine."""
    workers = n_cores() if n_workers is None else check_int("n_workers", n_workers, 1)
    if executor is None and processes.is_used:
        return processes.ProcessRunner(work, workers)
    if executor is None or _is_own_pool(executor):
        return ThreadRunner(work, workers)  # a thread that waits for its own pool may wait forever
    if isinstance(executor, ThreadPoolExecutor):
        return ThreadRunner(work, workers, executor)
    if isinstance(executor, Executor):
        return PartRunner(work, executor, workers)
    dask = sys.modules.get("distributed")  # if distributed is not imported, no client can exist
    if dask is not None and isinstance(executor, dask.Client):
        return ClusterRunner(work, executor)
    raise refused("executor", given=shown(executor))


def _is_own_pool(executor: Any) -> bool:
    """Return whether this thread belongs to `executor`, whose lock is held while threads start."""
    with getattr(executor, "_shutdown_lock", nullcontext()):
        return current_thread() in getattr(executor, "_threads", ())
