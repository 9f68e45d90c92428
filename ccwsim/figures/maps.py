"""Pictures of maps and of slices of volumes, with or without hard data.

Row 0 of an array is in the south; pictures have north at the top. In all functions, `shape` is the
shape of the grid, and `longest` is the length in pixels of the longer side of a picture.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from io import BytesIO
from typing import Any, NamedTuple

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from ccwsim import CCWSIMError
from ccwsim.figures.style import bytes_of
from ccwsim.model import CELL_AXES, UNKNOWN, Bytes, Integers, Mask, Shape, as_integers, check_int

MAX_SHEET_SIDE = 8192
WRONG_COLOUR = "#C8321F"
SLICE_GAP, LABEL_HEIGHT, LETTER_SIZE = 12, 22, 13
"""Gap between two slices, height of the labels above slices, and size of letters, in pixels."""
LABEL_GREY = "#6B737C"  # colour of the labels, legible in both themes
INK = "#1B1F24"


@dataclass(frozen=True, eq=False)
class Dots:
    """Hard data to draw on a map."""

    cells: Integers  # shape (n, 2): row and column, row 0 at the south
    colours: list[str]  # colour of the facies of each datum
    wrong: Mask  # shape (n,): True if a datum is not honoured (red ring)


def map_png(indices: Bytes, colours: Sequence[str], *, scale: int = 1) -> bytes:
    """Return a map as a palette PNG with square cells of `scale` pixels."""
    scale = check_int("scale", scale, 1)
    size = indices.shape[1] * scale, indices.shape[0] * scale
    return png_of(_coloured(indices, colours).resize(size, Image.Resampling.NEAREST))


def tile_size(shape: Shape, longest: int) -> tuple[int, int]:
    """Return the width and height in pixels of a map whose longer side has `longest` pixels."""
    ny, nx = shape
    share = longest / max(ny, nx)
    return max(1, round(nx * share)), max(1, round(ny * share))


def contact_sheet(
    indices: Bytes, colours: Sequence[str], *, longest: int = 96
) -> tuple[bytes, int]:
    """Return a PNG that shows realizations, shape (n, ny, nx), as tiles, and its number of columns.

    Realization r is in row r // columns and column r % columns. Here `longest` is the length in
    pixels of the longer side of a tile.
    """
    width, height = tile_size(indices.shape[1:], longest)
    columns = min(len(indices), MAX_SHEET_SIDE // width)
    rows = -(-len(indices) // columns)
    mode = "RGBA" if (indices == UNKNOWN).any() else "RGB"
    sheet = Image.new(mode, (columns * width, rows * height))
    for r, realization in enumerate(indices):
        full = _coloured(realization, colours).convert(mode)
        tile = full.resize((width, height), Image.Resampling.BOX)
        sheet.paste(tile, (r % columns * width, r // columns * height))
    return png_of(sheet), columns


def data_png(
    cells: Integers,
    indices: Integers,
    shape: Shape,
    colours: Sequence[str],
    *,
    longest: int,
) -> bytes:
    """Return hard data as a transparent PNG, with dots in the colours of their `indices`."""
    width, height = tile_size(shape, longest)
    picture = Image.new("RGBA", (width, height))
    pen = ImageDraw.Draw(picture)
    cells = as_integers(cells, "cells")
    indices = as_integers(indices, "indices", 0, len(colours) - 1)
    radius = max(1.0, min(0.02 * longest, 0.2 * (width * height / max(len(cells), 1)) ** 0.5))
    for (row, column), index in zip(cells.tolist(), indices.tolist(), strict=True):
        x = (column + 0.5) / shape[1] * width
        y = height - (row + 0.5) / shape[0] * height
        pen.circle((x, y), radius, fill=str(colours[index]))
    return png_of(picture)


def placement_svg(
    cells: Integers,
    colours: Sequence[str | None],
    shape: Shape,
    wells: Mapping[str, Sequence[int]] | None = None,
) -> str:
    """Return an SVG sketch of hard data inside and outside the outline of a grid.

    `cells`, shape (n, 2), may be outside the grid. A datum without a colour is drawn as a ring.
    `wells` maps the name of each well to the indices of its data, from the top down, which a line
    joins.
    """
    ny, nx = shape
    places = as_integers(cells, "cells").reshape(-1, 2) + 0.5
    low = np.minimum(places.min(axis=0, initial=0), 0)
    high = np.maximum(places.max(axis=0, initial=1), shape)
    scale = _SVG_SIDE / float((high - low).max())
    radius = max(2.5, min(7.0, _SVG_SIDE / 12 / max(len(places), 1) ** 0.5))
    pad = radius + 4

    def position_of(row: float, column: float) -> tuple[float, float]:
        return pad + (column - low[1]) * scale, pad + (high[0] - row) * scale

    width, height = np.maximum((high - low)[::-1] * scale, _SVG_SIDE / 2) + 2 * pad
    left, top = position_of(ny, 0)
    sides = max(nx * scale, 3.0), max(ny * scale, 3.0)  # keep the grid visible
    frame = f'x="{left:.2f}" y="{top:.2f}" width="{sides[0]:.2f}" height="{sides[1]:.2f}"'
    parts = [f'<rect {frame} fill="#8881" stroke="#777" stroke-width="1"/>']
    for (row, column), colour in zip(places.tolist(), colours, strict=True):
        x, y = position_of(row, column)
        look = f'fill="{colour}" stroke="#fff"' if colour else 'fill="none" stroke="#B3402A"'
        circle = f'cx="{x:.2f}" cy="{y:.2f}" r="{radius:.2f}"'
        parts.append(f'<circle {circle} {look} stroke-width="1.5"/>')
    for name, path in (wells or {}).items():
        ends = [position_of(row, column) for row, column in places[list(path)]]
        line = " ".join(f"{x:.2f},{y:.2f}" for x, y in ends)
        parts.append(f'<polyline points="{line}" fill="none" stroke="#777" stroke-width="2"/>')
        place = f'x="{ends[0][0]:.2f}" y="{max(ends[0][1] - radius - 3, 11):.2f}"'
        font = 'font-family="sans-serif" font-size="11" text-anchor="middle" fill="#777"'
        parts.append(f"<text {place} {font}>{escape(name)}</text>")
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.1f} {height:.1f}">'
    return head + "".join(parts) + "</svg>"


_SVG_SIDE = 480  # length in SVG units of the longer side of the sketch


def data_map_png(
    indices: Bytes, colours: Sequence[str], dots: Dots | None = None, *, longest: int = 640
) -> bytes:
    """Return a PNG of a map with hard data; the longer side has about `longest` pixels."""
    scale = max(1, round(longest / max(indices.shape)))
    if dots is None or not len(dots.cells):
        return map_png(indices, colours, scale=scale)
    picture = data_map(indices, colours, dots, scale)
    return png_of(picture.quantize(64, dither=Image.Dither.NONE), optimize=True)


def data_map(indices: Bytes, colours: Sequence[str], dots: Dots | None, scale: int) -> Image.Image:
    """Return a map with cells of `scale` pixels and with hard data; wrong data are drawn last."""
    size = indices.shape[1] * scale, indices.shape[0] * scale
    picture = _coloured(indices, colours).resize(size, Image.Resampling.NEAREST).convert("RGB")
    picture.info.clear()  # unknown cells are white here
    if dots is None or not len(dots.cells):
        return picture
    pen = ImageDraw.Draw(picture)
    height = indices.shape[0]
    radius = max(1.5, min(5.0, 0.18 * (picture.width * picture.height / len(dots.cells)) ** 0.5))
    for k in np.argsort(dots.wrong, kind="stable").tolist():
        row, column = dots.cells[k]
        centre = (column + 0.5) * scale, (height - row - 0.5) * scale
        pen.circle(centre, radius + 1.6, fill=WRONG_COLOUR if dots.wrong[k] else INK)
        pen.circle(centre, radius + 0.8, fill="#FFFFFF")
        pen.circle(centre, radius - 0.4, fill=dots.colours[k])
    return picture


def _coloured(indices: Bytes, colours: Sequence[str]) -> Image.Image:
    """Return a palette picture; unknown cells are transparent, or white without transparency."""
    if indices.dtype != np.uint8:
        indices = as_integers(indices, "indices", 0, len(colours) - 1).astype(np.uint8)
    picture = Image.fromarray(np.ascontiguousarray(indices[::-1]), mode="P")
    palette = [channel for rgb in bytes_of(colours) for channel in rgb]
    if len(colours) <= UNKNOWN and (indices == UNKNOWN).any():
        palette += [255] * (3 * 256 - len(palette))  # Pillow writes no transparency beyond it
        picture.info["transparency"] = UNKNOWN
    picture.putpalette(palette)
    return picture


def png_of(picture: Image.Image, **options: Any) -> bytes:
    """Return a picture as the bytes of a PNG file; `options` are passed to Pillow."""
    stream = BytesIO()
    picture.save(stream, "PNG", **options)
    return stream.getvalue()


class VolumeSlice(NamedTuple):
    """A slice of a volume with a label and hard data."""

    indices: Bytes
    label: str
    dots: Dots


def slices_of(indices: Bytes, dots: Dots | None = None) -> list[VolumeSlice]:
    """Return three slices through the middle of a volume: a layer, and sections along x and y.

    `dots` are hard data with layer, row and column; each slice shows the data inside the slice.
    Raises `CCWSIMError` for a map.
    """
    if indices.ndim != len(CELL_AXES):
        raise CCWSIMError(f"slices need a volume, shape (nz, ny, nx), not {indices.shape}")
    cells, wrong = np.empty((0, len(CELL_AXES)), np.int64), np.empty(0, bool)
    all_dots = Dots(cells, [], wrong) if dots is None else dots
    slices = []
    for axis, (name, n) in enumerate(zip(CELL_AXES, indices.shape, strict=True)):
        k = n // 2
        in_slice = np.flatnonzero(all_dots.cells[:, axis] == k)
        flat = np.delete(all_dots.cells[in_slice], axis, axis=1)
        dots_in_slice = Dots(
            flat, [all_dots.colours[d] for d in in_slice.tolist()], all_dots.wrong[in_slice]
        )
        slices.append(
            VolumeSlice(np.take(indices, k, axis), f"{name} {k} (0 to {n - 1})", dots_in_slice)
        )
    return slices


def slices_png(
    indices: Bytes,
    colours: Sequence[str],
    *,
    dots: Dots | None = None,
    longest: int = 1280,
) -> bytes:
    """Return a PNG, `longest` pixels wide, of labelled slices of a volume, side by side."""
    slices = slices_of(indices, dots)
    scale = max(
        1, round((longest - 2 * SLICE_GAP) / sum(section.indices.shape[1] for section in slices))
    )
    layer, *sections = slices
    maps = [data_map(layer.indices, colours, layer.dots, scale)]
    maps += [_with_wells(section, colours, scale) for section in sections]
    font = ImageFont.load_default(LETTER_SIZE)
    widths = [
        max(slice_picture.width, int(font.getlength(section.label)) + 1)
        for section, slice_picture in zip(slices, maps, strict=True)
    ]
    width = sum(widths) + SLICE_GAP * (len(maps) - 1)
    height = LABEL_HEIGHT + max(slice_picture.height for slice_picture in maps)
    picture = Image.new("RGBA", (width, height))
    pen, left = ImageDraw.Draw(picture), 0
    for section, slice_picture, width in zip(slices, maps, widths, strict=True):
        pen.text((left, 2), section.label, fill=LABEL_GREY, font=font)
        picture.paste(slice_picture, (left, LABEL_HEIGHT))
        left += width + SLICE_GAP
    return png_of(picture, optimize=True)


def _with_wells(section: VolumeSlice, colours: Sequence[str], scale: int) -> Image.Image:
    """Return a section with hard data as framed cells, because discs along a well would overlap."""
    picture = data_map(section.indices, colours, None, scale)
    pen, dots = ImageDraw.Draw(picture), section.dots
    frames = ["#FFFFFF"] * len(dots.cells)
    edges = [WRONG_COLOUR if wrong else INK for wrong in dots.wrong.tolist()]
    for wider, fills in ((2, edges), (1, frames), (0, dots.colours)):
        for (row, column), fill in zip(dots.cells.tolist(), fills, strict=True):
            x, y = column * scale, (section.indices.shape[0] - row - 1) * scale
            far = scale - 1 + wider
            pen.rectangle((x - wider, y - wider, x + far, y + far), fill=fill)
    return picture
