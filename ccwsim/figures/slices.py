"""Pictures of volumes: a layer, a section along x and a section along y, side by side."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from ccwsim.figures.maps import WRONG, Dots, data_map, png_of
from ccwsim.model.arrays import as_integers
from ccwsim.model.errors import CCWSIMError

GAP, LABEL, TEXT = 12, 22, 13
"""Gap between two slices, height of the labels above slices, and size of letters, in pixels."""
GREY = "#6B737C"
"""Colour of the labels, legible in both themes."""
INK = "#1B1F24"
AXES = ("layer", "row", "column")


class VolumeSlice(NamedTuple):
    """A slice of a volume with a label and hard data."""

    indices: NDArray[np.uint8]
    label: str
    dots: Dots


def slices_of(
    indices: NDArray[np.uint8], at: Sequence[int] | None = None, dots: Dots | None = None
) -> list[VolumeSlice]:
    """Return three slices through a cell of a volume: a layer, and sections along x and along y.

    `at` is the layer, row and column of the cell, by default the middle of the volume. `dots` are
    hard data with layer, row and column; each slice shows the data inside the slice. Raises
    `CCWSIMError` for a map, and for a cell outside the volume.

    Examples
    --------
    >>> [(one.label, one.indices.shape) for one in slices_of(np.zeros((4, 6, 8), np.uint8))]
    [('layer 2 (0 to 3)', (6, 8)), ('row 3 (0 to 5)', (4, 8)), ('column 4 (0 to 7)', (4, 6))]
    """
    shape = indices.shape
    if indices.ndim != len(AXES):
        raise CCWSIMError(f"slices need a volume, shape (nz, ny, nx), not {shape}")
    cell = [n // 2 for n in shape] if at is None else as_integers(at, "cell").ravel().tolist()
    if len(cell) != len(AXES) or not all(0 <= k < n for k, n in zip(cell, shape, strict=True)):
        raise CCWSIMError(f"cell {tuple(cell)} must lie in a volume of shape {shape}")
    cells, wrong = np.empty((0, len(AXES)), np.int64), np.empty(0, bool)
    data = Dots(cells, [], wrong) if dots is None else dots
    slices = []
    for axis, (name, k, n) in enumerate(zip(AXES, cell, shape, strict=True)):
        here = np.flatnonzero(data.cells[:, axis] == k)
        flat = np.delete(data.cells[here], axis, axis=1)
        own = Dots(flat, [data.colours[d] for d in here.tolist()], data.wrong[here])
        slices.append(VolumeSlice(np.take(indices, k, axis), f"{name} {k} (0 to {n - 1})", own))
    return slices


def slices_png(
    indices: NDArray[np.uint8],
    colours: Sequence[str],
    *,
    at: Sequence[int] | None = None,
    dots: Dots | None = None,
    longest: int = 1280,
) -> bytes:
    """Return a PNG of labelled slices of a volume, side by side on a transparent background.

    The picture is about `longest` pixels wide, and each cell is a square of whole pixels.

    Examples
    --------
    >>> from io import BytesIO
    >>> volume = np.zeros((5, 40, 40), np.uint8)
    >>> Image.open(BytesIO(slices_png(volume, ["#173F6B"], longest=744))).size
    (744, 262)
    """
    slices = slices_of(indices, at, dots)
    scale = max(1, round((longest - 2 * GAP) / sum(one.indices.shape[1] for one in slices)))
    layer, *sections = slices
    maps = [data_map(layer.indices, colours, layer.dots, scale)]
    maps += [_with_wells(one, colours, scale) for one in sections]
    font = ImageFont.load_default(TEXT)
    widths = [
        max(shown.width, int(font.getlength(one.label)) + 1)
        for one, shown in zip(slices, maps, strict=True)
    ]
    size = sum(widths) + GAP * (len(maps) - 1), LABEL + max(shown.height for shown in maps)
    picture = Image.new("RGBA", size)
    pen, left = ImageDraw.Draw(picture), 0
    for one, shown, width in zip(slices, maps, widths, strict=True):
        pen.text((left, 2), one.label, fill=GREY, font=font)
        picture.paste(shown, (left, LABEL))
        left += width + GAP
    return png_of(picture, optimize=True)


def _with_wells(section: VolumeSlice, colours: Sequence[str], scale: int) -> Image.Image:
    """Return a section with hard data as framed cells, because discs along a well would overlap."""
    nobody = Dots(np.empty((0, 2), np.int64), [], np.empty(0, bool))
    picture = data_map(section.indices, colours, nobody, scale)
    pen, dots = ImageDraw.Draw(picture), section.dots
    frames = ["#FFFFFF"] * len(dots.cells)
    edges = [WRONG if wrong else INK for wrong in dots.wrong.tolist()]
    for wider, fills in ((2, edges), (1, frames), (0, dots.colours)):
        for (row, column), fill in zip(dots.cells.tolist(), fills, strict=True):
            x, y = column * scale, (section.indices.shape[0] - row - 1) * scale
            far = scale - 1 + wider
            pen.rectangle((x - wider, y - wider, x + far, y + far), fill=fill)
    return picture
