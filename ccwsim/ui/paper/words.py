"""What the page of the paper says: before, while and after its experiments run."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from ccwsim.paper import EXPERIMENTS, Finished, Inputs, summary, verdict_of
from ccwsim.ui.paper.run import PaperRun
from ccwsim.ui.widgets.errors import reason

INTRODUCTION = (
    "Runs the experiments of Bavandsavadkoohi et al. (2024), sections 5.1 to 5.9, in this program, "
    "and writes one report: each figure and table next to what the paper says, with agreement or "
    "difference in words. The report is one HTML file that works offline and prints."
)
DURATIONS = {False: "some minutes on two cores", True: "under a minute, on smaller grids"}


def said_inputs(inputs: Inputs) -> str:
    """Say what the experiments are run on.

    Examples
    --------
    >>> said_inputs(Inputs())
    'On the bundled training images and data, in place of the authors’.'
    """
    if inputs.folder is None:
        return "On the bundled training images and data, in place of the authors’."
    return "On the authors’ training images and data, which this server has."


def progress_label(run: PaperRun) -> str:
    """Say how many experiments are finished, and the name of the one that runs."""
    n = len(run.finished)
    if n >= len(EXPERIMENTS):
        return "Writing the report …"
    return f"{n} of {len(EXPERIMENTS)} experiments · now {EXPERIMENTS[n].title}"


def ended_text(run: PaperRun) -> str:
    """Say how a run ended; empty while it goes on."""
    if run.going or run.job is None:
        return ""
    if run.job.error is not None:
        return f"The run ended early: {reason(run.job.error)}"
    if run.result is None:
        return ""
    stopped = "Stopped. " if run.result.stopped else ""
    return f"{stopped}{summary(run.result)}"


def verdict_list(finished: Sequence[Finished]) -> str:
    """Return all experiments as a list in HTML: those to come are quiet, the others unfold.

    Examples
    --------
    >>> verdict_list([]).count('class="coming"') == len(EXPERIMENTS)
    True
    """
    items = []
    for k, experiment in enumerate(EXPERIMENTS):
        line = f"<b>{k + 1}</b><i>{escape(experiment.title)}</i><em>{escape(experiment.place)}</em>"
        if k >= len(finished):
            items.append(f'<div class="coming">{line}</div>')
            continue
        inside = _judged(finished[k])
        items.append(
            f"<details><summary>{line}<u>{_words(finished[k])}</u></summary>{inside}</details>"
        )
    return f'<div class="verdicts">{"".join(items)}</div>'


def _judged(finished: Finished) -> str:
    if finished.outcome is None:
        return ""
    rows = "".join(
        f"<tr><td>{escape(j.claim)}</td><td>{escape(j.found)}</td>"
        f'<td class="{j.tone}">{escape(j.word)}</td></tr>'
        for j in finished.outcome.judgements
    )
    return f"<table><tr><th>The paper says</th><th>Found here</th><th></th></tr>{rows}</table>"


def _words(finished: Finished) -> str:
    if finished.outcome is None:
        return f'<span class="bad">{escape(verdict_of(finished))}</span>'
    tones = {j.word: j.tone for j in finished.outcome.judgements}
    return ", ".join(
        f'<span class="{tones[part.split(" × ")[-1]]}">{escape(part)}</span>'
        for part in verdict_of(finished).split(", ")
    )
