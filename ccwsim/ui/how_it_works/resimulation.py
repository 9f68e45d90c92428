"""The local re-simulation after the last patch, window by window, and the seam repair."""

from collections.abc import Sequence
from dataclasses import replace
from math import prod
from typing import Any, cast

import numpy as np
import streamlit as st
from scipy import ndimage

from ccwsim.engine.stages.path import overlap_cells
from ccwsim.engine.trace import ResimulatedWindow, Trace
from ccwsim.model import FORCED, Bytes, Mask, window_at
from ccwsim.ui.frontend.cells import CellMap, draw_cells, editor_points, facies_map
from ccwsim.ui.hard_data.page import describe_data_status
from ccwsim.ui.how_it_works.maps import TraceView, box_mark, data_in
from ccwsim.ui.how_it_works.run import How
from ccwsim.ui.how_it_works.words import OURS, STEP_REFERENCES, describe_window, format_count, say
from ccwsim.ui.widgets import field, options_of, page_text, pair, panel_title, step_note

MAX_UNASKED_TERMS = 3_000_000_000
"""If the remaining patches need more score terms, the page asks before it places these patches."""
PIXELS = 204  # side in pixels of a picture that shows one window of a map
WINDOW_MAP_HEIGHT = 360
WINDOW_SLICES_HEIGHT = 300
N_MARKED = 20
"""Maximum number of changes by seam repair that are marked; most changes are single cells."""


def draw_resimulation(page_state: How, view: TraceView) -> None:
    """Draw the corrected realization, the windows of a datum, and the changes by seam repair."""
    trace = view.trace
    panel_title("After the last patch: local re-simulation", "mismatches are corrected")
    if not trace.study.hard_data.n:
        say("There are no hard data in this study, so there is nothing to correct.", OURS)
    elif not trace.study.parameters.exact_data:
        off = "“Honour data exactly” is off: only the search is conditioned on the data."
        say(
            f"{off} Mismatches are not corrected, as in the authors' code.", STEP_REFERENCES["data"]
        )
    else:
        if _takes_long(trace):
            step_note("Finishing this realization takes a while.")
            if not st.button("Place the remaining patches", key="how_finish"):
                return
        _draw_windows_of_data(page_state, view)
    if trace.repairs:
        _draw_repair(view)


def _takes_long(trace: Trace) -> bool:
    """Return whether placing the remaining patches takes noticeable time."""
    search = trace.search
    n_blocks = overlap_cells(search.template, search.overlap) / prod(search.block)
    terms = n_blocks * len(trace.oriented.pyramid.sums) * int(trace.oriented.n_places.max())
    return len(trace.patches) * terms > MAX_UNASKED_TERMS and trace.n_done < len(trace.patches)


def _draw_repair(view: TraceView) -> None:
    """Draw the realization before and after seam repair."""
    trace = view.trace
    panel_title("Then: seam repair", "where patches are joined in ways absent from the image")
    if _takes_long(trace):
        step_note("Seam repair is shown once all patches are placed.")
        return
    changed = trace.before_repair != trace.realization.indices
    if not changed.any():
        say("No change joins the patches better.", OURS)
        return
    marked = [] if view.is_volume else _boxes_of(changed)
    n_changed, share = format_count(int(changed.sum()), "cell"), f"{100 * changed.mean():.1f}"
    note = " The largest changes are marked." if marked else ""
    say(page_text("Seam repair", cells=n_changed, share=share) + note, OURS)

    def map_of(indices: Bytes, name: str) -> CellMap:
        points = editor_points(trace.study.hard_data, view.image) if view.is_volume else []
        marks = [box_mark(box, view.theme.reference, "changed") for box in marked]
        whole = facies_map(indices, view.image, view.colours, f"The realization {name} seam repair")
        return replace(whole, points=points, marks=marks)

    before, after = trace.before_repair, trace.realization.indices
    maps = {"before": map_of(before, "before"), "after": map_of(after, "after")}
    _draw_pair(view, maps, "how_repair", max_height=_height(view, WINDOW_MAP_HEIGHT))


def _height(view: TraceView, of_map: int) -> int:
    """Return the height in pixels of a map, or of the slices of a volume."""
    return WINDOW_SLICES_HEIGHT if view.is_volume else of_map


def _draw_pair(view: TraceView, maps: dict[str, CellMap], key: str, **options: Any) -> None:
    """Draw the maps or volumes "before" and "after" side by side."""
    places = st.columns(2, gap="medium") if view.is_volume else pair()
    for place, (name, cell_map) in zip(places, maps.items(), strict=True):
        with place:
            st.html(f'<p class="caption">{name}</p>')
            draw_cells(
                cell_map, f"{key}_{name}", link=key, name=f"{key}_{name}", body=False, **options
            )


def _boxes_of(changed: Mask) -> list[tuple[slice, ...]]:
    """Return boxes around the largest changes of a map; adjacent changes share a box."""
    wide = ndimage.binary_dilation(changed, iterations=2)
    labels, _ = cast(tuple[Any, int], ndimage.label(wide))
    boxes = ndimage.find_objects(labels)
    boxes.sort(key=lambda box: -prod(side.stop - side.start for side in box))
    return boxes[:N_MARKED]


def _draw_windows_of_data(page_state: How, view: TraceView) -> None:
    """Draw the local re-simulation windows of one datum."""
    trace = view.trace
    by_datum = windows_by_datum(trace.windows)
    say(_describe(trace, by_datum), f"{OURS}; the authors' code does not correct such data")
    if not by_datum:
        return
    with st.container(key="how_mending"):
        sides = (st.container(), st.container())
        left, right = sides if view.is_volume else st.columns([1, 2], gap="medium")
    with left:
        corrected = list(by_datum)
        page_state.datum = min(page_state.datum, len(corrected) - 1)
        field(
            st.selectbox,
            "Corrected datum",
            key="how_datum",
            value=page_state.datum,
            write=lambda k: page_state.stop(datum=k),
            **options_of({k: _name(trace, datum) for k, datum in enumerate(corrected)}),
        )
        windows = by_datum[corrected[page_state.datum]]
        draw_cells(
            replace(windows_map(view, windows), wells=page_state.wells),
            "how_mended",
            name="corrected",
            cursor=trace.study.hard_data.cells[windows[0].datum].tolist(),
            body=False,
            max_height=_height(view, WINDOW_MAP_HEIGHT),
        )
    with right:
        captions = [describe_window(window) for window in windows if not window.fits]
        if not any(w.fits for w in windows) and not all(w.isolated for w in windows):
            captions.append("Afterwards, the window of a nearby datum corrected this datum too.")
        if captions:
            st.html("".join(f'<p class="caption">{text}</p>' for text in captions))
        with st.container(
            horizontal=not view.is_volume,
            vertical_alignment="bottom",
            gap="medium",
            key="how_pairs",
        ):
            for window in windows:
                if window.fits:
                    _draw_window(view, window)


def windows_by_datum(windows: Sequence[ResimulatedWindow]) -> dict[int, list[ResimulatedWindow]]:
    """Return the windows of each datum; the data with the largest final windows come first."""
    by_datum: dict[int, list[ResimulatedWindow]] = {}
    for window in windows:
        by_datum.setdefault(window.datum, []).append(window)

    def largest(datum: int) -> int:
        return max((w.size for w in by_datum[datum] if w.fits and not w.isolated), default=0)

    return {datum: by_datum[datum] for datum in sorted(by_datum, key=largest, reverse=True)}


def _describe(trace: Trace, by_datum: dict[int, list[ResimulatedWindow]]) -> str:
    data_status = trace.realization.data_status
    n = format_count(len(data_status), "datum", "data")
    text = f"Of {n}: {describe_data_status(data_status)}. "
    if not by_datum:
        return text + "The raster pass honours all data, so there is nothing to correct."
    forced = "If no patch fits, only the cell is set." if (data_status == FORCED).any() else ""
    return text + page_text("Windows of local re-simulation") + f" {forced}"


def _name(trace: Trace, datum: int) -> str:
    position = ", ".join(map(str, trace.study.hard_data.cells[datum].tolist()[::-1]))
    name = trace.study.training_image.facies_names[trace.study.facies_of_data[datum]]
    return f"{name} at ({position})"


def _part_of(window: ResimulatedWindow) -> tuple[slice, ...]:
    """Return the slices of the grid that a window covers."""
    first = (window.layer, window.row, window.column)[-window.before.ndim :]
    return window_at(first, window.before.shape)


def windows_map(view: TraceView, windows: list[ResimulatedWindow]) -> CellMap:
    """Return the realization with data and windows; in a volume, windows are in full colour."""
    trace, image = view.trace, view.image
    points = editor_points(trace.study.hard_data, image)
    if view.is_volume:
        lit = np.zeros(trace.before_repair.shape, bool)
        for window in windows:
            lit[_part_of(window)] = True
        alt = "The corrected realization, with the windows of the datum in full colour"
        cell_map = view.lit_map(trace.before_repair, lit, alt)
        return replace(cell_map, points=points)
    cell_map = facies_map(
        trace.realization.indices, image, view.colours, "The corrected realization"
    )
    marks = [box_mark(_part_of(window), view.theme.reference, "window") for window in windows]
    return replace(cell_map, points=points, marks=marks)


def _draw_window(view: TraceView, w: ResimulatedWindow) -> None:
    """Draw a window before and after a fitting patch was pasted."""
    trace, part = view.trace, _part_of(w)

    def map_of(indices: Bytes, name: str) -> CellMap:
        window = view.facies_map(indices, f"A window {name} local re-simulation")
        return replace(window, points=data_in(trace, part, indices), point_colours=view.colours)

    key = f"how_window_{w.datum}_{w.size}_{w.isolated}"
    with st.container(width="stretch" if view.is_volume else 2 * PIXELS + 16, key=key):
        st.html(f'<p class="caption">{describe_window(w)}</p>')
        maps = {"before": map_of(w.before, "before"), "after": map_of(w.after, "after")}
        cursor = (trace.study.hard_data.cells[w.datum] - [side.start for side in part]).tolist()
        _draw_pair(view, maps, key, cursor=cursor, max_height=_height(view, PIXELS), tools=False)
