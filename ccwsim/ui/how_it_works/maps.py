"""The maps and volumes on the page How it works."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ccwsim import TrainingImage
from ccwsim.engine.stages.cut import UNKNOWN
from ccwsim.engine.trace import Frame, PlaceFate, Trace, TracedPatch
from ccwsim.figures import CIVIDIS, Theme, mixed
from ccwsim.model import Array, Bytes, Floats, Mask, three_digits, window_at
from ccwsim.ui.frontend.cells import CellMap, number_map

DIM = 0.55  # share of the background colour that is mixed into the colours of dimmed facies
MAX_MARKS = 400
MAX_LIT = 100  # maximum number of facies for which dimmed colours are used
REJECTED_COLOUR = "#D55E00"
CANDIDATE_COLOUR = "#ffffff"
KEPT_COLOUR, PASTED_COLOUR = "#4C6E91", "#E9C46A"


@dataclass(frozen=True)
class TraceView:
    """The realization on the page, with the colours of its maps."""

    trace: Trace
    colours: Sequence[str]
    theme: Theme

    @property
    def image(self) -> TrainingImage:
        """The training image of the realization."""
        return self.trace.study.training_image

    @property
    def is_volume(self) -> bool:
        """Whether the realization is a volume."""
        return self.trace.study.grid.is_volume

    def facies_map(self, indices: Bytes, alt: str) -> CellMap:
        """Return a map of facies in grid coordinates, without a legend; UNKNOWN is blank."""
        grid_indices = np.where(indices == UNKNOWN, self.image.n_facies, indices).astype(np.uint8)
        names = [*self.image.facies_names, "not simulated"]
        return CellMap(grid_indices, [*self.colours, self.theme.hairline], names, alt)

    def lit_map(self, facies_grid: Bytes, lit: Mask, alt: str) -> CellMap:
        """Return a map of facies; cells that are not `lit` are dimmed, and UNKNOWN is blank."""
        n, simulated, colours = self.image.n_facies, facies_grid != UNKNOWN, self.colours
        has_dim = n <= MAX_LIT
        indices = np.where(simulated, facies_grid, n).astype(int)
        if has_dim:
            indices = np.where(simulated & ~lit, n + 1 + indices, indices)
        dim = [mixed(colour, self.theme.paper, DIM) for colour in colours] if has_dim else []
        names = list(self.image.facies_names)
        return CellMap(
            indices=indices.astype(np.uint8),
            colours=[*colours, self.theme.hairline, *dim],
            labels=[*names, "not simulated yet", *(names if has_dim else [])],
            alt=alt,
            keys=list(zip(names, colours, strict=True))[:6],
            point_colours=colours,
        )

    def value_map(
        self,
        values: Floats,
        name: str,
        ends: tuple[float, float],
        alt: str,
        colours: Sequence[str] = CIVIDIS,
        absent: str = "no value",
    ) -> CellMap:
        """Return a map or volume of numbers between two ends, in which NaN is blank."""
        cell_map = number_map(values, name, alt, limits=ends, text=three_digits, colours=colours)
        blank = np.where(cell_map.indices == UNKNOWN, len(cell_map.colours), cell_map.indices)
        return replace(
            cell_map,
            indices=blank.astype(np.uint8),
            colours=[*cell_map.colours, self.theme.hairline],
            labels=[*cell_map.labels, absent],
        )


@dataclass(frozen=True)
class PatchView(TraceView):
    """The patch on the page, with its realization and the fates of locations."""

    step: TracedPatch
    locations: list[PlaceFate]

    @property
    def level(self) -> int:
        """The wavelet level at which the search compares coefficients."""
        study = self.trace.study
        return study.parameters.along(study.grid.shape).level[-1]

    @property
    def search_fraction(self) -> float:
        """The share of locations, best overlaps first, that is searched if there are data."""
        return self.trace.study.parameters.search_fraction

    @property
    def first(self) -> tuple[int, ...]:
        """The first (layer,) row and column of the patch, in path coordinates."""
        return self.step.box[:3][-self.step.cells.ndim :]

    @property
    def part(self) -> tuple[slice, ...]:
        """The slices of the cells of the patch within the grid, in path coordinates."""
        return window_at(self.first, self.step.cells.shape)

    @property
    def part_of_grid(self) -> tuple[slice, ...]:
        """The slices of the cells of the patch within the grid, in grid coordinates."""
        return self.trace.grid_frame.box_to_grid(self.first, self.step.cells.shape)

    @property
    def block(self) -> tuple[int, ...]:
        """The size of a block in cells along the axes (z,) y and x of the path coordinates."""
        return self.step.block[-self.step.cells.ndim :]

    @property
    def block_frame(self) -> Frame:
        """A frame that converts arrays with one value per image block to grid coordinates."""
        shape = self.trace.oriented.pyramid.phases.shape[-self.step.cells.ndim :]
        return Frame(self.trace.path.orientation, shape)

    def where(self, location: PlaceFate) -> str:
        """Return the first cell (x, y[, z]) of a patch at a location, in the image as read."""
        first = np.multiply(location_of(location, len(self.block)), self.block).tolist()
        part = self.trace.image_frame.box_to_grid(first, self.step.cells.shape)
        return f"({', '.join(str(side.start) for side in reversed(part))})"

    def patch_map(self, indices: Bytes, alt: str) -> CellMap:
        """Return a map of a patch, given in path coordinates, in facies colours."""
        return self.facies_map(self.trace.grid_frame.turned(indices), alt)


def location_of(place: PlaceFate, n: int) -> tuple[int, ...]:
    """Return the `n` = 2 or 3 coordinates of a location in blocks: (layer,) row and column."""
    return (place.layer, place.row, place.column)[-n:]


def box_mark(
    part: tuple[slice, ...], colour: str, label: str, kind: str = "box", side_of_cell: int = 1
) -> dict:
    """Return a mark around a part of the grid, in map cells of `side_of_cell` grid cells a side."""
    rows, columns = part[-2:]
    height, width = rows.stop - rows.start, columns.stop - columns.start
    box = {"row": rows.start, "column": columns.start, "height": height, "width": width}
    box = {side: size / side_of_cell if side_of_cell > 1 else size for side, size in box.items()}
    return {"kind": kind, **box, "colour": colour, "label": label}


def data_in(
    trace: Trace, part: tuple[slice, ...], facies_grid: Array | None = None
) -> list[list[int]]:
    """Return the data in a part of the grid as points, wrong if they differ from `facies_grid`."""
    offsets = trace.study.hard_data.cells - [side.start for side in part]
    inside = ((offsets >= 0) & (offsets < [side.stop - side.start for side in part])).all(axis=1)
    facies = trace.study.facies_of_data[inside]
    wrong = (
        np.zeros(len(facies))
        if facies_grid is None
        else facies_grid[tuple(offsets[inside].T)] != facies
    )
    return np.column_stack([offsets[inside], facies, wrong]).astype(int).tolist()


def grid_map(view: PatchView) -> CellMap:
    """Return the grid before the patch is pasted, with lit overlap, data, outline and arrow."""
    step, frame = view.step, view.trace.grid_frame
    lit = np.zeros(step.before.shape, bool)
    lit[view.part] = step.in_overlap
    alt = f"The grid before patch {step.patch.number + 1}, with its overlap in full colour"
    before, lit = frame.to_grid(step.before), frame.to_grid(lit)
    return replace(
        view.lit_map(before, lit, alt),
        points=_conditioning_points(view),
        marks=[box_mark(view.part_of_grid, view.theme.reference, "the patch")],
        trail=[] if view.is_volume else _trail(view.trace, step),
    )


def centre_of_patch(view: PatchView) -> list[int]:
    """Return the middle cell of the patch, through which the slices of the grid are drawn."""
    return [(side.start + side.stop) // 2 for side in view.part_of_grid]


def _conditioning_points(view: PatchView) -> list[list[int]]:
    """Return the data that condition the patch on the page, as points of the grid."""
    seen = view.step.data.seen if view.step.data is not None else ()
    path_cells = [(datum.layer, datum.row, datum.column)[-len(view.first) :] for datum in seen]
    places = view.trace.grid_frame.cells_to_grid(path_cells).tolist()
    return [[*cell, datum.facies, 0] for cell, datum in zip(places, seen, strict=True)]


def _trail(trace: Trace, step: TracedPatch) -> list[list[float]]:
    """Return the arrow along the path to the tile of a patch of a map."""
    n, last = trace.path.tiles[2], step.patch.tile
    half, stride = trace.template / 2, trace.template - step.overlap
    first = last - last % n
    ends = [first, last] if last > first else [max(last - 1, 0), last]
    (_, rows, columns), (_, first_y, first_x) = trace.path.shape, trace.path.offset

    def centre(tile: int) -> list[float]:
        y, x = (k * stride + half for k in divmod(tile, n))
        y = min(max(y, first_y), first_y + rows - 1)
        x = min(max(x, first_x), first_x + columns - 1)
        row, column = trace.grid_frame.cells_to_grid([int(y), int(x)])[0].tolist()
        return [row + 0.5, column + 0.5]

    return [centre(tile) for tile in ends]


def score_map(view: PatchView, with_costs: bool) -> CellMap:
    """Return a map of the CCW scores of all locations, in blocks; good scores are bright."""
    step, frame = view.step, view.block_frame
    values, name, absent = step.ccw, "CCW", "a patch here would extend beyond the image"
    if with_costs:
        name, absent = "CCW + costs", f"{absent}, or the location is not searched"
        if step.totals is not None:
            values = (step.totals + step.energy) / step.block_size**2
            values = np.where(step.copies | np.isnan(step.ccw), np.nan, values)
            if step.data is not None:
                values = np.where(step.data.ruled_out, np.nan, values)
    whole = np.full(frame.shape, np.nan)
    whole[: values.shape[0], : values.shape[1]] = values
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    scores = view.value_map(
        frame.to_grid(whole),
        name,
        (low, high),
        alt=f"CCW score map of patch {step.patch.number + 1}",
        colours=CIVIDIS if step.correlation and not with_costs else CIVIDIS[::-1],
        absent=absent,
    )
    if not step.patch.shape and low == high:
        return replace(scores, strip=None)
    return scores


def score_volume(view: PatchView) -> CellMap:
    """Return a volume of the CCW scores, with candidates and rejected locations as points."""
    step = view.step
    scores = np.where(step.copies, np.nan, step.ccw)
    ends = float(np.nanmin(scores)), float(np.nanmax(scores))
    frame = Frame(view.trace.path.orientation, step.scores.shape)
    order = [*view.locations[1:], view.locations[0]]  # the chosen location is on top
    kinds = {"candidate": 0, "drawn": 1}
    looks = [kinds.get(location.fate, 2) for location in order]
    cells = frame.cells_to_grid([location_of(location, 3) for location in order]).tolist()
    point_colours = [CANDIDATE_COLOUR, view.theme.reference, REJECTED_COLOUR]
    keys = list(zip((*kinds, "rejected"), point_colours, strict=True))
    return replace(
        view.value_map(
            frame.to_grid(scores),
            "CCW",
            ends,
            alt=f"CCW score of each location for patch {step.patch.number + 1}",
            colours=CIVIDIS if step.correlation else CIVIDIS[::-1],
            absent="would only extend the piece copied by a neighbouring patch",
        ),
        keys=[key for k, key in enumerate(keys) if k in looks],
        points=[[*cell, look, 0] for cell, look in zip(cells, looks, strict=True)],
        point_colours=point_colours,
        points_are=("location", "locations"),
    )


def location_marks(view: PatchView, frame: Frame, scale: int, labels: Sequence[str]) -> list[dict]:
    """Mark candidates with rings and rejected locations with crosses, `scale` cells a block."""
    step, drawn = view.step, view.theme.reference

    def box_of(location: PlaceFate) -> tuple[slice, ...]:
        first = np.multiply(location_of(location, 2), scale).tolist()
        return frame.box_to_grid(first, (scale, scale))

    marks = []
    for location, label in list(zip(view.locations, labels, strict=True))[1:MAX_MARKS]:
        is_candidate = location.fate == "candidate"
        colour, kind = (CANDIDATE_COLOUR, "ring") if is_candidate else (REJECTED_COLOUR, "cross")
        marks.append(box_mark(box_of(location), colour, label, kind))
    marks.sort(key=lambda m: m["kind"])  # rings are drawn over crosses
    shift = scale / step.block_size
    first, side = [int(index * shift) for index in step.drawn_place], round(step.patch.size * shift)
    marks.append(box_mark(frame.box_to_grid(first, (side, side)), drawn, "drawn"))
    marks.append(box_mark(box_of(view.locations[0]), drawn, labels[0], "disc"))
    return marks


def error_map(view: PatchView) -> CellMap:
    """Return a map of the overlap in which cells that differ between patch and grid are marked."""
    indices = np.where(view.step.in_overlap, view.step.error, 2)
    colour_of = {
        "same": mixed(view.theme.quiet, view.theme.paper, 0.75),
        "differs": REJECTED_COLOUR,
        "not in the overlap": view.theme.hairline,
    }
    return _classes(view, indices, colour_of, 2, "Error surface")


def cut_map(view: PatchView) -> CellMap:
    """Return a map of kept and pasted cells and, for a volume, of cells that differ."""
    step = view.step
    indices = np.where(step.keep_mask, 0, np.where(step.in_overlap, 1, 2))
    beyond = mixed(PASTED_COLOUR, view.theme.paper, 0.6)
    colour_of = {"kept": KEPT_COLOUR, "pasted": PASTED_COLOUR, "pasted, beyond the overlap": beyond}
    if view.is_volume:
        indices = np.where(step.error & ~step.keep_mask, 3, indices)
        colour_of["pasted, patch and grid differ"] = REJECTED_COLOUR
    return _classes(view, indices, colour_of, 4 if view.is_volume else 2, "The cut of the patch")


def _classes(
    view: PatchView, indices: Array, colour_of: dict[str, str], n_keys: int, alt: str
) -> CellMap:
    grid_indices = view.trace.grid_frame.turned(indices.astype(np.uint8))
    labels, colours = list(colour_of), list(colour_of.values())
    return CellMap(grid_indices, colours, labels, alt, keys=list(colour_of.items())[:n_keys])
