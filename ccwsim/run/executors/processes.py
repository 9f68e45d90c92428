"""Realizations in worker processes, so that a crash of compiled code ends only its own run."""

import time
from collections.abc import Callable
from contextlib import nullcontext, suppress
from dataclasses import dataclass
from functools import partial
from math import inf
from queue import Empty, SimpleQueue
from threading import Lock
from typing import Any, NamedTuple

from ccwsim.engine.kernel_cache import FOLDER_VARIABLE, KERNEL_FOLDER
from ccwsim.engine.prepared_image import (
    PreparedImage,
    divide_images,
    fresh_images,
    keeps_images,
)
from ccwsim.engine.realization import compile_kernels
from ccwsim.jobs.child import (
    CAN_FORK,
    CONNECTION_ERRORS,
    ChildProcess,
    ProcessTemplate,
    WarmProcesses,
    bound,
    connect_to_parent,
    fork_on_request,
    send_answer,
)
from ccwsim.jobs.limits import RESERVE, free_bytes, limits_of_environment
from ccwsim.jobs.workers import WORKER_POLL_SECONDS, stoppable
from ccwsim.model import UNWATCHED, Study, Watch, refused
from ccwsim.run.executors.threads import Take, ThreadRunner, Work
from ccwsim.system.machine import n_cores
from ccwsim.system.memory import give_back_memory, settle_memory

MAX_IDLE = n_cores() + 1  # worker processes that are kept for the next runs
STOP_RUN_SECONDS = 5.0  # seconds that a run has to end after a stop, before its process is killed
ENVIRONMENT = {"OPENBLAS_NUM_THREADS": "1", FOLDER_VARIABLE: KERNEL_FOLDER}
"""Variables of worker processes: a template may have only one thread, and compiles no kernels."""


class Request(NamedTuple):
    """A run that a worker process simulates; None asks it to stop."""

    work: Work
    n_workers: int
    keeps_images: bool
    memory: int | None  # maximum further bytes of memory


@dataclass(frozen=True)
class End:
    """The last answer of a run, with its error if it failed.

    The answers before it are {k: realization} and (finished share, number of realizations).
    """

    error: Exception | None


class ProcessRunner(ThreadRunner):
    """Runs realizations on threads of a worker process; kernels are compiled by this process."""

    loads_kernels = False

    def run(self, take: Take, watch: Watch) -> list[int]:
        """Run the realizations like `ThreadRunner.run`."""
        finished: list[int] = []
        kill_at, answer = inf, None
        free = free_bytes(limits_of_environment())
        memory = None if free is None else free + RESERVE
        request = Request(self._work, self._n_workers, keeps_images(), memory)
        with _workers.process(partial(_start, self._work.study)) as process:
            _send(process, request)
            while not isinstance(answer, End):
                if kill_at == inf and watch.cancel():
                    kill_at = time.monotonic() + STOP_RUN_SECONDS
                    _send(process, None)
                elif time.monotonic() > kill_at:
                    process.kill()
                try:
                    answer = process.received.get(timeout=WORKER_POLL_SECONDS)
                except Empty:
                    continue
                if isinstance(answer, dict):
                    for k, realization in answer.items():
                        take(k, realization)
                        finished.append(k)
                elif isinstance(answer, tuple):
                    share, n_done = answer
                    watch.progress(share, n_done)
                elif isinstance(answer, Exception):
                    if kill_at == inf:
                        raise refused("run_process_ended") from answer
                    process.end()
                    answer = End(None)
        if answer.error is not None:
            raise answer.error
        return sorted(finished)


def _send(process: ChildProcess, request: Request | None) -> None:
    with suppress(*CONNECTION_ERRORS):  # `received` contains the error
        process.send(request)


_workers = WarmProcesses(MAX_IDLE)
_template: ProcessTemplate | None = None
_template_lock = Lock()  # held while the template is used
is_used = False  # whether runs simulate in worker processes


def use_processes() -> None:
    """Make all later runs of this process simulate in worker processes, except on executors."""
    global is_used
    is_used = True
    if CAN_FORK:
        with _template_lock:
            _running_template()  # the first run does not wait for its imports


def _running_template() -> ProcessTemplate:
    global _template
    if _template is None or not _template.runs():
        _template = ProcessTemplate(fork_workers, ENVIRONMENT)
    return _template


def _start(study: Study) -> ChildProcess:
    """Start a worker process: if the system can fork, a fork with the kernels of a study."""
    for _ in range(CAN_FORK * 2):
        with _template_lock, suppress(*CONNECTION_ERRORS):  # the template may have ended
            return _running_template().fork(study)
    return ChildProcess(serve_runs, ENVIRONMENT)


def fork_workers() -> None:
    """Fork worker processes, each with the kernels of a study."""
    fork_on_request(lambda study: compile_kernels(PreparedImage(study), UNWATCHED), serve_runs)


def serve_runs() -> None:
    """Simulate the runs that the parent process requests, until it ends."""
    requests, answers = connect_to_parent(niceness=0)
    settle_memory(max(2, n_cores()))
    divide_images(MAX_IDLE)
    lock = Lock()

    def send(answer: object) -> None:
        with lock:
            send_answer(answers, answer)

    while True:
        request = requests.get()
        if request is not None:  # None is a stop request that arrived after the end of a run
            bound(request.memory)
            send(End(_run(request, requests, send)))
            bound()
            del request
            give_back_memory()


def _run(
    request: Request, requests: SimpleQueue[Any], send: Callable[[object], None]
) -> Exception | None:
    """Simulate a run, send its realizations, and return the error with which it failed, if any."""

    def stopped() -> bool:
        return not requests.empty()

    def progress(share: float, n_done: int) -> None:
        send((share, n_done))

    try:
        with stoppable(stopped), nullcontext() if request.keeps_images else fresh_images():
            runner = ThreadRunner(request.work, request.n_workers)
            watch = Watch(progress, stopped)
            if runner.prepare(watch):
                runner.run(lambda k, r: send({k: r}), watch)
    except Exception as error:
        return error
    return None
