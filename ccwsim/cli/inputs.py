"""Read the inputs of a run (image, grid, data, parameters, or a project) from a command line."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import Any, NamedTuple

import click

from ccwsim.cli.options import (
    classes,
    code_and_code,
    edges_or_codes,
    in_group,
    name_and_code,
    number_or_each,
    one_or_each,
    piece,
    sizes,
    suggestion,
)
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.grid import Grid
from ccwsim.model.hard_data import HardData
from ccwsim.model.parameters import PER_AXIS, Parameters
from ccwsim.model.training_image import TrainingImage
from ccwsim.sharing.codec import FieldSpec, fields_of

DEFAULT_SHAPE = (256, 256)

PROJECT_HELP = (
    "read training image, grid, hard data, parameters, number of realizations and seed from a "
    "project file (.ccwsim) saved by the dashboard; parameter options, --realizations and --seed "
    "override the values in the project"
)
PARAMETERS_HELP = (
    "read parameters from a JSON file saved by the dashboard; parameter options override them"
)
CELL_HEIGHT_HELP = "height of a cell of a volume in world units (default: 1)"
BOTTOM_HELP = "z at the bottom of a volume (default: 0)"
NAME = {"metavar": "NAME"}
Options = dict[str, tuple[str, dict[str, Any], str]]
"""Option, type of the values and help text, for each argument of a file reader."""
IMAGE_OPTIONS: Options = {
    "variable": ("--variable", NAME, "name of the variable, if the file has several variables"),
    "threshold": (
        "--threshold",
        {"metavar": "V", "type": float},
        "for grey or continuous values: facies 1 at or above V, facies 0 below V",
    ),
    "classes": (
        "--classes",
        {"metavar": "N|E1,E2…|codes", "type": classes},
        "for continuous values: N classes with equal numbers of cells, or the edges of classes; "
        "'codes' reads integers as facies codes, even if there are many",
    ),
    "merge": (
        "--merge",
        {"metavar": "CODE=CODE|none", "type": code_and_code, "multiple": True},
        "facies of the image to merge with another; cells of a facies merged with none take the "
        "facies of the nearest other cell; repeat for each facies",
    ),
    "shape": (
        "--shape",
        {"metavar": "NXxNY[xNZ]", "type": sizes},
        "size of the image, if its file does not contain it (classic GSLIB)",
    ),
    "slice_index": (
        "--slice",
        {"metavar": "N", "type": int},
        "read one slice of a 3-D image as a map; N is the number of the slice, counted from 0",
    ),
    "crop": (
        "--crop",
        {"metavar": "X Y NX NY", "type": int, "nargs": 4, "callback": piece},
        "piece of the image: first column (counted from 0 at the west), first row (counted from 0 "
        "at the south), number of columns, number of rows",
    ),
    "layers": (
        "--layers",
        {"metavar": "Z NZ", "type": int, "nargs": 2},
        "layers of a volume: first layer (counted from 0 at the bottom), number of layers",
    ),
    "every": (
        "--every",
        {"metavar": "N", "type": int},
        "for images that are too large: read only the middle cell of each block of N x N cells",
    ),
    "up": (
        "--up/--no-up",
        {"default": None},
        "whether the first row of the file is in the south (--up) or in the north (--no-up); by "
        "default in the north for pictures, raster maps such as GeoTIFF and ESRI, GRDECL and text "
        "matrices, and in the south for other files",
    ),
    "z_up": (
        "--z-up/--no-z-up",
        {"default": None},
        "whether the first layer of a volume is the bottom (--z-up, the default) or the top "
        "(--no-z-up)",
    ),
    "transpose": ("--transpose", {"is_flag": True}, "exchange rows and columns"),
}
FILES_OF_DATA: Options = {
    "hard_data": (
        "--hard-data",
        {"metavar": "F"},
        "cells of known facies: a file (columns x, y, facies or row, col, facies; Geo-EAS points; "
        "a grid with gaps), or the name of bundled data ('ccwsim datasets' lists them)",
    ),
    "collars": (
        "--collars",
        {"metavar": "F"},
        "a table of well collars (name, x, y, z); --hard-data is then the table of well intervals "
        "(name, from, to, facies)",
    ),
    "surveys": (
        "--surveys",
        {"metavar": "F"},
        "a table of survey stations of deviated wells (name, depth, azimuth, inclination or dip)",
    ),
}
COLUMN_OPTIONS = {
    "x": ("--hard-x", "is x (in --collars, if given)"),
    "y": ("--hard-y", "is y (in --collars, if given)"),
    "z": ("--hard-z", "is z, for a volume (of --collars, if this table is given)"),
    "well": ("--hard-well", "of --hard-data contains the well names, for a volume"),
    "depth_from": ("--hard-from", "is the upper depth of well intervals, for a volume"),
    "depth_to": ("--hard-to", "is the lower depth of well intervals, for a volume"),
    "depth": ("--hard-depth", "is the depth of data in wells; '' for none"),
    "collar_well": ("--collar-well", "of --collars contains the well names"),
    "collar_length": ("--collar-length", "of --collars contains well lengths; '' for none"),
    "survey_well": ("--survey-well", "of --surveys contains the well names"),
    "survey_depth": ("--survey-depth", "of --surveys is the depth along wells"),
    "survey_azimuth": ("--survey-azimuth", "of --surveys is the direction from north, clockwise"),
    "survey_inclination": ("--survey-inclination", "of --surveys is the tilt from straight down"),
    "survey_dip": (
        "--survey-dip",
        "of --surveys is the tilt from the horizontal, negative downwards",
    ),
}
"""Options for the names of columns of hard data; their help starts with "which column"."""
ROW_OPTIONS = {
    "overlap": ("error upper lower drop", "intervals that overlap: keep one whole, or drop both"),
    "no_collar": ("error drop", "wells that have no collar"),
    "bad_row": ("error drop", "rows that cannot be used, such as those without a name or depth"),
    "one_depth": (
        "neighbour drop error",
        "intervals with one depth: take the other from the neighbouring row, or drop them",
    ),
    "no_facies": (
        "drop above error",
        "intervals without facies: drop them, or take the facies of the interval above",
    ),
}
"""Options for rows of tables of wells: the possible values, the default first, and a help text."""
DATA_OPTIONS: Options = {
    **{key: (o, NAME, f"which column {text}") for key, (o, text) in COLUMN_OPTIONS.items()},
    "facies": (
        "--hard-facies",
        NAME,
        "which column, or which variable of a grid, contains the facies (codes, names or values)",
    ),
    "facies_names": (
        "--facies-name",
        {"metavar": "NAME=CODE", "type": name_and_code, "multiple": True},
        "facies code for a name that the training image does not have; repeat for each name",
    ),
    "coordinates": (
        "--hard-coordinates",
        {"type": click.Choice(["world", "cells"])},
        "whether two columns with unclear names are x and y, or row and column (from 0)",
    ),
    "threshold": (
        "--hard-threshold",
        {"metavar": "V", "type": float},
        "for continuous values: facies 1 at or above V, as for the training image",
    ),
    "classes": (
        "--hard-classes",
        {"metavar": "E1,E2…|codes", "type": edges_or_codes},
        "for continuous values: class edges, as for the training image",
    ),
    "on_collision": (
        "--on-collision",
        {"type": click.Choice(["error", "drop", "majority", "nearest"])},
        "if a cell has data of two facies: stop, drop all data of the cell, keep the majority "
        "facies, or keep the facies of the datum nearest to the cell centre (default: error)",
    ),
    "on_outside": (
        "--on-outside",
        {"type": click.Choice(["error", "drop"])},
        "what to do with data outside the grid (default: error)",
    ),
    "on_unknown": (
        "--on-unknown",
        {"type": click.Choice(["error", "drop"])},
        "what to do with data of a facies not in the TI (default: error)",
    ),
    **{
        f"on_{key}": (
            f"--on-{key.replace('_', '-')}",
            {"type": click.Choice(choices.split())},
            f"with --collars: what to do with {text} (default: {choices.split()[0]})",
        )
        for key, (choices, text) in ROW_OPTIONS.items()
    },
}
READING_DATA = {o[2:].replace("-", "_"): name for name, (o, *_) in DATA_OPTIONS.items()}
"""Argument of the hard data reader, for each parameter of the command."""
_OF_GRID = ("grid", "cell_size", "origin", "crs", "cell_height", "bottom")
OF_PROJECT = ("training_image", *_OF_GRID, *IMAGE_OPTIONS, *FILES_OF_DATA, *READING_DATA)
"""Inputs that cannot be given beside --project, because a project contains them."""


class SimulationInputs(NamedTuple):
    """Inputs of a run; `study` contains training image, grid, parameters and hard data."""

    study: tuple[TrainingImage, Grid, Parameters, HardData]
    n_realizations: int
    seed: int
    notes: tuple[str, ...] = ()


def image_and_data_options(command: Any) -> Any:
    """Add the options for the inputs of a simulation."""
    reading, data = in_group("Reading a training image from a file"), in_group("Hard data")
    grid, parameters = in_group("Simulation grid"), in_group("Parameters of the simulation")
    options = [
        click.argument("training_image", metavar="[TI]", required=False),
        in_group("A whole study")("--project", metavar="FILE", help=PROJECT_HELP),
        *(reading(o, name, help=text, **how) for name, (o, how, text) in IMAGE_OPTIONS.items()),
        *(data(o, help=text, **how) for o, how, text in (FILES_OF_DATA | DATA_OPTIONS).values()),
        *(_option(row, grid) for row in fields_of("grid")),
        grid("--cell-height", type=float, metavar="DZ", help=CELL_HEIGHT_HELP),
        grid("--bottom", type=float, metavar="Z", help=BOTTOM_HELP),
        parameters("--parameters", metavar="FILE.json", help=PARAMETERS_HELP),
        *(_option(row, parameters) for row in fields_of("parameters")),
        *(_option(row, in_group("Run")) for row in fields_of("study")),
    ]
    for option in reversed(options):
        command = option(command)
    return command


def _option(row: FieldSpec, option: Any) -> Any:
    name, how = row.fields[0], {"help": row.help, "default": None}
    if row.no_option:
        return option(f"{row.option}/{row.no_option}", name, **how)
    how["metavar"] = row.metavar
    if row.kind == "sizes":
        return option(row.option, type=sizes, **how)
    if row.kind == "lengths":
        return option(row.option, name, type=float, nargs=2, **how)
    kinds = {"count": int, "whole": int, "number": float, "word": str, "crs": str}
    each = {"location_weight": number_or_each, **dict.fromkeys(PER_AXIS, one_or_each)}
    return option(row.option, name, type=each.get(name) or kinds[row.kind], **how)


def inputs_of(options: Any) -> SimulationInputs:
    """Return the inputs of a run, read from a project file or from options."""
    options.transpose = options.transpose or None
    options.facies_name = options.facies_name or None
    if options.project is not None:
        return _of_project(options)
    if options.training_image is None:
        raise CCWSIMError("give a training image (TI), or give a project file with --project")
    image, grid = image_of(options), grid_of(options)
    data, notes = hard_data_of(options, grid, image)
    n = 1 if options.n_realizations is None else options.n_realizations
    study = image, grid, parameters_of(options, Parameters()), data
    return SimulationInputs(study, n, options.seed or 0, notes)


def _of_project(options: Any) -> SimulationInputs:
    from ccwsim.sharing.project import read_project

    both = _given(options, OF_PROJECT)
    if both:
        name = next(iter(both)).replace("_", " ")
        raise CCWSIMError(f"the project {options.project} contains {name}; leave this input out")
    project = read_project(options.project)
    study, n, seed = project.study, options.n_realizations, options.seed
    parameters = parameters_of(options, study.parameters)
    inputs = study.training_image, study.grid, parameters, study.hard_data
    n = project.n_realizations if n is None else n
    return SimulationInputs(inputs, n, study.seed if seed is None else seed)


def _given(options: Any, names: Iterable[str]) -> dict[str, Any]:
    """Return the options that were given, by name."""
    values = {name: getattr(options, name) for name in names}
    return {name: value for name, value in values.items() if value not in (None, ())}


def parameters_of(options: Any, usual: Parameters) -> Parameters:
    """Return the parameters. Options override `--parameters`, which overrides `usual`."""
    if options.parameters is not None:
        from ccwsim.io import parameters_from_json
        from ccwsim.io.opening import read_bytes

        usual = parameters_from_json(read_bytes(options.parameters)[0])
    names = [row.fields[0] for row in fields_of("parameters")]
    return Parameters(**{**asdict(usual), **_given(options, names)})


def image_of(options: Any) -> TrainingImage:
    """Return the training image given in a command line."""
    from ccwsim import datasets
    from ccwsim.io import read_training_image

    name = options.training_image
    reading, bundled = _given(options, IMAGE_OPTIONS), datasets.all_image_names()
    if name in bundled:
        if reading:
            raise CCWSIMError(
                f"{name} is a bundled training image and needs no options for reading; for a file "
                f"of this name write ./{name}"
            )
        return datasets.load(name)
    if not Path(name).exists():
        there = ", ".join(bundled)
        raise CCWSIMError(
            f"{name} is neither a file nor a bundled training image ({there})."
            f"{suggestion(name, bundled)}"
        )
    if options.grid is not None and len(options.grid) == 3:
        reading["volume"] = True
    return read_training_image(name, **reading)


def grid_of(options: Any) -> Grid:
    """Return the simulation grid given in a command line."""
    from ccwsim import datasets

    own = _grid_of_image(options)
    if own is not None:
        return own
    shape = options.grid or DEFAULT_SHAPE
    if options.grid is None and options.hard_data in datasets.all_hard_data_names():
        shape = datasets.hard_data_grid_shape(options.hard_data)
    cell, origin = options.cell_size or (1.0, 1.0), options.origin or (0.0, 0.0)
    height, bottom = options.cell_height, options.bottom
    if len(shape) == 2:
        if height is not None or bottom is not None:
            raise CCWSIMError(
                "--cell-height and --bottom are only for volumes; give --grid three numbers"
            )
        return Grid(shape[-2], shape[-1], cell, origin, crs=options.crs or "")
    cell, origin = (*cell, 1.0 if height is None else height), (*origin, bottom or 0.0)
    return Grid(shape[-2], shape[-1], cell, origin, nz=shape[0], crs=options.crs or "")


def _grid_of_image(options: Any) -> Grid | None:
    """Return the grid of an image file with coordinates, unless options describe the grid."""
    from ccwsim import datasets
    from ccwsim.io import read_geometry

    name = options.training_image
    if _given(options, _OF_GRID) or name in datasets.all_image_names() or options.transpose:
        return None
    return read_geometry(name, **_given(options, IMAGE_OPTIONS))


def hard_data_of(
    options: Any, grid: Grid, image: TrainingImage
) -> tuple[HardData, tuple[str, ...]]:
    """Return the hard data given in a command line, and notes on the import of the data."""
    from ccwsim import datasets
    from ccwsim.io import import_hard_data, import_wells

    name, bundled = options.hard_data, datasets.all_hard_data_names()
    given = _given(options, READING_DATA)
    reading = {READING_DATA[key]: value for key, value in given.items()}
    collars, surveys = options.collars, options.surveys
    if (reading or collars or surveys) and (name is None or name in bundled):
        raise CCWSIMError("options for reading hard data need a file; give a file with --hard-data")
    if name is None:
        return HardData(), ()
    if name in bundled:
        return datasets.load_hard_data(name), ()
    if not Path(name).exists():
        there = ", ".join(bundled)
        raise CCWSIMError(
            f"{name} is neither a file nor the name of bundled hard data ({there})."
            f"{suggestion(name, bundled)}"
        )
    if collars is None and surveys is not None:
        raise CCWSIMError("--surveys needs a table of well collars; give this table with --collars")
    for table, given in (("collars", collars), ("surveys", surveys)):
        columns = [name for name in reading if name.startswith(table[:-1] + "_")]
        if given is None and columns:
            said = columns[0].replace("_", "-")
            raise CCWSIMError(f"--{said} names a column of a table of {table}; give --{table}")
    if collars is None:
        report = import_hard_data(name, grid, image, **reading)
    elif "coordinates" in reading:
        raise CCWSIMError("leave out --hard-coordinates, which cannot be used with --collars")
    else:
        report = import_wells(collars, name, grid, image, surveys=surveys, **reading)
    return report.hard_data, report.notes
