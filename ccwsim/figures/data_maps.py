"""Maps with the hard data on them, as pictures: for paper, where nothing can be hovered."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from io import BytesIO

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from ccwsim.figures.palette import CIVIDIS, ramp
from ccwsim.figures.rasters import map_png

WRONG = "#C8321F"
STEPS = 101


@dataclass(frozen=True, eq=False)
class Dots:
    """Hard data to be drawn on a map.

    Attributes
    ----------
    cells : ndarray of int, shape (n, 2)
        Row and column, row 0 at the south.
    colours : list of str
        One a datum, of its facies.
    wrong : ndarray of bool, shape (n,)
        Those that the map does not honour are ringed red.
    """

    cells: NDArray[np.integer]
    colours: list[str]
    wrong: NDArray[np.bool_]


def data_map_png(
    indices: NDArray[np.uint8],
    colours: Sequence[str],
    dots: Dots | None = None,
    *,
    longest: int = 640,
) -> bytes:
    """Return a map, about `longest` pixels on its longer side, with its hard data, as a PNG.

    Examples
    --------
    >>> dots = Dots(np.array([[0, 1]]), ["#173F6B"], np.array([True]))
    >>> png = data_map_png(np.eye(2, dtype=np.uint8), ["#173F6B", "#F0AD2E"], dots, longest=100)
    >>> Image.open(BytesIO(png)).size
    (100, 100)
    """
    scale = max(1, round(longest / max(indices.shape)))
    plain = map_png(indices, colours, scale=scale)
    if dots is None or not len(dots.cells):
        return plain
    picture = Image.open(BytesIO(plain)).convert("RGB")
    pen = ImageDraw.Draw(picture)
    height = indices.shape[0]
    radius = max(1.5, min(5.0, 0.18 * (picture.width * picture.height / len(dots.cells)) ** 0.5))
    order = np.argsort(dots.wrong, kind="stable")  # the wrong ones on top
    for k in order.tolist():
        row, column = dots.cells[k]
        x, y = (column + 0.5) * scale, (height - row - 0.5) * scale
        wrong = bool(dots.wrong[k])
        _ring(pen, x, y, radius + 1.6, WRONG if wrong else "#1B1F24")
        _ring(pen, x, y, radius + 0.8, "#FFFFFF")
        _ring(pen, x, y, radius - 0.4, dots.colours[k])
    written = BytesIO()
    picture.quantize(64, dither=Image.Dither.NONE).save(written, "PNG", optimize=True)
    return written.getvalue()


def share_png(shares: NDArray[np.float64], *, longest: int = 640) -> bytes:
    """Return a map of shares from 0 to 1 in the cividis ramp as a PNG.

    Examples
    --------
    >>> Image.open(BytesIO(share_png(np.eye(3), longest=9))).size
    (9, 9)
    """
    steps = np.rint(np.clip(shares, 0, 1) * (STEPS - 1)).astype(np.uint8)
    return map_png(steps, ramp(CIVIDIS, STEPS), scale=max(1, round(longest / max(steps.shape))))


def _ring(pen: ImageDraw.ImageDraw, x: float, y: float, radius: float, colour: str) -> None:
    pen.ellipse((x - radius, y - radius, x + radius, y + radius), fill=colour)
