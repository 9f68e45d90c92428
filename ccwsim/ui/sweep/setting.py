"""One setting of a sweep: a realization of it, its numbers, and a way to take it."""

from __future__ import annotations

from html import escape

import numpy as np
import streamlit as st
from streamlit.errors import StreamlitAPIException

from ccwsim.experiments.sweep import RANGED, Row, label, varied
from ccwsim.model.parameters import Parameters
from ccwsim.ui.session.state import State
from ccwsim.ui.sweep.ranges import use_setting
from ccwsim.ui.sweep.run import SweepRun
from ccwsim.ui.sweep.state import SweepState
from ccwsim.ui.widgets.facts import three_digits
from ccwsim.ui.widgets.fields import button
from ccwsim.ui.widgets.maps import draw_map, facies_map, points_of
from ccwsim.ui.widgets.steps import panel_title

MAP_HEIGHT = 392


def draw_realization(state: State, run: SweepRun, k: int) -> None:
    """Draw one realization of a setting large, with a way to its others."""
    page_state = state.page(SweepState)
    row, image = run.found.rows[k], run.training_image
    r = page_state.shown = min(page_state.shown, len(row.realizations) - 1)
    n = len(row.realizations)
    with st.container(horizontal=True, vertical_alignment="center", gap="small", key="shown_row"):
        panel_title(f"Realization {r + 1} of {run.n_realizations}")
        for step, sign, name in ((-1, "‹", "previous"), (1, "›", "next")):
            button(
                sign, key=f"swept_{name}", on_click=_step, args=(state, step, n),
                disabled=n == 1,
                help=f"The {name} realization; the first {n} are kept",
            )  # fmt: skip
    said = label(row.parameters, RANGED)
    shown = facies_map(row.realizations[r], image, run.colours, f"Realization {r + 1} of {said}")
    codes = image.codes[row.realizations[r]]
    shown.points.extend(points_of(run.hard_data, image, codes))
    draw_map(shown, "map_swept", name="setting", max_height=MAP_HEIGHT)


def draw_numbers(state: State, run: SweepRun, k: int) -> None:
    """Draw what was judged, beside the best of all settings, and the button that takes it."""
    rows = run.found.rows
    panel_title("Its numbers")
    lines = "".join(
        f"<tr><th>{escape(name)}</th><td>{own}</td><td>{best}</td></tr>"
        for name, own, best in numbers_of(rows[k], rows, run)
    )
    head = "<tr><td></td><td>here</td><td>best</td></tr>"
    names = [name for name in RANGED if name != "search_fraction" or name in varied(run.settings)]
    said = escape(label(rows[k].parameters, names))
    st.html(f'<p class="setting">{said}</p><table class="numbers">{head}{lines}</table>')
    use_button(state, rows[k].parameters, "Use this setting", "use_setting")


def numbers_of(row: Row, rows: tuple[Row, ...], run: SweepRun) -> list[tuple[str, str, str]]:
    """Return name, value and the best value of all settings, in words."""
    names = ["Patterns, full resolution (bits)", "… half resolution", "… third resolution"]
    each = [(names[f], [r.quality.pattern_distances[f] for r in rows], min) for f in range(3)]
    facies = run.training_image.facies_names[run.facies]
    for way, name in enumerate(("E–W", "N–S")):
        each.append(
            (f"τ of {facies} {name}, error", [r.quality.tau_errors[way] for r in rows], min)
        )
    if row.quality.n > 1:
        each.append(("Cells that differ (%)", [100 * r.quality.differing for r in rows], max))
    if run.hard_data.n:
        mended = [r.quality.n_resimulated + r.quality.n_forced for r in rows]
        each.append((f"Data mended, of {run.hard_data.n}", mended, min))
        each.append(("Data not honoured", [r.quality.n_mismatched for r in rows], min))
    each.append(("CPU time (ms)", [1000 * r.quality.cpu_seconds for r in rows], min))
    at = next(place for place, other in enumerate(rows) if other is row)
    return [(name, _said(values[at]), _best(values, best)) for name, values, best in each]


def use_button(state: State, parameters: Parameters, text: str, key: str) -> None:
    """Draw a button that takes a setting into the study and goes to where it is simulated."""
    pressed = button(
        text, key=key, on_click=use_setting, args=(state, parameters),
        type="primary" if key == "use_setting" else "secondary",
        help="Takes it into the study and goes to Simulate.",
    )  # fmt: skip
    if pressed:
        try:
            st.switch_page("pages/simulate.py")
        except StreamlitAPIException:  # a page run alone knows no others
            st.success("The study has this setting now.")


def _step(state: State, step: int, n: int) -> None:
    page_state = state.page(SweepState)
    page_state.shown = (page_state.shown + step) % n


def _said(value: float) -> str:
    return "–" if np.isnan(value) else three_digits(value)


def _best(values: list[float], best) -> str:
    known = [value for value in values if not np.isnan(value)]
    return _said(best(known)) if known else "–"
