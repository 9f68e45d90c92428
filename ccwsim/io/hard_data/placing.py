"""Place imported points in the cells of a grid, find conflicts and resolve them."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, Literal, get_args, get_type_hints

import numpy as np

from ccwsim import Grid, HardData, TrainingImage
from ccwsim.io.hard_data.points import MAX_DISTANCE_CELLS, ImportedPoints, along_wells
from ccwsim.io.hard_data.rows import RowProblem
from ccwsim.io.places import check_place
from ccwsim.model import (
    CCWSIMError,
    Classes,
    FaciesMatch,
    FaciesNames,
    Floats,
    Ints,
    Mask,
    as_integers,
    asks_for_codes,
    check_choice,
    check_int,
    classify,
    code_or_name,
    describe_cell,
    facies_label,
    match_facies,
    refused,
    shown,
)

_LISTED = 6  # maximum number of problems of a kind that a message lists
Treatment = Literal["error", "drop"]
CollisionTreatment = Literal["error", "drop", "majority", "nearest"]
_FILE = Path(__file__).parents[2] / "assets" / "hard_data_notes.toml"
_NOTES: dict[str, dict[str, str]] = tomllib.loads(_FILE.read_text("utf-8"))
KINDS_OF_ROWS = _NOTES["rows"]  # problems with rows of tables of wells, by the option that decides


@dataclass(frozen=True)
class Conversion:
    """Options for converting values to facies and for treating data that do not fit."""

    facies_names: FaciesNames | None = None
    """Facies of the training image, by code or name, for names and codes of the data:
    `{"Sand": 1, "Ton": "clay"}` or pairs. `{7: 1}` changes the code 7 to 1."""
    threshold: float | None = None
    classes: Classes = None
    """Threshold or classes of continuous values, as in `classify`; use the image's class edges."""
    on_collision: CollisionTreatment = "error"
    """Treatment of a cell with data of several facies: raise an "error", "drop" all its data, keep
    the "majority" facies, or keep the facies of the datum "nearest" to the centre. The nearest
    datum decides a tie; if distances are equal, the first datum decides."""
    on_outside: Treatment = "error"
    on_unknown: Treatment = "error"
    """Treatment of data outside the grid and of unknown facies: "error" or "drop"."""
    on_overlap: Literal["error", "upper", "lower", "drop"] = "error"
    on_no_collar: Treatment = "error"
    on_bad_row: Treatment = "error"
    on_one_depth: Literal["neighbour", "drop", "error"] = "neighbour"
    on_no_facies: Literal["drop", "above", "error"] = "drop"
    """Treatment of rows in tables of wells. If intervals overlap, keep the "upper" or "lower" one
    whole, or "drop" both. Leave out wells without a collar and rows that cannot be used (no
    name, no coordinates, exchanged depths, a second collar, …). If an interval has only one depth,
    take the other from the "neighbour" above or below. If an interval has no facies, leave it out,
    or take the facies of the interval "above"."""

    def __post_init__(self) -> None:
        if isinstance(self.classes, (int, np.integer)):
            raise refused("other_classes", classes=shown(self.classes))
        for name, allowed in CONVERSION_CHOICES.items():
            check_choice(name, getattr(self, name), allowed)

    @classmethod
    def taken_from(cls, options: dict[str, Any]) -> Conversion:
        """Remove the options of a conversion from `options`, and return the conversion."""
        names = [field.name for field in fields(cls) if field.name in options]
        return cls(**{name: options.pop(name) for name in names})


CONVERSION_CHOICES: dict[str, tuple[str, ...]] = {
    name: get_args(hint)
    for name, hint in get_type_hints(Conversion).items()
    if name.startswith("on_")
}
"""The possible values of each option for data that do not fit."""
ROW_CHOICES = {name: CONVERSION_CHOICES[name] for name in KINDS_OF_ROWS}
"""The possible values of each option for rows of tables of wells; the first is the default."""


STRICT = Conversion()  # only facies codes or known names; an error for data that do not fit


@dataclass(frozen=True, eq=False)
class PlacedPoints:
    """Imported points placed in cells of a grid, and conflicts between them."""

    points: ImportedPoints
    """The imported points; an interval in a well has one point per cell."""
    cells: Ints
    """(Layer,) row and column of each point, in or outside the grid; shape (n, 2) or (n, 3)."""
    facies: Ints
    """Facies codes, shape (n,); the code of an unknown name is the minimum of int64."""
    offsets: Floats
    """Distance of each point from the centre of its cell, in cells, shape (n,)."""
    outside: Ints
    """Indices of points outside the grid."""
    unknown: Ints
    """Indices of the points in the grid whose facies the training image does not have."""
    collisions: tuple[Ints, ...]
    """For each cell with several facies: indices of its points that have a known facies."""
    match: FaciesMatch | None = None
    """Facies of the training image for each facies of the points; None without an image."""

    @property
    def unknown_facies(self) -> tuple[str, ...]:
        """Names (as in the file) of the facies that the training image does not have."""
        if self.points.words:
            indices = np.unique(self.points.values[self.unknown]).astype(int)
            return tuple(self.points.words[k] for k in indices)
        return tuple(map(str, np.unique(self.facies[self.unknown]).tolist()))


def place_points(
    points: ImportedPoints,
    grid: Grid | None = None,
    training_image: TrainingImage | None = None,
    conversion: Conversion = STRICT,
) -> PlacedPoints:
    """Place imported points in the cells of a grid and find the problems with them.

    `points` is the result of `read_points` or `read_well_points`. Without a grid, there are no
    upper bounds. Names of facies may be in upper or lower case. Raises `CCWSIMError` for cells that
    are not integers, or values that are not facies codes.

    Examples
    --------
    >>> from io import BytesIO
    >>> from ccwsim.io import read_points
    >>> points = read_points(BytesIO(b"x,y,facies\\n5.2,0.5,1\\n5.9,0.4,0\\n"))
    >>> placed = place_points(points, Grid(4, 8))
    >>> placed.cells.tolist(), [c.tolist() for c in placed.collisions]
    ([[0, 5], [0, 5]], [[0, 1]])
    """
    if grid is not None:
        check_place(points.name, points.place, grid)
    points = along_wells(points, grid)
    cells, offsets = _cells(points, grid)
    facies, match = _facies_and_match(points, training_image, conversion)
    inside = grid.holds(cells) if grid is not None else (cells >= 0).all(axis=1)
    has_code = facies != _NO_CODE
    if training_image is not None and not training_image.values:
        has_code = np.isin(facies, training_image.codes)
    outside, unknown = np.flatnonzero(~inside), np.flatnonzero(inside & ~has_code)
    collisions = colliding(cells, facies, np.flatnonzero(inside & has_code))
    return PlacedPoints(
        points=points,
        cells=cells,
        facies=facies,
        offsets=offsets,
        outside=outside,
        unknown=unknown,
        collisions=collisions,
        match=match,
    )


def _facies_and_match(
    points: ImportedPoints, training_image: TrainingImage | None, conversion: Conversion
) -> tuple[Ints, FaciesMatch | None]:
    """Return the facies of points, or numbers of their values, and how they match an image."""
    if training_image is not None and training_image.values:
        if points.words or conversion.threshold is not None or conversion.classes is not None:
            raise refused("data_of_values", name=points.name, variable=training_image.variable)
        numbers = np.unique(points.values, return_inverse=True)[1]
        return numbers, FaciesMatch(training_image, {}, [], {})
    if points.words:
        labels = [facies_label(word) for word in points.words]
        which = as_integers(points.values, points.name, 0, len(labels) - 1)
    else:
        values = _facies(points, conversion.threshold, conversion.classes)
        present_codes, which = np.unique(values, return_inverse=True)
        labels = [str(code) for code in present_codes.tolist()]
    stated = _of_indicator(points.variable, labels, training_image)
    stated |= _stated_codes(conversion.facies_names, training_image)
    match, by_label = None, {label: code_or_name(label) for label in labels}
    if training_image is not None:
        as_codes = conversion.threshold is None and asks_for_codes(conversion.classes)
        as_codes |= training_image.numbering == "codes"  # a threshold of the data states its codes
        match = match_facies(
            labels,
            training_image,
            numbering=points.numbering if as_codes else "values",
            facies=stated,
            shares=(np.bincount(which, minlength=len(labels)) / max(points.n, 1)).tolist(),
        )
        by_label = match.codes
    codes = [stated.get(label.casefold(), by_label[label]) for label in labels]
    numbers = [_NO_CODE if isinstance(code, str) else code for code in codes]
    return np.array(numbers, np.int64)[which], match


def _of_indicator(
    variable: str, labels: Sequence[str], image: TrainingImage | None
) -> dict[str, int]:
    """Return the codes of 0 and 1 in a column with the name of a facies; no facies has code −1."""
    names = [] if image is None else [name.casefold() for name in image.facies_names]
    if image is None or variable.casefold() not in names or not {*labels} <= {"0", "1"}:
        return {}
    codes = image.codes.tolist()
    one = codes.pop(names.index(variable.casefold()))
    return {"1": one, "0": codes[0] if len(codes) == 1 else -1}


def fit_grid(
    points: ImportedPoints,
    *,
    shape: Sequence[int] | None = None,
    cell_size: float | Sequence[float] | None = None,
) -> Grid:
    """Return a grid that contains all points of a file, except those that are far away.

    Points in world coordinates are far away if their distance from the others exceeds the extent of
    the others, as in `far_away`. If points have (layer,) row and column, the maximum indices define
    the grid. If the file is a grid with gaps, this grid is returned. `shape` and `cell_size` of
    points in world coordinates, and errors, are those of `Grid.fit`.

    Examples
    --------
    >>> from io import BytesIO
    >>> from ccwsim.io import read_points
    >>> text = b"easting,northing,facies\\n436120,4505250,1\\n439880,4509100,0\\n"
    >>> fit_grid(read_points(BytesIO(text)), shape=(512, 512))
    Grid(ny=512, nx=512, cell_size=(10.0, 10.0), origin=(435400.0, 4504600.0))
    """
    if points.world:
        near = ~far_away(points.places)
        places = points.places[near]
        if points.spans is not None:  # the grid must contain both ends of each interval
            places = np.repeat(places, 2, axis=0)
            places[:, 2] = points.spans[near].ravel()
        return Grid.fit(places, shape=shape, cell_size=cell_size)
    if points.grid is not None:
        return points.grid
    least = Grid.of(shape if shape is not None else (1,) * points.places.shape[1])
    if not points.n:
        return least
    most = _cells(points, None)[0].max(axis=0) + 1
    return Grid.of(np.maximum(least.shape, most))


def far_away(places: Floats) -> Mask:
    """Return a mask of places whose distance from the middle 90 % exceeds the extent of these."""
    far = np.zeros(len(places), bool)
    if not len(places) or not np.isfinite(places).all():
        return far
    low, high = np.quantile(places[:, :2], (0.05, 0.95), axis=0)
    if extent := float((high - low).max()):
        far = ((places[:, :2] < low - extent) | (places[:, :2] > high + extent)).any(axis=1)
    return far


def _cells(points: ImportedPoints, grid: Grid | None) -> tuple[Ints, Floats]:
    """Return the cell of each point, and its distance from the cell's centre, in cells."""
    if not points.world:
        cells = np.rint(points.places)
        broken = ~(np.abs(points.places - cells).max(axis=1, initial=0) <= 1e-3)  # also NaN
        broken |= ~(np.abs(cells).max(axis=1, initial=0) <= MAX_DISTANCE_CELLS)
        message = "rows and columns must be whole numbers; for world coordinates name them x and y"
        points.refuse(broken, message)
        return cells.astype(np.int64), np.zeros(points.n)
    frame = grid or Grid.of((1,) * points.places.shape[1])
    in_cells = (points.places - frame.origin) / frame.cell_size
    far = ~(np.abs(in_cells).max(axis=1, initial=0) <= MAX_DISTANCE_CELLS)  # also NaN
    points.refuse(far, "the coordinates are too far from the grid; correct them")
    floors = np.floor(in_cells[:, ::-1]).astype(np.int64)
    cells = grid.cells_of(*points.places.T) if grid else floors
    return cells, np.linalg.norm(in_cells[:, ::-1] - cells - 0.5, axis=1)


def _facies(points: ImportedPoints, threshold: float | None, classes: Classes) -> Ints:
    if not points.n:
        return np.empty(0, np.int64)
    if threshold is None and asks_for_codes(classes):
        bad = np.abs(points.values - np.rint(points.values)) > 1e-3
        points.refuse(
            bad,
            f"{points.values[bad.argmax()]:g} is not a facies code; for continuous values give the "
            "class edges or threshold of the image",
        )
        classes = "codes"
    return classify(points.values, threshold=threshold, classes=classes, what=points.name)


def _stated_codes(names: FaciesNames | None, image: TrainingImage | None) -> dict[str, int]:
    """Check names and facies; return the codes by label in lower case."""
    try:
        codes = {
            facies_label(name).casefold(): image.code_of(facies)
            if image is not None and isinstance(facies, str)
            else check_int("code of a facies", facies, -(2**53), 2**53)
            for name, facies in dict(names or {}).items()
        }
    except (TypeError, ValueError):
        codes = {"": 0}
    if "" in codes:
        raise refused("facies_names", names=shown(names))
    return codes


_NO_CODE = np.iinfo(np.int64).min  # the code of an unknown name


def colliding(cells: Ints, facies: Ints, among: Ints) -> tuple[Ints, ...]:
    """For each cell with more than one facies, return its points."""
    if not len(among):
        return ()
    order = among[np.lexsort((among, *cells[among].T[::-1]))]
    new_cell = np.any(np.diff(cells[order], axis=0) != 0, axis=1)
    starts = np.concatenate([[0], np.flatnonzero(new_cell) + 1, [len(order)]])
    low = np.minimum.reduceat(facies[order], starts[:-1])
    high = np.maximum.reduceat(facies[order], starts[:-1])
    return tuple(order[starts[k] : starts[k + 1]] for k in np.flatnonzero(low != high))


def settled(facies: Ints, offsets: Floats, choice: str) -> tuple[int | None, bool]:
    """Return the facies to keep in a cell, and whether only the order of the data decided."""
    if choice == "drop":
        return None, False
    running = np.ones(len(facies), bool)
    if choice == "majority":
        codes, counts = np.unique(facies, return_counts=True)
        running = np.isin(facies, codes[counts == counts.max()])
    nearest = offsets[running].min()
    running &= offsets <= nearest + 1e-9
    nearest_facies = facies[running]
    return int(nearest_facies[0]), bool((nearest_facies != nearest_facies[0]).any())


@dataclass(frozen=True, eq=False)
class HardDataImport:
    """Hard data and a report of the import, which counts points, rows and cells."""

    hard_data: HardData
    n_read: int  # points with a value in the file
    n_missing: int  # rows without a value
    n_off_centre: int  # points moved to the centre of their cell
    n_outside: int  # points outside the grid
    n_unknown: int  # points with a facies that the training image does not have
    n_collisions: int  # cells with more than one facies
    n_repeated: int  # points that repeat the facies of their cell
    n_dropped: int  # points left out: outside, unknown, or rejected in a collision
    notes: tuple[str, ...]
    """The report as sentences for the user."""
    wells: Mapping[str, Ints] = field(default_factory=dict)
    """For named wells, the cells that contain data of each well, as in `HardData.cells`."""


def resolve_points(placed: PlacedPoints, conversion: Conversion = STRICT) -> HardDataImport:
    """Return hard data, with conflicts resolved by the options of the conversion.

    Raises one `CCWSIMError`, with line numbers, for all conflicts whose option is "error".

    Examples
    --------
    >>> from io import BytesIO
    >>> from ccwsim.io import read_points
    >>> points = read_points(BytesIO(b"x,y,facies\\n5.2,0.5,1\\n5.9,0.4,0\\n"))
    >>> nearest = Conversion(on_collision="nearest")
    >>> report = resolve_points(place_points(points, Grid(4, 8)), nearest)
    >>> report.hard_data.facies.tolist(), report.n_dropped
    ([1], 1)
    """
    points = placed.points
    problems, notes_on_rows = _on_rows(points.problems, conversion)
    if len(placed.outside) and conversion.on_outside == "error":
        problems.append(
            f"{points.name}, {points.named(placed.outside)}: {len(placed.outside)} of {points.n} "
            "data lie outside the grid; drop them (on_outside='drop'), or correct the grid or the "
            "coordinates"
        )
    if len(placed.unknown) and conversion.on_unknown == "error":
        problems.append(_unknown_message(placed))
    if placed.collisions and conversion.on_collision == "error":
        problems.append(_collision_message(placed))
    if problems:
        raise CCWSIMError("\n".join(problems))
    keep = np.ones(points.n, bool)
    keep[placed.outside] = keep[placed.unknown] = False
    ties = 0
    for members in placed.collisions:
        facies, offsets = placed.facies[members], placed.offsets[members]
        code, tied = settled(facies, offsets, conversion.on_collision)
        keep[members] &= facies == code if code is not None else False
        ties += tied
    return _report(placed, keep, ties, notes_on_rows)


def _on_rows(
    problems: Sequence[RowProblem], conversion: Conversion
) -> tuple[list[str], tuple[str, ...]]:
    """Return errors for row problems without a decision, and notes on problems with a decision."""
    errors, notes = list[str](), list[str]()
    for option, kind in KINDS_OF_ROWS.items():
        undecided = [problem for problem in problems if problem.option == option]
        choice, more = getattr(conversion, option), len(undecided) - _LISTED
        if undecided and choice == "error":
            errors += [f"{p.where}: {p.message}; {p.remedy}" for p in undecided[:_LISTED]]
            choices = " or ".join(
                f"'{each}'" for each in CONVERSION_CHOICES[option] if each != "error"
            )
            errors[-1] += f", or choose what to do ({option}={choices})"
            errors[-1] += f"; {more} more of this kind" if more > 0 else ""
        elif undecided and (option, choice) != ("on_no_facies", "drop"):  # these rows are counted
            where = "; ".join(problem.where for problem in undecided[:_LISTED])
            where += "; …" if more > 0 else ""
            notes.append(f"{kind}: {len(undecided)} ({where}); {_NOTES['decided'][choice]}.")
    return errors, tuple(notes)


def _unknown_message(placed: PlacedPoints) -> str:
    points, unknown = placed.points, placed.unknown_facies
    start = f"{points.name}, {points.named(placed.unknown)}: the training image has no facies "
    if not points.words:
        return f"{start}{', '.join(unknown[:10])}; recode or drop these data (on_unknown='drop')"
    listed = ", ".join(map(repr, unknown))[:300]
    remedy = f"give codes, as facies_names={{{shown(unknown[0])}: 1}}, or on_unknown='drop'"
    return f"{start}{listed}; {remedy}"


def _collision_message(placed: PlacedPoints) -> str:
    points, members = placed.points, placed.collisions[0]
    where = describe_cell(placed.cells[members[0]])
    as_read = points.words or (placed.match and placed.match.image.values)
    values = [points.said(k) if as_read else placed.facies[k] for k in members[:6]]
    lines = zip(points.lines[members[:6]], values, strict=True)
    examples = ", ".join(f"{points.counted} {line}: {value}" for line, value in lines)
    more = len(placed.collisions) - 1
    tail = f", and {more} more such cells" if more else ""
    return (
        f"{points.name}: two facies in the cell at {where} ({examples}){tail}; drop these data, or "
        "keep the majority or the nearest facies (on_collision='drop', 'majority' or 'nearest')"
    )


def _report(
    placed: PlacedPoints, keep: Mask, ties: int, notes_on_rows: tuple[str, ...]
) -> HardDataImport:
    points = placed.points
    image = placed.match and placed.match.image
    if image and image.values:
        values = {image.variable: points.values[keep]}
        hard_data = HardData(placed.cells[keep], values=values).of_image(image)
    else:
        hard_data = HardData(placed.cells[keep], placed.facies[keep])
    if placed.match is not None:
        placed.match.warn(points.name)
        hard_data.numbering = placed.match.image.numbering_of_data
    n_outside, n_unknown = len(placed.outside), len(placed.unknown)
    clashing = np.concatenate([*placed.collisions, np.empty(0, np.int64)])
    n_dropped = int(np.count_nonzero(~keep))
    n_repeated = points.n - n_dropped - hard_data.n
    kept = clashing[keep[clashing]]
    counted = {
        "missing": points.n_missing,
        "outside": n_outside,
        "unknown": n_unknown,
        "clashing": len(clashing),
        "ties": ties,
        "repeated": n_repeated,
        "off_centre": int(np.count_nonzero(placed.offsets[keep] > 1e-6)),
    }
    told = {
        "of": points.n,
        "rejected": n_dropped - n_outside - n_unknown,
        "outside": points.named(placed.outside),
        "unknown": points.named(placed.unknown),
        "collisions": len(placed.collisions),
        "chosen": points.named(kept) if len(kept) else "none",
        "kept": points.n - n_dropped,
    }
    sentences = (_NOTES["placed"][what].format(n=n, **told) for what, n in counted.items() if n)
    notes = (*points.notes, *notes_on_rows, *sentences)
    return HardDataImport(
        hard_data=hard_data,
        n_read=points.n,
        n_missing=points.n_missing,
        n_off_centre=counted["off_centre"],
        n_outside=n_outside,
        n_unknown=n_unknown,
        n_collisions=len(placed.collisions),
        n_repeated=n_repeated,
        n_dropped=n_dropped,
        notes=notes,
        wells=_cells_of_wells(placed, keep),
    )


def _cells_of_wells(placed: PlacedPoints, keep: Mask) -> dict[str, Ints]:
    """For each well, return the cells with its data; leave out wells without data."""
    names = placed.points.wells
    well_names = list(dict.fromkeys(name for name in names.values() if name))
    numbers = {name: k for k, name in enumerate(well_names)}
    lines = placed.points.lines[keep].tolist()
    which = np.array([numbers.get(names.get(line, ""), -1) for line in lines], np.int64)
    rows = np.unique(np.column_stack([which, placed.cells[keep]])[which >= 0], axis=0)
    present, starts = np.unique(rows[:, 0], return_index=True)
    parts = np.split(rows[:, 1:], starts[1:]) if len(present) else []
    return {well_names[k]: part for k, part in zip(present.tolist(), parts, strict=True)}
