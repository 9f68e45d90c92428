"""What mending did once the last patch was laid: window by window, before and after."""

from __future__ import annotations

from collections.abc import Sequence

import streamlit as st

from ccwsim.engine.trace import ResimulatedWindow, Trace
from ccwsim.figures import Theme
from ccwsim.model.ensemble import FORCED
from ccwsim.ui.hard_data.canvas import said_help
from ccwsim.ui.how_it_works.maps import patch_map
from ccwsim.ui.how_it_works.state import How
from ccwsim.ui.how_it_works.words import counted, say
from ccwsim.ui.session.state import State
from ccwsim.ui.widgets.fields import field
from ccwsim.ui.widgets.maps import CellMap, draw_map, facies_map, points_of
from ccwsim.ui.widgets.steps import pair, panel_title, step_note

MUCH_WORK = 3_000_000_000
"""Terms of scores above which the patches up to the end are laid only when asked for."""
SMALL = 204


def draw_resimulation(state: State, trace: Trace, colours: list[str], theme: Theme) -> None:
    """Draw the realization as mending left it, and the windows of one datum."""
    page_state = state.page(How)
    panel_title("After the last patch: mending", "what the raster left wrong is simulated anew")
    if not trace.study.hard_data.n:
        say("There are no hard data in this study, so there is nothing to mend.", "section 4.4")
        return
    if not trace.study.parameters.exact_data:
        say("Exact data is off: data only steer the search, and what is wrong stays wrong.",
            "section 4.4")  # fmt: skip
        return
    if _work(trace) > MUCH_WORK and trace.n_done < len(trace.patches):
        step_note("This realization takes a while to finish.")
        if not st.button("Lay all its patches", key="how_finish"):
            return
    by_datum = windows_by_datum(trace.windows)
    say(_words(trace, by_datum), "not in the paper, whose codes leave such data wrong")
    if not by_datum:
        return
    data = list(by_datum)
    page_state.datum = min(page_state.datum, len(data) - 1)
    with st.container(key="how_mending"):
        left, right = st.columns([1, 2], gap="medium")
    with left:
        field(
            st.selectbox, "Mended datum", key="how_datum", value=page_state.datum,
            options=list(range(len(data))), write=page_state.look_at,
            format_func=lambda k: _name(trace, data[k]),
        )  # fmt: skip
        _where(trace, by_datum[data[page_state.datum]], colours, theme)
    with right:
        _windows(trace, by_datum[data[page_state.datum]], colours, theme)


def windows_by_datum(windows: Sequence[ResimulatedWindow]) -> dict[int, list[ResimulatedWindow]]:
    """Return the windows of each datum; data that a large window mended come first."""
    found: dict[int, list[ResimulatedWindow]] = {}
    for window in windows:
        found.setdefault(window.datum, []).append(window)

    def largest(datum: int) -> int:
        return max((w.size for w in found[datum] if w.fits and not w.scar), default=0)

    return {datum: found[datum] for datum in sorted(found, key=largest, reverse=True)}


def _work(trace: Trace) -> float:
    energies, search = trace.oriented.energies, trace.search
    terms = 2 * search.template * search.overlap / search.unit**2 * len(trace.oriented.pyramid.sums)
    return len(trace.patches) * energies[0, 0].size * terms


def _words(trace: Trace, by_datum: dict[int, list[ResimulatedWindow]]) -> str:
    data_status = trace.realization.data_status
    text = f"Of {counted(len(data_status), 'datum', 'data')}: {said_help(data_status)}. "
    if not by_datum:
        return text + "Mending had nothing to do."
    return text + (
        "Around a missed datum a window is laid that honours <b>every</b> datum in it and fits its "
        "surroundings on all sides; where none fits, the window is halved. "
        + ("The last resort sets the single cell." if (data_status == FORCED).any() else "")
    )


def _name(trace: Trace, datum: int) -> str:
    row, column = trace.study.hard_data.cells[datum].tolist()
    name = trace.study.training_image.facies_names[trace.study.facies_of_data[datum]]
    return f"{name} at ({column}, {row})"


def _where(
    trace: Trace, windows: list[ResimulatedWindow], colours: list[str], theme: Theme
) -> None:
    image = trace.study.training_image
    shown = facies_map(trace.realization.indices, image, colours, "The realization, mended")
    shown.points.extend(points_of(trace.study.hard_data, image))
    for window in windows:
        shown.marks.append(
            {"kind": "box", "row": window.row, "column": window.column, "height": window.size,
             "width": window.size, "colour": theme.reference, "label": "window"}
        )  # fmt: skip
    draw_map(shown, "how_map_mended", max_height=360, name="mended")


def _windows(
    trace: Trace, windows: list[ResimulatedWindow], colours: list[str], theme: Theme
) -> None:
    own = [w for w in windows if not w.scar]
    said = [window_words(window) for window in windows if not window.fits]
    if own and not any(window.fits for window in own):
        said.append("Then the window of a datum nearby brought this one too.")
    if said:
        st.html("".join(f'<p class="caption">{words}</p>' for words in said))
    with st.container(
        horizontal=True, vertical_alignment="bottom", gap="medium", key="how_pairs"
    ):  # fmt: skip
        for window in windows:
            if window.fits:
                _window(trace, window, colours, theme)


def _window(trace: Trace, w: ResimulatedWindow, colours: list[str], theme: Theme) -> None:
    """Draw one window where a patch fitted: how it was, and how it is."""
    image = trace.study.training_image
    inside = [
        [row - w.row, column - w.column, int(facies)]
        for (row, column), facies in zip(
            trace.study.hard_data.cells.tolist(), trace.study.facies_of_data, strict=True
        )
        if 0 <= row - w.row < w.size and 0 <= column - w.column < w.size
    ]

    def drawn(cells) -> CellMap:
        shown = patch_map(cells, image, colours, theme, "A window")
        shown.points.extend([*at, int(cells[at[0], at[1]] != at[2])] for at in inside)
        return shown

    key = f"{w.datum}_{w.size}_{w.scar}"
    with st.container(width=2 * SMALL + 16, key=f"how_window_{key}"):
        st.html(f'<p class="caption">{window_words(w)}</p>')
        for place, name, cells in zip(
            pair(), ("before", "after"), (w.before, w.after), strict=True
        ):
            with place:
                st.html(f'<p class="caption">{name}</p>')
                draw_map(drawn(cells), f"how_map_{name}_{key}", max_height=SMALL, tools=False)


def window_words(w: ResimulatedWindow) -> str:
    """Say what came of a window.

    Examples
    --------
    >>> import numpy as np
    >>> cells = np.zeros((8, 8), np.uint8)
    >>> window = ResimulatedWindow(0, 8, 0, 0, cells, cells, cells.astype(np.int32), False, False)
    >>> window_words(window)
    'Window of 8 cells: no patch of the image honours all its data and fits.'
    """
    if w.size == 1:
        return "Set by force: no window fitted, so the cell alone was changed."
    start = f"Window of {w.size} cells"
    if not w.fits:
        return f"{start}: no patch of the image honours all its data and fits."
    if w.scar:
        return f"{start}: heals the scar around the datum, which was right already."
    return f"{start}: a patch fits and honours all its data."
