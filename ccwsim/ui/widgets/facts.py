"""The line of facts: the main results of an ensemble in one line."""

from collections.abc import Iterable
from html import escape

import numpy as np
import streamlit as st

from ccwsim.metrics import fit_proportions
from ccwsim.model.ensemble import Ensemble
from ccwsim.model.numbers import duration, plural, three_digits
from ccwsim.report.verdicts import advise_proportions, describe_proportion

SMALL = 3


def facts_of(ensemble: Ensemble) -> list[str]:
    """Return the main facts of an ensemble as short phrases with units."""
    return [*_honoured(ensemble), _time(ensemble), *_proportions(ensemble)]


def draw_facts(ensemble: Ensemble) -> None:
    """Write the facts about an ensemble in one line."""
    write_facts(facts_of(ensemble))


def write_facts(facts: Iterable[str]) -> None:
    """Write facts in one line, which breaks only between facts; the style adds the dots."""
    joined = " ".join(f'<span class="fact">{escape(fact)}</span>' for fact in facts)
    st.html(f'<p class="facts">{joined}</p>')


def _honoured(ensemble: Ensemble) -> list[str]:
    n = ensemble.hard_data.n
    if not n:
        return ["no hard data"]
    if not ensemble.parameters.exact_data:
        wrong = float(ensemble.n_mismatched.mean())
        share = f"{three_digits(wrong)} of {n} data wrong ({100 * wrong / n:.1f} %)"
        return [f"“Honour data exactly” is off: {share}"]
    worst = int(ensemble.n_mismatched.max(initial=0))
    if worst == 0:
        return [f"{n} of {n} data honoured"]
    return [f"up to {worst} of {n} data not honoured"]


def _time(ensemble: Ensemble) -> str:
    count = plural(ensemble.n, "realization")
    if ensemble.is_stored:
        return f"{count} stored with the program, not run on this machine"
    cpu_time = duration(float(ensemble.cpu_seconds.mean()))
    return f"{count} in {duration(ensemble.wall_seconds)}, {cpu_time} CPU each"


def _proportions(ensemble: Ensemble) -> list[str]:
    image = ensemble.training_image
    if image.n_facies > SMALL:
        expected = np.maximum(ensemble.expected_proportions, 1e-9)
        errors = abs(ensemble.proportions.mean(axis=0) / expected - 1)
        facts = [
            f"proportion that differs most: {describe_proportion(ensemble, int(errors.argmax()))}"
        ]
    else:
        first = 1 if image.n_facies == 2 else 0
        facts = [describe_proportion(ensemble, k) for k in range(first, image.n_facies)]
    advice = advise_proportions(ensemble, fit_proportions(ensemble))
    return [*facts, advice] if advice else facts
