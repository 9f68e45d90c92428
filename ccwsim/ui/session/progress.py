"""The progress of a job as text: finished pieces, remaining time, queue position, compilation."""

from ccwsim.engine.compilation import compilation, must_compile
from ccwsim.jobs.job import Job
from ccwsim.model import duration
from ccwsim.ui.widgets import page_labels

SLOW_START = 0.8
"""Number of seconds without progress after which a job is assumed to compile kernels."""


def progress_text(job: Job, label: str = "") -> str:
    """Return the progress of a job as text; `label` replaces the number of finished pieces."""
    if delay := delay_text(job):
        return f"{label} · {delay}" if label else delay
    text = label or f"{job.n_done:,} of {job.n:,} {job.unit}"
    seconds = job.seconds_left
    return text if seconds is None else f"{text} · {duration(seconds, rough=True)} left"


def delay_text(job: Job) -> str:
    """Return the reason (stop, queue or compilation) why a job makes no progress, or ""."""
    if job.is_cancelled():
        return "Stopping …"
    if position := job.position:
        return queue_text(position)
    if job.fraction == 0 and job.seconds > SLOW_START:
        return compilation_text()
    return ""


def queue_text(position: int) -> str:
    """Return the position of a waiting job as text."""
    return f"Waiting: {ordinal(position)} in the queue"


def compilation_text() -> str:
    """Describe the progress of compilation: features, number of kernels, and remaining time."""
    text = "Compiling kernels for this kind of study, once on this machine"
    if progress := compilation():
        features = sorted({page_labels("kernels")[module] for module in progress.modules})
        text += f" ({', '.join(features)}): {progress.n_done} of {progress.n} done"
        if progress.seconds_left is not None:
            text += f", about {duration(progress.seconds_left, rough=True)} left"
    return text + " …"


def compilation_to_come() -> str:
    """Return a note that kernels must compile first, or "" if all kernels are compiled already."""
    return " Kernels are compiled first; this happens only once." if must_compile() else ""


def ordinal(number: int) -> str:
    """Return the ordinal of a number."""
    special = {1: "st", 2: "nd", 3: "rd"} if number % 100 not in (11, 12, 13) else {}
    return f"{number}{special.get(number % 10, 'th')}"
