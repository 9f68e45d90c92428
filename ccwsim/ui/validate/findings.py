"""Findings about the realizations, which the page shows in one line at the top."""

from typing import Any

import numpy as np
import streamlit as st

from ccwsim.jobs.statistics import Task
from ccwsim.metrics import Fit
from ccwsim.model.ensemble import Ensemble
from ccwsim.model.numbers import three_digits
from ccwsim.report import verdicts
from ccwsim.report.verdicts import Verdict
from ccwsim.ui.session.state import State
from ccwsim.ui.study.data_fit import data_fit, flagged, is_judged
from ccwsim.ui.validate import statistics
from ccwsim.ui.validate.reproduction import describe_unseen_of
from ccwsim.ui.widgets.text import verdict_html

MOMENT_SECONDS = 0.1
"""Maximum seconds that the line of findings waits for the proportions."""
MAX_LISTED = 4
"""With more facies than this number, only the proportions that deviate are listed."""


def findings(state: State, ensemble: Ensemble) -> list[Verdict]:
    """Return the findings that follow from the statistics computed so far."""
    page_state = state.page(statistics.Validation)
    found = [of_data(ensemble)]
    tasks: dict[str, Task[Any]] = {
        "shares": statistics.proportions(ensemble),
        "variety": statistics.variety(ensemble),
        "checks": statistics.checks(ensemble),
    }
    if is_judged(ensemble.hard_data, ensemble.grid):
        image, data = ensemble.training_image, ensemble.hard_data
        tasks["data_fit"] = data_fit(image, data, ensemble.grid)
    for word, task in tasks.items():
        page_state.worker.ask(task)
        if page_state.worker.cache.get(task.key) is None:
            page_state.waiting[word] = task  # the finding is added when the page is drawn again
    page_state.worker.wait_for(tasks["shares"], MOMENT_SECONDS)
    known = {name: statistics.known(state, task) for name, task in tasks.items()}
    agreement = known.get("data_fit")
    if agreement and flagged(agreement):
        found.insert(0, Verdict(agreement.words, good=False))
    if known["checks"] is not None:
        found += verdicts.describe_checks(known["checks"], ensemble.training_image.facies_names)
    if known["shares"]:
        found += of_proportions(ensemble, known["shares"].fit)
    small = statistics.known(state, statistics.volume_patterns(ensemble))
    if ensemble.grid.nz is not None and small:
        found.append(Verdict(describe_unseen_of(small), good=None))
    if known["variety"] is not None and ensemble.n > 1:
        found.append(of_variety(ensemble, known["variety"]))
    apart = statistics.known(state, statistics.patterns(ensemble))
    if apart and not apart.within[0].max() > 0:
        found.append(Verdict("realizations are copies of the training image", good=False))
    return found


def of_data(ensemble: Ensemble) -> Verdict:
    """Return a finding on whether the data are honoured."""
    n = ensemble.hard_data.n
    if not n:
        return Verdict("no hard data", good=None)
    share = ensemble.n_mismatched.mean() / n
    if not share:
        return Verdict(f"all {n} data honoured in all {ensemble.n} realizations")
    return Verdict(f"{three_digits(100 * share)} % of {n} data not honoured", good=False)


def of_proportions(ensemble: Ensemble, fit: Fit | None) -> list[Verdict]:
    """Return findings on the proportions; deviations are marked as bad and include advice."""
    n = ensemble.training_image.n_facies
    off = fit.outside if fit is not None else np.zeros(n, bool)
    said = [k for k in range(1 if n == 2 else 0, n) if n <= MAX_LISTED or off[k]]
    good = [None if fit is None else not missed for missed in off]
    found = [Verdict(verdicts.describe_proportion(ensemble, k), good=good[k]) for k in said]
    if n > MAX_LISTED:
        others = "all" if not said else "the other"
        found.append(Verdict(f"{others} proportions within the scatter of TI crops"))
    advice = verdicts.advise_proportions(ensemble, fit)
    return [*found, Verdict(advice, good=None)] if advice else found


def of_variety(ensemble: Ensemble, differing: float) -> Verdict:
    """Return a finding on the differences between realizations; no difference is marked as bad."""
    shares = ensemble.proportions.mean(axis=0).tolist()
    return Verdict(
        verdicts.describe_variety(differing, shares), good=None if differing > 0 else False
    )


def draw_summary(state: State, ensemble: Ensemble) -> None:
    """Draw the findings in one line, and mark bad findings."""
    first, *others = findings(state, ensemble)
    first = first._replace(words=first.words[:1].upper() + first.words[1:])
    dot = ' <span class="dot">·</span> '
    said = dot.join(verdict_html(verdict, "fact") for verdict in (first, *others))
    st.html(f'<p class="facts judged" role="status">{said}</p>')
