"""The four steps of one patch, side by side: grid, overlap, score map, patch."""

from __future__ import annotations

import numpy as np
import streamlit as st

from ccwsim.engine.stages.cut import UNKNOWN
from ccwsim.engine.trace import Frame, PlaceFate, Trace, TracedPatch
from ccwsim.figures import Theme
from ccwsim.ui.how_it_works.fates import said_fate
from ccwsim.ui.how_it_works.maps import (
    cut_map,
    error_map,
    fate_marks,
    grid_map,
    patch_map,
    score_map,
    value_map,
)
from ccwsim.ui.how_it_works.state import How
from ccwsim.ui.how_it_works.words import (
    cut_words,
    draw_words,
    overlap_words,
    path_words,
    say,
    score_words,
)
from ccwsim.ui.session.state import State
from ccwsim.ui.widgets.fields import field
from ccwsim.ui.widgets.maps import draw_map, facies_map
from ccwsim.ui.widgets.steps import pair, panel_title

WIDTHS = [1.25, 0.72, 1.25, 1.0]
LARGE, SMALL = 460, 200
SUBSCRIPTS = "₀₁₂₃₄₅₆"
GROUNDS = {"score": "CCW", "costs": "with data", "image": "image"}
MARKS = (
    '<p class="marks"><span><i class="mark drawn"></i>drawn</span><span><i class="mark candidate">'
    "</i>candidate</span>{}</p>"
)
FALLEN = '<span><i class="mark out"></i>fell out</span>'


def draw_steps(
    state: State, trace: Trace, step: TracedPatch, told: list[PlaceFate], colours: list[str],
    theme: Theme,
) -> None:  # fmt: skip
    """Draw the steps of the patch that is shown."""
    with st.container(key="how_steps"):
        grid, overlap, score, patch = st.columns(WIDTHS, gap="medium")
    with grid:
        _grid(state, trace, step, colours, theme)
    with overlap:
        _overlap(state, trace, step, colours, theme)
    with score:
        _score(state, trace, step, told, colours, theme)
    with patch:
        _patch(trace, step, told, colours, theme)


def _grid(state: State, trace: Trace, step: TracedPatch, colours: list[str], theme: Theme) -> None:
    panel_title("1 Grid so far", "overlap lit")
    draw_map(
        grid_map(trace, step, colours, theme), "how_map_grid", grid=trace.study.grid,
        max_height=LARGE, name="grid_so_far",
        on_cell=lambda row, column: state.page(How).go(trace.patch_of_cell(row, column)),
    )  # fmt: skip
    say(path_words(trace), "section 4.1 · Algorithm 1, line 3")


def _overlap(
    state: State, trace: Trace, step: TracedPatch, colours: list[str], theme: Theme
) -> None:
    image, frame = trace.study.training_image, trace.grid_frame
    level = trace.study.parameters.level
    panel_title(f"2 Overlap → cA{SUBSCRIPTS[level]}" if level else "2 Overlap")
    old = np.where(step.in_overlap, step.old, UNKNOWN).astype(np.uint8)
    shown = patch_map(frame.patch_to_world(old), image, colours, theme, "The overlap")
    draw_map(shown, "how_map_overlap", max_height=SMALL, tools=False)
    plane = 0 if len(step.blocks) == 1 else state.page(How).facies
    named = image.facies_names[1 if len(step.blocks) == 1 and image.n_facies > 1 else plane]
    values = frame.patch_to_world(step.approximation[plane])
    if level:
        draw_map(
            value_map(values, f"cA of {named}:", theme, f"Approximation of {named}", low=0.0,
                      high=float(step.unit), absent="not in the overlap"),
            "how_map_approximation", max_height=SMALL, tools=False,
        )  # fmt: skip
    say(overlap_words(trace, step), "sections 3 and 4.2")


def _score(
    state: State, trace: Trace, step: TracedPatch, told: list[PlaceFate], colours: list[str],
    theme: Theme,
) -> None:  # fmt: skip
    how = state.page(How)
    share = trace.study.parameters.search_fraction
    offered = [key for key in GROUNDS if key != "costs" or step.totals is not None]
    ground = how.ground if how.ground in offered else "score"
    with st.container(horizontal=True, vertical_alignment="center", key="how_score_row"):
        panel_title("3 CCW score map")
        field(
            st.segmented_control, "Ground", key="how_ground", value=ground, options=offered,
            format_func=lambda key: GROUNDS[key], label_visibility="collapsed",
            write=how.show,
        )  # fmt: skip
    if ground == "image":
        image = trace.study.training_image
        shown = facies_map(image.indices, image, colours, f"Training image {image.name}")
        frame, scale = trace.image_frame, trace.search.unit
    else:
        shown = score_map(trace, step, theme, ground == "costs")
        shape = trace.oriented.pyramid.phases.shape[2:]
        frame, scale = Frame(trace.path.orientation, (shape[0], shape[1])), 1
    said = [f"CCW {place.ccw:.4g}, {said_fate(place, step, share)}" for place in told]
    shown.marks.extend(fate_marks(frame, scale, step, told, theme, said))
    draw_map(shown, "how_map_score", max_height=LARGE, name="ccw_score_map")
    fallen = any(place.fate not in ("drawn", "candidate") for place in told)
    st.html(MARKS.format(FALLEN if fallen else ""))
    say(score_words(step), "sections 3.2 and 4.2")


def _patch(
    trace: Trace, step: TracedPatch, told: list[PlaceFate], colours: list[str], theme: Theme
) -> None:
    image, frame, p = trace.study.training_image, trace.grid_frame, step.patch
    panel_title("4 Drawn patch → cut → pasted")
    part = np.s_[p.y0 : p.y0 + p.size, p.x0 : p.x0 + p.size]
    new, after = (frame.patch_to_world(a) for a in (step.cells, step.after[part]))
    inside = frame.box_to_world(p.y0, p.x0, p.size, p.size)
    shown = {
        "drawn patch": patch_map(new, image, colours, theme, "The drawn patch"),
        "error surface": error_map(trace, step, theme),
        "cut": cut_map(trace, step, theme),
        "pasted": patch_map(after, image, colours, theme, "The grid with the patch pasted"),
    }
    if inside.height == inside.width == p.size:  # whole: data can be shown where they lie
        shown["pasted"].points.extend(_data_in(trace, inside))
    with st.container(key="how_small_maps"):
        places = [*pair(), *pair()]
    for place, (title, small) in zip(places, shown.items(), strict=True):
        with place:
            st.html(f'<p class="caption">{title}</p>')
            draw_map(small, f"how_map_{title.replace(' ', '_')}", max_height=SMALL, tools=False)
    say(draw_words(step, told), "Algorithm 1, lines 8 and 9")
    say(cut_words(step), "section 4.3 · Algorithm 1, line 10")


def _data_in(trace: Trace, box) -> list[list[int]]:
    """Return the data in a box as points of its own map."""
    cells, facies = trace.study.hard_data.cells, trace.study.facies_of_data
    return [
        [int(row) - box.row, int(column) - box.column, int(of), 0]
        for (row, column), of in zip(cells, facies, strict=True)
        if 0 <= row - box.row < box.height and 0 <= column - box.column < box.width
    ]
