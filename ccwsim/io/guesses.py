"""Find the options that a training image file leaves open, and guess a value for each."""

from __future__ import annotations

from collections.abc import Mapping
from math import isqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ccwsim.io.data_file import DataFile
from ccwsim.io.formats.pictures import (
    MAX_COLOURS,
    PictureFile,
    distinct_colours,
    grey_of,
    is_grey,
    main_colours,
)
from ccwsim.io.gridding import as_grid
from ccwsim.io.limits import TooManyCells
from ccwsim.io.opening import PathOrFile, open_file
from ccwsim.io.part import FilePart, largest_without_gaps, thinning
from ccwsim.io.training_images import PREFERRED
from ccwsim.model.classes import are_codes
from ccwsim.model.errors import CCWSIMError

QUESTIONS = {
    "part": ("every", "crop", "layers"),
    "variable": ("variable",),
    "shape": ("shape",),
    "slice": ("volume", "slice_index", "z_up"),
    "up": ("up",),
    "gaps": ("crop",),
    "values": ("threshold", "classes", "merge"),
}
"""Arguments of `read_training_image` that answer each question. The order of the questions matters,
because later questions depend on earlier answers."""


def guess_answers(
    path_or_file: PathOrFile, answers: Mapping[str, Any] | None = None
) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Guess the arguments needed to read a file as a training image, and list open questions.

    Raises `CCWSIMError` for a file that cannot be opened, or answers that do not fit the file.

    Parameters
    ----------
    path_or_file : str, Path or binary file
    answers : mapping, optional
        Known arguments of `read_training_image`, which are returned unchanged.

    Returns
    -------
    answers : dict
        The known arguments, and guesses for open questions: the first variable with codes, all
        layers of a volume (with `volume=False` the middle slice), the shape nearest to a square,
        the largest rectangle without gaps, the smallest `every` that keeps a picture within the
        limit, Otsu's threshold for grey values, and one class per main colour of a picture.
    asked : tuple of str
        The keys of `QUESTIONS` that apply to this file, whether answered or not.

    References
    ----------
    N. Otsu (1979), A threshold selection method from gray-level histograms. IEEE Transactions on
    Systems, Man, and Cybernetics 9(1), 62-66.

    Examples
    --------
    >>> from io import BytesIO
    >>> guess_answers(BytesIO(b"2 2 1\\n1\\nporosity\\n0.1\\n0.12\\n0.3\\n0.31\\n"))
    ({'threshold': 0.21}, ('values',))
    """
    known, asked = dict(answers or {}), []
    try:
        file, part = open_file(path_or_file), None
    except TooManyCells as error:
        asked.append("part")
        part = _guess_part(*error.grid(), known)
        how = {name: known.get(name) for name in ("shape", "up", "z_up")}
        file = open_file(path_or_file, part, **how)
    if isinstance(file, PictureFile):
        if file.known is not None and "part" not in asked:
            _ask_gaps(file.name, file.known if known.get("up") else file.known[::-1], known, asked)
            file = open_file(path_or_file, FilePart.answered(known), up=known.get("up"))
            assert isinstance(file, PictureFile)
        if not file.says_codes and len(distinct_colours(file.rgb)[0]) > MAX_COLOURS:
            asked.append("values")
            if not {"threshold", "classes"} & set(known):
                known |= _of_colours(file)
        return known, tuple(asked)
    file = file if part else as_grid(file, known.get("shape"))
    values = _layer(file, known, asked)
    asked += ["up"] if file.asks_up else []
    _ask_gaps(file.name, file.known(values), known, asked)
    taken = values if part else FilePart(known.get("crop")).of(file.name, values)
    taken = taken[file.known(taken)]
    if taken.size and not are_codes(taken):
        asked.append("values")
        if not {"threshold", "classes"} & set(known):
            known["threshold"] = otsu(taken)
    return known, tuple(asked)


def _guess_part(shape: tuple[int, ...], copies: float, known: dict[str, Any]) -> FilePart:
    """Guess `every` such that the part of a grid of this shape is within the limit of cells."""
    if "every" not in known:
        _, sides = FilePart.of_answers(known).box("the grid", shape)
        known["every"] = thinning(sides, copies)
    return FilePart.of_answers(known)


def _layer(file: DataFile, known: dict[str, Any], asked: list[str]) -> NDArray:
    """Guess variable, shape and layers (all without a slice); return values, row 0 at the south."""
    names = list(file.variables)
    liked = [name for name in names if name.lower() in PREFERRED]
    if len(names) > 1 and len(liked) != 1:
        asked.append("variable")
        known.setdefault("variable", _likely_facies(file))
    key = file.chosen(known.get("variable"), PREFERRED)
    if file.is_table:
        asked.append("shape")
        known.setdefault("shape", _squarest(len(file.variables[key])))
    grid = file.grid_of(key, known.get("shape"))
    if len(grid) > 1 and 1 not in grid.shape[1:]:
        asked.append("slice")
        if known.get("volume", "slice_index" not in known):
            known["volume"] = True
            return file.oriented(grid, up=known.get("up"), volume=True)
        known.setdefault("slice_index", len(grid) // 2)
    return file.oriented(grid, up=known.get("up"), slice_index=known.get("slice_index"))


def _ask_gaps(name: str, there: NDArray[np.bool_], known: dict[str, Any], asked: list[str]) -> None:
    """Ask for a piece without unknown cells; `there` masks known cells, row 0 in the south."""
    there = np.all(there, axis=0) if there.ndim == 3 else there  # a cropped piece keeps all layers
    if there.all() or "part" in asked:
        return
    asked.append("gaps")
    if "crop" not in known:
        piece = largest_without_gaps(there)
        if not piece[2]:
            raise CCWSIMError(f"{name}: no cell has a value; choose another variable or slice")
        known["crop"] = piece


def _likely_facies(file: DataFile) -> str:
    """Return the first variable with facies codes; if there is none, the first variable."""
    for name, values in file.variables.items():
        there = values[file.known(values)]
        if there.size and are_codes(there) and there.min() != there.max():
            return name
    return next(iter(file.variables))


def _squarest(n: int) -> tuple[int, int]:
    ny = next(k for k in range(isqrt(n), 0, -1) if n % k == 0)
    return ny, n // ny


def _of_colours(picture: PictureFile) -> dict[str, Any]:
    """Guess a threshold for a grey picture, or the number of main colours for a coloured one."""
    if is_grey(picture.rgb, percent=99.0):
        return {"threshold": otsu(grey_of(picture.rgb))}
    return {"classes": max(2, len(main_colours(picture.rgb)))}


def otsu(values: NDArray) -> float:
    """Return the threshold that minimizes the variance within the two classes (Otsu's method)."""
    low, high = float(values.min()), float(values.max())
    counts, edges = np.histogram(values, bins=256, range=(low, high))
    middles = (edges[:-1] + edges[1:]) / 2
    below = np.cumsum(counts)[:-1]
    above = values.size - below
    sums = np.cumsum(counts * middles)
    apart = sums[:-1] / np.maximum(below, 1) - (sums[-1] - sums[:-1]) / np.maximum(above, 1)
    between = below.astype(float) * above * apart**2
    # all thresholds between two neighbouring values are equally good
    best = np.flatnonzero(between >= between.max() * (1 - 1e-12))
    return float(f"{edges[1:-1][best].mean():.3g}")
