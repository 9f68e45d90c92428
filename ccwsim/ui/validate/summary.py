"""What the validation comes to, in words that need no training."""

from __future__ import annotations

from dataclasses import dataclass, replace
from html import escape

import numpy as np
import streamlit as st
from numpy.typing import NDArray

from ccwsim.figures import Bundle
from ccwsim.metrics import Anodi
from ccwsim.model.ensemble import Ensemble
from ccwsim.ui.jobs.statistics import Failure
from ccwsim.ui.session.state import State
from ccwsim.ui.validate.panel import Validation, known
from ccwsim.ui.validate.reproduction import mean_ratio
from ccwsim.ui.validate.statistics import curves, patterns, proportions
from ccwsim.ui.widgets.facts import three_digits

MAX_PROPORTION_GAP = 2.0
"""Percentage points that a mean proportion may be off."""
MAX_CONNECTIVITY_GAP = 0.15
"""How far a ratio to the training image may be from 1."""
MAX_VARIOGRAM_GAP = 0.25
"""The same for variograms, which vary more."""
MOMENT_SECONDS = 0.1
"""How long the line waits for the proportions."""


@dataclass(frozen=True)
class Finding:
    """Something found, and whether it is as it should be."""

    text: str
    good: bool


def findings(state: State, ensemble: Ensemble) -> list[Finding]:
    """Return what can be said with what is known so far."""
    facies = state.facies
    name = ensemble.training_image.facies_names[facies]
    bundles = {
        (statistic, way): known(state, curves(ensemble, statistic, facies, way))
        for statistic in ("connectivity", "variogram")
        for way in ("E-W", "N-S")
    }
    found = [of_data(ensemble)]
    worker = state.page(Validation).worker
    worker.ask(proportions(ensemble))
    shares = worker.wait_for(proportions(ensemble), MOMENT_SECONDS)
    if shares is not None and not isinstance(shares, Failure):
        found.append(of_proportions(shares, ensemble.training_image.proportions))
    joined = [b for (s, _), b in bundles.items() if s == "connectivity" and b is not None]
    if len(joined) == 2:
        found.append(of_connectivity(joined, name))
    varied = [b for (s, _), b in bundles.items() if s == "variogram" and b is not None]
    if len(varied) == 2:
        found.append(of_variograms(varied))
    compared = known(state, patterns(ensemble))
    if compared is not None and ensemble.n > 1:
        found.append(of_patterns(compared))
    return found


def of_data(ensemble: Ensemble) -> Finding:
    """Say whether the data are honoured."""
    n = ensemble.hard_data.n
    if not n:
        return Finding("no hard data", True)
    share = ensemble.n_mismatched.mean() / n
    if not share:
        return Finding(f"all {n} data honoured in all {ensemble.n} realizations", True)
    return Finding(f"{three_digits(100 * share)} % of {n} data not honoured", False)


def of_proportions(each: NDArray[np.float64], reference: NDArray[np.float64]) -> Finding:
    """Say how far the mean proportions are off."""
    off = 100 * float(np.abs(each.mean(axis=0) - reference).max())
    return Finding(f"proportions within {max(off, 0.1):.1f} %", off <= MAX_PROPORTION_GAP)


def reach(tau: NDArray[np.float64]) -> float:
    """Return over how many cells a facies is connected: the sum of τ over the lags."""
    return float(np.nansum(tau[1:]))


def of_connectivity(bundles: list[Bundle], name: str) -> Finding:
    """Compare the distance over which a facies is connected with the training image."""
    own = sum(reach(bundle.reference) for bundle in bundles)
    ratio = sum(reach(bundle.median) for bundle in bundles) / own if own else 1.0
    text = f"{name} is connected over {ratio:.2f} of the distance seen in the training image"
    return Finding(text, abs(ratio - 1) <= MAX_CONNECTIVITY_GAP)


def of_variograms(bundles: list[Bundle]) -> Finding:
    """Say how far the median variogram is from the training image, in shares of its level."""
    apart = [
        float(np.abs(b.median - b.reference).mean() / max(b.reference.mean(), 1e-12))
        for b in bundles
    ]
    worst = max(apart)
    return Finding(
        f"variograms within {100 * worst:.0f} % of the training image's", worst <= MAX_VARIOGRAM_GAP
    )


def of_patterns(found: Anodi) -> Finding:
    """Say how varied the realizations are for how far they are from the training image."""
    ratio = mean_ratio(found)
    if np.isnan(ratio):
        return Finding("realizations are copies of the training image", False)
    text = f"realizations differ from each other {ratio:.2f} × as much as from the image"
    return Finding(text, True)


def draw_summary(state: State, ensemble: Ensemble) -> None:
    """Write the findings in one line; what is not as it should be is marked."""
    found = findings(state, ensemble)
    found[0] = replace(found[0], text=found[0].text[:1].upper() + found[0].text[1:])
    said = ' <span class="dot">·</span> '.join(
        f'<span class="{"fact" if finding.good else "fact odd"}">{escape(finding.text)}</span>'
        for finding in found
    )
    st.html(f'<p class="facts judged" role="status">{said}</p>')
