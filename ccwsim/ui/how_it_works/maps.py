"""The maps of the page that follows a realization, as the canvas takes them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from ccwsim.engine.stages.cut import UNKNOWN
from ccwsim.engine.trace import Frame, PlaceFate, Trace, TracedPatch
from ccwsim.engine.trace.frames import Rectangle
from ccwsim.figures import CIVIDIS, Theme, ramp
from ccwsim.model.training_image import TrainingImage
from ccwsim.ui.frontend.cell_map import N_STEPS, CellMap

DIM = 0.55
"""How much of the paper is mixed into what is not lit."""
MAX_MARKS = 400
MAX_LIT = 100
"""Facies that can have a dim colour too."""
REJECTED = "#D55E00"
CANDIDATE = "#ffffff"
KEPT, PASTED = "#4C6E91", "#E9C46A"


@dataclass(frozen=True)
class PatchView:
    """The patch that is shown: its realization, what happened to the locations, the colours."""

    trace: Trace
    step: TracedPatch
    locations: list[PlaceFate]
    colours: Sequence[str]
    theme: Theme

    @property
    def image(self) -> TrainingImage:
        """The training image."""
        return self.trace.study.training_image

    @property
    def level(self) -> int:
        """The wavelet level of the search."""
        return self.trace.study.parameters.level

    @property
    def search_fraction(self) -> float:
        """The share of the overlaps that is searched where there are data."""
        return self.trace.study.parameters.search_fraction

    def where(self, location: PlaceFate) -> str:
        """Return the lowest cell, in the image, of the patch of a location."""
        return xy_of(self.trace, location.row, location.column, self.step.patch.size)

    @property
    def block_frame(self) -> Frame:
        """Turns arrays of one value a block of the image from path to grid coordinates."""
        rows, columns = self.trace.oriented.pyramid.phases.shape[-2:]
        return Frame(self.trace.path.orientation, (rows, columns))

    def patch_map(self, indices: NDArray[np.uint8], alt: str) -> CellMap:
        """Return the map of a patch in the colours of the facies."""
        return patch_map(indices, self.image, self.colours, self.theme, alt)


def mixed(colour: str, ground: str, share: float) -> str:
    """Return a colour with a share of another one in it.

    Examples
    --------
    >>> mixed("#000000", "#FFFFFF", 0.5)
    '#808080'
    """
    return ramp([colour, ground], 101)[round(100 * share)]


def box_mark(box: Rectangle, colour: str, label: str, kind: str = "box") -> dict:
    """Return what is drawn on a map around a box."""
    return {"kind": kind, **box._asdict(), "colour": colour, "label": label}


def data_in(trace: Trace, box: Rectangle) -> list[list[int]]:
    """Return row, column and facies of the data in a box; rows and columns are the box's own."""
    cells = (trace.study.hard_data.cells - [box.row, box.column]).tolist()
    return [
        [row, column, int(facies)]
        for (row, column), facies in zip(cells, trace.study.facies_of_data, strict=True)
        if 0 <= row < box.height and 0 <= column < box.width
    ]


def xy_of(trace: Trace, row: int, column: int, size: int) -> str:
    """Return the south-west cell in the image of a patch at a location in blocks, as (x, y)."""
    unit = trace.search.block[2]
    box = trace.image_frame.box_to_grid(row * unit, column * unit, size, size)
    return f"({box.column}, {box.row})"


def patch_map(
    indices: NDArray[np.uint8], image: TrainingImage, colours: Sequence[str], theme: Theme, alt: str
) -> CellMap:
    """Return a map of facies, shape (ny, nx), where UNKNOWN cells are blank; no legend."""
    shown = np.where(indices == UNKNOWN, image.n_facies, indices).astype(np.uint8)
    names = [*image.facies_names, "not simulated"]
    return CellMap(shown, [*colours, theme.hairline], names, alt)


@dataclass(frozen=True)
class Scale:
    """What the numbers of a map are, from which to which, and in which colours."""

    name: str
    low: float
    high: float
    colours: Sequence[str] = CIVIDIS
    absent: str = "no value"


def value_map(values: NDArray[np.float64], scale: Scale, theme: Theme, alt: str) -> CellMap:
    """Return a map of numbers, shape (ny, nx); NaN is blank."""
    low, span = scale.low, scale.high - scale.low
    share = np.clip((values - low) / span, 0, 1) if span else np.zeros(values.shape)
    indices = np.where(np.isnan(values), N_STEPS + 1, np.rint(np.nan_to_num(share) * N_STEPS))
    labels = [f"{scale.name} {low + span * k / N_STEPS:.3g}" for k in range(N_STEPS + 1)]
    ends = {"low": f"{low:.3g}", "high": f"{scale.high:.3g}"}
    strip = {"colours": list(scale.colours), **ends}
    steps = [*_steps(tuple(scale.colours)), theme.hairline]
    return CellMap(indices.astype(np.uint8), steps, [*labels, scale.absent], alt, strip=strip)


@cache
def _steps(colours: tuple[str, ...]) -> list[str]:
    return ramp(colours, N_STEPS + 1)


def grid_map(view: PatchView) -> CellMap:
    """Return the grid before the patch: the overlap lit, the patch outlined, the path."""
    step, p, frame = view.step, view.step.patch, view.trace.grid_frame
    lit = np.zeros(step.before.shape, bool)
    lit[p.y0 : p.y0 + p.size, p.x0 : p.x0 + p.size] = step.in_overlap
    box = frame.box_to_grid(p.y0, p.x0, p.size, p.size)
    alt = f"The grid before patch {p.number + 1}, with its overlap in full colour"
    before, lit = frame.map_to_grid(step.before), frame.map_to_grid(lit)
    return replace(
        lit_map(before, lit, view.image, view.colours, view.theme, alt),
        points=_conditioning_points(view),
        marks=[box_mark(box, view.theme.reference, "the patch")],
        trail=_trail(view.trace, step),
    )


def lit_map(
    cells: NDArray[np.uint8],
    lit: NDArray[np.bool_],
    image: TrainingImage,
    colours: Sequence[str],
    theme: Theme,
    alt: str,
) -> CellMap:
    """Return facies, in full colour where lit and else dim; UNKNOWN cells are blank."""
    n, known = image.n_facies, cells != UNKNOWN
    has_dim = n <= MAX_LIT
    indices = np.where(known, cells, n).astype(int)
    if has_dim:
        indices = np.where(known & ~lit, n + 1 + indices, indices)
    dim = [mixed(colour, theme.paper, DIM) for colour in colours] if has_dim else []
    names = list(image.facies_names)
    return CellMap(
        indices=indices.astype(np.uint8),
        colours=[*colours, theme.hairline, *dim],
        labels=[*names, "not simulated yet", *(names if has_dim else [])],
        alt=alt,
        keys=list(zip(names, colours, strict=True))[:6],
        point_colours=colours,
    )


def _conditioning_points(view: PatchView) -> list[list[int]]:
    """Return the data that condition this patch as points of the grid."""
    points = []
    for datum in view.step.data.seen if view.step.data is not None else ():
        box = view.trace.grid_frame.box_to_grid(datum.row, datum.column, 1, 1)
        points.append([box.row, box.column, datum.facies, 0])
    return points


def _trail(trace: Trace, step: TracedPatch) -> list[list[float]]:
    """Return the way along the row of the path to the tile it is at."""
    n, last = trace.path.tiles[2], step.patch.tile
    half, stride = trace.template / 2, trace.template - step.overlap
    first = last - last % n
    ends = [first, last] if last > first else [max(last - 1, 0), last]
    (_, rows, columns), (_, first_y, first_x) = trace.path.shape, trace.path.offset

    def centre(tile: int) -> list[float]:
        y, x = (k * stride + half for k in divmod(tile, n))
        y = min(max(y, first_y), first_y + rows - 1)
        x = min(max(x, first_x), first_x + columns - 1)
        box = trace.grid_frame.box_to_grid(int(y), int(x), 1, 1)
        return [box.row + 0.5, box.column + 0.5]

    return [centre(tile) for tile in ends]


def score_map(view: PatchView, with_data: bool) -> CellMap:
    """Return the CCW score of each location, in blocks of the image; best is bright."""
    step, frame = view.step, view.block_frame
    shown, name, absent = step.ccw, "CCW", "no location for a whole patch"
    if with_data:
        name, absent = "CCW + data", f"{absent}, or not searched"
        if step.totals is not None:
            shown = (step.totals + step.energy) / step.block_size**2
            shown = np.where(step.copies, np.nan, shown)
            if step.data is not None:
                shown = np.where(step.data.ruled_out, np.nan, shown)
    whole = np.full(frame.shape, np.nan)
    whole[: shown.shape[0], : shown.shape[1]] = shown
    low, high = float(np.nanmin(shown)), float(np.nanmax(shown))
    colours = CIVIDIS if step.correlation and not with_data else CIVIDIS[::-1]
    scale = Scale(name, low, high, colours, absent)
    alt = f"CCW score map of patch {step.patch.number + 1}"
    found = value_map(frame.map_to_grid(whole), scale, view.theme, alt)
    if not step.patch.shape and low == high:
        return replace(found, strip=None)
    return found


def location_marks(view: PatchView, frame: Frame, scale: int, labels: Sequence[str]) -> list[dict]:
    """Return the marks of the locations: rings for candidates, crosses for rejected ones.

    The map of `frame` has `scale` cells a block; `labels` are what the hover says of each.
    """
    step, drawn = view.step, view.theme.reference

    def box_of(location: PlaceFate) -> Rectangle:
        return frame.box_to_grid(location.row * scale, location.column * scale, scale, scale)

    marks = []
    for location, label in list(zip(view.locations, labels, strict=True))[1:MAX_MARKS]:
        is_candidate = location.fate == "candidate"
        colour, kind = (CANDIDATE, "ring") if is_candidate else (REJECTED, "cross")
        marks.append(box_mark(box_of(location), colour, label, kind))
    marks.sort(key=lambda m: m["kind"])  # rings over crosses
    shift = scale / step.block_size
    row, column = (int(at * shift) for at in step.drawn_place)
    side = round(step.patch.size * shift)
    marks.append(box_mark(frame.box_to_grid(row, column, side, side), drawn, "drawn"))
    marks.append(box_mark(box_of(view.locations[0]), drawn, labels[0], "disc"))
    return marks


def error_map(view: PatchView) -> CellMap:
    """Return where patch and grid differ in the overlap."""
    indices = np.where(view.step.in_overlap, view.step.error, 2)
    colours = [mixed(view.theme.quiet, view.theme.paper, 0.75), REJECTED, view.theme.hairline]
    return _classes(
        view, indices, colours, ["same", "differs", "not in the overlap"], "Error surface"
    )


def cut_map(view: PatchView) -> CellMap:
    """Return which cells of the patch stay as they were, and which are pasted."""
    indices = np.where(view.step.keep_mask, 0, np.where(view.step.in_overlap, 1, 2))
    colours = [KEPT, PASTED, mixed(PASTED, view.theme.paper, 0.6)]
    return _classes(
        view, indices, colours, ["kept", "pasted", "pasted, beyond the overlap"], "Cut mask"
    )


def _classes(
    view: PatchView, indices: NDArray, colours: list[str], labels: list[str], alt: str
) -> CellMap:
    shown = view.trace.grid_frame.patch_to_grid(indices.astype(np.uint8))
    return CellMap(
        shown, colours, labels, alt, keys=list(zip(labels[:2], colours[:2], strict=True))
    )
