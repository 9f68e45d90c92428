"""The texts beside the steps, their sections in the paper, and the table of locations."""

from collections.abc import Sequence
from html import escape
from math import prod

import numpy as np
import streamlit as st
from streamlit.delta_generator import DeltaGenerator

from ccwsim.engine.stages.path import ORDERS, Triple, along_path
from ccwsim.engine.trace import PlaceFate, ResimulatedWindow, Trace, TracedPatch
from ccwsim.model import describe_shape as cells_along, listing, read_toml
from ccwsim.ui.how_it_works.maps import PatchView
from ccwsim.ui.widgets import page_text, scrolled

MAX_ROWS = 24
MARKS = (
    '<p class="marks"><span><i class="mark drawn"></i>drawn</span><span><i class="mark candidate">'
    "</i>candidate</span>{}</p>"
)
REJECTED_MARK = '<span><i class="mark out"></i>rejected</span>'
OURS = "not in the paper"
STEP_REFERENCES = read_toml("ui/how_it_works/paper.toml")
"""For each step, the section, figure and line of the paper that describe the step."""
LAYER_ROW_COLUMN = ("layer", "row", "column")
ORDER_WORDS = (
    "layer after layer",
    "row by row through all layers",
    "column by column through all layers",
)
"""Description of each order in `ORDERS`, in which the patches of a volume are placed."""


def say(text: str, source: str) -> None:
    """Write a text in HTML, followed by its section in the paper or "not in the paper"."""
    st.html(f'<p class="say">{text} <span class="ref">{escape(source)}</span></p>')


def say_steps(view: PatchView, places: Sequence[DeltaGenerator]) -> None:
    """Write the text of each of the four steps, with the number of the step, into its place."""
    step, trace = view.step, view.trace
    overlap, scores, draw, cut = (STEP_REFERENCES["first patch"],) * 3 + (STEP_REFERENCES["paste"],)
    if step.patch.shape:
        overlap = STEP_REFERENCES["overlap" if view.level else "single cells"]
        scores, draw = STEP_REFERENCES["scores"], STEP_REFERENCES["draw"]
        cut = OURS if view.is_volume else STEP_REFERENCES["cut"]
    texts = (
        [(describe_path(trace), STEP_REFERENCES["path"]), (describe_offset(trace), OURS)],
        [(describe_overlap(view), overlap)],
        [(describe_patch_scores(step), scores)],
        [
            (describe_draw(view), draw),
            (f"The patch is from {escape(step.source)}." if step.source else "", OURS),
            (describe_shift(step), OURS),
            (describe_cut(view), cut),
        ],
    )
    for number, (place, texts_of_step) in enumerate(zip(places, texts, strict=True), start=1):
        with place:
            for k, (text, source) in enumerate(texts_of_step):
                if text:
                    say(f"<b>{number}</b> {text}" if k == 0 else text, source)


def format_count(n: int, singular: str, plural: str = "") -> str:
    """Return a number with its noun, in singular or plural."""
    return f"{n:,} {singular if n == 1 else plural or singular + 's'}".replace(",", "\u202f")


def describe_sides(trace: Trace, sides: int) -> str:
    """Return a text that lists the sides of a patch that overlap earlier patches."""
    faces = trace.grid_frame.faces(sides)
    if not faces:
        return "the first patch, no overlap"
    if trace.study.grid.is_volume:
        return f"overlap on {format_count(len(faces), 'face')}: {listing(faces)}"
    return f"{'L-shaped overlap,' if len(faces) == 2 else 'overlap in the'} {listing(faces)}"


def describe_position(trace: Trace, number: int) -> str:
    """Describe the position of a patch among the tiles of the path."""
    tiles = trace.path.tiles
    position = np.unravel_index(trace.patches[number].tile, tiles)
    named = zip(LAYER_ROW_COLUMN, position, tiles, strict=True)
    along = [*named][-trace.study.grid.n_dimensions :]
    return ", ".join(f"{name} {int(k) + 1} of {n}" for name, k, n in along) + " of the path"


def describe_path(trace: Trace) -> str:
    """Return a description of the start, direction and step of the path."""
    frame, search, volume = trace.grid_frame, trace.search, trace.study.grid.is_volume
    corner, is_random = frame.faces(), trace.study.parameters.random_path
    line = "row" if frame.direction in ("east", "west") else "column"
    start = f"the <b>{'-'.join(corner)}</b> and runs <b>{frame.direction}</b>, {line} after {line}"
    if volume:
        order = ORDER_WORDS[[axes[0] for axes in ORDERS].index(ORDERS[trace.path.order][0])]
        start = f"the corner <b>{listing(corner)}</b> and proceeds {order}"

    def along(lengths: Triple) -> str:
        in_grid = along_path(lengths, trace.path.orientation)
        return cells_along(in_grid) if volume else str(in_grid[-1])

    z, y, x = (t - o for t, o in zip(search.template, search.overlap, strict=True))
    return page_text(
        "Path",
        way=start,
        same="random in each realization" if is_random else "equal in all realizations",
        keys="Left" if volume else "Click the grid to show a patch; left",
        step=along((z, y, x)),
        template=along(search.template),
        overlap=along(search.overlap),
    )


def describe_offset(trace: Trace) -> str:
    """Return a sentence that explains why the first patch begins outside the grid."""
    offset = trace.grid_frame.offset
    if not any(offset):
        return ""
    named = zip(LAYER_ROW_COLUMN[-len(offset) :], offset, strict=True)
    counts = listing(format_count(n, name) for name, n in named)
    return page_text("Offset of the path", offset=counts)


def describe_overlap(view: PatchView) -> str:
    """Return a sentence on the size of the overlap and on the size of the approximation."""
    n_cells = int(view.step.in_overlap.sum())
    if not n_cells:
        return "The grid is still empty, so there is no overlap to compare with the image."
    size_text = f"The overlap is {format_count(n_cells, 'cell')}."
    if max(view.block) == 1:
        return f"{size_text} At level 0, cells are compared one by one, as in CCSIM."
    return page_text(
        "Approximation of the overlap",
        cells=size_text,
        level=view.level,
        n=format_count(int(np.isfinite(view.step.approximation[0]).sum()), "coefficient"),
        numbers=format_count(n_cells, "number"),
        block=cells_along(view.block),
        factor=f"{prod(view.block) ** 0.5:.3g}",
    )


def describe_patch_scores(step: TracedPatch) -> str:
    """Return a description of the scores, and the best score."""
    locations = format_count(int(np.isfinite(step.ccw).sum()), "location")
    if not step.patch.shape:
        decide = " Only the hard data decide." if step.data is not None else ""
        return f"Without an overlap, all {locations} of the image fit equally well.{decide}"
    ccw = step.ccw
    if step.correlation:
        best, measure = (
            np.nanmax(ccw),
            "the paper's CCW (cross-correlation) ΣA·B; the largest is best",
        )
    else:
        best, measure = np.nanmin(ccw), page_text("Squared difference")
    median = f"{np.nanpercentile(ccw, 50, method='higher'):.4g}"
    return page_text("Scores", locations=locations, how=measure, best=f"{best:.4g}", median=median)


def describe_draw(view: PatchView) -> str:
    """Return a description of how the location was chosen."""
    step, n = view.step, view.step.n_candidates
    chances = "all equally likely"
    if step.steered:
        chances = "candidates that correct the facies proportions are preferred (not in the paper)"
    chance = f"One of {n} candidates is drawn: {chances}. This choice makes realizations differ."
    if n == 1:
        chance = "The location is the only candidate."
    elif step.n_drawn > 1:
        chance = page_text("Several drawn", n_drawn=step.n_drawn, n=n, how=chances)
    return f"Drawn: CCW {view.locations[0].ccw:.4g}. {chance}"


def describe_shift(step: TracedPatch) -> str:
    """Return a sentence on the shift of the patch by refinement; empty without a shift."""
    shift = int(np.abs(np.subtract(step.place, step.drawn_place)).max())
    sentence = (
        f"Refinement shifted the patch by {format_count(shift, 'cell')} to the best fit at full"
    )
    return f"{sentence} resolution." if shift else ""


def describe_cut(view: PatchView) -> str:
    """Return a description of the search for the cut, with the number of kept grid cells."""
    step = view.step
    if not step.patch.shape:
        return "There is no overlap to cut, so the whole patch is pasted."
    n_cells, kept = int(step.in_overlap.sum()), format_count(int(step.keep_mask.sum()), "cell")
    cut = page_text("Cut of a map", kept=kept)
    if view.is_volume:
        cut = page_text("Cut of a volume", kept=kept)
    differ = f"{int(step.error.sum())} of {format_count(n_cells, 'cell')}"
    return f"Patch and grid differ in {differ} of the overlap. {cut}"


def describe_fate(location: PlaceFate, step: TracedPatch, search_fraction: float) -> str:
    """Describe the fate of a location and the reason for it."""
    return page_text(
        f"Fate of a location: {location.fate}",
        best=f"{100 * search_fraction:.3g}",
        missed=_misses(location),
    )


def _misses(location: PlaceFate) -> str:
    missed = {
        "in the patch": location.missed,
        "that the cut must keep": location.held,
        "ahead": location.ahead,
    }
    parts = [
        f"misses {format_count(n, 'datum', 'data')} {where}" for where, n in missed.items() if n
    ]
    return ", ".join(parts) or "may miss data ahead, which would be outside the image"


def is_rejected(location: PlaceFate) -> bool:
    """Return whether a location was rejected although it fits the overlap."""
    return location.fate not in ("drawn", "candidate")


def draw_locations(view: PatchView) -> None:
    """Draw the table of locations with their scores, missed data and fates."""
    has_data = view.step.data is not None
    rejected = [location for location in view.locations if is_rejected(location)]
    listed = view.locations[: MAX_ROWS - min(len(rejected), MAX_ROWS // 2)]
    listed += [location for location in rejected if location not in listed][
        : MAX_ROWS - len(listed)
    ]
    axes = "x, y, z" if view.is_volume else "x, y"
    names = [f"location {axes}", "CCW", *(["missed", "ahead"] if has_data else []), "fate"]
    head = "".join(f"<th>{escape(name)}</th>" for name in names)
    body = "".join(_row(view, location) for location in listed)
    table = f"<thead><tr>{head}</tr></thead><tbody>{body}</tbody>"
    n_omitted = len(view.locations) - len(listed)
    tail = (
        f'<p class="note">and {format_count(n_omitted, "location")} more</p>' if n_omitted else ""
    )
    st.html(scrolled(f'<table class="numbers fates">{table}</table>', "Locations") + tail)


def _row(view: PatchView, location: PlaceFate) -> str:
    texts = [view.where(location), f"{location.ccw:.4g}"]
    if view.step.data is not None:
        texts += [str(location.missed + location.held), str(location.ahead)]
    kind = "out" if is_rejected(location) else location.fate
    fate = escape(describe_fate(location, view.step, view.search_fraction))
    numbers = "".join(f"<td>{cell}</td>" for cell in texts)
    reason = f'<td class="reason"><i class="mark {kind}"></i>{fate}</td>'
    return f'<tr class="{kind}">{numbers}{reason}</tr>'


def say_candidates(view: PatchView) -> None:
    """Describe the choice of the candidates, with or without data."""
    step, k = view.step, len(view.step.places)
    if step.data is not None:
        say(_data_and_search(view), STEP_REFERENCES["data"])
        say(_choice_with_data(view), OURS)
        return
    text = f"The K = {k} locations with the best scores are the candidates."
    source = STEP_REFERENCES["candidates"]
    if not step.patch.shape:
        text = f"All locations have equal scores, so K = {k} locations are chosen at random."
        source = STEP_REFERENCES["first patch"]
    if view.trace.study.hard_data.n:
        text += " No hard data are in this patch or just ahead, so the patch is unconditional."
    say(text, source)
    if step.slack is not None:
        say(_choice_without_data(view), OURS)


def _choice_without_data(view: PatchView) -> str:
    """Describe which of the K best locations can be chosen if no data are near."""
    step, n_copies = view.step, int(view.step.copies.sum())
    assert step.slack is not None
    slack = round(step.slack / view.trace.search.cell_cost)
    text = page_text("Choice without data", n=step.n_candidates, cells=slack)
    text += " " + page_text("Costs of guides") if view.trace.study.is_guided else ""
    copies = page_text("Copies", locations=format_count(n_copies, "location"))
    return f"{text} {copies}" if n_copies else text


def _data_and_search(view: PatchView) -> str:
    """Describe which data condition the patch, and which locations are searched."""
    d = view.step.data
    assert d is not None
    n_inside = sum(datum.inside for datum in d.seen)
    searched = "All locations are searched."
    if d.weights.everywhere:
        searched = "All locations are searched, because data are dense here."
    elif d.ruled_out.any():
        n = format_count(int((~d.ruled_out).sum()), "location")
        best = f"{100 * view.search_fraction:.3g}"
        searched = f"Only the {best} % of locations with the best overlaps are searched ({n})."
    shape = view.step.cells.shape
    return page_text(
        "Data and search",
        within=f"a box of {cells_along([d.reach // shape[-1] * n for n in shape])} cells",
        searched=searched,
        inside=format_count(n_inside, "datum", "data"),
        ahead=len(d.seen) - n_inside,
    )


def _choice_with_data(view: PatchView) -> str:
    """Describe how data and overlap are weighted, and how many candidates remain."""
    d, search = view.step.data, view.trace.search
    assert d is not None
    n_rejected = sum(map(is_rejected, view.locations))
    missed, held, ahead = (round(w * search.datum_cost / search.cell_cost) for w in d.weights[:3])
    rejected = f" Rejected: {format_count(n_rejected, 'location')} that fit the overlap."
    n, k, slack = view.step.n_candidates, len(view.step.places), round(d.slack / search.cell_cost)
    text = page_text(
        "Choice with data", n=n, k=k, missed=missed, held=held, ahead=ahead, slack=slack
    )
    return text + (rejected if n_rejected else "")


def describe_window(w: ResimulatedWindow) -> str:
    """Return the outcome of a window of local re-simulation in words."""
    outcome = "forced" if w.size == 1 else "patch" if w.fits else "none"
    outcome = "isolated" if w.fits and w.isolated and w.size > 1 else outcome
    size = cells_along(w.before.shape) if w.before.ndim == 3 else w.size
    return page_text(f"Window: {outcome}", size=size)
