"""The simulation grid and the hard data of a command line."""

from __future__ import annotations

import argparse
from pathlib import Path

from ccwsim import datasets
from ccwsim.cli.values import edges_or_codes, grid_shape
from ccwsim.io import import_hard_data
from ccwsim.io.hard_data.collisions import COLLISION_CHOICES
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.grid import Grid
from ccwsim.model.hard_data import HardData
from ccwsim.model.training_image import TrainingImage

DEFAULT_SHAPE = (256, 256)
READING = {
    "hard_variable": "variable",
    "hard_coordinates": "coordinates",
    "hard_threshold": "threshold",
    "hard_classes": "classes",
    "on_collision": "on_collision",
    "on_outside": "on_outside",
    "on_unknown": "on_unknown",
}
"""Options for reading hard data, and what `import_hard_data` calls them."""


def add_grid_options(parser: argparse.ArgumentParser) -> None:
    """Add the size and the place of the simulation grid."""
    group = parser.add_argument_group("simulation grid")
    group.add_argument(
        "--grid", type=grid_shape, metavar="NXxNY",
        help="cells along x (columns) x cells along y (rows), in the order of a GSLIB header "
        "(default: the grid of bundled hard data, otherwise 256x256)",
    )  # fmt: skip
    group.add_argument(
        "--cell-size", type=float, nargs=2, metavar=("DX", "DY"),
        help="size of a cell in world units (default: 1 1)",
    )  # fmt: skip
    group.add_argument(
        "--origin", type=float, nargs=2, metavar=("X", "Y"),
        help="outer corner of the south-west cell in world units (default: 0 0)",
    )  # fmt: skip


def add_data_options(parser: argparse.ArgumentParser) -> None:
    """Add the hard data and what to do where they are in trouble."""
    group = parser.add_argument_group("hard data")
    group.add_argument(
        "--hard-data", metavar="F",
        help="cells whose facies is known: a file (columns x, y, facies or row, col, facies; "
        "Geo-EAS points; a grid with gaps), or the name of bundled ones: "
        f"{', '.join(datasets.hard_data_names())}",
    )  # fmt: skip
    group.add_argument("--hard-variable", metavar="NAME", help="which column holds the facies")
    group.add_argument(
        "--hard-coordinates", choices=("world", "cells"),
        help="whether two columns of unclear names are x and y, or row and column (from 0)",
    )  # fmt: skip
    group.add_argument(
        "--hard-threshold", type=float, metavar="V",
        help="for continuous values: facies 1 at or above V, as for the training image",
    )  # fmt: skip
    group.add_argument(
        "--hard-classes", type=edges_or_codes, metavar="E1,E2…|codes",
        help="for continuous values: the class edges of the training image",
    )  # fmt: skip
    group.add_argument(
        "--on-collision", choices=COLLISION_CHOICES,
        help="two facies in one cell: stop, drop all data of the cell, keep the facies of most, "
        "or that of the datum nearest to the centre (default: error)",
    )  # fmt: skip
    for name, what in (("outside", "outside the grid"), ("unknown", "of a facies not in the TI")):
        group.add_argument(
            f"--on-{name}", choices=("error", "drop"), help=f"data {what} (default: error)"
        )


def grid_of(options: argparse.Namespace) -> Grid:
    """Return the simulation grid of a command line.

    Raises
    ------
    CCWSIMError
        For sizes that are not positive.

    Examples
    --------
    >>> parser = argparse.ArgumentParser()
    >>> add_grid_options(parser)
    >>> add_data_options(parser)
    >>> grid_of(parser.parse_args(["--grid", "640x480", "--cell-size", "5", "10"]))
    Grid(ny=480, nx=640, cell_size=(5.0, 10.0), origin=(0.0, 0.0))
    """
    shape = options.grid or DEFAULT_SHAPE
    if options.grid is None and options.hard_data in datasets.hard_data_names():
        shape = datasets.hard_data_grid_shape(options.hard_data)
    ny, nx = shape
    return Grid(ny, nx, options.cell_size or (1.0, 1.0), options.origin or (0.0, 0.0))


def hard_data_of(
    options: argparse.Namespace, grid: Grid, training_image: TrainingImage
) -> tuple[HardData, tuple[str, ...]]:
    """Return the hard data of a command line, and what happened while reading, in sentences.

    Raises
    ------
    CCWSIMError
        For a file that is not there or cannot be read, options without data, or troubles that
        no option settles.
    """
    name = options.hard_data
    reading = {own: getattr(options, option) for option, own in READING.items()}
    reading = {key: value for key, value in reading.items() if value is not None}
    bundled = name in datasets.hard_data_names()
    if reading and (name is None or bundled):
        raise CCWSIMError(
            "options for reading hard data need a file of them; give it with --hard-data"
        )
    if name is None:
        return HardData(), ()
    if bundled:
        return datasets.load_hard_data(name), ()
    if not Path(name).exists():
        there = ", ".join(datasets.hard_data_names())
        raise CCWSIMError(f"{name} is neither a file nor the name of bundled hard data ({there})")
    report = import_hard_data(name, grid, training_image, **reading)
    return report.hard_data, report.notes
