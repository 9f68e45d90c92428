"""Pictures (PNG, JPEG, TIFF, GIF, BMP): colours to facies and back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from io import BytesIO

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from ccwsim.io.data_file import DataFile
from ccwsim.io.formats.bare_pictures import bare_picture
from ccwsim.io.formats.classes import Classes, asks_for_codes, classify
from ccwsim.io.formats.colours import (
    MAX_COLOURS,
    colours_for,
    distinct_colours,
    grey_of,
    nearest_colours,
)
from ccwsim.io.limits import check_cells
from ccwsim.model.errors import CCWSIMError

_FORMATS = ("PNG", "JPEG", "TIFF", "GIF", "BMP")
_TAG, _CODES = "Palette", "facies codes"
_NUMBERS = ("I", "F", "I;16", "I;16B", "I;16L", "I;16N")


@dataclass(frozen=True, eq=False)
class Picture:
    """A picture as colours, row 0 at the top as in the file.

    Attributes
    ----------
    name : str
        What to call the file in messages.
    rgb : ndarray of uint8, shape (ny, nx, 3)
        Red, green and blue; transparent parts are shown on white.
    numbers : ndarray of uint8, shape (ny, nx), optional
        What the file stores where it has a palette or is grey.
    says_codes : bool
        Whether the file itself says that these numbers are facies codes.
    """

    name: str
    rgb: NDArray[np.uint8]
    numbers: NDArray[np.uint8] | None
    says_codes: bool = False


def read_picture(content: bytes, name: str) -> Picture | DataFile:
    """Return a picture, or a grid where its pixels are numbers (16 bits and more).

    Raises
    ------
    CCWSIMError
        For a broken picture or one that is too large.

    Examples
    --------
    >>> content = BytesIO()
    >>> Image.new("1", (3, 2)).save(content, "PNG")
    >>> read_picture(content.getvalue(), "a.png").rgb.shape
    (2, 3, 3)
    """
    content = bare_picture(content, name, f"{_TAG}\0{_CODES}".encode())
    try:
        image = Image.open(BytesIO(content), formats=_FORMATS)
    except Image.DecompressionBombError as error:
        raise CCWSIMError(
            f"{name}: more than {2 * (Image.MAX_IMAGE_PIXELS or 0)} pixels; cut a smaller piece"
        ) from error
    except Exception as error:  # Pillow's readers raise a dozen types for broken files
        raise CCWSIMError(f"{name}: the picture cannot be read; save it again as PNG") from error
    check_cells(name, (image.height, image.width))
    try:
        if image.mode in _NUMBERS:
            numbers = np.array(image)[None]
            return DataFile("picture of numbers", name, {"grey": numbers}, south_first=False)
        numbers = np.array(image).astype(np.uint8) if image.mode in ("P", "L", "1") else None
        says_codes = image.mode == "P" and image.info.get(_TAG) == _CODES
        return Picture(name, _on_white(image), numbers, says_codes)
    except Exception as error:
        raise CCWSIMError(f"{name}: the picture is broken; save it again as PNG") from error


def picture_facies(
    picture: Picture, *, threshold: float | None = None, classes: Classes = None
) -> NDArray[np.int64]:
    """Return the facies codes of a picture, shape (ny, nx), row 0 at the top.

    Without classes every colour is a facies, counted from dark to light. `classes="codes"` takes
    the numbers of a palette or the grey values as codes, as do PNGs that this package wrote.
    `classes=n` takes the n main colours; a threshold or a list of edges cuts the grey value (0
    black to 255 white).

    Raises
    ------
    CCWSIMError
        For more colours than facies can be, as blurred (JPEG) or smoothed edges bring.

    Examples
    --------
    >>> rgb = np.array([[[0] * 3, [255] * 3]], np.uint8)
    >>> picture_facies(Picture("a.png", rgb, None)).tolist()
    [[0, 1]]
    """
    if threshold is None and isinstance(classes, (int, np.integer)):
        return nearest_colours(picture.rgb, int(classes))
    if threshold is None and asks_for_codes(classes):
        as_codes = picture.says_codes or classes is not None
        if as_codes and picture.numbers is not None:
            return picture.numbers.astype(np.int64)
        colours, places = distinct_colours(picture.rgb)
        if len(colours) > MAX_COLOURS:
            raise CCWSIMError(
                f"{picture.name} has {len(colours)} colours, as blur or smooth edges make; give "
                "classes= (the number of facies) or a threshold on the grey value (0 to 255)"
            )
        return places.astype(np.int64)
    grey = grey_of(picture.rgb)
    return classify(grey, threshold=threshold, classes=classes, what=picture.name)


def picture_as_bytes(
    indices: NDArray[np.integer],
    n_colours: int,
    colours: Sequence[str] | None = None,
    *,
    are_codes: bool = False,
) -> bytes:
    """Return a palette PNG of indices of shape (ny, nx), row 0 at the south: north is up.

    The palette gets white after the n colours, for what lies between maps. With `are_codes` the
    file says that its numbers are facies codes.

    Raises
    ------
    CCWSIMError
        For an index that has no colour, or a colour that is not written `#rrggbb`.

    Examples
    --------
    >>> picture_as_bytes(np.array([[0, 1]]), 2)[1:4]
    b'PNG'
    """
    if indices.min() < 0 or indices.max() > min(n_colours, 255):
        raise CCWSIMError(f"a picture of {n_colours} colours cannot show {indices.max()}")
    palette = np.vstack([colours_for(n_colours, colours), [[255, 255, 255]]])[:256]
    image = Image.fromarray(np.ascontiguousarray(indices[::-1].astype(np.uint8)))
    image.putpalette(palette.astype(np.uint8).tobytes())
    content = BytesIO()
    said = PngInfo()
    if are_codes:
        said.add_text(_TAG, _CODES)
    image.save(content, "PNG", pnginfo=said)
    return content.getvalue()


def _on_white(image: Image.Image) -> NDArray[np.uint8]:
    if image.mode in ("RGBA", "LA", "PA", "La", "RGBa") or "transparency" in image.info:
        ground = Image.new("RGBA", image.size, "white")
        return np.array(Image.alpha_composite(ground, image.convert("RGBA")).convert("RGB"))
    return np.array(image.convert("RGB"))
