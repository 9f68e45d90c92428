"""Local re-simulation after the last patch: window by window, before and after."""

from __future__ import annotations

from collections.abc import Sequence
from math import prod
from typing import Any, cast

import numpy as np
import streamlit as st
from numpy.typing import NDArray
from scipy import ndimage

from ccwsim.engine.trace import ResimulatedWindow, Trace
from ccwsim.engine.trace.frames import Rectangle
from ccwsim.figures import Theme
from ccwsim.model.ensemble import FORCED
from ccwsim.ui.frontend.cell_map import CellMap, facies_map, points_of
from ccwsim.ui.frontend.map import draw_map
from ccwsim.ui.hard_data.page import describe_data_status
from ccwsim.ui.how_it_works.maps import box_mark, data_in, patch_map
from ccwsim.ui.how_it_works.run import How
from ccwsim.ui.how_it_works.words import OURS, PAPER, describe_window, format_count, say
from ccwsim.ui.widgets.fields import field
from ccwsim.ui.widgets.text import pair, panel_title, step_note

MAX_TERMS = 3_000_000_000
"""Terms of scores above which the patches up to the end are placed only when asked for."""
PIXELS = 204
"""Of a side of a window."""
N_MARKED = 20
"""Changes of seam repair that are marked: most are of one cell."""


def draw_resimulation(how: How, trace: Trace, colours: list[str], theme: Theme) -> None:
    """Draw the corrected realization, the windows of one datum, and what seam repair changed."""
    panel_title(
        "After the last patch: local re-simulation", "what the raster pass left wrong is corrected"
    )
    if not trace.study.hard_data.n:
        say("There are no hard data in this study, so there is nothing to correct.", OURS)
        _draw_repair(trace, colours, theme)
        return
    if not trace.study.parameters.exact_data:
        say_uncorrected()
        return
    if _n_terms(trace) > MAX_TERMS and trace.n_done < len(trace.patches):
        step_note("This realization takes a while to finish.")
        if not st.button("Place all its patches", key="how_finish"):
            return
    _draw_windows_of_data(how, trace, colours, theme)
    _draw_repair(trace, colours, theme)


def _draw_repair(trace: Trace, colours: list[str], theme: Theme) -> None:
    """Draw what seam repair changed."""
    if not trace.repairs:
        return
    panel_title("Then: seam repair", "where patches are joined as the image never has it")
    if _n_terms(trace) > MAX_TERMS and trace.n_done < len(trace.patches):
        step_note("It is shown once all patches are placed.")
        return
    changed = trace.before_repair != trace.realization.indices
    if not changed.any():
        say("No change was found that joins the patches better.", OURS)
        return
    lit = _boxes_of(changed)
    say(
        "Where cells have patterns that the training image never has, windows are simulated anew "
        "and single cells changed, if that leaves fewer of them: "
        f"<b>{format_count(int(changed.sum()), 'cell')}</b> ({100 * changed.mean():.1f} %) are "
        "another facies now. The largest changes are marked.",
        OURS,
    )
    image = trace.study.training_image
    shown = {"before": trace.before_repair, "after": trace.realization.indices}
    for place, (name, cells) in zip(pair(), shown.items(), strict=True):
        with place:
            own = facies_map(cells, image, colours, f"The realization {name} seam repair")
            own.marks.extend(box_mark(box, theme.reference, "changed") for box in lit)
            st.html(f'<p class="caption">{name}</p>')
            key = f"how_map_repair_{name}"
            draw_map(own, key, max_height=360, link="how_repair", name=f"{name}_seam_repair")


def _boxes_of(changed: NDArray[np.bool_]) -> list[Rectangle]:
    """Return boxes around the largest changes, neighbours together."""
    wide = ndimage.binary_dilation(changed, iterations=2)
    labels, _ = cast(tuple[Any, int], ndimage.label(wide))
    found = ndimage.find_objects(labels)
    boxes = [Rectangle(y.start, x.start, y.stop - y.start, x.stop - x.start) for y, x in found]
    return sorted(boxes, key=lambda box: -box.height * box.width)[:N_MARKED]


def _draw_windows_of_data(how: How, trace: Trace, colours: list[str], theme: Theme) -> None:
    """Draw the windows of one datum."""
    by_datum = windows_by_datum(trace.windows)
    say_corrected(trace, by_datum)
    if not by_datum:
        return
    with st.container(key="how_mending"):
        left, right = st.columns([1, 2], gap="medium")
    with left:
        windows = choose_datum(how, trace, by_datum)
        _draw_realization(trace, windows, colours, theme)
    with right:
        say_windows(windows)
        _draw_windows(trace, windows, colours, theme)


def choose_datum(
    how: How, trace: Trace, by_datum: dict[int, list[ResimulatedWindow]]
) -> list[ResimulatedWindow]:
    """Offer the data that were corrected; return the windows of the chosen one."""
    data = list(by_datum)
    how.datum = min(how.datum, len(data) - 1)
    offered = {"value": how.datum, "options": list(range(len(data)))}
    offered |= {"format_func": lambda k: _name(trace, data[k])}
    shows = {"key": "how_datum", "write": lambda k: how.stop(datum=k)}
    field(st.selectbox, "Corrected datum", **shows, **offered)
    return by_datum[data[how.datum]]


def windows_by_datum(windows: Sequence[ResimulatedWindow]) -> dict[int, list[ResimulatedWindow]]:
    """Return the windows of each datum; data that a large window corrected come first."""
    found: dict[int, list[ResimulatedWindow]] = {}
    for window in windows:
        found.setdefault(window.datum, []).append(window)

    def largest(datum: int) -> int:
        return max((w.size for w in found[datum] if w.fits and not w.isolated), default=0)

    return {datum: found[datum] for datum in sorted(found, key=largest, reverse=True)}


def _n_terms(trace: Trace) -> float:
    search = trace.search
    (_, size, _), (_, overlap, _) = search.template, search.overlap
    terms = 2 * size * overlap / prod(search.block) * len(trace.oriented.pyramid.sums)
    return len(trace.patches) * trace.oriented.n_places * terms


def say_corrected(trace: Trace, by_datum: dict[int, list[ResimulatedWindow]]) -> None:
    """Say how many data local re-simulation corrected, and how."""
    say(_describe(trace, by_datum), f"{OURS}; the authors' code leaves such data wrong")


def say_uncorrected() -> None:
    """Say that data are not honoured exactly."""
    off = "“Honour data exactly” is off: the search alone is conditioned on the data."
    say(f"{off} What is wrong stays wrong, as in the authors' code.", PAPER["data"])


def _describe(trace: Trace, by_datum: dict[int, list[ResimulatedWindow]]) -> str:
    data_status = trace.realization.data_status
    n = format_count(len(data_status), "datum", "data")
    text = f"Of {n}: {describe_data_status(data_status)}. "
    if not by_datum:
        return text + "There was nothing left to correct."
    return text + (
        "Around a missed datum a window is re-simulated so that it honours <b>every</b> datum in "
        "it and fits its surroundings on all sides; where no patch does, the window is halved. "
        + ("The last resort sets the single cell." if (data_status == FORCED).any() else "")
    )


def _name(trace: Trace, datum: int) -> str:
    at = ", ".join(map(str, trace.study.hard_data.cells[datum].tolist()[::-1]))
    name = trace.study.training_image.facies_names[trace.study.facies_of_data[datum]]
    return f"{name} at ({at})"


def _box_of(window: ResimulatedWindow) -> Rectangle:
    return Rectangle(window.row, window.column, window.size, window.size)


def _draw_realization(
    trace: Trace, windows: list[ResimulatedWindow], colours: list[str], theme: Theme
) -> None:
    image = trace.study.training_image
    shown = facies_map(trace.realization.indices, image, colours, "The realization, corrected")
    shown.points.extend(points_of(trace.study.hard_data, image))
    shown.marks.extend(box_mark(_box_of(w), theme.reference, "window") for w in windows)
    draw_map(shown, "how_map_mended", max_height=360, name="corrected")


def say_windows(windows: list[ResimulatedWindow]) -> None:
    """Say what came of the windows where no patch fitted."""
    captions = [describe_window(window) for window in windows if not window.fits]
    if not any(w.fits for w in windows) and not all(w.isolated for w in windows):
        captions.append("Then the window of a nearby datum corrected this one too.")
    if captions:
        st.html("".join(f'<p class="caption">{text}</p>' for text in captions))


def _draw_windows(
    trace: Trace, windows: list[ResimulatedWindow], colours: list[str], theme: Theme
) -> None:
    row = st.container(horizontal=True, vertical_alignment="bottom", gap="medium", key="how_pairs")
    for window in windows:
        if window.fits:
            with row:
                _draw_window(trace, window, colours, theme)


def _draw_window(trace: Trace, w: ResimulatedWindow, colours: list[str], theme: Theme) -> None:
    """Draw one window where a patch fitted: how it was, and how it is."""
    image, data = trace.study.training_image, data_in(trace, _box_of(w))

    def map_of(cells) -> CellMap:
        shown = patch_map(cells, image, colours, theme, "A window")
        shown.points.extend([*at, int(cells[at[0], at[1]] != at[2])] for at in data)
        return shown

    key = f"{w.datum}_{w.size}_{w.isolated}"
    with st.container(width=2 * PIXELS + 16, key=f"how_window_{key}"):
        st.html(f'<p class="caption">{describe_window(w)}</p>')
        shown = {"before": w.before, "after": w.after}
        for place, (name, cells) in zip(pair(), shown.items(), strict=True):
            with place:
                st.html(f'<p class="caption">{name}</p>')
                draw_map(map_of(cells), f"how_map_{name}_{key}", max_height=PIXELS, tools=False)
