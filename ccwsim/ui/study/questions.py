"""Questions about hard data: columns, names, a threshold, rows that do not fit."""

import re
from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import cycle
from typing import Any

import numpy as np
import pandas as pd
import streamlit as st

from ccwsim import CCWSIMError, Grid
from ccwsim.io import FileSummary, ImportedPoints, PlacedPoints, PointsPreview, inspect
from ccwsim.io.gridding import FilePart
from ccwsim.io.hard_data.columns import ALTERNATIVE_ROLES, DEPTHS, WELL_TABLES
from ccwsim.io.hard_data.placing import KINDS_OF_ROWS
from ccwsim.io.hard_data.rows import RowProblem
from ccwsim.model.arrays import Ints, describe_shape
from ccwsim.sharing.choices import Answers, Choices, DataChoice, Upload
from ccwsim.ui.session import resolve
from ccwsim.ui.study.asking import Item, Question, Write, ask, same
from ccwsim.ui.widgets.errors import if_possible
from ccwsim.ui.widgets.fields import button
from ccwsim.ui.widgets.text import page_labels, plain

MAX_LISTED = 300
"""Maximum number of rows or slices in a list; if there are more slices, the user types a number."""
MAX_NAMES = 24  # maximum number of names or codes of facies for which the page asks one by one
AS_READ = {None: "as usual in the format"}
STOP = {None: "stop with an error"}
OUT = {"drop": "leave them out"}
WAYS: dict[str, dict[Any, str]] = {
    "up": AS_READ | {True: "the south", False: "the north"},
    "z_up": AS_READ | {True: "the bottom", False: "the top"},
    "coordinates": {None: "world coordinates", "cells": "column and row of a cell"},
    **dict.fromkeys(("on_outside", "on_unknown", "on_no_collar", "on_bad_row"), STOP | OUT),
    "on_overlap": STOP
    | {
        "upper": "keep the upper interval whole",
        "lower": "keep the lower interval whole",
        "drop": "leave out both intervals",
    },
    "on_one_depth": {None: "take the other depth from the neighbouring row"} | OUT,
    "on_no_facies": {None: OUT["drop"], "above": "take the facies of the interval above"},
    "on_collision": STOP
    | {
        "majority": "keep the majority facies",
        "nearest": "keep the datum nearest to the centre",
        "drop": "ignore all data in such a cell",
    },
}
"""Questions with few possible answers, and these answers; None stands for the usual answer."""
ROLES = ("x", "y", "facies", "well")
"""Columns of a table of points, by the names of the arguments that set them."""
ROLES_OF_VOLUME = ("x", "y", "z", "facies", "well", *DEPTHS)
ROLES_OF_WELLS = {name: (*roles,) for name, roles in WELL_TABLES.items()}
ROLES_OF_WELLS["intervals"] += ("facies",)
LABELS = page_labels("columns_of_data")
TEXT_ROLES = ("facies", "well", "collar_well", "survey_well")  # columns that may contain text
SURVEY_TILTS = ("survey_inclination", "survey_dip")
EITHER_ROLES = tuple((roles, (role,)) for role, roles in ALTERNATIVE_ROLES.items())
"""Pairs of alternative columns; a table has either the first or the second columns of a pair."""
MAY_LACK = (*DEPTHS, "collar_length", *SURVEY_TILTS)
NO_COLUMN = ""
WIDTH = 232  # width of a question in pixels if several questions are side by side
KEPT = "The study keeps its present data."
IN_SCRIPTS = re.compile(r" \(\w+=[^)]*\)")
"""Pattern of hints in error messages that are only useful in scripts."""
Use = Callable[..., None]
"""A function use(choice, grid) that puts chosen data into the study; `grid` is optional."""


def summary_of(upload: Upload | None, part: FilePart | None = None) -> FileSummary | None:
    """Return a summary of an uploaded file, or None if the file cannot be opened."""
    return if_possible(lambda: resolve.read_upload(inspect, upload, part)) if upload else None


def say_open(choices: Choices, problem: str) -> None:
    """Warn that data are not used until questions are answered; show the error of a bad file."""
    choice, placed = choices.data, if_possible(lambda: resolve.placed_data(choices))
    if choice.source == "file" and any(summary_of(file) is None for file in choice.files):
        st.error(plain(f"{problem}. {KEPT}"))
        return
    troubles = troubles_of(placed) if placed is not None else {}
    undecided = [
        words
        for name, words in troubles.items()
        if WAYS[name].items() >= STOP.items() and name not in dict(choice.answers)
    ]
    if placed is not None and undecided:
        problem = f"{placed.points.name} does not fit yet: {', '.join(undecided)}"
    st.warning(plain(f"{IN_SCRIPTS.sub('', problem)}. {KEPT}"))


def troubles_of(placed: PlacedPoints) -> dict[str, str]:
    """Return a short phrase for each kind of problem that the data have, by question in `WAYS`."""
    n, rows = placed.points.n, Counter(problem.option for problem in placed.points.problems)
    n_outside, n_unknown, n_cells = map(len, (placed.outside, placed.unknown, placed.collisions))
    kinds = {
        name: (rows[name], f"{kind[:1].lower()}{kind[1:]}: {rows[name]}")
        for name, kind in KINDS_OF_ROWS.items()
    } | {
        "on_outside": (n_outside, f"{n_outside} of {n} data outside the grid"),
        "on_unknown": (
            n_unknown,
            f"{n_unknown} of {n} data of facies that the image does not have",
        ),
        "on_collision": (n_cells, f"cells with more than one facies: {n_cells}"),
    }
    return {name: words for name, (count, words) in kinds.items() if count}


def answered(answers: Answers, **new: Any) -> Answers:
    """Return answers with some answers changed; None removes an answer."""
    merged = {**dict(answers), **new}
    return tuple(sorted((name, value) for name, value in merged.items() if value is not None))


def rounded(value: float) -> float:
    """Return a value rounded to four digits."""
    return float(f"{value:.4g}")


def ask_data(choices: Choices, use: Use, *, wide: bool = False) -> None:
    """Ask the open questions about the hard data of a study.

    If `wide`, all columns and names are shown with their guesses. Other functions then offer a
    larger grid, ask about rows that do not fit, and draw the columns of tables of wells.
    """
    choice, volume, items = choices.data, choices.grid.nz is not None, list[Item]()
    write = writer(choice, use)
    if choice.source == "file" and choice.tables is not None and not wide:
        for table, preview in resolve.previews_of_wells(choice).items():
            ask_columns_of_wells(choice, table, preview, use)
    elif choice.source == "file" and choice.tables is None and choice.upload is not None:
        summary = summary_of(choice.upload)
        if summary is None:
            return
        if summary.is_table:
            preview = resolve.preview_of(choice, choices.grid)
            if volume and not wide:
                st.caption(plain(taken_as(preview)))
            items += _columns(choice, preview, ROLES_OF_VOLUME if volume else ROLES, wide)
            items += _coordinates(choice, preview)
        else:
            items += _grid(summary, choice, volume)
    points = None
    if choice.source == "file":
        points = if_possible(lambda: resolve.points_in_files(choices))
    if points is not None and points.continuous:
        items += _threshold(points, dict(choice.answers).get("threshold"))
    placed = if_possible(lambda: resolve.placed_data(choices))
    if placed is not None:
        items += _names(choices, placed, wide)
    ask(items, write)
    if not wide:
        offer_fit(choices, use)
        ask_troubles(choices, use)


def writer(choice: DataChoice, use: Use) -> Write:
    """Return a function that stores new answers in a choice and uses the choice."""
    return lambda **new: use(replace(choice, answers=answered(choice.answers, **new)))


def _grid(summary: FileSummary, choice: DataChoice, volume: bool) -> list[Item]:
    """Return the open questions about a grid of data."""
    answers, items = dict(choice.answers), list[Item]()
    if len(summary.variables) > 1:
        items.append(which_variable(summary, answers.get("facies"), "facies"))
    if not volume and summary.n_slices > 1:
        items.append(which_slice(summary.n_slices, answers.get("slice_index")))
    names = ("up", "z_up") if volume else ("up",)
    return items + [way(name, answers) for name in names if summary.asks_up or name in answers]


def which_variable(summary: FileSummary, value: str | None, argument: str) -> Question:
    """Ask which of the variables in a file is the facies."""
    names = same(variable.name for variable in summary.variables)
    text = "Which variable is the facies?"
    return Question("variable", text, value, names, lambda name: {argument: name})


def way(name: str, answers: Mapping[str, Any], label: str = "") -> Question:
    """Ask a question of `WAYS`."""
    return Question(name, label or LABELS[name], answers.get(name), WAYS[name])


def ask_columns_of_wells(
    choice: DataChoice,
    table: str,
    preview: PointsPreview | CCWSIMError,
    use: Use,
    *,
    wide: bool = False,
) -> None:
    """Ask for the roles of columns in a table of wells; if the table cannot be read, say why."""
    if isinstance(preview, CCWSIMError):
        st.error(plain(f"{preview}."))
        return
    if not wide:
        st.caption(plain(f"{table.capitalize()}: {taken_as(preview)}"))
    ask(_columns(choice, preview, ROLES_OF_WELLS[table], wide), writer(choice, use))


def taken_as(preview: PointsPreview) -> str:
    """Describe the role of each column."""
    roles = [f"{column} → {role_of(role)}" for role, column in preview.guess.items()]
    return ", ".join(roles) or "no column was recognized by its name"


def role_of(role: str) -> str:
    """Return the heading of a column, derived from the name of the argument."""
    return re.sub("^(collar|survey)_", "", role).replace("_", " ")


def _columns(
    choice: DataChoice, preview: PointsPreview, roles: Sequence[str], wide: bool
) -> list[Item]:
    """Return the questions about the columns of a table, with the guesses."""
    answers = {role: column for role, column in choice.answers if role in roles}
    taken = {role: answers.get(role, preview.guess.get(role)) for role in roles}
    lack = _may_lack(roles)
    asked = {role for role, column in answers.items() if column or role not in lack}
    asked |= {*_open_alternatives(preview, roles)} if not wide else {*roles}
    unclear = preview.assignment.unclear
    asked |= {r for r in roles if r not in lack and (r not in preview.guess or unclear)}
    side_by_side = wide and roles is not ROLES
    items = tuple(
        Question(
            f"column_{role}",
            "z of the collar" if role == "z" and "collar_well" in roles else LABELS[role],
            taken[role] or (NO_COLUMN if role in lack else None),
            ({NO_COLUMN: "none"} if role in lack else {})
            | same(preview.columns if role in TEXT_ROLES else preview.numeric),
            partial(_answers_of_column, taken, role),
            look={"width": WIDTH} if side_by_side else {},
        )
        for role in roles
        if role in asked
    )
    return [items] if side_by_side else [*items]


def _answers_of_column(
    taken: Mapping[str, str | None], role: str, column: str
) -> Mapping[str, str | None]:
    """Return the columns after a change of one role; for another facies, reset values and names."""
    new = with_column(taken, role, column)
    if new.get("facies") == taken.get("facies"):
        return new
    return new | {"threshold": None, "facies_names": None}


def _may_lack(roles: Collection[str]) -> tuple[str, ...]:
    """Return the roles for which a table needs no column; points need no well names."""
    return (*MAY_LACK, "well") if "x" in roles else MAY_LACK


def _open_alternatives(preview: PointsPreview, roles: Collection[str]) -> tuple[str, ...]:
    """Return alternative roles of which the user must choose one, such as inclination or dip."""
    ends = [role for role in ("depth_from", "depth_to") if role in preview.guess]
    if "survey_dip" in roles:
        return () if {*SURVEY_TILTS} & preview.guess.keys() else SURVEY_TILTS
    needed = "depth" in roles and "x" not in roles
    if len(ends) == 1 or (needed and not ends and "depth" not in preview.guess):
        return tuple(DEPTHS)
    return ()


def with_column(taken: Mapping[str, str | None], role: str, column: str) -> dict[str, str | None]:
    """Return the column of each role after a change of one role; an empty text means no column.

    A column has only one role, so the two affected roles exchange columns. A table has depths of
    either intervals or points, and either inclination or dip.
    """
    new = {**taken, role: column}
    lack = _may_lack(taken)
    for other, taken_column in taken.items():
        if other != role and column and taken_column == column:
            alike = other not in lack or (role in DEPTHS and other in DEPTHS)
            new[other] = (taken[role] if alike else None) or (NO_COLUMN if other in lack else None)
    for used, unused in (*EITHER_ROLES, *(sides[::-1] for sides in EITHER_ROLES)):
        if role in used and column:
            new |= dict.fromkeys(other for other in unused if other in new)
    return new


def _coordinates(choice: DataChoice, preview: PointsPreview) -> list[Item]:
    """Ask for the meaning of position columns if the column names do not show it."""
    answers = dict(choice.answers)
    if not preview.assignment.unclear and not {"x", "y", "coordinates"} & answers.keys():
        return []
    reset = {"cells": dict.fromkeys(DEPTHS)}  # positions in cells have a layer and no depths
    question = way("coordinates", answers)
    return [replace(question, answers=lambda unit: {"coordinates": unit, **reset.get(unit, {})})]


def which_slice(n: int, index: int | None, *, slider: bool = False) -> Question:
    """Ask which of n slices to use; slice numbers start at 0 in code and at 1 on the page."""
    number = Question(
        "slice",
        f"Which of {n} slices, counted from the bottom?",
        None if index is None else index + 1,
        answers=lambda number: {"slice_index": number - 1},
        look={"min_value": 1, "max_value": n},
    )
    if n > MAX_LISTED:
        return number
    if slider:
        return replace(number, widget=st.slider)
    offered = {k: f"{k} of {n}" for k in range(1, n + 1)}
    text = "Which slice, counted from the bottom?"
    return replace(number, text=text, options=offered, look={})


def _threshold(points: ImportedPoints, threshold: float | None) -> list[Item]:
    """Ask for a threshold for values that are not codes; the guess is the median."""
    guess = rounded(float(np.median(points.values)))
    low, high = points.values.min(), points.values.max()
    text = f"{plain(points.variable)} is from {low:g} to {high:g}. Lowest value of facies 1?"
    look = {"placeholder": f"such as {guess:g}", "format": "%g"}
    question = Question("threshold", text, threshold, look=look)
    if threshold is not None:
        return [question]

    def use_median(write: Write) -> None:
        label = f"Use the median, {guess:g}"
        button(label, key="ask_median", on_click=partial(write, threshold=guess))

    return [question, use_median]


def _names(choices: Choices, placed: PlacedPoints, wide: bool) -> list[Item]:
    """Ask which facies of the image each name or unknown code in the file denotes."""
    image, points = resolve.image_of(choices.image), placed.points
    codes = dict(dict(choices.data.answers).get("facies_names", ()))
    asked = [*(points.words if wide else ()), *codes, *sorted({*placed.unknown_facies})]
    spellings = {name.casefold(): name for name in reversed(asked)}
    names = list(dict.fromkeys(spellings[name.casefold()] for name in asked))
    labels = dict(zip(image.codes.tolist(), image.facies_names, strict=True))
    items: list[Item] = []
    for k, name in enumerate(names[:MAX_NAMES]):
        code = codes.get(name, _code_of(placed, name))
        text = plain(f"{name} is" if points.words else f"Facies {name} is")
        value, answers = code if code in labels else None, partial(_answers_of_name, codes, name)
        items.append(Question(f"name_{k}", text, value, labels, answers))
    if len(names) > MAX_NAMES:
        note = f"{len(names)} different facies; the first {MAX_NAMES} are listed."
        items.append(lambda _: st.caption(note))
    return items


def _answers_of_name(codes: Mapping[str, int], name: str, code: int) -> dict[str, Any]:
    return {"facies_names": tuple(sorted({**codes, name: code}.items()))}


def _code_of(placed: PlacedPoints, name: str) -> int | None:
    words = placed.points.words
    if name not in words:
        return None
    return int(placed.facies[np.argmax(placed.points.values == words.index(name))])


def offer_fit(choices: Choices, use: Use) -> None:
    """If some data are outside the grid, offer a grid that contains all data."""
    grid = resolve.grid_for_data(choices)
    if grid is not None:
        button("Fit the grid to the data", key="ask_fit", on_click=use, args=(choices.data, grid))
        st.caption(f"It becomes {described(grid)}.")


def described(grid: Grid) -> str:
    """Describe a grid in words."""
    sizes = [f"{side:g}" for side in grid.cell_size]
    size = sizes[0] if len({*sizes}) == 1 else " × ".join(sizes)
    corner = ", ".join(f"{coordinate:.12g}" for coordinate in grid.origin)
    return f"{describe_shape(grid.shape)} cells of {size} from ({corner})"


def ask_troubles(choices: Choices, use: Use, *, wide: bool = False) -> None:
    """List the rows that do not fit, in tables if `wide`, and ask how to handle these rows."""
    choice, placed = choices.data, if_possible(lambda: resolve.placed_data(choices))
    if placed is None:
        return
    write, answers, troubles = writer(choice, use), dict(choice.answers), troubles_of(placed)
    clashing = np.concatenate(placed.collisions) if placed.collisions else np.empty(0, np.int64)
    kinds = {"on_outside": placed.outside, "on_unknown": placed.unknown, "on_collision": clashing}
    places = st.columns(2, gap="large") if wide and troubles else [st.container()]
    for place, (name, label) in zip(cycle(places), troubles.items(), strict=False):
        with place:
            ask([way(name, answers, label[:1].upper() + label[1:])], write)
            if name in kinds:
                _list_rows(placed, kinds[name], wide)
            else:
                _list_problems([p for p in placed.points.problems if p.option == name], wide)


def _list_problems(problems: Sequence[RowProblem], wide: bool) -> None:
    """List problems with rows of tables of wells."""
    first = problems[: MAX_LISTED if wide else 3]
    if wide:
        rows = {"rows": [p.where for p in first], "problem": [p.message for p in first]}
        _draw_table(rows, len(problems))
    else:
        more = " …" if len(problems) > len(first) else ""
        st.caption(plain("; ".join(f"{p.where}: {p.message}" for p in first) + more))


def _draw_table(rows: Mapping[str, Any], n: int) -> None:
    """Draw the first of `n` rows as a table, by column."""
    table = pd.DataFrame(rows)
    st.dataframe(table, hide_index=True, height="content" if len(table) < 8 else 280)
    if n > len(table):
        st.caption(f"The first {len(table)} of {n} rows.")


def _list_rows(placed: PlacedPoints, indices: Ints, wide: bool) -> None:
    points = placed.points
    if not wide:
        st.caption(plain(points.named(indices).capitalize()))
        return
    axes, n = ("layer", "row", "column"), points.places.shape[1]
    names = ("x", "y", "z")[:n] if points.world else axes[-n:]
    first = indices[:MAX_LISTED]
    rows: dict[str, Any] = {points.counted: points.lines[first]}
    if points.wells:
        rows["well"] = [points.wells.get(line, "") for line in points.lines[first].tolist()]
    rows |= {name: points.places[first, k] for k, name in enumerate(names)}
    rows["facies"] = [points.said(int(k)) for k in first]
    rows["cell"] = [
        ", ".join(f"{axis} {k}" for axis, k in zip(axes[-len(cell) :], cell, strict=True))
        for cell in placed.cells[first].tolist()
    ]
    _draw_table(rows, len(indices))
