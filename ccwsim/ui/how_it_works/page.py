"""The page How it works: how a realization is simulated, patch by patch and step by step."""

import time
from dataclasses import replace
from functools import partial
from html import escape
from typing import Any

import numpy as np
import streamlit as st

from ccwsim import CCWSIMError, TrainingImage
from ccwsim.engine.stages.cut import UNKNOWN
from ccwsim.engine.stages.pyramid import decompose
from ccwsim.engine.trace import Trace, check_traceable, fates
from ccwsim.figures import CIVIDIS
from ccwsim.model import MAX_CANDIDATES_OFFERED, MAX_REALIZATIONS, Floats, levels, overlap_sizes
from ccwsim.ui.frontend.cells import draw_cells
from ccwsim.ui.frontend.component import run_script
from ccwsim.ui.how_it_works import maps, words
from ccwsim.ui.how_it_works.maps import PatchView, TraceView
from ccwsim.ui.how_it_works.resimulation import draw_resimulation
from ccwsim.ui.how_it_works.run import How, forget_own, page_parameters, set_own, trace_of, use_own
from ccwsim.ui.how_it_works.words import say
from ccwsim.ui.results.maps import colours_of
from ccwsim.ui.session import State, cached, data_of, error_boundary, page_link
from ccwsim.ui.study.study_column import size_fields
from ccwsim.ui.widgets import (
    bound_to,
    button,
    chart_theme,
    draw_style,
    field,
    help_of,
    in_row,
    options_of,
    page_text,
    pair,
    panel_title,
    plain,
)

DRAWING = "drawing"
"""Value of `How.resimulated` from the start of a full redraw until the re-simulation is drawn."""
PLAY_SECONDS = 0.8  # number of seconds between patches while the page plays
STEP_WIDTHS = [1.25, 0.72, 1.25, 1.0]
STEP_WIDTHS_VOLUME = [1.2, 1.0]
STEP_MAP_HEIGHT = 460
SMALL_MAP: dict[str, Any] = {"max_height": 200, "tools": False}
SLICES: dict[str, Any] = {"max_height": 300, "body": False}
SUBSCRIPTS = "₀₁₂₃₄₅₆"
LOCATION_MAPS = {"score": "CCW", "costs": "total", "image": "image"}
BANDS = {
    "cA": "approximation",
    "cH": "horizontal detail",
    "cV": "vertical detail",
    "cD": "diagonal detail",
}


def draw_how(state: State) -> None:
    """Draw the page, which is redrawn automatically while it plays."""
    page_state = state.page(How)
    draw_style("how_it_works/how.css", f":root {{ --drawn: {chart_theme().reference} }}")
    page_state.resimulated = DRAWING
    st.fragment(_draw, run_every=PLAY_SECONDS if page_state.playing else None)(
        state, page_state.playing
    )
    with st.container(key="how_after"):
        _after(state)
    page_link("pages/paper_and_ours.py", "Each step beside the paper, and the paper in 170 lines")


def _draw(state: State, timed: bool) -> None:
    page_state = state.page(How)
    with error_boundary():
        _draw_top(state)
    # a fragment cannot start its own timer or redraw elements below it
    if page_state.playing != timed or page_state.resimulated not in (DRAWING, page_state.traced):
        st.rerun()


@st.fragment
def _after(state: State) -> None:
    """Draw the local re-simulation, which does not depend on the patch on the page."""
    page_state = state.page(How)
    page_state.resimulated = page_state.traced
    with error_boundary():
        if page_state.trace is not None:
            view = TraceView(page_state.trace, colours_of(state), chart_theme())
            draw_resimulation(page_state, view)


def _draw_top(state: State) -> None:
    page_state = state.page(How)
    with in_row("how_top", "bottom", gap="large"):
        player = st.container(key="how_player", gap="small")
        _draw_setting(state)
    n_data = data_of(state.choices).n
    try:
        check_traceable(page_parameters(state), n_data)
    except CCWSIMError as error:
        page_state.stop(trace=None, traced=None)
        st.warning(plain(str(error)))
        button(
            "Follow our CCWSIM here",
            key="how_ccwsim",
            on_click=lambda: set_own(state, method="ccwsim", variant="ours"),
            type="primary",
        )
        return
    trace = trace_of(state)
    tick(page_state, len(trace.patches))
    with player:
        _draw_player(page_state, trace)
    with st.container(key="results"):
        _draw_patch(page_state, trace, colours_of(state))


def tick(page_state: How, n: int) -> None:
    """While the page plays, show the next patch at its time, and stop at the last patch."""
    if not page_state.playing or time.monotonic() - page_state.ticked < 0.7 * PLAY_SECONDS:
        return
    page_state.ticked = time.monotonic()
    if page_state.patch + 1 < n:
        page_state.patch += 1
    page_state.playing = page_state.patch + 1 < n


def _draw_player(page_state: How, trace: Trace) -> None:
    """Draw the controls that step through the patches: buttons, a slider, play, arrow keys."""
    n = len(trace.patches)

    def step(by: int) -> None:
        page_state.stop(patch=min(max(page_state.patch + by, 0), n - 1))

    def jump(number: int) -> None:
        page_state.stop(patch=min(number, n) - 1)

    def play() -> None:
        page_state.playing, page_state.ticked = True, time.monotonic()
        if page_state.patch + 1 >= n:
            page_state.patch = 0

    patch = trace.patches[page_state.patch]
    facts = [
        f"<b>Patch {patch.number + 1} of {n}</b>",
        escape(words.describe_sides(trace, patch.shape)),
        words.describe_position(trace, patch.number),
    ]
    if patch.split:
        facts.append(f"part {patch.part + 1} of a tile that is full of data ({words.OURS})")
    position = " ".join(f'<span class="fact">{fact}</span>' for fact in facts)
    st.html(f'<p class="facts where">{position}</p>')
    with in_row("how_row"):
        button(
            "Previous",
            key="how_previous",
            on_click=lambda: step(-1),
            icon=":material/chevron_left:",
            disabled=page_state.patch == 0,
        )
        with st.container(key="how_slide"):
            field(
                st.slider,
                "Patch",
                key="how_patch",
                value=page_state.patch + 1,
                write=jump,
                min_value=1,
                max_value=max(n, 2),
                disabled=n < 2,
                label_visibility="collapsed",
            )
        button(
            "Next",
            key="how_next",
            on_click=lambda: step(1),
            icon=":material/chevron_right:",
            disabled=page_state.patch + 1 == n,
        )
        # two buttons, so that a second click on a slow Stop does not start the play again
        if page_state.playing:
            button("Stop", key="how_stop", on_click=page_state.stop, type="primary")
        else:
            button("Play", key="how_play", on_click=play, type="primary")
    run_script("arrows", "how_arrows", lambda by: step(int(by)))


def _draw_setting(state: State) -> None:
    """Draw controls for the setting of this page, and a button that applies it to the study."""
    page_state, p = state.page(How), page_parameters(state)
    shape, is_ccsim = state.image.shape, p.method == "ccsim"

    def parameter(widget, label: str, name: str, key: str, **options) -> None:
        options = bound_to(p, name, partial(set_own, state), help=help_of(name)) | options
        field(widget, label, key=f"how_{key}", **options)

    def follow(number: int) -> None:
        page_state.stop(number=number - 1, datum=0)

    with in_row("how_setting", "bottom"):
        field(
            st.number_input,
            "Realization",
            key="how_number",
            value=page_state.number + 1,
            write=follow,
            min_value=1,
            max_value=MAX_REALIZATIONS,
            help="Index of the realization, as on the page Simulate.",
            width=124,
        )
        if len(shape) == 3:
            with st.popover("Sizes", key="how_sizes"):
                size_fields(p, shape, partial(set_own, state), "how_")
        else:
            parameter(
                st.selectbox,
                "Level J",
                "wavelet_level",
                "level",
                value=p.level,
                options=[0] if is_ccsim else levels(shape),
                disabled=is_ccsim,
                width=96,
            )
            (_, _, template), _, (_, _, level) = p.along(shape)
            parameter(
                st.selectbox,
                "Overlap OR",
                "overlap_size",
                "overlap",
                options=overlap_sizes(level, template),
                width=116,
            )
        parameter(
            st.number_input,
            "Candidates K",
            "n_candidates",
            "candidates",
            min_value=1,
            max_value=MAX_CANDIDATES_OFFERED,
            width=136,
        )
        if page_state.parameters is not None:
            use = "Applies this setting to the study, and therefore to all other pages."
            button("Use this setting", key="how_use", on_click=use_own, args=(state,), help=use)
            button("Back to the study's", key="how_back", on_click=forget_own, args=(state,))


def _draw_patch(page_state: How, trace: Trace, colours: list[str]) -> None:
    """Draw the steps of the patch, the table of locations, and the wavelet sub-bands."""
    step = trace.at(page_state.patch)
    view = PatchView(trace, colours, chart_theme(), step, fates(step))
    if view.is_volume:
        grid, overlap = st.columns(STEP_WIDTHS_VOLUME, gap="medium")
        score, candidates = st.columns(STEP_WIDTHS_VOLUME, gap="medium")
        patch, bands = st.container(), None
        texts = [grid, overlap, score, patch]
    else:
        with st.container(key="how_steps"):
            grid, overlap, score, patch = st.columns(STEP_WIDTHS, gap="medium")
            with st.container(key="how_texts"):
                texts = st.columns(4, gap="medium")
        with st.container(key="how_more"):
            candidates, bands = st.columns([1, 1.6], gap="large")
    with grid:
        _draw_grid(page_state, view)
    with overlap:
        _draw_overlap(page_state, view)
    with score:
        _draw_scores(page_state, view)
    with patch:
        _draw_pasting(view)
    words.say_steps(view, texts)
    with candidates:
        panel_title("Candidates" if step.data is None else "Candidates and hard data")
        words.say_candidates(view)
        words.draw_locations(view)
    if bands is not None:
        with bands:
            _draw_bands(page_state, view)


def _draw_grid(page_state: How, view: PatchView) -> None:
    panel_title("1 Grid so far", "overlap lit")
    trace = view.trace

    def jump(row: int, column: int) -> None:
        page_state.stop(patch=trace.patch_of_cell(row, column))

    draw_cells(
        replace(maps.grid_map(view), wells=page_state.wells),
        "how_grid",
        name="grid_so_far",
        grid=trace.study.grid,
        max_height=420 if view.is_volume else STEP_MAP_HEIGHT,
        on_cell=jump,
        cursor=maps.centre_of_patch(view),
    )


def _small(view: PatchView) -> dict[str, Any]:
    """Return options of a map or volume of the patch; all volumes of the page share the cursor."""
    return SLICES | {"link": "how_patch"} if view.is_volume else SMALL_MAP


def _draw_overlap(page_state: How, view: PatchView) -> None:
    step = view.step
    approximated = view.level and not view.is_volume
    panel_title(f"2 Overlap → cA{SUBSCRIPTS[view.level]}" if approximated else "2 Overlap")
    old = np.where(step.in_overlap, step.old, UNKNOWN).astype(np.uint8)
    draw_cells(view.patch_map(old, "The overlap"), "how_overlap", **_small(view))
    if not approximated:
        return
    image = view.image
    plane = facies = page_state.facies
    if len(step.blocks) == 1:
        plane, facies = 0, min(1, image.n_facies - 1)
    name = image.facies_names[facies]
    values, ends = view.trace.grid_frame.turned(step.approximation[plane]), (0, step.block_size)
    alt, absent = f"Approximation of {name}", "not in the overlap"
    cell_map = view.value_map(values, f"cA of {name}:", ends, alt, absent=absent)
    draw_cells(cell_map, "how_approximation", **SMALL_MAP)


def _draw_scores(page_state: How, view: PatchView) -> None:
    """Mark the locations in the volume or on the map of scores, or on the image."""
    if view.is_volume:
        panel_title("3 CCW score of each location", "in blocks of the training image")
        cell_map = maps.score_volume(view)
        drawn = cell_map.points[-1][:3]
        draw_cells(cell_map, "how_score", cursor=drawn, name="ccw_score", **SLICES)
        return
    step, trace = view.step, view.trace
    offered = [key for key in LOCATION_MAPS if key != "costs" or step.totals is not None]
    ground = page_state.ground if page_state.ground in offered else "score"
    with in_row("how_score_row"):
        panel_title("3 CCW score map")
        field(
            st.segmented_control,
            "Ground",
            key="how_ground",
            value=ground,
            write=lambda key: page_state.stop(ground=key),
            options=offered,
            format_func=lambda key: LOCATION_MAPS[key],
            label_visibility="collapsed",
        )
    if ground == "image":
        layer = trace.oriented.pyramid.image[step.layer]
        cell_map = view.patch_map(layer, f"Training image {view.image.name}")
        frame, scale = trace.image_frame, trace.search.block[2]
    else:
        cell_map = maps.score_map(view, ground == "costs")
        frame, scale = view.block_frame, 1
    share = view.search_fraction
    labels = [
        f"CCW {location.ccw:.4g}, {words.describe_fate(location, step, share)}"
        for location in view.locations
    ]
    cell_map.marks.extend(maps.location_marks(view, frame, scale, labels))
    draw_cells(cell_map, "how_score", max_height=STEP_MAP_HEIGHT, name="ccw_score_map")
    out = words.REJECTED_MARK if any(map(words.is_rejected, view.locations)) else ""
    st.html(words.MARKS.format(out))


def _draw_pasting(view: PatchView) -> None:
    step, part = view.step, view.part_of_grid
    panel_title("4 Drawn patch → cut → pasted")
    cell_maps = {
        "drawn patch": view.patch_map(step.cells, "The drawn patch"),
        "error surface": maps.error_map(view),
        "cut": maps.cut_map(view),
        "pasted": view.patch_map(step.after[view.part], "The grid with the patch pasted"),
    }
    if view.is_volume:
        del cell_maps["error surface"]  # the map of the cut also shows the overlap
    elif cell_maps["pasted"].indices.shape == tuple(side.stop - side.start for side in part):
        # the patch is completely within the grid
        cell_maps["pasted"].points.extend(maps.data_in(view.trace, part))
    with st.container(key="how_small_maps"):
        places = st.columns(3, gap="medium") if view.is_volume else [*pair(), *pair()]
    for place, (title, small) in zip(places, cell_maps.items(), strict=True):
        with place:
            st.html(f'<p class="caption">{title}</p>')
            options: dict[str, Any] = _small(view) | {"body": title == "cut"}
            draw_cells(small, f"how_{title.replace(' ', '_')}", **options)


def _draw_bands(page_state: How, view: PatchView) -> None:
    """Draw the sub-bands of the image at the search level, with the chosen location marked."""
    image, level, unit = view.image, view.level, view.step.block_size
    with in_row("how_bands_row"):
        panel_title("The training image in wavelets", f"level {level}")
        if image.n_facies > 2:
            field(
                st.selectbox,
                "Facies",
                key="how_facies",
                width=140,
                label_visibility="collapsed",
                **bound_to(page_state, "facies"),
                **options_of(dict(enumerate(image.facies_names))),
            )
    if not level:
        say(page_text("Level 0"), words.STEP_REFERENCES["image"])
        return
    bands = _bands(image, page_state.facies, level)
    box = view.trace.image_frame.box_to_grid(view.step.drawn_place, view.step.cells.shape)
    mark = maps.box_mark(box, view.theme.reference, "the drawn patch", side_of_cell=unit)
    with st.container(key="how_bands"):
        places = st.columns(4, gap="medium")
    for place, (name, meaning) in zip(places, BANDS.items(), strict=True):
        with place:
            panel_title(f"{name}{SUBSCRIPTS[level]}", meaning)
            band, largest = bands[name], float(abs(bands[name]).max()) or 1.0
            ends, colours = (-largest, largest), view.theme.difference
            if name == "cA":
                ends, colours = (0, unit), CIVIDIS
            alt = f"{name}, {meaning}"
            band_map = view.value_map(band, name, ends, alt, colours)
            if not view.step.source:  # otherwise, the patch is from a copy
                band_map.marks.append(mark)
            draw_cells(
                band_map,
                f"how_{name}",
                name=name,
                link="how_bands",
                scale="how_bands",
                max_height=300,
            )
    say(page_text("Sub-bands", side=unit), words.STEP_REFERENCES["image"])
    patch, (ty, tx) = view.trace.reconstructed(view.step, page_state.facies), view.step.drawn_place
    n, layer = len(patch), view.trace.oriented.pyramid.image[view.step.layer]
    sliced = layer[ty : ty + n, tx : tx + n] == page_state.facies
    largest = float(abs(patch - sliced).max(initial=0.0))
    size = len(view.step.cells)
    difference = "0" if largest == 0 else f"{largest:.0e}"
    text = page_text("Inverse transform", size=size, n=size // unit, largest=difference)
    say(text, words.STEP_REFERENCES["inverse"])


@cached(max_entries=16)
def _bands(image: TrainingImage, facies: int, level: int) -> dict[str, Floats]:
    approximation, details, *_ = decompose(image.indices == facies, level)
    return dict(zip(BANDS, (approximation, *details), strict=True))
