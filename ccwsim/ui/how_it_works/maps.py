"""The maps of the page that follows a realization, as the canvas takes them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from ccwsim.engine.stages.cut import UNKNOWN
from ccwsim.engine.trace import Frame, PlaceFate, Trace, TracedPatch
from ccwsim.figures import CIVIDIS, Theme, ramp
from ccwsim.model.training_image import TrainingImage
from ccwsim.ui.widgets.maps import CellMap

N_STEPS = 200
DIM = 0.55
"""How much of the paper is mixed into what is not lit."""
MAX_MARKS = 400
MAX_LIT = 100
"""Facies that can have a dim colour too."""
OUT = "#D55E00"
CANDIDATE = "#ffffff"


def mixed(colour: str, ground: str, share: float) -> str:
    """Return a colour with a share of another one in it.

    Examples
    --------
    >>> mixed("#000000", "#FFFFFF", 0.5)
    '#808080'
    """
    return ramp([colour, ground], 101)[round(100 * share)]


def patch_map(
    indices: NDArray[np.uint8], image: TrainingImage, colours: Sequence[str], theme: Theme, alt: str
) -> CellMap:
    """Return a map of facies, shape (ny, nx), where UNKNOWN cells are blank; no legend."""
    n = image.n_facies
    shown = np.where(indices == UNKNOWN, n, indices).astype(np.uint8)
    return CellMap(shown, [*colours, theme.hairline], [*image.facies_names, "not simulated"], alt)


def value_map(
    values: NDArray[np.float64], what: str, theme: Theme, alt: str, *,
    low: float, high: float, colours: Sequence[str] = CIVIDIS, absent: str = "no value",
) -> CellMap:  # fmt: skip
    """Return a map of numbers, shape (ny, nx); NaN is blank and said to be `absent`."""
    span = high - low
    share = np.clip((values - low) / span, 0, 1) if span else np.zeros(values.shape)
    indices = np.where(np.isnan(values), N_STEPS + 1, np.rint(np.nan_to_num(share) * N_STEPS))
    labels = [f"{what} {low + span * k / N_STEPS:.3g}" for k in range(N_STEPS + 1)]
    strip = {"colours": list(colours), "low": f"{low:.3g}", "high": f"{high:.3g}"}
    steps = [*_steps(tuple(colours)), theme.hairline]
    return CellMap(indices.astype(np.uint8), steps, [*labels, absent], alt, strip=strip)


@cache
def _steps(colours: tuple[str, ...]) -> list[str]:
    return ramp(colours, N_STEPS + 1)


def grid_map(trace: Trace, step: TracedPatch, colours: Sequence[str], theme: Theme) -> CellMap:
    """Return the grid before a patch is laid: the overlap lit, the patch outlined, the path."""
    image, p, frame = trace.study.training_image, step.patch, trace.grid_frame
    n = image.n_facies
    lit = np.zeros(step.before.shape, bool)
    lit[p.y0 : p.y0 + p.size, p.x0 : p.x0 + p.size] = step.in_overlap
    known = step.before != UNKNOWN
    has_dim = n <= MAX_LIT
    indices = np.where(known, step.before, n).astype(int)
    if has_dim:
        indices = np.where(known & ~lit, n + 1 + indices, indices)
    dim = [mixed(c, theme.paper, DIM) for c in colours] if has_dim else []
    names = list(image.facies_names)
    box = frame.box_to_world(p.y0, p.x0, p.size, p.size)
    marks = [{"kind": "box", **box._asdict(), "colour": theme.reference, "label": "the patch"}]
    return CellMap(
        frame.map_to_world(indices.astype(np.uint8)),
        [*colours, theme.hairline, *dim],
        [*names, "not simulated yet", *(names if has_dim else [])],
        f"The grid before patch {p.number + 1}, with its overlap in full colour",
        keys=list(zip(names, colours, strict=True))[:6],
        points=_seen(trace, step), point_colours=colours,
        marks=marks, trail=_trail(trace, step),
    )  # fmt: skip


def _seen(trace: Trace, step: TracedPatch) -> list[list[int]]:
    """Return the data that have a say in this patch as points of the grid."""
    found = []
    for datum in step.data.seen if step.data is not None else ():
        box = trace.grid_frame.box_to_world(datum.row, datum.column, 1, 1)
        found.append([box.row, box.column, datum.facies, 0])
    return found


def _trail(trace: Trace, step: TracedPatch) -> list[list[float]]:
    """Return the way along the row of the path to the tile it is at."""
    n, last = trace.path.n_columns, step.patch.tile
    half, stride = trace.template / 2, trace.template - step.overlap
    first = last - last % n
    ends = [first, last] if last > first else [max(last - 1, 0), last]
    rows, columns = trace.path.shape

    def centre(tile: int) -> list[float]:
        y, x = (k * stride + half for k in divmod(tile, n))
        y, x = min(y, rows - 1), min(x, columns - 1)
        box = trace.grid_frame.box_to_world(int(y), int(x), 1, 1)
        return [box.row + 0.5, box.column + 0.5]

    return [centre(tile) for tile in ends]


def score_map(trace: Trace, step: TracedPatch, theme: Theme, with_data: bool) -> CellMap:
    """Return the CCW score of each place, in blocks of the image; best is bright."""
    shown = step.ccw
    if with_data and step.totals is not None:
        shown = (step.totals + step.energy) / step.unit**2
        if step.data is not None:
            shown = np.where(step.data.ruled_out, np.nan, shown)
    rows, columns = trace.oriented.pyramid.phases.shape[2:]
    whole = np.full((rows, columns), np.nan)
    whole[: shown.shape[0], : shown.shape[1]] = shown
    frame = Frame(trace.path.orientation, (rows, columns))
    low, high = float(np.nanmin(shown)), float(np.nanmax(shown))
    best_high = step.correlation and not with_data
    ramped = CIVIDIS if best_high else CIVIDIS[::-1]
    found = value_map(
        frame.map_to_world(whole), "CCW + data" if with_data else "CCW", theme,
        f"CCW score map of patch {step.patch.number + 1}", low=low, high=high, colours=ramped,
        absent="no place for a whole patch" + (", or not looked at" if with_data else ""),
    )  # fmt: skip
    if not step.patch.shape and low == high:
        return replace(found, strip=None)
    return found


def fate_marks(
    frame: Frame, scale: int, step: TracedPatch, told: list[PlaceFate], theme: Theme,
    said: Sequence[str],
) -> list[dict]:  # fmt: skip
    """Return the marks of the places: rings for candidates, crosses for those that fell out.

    Parameters
    ----------
    frame : Frame
        Of the map, which has `scale` cells a block.
    said : sequence of str
        What the hover says of each place.
    """

    def mark(place: PlaceFate, kind: str, colour: str, label: str) -> dict:
        box = frame.box_to_world(place.row * scale, place.column * scale, scale, scale)
        return {"kind": kind, **box._asdict(), "colour": colour, "label": label}

    marks = []
    for place, words in list(zip(told, said, strict=True))[1:MAX_MARKS]:
        out = place.fate != "candidate"
        marks.append(mark(place, "cross" if out else "ring", OUT if out else CANDIDATE, words))
    marks.sort(key=lambda m: m["kind"])  # rings over crosses
    ty, tx = step.drawn_place
    shift = scale / step.unit
    side = round(step.patch.size * shift)
    box = frame.box_to_world(int(ty * shift), int(tx * shift), side, side)
    marks.append({"kind": "box", **box._asdict(), "colour": theme.reference, "label": "drawn"})
    marks.append(mark(told[0], "disc", theme.reference, said[0]))
    return marks


def error_map(trace: Trace, step: TracedPatch, theme: Theme) -> CellMap:
    """Return where patch and grid differ in the overlap."""
    indices = np.where(step.in_overlap, step.error, 2).astype(np.uint8)
    colours = [mixed(theme.quiet, theme.paper, 0.75), OUT, theme.hairline]
    labels = ["same", "differs", "not in the overlap"]
    return CellMap(
        trace.grid_frame.patch_to_world(indices), colours, labels, "Error surface",
        keys=list(zip(labels[:2], colours, strict=False)),
    )  # fmt: skip


def cut_map(trace: Trace, step: TracedPatch, theme: Theme) -> CellMap:
    """Return which cells of the patch stay as they were, and which are pasted."""
    indices = np.where(step.kept, 0, np.where(step.in_overlap, 1, 2)).astype(np.uint8)
    colours = ["#4C6E91", "#E9C46A", mixed("#E9C46A", theme.paper, 0.6)]
    labels = ["kept", "pasted", "pasted, beyond the overlap"]
    return CellMap(
        trace.grid_frame.patch_to_world(indices), colours, labels, "Cut mask",
        keys=list(zip(labels[:2], colours, strict=False)),
    )  # fmt: skip
