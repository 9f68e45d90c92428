"""A patch of a volume: its faces of overlap, the score of each location, the cut as a surface."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import streamlit as st
from numpy.typing import ArrayLike, NDArray

from ccwsim.engine.stages.box import BELOW, LEFT, TOP
from ccwsim.engine.stages.cut import UNKNOWN
from ccwsim.engine.stages.path import FROM_ABOVE, ORDERS, from_path
from ccwsim.engine.trace import PlaceFate, Trace, TracedPatch, fates
from ccwsim.figures import CIVIDIS, Theme
from ccwsim.model.arrays import describe_shape, listing
from ccwsim.ui.hard_data.page import describe_data_status
from ccwsim.ui.how_it_works import words
from ccwsim.ui.how_it_works.maps import (
    CANDIDATE,
    DIM,
    KEPT,
    PASTED,
    REJECTED,
    Scale,
    mixed,
    patch_map,
    value_map,
)
from ccwsim.ui.how_it_works.run import How
from ccwsim.ui.how_it_works.words import OURS, PAPER, format_count, say
from ccwsim.ui.results.tables import numbers_table
from ccwsim.ui.widgets.maps import CellMap, facies_map, points_of
from ccwsim.ui.widgets.text import panel_title, scrolled
from ccwsim.ui.widgets.volumes import draw_volume

SLICES: dict[str, Any] = {"body": False, "max_height": 300}
PATCH: dict[str, Any] = {"link": "how_patch", **SLICES}
"""All that is shown of a patch shares the cursor."""
MAX_ROWS = 24
ORDER_WORDS = (
    "layer after layer",
    "its rows through all layers, one after the other",
    "its columns through all layers, one after the other",
)


@dataclass(frozen=True)
class VolumeView:
    """The patch that is shown, as the page has it."""

    trace: Trace
    step: TracedPatch
    locations: list[PlaceFate]
    colours: Sequence[str]
    theme: Theme

    def turned(self, array: NDArray) -> NDArray:
        """Return an array in path coordinates, shape (nz, ny, nx), as the grid lies."""
        return np.ascontiguousarray(from_path(array, self.trace.path.orientation))

    def of_grid(self, array: NDArray) -> NDArray:
        """Return the same of what covers whole tiles: the grid alone."""
        path = self.trace.path
        part = (slice(k, k + n) for k, n in zip(path.offset, path.shape, strict=True))
        return self.turned(array[tuple(part)])

    def places(self, cells: ArrayLike, shape: tuple[int, ...]) -> NDArray[np.int64]:
        """Return where cells of an array of a shape, in path coordinates, lie in `turned`."""
        chosen = np.asarray(cells, np.int64).reshape(-1, 3)
        marked = np.zeros(shape, np.int64)
        marked[tuple(chosen.T)] = np.arange(1, len(chosen) + 1)
        turned = self.turned(marked)
        found = np.argwhere(turned)
        return found[np.argsort(turned[tuple(found.T)])]


def draw_volume_patch(trace: Trace, how: How, colours: list[str], theme: Theme) -> None:
    """Draw the steps of the patch that is shown."""
    step = trace.at(how.patch)
    view = VolumeView(trace, step, fates(step), colours, theme)
    left, right = st.columns([1.2, 1.0], gap="medium")
    with left:
        panel_title("1 Grid so far", "overlap lit")
        options: dict[str, Any] = {"grid": trace.study.grid, "name": "grid_so_far"}
        draw_volume(grid_volume(view), "how_volume_grid", max_height=420, **options)
        say(describe_path(trace), PAPER["path"])
        if offset := describe_offset(trace):
            say(offset, OURS)
    with right:
        panel_title("2 Overlap", describe_faces(trace, step.patch.shape))
        old = np.where(step.in_overlap, step.old, UNKNOWN).astype(np.uint8)
        shown = _patch(view, old, "The overlap of the patch")
        draw_volume(shown, "how_volume_overlap", **PATCH)
        first = "overlap" if step.patch.shape else "first patch"
        say(describe_overlap(view), PAPER[first])
    left, right = st.columns([1.2, 1.0], gap="medium")
    with left:
        panel_title("3 CCW score of each location", "in blocks of the training image")
        draw_volume(score_volume(view), "how_volume_score", **SLICES)
        say(words.describe_scores(step), PAPER["scores" if step.patch.shape else first])
    with right:
        panel_title("Candidates")
        _draw_candidates(view)
    _draw_cut(view)


def _patch(view: VolumeView, cells: NDArray, alt: str) -> CellMap:
    image = view.trace.study.training_image
    return patch_map(view.turned(cells), image, view.colours, view.theme, alt)


def _draw_cut(view: VolumeView) -> None:
    step, box = view.step, view.step.box
    part = np.s_[box.z0 : box.z0 + box.nz, box.y0 : box.y0 + box.ny, box.x0 : box.x0 + box.nx]
    panel_title("4 Drawn patch → cut → pasted")
    each = (
        ("drawn patch", "drawn", _patch(view, step.cells, "The drawn patch")),
        ("cut: a surface through the overlap", "cut", cut_volume(view)),
        ("pasted", "pasted", _patch(view, step.after[part], "The grid with the patch pasted")),
    )
    for place, (title, key, shown) in zip(st.columns(3, gap="medium"), each, strict=True):
        with place:
            st.html(f'<p class="caption">{title}</p>')
            options: dict[str, Any] = PATCH | {"body": key == "cut"}
            draw_volume(shown, f"how_volume_{key}", **options)
    say(describe_draw(view), PAPER["draw" if step.patch.shape else "first patch"])
    if shift := describe_shift(step):
        say(shift, OURS)
    say(describe_cut(step), OURS if step.patch.shape else PAPER["paste"])


def grid_volume(view: VolumeView) -> CellMap:
    """Return the grid before the patch: the overlap lit, all else dim, data that condition it."""
    step, box, image = view.step, view.step.box, view.trace.study.training_image
    n = image.n_facies
    lit = np.zeros(step.before.shape, bool)
    lit[box.z0 : box.z0 + box.nz, box.y0 : box.y0 + box.ny, box.x0 : box.x0 + box.nx] = (
        step.in_overlap
    )
    known = step.before != UNKNOWN
    indices = np.where(known, step.before, n).astype(int)
    indices = np.where(known & ~lit, n + 1 + indices, indices)
    names = list(image.facies_names)
    return CellMap(
        indices=view.of_grid(indices.astype(np.uint8)),
        colours=[
            *view.colours,
            view.theme.hairline,
            *(mixed(colour, view.theme.paper, DIM) for colour in view.colours),
        ],
        labels=[*names, "not simulated yet", *names],
        alt=f"The grid before patch {step.patch.number + 1}, with its overlap in full colour",
        keys=list(zip(names, view.colours, strict=True))[:6],
        points=_conditioning(view),
        point_colours=view.colours,
    )


def _conditioning(view: VolumeView) -> list[list[int]]:
    """Return the data that condition this patch, as points of the grid."""
    data, path = view.step.data, view.trace.path
    seen = [] if data is None else data.seen
    cells = np.array([(d.layer, d.row, d.column) for d in seen]).reshape(-1, 3) - path.offset
    inside = [k for k, cell in enumerate(cells) if (cell >= 0).all() and (cell < path.shape).all()]
    where = view.places(cells[inside], path.shape)
    facies = (seen[k].facies for k in inside)
    return [[*map(int, at), own, 0] for at, own in zip(where, facies, strict=True)]


def score_volume(view: VolumeView) -> CellMap:
    """Return the CCW score of each location, the K best as points: bright is a good fit."""
    step = view.step
    scores = np.where(step.copies, np.nan, step.ccw)
    low, high = float(np.nanmin(scores)), float(np.nanmax(scores))
    colours = CIVIDIS if step.correlation else CIVIDIS[::-1]
    scale = Scale("CCW", low, high, colours, "only goes on with a patch beside this one")
    alt = f"CCW score of each location for patch {step.patch.number + 1}"
    shown = value_map(view.turned(scores), scale, view.theme, alt)
    candidates = view.places(step.candidates, step.scores.shape)
    points = [[*map(int, at), int(k == step.drawn), 0] for k, at in enumerate(candidates)]
    drawn = [CANDIDATE, view.theme.reference]
    named = "candidate", "candidates"
    return replace(shown, points=points, point_colours=drawn, points_are=named)


def cut_volume(view: VolumeView) -> CellMap:
    """Return which cells of the patch stay as they were, differ, and are pasted."""
    step = view.step
    indices = np.where(step.keep_mask, 0, np.where(step.in_overlap, 1, 2))
    indices = np.where(step.error & ~step.keep_mask, 3, indices).astype(np.uint8)
    colours = [KEPT, PASTED, mixed(PASTED, view.theme.paper, 0.6), REJECTED]
    labels = ["kept", "pasted", "pasted, beyond the overlap", "pasted, where it differs"]
    keys = list(zip(labels, colours, strict=True))
    return CellMap(view.turned(indices), colours, labels, "The cut of the patch", keys=keys)


def faces_of(trace: Trace, shape: int) -> list[str]:
    """Return where the overlap of a patch is, as the grid lies.

    `shape` is a sum of LEFT, TOP and BELOW along the path.
    """
    way = trace.path.orientation
    ew, ns = ("west", "east"), ("south", "north")
    across, along = (ns, ew) if way & 4 else (ew, ns)
    names = {
        LEFT: across[bool(way & 2)],
        TOP: along[bool(way & 1)],
        BELOW: "above" if way & FROM_ABOVE else "below",
    }
    return [name for side, name in names.items() if shape & side]


def describe_faces(trace: Trace, shape: int) -> str:
    """Say which faces of a patch lie on what is simulated."""
    faces = faces_of(trace, shape)
    if not faces:
        return "the first patch has none"
    return f"{format_count(len(faces), 'face')}: {listing(faces)}"


def describe_position(trace: Trace, number: int) -> str:
    """Return which tile of the path a patch is in, in words."""
    path, patch = trace.path, trace.patches[number]
    at = np.unravel_index(patch.tile, path.tiles)
    each = zip(("layer", "row", "column"), at, path.tiles, strict=True)
    return ", ".join(f"{name} {int(k) + 1} of {n}" for name, k, n in each) + " of the path"


def describe_path(trace: Trace) -> str:
    """Return where the path comes from, and how far patches are apart."""
    path, p = trace.path, trace.study.parameters
    lengths = p.along(trace.study.grid.shape)
    corner = listing(faces_of(trace, LEFT | TOP | BELOW))
    steps = [t - o for t, o in zip(lengths.template, lengths.overlap, strict=True)]
    drawn = "drawn at random for each realization" if p.random_path else "the same for all"
    order = ORDER_WORDS[[axes[0] for axes in ORDERS].index(ORDERS[path.order][0])]
    return (
        f"The path starts in the corner <b>{corner}</b> and goes {order} ({drawn}). Patches of "
        f"{describe_shape(lengths.template)} cells are placed {describe_shape(steps)} cells apart, "
        f"so each overlaps what is there by {describe_shape(lengths.overlap)}: the part in full "
        "colour. Left and right arrow keys step."
    )


def describe_offset(trace: Trace) -> str:
    """Return how far before the grid the first patch begins, and why."""
    if not any(trace.path.offset):
        return ""
    layers, rows, columns = trace.path.offset
    return (
        f"The first patch begins {format_count(layers, 'layer')}, {format_count(rows, 'row')} and "
        f"{format_count(columns, 'column')} before the grid, drawn at random, so that seams are "
        "elsewhere in each realization and do not show in their mean."
    )


def describe_overlap(view: VolumeView) -> str:
    """Return what the overlap is, and how few numbers stand for it."""
    step, n_cells = view.step, int(view.step.in_overlap.sum())
    if not n_cells:
        return "Nothing has been simulated yet, so there is nothing to compare the image with."
    if max(step.block) == 1:
        return f"The overlap is {format_count(n_cells, 'cell')}, which are compared one by one."
    n = int(np.isfinite(step.approximation[0]).sum())
    return (
        f"The overlap is {format_count(n_cells, 'cell')}. Its Haar approximation has one number a "
        f"block of {describe_shape(step.block)} cells: <b>{format_count(n, 'coefficient')}</b> "
        f"instead of {format_count(n_cells, 'number')}."
    )


def describe_draw(view: VolumeView) -> str:
    """Return what was drawn."""
    step, n = view.step, view.step.n_candidates
    how = "all equally likely"
    if step.steered:
        how = "the likelier the nearer it brings the proportions to their target (not in the paper)"
    chance = f"One of {n} candidates, {how}." if n > 1 else "It is the only candidate."
    return f"Drawn: CCW {view.locations[0].ccw:.4g}. {chance}"


def describe_shift(step: TracedPatch) -> str:
    """Return how far refinement shifted the patch; empty where it did not."""
    shift = np.subtract(step.place, step.drawn_place)
    if not shift.any():
        return ""
    each = zip(("layers", "rows", "columns"), shift.tolist(), strict=True)
    moved = listing(f"{abs(n)} {name}" for name, n in each if n)
    return f"Refinement shifted it by {moved} to where it fits best at full resolution."


def describe_cut(step: TracedPatch) -> str:
    """Return what the cut keeps."""
    if not step.patch.shape:
        return "Nothing to cut: the whole patch is pasted."
    wrong, kept = int(step.error.sum()), int(step.keep_mask.sum())
    return (
        f"Patch and grid differ in {format_count(wrong, 'cell')} of "
        f"{format_count(int(step.in_overlap.sum()), 'cell')} of the overlap. The cheapest surface "
        f"through them is the minimum cut of a flow from the old cells to the new: "
        f"{format_count(kept, 'cell')} stay as they were, all else is pasted."
    )


def _draw_candidates(view: VolumeView) -> None:
    """Draw what became of the best locations, and of the data that condition the patch."""
    step = view.step
    text = f"The K = {len(step.places)} best are looked at, <b>{step.n_candidates}</b> of them are "
    text += "near enough to the very best to be drawn from: the points above, the drawn one red."
    say(text, PAPER["candidates"])
    if step.data is not None:
        inside = sum(datum.inside for datum in step.data.seen)
        say(
            f"<b>{format_count(inside, 'datum', 'data')}</b> in the patch and "
            f"<b>{len(step.data.seen) - inside}</b> ahead of the path condition it.",
            PAPER["data"],
        )
    rows = [
        [f"{at.column}, {at.row}, {at.layer}", f"{at.ccw:.4g}", _fate(view, at)]
        for at in view.locations[:MAX_ROWS]
    ]
    table = numbers_table(rows, ("block x, y, z along the path", "CCW", "fate"), "fates")
    st.html(scrolled(table, "Locations"))


def _fate(view: VolumeView, at: PlaceFate) -> str:
    return words.describe_fate(at, view.step, view.trace.study.parameters.search_fraction)


def draw_volume_after(trace: Trace, colours: list[str]) -> None:
    """Draw what local re-simulation and seam repair did after the last patch."""
    data, image = trace.study.hard_data, trace.study.training_image
    panel_title("After the last patch", "local re-simulation of data, then seam repair")
    status = trace.realization.data_status
    if data.n and trace.study.parameters.exact_data:
        n = len({window.datum for window in trace.windows if window.fits})
        tried = f"Windows fitted around {format_count(n, 'datum', 'data')}." if n else ""
        counted = format_count(len(status), "datum", "data")
        say(f"Of {counted}: {describe_data_status(status)}. {tried}", OURS)
    elif not data.n:
        say("There are no hard data in this study, so there is nothing to correct.", OURS)
    if not trace.repairs:
        return
    changed = trace.before_repair != trace.realization.indices
    say(
        "Windows around patterns of 3 × 3 × 3 cells that the training image never has are "
        "simulated anew, if that leaves fewer of them: "
        f"<b>{format_count(int(changed.sum()), 'cell')}</b> ({100 * changed.mean():.1f} %) are "
        "another facies now.",
        OURS,
    )
    shown = {"before": trace.before_repair, "after": trace.realization.indices}
    for place, (name, cells) in zip(st.columns(2, gap="medium"), shown.items(), strict=True):
        with place:
            own = facies_map(cells, image, colours, f"The realization {name} seam repair")
            own.points.extend(points_of(data, image))
            st.html(f'<p class="caption">{name} seam repair</p>')
            options: dict[str, Any] = {"link": "how_repair", "name": f"{name}_seam_repair"}
            draw_volume(own, f"how_volume_{name}", **(SLICES | options))
