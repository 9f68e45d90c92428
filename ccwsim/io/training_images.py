"""Read and write training images, and guess the arguments that a file leaves open."""

from collections.abc import Mapping, Sequence
from io import BytesIO
from math import isqrt
from pathlib import Path
from typing import Any

import numpy as np

from ccwsim import Grid, TrainingImage
from ccwsim.io.atomic import check_format, format_of, write_bytes
from ccwsim.io.data_file import DataFile
from ccwsim.io.formats import pictures
from ccwsim.io.formats.grdecl import geometry_as_bytes, regions_as_bytes
from ccwsim.io.formats.text_grids import grid_as_bytes
from ccwsim.io.gridding import Crop, FilePart, Layers, as_grid, thinning
from ccwsim.io.limits import TooManyCells
from ccwsim.io.opening import PathOrFile, open_file
from ccwsim.model import (
    Array,
    CCWSIMError,
    Classes,
    Floats,
    Mask,
    Merge,
    Shape,
    are_codes,
    asks_for_codes,
    classify,
    merge_facies,
    refused,
    shown,
    warn,
)

IMAGE_FORMATS = ("npy", "sgems", "gslib", "dat", "grdecl", "png")  # named by file ending

USUAL_NAMES = ("array", "band 1", "grid", "matrix")
"""Names that readers give to the only variable of a file without names."""
PREFERRED_VARIABLES = ("ti", "training_image")  # variables that are preferred if a file has several


def read_training_image(
    path_or_file: PathOrFile,
    *,
    variable: str | None = None,
    up: bool | None = None,
    transpose: bool = False,
    shape: Shape | None = None,
    slice_index: int | None = None,
    crop: Crop = None,
    every: int = 1,
    layers: Layers = None,
    threshold: float | None = None,
    classes: Classes = None,
    merge: Merge = (),
    name: str = "",
    volume: bool = False,
    z_up: bool | None = None,
    numbering: str | None = None,
    continuous: bool = False,
    units: str = "",
) -> TrainingImage:
    """Read a training image from a file of any supported format.

    Formats: pictures (PNG, JPEG, TIFF, GIF, BMP), SGeMS, MPSLIB, geone and classic GSLIB grids,
    ESRI ASCII grids, tables and matrices in text, VTK ImageData, and NumPy and MATLAB files.

    Cells without a value are unknown (`TrainingImage.known`), and a warning gives their number;
    `crop` can cut out a piece without gaps. An error names the argument that is missing.

    Parameters
    ----------
    variable : str, optional
        Name of the variable or array; not needed if a file has only one variable or one named `ti`.
    up : bool, optional
        Whether the first row of the file is the south (True) or the north (False). The default is
        False for pictures, raster maps such as GeoTIFF and ESRI grids, GRDECL and text matrices,
        and True for other formats.
    transpose : bool
        Exchange rows and columns.
    shape : (ny, nx) or (nz, ny, nx), optional
        Shape of the grid; needed if the file does not contain it (classic GSLIB).
    slice_index : int, optional
        Index of the slice of a 3-D grid, from 0.
    crop : (row, column, n_rows, n_columns), optional
        Rectangle to cut from each layer. `row` (from the south) and `column` define the south-west
        cell of the rectangle.
    every : int
        Keep only the middle cell of each square of `every` × `every` cells, in all layers.
    layers : (first, n), optional
        Layers to cut from a 3-D grid: the first layer, counted from 0 at the bottom, and their
        number.
    threshold, classes : optional
        For continuous variables as in `classify`, for pictures as in `picture_facies`.
    merge : mapping, or pairs, of int to int or None
        Facies to merge with others, as in `merge_facies`.
    name : str
        Name of the image; by default, the name of the file.
    volume : bool
        Return all layers of a 3-D grid as a volume instead of one slice.
    z_up : bool, optional
        For a volume: True if the first layer of the file is the bottom, False if it is the top. The
        default is False for GRDECL and for axes of depths or layers in NetCDF files (by name or the
        attribute `positive`), and True otherwise.
    numbering : str, optional
        What the codes are, as in `TrainingImage`; the default is "values" for a threshold or
        classes, "colours" for pictures and palettes without names, and "codes" for other files.
    continuous : bool
        Keep the values as those of a continuous variable with the name of the file's variable or,
        if the file has no such name, with the name of the file.
    units : str
        Units of a continuous variable.

    Examples
    --------
    >>> read_training_image(BytesIO(b"2 2 1\\n1\\nfacies\\n0\\n0\\n0\\n7\\n")).array
    array([[0, 0],
           [0, 7]], dtype=uint8)
    """
    if volume and slice_index is not None:
        raise refused("slice_and_volume", index=shown(slice_index))
    answers = {"crop": crop, "every": every, "layers": layers, "shape": shape, "z_up": z_up}
    answers |= {"variable": variable, "up": up, "slice_index": slice_index, "volume": volume}
    file, key, values = _read(path_or_file, answers)
    name = name or Path(file.name).stem
    if continuous:
        if isinstance(file, pictures.PictureFile) or merge:
            raise refused("continuous_file", name=file.name)
        values = np.where(file.known(values), values, np.nan)
        return TrainingImage.from_array(
            np.swapaxes(values, -1, -2) if transpose else values,
            threshold=threshold,
            classes=classes,
            name=name,
            continuous=True,
            variable=(key in USUAL_NAMES and Path(file.name).stem) or key,
            units=units,
        )
    as_codes = threshold is None and asks_for_codes(classes)
    if isinstance(file, pictures.PictureFile):
        if volume:
            raise CCWSIMError(f"{file.name} is a picture with one layer; leave out volume=")
        note, known_mask = file.unknown_note(), file.opaque
        says_codes = file.says_codes if classes is None else file.numbers is not None
        numbered = "codes" if as_codes and says_codes else "colours"
        codes = pictures.picture_facies(file, threshold=threshold, classes=classes)
        if not up:
            codes, known_mask = codes[::-1], None if known_mask is None else known_mask[::-1]
        names = None
    else:
        note, known_mask, what = (
            file.unknown_note(values),
            file.known(values),
            f"{file.name}, {key}",
        )
        if not known_mask.any():
            raise CCWSIMError(f"{what}: no cell has a value; choose another variable or file")
        valid_values = values if known_mask.all() else values[known_mask]
        valid_values = classify(valid_values, threshold=threshold, classes=classes, what=what)
        numbered = "values" if not as_codes else file.numbering if classes is None else "codes"
        names = file.labels.get(key)
        numbered = "names" if names else numbered
        codes = np.full(known_mask.shape, valid_values.flat[0])
        codes[known_mask] = valid_values.ravel()
    if note:
        warn(f"{file.name}: {note}")
    codes = merge_facies(codes, merge) if merge else codes
    names = [names[code] for code in np.unique(codes)] if names else None
    codes = codes if known_mask is None or known_mask.all() else np.where(known_mask, codes, np.nan)
    codes = np.swapaxes(codes, -1, -2) if transpose else codes
    return TrainingImage(
        codes,
        name=name,
        facies_names=names,
        numbering=numbering or numbered,
    )


def read_colours(path_or_file: PathOrFile, **answers: Any) -> dict[int, str]:
    """Return the colour of each facies in a picture; for other files, return an empty dict.

    Answers are arguments of `read_training_image`. The colour of a facies code is the median colour
    of its pixels, `#rrggbb`. The dict is empty for grey pictures.

    Examples
    --------
    >>> read_colours(BytesIO(b"2 1 1\\n1\\nfacies\\n0\\n1\\n"))
    {}
    """
    file = open_file(path_or_file, FilePart.answered(answers), up=answers.get("up"))
    if not isinstance(file, pictures.PictureFile) or pictures.is_grey(file.rgb):
        return {}
    conversion = {name: answers.get(name) for name in ("threshold", "classes")}
    codes = pictures.picture_facies(file, **conversion)
    return dict(
        zip(np.unique(codes).tolist(), pictures.facies_colours_of(file, codes), strict=True)
    )


def read_geometry(path_or_file: PathOrFile, **answers: Any) -> Grid | None:
    """Return the grid of a training image in world coordinates; None if the file does not state it.

    The grid has the shape, cell size, origin and coordinate system of the image that
    `read_training_image` returns with these answers. It is None for pictures, vertical sections and
    files without cell size.

    Examples
    --------
    >>> read_geometry(BytesIO(b"2 1 1 10 10 1 500 0 0\\n1\\nfacies\\n0\\n1\\n"))
    Grid(ny=1, nx=2, cell_size=(10.0, 10.0), origin=(500.0, 0.0))
    """
    file, key, values = _read(path_or_file, answers)
    if (
        isinstance(file, pictures.PictureFile)
        or not file.geometry.cell_size
        or answers.get("transpose")
    ):
        return None
    is_section = file.variables[key].shape[1:] != values.shape[-2:]
    return None if is_section else file.geometry.grid(values.shape)


def _read(
    path_or_file: PathOrFile, answers: Mapping[str, Any]
) -> tuple[DataFile | pictures.PictureFile, str, Array]:
    """Return a file, and name and values of the variable; of a picture, only the file."""
    part, shape = FilePart.answered(answers), answers.get("shape")
    orientation: dict[str, Any] = {name: answers.get(name) for name in ("up", "z_up")}
    file = open_file(path_or_file, part, shape=shape, **orientation)
    if isinstance(file, pictures.PictureFile):
        return file, "", np.empty(0)
    shape = shape if part is None else None  # a part is a grid already
    file = as_grid(file, shape)
    key = file.chosen(answers.get("variable"), PREFERRED_VARIABLES)
    orientation |= {name: answers.get(name) for name in ("slice_index", "volume")}
    return file, key, file.oriented(file.grid_of(key, shape), **orientation)


def read_grid(path_or_file: PathOrFile, **answers: Any) -> Floats:
    """Return the values of a grid before conversion to facies; for a picture, the grey values.

    Answers are arguments of `read_training_image` that select cells. The result has the shape
    (ny, nx) or, for a volume, (nz, ny, nx), with NaN in unknown cells.

    Examples
    --------
    >>> read_grid(BytesIO(b"2 1 1\\n1\\nporosity\\n0.25\\n-999\\n"))
    array([[0.25,  nan]])
    """
    file, _, values = _read(path_or_file, answers)
    if isinstance(file, pictures.PictureFile):
        file = file.grid()
        values = file.oriented(file.variables["grey"], up=answers.get("up"))
    return np.where(file.known(values), values, np.nan).astype(np.float64)


def write_training_image(
    path_or_file: PathOrFile,
    training_image: TrainingImage,
    *,
    format: str | None = None,
    colours: Sequence[str] | None = None,
) -> None:
    """Write a training image as `npy`, `sgems` (also `gslib`, `dat`), `grdecl` or `png`.

    Only maps can be written as PNG. In a PNG, codes from 0 to 254 are indices of the palette; if a
    code is outside this range, all codes are renumbered from 0.

    Examples
    --------
    >>> file = BytesIO()
    >>> write_training_image(file, TrainingImage([[0, 1]], name="t"), format="sgems")
    >>> file.getvalue()
    b'2 1 1\\n1\\nfacies\\n0\\n1\\n'
    """
    kind = format_of(path_or_file, format, IMAGE_FORMATS)
    write_bytes(path_or_file, training_image_as_bytes(training_image, kind, colours=colours))


def training_image_as_bytes(
    training_image: TrainingImage, format: str, *, colours: Sequence[str] | None = None
) -> bytes:
    """Return the file content that `write_training_image` writes, for a download."""
    kind = format_of(None, format, IMAGE_FORMATS)
    check_format(kind, (1, *training_image.shape), bool(training_image.values))
    if kind == "png":
        return _png(training_image, colours)
    if kind == "grdecl":
        regions = {"FIPNUM": training_image.indices}
        geometry = geometry_as_bytes(Grid.of(training_image.shape), training_image.known)
        return geometry + regions_as_bytes(regions, training_image)
    name, array = next(iter(training_image.values.items()), ("facies", training_image.array))
    if kind != "npy":
        return grid_as_bytes([array], [name])
    content = BytesIO()
    np.save(content, array, allow_pickle=False)
    return content.getvalue()


def _png(training_image: TrainingImage, colours: Sequence[str] | None) -> bytes:
    codes = training_image.codes.astype(np.int64)
    if codes[0] < 0 or codes[-1] > 254:
        return pictures.picture_as_bytes(
            np.minimum(training_image.indices, len(codes)), len(codes), colours, are_codes=True
        )
    palette = ["#ffffff"] * (int(codes[-1]) + 1)
    for code, rgb in zip(codes, pictures.colours_for(len(codes), colours), strict=True):
        palette[code] = "#" + rgb.tobytes().hex()
    return pictures.picture_as_bytes(
        np.nan_to_num(training_image.array, nan=len(palette)), len(palette), palette, are_codes=True
    )


CONVERSIONS = ("threshold", "classes", "continuous")
"""Arguments of `read_training_image` that say what values mean."""
QUESTIONS = {
    "part": ("every", "crop", "layers"),
    "variable": ("variable",),
    "shape": ("shape",),
    "slice": ("volume", "slice_index", "z_up"),
    "up": ("up",),
    "gaps": ("crop",),
    "values": ("threshold", "classes", "merge", "continuous", "units"),
}
"""Arguments of `read_training_image` that answer each question; later ones depend on earlier."""


def guess_answers(
    path_or_file: PathOrFile, answers: Mapping[str, Any] | None = None
) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Guess the arguments needed to read a file as a training image, and list open questions.

    `answers` contains known arguments of `read_training_image`. They are returned unchanged, with
    guesses for open questions: the first variable with codes, all layers of a volume (with
    `volume=False` the middle slice), the shape nearest to a square, the smallest `every` that keeps
    a picture within the limit, the threshold of Otsu (1979) for grey values, and one class per main
    colour of a picture. The second result has the keys of `QUESTIONS` that apply to this file,
    whether answered or not. Raises `CCWSIMError` for answers that do not fit the file.

    Examples
    --------
    >>> from io import BytesIO
    >>> guess_answers(BytesIO(b"2 2 1\\n1\\nporosity\\n0.1\\n0.12\\n0.3\\n0.31\\n"))
    ({'threshold': 0.21}, ('values',))
    """
    guesses, asked = dict(answers or {}), []
    try:
        file, part = open_file(path_or_file), None
    except TooManyCells as error:
        asked.append("part")
        shape, copies = error.grid()
        if (
            "every" not in guesses
        ):  # the smallest value that keeps the part within the limit of cells
            _, sides = FilePart.of_answers(guesses).box("the grid", shape)
            guesses["every"] = thinning(sides, copies)
        part = FilePart.of_answers(guesses)
        reading = {name: guesses.get(name) for name in ("shape", "up", "z_up")}
        file = open_file(path_or_file, part, **reading)
    if isinstance(file, pictures.PictureFile):
        if file.opaque is not None and "part" not in asked:
            _ask_gaps(file.name, file.opaque, asked)
            file = open_file(path_or_file, FilePart.answered(guesses), up=guesses.get("up"))
            assert isinstance(file, pictures.PictureFile)
        if (
            not file.says_codes
            and len(pictures.distinct_colours(file.rgb)[0]) > pictures.MAX_COLOURS
        ):
            asked.append("values")
            if not set(CONVERSIONS) & set(guesses):
                if pictures.is_grey(file.rgb, percent=99.0):
                    guesses["threshold"] = otsu(pictures.grey_of(file.rgb))
                else:
                    guesses["classes"] = max(2, len(pictures.main_colours(file.rgb)))
        return guesses, tuple(asked)
    file = file if part else as_grid(file, guesses.get("shape"))
    values = _layer(file, guesses, asked)
    asked += ["up"] if file.asks_up else []
    _ask_gaps(file.name, file.known(values), asked)
    taken = values if part else FilePart(guesses.get("crop")).of(file.name, values)
    taken = taken[file.known(taken)]
    if taken.size and not are_codes(taken):
        asked.append("values")
        if not set(CONVERSIONS) & set(guesses):
            guesses["threshold"] = otsu(taken)
    return guesses, tuple(asked)


def _layer(file: DataFile, guesses: dict[str, Any], asked: list[str]) -> Array:
    """Guess variable, shape and layers (all without a slice); return values, row 0 at the south."""
    names = list(file.variables)
    liked = [name for name in names if name.lower() in PREFERRED_VARIABLES]
    if len(names) > 1 and len(liked) != 1:
        asked.append("variable")
        guesses.setdefault("variable", _likely_facies(file))
    key = file.chosen(guesses.get("variable"), PREFERRED_VARIABLES)
    if file.is_table:
        asked.append("shape")
        n = len(file.variables[key])
        ny = next(k for k in range(isqrt(n), 0, -1) if n % k == 0)  # the shape nearest to a square
        guesses.setdefault("shape", (ny, n // ny))
    grid = file.grid_of(key, guesses.get("shape"))
    if len(grid) > 1 and 1 not in grid.shape[1:]:
        asked.append("slice")
        if guesses.get("volume", "slice_index" not in guesses):
            guesses["volume"] = True
            return file.oriented(grid, up=guesses.get("up"), volume=True)
        guesses.setdefault("slice_index", len(grid) // 2)
    return file.oriented(grid, up=guesses.get("up"), slice_index=guesses.get("slice_index"))


def _ask_gaps(name: str, known_mask: Mask, asked: list[str]) -> None:
    """Ask whether to cut out a piece without unknown cells, if there are such cells."""
    if known_mask.all() or "part" in asked:
        return
    if not known_mask.any():
        raise CCWSIMError(f"{name}: no cell has a value; choose another variable or slice")
    asked.append("gaps")


def _likely_facies(file: DataFile) -> str:
    """Return the first variable with facies codes; if there is none, the first variable."""
    for name, values in file.variables.items():
        valid_values = values[file.known(values)]
        if (
            valid_values.size
            and are_codes(valid_values)
            and valid_values.min() != valid_values.max()
        ):
            return name
    return next(iter(file.variables))


def otsu(values: Array) -> float:
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
