"""Start a comparison, follow it, and take in what it gives."""

from __future__ import annotations

from ccwsim.experiments.comparison import Comparison, add_curves, compare
from ccwsim.model.errors import Cancelled, CCWSIMError
from ccwsim.model.study import Study
from ccwsim.ui.compare.settings import LETTERS, MIN_SETTINGS, Asked, Comparing, Run, settings_of
from ccwsim.ui.jobs.job import Job
from ccwsim.ui.jobs.limits import Demand, demand_of
from ccwsim.ui.session.fragments import follow
from ccwsim.ui.session.resolve import data_of, image_of
from ccwsim.ui.session.state import State
from ccwsim.ui.study.run import failed


def asked_of(state: State) -> Asked:
    """Return what a comparison would be asked for now."""
    c = state.choices
    return Asked(c.image, c.data, c.grid, c.seed, state.page(Comparing).n, settings_of(state))


def start_comparison(state: State) -> None:
    """Compare the settings as they are; a comparison that is still going is stopped."""
    page_state = state.page(Comparing)
    try:
        run = Run(asked_of(state))
        image, data = image_of(state.choices.image), data_of(state.choices)
    except CCWSIMError as error:
        page_state.message = str(error)
        return
    if page_state.job is not None:
        page_state.job.cancel()
    asked, facies = run.asked, min(state.facies, image.n_facies - 1)

    def work(job: Job[Comparison]) -> Comparison:
        study = (image, asked.grid, dict(zip(LETTERS, asked.settings, strict=False)), data)
        options = (asked.n, asked.seed, job.report, job.is_cancelled)
        return compare(*study, *options, facies=facies, on_partial=run.take)

    page_state.message = ""
    try:
        n = asked.n * len(asked.settings)
        page_state.job = Job(work, run, _demand(state, asked), n=n)
    except CCWSIMError as error:
        page_state.job, page_state.message = None, str(error)


def _demand(state: State, asked: Asked) -> Demand:
    """Return what a comparison asks of the server: all its realizations are kept."""
    image, data = image_of(state.choices.image), data_of(state.choices)
    each = [
        demand_of(Study(image, asked.grid, p, data, asked.seed), asked.n) for p in asked.settings
    ]
    n_cells = sum(demand.n_cells for demand in each)
    return Demand(n_cells, data.n, sum(demand.n_bytes for demand in each))


def want_curves(state: State) -> None:
    """Work out the curves of the chosen facies where the comparison does not have them yet."""
    page_state = state.page(Comparing)
    found = page_state.found
    if page_state.job is not None or found is None or has_curves(found, state.facies):
        return
    assert page_state.asked is not None
    facies, asked = state.facies, page_state.asked
    page_state.job = Job(
        lambda job: add_curves(found, facies, job.report, job.is_cancelled),
        about=Run(asked, found),
        n=asked.n * len(asked.settings),
    )


def has_curves(found: Comparison, facies: int) -> bool:
    """Return whether the curves of a facies are known."""
    return any(key[0] == facies for key in found.curves)


def collect_comparison(state: State) -> None:
    """Take what a finished job gives; earlier results stay where it gave none."""
    page_state = state.page(Comparing)
    job = page_state.job
    if job is None or not job.finished:
        return
    page_state.job = None
    run: Run = job.about
    found = job.result
    if isinstance(job.error, Cancelled):
        found = run.partial
        if found is not None and len(found.names) < MIN_SETTINGS:
            found = None
        page_state.message = _stopped(found, len(run.asked.settings), page_state.found is not None)
    elif job.error is not None:
        page_state.message = failed(job.error)
    if found is not None:
        page_state.found, page_state.asked = found, run.asked


def _stopped(found: Comparison | None, n: int, has_older: bool) -> str:
    if found is not None:
        all_ = "all" if len(found.names) == n else f"{len(found.names)} of {n}"
        return f"Stopped after {all_} settings were simulated; what was worked out is shown."
    return "Stopped before two settings were simulated." + (
        " The earlier comparison is still shown." if has_older else ""
    )


def follow_comparison(state: State, n_parts: int) -> None:
    """Show progress; draw the page again where there are more than `n_parts`, and at the end."""
    job = state.page(Comparing).job
    if job is not None:
        follow(
            job,
            on_finished=lambda: collect_comparison(state),
            has_news=lambda: job.about.n_parts != n_parts,
            label=lambda: progress_label(job),
        )


def progress_label(job: Job[Comparison]) -> str:
    """Say which work is done once all realizations are finished; empty before."""
    if job.n_done < job.n:
        return ""
    known = job.about.partial
    return "Comparing patterns" if known and known.curves else "Comparing curves"
