"""The page How it works: how a realization is simulated, patch by patch and step by step."""

import time
from dataclasses import replace
from functools import partial
from html import escape
from typing import Any

import numpy as np
import streamlit as st
from numpy.typing import NDArray

from ccwsim.engine.stages.cut import UNKNOWN
from ccwsim.engine.stages.pyramid import decompose
from ccwsim.engine.trace import Trace, check_traceable, fates
from ccwsim.figures import CIVIDIS
from ccwsim.model.bounds import MAX_CANDIDATES_OFFERED, MAX_REALIZATIONS
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.sizes import levels, overlap_sizes
from ccwsim.model.training_image import TrainingImage
from ccwsim.ui.frontend.cells import draw_cells
from ccwsim.ui.frontend.component import run_script
from ccwsim.ui.how_it_works import maps, words
from ccwsim.ui.how_it_works.maps import PatchView
from ccwsim.ui.how_it_works.resimulation import draw_resimulation
from ccwsim.ui.how_it_works.run import How, forget_own, parameters_of, set_own, trace_of, use_own
from ccwsim.ui.how_it_works.words import say
from ccwsim.ui.results.maps import colours_of
from ccwsim.ui.session.cached import cached
from ccwsim.ui.session.fragments import error_boundary
from ccwsim.ui.session.resolve import image_of
from ccwsim.ui.session.state import State
from ccwsim.ui.study.study_column import size_fields
from ccwsim.ui.widgets.fields import bound_to, button, field, help_of, options_of
from ccwsim.ui.widgets.text import page_text, pair, panel_title, plain
from ccwsim.ui.widgets.theme import chart_theme, draw_style

DRAWING = "drawing"
"""Value of `How.resimulated` from the start of a full redraw until the re-simulation is drawn."""
PLAY_SECONDS = 0.8  # number of seconds between patches while the page plays
WIDTHS = [1.25, 0.72, 1.25, 1.0]
WIDTHS_VOLUME = [1.2, 1.0]
MAX_HEIGHT = 460
SMALL_MAP: dict[str, Any] = {"max_height": 200, "tools": False}
SLICES: dict[str, Any] = {"max_height": 300, "body": False}
SUBSCRIPTS = "₀₁₂₃₄₅₆"
GROUNDS = {"score": "CCW", "costs": "total", "image": "image"}
BANDS = {
    "cA": "approximation",
    "cH": "horizontal detail",
    "cV": "vertical detail",
    "cD": "diagonal detail",
}


def draw_how(state: State) -> None:
    """Draw the page, which is redrawn automatically while it plays."""
    how = state.page(How)
    draw_style("how_it_works/how.css", f":root {{ --drawn: {chart_theme().reference} }}")
    how.resimulated = DRAWING
    st.fragment(_draw, run_every=PLAY_SECONDS if how.playing else None)(state, how.playing)
    with st.container(key="how_after"):
        _after(state)


def _draw(state: State, timed: bool) -> None:
    how = state.page(How)
    with error_boundary():
        _draw_top(state)
    # a fragment cannot start its own timer or redraw elements below it
    if how.playing != timed or how.resimulated not in (DRAWING, how.traced):
        st.rerun()


@st.fragment
def _after(state: State) -> None:
    """Draw the local re-simulation, which does not depend on the patch on the page."""
    how = state.page(How)
    how.resimulated = how.traced
    with error_boundary():
        if how.trace is not None:
            draw_resimulation(how, how.trace, colours_of(state), chart_theme())


def _draw_top(state: State) -> None:
    how = state.page(How)
    with st.container(horizontal=True, vertical_alignment="bottom", gap="large", key="how_top"):
        player = st.container(key="how_player", gap="small")
        _draw_setting(state)
    try:
        check_traceable(parameters_of(state))
    except CCWSIMError as error:
        how.stop(trace=None, traced=None)
        st.warning(plain(str(error)))
        to_ccwsim = {"on_click": lambda: set_own(state, method="ccwsim"), "type": "primary"}
        button("Follow CCWSIM here", key="how_ccwsim", **to_ccwsim)
        return
    trace = trace_of(state)
    tick(how, len(trace.patches))
    with player:
        _draw_player(how, trace)
    with st.container(key="results"):
        _draw_patch(how, trace, colours_of(state))


def tick(how: How, n: int) -> None:
    """While the page plays, show the next patch at its time, and stop at the last patch."""
    if not how.playing or time.monotonic() - how.ticked < 0.7 * PLAY_SECONDS:
        return
    how.ticked = time.monotonic()
    if how.patch + 1 < n:
        how.patch += 1
    how.playing = how.patch + 1 < n


def _draw_player(how: How, trace: Trace) -> None:
    """Draw the controls that step through the patches: buttons, a slider, play, arrow keys."""
    n = len(trace.patches)

    def step(by: int) -> None:
        how.stop(patch=min(max(how.patch + by, 0), n - 1))

    def jump(number: int) -> None:
        how.stop(patch=min(number, n) - 1)

    def play() -> None:
        how.playing, how.ticked = True, time.monotonic()
        if how.patch + 1 >= n:
            how.patch = 0

    patch = trace.patches[how.patch]
    facts = [
        f"<b>Patch {patch.number + 1} of {n}</b>",
        escape(words.describe_sides(trace, patch.shape)),
        words.describe_position(trace, patch.number),
    ]
    if patch.split:
        facts.append(f"part {patch.part + 1} of a tile that is full of data ({words.OURS})")
    position = " ".join(f'<span class="fact">{fact}</span>' for fact in facts)
    st.html(f'<p class="facts where">{position}</p>')
    with st.container(horizontal=True, vertical_alignment="center", gap="small", key="how_row"):
        ends = {"icon": ":material/chevron_left:", "disabled": how.patch == 0}
        button("Previous", key="how_previous", on_click=lambda: step(-1), **ends)
        with st.container(key="how_slide"):
            track = {"value": how.patch + 1, "min_value": 1, "max_value": max(n, 2)}
            look = {"disabled": n < 2, "label_visibility": "collapsed"}
            field(st.slider, "Patch", key="how_patch", write=jump, **track, **look)
        ends = {"icon": ":material/chevron_right:", "disabled": how.patch + 1 == n}
        button("Next", key="how_next", on_click=lambda: step(1), **ends)
        # two buttons, so that a second click on a slow Stop does not start the play again
        if how.playing:
            button("Stop", key="how_stop", on_click=how.stop, type="primary")
        else:
            button("Play", key="how_play", on_click=play, type="primary")
    run_script("arrows", "how_arrows", lambda by: step(int(by)))


def _draw_setting(state: State) -> None:
    """Draw controls for the setting of this page, and a button that applies it to the study."""
    how, p = state.page(How), parameters_of(state)
    shape, is_ccsim = image_of(state.choices.image).shape, p.method == "ccsim"

    def parameter(widget, label: str, name: str, key: str, **options) -> None:
        options = bound_to(p, name, partial(set_own, state), help=help_of(name)) | options
        field(widget, label, key=f"how_{key}", **options)

    def follow(number: int) -> None:
        how.stop(number=number - 1, datum=0)

    with st.container(horizontal=True, vertical_alignment="bottom", gap="small", key="how_setting"):
        numbers = {"value": how.number + 1, "min_value": 1, "max_value": MAX_REALIZATIONS}
        look = {"help": "Index of the realization, as on the page Simulate.", "width": 124}
        field(st.number_input, "Realization", key="how_number", write=follow, **numbers, **look)
        if len(shape) == 3:
            with st.popover("Sizes", key="how_sizes"):
                size_fields(p, shape, partial(set_own, state), "how_")
        else:
            offered: dict[str, Any] = {"options": [0] if is_ccsim else levels(shape)}
            offered |= {"disabled": is_ccsim, "width": 96}
            parameter(st.selectbox, "Level J", "wavelet_level", "level", value=p.level, **offered)
            (_, _, template), _, (_, _, level) = p.along(shape)
            offered = {"options": overlap_sizes(level, template), "width": 116}
            parameter(st.selectbox, "Overlap OR", "overlap_size", "overlap", **offered)
        numbers = {"min_value": 1, "max_value": MAX_CANDIDATES_OFFERED, "width": 136}
        parameter(st.number_input, "Candidates K", "n_candidates", "candidates", **numbers)
        if how.parameters is not None:
            use = "Applies this setting to the study, and therefore to all other pages."
            button("Use this setting", key="how_use", on_click=use_own, args=(state,), help=use)
            button("Back to the study's", key="how_back", on_click=forget_own, args=(state,))


def _draw_patch(how: How, trace: Trace, colours: list[str]) -> None:
    """Draw the steps of the patch, the table of locations, and the wavelet sub-bands."""
    step = trace.at(how.patch)
    view = PatchView(trace, step, fates(step), colours, chart_theme())
    if view.is_volume:
        grid, overlap = st.columns(WIDTHS_VOLUME, gap="medium")
        score, candidates = st.columns(WIDTHS_VOLUME, gap="medium")
        patch, bands = st.container(), None
        texts = [grid, overlap, score, patch]
    else:
        with st.container(key="how_steps"):
            grid, overlap, score, patch = st.columns(WIDTHS, gap="medium")
            with st.container(key="how_texts"):
                texts = st.columns(4, gap="medium")
        with st.container(key="how_more"):
            candidates, bands = st.columns([1, 1.6], gap="large")
    with grid:
        _draw_grid(how, view)
    with overlap:
        _draw_overlap(how, view)
    with score:
        _draw_scores(how, view)
    with patch:
        _draw_pasting(view)
    words.say_steps(view, texts)
    with candidates:
        panel_title("Candidates" if step.data is None else "Candidates and hard data")
        words.say_candidates(view)
        words.draw_locations(view)
    if bands is not None:
        with bands:
            _draw_bands(how, view)


def _draw_grid(how: How, view: PatchView) -> None:
    panel_title("1 Grid so far", "overlap lit")
    trace = view.trace

    def jump(row: int, column: int) -> None:
        how.stop(patch=trace.patch_of_cell(row, column))

    options: dict[str, Any] = {"grid": trace.study.grid, "name": "grid_so_far", "on_cell": jump}
    options["max_height"] = 420 if view.is_volume else MAX_HEIGHT
    shown = replace(maps.grid_map(view), wells=how.wells)
    draw_cells(shown, "how_grid", cursor=maps.centre_of_patch(view), **options)


def _small(view: PatchView) -> dict[str, Any]:
    """Return options of a map or volume of the patch; all volumes of the page share the cursor."""
    return SLICES | {"link": "how_patch"} if view.is_volume else SMALL_MAP


def _draw_overlap(how: How, view: PatchView) -> None:
    step = view.step
    approximated = view.level and not view.is_volume
    panel_title(f"2 Overlap → cA{SUBSCRIPTS[view.level]}" if approximated else "2 Overlap")
    old = np.where(step.in_overlap, step.old, UNKNOWN).astype(np.uint8)
    draw_cells(view.patch_map(old, "The overlap"), "how_overlap", **_small(view))
    if not approximated:
        return
    image = view.image
    plane = facies = how.facies
    if len(step.blocks) == 1:
        plane, facies = 0, min(1, image.n_facies - 1)
    name = image.facies_names[facies]
    values, ends = view.trace.grid_frame.turned(step.approximation[plane]), (0, step.block_size)
    alt, absent = f"Approximation of {name}", "not in the overlap"
    shown = maps.value_map(values, f"cA of {name}:", ends, view.theme, alt, absent=absent)
    draw_cells(shown, "how_approximation", **SMALL_MAP)


def _draw_scores(how: How, view: PatchView) -> None:
    """Mark the locations in the volume or on the map of scores, or on the image."""
    if view.is_volume:
        panel_title("3 CCW score of each location", "in blocks of the training image")
        shown = maps.score_volume(view)
        drawn = shown.points[-1][:3]
        draw_cells(shown, "how_score", cursor=drawn, name="ccw_score", **SLICES)
        return
    step, trace = view.step, view.trace
    offered = [key for key in GROUNDS if key != "costs" or step.totals is not None]
    ground = how.ground if how.ground in offered else "score"
    with st.container(horizontal=True, vertical_alignment="center", key="how_score_row"):
        panel_title("3 CCW score map")
        options = {"value": ground, "options": offered, "format_func": lambda key: GROUNDS[key]}
        options |= {"write": lambda key: how.stop(ground=key), "label_visibility": "collapsed"}
        field(st.segmented_control, "Ground", key="how_ground", **options)
    if ground == "image":
        cells = trace.oriented.pyramid.image[step.layer]
        shown = view.patch_map(cells, f"Training image {view.image.name}")
        frame, scale = trace.image_frame, trace.search.block[2]
    else:
        shown = maps.score_map(view, ground == "costs")
        frame, scale = view.block_frame, 1
    share = view.search_fraction
    labels = [f"CCW {at.ccw:.4g}, {words.describe_fate(at, step, share)}" for at in view.locations]
    shown.marks.extend(maps.location_marks(view, frame, scale, labels))
    draw_cells(shown, "how_score", max_height=MAX_HEIGHT, name="ccw_score_map")
    out = words.REJECTED_MARK if any(map(words.is_rejected, view.locations)) else ""
    st.html(words.MARKS.format(out))


def _draw_pasting(view: PatchView) -> None:
    step, part = view.step, view.part_of_grid
    panel_title("4 Drawn patch → cut → pasted")
    shown = {
        "drawn patch": view.patch_map(step.cells, "The drawn patch"),
        "error surface": maps.error_map(view),
        "cut": maps.cut_map(view),
        "pasted": view.patch_map(step.after[view.part], "The grid with the patch pasted"),
    }
    if view.is_volume:
        del shown["error surface"]  # the map of the cut also shows the overlap
    elif shown["pasted"].indices.shape == tuple(side.stop - side.start for side in part):
        # the patch is completely within the grid
        shown["pasted"].points.extend(maps.data_in(view.trace, part))
    with st.container(key="how_small_maps"):
        places = st.columns(3, gap="medium") if view.is_volume else [*pair(), *pair()]
    for place, (title, small) in zip(places, shown.items(), strict=True):
        with place:
            st.html(f'<p class="caption">{title}</p>')
            options: dict[str, Any] = _small(view) | {"body": title == "cut"}
            draw_cells(small, f"how_{title.replace(' ', '_')}", **options)


def _draw_bands(how: How, view: PatchView) -> None:
    """Draw the sub-bands of the image at the search level, with the chosen location marked."""
    image, level, unit = view.image, view.level, view.step.block_size
    with st.container(horizontal=True, vertical_alignment="center", key="how_bands_row"):
        panel_title("The training image in wavelets", f"level {level}")
        if image.n_facies > 2:
            options = bound_to(how, "facies", width=140, label_visibility="collapsed")
            options |= options_of(dict(enumerate(image.facies_names)))
            field(st.selectbox, "Facies", key="how_facies", **options)
    if not level:
        say(page_text("Level 0"), words.PAPER["image"])
        return
    bands = _bands(image, how.facies, level)
    box = view.trace.image_frame.box_to_grid(view.step.drawn_place, view.step.cells.shape)
    mark = maps.box_mark(box, view.theme.reference, "the drawn patch", cells=unit)
    with st.container(key="how_bands"):
        places = st.columns(4, gap="medium")
    for place, (name, meaning) in zip(places, BANDS.items(), strict=True):
        with place:
            panel_title(f"{name}{SUBSCRIPTS[level]}", meaning)
            band, largest = bands[name], float(abs(bands[name]).max()) or 1.0
            ends, colours = (-largest, largest), view.theme.difference
            if name == "cA":
                ends, colours = (0, unit), CIVIDIS
            shown = maps.value_map(band, name, ends, view.theme, f"{name}, {meaning}", colours)
            if not view.step.source:  # otherwise, the patch is from a copy
                shown.marks.append(mark)
            linked: dict[str, Any] = {"scale": "how_bands", "link": "how_bands", "name": name}
            draw_cells(shown, f"how_{name}", max_height=300, **linked)
    say(page_text("Sub-bands", side=unit), words.PAPER["image"])
    patch, (ty, tx) = view.trace.reconstructed(view.step, how.facies), view.step.drawn_place
    n, cells = len(patch), view.trace.oriented.pyramid.image[view.step.layer]
    sliced = cells[ty : ty + n, tx : tx + n] == how.facies
    largest = float(abs(patch - sliced).max(initial=0.0))
    shown = "0" if largest == 0 else f"{largest:.0e}"
    values = {"size": len(view.step.cells), "n": len(view.step.cells) // unit, "largest": shown}
    say(page_text("Inverse transform", **values), words.PAPER["inverse"])


@cached(max_entries=16)
def _bands(image: TrainingImage, facies: int, level: int) -> dict[str, NDArray[np.float64]]:
    approximation, details, *_ = decompose(image.indices == facies, level)
    return dict(zip(BANDS, (approximation, *details), strict=True))
