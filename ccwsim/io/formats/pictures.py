"""Convert pictures (PNG, JPEG, TIFF, GIF, BMP) to facies, and facies to pictures."""

import colorsys
import re
from collections.abc import Sequence
from dataclasses import dataclass
from io import BytesIO
from math import ceil, sqrt

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageOps, PngImagePlugin
from PIL.PngImagePlugin import PngInfo

from ccwsim.io.data_file import DataFile, broken
from ccwsim.io.gridding import FilePart
from ccwsim.io.limits import MIB, check_cells
from ccwsim.model import (
    Array,
    Bytes,
    CCWSIMError,
    Classes,
    Floats,
    Int32s,
    Integers,
    Ints,
    Mask,
    asks_for_codes,
    classify,
    refused,
    shown,
)

MAX_SHEET_PIXELS = 50_000_000  # pixels in a sheet of maps; many viewers reject larger pictures
SHEET_GAP = 4  # width of the white gap between the maps of a sheet, in cells
_FORMATS = ("PNG", "JPEG", "TIFF", "GIF", "BMP")
PICTURE_OF_NUMBERS = "picture of numbers"
_TAG, _CODES = "Palette", "facies codes"
# long remarks in a PNG do no harm: uploads are read with bounded memory
PngImagePlugin.MAX_TEXT_CHUNK = PngImagePlugin.MAX_TEXT_MEMORY = 1024 * MIB
_ORIENTATION = 0x0112  # number of the EXIF tag of the camera's orientation
_NUMBER_MODES = ("I", "F", "I;16", "I;16B", "I;16L", "I;16N")


@dataclass(frozen=True, eq=False)
class PictureFile:
    """The colours of a picture, row 0 at the top as in the file."""

    name: str
    rgb: Bytes  # shape (ny, nx, 3); transparent parts are shown on white
    numbers: Bytes | None  # shape (ny, nx): palette indices or grey values
    says_codes: bool = False  # whether the file marks `numbers` as facies codes
    opaque: Mask | None = None  # shape (ny, nx); False in transparent pixels, if any

    def unknown_note(self) -> str:
        """Return a sentence about the transparent pixels; empty if there is none."""
        if self.opaque is None:
            return ""
        n = np.count_nonzero(~self.opaque)
        return f"{n} of {self.opaque.size} pixels are transparent, which means unknown"

    def grid(self) -> DataFile:
        """Return the grey values as a grid; transparent pixels are NaN."""
        grey = np.where(True if self.opaque is None else self.opaque, grey_of(self.rgb), np.nan)
        return DataFile("picture", self.name, {"grey": grey[None]}, south_first=False)


def read_picture(
    content: bytes, name: str, part: FilePart | None = None, *, up: bool | None = None
) -> PictureFile | DataFile:
    """Read a picture, or a grid if its pixels are numbers of 16 bits or more."""
    picture = _opened_picture(content, name)
    check_cells(name, (picture.height, picture.width))
    with broken(f"{name}: the picture is broken; save it again"):
        if part is not None:
            picture = _part_of(picture, part, name, up)
        if picture.mode in _NUMBER_MODES:
            numbers = np.array(picture)[None]
            return DataFile(PICTURE_OF_NUMBERS, name, {"grey": numbers}, south_first=False)
        numbers = np.array(picture).astype(np.uint8) if picture.mode in ("P", "L", "1") else None
        says_codes = picture.mode == "P" and picture.info.get(_TAG) == _CODES
        rgb, opaque = _on_white(picture)
        return PictureFile(name, rgb, numbers, says_codes, opaque)


def picture_facies(
    picture: PictureFile, *, threshold: float | None = None, classes: Classes = None
) -> Ints:
    """Return the facies codes of a picture, shape (ny, nx), row 0 at the top.

    Without classes, every colour is a facies, from dark to light. `classes="codes"` uses palette
    indices or grey values, `classes=n` the n main colours; a threshold or edges divide grey values.
    """
    if threshold is None and isinstance(classes, (int, np.integer)):
        return nearest_colours(picture.rgb, int(classes))
    if threshold is None and asks_for_codes(classes):
        as_codes = picture.says_codes or classes is not None
        if as_codes and picture.numbers is not None:
            return picture.numbers.astype(np.int64)
        colours, places = distinct_colours(picture.rgb, picture.opaque)
        if len(colours) > MAX_COLOURS:
            raise refused("too_many_colours", name=picture.name, n=len(colours))
        return places.astype(np.int64)
    grey = grey_of(picture.rgb)
    return classify(grey, threshold=threshold, classes=classes, what=picture.name)


def sheet_layout(n: int, ny: int, nx: int) -> tuple[int, int]:
    """Return rows and columns of a sheet of n maps; raise an error if it is too large."""
    columns = min(n, max(1, ceil(sqrt(n * ny / nx))))
    rows = ceil(n / columns)
    height, width = rows * (ny + SHEET_GAP), columns * (nx + SHEET_GAP)
    if height * width > MAX_SHEET_PIXELS or max(height, width) > 65_000:
        raise CCWSIMError(f"a picture of {n} realizations is too large; write fewer, or an npz")
    return rows, columns


def picture_as_bytes(
    indices: Integers,
    n_colours: int,
    colours: Sequence[str] | None = None,
    *,
    are_codes: bool = False,
) -> bytes:
    """Return a palette PNG (north up) of colour indices; white follows the colours for gaps.

    In a picture of codes, gaps are transparent, which means unknown.
    """
    if indices.min() < 0 or indices.max() > min(n_colours, 255):
        raise CCWSIMError(f"a picture of {n_colours} colours cannot show colour {indices.max()}")
    palette = np.vstack([colours_for(n_colours, colours), [[255, 255, 255]]])[:256]
    picture = Image.fromarray(np.ascontiguousarray(indices[::-1].astype(np.uint8)))
    picture.putpalette(palette.astype(np.uint8).tobytes())
    content = BytesIO()
    info = PngInfo()
    if are_codes:
        info.add_text(_TAG, _CODES)
    gap = n_colours if indices.max() == n_colours else None
    picture.save(content, "PNG", pnginfo=info, transparency=gap if are_codes else None)
    return content.getvalue()


def _opened_picture(content: bytes, name: str) -> Image.Image:
    too_large = f"{name}: more than {2 * (Image.MAX_IMAGE_PIXELS or 0)} pixels; cut a smaller piece"
    with (
        broken(f"{name}: the picture cannot be read; save it again, as PNG or TIFF"),
        broken(too_large, Image.DecompressionBombError),
    ):
        picture = Image.open(BytesIO(content), formats=_FORMATS)
        if (n := getattr(picture, "n_frames", 1)) > 1:
            raise refused("several_frames", name=name, n=n)
        turned = picture.getexif().get(_ORIENTATION, 1) > 1
        return ImageOps.exif_transpose(picture) if turned else picture


def _part_of(picture: Image.Image, part: FilePart, name: str, up: bool | None) -> Image.Image:
    """Return the pixels of a part; keep the palette and the transparency."""
    (row, column), (ny, nx) = part.box(name, (picture.height, picture.width))
    top = row if up else picture.height - row - ny
    size = nx // part.every, ny // part.every
    return picture.resize(size, Image.Resampling.NEAREST, (column, top, column + nx, top + ny))


def _on_white(picture: Image.Image) -> tuple[Bytes, Mask | None]:
    """Return the colours of a picture on white, and a mask of pixels that are not transparent."""
    if picture.mode in ("RGBA", "LA", "PA", "La", "RGBa") or "transparency" in picture.info:
        ground, picture = Image.new("RGBA", picture.size, "white"), picture.convert("RGBA")
        opaque = np.array(picture.getchannel("A")) > 0
        rgb = np.array(Image.alpha_composite(ground, picture).convert("RGB"))
        return rgb, None if opaque.all() else opaque
    return np.array(picture.convert("RGB")), None


MAX_COLOURS = 16  # maximum number of colours that count as facies; more indicate blur or shading

# maximum difference between red, green and blue for a colour to count as grey
MAX_GREY_DIFFERENCE = 24

DEFAULT_COLOURS = ("#1f3f77", "#f0a830", "#2f8f5b", "#a63d2f", "#7d5ba6", "#8a8f98")
"""Default colours of facies, in the order of the codes: blue, amber, green, brick, violet, grey."""


def colours_for(n: int, colours: Sequence[str] | None = None) -> Bytes:
    """Return n colours as red, green and blue, shape (n, 3)."""
    rgb = [_rgb(colour) for colour in list(DEFAULT_COLOURS if colours is None else colours)[:n]]
    for k in range(len(rgb), n):
        hue = (k * 0.618034) % 1.0
        rgb.append(
            tuple(round(255 * c) for c in colorsys.hsv_to_rgb(hue, 0.6, 0.5 + 0.1 * (k % 5)))
        )
    return np.array(rgb, dtype=np.uint8).reshape(n, 3)


def grey_of(rgb: Bytes) -> Floats:
    """Return the luminance (ITU-R 601) of each colour, from 0 (black) to 255 (white)."""
    weights = np.array([0.299, 0.587, 0.114])
    return np.rint(rgb @ weights * 1000) / 1000


def is_grey(rgb: Bytes, percent: float = 100.0) -> bool:
    """Return whether at least `percent` % of the cells are grey."""
    return bool(
        np.percentile(np.ptp(rgb.astype(np.int16), axis=-1), percent) <= MAX_GREY_DIFFERENCE
    )


def distinct_colours(rgb: Bytes, counted: Mask | None = None) -> tuple[Bytes, Int32s]:
    """Return the colours of `counted` cells from dark to light, and each cell's colour index."""
    packed = _packed_rgb(rgb, 8)
    occurs = np.zeros(1 << 24, bool)
    occurs[packed if counted is None else packed[counted]] = True
    present = np.flatnonzero(occurs)
    colours = np.stack([present >> 16, present >> 8, present], axis=1).astype(np.uint8)
    order = np.lexsort((present, grey_of(colours)))
    rank = np.zeros(1 << 24, np.int32)
    rank[present[order]] = np.arange(len(order))
    return colours[order], rank[packed]


SHARE_OF_MAIN, APART = 0.02, 72.0
"""Minimum share of pixels of a main colour; minimum distance (0 to 255) between main colours."""


def main_colours(rgb: Bytes) -> Floats:
    """Return frequent colours that differ clearly from each other, shape (n, 3)."""
    counts = np.bincount(_packed_rgb(rgb >> 4, 4).ravel(), minlength=1 << 12)
    order = np.argsort(-counts, kind="stable")
    points = np.stack([order >> 8, order >> 4, order], axis=1) % 16 * 16.0 + 8.0
    main = np.empty((0, 3))
    for colour, count in zip(points, counts[order], strict=True):
        if count < SHARE_OF_MAIN * counts.sum() or len(main) == MAX_COLOURS:
            break
        if not len(main) or np.linalg.norm(main - colour, axis=1).min() > APART:
            main = np.vstack([main, colour])
    return main


def few_colours(picture: PictureFile, most: int = 200) -> tuple[Bytes, list[str]]:
    """Reduce a picture to a few colours for display; return their indices and `#rrggbb` codes."""
    small = Image.fromarray(picture.rgb).quantize(most, dither=Image.Dither.NONE)
    palette = bytes(small.getpalette() or b"")
    return np.array(small), [f"#{palette[k : k + 3].hex()}" for k in range(0, len(palette), 3)]


def facies_colours_of(picture: PictureFile, codes: Ints) -> list[str]:
    """Return the median colour of each facies of a picture, in the order of the codes."""
    order = np.argsort(codes, axis=None, kind="stable")
    _, starts = np.unique(codes.ravel()[order], return_index=True)
    of_facies = np.split(picture.rgb.reshape(-1, 3)[order], starts[1:])
    return ["#" + np.median(rgb, axis=0).astype(np.uint8).tobytes().hex() for rgb in of_facies]


def nearest_colours(rgb: Bytes, n: int) -> Ints:
    """Return the facies of a picture reduced to n colours, from dark to light, by k-means."""
    if not 2 <= n <= MAX_COLOURS:
        raise CCWSIMError(f"classes = {shown(n)} must be from 2 to {MAX_COLOURS} for a picture")
    coarse = _packed_rgb(rgb >> 3, 5)
    counts = np.bincount(coarse.ravel(), minlength=1 << 15)
    bins = np.flatnonzero(counts)
    if len(bins) < n:
        raise CCWSIMError(f"the picture has only {len(bins)} clearly different colours, not {n}")
    points = np.stack([bins >> 10, bins >> 5, bins], axis=1) % 32 * 8.0 + 4.0
    label = _k_means(points, counts[bins].astype(np.float64), n)
    of_bin = np.zeros(1 << 15, np.int64)
    of_bin[bins] = label
    return of_bin[coarse]


def _packed_rgb(rgb: Integers, bits: int) -> Int32s:
    """Return red, green and blue packed into one number."""
    red, green, blue = np.moveaxis(rgb.astype(np.int32), -1, 0)
    return red << 2 * bits | green << bits | blue


def _k_means(points: Array, weights: Array, n: int) -> NDArray[np.intp]:
    centres = points[[weights.argmax()]]
    while len(centres) < n:
        far = ((points[:, None] - centres) ** 2).sum(axis=2).min(axis=1)
        centres = np.vstack([centres, points[(far * weights).argmax()]])
    label = np.zeros(len(points), np.intp)
    for _ in range(20):
        label = ((points[:, None] - centres) ** 2).sum(axis=2).argmin(axis=1)
        for k in range(n):
            mine = label == k
            if mine.any():
                centres[k] = np.average(points[mine], axis=0, weights=weights[mine])
    rank = np.empty(n, np.intp)
    rank[np.argsort(centres @ [0.299, 0.587, 0.114], kind="stable")] = np.arange(n)
    return rank[label]


def _rgb(colour: str) -> tuple[int, ...]:
    digits = str(colour).removeprefix("#")
    if not re.fullmatch("[0-9a-fA-F]{6}", digits):
        raise CCWSIMError(f"{shown(colour)} is not a colour; write it as #rrggbb")
    return tuple(bytes.fromhex(digits))
