"""Training images from files, and to files."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ccwsim.io.atomic import format_of, write_bytes
from ccwsim.io.data_file import DataFile
from ccwsim.io.formats.classes import Classes, classify
from ccwsim.io.formats.pictures import (
    PICTURE_OF_NUMBERS,
    PictureFile,
    colours_for,
    facies_colours_of,
    grey_of,
    is_grey,
    picture_as_bytes,
    picture_facies,
)
from ccwsim.io.formats.text_grids import grid_as_bytes
from ccwsim.io.limits import check_cells
from ccwsim.io.opening import PathOrFile, open_file
from ccwsim.io.part import Crop, FilePart
from ccwsim.model.errors import CCWSIMError, shown
from ccwsim.model.training_image import TrainingImage

FORMATS = ("npy", "sgems", "gslib", "dat", "png")
"""Formats of training images, by their endings."""

PREFERRED = ("ti", "training_image")
"""Variables that are taken without a question from a file with several."""


def read_training_image(
    path_or_file: PathOrFile,
    *,
    variable: str | None = None,
    up: bool | None = None,
    transpose: bool = False,
    shape: tuple[int, ...] | None = None,
    slice_index: int | None = None,
    crop: Crop = None,
    every: int = 1,
    threshold: float | None = None,
    classes: Classes = None,
    name: str = "",
    volume: bool = False,
    z_up: bool | None = None,
) -> TrainingImage:
    """Return the training image of a file, whatever its format.

    Read are pictures (PNG, JPEG, TIFF, GIF, BMP), SGeMS, MPSLIB, geone and classic GSLIB grids,
    ESRI ASCII grids, tables and matrices in text, VTK ImageData, and NumPy and MATLAB files.

    Raises `CCWSIMError` for a file that cannot be read, or if a choice is needed, which it names.

    Parameters
    ----------
    path_or_file : str, Path or binary file
        Known by its content, not by its name.
    variable : str, optional
        Which variable or array; not needed if there is only one, or one called `ti`.
    up : bool, optional
        True if the first row of the file is the south, False if it is the north. By default as
        the format has it: north first in pictures, ESRI grids and text matrices, else south.
    transpose : bool
        Exchange rows and columns.
    shape : (ny, nx) or (nz, ny, nx), optional
        Needed if the file does not say it (classic GSLIB).
    slice_index : int, optional
        Which slice of a 3-D grid, from 0.
    crop : (row, column, n_rows, n_columns), optional
        The piece to take, by its south-west cell (row 0 in the south) and its size in cells; of
        every layer of a volume.
    every : int
        Only the middle cell of each square of `every` cells a side is taken; layers stay.
    threshold, classes : optional
        For continuous variables, as in `classify`; for pictures as in `picture_facies`.
    name : str
        By default the file's name.
    volume : bool
        Take all layers of a 3-D grid, as a volume, instead of one slice.
    z_up : bool, optional
        For a volume: True if the first layer of the file is the bottom, False if it is the top. By
        default as the format has it: the bottom first, also in arrays of NumPy and MATLAB.

    Examples
    --------
    >>> read_training_image(BytesIO(b"2 2 1\\n1\\nfacies\\n0\\n0\\n0\\n7\\n")).array
    array([[0, 0],
           [0, 7]], dtype=uint8)
    >>> file = BytesIO(b"2 1 3\\n1\\nfacies\\n0\\n1\\n2\\n3\\n4\\n5\\n")
    >>> read_training_image(file, volume=True).shape
    (3, 1, 2)
    """
    if volume and slice_index is not None:
        raise CCWSIMError(
            f"slice_index = {shown(slice_index)} takes one layer and volume=True all; give one"
        )
    part = FilePart.answered({"crop": crop, "every": every})
    file = open_file(path_or_file, part, up=up)
    if isinstance(file, PictureFile):
        if volume:
            raise CCWSIMError(f"{file.name} is a picture, one layer; leave volume out")
        codes = picture_facies(file, threshold=threshold, classes=classes)
        codes = codes if up else codes[::-1]
    else:
        how = {"up": up, "slice_index": slice_index, "volume": volume, "z_up": z_up}
        key, values = _values(file, part, variable=variable, shape=shape, **how)
        unknown = int(np.count_nonzero(~file.known(values)))
        if unknown:
            raise CCWSIMError(
                f"{file.name}: {unknown} of {values.size} cells of {key} have no value; every cell "
                "of a training image must be known, so cut out a piece without gaps (crop=)"
            )
        codes = classify(values, threshold=threshold, classes=classes, what=f"{file.name}, {key}")
    codes = np.swapaxes(codes, -1, -2) if transpose else codes
    return TrainingImage(codes, name=name or Path(file.name).stem)


def read_colours(path_or_file: PathOrFile, **answers: Any) -> dict[int, str]:
    """Return the colours that the facies of a picture have in it; none for a file without colours.

    Parameters
    ----------
    path_or_file, **answers
        Parameters of `read_training_image`, whose errors are raised.

    Returns
    -------
    dict of int to str
        `#rrggbb` by facies code, the median of its pixels; empty for other files and greys.

    Examples
    --------
    >>> read_colours(BytesIO(b"2 1 1\\n1\\nfacies\\n0\\n1\\n"))
    {}
    """
    file = open_file(path_or_file, FilePart.answered(answers), up=answers.get("up"))
    if not isinstance(file, PictureFile) or is_grey(file.rgb):
        return {}
    how = {name: answers.get(name) for name in ("threshold", "classes")}
    codes = picture_facies(file, **how)
    return dict(zip(np.unique(codes).tolist(), facies_colours_of(file, codes), strict=True))


def read_grid(path_or_file: PathOrFile, **answers: Any) -> NDArray[np.float64]:
    """Return the values of a grid before they become facies; the grey values of a picture.

    Parameters
    ----------
    path_or_file, **answers
        Parameters of `read_training_image` that say which cells are read; its errors are raised.

    Returns
    -------
    ndarray, shape (ny, nx) or, for a volume, (nz, ny, nx)
        Row 0 at the south, layer 0 at the bottom, NaN in cells that are not known.

    Examples
    --------
    >>> read_grid(BytesIO(b"2 1 1\\n1\\nporosity\\n0.25\\n-999\\n"))
    array([[0.25,  nan]])
    """
    part = FilePart.answered(answers)
    file = open_file(path_or_file, part, up=answers.get("up"))
    if isinstance(file, PictureFile):
        grey = grey_of(file.rgb)
        return grey if answers.get("up") else grey[::-1]
    how = {name: answers[name] for name in answers if name not in ("crop", "every")}
    _, values = _values(file, part, **how)
    return np.where(file.known(values), values, np.nan).astype(np.float64)


def write_training_image(
    path_or_file: PathOrFile,
    training_image: TrainingImage,
    *,
    format: str | None = None,
    colours: Sequence[str] | None = None,
) -> None:
    """Write a training image as `npy`, `sgems` (also `gslib`, `dat`) or `png`.

    Raises `CCWSIMError` for another format, or a place that cannot be written.

    Parameters
    ----------
    path_or_file : str, Path or binary file
        A path is replaced at once and whole; a file object needs `format`.
    training_image : TrainingImage
        A PNG keeps the codes 0 to 254 as numbers of the palette, others are numbered from 0; it
        holds maps only.
    format : str, optional
        By the ending of the path by default.
    colours : sequence of str, optional
        One `#rrggbb` a facies.

    Examples
    --------
    >>> file = BytesIO()
    >>> write_training_image(file, TrainingImage([[0, 1]], name="t"), format="sgems")
    >>> file.getvalue()
    b'2 1 1\\n1\\nfacies\\n0\\n1\\n'
    """
    kind = format_of(path_or_file, format, FORMATS)
    write_bytes(path_or_file, training_image_as_bytes(training_image, kind, colours=colours))


def training_image_as_bytes(
    training_image: TrainingImage, format: str, *, colours: Sequence[str] | None = None
) -> bytes:
    """Return a training image as the content of a file, for a download; see `write_training_image`.

    Examples
    --------
    >>> training_image_as_bytes(TrainingImage([[0, 1]]), "png")[1:4]
    b'PNG'
    """
    kind = format_of(None, format, FORMATS)
    if kind == "png":
        if training_image.n_dimensions == 3:
            raise CCWSIMError(
                "a PNG holds maps, not volumes: write one layer, TrainingImage(ti.array[k]), or "
                "npy or sgems"
            )
        return _png(training_image, colours)
    if kind != "npy":
        return grid_as_bytes([training_image.array], ["facies"])
    content = BytesIO()
    np.save(content, training_image.array, allow_pickle=False)
    return content.getvalue()


def _values(
    file: DataFile,
    part: FilePart | None,
    *,
    variable: str | None = None,
    shape: tuple[int, ...] | None = None,
    **orientation: Any,
) -> tuple[str, NDArray]:
    key = file.chosen(variable, PREFERRED)
    values = file.oriented(file.grid_of(key, shape), **orientation)
    if part is not None and file.kind != PICTURE_OF_NUMBERS:  # its part came with the pixels
        values = part.of(file.name, values)
        check_cells(file.name, values.shape)
    return key, values


def _png(training_image: TrainingImage, colours: Sequence[str] | None) -> bytes:
    codes = training_image.codes.astype(np.int64)
    if codes[0] < 0 or codes[-1] > 254:
        return picture_as_bytes(training_image.indices, len(codes), colours, are_codes=True)
    palette = ["#ffffff"] * (int(codes[-1]) + 1)
    for code, rgb in zip(codes, colours_for(len(codes), colours), strict=True):
        palette[code] = "#" + rgb.tobytes().hex()
    return picture_as_bytes(training_image.array, len(palette), palette, are_codes=True)
