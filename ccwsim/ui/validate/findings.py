"""Findings about the realizations, which the page shows in one line at the top."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import Any, NamedTuple

import numpy as np
import streamlit as st

from ccwsim.jobs.statistics import Task
from ccwsim.metrics import Fit
from ccwsim.metrics.bands import Statistic
from ccwsim.metrics.lags import DirectionName
from ccwsim.model.ensemble import Ensemble
from ccwsim.model.numbers import three_digits
from ccwsim.report.verdicts import (
    NOT_JUDGED,
    advise_proportions,
    curve_title,
    describe_curve,
    describe_geobodies,
    describe_layers,
    describe_patterns,
    describe_proportion,
    describe_variety,
    size_text,
    way_name,
)
from ccwsim.ui.session.state import State
from ccwsim.ui.study.data_fit import data_fit, flagged, is_judged
from ccwsim.ui.validate.reproduction import axis_curves, describe_unseen_of
from ccwsim.ui.validate.statistics import (
    Validation,
    curves,
    geobodies,
    known,
    layers,
    patterns,
    proportions,
    variety,
    volume_patterns,
)

MOMENT_SECONDS = 0.1
"""Maximum seconds that the line of findings waits for the proportions."""
MAX_LISTED = 4
"""With more facies than this number, only the proportions that deviate are listed."""


class Finding(NamedTuple):
    """A statement about the realizations, and whether the statement is good."""

    text: str
    good: bool


def findings(state: State, ensemble: Ensemble) -> list[Finding]:
    """Return the findings that follow from the statistics computed so far."""
    page_state, k = state.page(Validation), state.facies
    name, is_volume = ensemble.training_image.facies_names[k], ensemble.grid.nz is not None
    found = [of_data(ensemble)]
    tasks: dict[str, Task[Any]] = {"shares": proportions(ensemble), "variety": variety(ensemble)}
    if is_judged(ensemble.hard_data, ensemble.grid):
        image, data = ensemble.training_image, ensemble.hard_data
        tasks["data_fit"] = data_fit(image, data, ensemble.grid)
    for word, task in tasks.items():
        page_state.worker.ask(task)
        if page_state.worker.cache.get(task.key) is None:
            page_state.waiting[word] = task  # the finding is added when the page is drawn again
    page_state.worker.wait_for(tasks["shares"], MOMENT_SECONDS)
    agreement = known(state, tasks["data_fit"]) if "data_fit" in tasks else None
    if agreement and flagged(agreement):
        found.insert(0, Finding(agreement.words, False))
    if shares := known(state, proportions(ensemble)):
        found += of_proportions(ensemble, shares.fit)
    ways = axis_curves(ensemble)
    compared = [known(state, curves(ensemble, statistic, k, way)) for statistic, way in ways]
    fits = {way: curve.fit for way, curve in zip(ways, compared, strict=True) if curve}
    if len(fits) == len(ways):
        found += of_curves(fits, name)
    if is_volume:
        found += of_volume(state, ensemble)
    if joined := known(state, geobodies(ensemble, k, page_state.neighbours if is_volume else None)):
        found += [Finding(text, False) for text in describe_geobodies(joined.fit, name)]
    differing = known(state, variety(ensemble))
    if differing is not None and ensemble.n > 1:
        found.append(of_variety(ensemble, differing))
    apart = known(state, patterns(ensemble))
    if apart and not apart.within[0].max() > 0:
        found.append(Finding("realizations are copies of the training image", False))
    return found


def of_data(ensemble: Ensemble) -> Finding:
    """Return a finding on whether the data are honoured."""
    n = ensemble.hard_data.n
    if not n:
        return Finding("no hard data", True)
    share = ensemble.n_mismatched.mean() / n
    if not share:
        return Finding(f"all {n} data honoured in all {ensemble.n} realizations", True)
    return Finding(f"{three_digits(100 * share)} % of {n} data not honoured", False)


def of_proportions(ensemble: Ensemble, fit: Fit | None) -> list[Finding]:
    """Return findings on the proportions; deviations are marked as bad and include advice."""
    n = ensemble.training_image.n_facies
    off = fit.outside if fit is not None else np.zeros(n, bool)
    said = [k for k in range(1 if n == 2 else 0, n) if n <= MAX_LISTED or off[k]]
    found = [Finding(describe_proportion(ensemble, k), not off[k]) for k in said]
    if n > MAX_LISTED:
        others = "all" if not said else "the other"
        found.append(Finding(f"{others} proportions within the scatter of TI crops", True))
    advice = advise_proportions(ensemble, fit)
    return [*found, Finding(advice, True)] if advice else found


def of_curves(
    fits: Mapping[tuple[Statistic, DirectionName], Fit | None], name: str
) -> list[Finding]:
    """Return one finding on all curves inside the band of crops, and one on each other curve."""
    judged = {key: fit for key, fit in fits.items() if fit is not None and fit.judged}
    if not judged:
        return [Finding(f"curves of {name} {NOT_JUDGED}", True)]
    outside = [
        Finding(f"{name}, {way_name(way)}: {describe_curve(fit, statistic)}", False)
        for (statistic, way), fit in judged.items()
        if not fit.fits
    ]
    titles = [curve_title(statistic, way) for (statistic, way), fit in judged.items() if fit.fits]
    inside = [f"{title[:1].lower()}{title[1:]}" for title in titles]
    if not inside:
        return outside
    what = "variograms and connectivity" if len(inside) == len(fits) else ", ".join(inside)
    size = size_text(next(iter(judged.values())))
    return [*outside, Finding(f"{name}: {what} inside the band of TI crops ({size})", True)]


def of_volume(state: State, ensemble: Ensemble) -> list[Finding]:
    """Return the findings for volumes only: layers, small patterns and unseen patterns."""
    name = ensemble.training_image.facies_names[state.facies]
    found = []
    if by_layer := known(state, layers(ensemble, state.facies)):
        good = by_layer.fit is None or by_layer.fit.fits
        text = describe_layers(by_layer.fit, name)
        found.append(Finding(f"{name}: {text}" if good else text, good))
    if small := known(state, volume_patterns(ensemble)):
        found += [Finding(*said) for said in describe_patterns(small.fit)]
        found.append(Finding(describe_unseen_of(small), True))
    return found


def of_variety(ensemble: Ensemble, differing: float) -> Finding:
    """Return a finding on the differences between realizations, which is never marked as bad."""
    shares = ensemble.proportions.mean(axis=0).tolist()
    return Finding(describe_variety(differing, shares), differing > 0)


def draw_summary(state: State, ensemble: Ensemble) -> None:
    """Draw the findings in one line, and mark bad findings."""
    (first, good), *others = findings(state, ensemble)
    said = ' <span class="dot">·</span> '.join(
        f'<span class="{"fact" if good else "fact odd"}">{escape(text)}</span>'
        for text, good in [(first[:1].upper() + first[1:], good), *others]
    )
    st.html(f'<p class="facts judged" role="status">{said}</p>')
