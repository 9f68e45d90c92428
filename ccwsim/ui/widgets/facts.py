"""The line of facts: the main results of an ensemble in one line."""

from collections.abc import Iterable
from html import escape

import numpy as np
import streamlit as st

from ccwsim import Ensemble
from ccwsim.metrics import fit_proportions
from ccwsim.model import duration, plural, three_digits
from ccwsim.report.verdicts import advise_proportions, compare_proportion, describe_proportion
from ccwsim.ui.widgets.text import numbers_table, scrolled


def facts_of(ensemble: Ensemble, *, short: bool = False) -> list[str]:
    """Return the main facts of an ensemble as short phrases with units.

    If `short`, a proportion is compared with one other share only.
    """
    return [*_honoured(ensemble), _time(ensemble), *_proportions(ensemble, short)]


def draw_facts(ensemble: Ensemble) -> None:
    """Write the facts about an ensemble in one line, and a menu with proportions and all facts.

    The style cuts a long line.
    """
    write_facts(facts_of(ensemble, short=True))
    with st.popover("Proportions", key="facts_table"):
        st.html(scrolled(proportions_table(ensemble), "Proportions"))
        write_facts(facts_of(ensemble))


def proportions_table(ensemble: Ensemble) -> str:
    """Return a table, as HTML, of the share of each facies and of the shares compared with it."""
    names = ensemble.training_image.facies_names
    rows = [compare_proportion(ensemble, k) for k in range(len(names))]
    cells = ([escape(name), *row.values()] for name, row in zip(names, rows, strict=True))
    return numbers_table(cells, ["facies", *rows[0]], "shares")


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


def _proportions(ensemble: Ensemble, short: bool) -> list[str]:
    expected = np.maximum(ensemble.expected_proportions, 1e-9)
    differences = abs(ensemble.proportions.mean(axis=0) / expected - 1).round(6)
    k = int(np.lexsort((-expected, differences))[-1])
    largest = "largest difference: " if len(expected) > 2 else ""
    fact = largest + describe_proportion(ensemble, k, short=short)
    advice = advise_proportions(ensemble, fit_proportions(ensemble))
    return [fact, advice] if advice else [fact]
