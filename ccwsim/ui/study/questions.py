"""Questions about hard data: columns, names, a threshold, rows that do not fit."""

import re
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import cycle
from typing import Any

import numpy as np
import pandas as pd
import streamlit as st

from ccwsim import CCWSIMError
from ccwsim.figures import facies_colours
from ccwsim.io import FileSummary, ImportedPoints, PlacedPoints, PointsPreview, inspect
from ccwsim.io.formats.text_tables import is_number
from ccwsim.io.gridding import FilePart
from ccwsim.io.hard_data.columns import ALTERNATIVE_ROLES, DEPTH_ROLES, WELL_TABLES
from ccwsim.io.hard_data.placing import KINDS_OF_ROWS
from ccwsim.io.hard_data.rows import RowProblem
from ccwsim.model import MAX_GRID_SIDE_OFFERED, FaciesMatch, Ints, facies_label
from ccwsim.sharing.choices import Answers, Choices, DataChoice, FaciesAnswers, ImageChoice, Upload
from ccwsim.ui.session import resolve
from ccwsim.ui.study.asking import FormItem, Question, WriteAnswer, answer_button, ask, same
from ccwsim.ui.widgets import button, if_possible, page_labels, page_text, plain

MAX_MENU_ROWS = 300
"""Maximum number of rows or slices in a list; if there are more slices, the user types a number."""
# maximum number of names or codes of facies for which the page asks one by one
MAX_ASKED_FACIES = 24
AS_READ = {None: "as usual in the format"}
STOP = {None: "stop with an error"}
OUT = {"drop": "leave them out"}
ANSWER_LABELS: dict[str, dict[Any, str]] = {
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
ROLES_OF_VOLUME = ("x", "y", "z", "facies", "well", *DEPTH_ROLES)
ROLES_OF_WELLS = {name: (*roles,) for name, roles in WELL_TABLES.items()}
ROLES_OF_WELLS["intervals"] += ("facies",)
COLUMN_LABELS = page_labels("columns_of_data")
TEXT_ROLES = ("facies", "well", "collar_well", "survey_well")  # columns that may contain text
SURVEY_TILTS = ("survey_inclination", "survey_dip")
EITHER_ROLES = tuple((roles, (role,)) for role, roles in ALTERNATIVE_ROLES.items())
"""Pairs of alternative columns; a table has either the first or the second columns of a pair."""
MAY_LACK = (*DEPTH_ROLES, "collar_length", *SURVEY_TILTS)
NO_COLUMN = ""
QUESTION_WIDTH = 232  # width of a question in pixels if several questions are side by side
DATA_KEPT = "The study keeps its present data."
IN_SCRIPTS = re.compile(r" \(\w+=[^)]*\)")
"""Pattern of hints in error messages that are only useful in scripts."""
UseData = Callable[..., None]
"""A function use(choice, grid) that puts chosen data into the study; `grid` is optional."""


def summary_of(upload: Upload | None, part: FilePart | None = None) -> FileSummary | None:
    """Return a summary of an uploaded file, or None if the file cannot be opened."""
    return if_possible(lambda: resolve.read_upload(inspect, upload, part)) if upload else None


def say_open(choices: Choices, problem: str) -> None:
    """Warn that data are not used until questions are answered; show the error of a bad file."""
    choice, placed = choices.data, if_possible(lambda: resolve.placed_data(choices))
    if choice.source == "file" and any(summary_of(file) is None for file in choice.files):
        st.error(plain(f"{problem}. {DATA_KEPT}"))
        return
    troubles = troubles_of(placed) if placed is not None else {}
    undecided = [
        words
        for name, words in troubles.items()
        if ANSWER_LABELS[name].items() >= STOP.items() and name not in dict(choice.answers)
    ]
    if placed is not None and undecided:
        problem = f"{placed.points.name} does not fit yet: {', '.join(undecided)}"
    st.warning(plain(f"{IN_SCRIPTS.sub('', problem)}. {DATA_KEPT}"))


def troubles_of(placed: PlacedPoints) -> dict[str, str]:
    """Return a short phrase for each problem of the data, by question in `ANSWER_LABELS`."""
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


def ask_data(choices: Choices, use: UseData, *, wide: bool = False) -> None:
    """Ask the open questions about the hard data of a study.

    If `wide`, all columns and names are shown with their guesses. Other functions then offer a
    larger grid, ask about rows that do not fit, and draw the columns of tables of wells.
    """
    choice, volume, items = choices.data, choices.grid.is_volume, list[FormItem]()
    write = writer(choice, use)
    if choice.source == "file" and choice.tables is not None and not wide:
        for table, preview in resolve.previews_of_wells(choice).items():
            ask_columns_of_wells(choice, table, preview, use)
    elif choice.source == "file" and choice.tables is None and choice.upload is not None:
        summary = summary_of(choice.upload)
        if summary is None:
            return
        if summary.is_table:
            preview = resolve.preview_of(choice, choices)
            if volume and not wide:
                st.caption(plain(taken_as(preview)))
            items += _columns(choice, preview, ROLES_OF_VOLUME if volume else ROLES, wide)
            items += _coordinates(choice, preview)
        else:
            items += _grid(summary, choice, volume)
    points = None
    if choice.source == "file":
        points = if_possible(lambda: resolve.points_in_files(choices))
    placed = if_possible(lambda: resolve.placed_data(choices))
    match = None if placed is None else placed.match
    if points is not None and points.continuous and not (match and match.image.values):
        items += _threshold(points, dict(choice.answers).get("threshold"))
    if placed is not None and match is not None:
        others = (*placed.points.words, *placed.unknown_facies) if wide else placed.unknown_facies
        answers = dict(choice.answers).get("facies_names", ())
        of_facies = facies_items(match, answers, choices.image, others=others)
        items = [*of_facies, *items] if match.open_labels else [*items, *of_facies]
    ask(items, write)
    if not wide:
        offer_grids(choices, use)
        ask_troubles(choices, use)


def writer(choice: DataChoice, use: UseData) -> WriteAnswer:
    """Return a function that stores new answers in a choice and uses the choice."""
    return lambda **new: use(replace(choice, answers=answered(choice.answers, **new)))


def _grid(summary: FileSummary, choice: DataChoice, volume: bool) -> list[FormItem]:
    """Return the open questions about a grid of data."""
    answers, items = dict(choice.answers), list[FormItem]()
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
    """Ask a question of `ANSWER_LABELS`."""
    return Question(name, label or COLUMN_LABELS[name], answers.get(name), ANSWER_LABELS[name])


def ask_columns_of_wells(
    choice: DataChoice,
    table: str,
    preview: PointsPreview | CCWSIMError,
    use: UseData,
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
) -> list[FormItem]:
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
            "z of the collar" if role == "z" and "collar_well" in roles else COLUMN_LABELS[role],
            taken[role] or (NO_COLUMN if role in lack else None),
            ({NO_COLUMN: "none"} if role in lack else {})
            | same(preview.columns if role in TEXT_ROLES else preview.numeric),
            partial(_answers_of_column, taken, role),
            look={"width": QUESTION_WIDTH} if side_by_side else {},
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
        return tuple(DEPTH_ROLES)
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
            alike = other not in lack or (role in DEPTH_ROLES and other in DEPTH_ROLES)
            new[other] = (taken[role] if alike else None) or (NO_COLUMN if other in lack else None)
    for used, unused in (*EITHER_ROLES, *(sides[::-1] for sides in EITHER_ROLES)):
        if role in used and column:
            new |= dict.fromkeys(other for other in unused if other in new)
    return new


def _coordinates(choice: DataChoice, preview: PointsPreview) -> list[FormItem]:
    """Ask for the meaning of position columns if the column names do not show it."""
    answers = dict(choice.answers)
    if not preview.assignment.unclear and not {"x", "y", "coordinates"} & answers.keys():
        return []
    reset = {"cells": dict.fromkeys(DEPTH_ROLES)}  # positions in cells have a layer and no depths
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
    if n > MAX_MENU_ROWS:
        return number
    if slider:
        return replace(number, widget=st.slider)
    offered = {k: f"{k} of {n}" for k in range(1, n + 1)}
    text = "Which slice, counted from the bottom?"
    return replace(number, text=text, options=offered, look={})


def _threshold(points: ImportedPoints, threshold: float | None) -> list[FormItem]:
    """Ask for a threshold for values that are not codes; the guess is the median."""
    guess = rounded(float(np.median(points.values)))
    low, high = points.values.min(), points.values.max()
    text = f"{plain(points.variable)} is from {low:g} to {high:g}. Lowest value of facies 1?"
    look = {"placeholder": f"such as {guess:g}", "format": "%g"}
    question = Question("threshold", text, threshold, look=look)
    use_median = answer_button(f"Use the median, {guess:g}", "ask_median", threshold=guess)
    return [question, use_median] if threshold is None else [question]


def facies_items(
    match: FaciesMatch,
    answers: FaciesAnswers,
    image_choice: ImageChoice,
    part: str = "",
    others: Iterable[str] = (),
) -> list[FormItem]:
    """Ask which facies of the image open labels, labels with an answer, and `others` are.

    If codes of the image or of the labels are only numbers, the likeliest facies are chosen first.
    """
    image, answered_codes = match.image, dict(answers)
    asked = [*others, *answered_codes, *match.open_labels]
    names = [*{facies_label(name).casefold(): name for name in asked}.values()]
    is_numbered = match.open_labels or image.numbering != "codes"
    guesses = {n: code for n, code in match.likeliest.items() if n in names and is_numbered}
    codes, facies = match.codes | guesses | answered_codes, image.codes.tolist()
    colours = dict(zip(facies, facies_colours(image, dict(image_choice.colours)), strict=True))
    items: list[FormItem] = []
    for k, name in enumerate(names[:MAX_ASKED_FACIES]):
        question = Question(
            key=f"name_{k}",
            text=plain(f"Facies {name} is" if is_number(name) else f"{name} is"),
            value=codes.get(name) if codes.get(name) in facies else None,
            options=dict(zip(facies, image.facies_names, strict=True)),
            answers=lambda code, name=name: with_facies(answered_codes | {name: code}),
        )
        items.append((partial(_swatch, colours.get(codes.get(name))), question))
    if guesses:
        items.append("The likeliest facies are chosen, by proportions.")
        likeliest = with_facies(guesses | answered_codes)
        items.append(answer_button("Use these facies", f"{part}name_likeliest", **likeliest))
    if len(names) > MAX_ASKED_FACIES:
        items.append(f"{len(names)} different facies; the first {MAX_ASKED_FACIES} are listed.")
    return items


def with_facies(codes: Mapping[str, int]) -> dict[str, Any]:
    """Return the answer on the facies of the image for each name or code."""
    return {"facies_names": tuple(sorted(codes.items()))}


def _swatch(colour: str | None, _: WriteAnswer) -> None:
    """Draw the colour of a facies of the image."""
    style = f"background: {colour or 'none'}"
    st.html(f'<div class="facies-swatch" style="{style}"></div>', width="content")


GRID_BUTTONS = {"enlarge": "Enlarge the grid", "fit": "Fit the grid to the data"}
"""Labels of the buttons that use the grids of `grids_for_data`."""


def offer_grids(choices: Choices, use: UseData, part: str = "") -> None:
    """If data are outside the grid, offer to leave them out, or another grid.

    Keys of the buttons begin with `part`.
    """
    choice, grids = choices.data, resolve.grids_for_data(choices)
    if not grids or choices.grid == next(iter(grids.values())):
        return
    if choice.source == "file":
        drop = {"on_click": writer(choice, use), "kwargs": {"on_outside": "drop"}}
        button("Drop them", key=f"{part}ask_drop", **drop)
    for name, grid in grids.items():
        button(GRID_BUTTONS[name], key=f"{part}ask_{name}", on_click=use, args=(choice, grid))
        st.caption(f"It becomes {resolve.described(grid)}.")
    if "enlarge" not in grids:
        st.caption(page_text("Grid too large", n=f"{MAX_GRID_SIDE_OFFERED:,}"))


def ask_troubles(choices: Choices, use: UseData, *, wide: bool = False) -> None:
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
    first = problems[: MAX_MENU_ROWS if wide else 3]
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
    first = indices[:MAX_MENU_ROWS]
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
