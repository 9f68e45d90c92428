"""The settings of a sweep: one large with its numbers, all as tiles, all in a table and as CSV."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable, Sequence
from html import escape
from typing import Any

import numpy as np
import streamlit as st

from ccwsim.experiments.sweep import RANGED, Row, Sweep, label, pareto_front, varied
from ccwsim.figures import contact_sheet, tile_size
from ccwsim.model.grid import Grid
from ccwsim.model.parameters import Parameters
from ccwsim.ui.results.gallery import step_buttons
from ccwsim.ui.results.tables import as_csv, numbers_table
from ccwsim.ui.session.address import go_to
from ccwsim.ui.session.state import State
from ccwsim.ui.sweep.plan import use_setting
from ccwsim.ui.sweep.run import SweepRun, SweepState
from ccwsim.ui.widgets.facts import seconds, three_digits
from ccwsim.ui.widgets.fields import button
from ccwsim.ui.widgets.maps import canvas_component, draw_map, facies_map, points_of
from ccwsim.ui.widgets.steps import panel_title

HEADS = {
    "pattern_full": "patterns",
    "pattern_half": "at 1/2",
    "pattern_third": "at 1/3",
    "tau_error_EW": "τ error E–W",
    "tau_error_NS": "τ error N–S",
    "differing": "differing",
    "mended": "re-simulated",
    "forced": "forced",
    "not_honoured": "not honoured",
    "cpu_ms": "CPU ms",
}
"""What the numbers are called on the page; the keys are the columns of the CSV."""
TILES = "sweep_tiles"
TILE_PIXELS = 124
"""Of a tile's longer side."""


def draw_realization(state: State, run: SweepRun, k: int) -> None:
    """Draw one realization of a setting large, with a way to its others."""
    page_state = state.page(SweepState)
    row, image = run.found.rows[k], run.training_image
    n = len(row.realizations)
    r = page_state.shown = min(page_state.shown, n - 1)

    def step(way: int) -> None:
        page_state.shown = (page_state.shown + way) % n

    with st.container(horizontal=True, vertical_alignment="center", gap="small", key="shown_row"):
        panel_title(f"Realization {r + 1} of {run.n_realizations}")
        step_buttons("swept", step, disabled=n == 1, note=f"; the first {n} are kept")
    alt = f"Realization {r + 1} of {label(row.parameters, RANGED)}"
    shown = facies_map(row.realizations[r], image, run.colours, alt)
    shown.points.extend(points_of(run.hard_data, image, image.codes[row.realizations[r]]))
    draw_map(shown, "map_swept", name="setting", max_height=392)


def draw_numbers(state: State, run: SweepRun, k: int) -> None:
    """Draw what was judged, beside the best of all settings, and the button that takes it."""
    rows = run.found.rows
    panel_title("Its numbers")
    names = [name for name in RANGED if name != "search_fraction" or name in varied(run.settings)]
    st.html(f'<p class="setting">{escape(label(rows[k].parameters, names))}</p>')
    lines = [(escape(name), own, best) for name, own, best in numbers_of(rows[k], rows, run)]
    st.html(numbers_table(lines, ("", "here", "best")))
    use_button(state, rows[k].parameters, "Use this setting", "use_setting")


def numbers_of(row: Row, rows: tuple[Row, ...], run: SweepRun) -> list[tuple[str, str, str]]:
    """Return name, value and the best value of all settings, in words."""
    qualities = [r.quality for r in rows]
    names = ["Patterns, full resolution (bits)", "… half resolution", "… third resolution"]
    each = [(names[f], [q.pattern_distances[f] for q in qualities], np.min) for f in range(3)]
    facies = run.training_image.facies_names[run.facies]
    for axis, way in enumerate(("E–W", "N–S")):
        errors = [q.tau_errors[axis] for q in qualities]
        each.append((f"τ of {facies} {way}, error", errors, np.min))
    if row.quality.n > 1:
        each.append(("Cells that differ (%)", [100 * q.differing for q in qualities], np.max))
    if n := run.hard_data.n:
        resimulated = [q.n_resimulated + q.n_forced for q in qualities]
        each.append((f"Data re-simulated, of {n}", resimulated, np.min))
        each.append(("Data not honoured", [q.n_mismatched for q in qualities], np.min))
    each.append(("CPU time (ms)", [1000 * q.cpu_seconds for q in qualities], np.min))
    k = next(k for k, other in enumerate(rows) if other is row)
    lines = []
    for name, values, best in each:
        known = [value for value in values if not np.isnan(value)]
        best_text = three_digits(float(best(known))) if known else "–"
        lines.append((name, three_digits(values[k]), best_text))
    return lines


def use_button(state: State, parameters: Parameters, text: str, key: str) -> None:
    """Draw a button that takes a setting into the study and goes to where it is simulated."""
    kind = "primary" if key == "use_setting" else "secondary"
    options: dict[str, Any] = {"on_click": use_setting, "args": (state, parameters), "type": kind}
    if button(text, key=key, help="Takes it into the study and goes to Simulate.", **options):
        go_to("pages/simulate.py", "The study has this setting now.")


def draw_tiles(
    run: SweepRun, names: list[str], marked: tuple[int, int], choose: Callable[[int], None]
) -> None:
    """Draw a tile a setting, labelled by the parameters `names`, and outlines of those to come.

    `marked` are the numbers of the large and of the recommended setting; `choose` is called with
    the number of the one that is clicked.
    """
    rows = run.found.rows
    while len(run.tiles) < len(rows):
        first = rows[len(run.tiles)].realizations[:1]
        run.tiles.append(contact_sheet(first, run.colours, longest=2 * TILE_PIXELS)[0])
    tiles: list[dict[str, Any]] = []
    for k, (row, png) in enumerate(zip(rows, run.tiles, strict=False)):
        bits, time = three_digits(row.quality.pattern_distance), seconds(row.quality.cpu_seconds)
        tile = {"label": label(row.parameters, names), "note": f"{bits} bits · {time}"}
        tiles.append({**tile, "png": b64encode(png).decode(), "recommended": k == marked[1]})
    if run.going:
        tiles += _to_come(run.settings[len(rows) :], names, "to come")

    def chosen() -> None:
        number = st.session_state[TILES].chosen
        if number is not None:
            choose(int(number))

    _draw_tiles(tiles, marked[0], run.grid, chosen)


def draw_planned_tiles(settings: Sequence[Parameters], names: list[str], grid: Grid) -> None:
    """Draw outlines of the settings that are going to be tried."""
    _draw_tiles(_to_come(settings, names, ""), -1, grid, lambda: None)


def _to_come(settings: Sequence[Parameters], names: list[str], note: str) -> list[dict[str, Any]]:
    return [{"label": label(p, names), "note": note} for p in settings]


def _draw_tiles(
    tiles: list[dict[str, Any]], shown: int, grid: Grid, chosen: Callable[[], None]
) -> None:
    width, height = tile_size(grid.shape, TILE_PIXELS)
    data = {"tiles": tiles, "shown": shown, "width": width, "height": height}
    canvas_component("settings")(key=TILES, data=data, on_chosen_change=chosen)


def draw_table(found: Sweep) -> None:
    """Draw all rows."""
    with st.expander("All numbers", key="sweep_table"):
        rows = [columns_of(row) for row in found.rows]
        table = {
            HEADS.get(name) or RANGED.get(name) or name: [row[name] for row in rows]
            for name in rows[0]
        }
        number = st.column_config.NumberColumn
        formats = {
            head: number(format="%.4f" if name.startswith("pattern") else "%.3g")
            for name, head in HEADS.items()
        }
        st.dataframe(table, hide_index=True, column_config=formats)


def columns_of(row: Row) -> dict[str, Any]:
    """Return the setting and all its numbers by name."""
    q = row.quality
    data = (q.n_resimulated, q.n_forced, q.n_mismatched)
    numbers = (*q.pattern_distances, *q.tau_errors, q.differing, *data, 1000 * q.cpu_seconds)
    setting = {name: getattr(row.parameters, name) for name in RANGED}
    own = {"wavelet_level": row.parameters.level}
    return {**setting, **own, **dict(zip(HEADS, numbers, strict=True))}


def sweep_csv(found: Sweep, recommended: int) -> bytes:
    """Return one line a setting: its values, its numbers, and how it stands among the others."""
    front = set(pareto_front(found.times, found.errors()).tolist())
    lines = []
    for k, row in enumerate(found.rows):
        values = columns_of(row).values()
        cells = [f"{v:.6g}" if isinstance(v, float) else v for v in values]
        lines.append([*cells, int(k in front), int(k == recommended)])
    head = columns_of(found.rows[0]) if found.rows else ()
    return as_csv([*head, "on_front", "recommended"], lines)
