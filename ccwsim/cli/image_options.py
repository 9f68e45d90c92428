"""The training image of a command line: a bundled one or a file."""

from __future__ import annotations

import argparse
from pathlib import Path

from ccwsim import datasets
from ccwsim.cli.values import classes, sizes
from ccwsim.io import read_training_image
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.training_image import TrainingImage

NORTH, SOUTH = "north", "south"


def add_image_options(parser: argparse.ArgumentParser) -> None:
    """Add the training image and how to read it."""
    parser.add_argument(
        "training_image", metavar="TI", nargs="?",
        help="the training image: a file (picture, SGeMS, GSLIB, ESRI, CSV, NumPy, MATLAB), or "
        f"the name of a bundled one: {', '.join(datasets.names())}",
    )  # fmt: skip
    group = parser.add_argument_group("reading the training image, where it is a file")
    group.add_argument("--variable", metavar="NAME", help="which of several variables")
    group.add_argument(
        "--threshold", type=float, metavar="V",
        help="for grey or continuous values: facies 1 at or above V, 0 below",
    )  # fmt: skip
    group.add_argument(
        "--classes", type=classes, metavar="N|E1,E2…|codes",
        help="for continuous values: N classes of equally many cells, or classes between these "
        "edges; 'codes' takes many whole numbers as facies codes",
    )  # fmt: skip
    group.add_argument(
        "--shape", type=sizes, metavar="NXxNY[xNZ]",
        help="columns x rows of the image, where its file does not say them (classic GSLIB)",
    )  # fmt: skip
    group.add_argument(
        "--slice", type=int, dest="slice_index", metavar="N",
        help="which slice of a 3-D image, from 0",
    )  # fmt: skip
    group.add_argument(
        "--first-row", choices=(NORTH, SOUTH),
        help="where the first row of the file lies (default: as its format has it: north in "
        "pictures and matrices, south in GSLIB and NumPy files)",
    )  # fmt: skip
    group.add_argument(
        "--transpose", action="store_true", default=None, help="exchange rows and columns"
    )


def image_of(options: argparse.Namespace) -> TrainingImage:
    """Return the training image of a command line.

    Raises
    ------
    CCWSIMError
        For a file that is not there or cannot be read, and reading options for a bundled image.

    Examples
    --------
    >>> parser = argparse.ArgumentParser()
    >>> add_image_options(parser)
    >>> image_of(parser.parse_args(["channels"]))
    TrainingImage('channels', 256 × 256, 2 facies)
    """
    name = options.training_image
    reading = {
        "variable": options.variable,
        "threshold": options.threshold,
        "classes": options.classes,
        "shape": options.shape,
        "slice_index": options.slice_index,
        "up": None if options.first_row is None else options.first_row == SOUTH,
        "transpose": options.transpose,
    }
    reading = {key: value for key, value in reading.items() if value is not None}
    if name in datasets.names():
        if reading:
            raise CCWSIMError(
                f"{name} is a bundled training image and needs no options for reading; "
                f"for a file of that name write ./{name}"
            )
        return datasets.load(name)
    if not Path(name).exists():
        there = ", ".join(datasets.names())
        raise CCWSIMError(f"{name} is neither a file nor a bundled training image ({there})")
    return read_training_image(name, **reading)
