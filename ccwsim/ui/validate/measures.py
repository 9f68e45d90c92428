"""The table of measures that are one number each; `ccwsim.metrics.MEASURES` has its rows."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import streamlit as st

from ccwsim.metrics import Measured
from ccwsim.model.ensemble import Ensemble
from ccwsim.report.verdicts import HOW_MEASURED, MEASURES_HEAD, describe_measures
from ccwsim.ui.results.tables import as_csv, csv_button, numbers_table
from ccwsim.ui.session.file_names import study_part
from ccwsim.ui.session.state import State
from ccwsim.ui.validate.statistics import measures, panel
from ccwsim.ui.widgets.text import panel_title, scrolled, step_note


def draw_measures(state: State, ensemble: Ensemble, colours: Sequence[str]) -> None:
    """Draw all measures of the facies, each beside crops of the training image."""
    name = ensemble.training_image.facies_names[state.facies]

    def draw(found: Measured) -> None:
        n = len(found.each)
        panel_title(f"Measures of {name}", f"{'first ' if n < ensemble.n else ''}{n} realizations")
        rows = []
        for row in describe_measures(found):
            title = f'<span title="{escape(row.definition)}">{escape(row.title)}</span>'
            verdict = f'<span class="{"fact" if row.good else "fact odd"}">{row.verdict}</span>'
            rows.append([title, row.image, row.realizations, verdict])
        table = numbers_table(rows, MEASURES_HEAD, "measures")
        st.html(scrolled(table, f"Measures of {name}"))
        step_note(HOW_MEASURED)
        of = study_part(ensemble)
        csv_button("Measures as CSV", "measures", lambda: measures_csv(found), of, width="content")

    panel(state, "measures", measures(ensemble, state.facies), draw)


def measures_csv(found: Measured) -> bytes:
    """Return one line a measure: the training image, crops, pieces, and each realization."""
    head = ["measure", "training_image", "crops", "tolerance", "pieces"]
    lines = []
    for k, measure in enumerate(found.measures):
        fit = found.fit
        band = ("", "", "") if fit is None else (fit.reference[k], fit.tolerance[k], fit.found[k])
        numbers = [found.reference[k], *band, *found.each[:, k]]
        shown = (n if n == "" else f"{measure.factor * n:.6g}" for n in numbers)
        lines.append([measure.title, *shown])
    return as_csv([*head, *(f"realization_{r + 1}" for r in range(len(found.each)))], lines)
