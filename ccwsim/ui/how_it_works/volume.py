"""A patch of a volume: its faces of overlap, the score of each location, the cut as a surface."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import streamlit as st
from numpy.typing import ArrayLike, NDArray

from ccwsim.engine.stages.cut import UNKNOWN
from ccwsim.engine.stages.path import (
    BELOW,
    FROM_ABOVE,
    LEFT,
    ORDERS,
    TOP,
    cells_from_path,
    from_path,
)
from ccwsim.engine.trace import PlaceFate, ResimulatedWindow, Trace, TracedPatch, fates
from ccwsim.figures import CIVIDIS, Theme
from ccwsim.model.arrays import describe_shape, listing
from ccwsim.ui.frontend.cell_map import CellMap, facies_map, points_of
from ccwsim.ui.frontend.volume import draw_volume
from ccwsim.ui.how_it_works import words
from ccwsim.ui.how_it_works.maps import (
    CANDIDATE,
    KEPT,
    PASTED,
    REJECTED,
    PatchView,
    Scale,
    lit_map,
    mixed,
    patch_map,
    value_map,
)
from ccwsim.ui.how_it_works.resimulation import (
    choose_datum,
    say_corrected,
    say_uncorrected,
    say_windows,
    windows_by_datum,
)
from ccwsim.ui.how_it_works.run import How
from ccwsim.ui.how_it_works.words import (
    OURS,
    PAPER,
    describe_draw,
    describe_window,
    format_count,
    is_rejected,
    say,
)
from ccwsim.ui.widgets.text import panel_title

SLICES: dict[str, Any] = {"body": False, "max_height": 300}
PATCH: dict[str, Any] = {"link": "how_patch", **SLICES}
"""All that is shown of a patch shares the cursor."""
ORDER_WORDS = (
    "layer after layer",
    "its rows through all layers, one after the other",
    "its columns through all layers, one after the other",
)


class VolumeView(PatchView):
    """The patch of a volume, and how arrays along its path lie in the grid."""

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
        return cells_from_path(chosen, shape, self.trace.path.orientation)

    def where(self, location: PlaceFate) -> str:
        """Return the lowest cell, in the image, of the patch of a location, as (x, y, z)."""
        at = np.array([location.layer, location.row, location.column]) * self.step.block
        last = at + self.step.cells.shape - 1
        ends = self.places([at, last], self.trace.oriented.pyramid.image.shape)
        return f"({', '.join(map(str, ends.min(axis=0)[::-1].tolist()))})"


def draw_volume_patch(trace: Trace, how: How, colours: list[str], theme: Theme) -> None:
    """Draw the steps of the patch that is shown."""
    step = trace.at(how.patch)
    view = VolumeView(trace, step, fates(step), colours, theme)
    left, right = st.columns([1.2, 1.0], gap="medium")
    with left:
        panel_title("1 Grid so far", "overlap lit")
        options: dict[str, Any] = {"grid": trace.study.grid, "name": "grid_so_far"}
        options["cursor"] = centre_of_patch(view)
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
        scores = score_volume(view)
        draw_volume(scores, "how_volume_score", cursor=scores.points[-1][:3], **SLICES)
        say(words.describe_scores(step), PAPER["scores" if step.patch.shape else first])
    with right:
        panel_title("Candidates" if step.data is None else "Candidates and hard data")
        words.say_candidates(view)
        words.draw_locations(view)
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
    step, box = view.step, view.step.box
    lit = np.zeros(step.before.shape, bool)
    lit[box.z0 : box.z0 + box.nz, box.y0 : box.y0 + box.ny, box.x0 : box.x0 + box.nx] = (
        step.in_overlap
    )
    alt = f"The grid before patch {step.patch.number + 1}, with its overlap in full colour"
    before, lit = view.of_grid(step.before), view.of_grid(lit)
    shown = lit_map(before, lit, view.image, view.colours, view.theme, alt)
    return replace(shown, points=_conditioning(view))


def centre_of_patch(view: VolumeView) -> list[int]:
    """Return the middle cell of the patch in the grid, for slices to go through."""
    box, path = view.step.box, view.trace.path
    first, lengths = (box.z0, box.y0, box.x0), (box.nz, box.ny, box.nx)
    ends = zip(first, lengths, path.offset, path.shape, strict=True)
    middle = [min(max(at + n // 2 - start, 0), last - 1) for at, n, start, last in ends]
    return view.places(middle, path.shape)[0].tolist()


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
    """Return the CCW score of each location, the best as points: bright is a good fit."""
    step = view.step
    scores = np.where(step.copies, np.nan, step.ccw)
    low, high = float(np.nanmin(scores)), float(np.nanmax(scores))
    colours = CIVIDIS if step.correlation else CIVIDIS[::-1]
    scale = Scale("CCW", low, high, colours, "only goes on with a patch beside this one")
    alt = f"CCW score of each location for patch {step.patch.number + 1}"
    shown = value_map(view.turned(scores), scale, view.theme, alt)
    order = [*view.locations[1:], view.locations[0]]  # the drawn one over the others
    looks = [2 if is_rejected(at) else int(at.fate == "drawn") for at in order]
    cells = view.places([(at.layer, at.row, at.column) for at in order], step.scores.shape)
    points = [[*map(int, at), look, 0] for at, look in zip(cells, looks, strict=True)]
    colours = [CANDIDATE, view.theme.reference, REJECTED]
    keys = list(zip(("candidate", "drawn", "rejected"), colours, strict=True))
    keys = [key for k, key in enumerate(keys) if k in looks]
    named = {"points": points, "point_colours": colours, "points_are": ("location", "locations")}
    return replace(shown, keys=keys, **named)


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


def describe_shift(step: TracedPatch) -> str:
    """Return how far refinement shifted the patch; empty where it did not."""
    shift = np.subtract(step.place, step.drawn_place)
    if not shift.any():
        return ""
    each = zip(("layer", "row", "column"), shift.tolist(), strict=True)
    moved = listing(format_count(abs(n), name) for name, n in each if n)
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


def draw_volume_after(how: How, trace: Trace, colours: list[str], theme: Theme) -> None:
    """Draw what local re-simulation and seam repair did after the last patch."""
    image, data = trace.study.training_image, trace.study.hard_data
    panel_title("After the last patch", "local re-simulation of data, then seam repair")
    if not data.n:
        say("There are no hard data in this study, so there is nothing to correct.", OURS)
    elif not trace.study.parameters.exact_data:
        say_uncorrected()
    else:
        by_datum = windows_by_datum(trace.windows)
        say_corrected(trace, by_datum)
        if by_datum:
            _draw_windows(trace, choose_datum(how, trace, by_datum), colours, theme)
    if not trace.repairs:
        return
    changed = trace.before_repair != trace.realization.indices
    say(
        "Where 3 × 3 × 3 cells have patterns that the training image never has, single cells are "
        "changed and windows simulated anew, if that leaves fewer of them: "
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


def _draw_windows(
    trace: Trace, windows: list[ResimulatedWindow], colours: list[str], theme: Theme
) -> None:
    """Draw where the windows of a datum are, and each that fitted before and after."""
    say_windows(windows)
    shown = windows_volume(trace, windows, colours, theme)
    cursor = trace.study.hard_data.cells[windows[0].datum].tolist()
    draw_volume(shown, "how_volume_windows", cursor=cursor, name="corrected", **SLICES)
    for k, window in enumerate(w for w in windows if w.fits):
        st.html(f'<p class="caption">{describe_window(window)}</p>')
        shown = {"before": window.before, "after": window.after}
        for place, (name, cells) in zip(st.columns(2, gap="medium"), shown.items(), strict=True):
            with place:
                alt = f"A window {name} local re-simulation"
                own = patch_map(cells, trace.study.training_image, colours, theme, alt)
                own = replace(own, points=_data_in(trace, window, cells), point_colours=colours)
                st.html(f'<p class="caption">{name}</p>')
                options: dict[str, Any] = {"link": f"how_window_{k}", "name": f"window_{name}"}
                options["cursor"] = (
                    trace.study.hard_data.cells[window.datum]
                    - [window.layer, window.row, window.column]
                ).tolist()
                draw_volume(own, f"how_volume_window_{name}_{k}", **(SLICES | options))


def _part(window: ResimulatedWindow) -> tuple[slice, ...]:
    first = window.layer, window.row, window.column
    return tuple(slice(k, k + n) for k, n in zip(first, window.before.shape, strict=True))


def windows_volume(
    trace: Trace, windows: list[ResimulatedWindow], colours: list[str], theme: Theme
) -> CellMap:
    """Return the realization before seam repair: windows in full colour, and the data."""
    image, lit = trace.study.training_image, np.zeros(trace.before_repair.shape, bool)
    for window in windows:
        lit[_part(window)] = True
    alt = "The realization, corrected, with the windows of the datum in full colour"
    shown = lit_map(trace.before_repair, lit, image, colours, theme, alt)
    return replace(shown, points=points_of(trace.study.hard_data, image))


def _data_in(trace: Trace, window: ResimulatedWindow, cells: NDArray) -> list[list[int]]:
    """Return the data in a window, in its own layers, rows and columns."""
    at = trace.study.hard_data.cells - [window.layer, window.row, window.column]
    inside = ((at >= 0) & (at < cells.shape)).all(axis=1)
    facies = trace.study.facies_of_data[inside]
    wrong = cells[tuple(at[inside].T)] != facies
    return np.column_stack([at[inside], facies, wrong]).astype(int).tolist()
