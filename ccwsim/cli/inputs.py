"""Read the inputs of a run (image, grid, data, parameters, or a project) from a command line."""

import csv
import re
import sys
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from functools import cache, reduce
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

import click

from ccwsim import Auxiliary, CCWSIMError, Grid, HardData, Parameters, Secondary, TrainingImage
from ccwsim.cli import options as types
from ccwsim.cli.options import GroupedOption, suggestion
from ccwsim.model import PARAMETER_CHOICES, PER_AXIS, parameter_table, refused, shown
from ccwsim.sharing.codec import fields_of

DEFAULT_SHAPE = (256, 256)
MAX_DIAGNOSED = 1_000_000  # maximum number of cells of an image on which advice is printed
OPTION_KINDS: dict[str, dict[str, Any]] = {
    "text": {},
    "number": {"type": float},
    "whole number": {"type": int},
    "two whole numbers": {"type": int, "nargs": 2},
    "two numbers": {"type": float, "nargs": 2},
    "number per axis": {"type": types.number_or_each},
    "whole number per axis": {"type": types.one_or_each},
    "flag": {"is_flag": True},
    "yes or no": {"default": None},
    "sizes": {"type": types.sizes},
    "classes": {"type": types.classes},
    "edges": {"type": types.edges_or_codes},
    "piece": {"type": int, "nargs": 4, "callback": types.piece},
    "codes": {"type": types.code_and_code, "multiple": True},
    "file": {},
    "input": {"shell_complete": types.complete_input},
    "inputs": {"shell_complete": types.complete_input, "multiple": True},
    "files": {"multiple": True},
    "pairs of files": {"nargs": 2, "multiple": True},
    "needed file": {"required": True},
    "needed files": {"multiple": True, "required": True},
    "ratio": {"type": float, "default": 1.0},
    "facies and number": {"type": types.facies_and_number, "multiple": True},
    "name and facies": {"type": types.name_and_facies, "multiple": True},
}
"""Arguments of `click.option`, by the kind of value in the table of options."""
OPTION_EXAMPLES = {
    "template_size": "32x32x16 (along z from 1)",
    "overlap_size": "8x8x4 (along z from 0)",
    "wavelet_level": "2x2x1",
    "location_weight": "0x0x0.5 for a vertical trend only",
}
"""Examples of parameters that have one number for each axis of a volume."""


class OptionRow(NamedTuple):
    """A row of the table `options.csv`, or the option of a parameter."""

    group: str
    argument: str  # argument of the file reader
    option: str
    metavar: str
    kind: str  # one of `OPTION_KINDS`, or the allowed words, separated by "|"
    help: str

    @property
    def name(self) -> str:
        """Parameter of the command that the option sets."""
        return self.option[2:].replace("-", "_") if self.group == "data" else self.argument


def _parameter_rows() -> list[OptionRow]:
    """Return a row for each parameter; its help text has the meaning, range and default."""
    rows = []
    for spec, row in zip(fields_of("parameters"), parameter_table(), strict=True):
        name, option, allowed = row["name"], spec.option, f"{row['allowed']}; "
        usual = {"True": "yes", "False": "no"}.get(row["default"], row["default"])
        kind, metavar = {
            "choice": ("yes or no", ""),
            "number": ("number", "SHARE"),
            "whole": ("whole number", row["symbol"] or "N"),
            "word": ("text", "|".join(PARAMETER_CHOICES.get(name, ()))),
        }[spec.kind]
        if spec.no_option:
            option, allowed = f"{option}/{spec.no_option}", ""
        text = f"{row['meaning']} ({allowed}default: {usual})"
        if name in OPTION_EXAMPLES:
            kind += " per axis"
            text += f"; for a volume, one number or three, such as {OPTION_EXAMPLES[name]}"
        rows.append(OptionRow("parameters", name, option, metavar=metavar, kind=kind, help=text))
    return rows


_TEXT = Path(__file__).with_name("options.csv").read_text("utf-8")
_TABLE = [OptionRow(**row) for row in csv.DictReader(_TEXT.splitlines())] + _parameter_rows()


def _rows(groups: Sequence[str]) -> list[OptionRow]:
    return [row for row in _TABLE if row.group in groups]


IMAGE_ARGUMENTS = [row.argument for row in _rows(["image"])]
READING_DATA = {row.name: row.argument for row in _rows(["data"])}
"""Argument of the hard data reader, for each parameter of the command."""
_OF_GRID = [row.name for row in _rows(["grid"])]
_READ = [row.name for row in _rows(["image", "files", "data", "guides"]) if row.kind != "ratio"]
OF_PROJECT = ("training_image", *_OF_GRID, *_READ)
"""Inputs that cannot be given beside --project, because a project contains them."""


class SimulationInputs(NamedTuple):
    """Inputs of a run, as in `ccwsim.simulate`."""

    training_image: TrainingImage
    grid: Grid
    parameters: Parameters
    hard_data: HardData
    n_realizations: int
    seed: int
    notes: tuple[str, ...] = ()
    secondary: Secondary | None = None


def image_and_data_options(command: Any) -> Any:
    """Add the options for the inputs of a simulation."""
    groups = {
        "A whole study": ["project"],
        "Reading a training image from a file": ["image"],
        "Hard data": ["files", "data"],
        "Simulation grid": ["grid"],
        "Guides": ["guides"],
        "Parameters of the simulation": ["parameters"],
        "Run": ["run"],
    }
    argument = click.argument(
        "training_image", metavar="[TI]", required=False, **OPTION_KINDS["input"]
    )
    return argument(options_in(groups)(command))


def options_in(groups: dict[str, list[str]]) -> Callable[[Any], Any]:
    """Return a decorator that adds the options of groups of the table, by their headings."""
    options = []
    for heading, names in groups.items():
        for row in _rows(names):
            settings = OPTION_KINDS.get(row.kind, {"type": click.Choice(row.kind.split("|"))})
            if "file" in row.kind:
                settings = settings | {"type": click.Path()}
            options.append(
                click.option(
                    *row.option.split(),
                    row.name,
                    cls=GroupedOption,
                    metavar=row.metavar or None,
                    help=row.help,
                    group=heading,
                    **settings,
                )
            )
    return lambda command: reduce(lambda done, option: option(done), reversed(options), command)


def inputs_of(options: Any) -> SimulationInputs:
    """Return the inputs of a run, read from a project file or from options."""
    options.transpose = options.transpose or None
    options.continuous = options.continuous or None
    options.facies_name = options.facies_name or None
    if options.project is not None:
        return _of_project(options)
    if options.training_image is None:
        raise CCWSIMError("give a training image (TI), or give a project file with --project")
    image, grid = read_image_option(options), grid_of(options)
    hard_data, notes = hard_data_of(options, grid, image)
    usual = Parameters()
    if not _given(options, PER_AXIS):
        from ccwsim.experiments.plan import describe_advice  # takes long to import
        from ccwsim.metrics import default_parameters

        usual = default_parameters(image)
        advice = "" if image.array.size > MAX_DIAGNOSED else describe_advice(image)
        notes = *notes, *([advice] if advice else [])
    return SimulationInputs(
        training_image=image,
        grid=grid,
        parameters=read_parameter_options(options, usual),
        hard_data=hard_data,
        n_realizations=1 if options.n_realizations is None else options.n_realizations,
        seed=options.seed or 0,
        notes=notes,
        secondary=read_secondary_options(options, grid, image),
    )


def _of_project(options: Any) -> SimulationInputs:
    from ccwsim.sharing.project import read_project

    both = _given(options, OF_PROJECT)
    if both:
        name = next(iter(both)).replace("_", " ")
        raise CCWSIMError(f"the project {options.project} contains {name}; leave this input out")
    project = read_project(options.project)
    study, n, seed = project.study, options.n_realizations, options.seed
    return SimulationInputs(
        training_image=study.training_image,
        grid=study.grid,
        parameters=read_parameter_options(options, study.parameters),
        hard_data=study.hard_data,
        n_realizations=project.n_realizations if n is None else n,
        seed=study.seed if seed is None else seed,
        secondary=study.secondary,
    )


def _given(options: Any, names: Iterable[str]) -> dict[str, Any]:
    """Return the options that were given, by name."""
    values = {name: getattr(options, name) for name in names}
    return {name: value for name, value in values.items() if value not in (None, ())}


def read_parameter_options(options: Any, usual: Parameters) -> Parameters:
    """Return the parameters. Options override `--parameters`, which overrides `usual`.

    `--as` first switches to a published variant, or back.
    """
    if options.parameters is not None:
        from ccwsim.io import parameters_from_json
        from ccwsim.io.opening import read_bytes

        usual = parameters_from_json(read_bytes(options.parameters)[0])
    if options.variant is not None:
        usual = usual.as_in(options.variant)
    names = [row.fields[0] for row in fields_of("parameters")]
    return Parameters(**{**asdict(usual), **_given(options, names)})


@cache
def _standard_input() -> bytes:
    return sys.stdin.buffer.read()


def input_file(name: str, kind: str = "", bundled: Collection[str] = ()) -> Any:
    """Return the path of an existing file, or the content of standard input for "-"."""
    if name == "-":
        return BytesIO(_standard_input())
    if kind and not Path(name).exists():
        raise refused(
            "unknown_input",
            name=name,
            kind=kind,
            there=", ".join(bundled),
            suggestion=suggestion(name, bundled),
        )
    return name


@contextmanager
def options_in_messages(groups: Sequence[str]) -> Iterator[None]:
    """Name the options of groups in messages, instead of the arguments of the library."""
    try:
        yield
    except CCWSIMError as error:
        message = str(error)
        for row in _rows(groups):
            pattern = rf"\b{row.argument}=|^{row.argument} = "
            message = re.sub(pattern, f"{row.option.split('/')[0]} ", message)
        raise CCWSIMError(message) from error


@options_in_messages(["image"])
def read_image_option(options: Any, name: str | None = None) -> TrainingImage:
    """Return the training image given in a command line, or another one by its name."""
    from ccwsim import datasets
    from ccwsim.io import read_training_image

    name = name or str(options.training_image)
    reading, bundled = _given(options, IMAGE_ARGUMENTS), datasets.BUNDLED_IMAGES
    if name in bundled:
        if reading:
            raise refused("image_is_bundled", name=name)
        return datasets.load(name)
    if options.grid is not None and len(options.grid) == 3:
        reading["volume"] = True
    return read_training_image(input_file(name, "a bundled training image", bundled), **reading)


def grid_of(options: Any) -> Grid:
    """Return the simulation grid given in a command line."""
    from ccwsim import datasets

    image_grid = _grid_of_image(options)
    if image_grid is not None:
        return image_grid
    shape = options.grid or DEFAULT_SHAPE
    if options.grid is None and options.hard_data in datasets.BUNDLED_DATA:
        shape = datasets.hard_data_grid_shape(options.hard_data)
    cell, origin = options.cell_size or (1.0, 1.0), options.origin or (0.0, 0.0)
    height, bottom, nz = options.cell_height, options.bottom, None
    if len(shape) == 3:
        nz = shape[0]
        cell, origin = (*cell, 1.0 if height is None else height), (*origin, bottom or 0.0)
    elif height is not None or bottom is not None:
        raise refused("heights_of_volumes_only")
    return Grid(shape[-2], shape[-1], cell, origin, nz=nz, crs=options.crs or "")


def _grid_of_image(options: Any) -> Grid | None:
    """Return the grid of an image file with coordinates, unless options describe the grid."""
    from ccwsim import datasets
    from ccwsim.io import read_geometry

    name = options.training_image
    if _given(options, _OF_GRID) or name in datasets.BUNDLED_IMAGES or options.transpose:
        return None
    return read_geometry(input_file(name), **_given(options, IMAGE_ARGUMENTS))


@options_in_messages(["data"])
def hard_data_of(
    options: Any, grid: Grid, image: TrainingImage
) -> tuple[HardData, tuple[str, ...]]:
    """Return the hard data given in a command line, and notes on the import of the data."""
    from ccwsim import datasets
    from ccwsim.io import import_hard_data, import_wells

    name, bundled = options.hard_data, datasets.BUNDLED_DATA
    reading = {READING_DATA[key]: value for key, value in _given(options, READING_DATA).items()}
    collars, surveys = options.collars, options.surveys
    of_guides = {"facies_names"} if options.probability or options.other_images else set()
    is_read = reading.keys() - of_guides or collars or surveys
    if is_read and (name is None or name in bundled):
        raise CCWSIMError("options for reading hard data need a file; give a file with --hard-data")
    if name is None:
        return HardData(), ()
    if name in bundled:
        return datasets.load_hard_data(name), ()
    file = input_file(name, "the name of bundled hard data", bundled)
    if collars is None and surveys is not None:
        raise CCWSIMError("--surveys needs a table of well collars; give this table with --collars")
    for table, path in (("collars", collars), ("surveys", surveys)):
        columns = [name for name in reading if name.startswith(table[:-1] + "_")]
        if path is None and columns:
            option = columns[0].replace("_", "-")
            raise CCWSIMError(f"--{option} names a column of a table of {table}; give --{table}")
    if collars is None:
        report = import_hard_data(file, grid, image, **reading)
    elif "coordinates" in reading:
        raise CCWSIMError("leave out --hard-coordinates, which cannot be used with --collars")
    else:
        report = import_wells(collars, file, grid, image, surveys=surveys, **reading)
    return report.hard_data, report.notes


def read_secondary_options(options: Any, grid: Grid, image: TrainingImage) -> Secondary | None:
    """Return the secondary information given in a command line, or None if there is none."""
    from ccwsim.io import angles_along, read_active, read_lines, read_probabilities, read_values
    from ccwsim.metrics import main_direction

    active = options.active and read_active(options.active, grid, options.active_codes)
    auxiliary, probabilities = [], {}
    for of_image, of_grid in options.auxiliary:
        auxiliary.append(
            Auxiliary(
                read_values(of_image, Grid.of(image.shape)),
                read_values(of_grid, grid),
                weight=options.auxiliary_weight,
            )
        )
    for text in options.probability:
        name, _, path = ("", "", text) if Path(text).exists() else text.partition("=")
        facies = image.facies_names[image.index_of(int(name))] if name.isdecimal() else name or None
        probabilities |= read_probabilities(path or text, grid, facies)

    def field(name: str) -> Any:
        """Return an option as a number; if it names a file, return the map in that file."""
        text = getattr(options, name)
        if text is None:
            return None
        try:
            return float(text)
        except ValueError:
            lines = read_lines(text, grid) if name == "angle" else None
        if lines is None:
            return read_values(text, grid)
        return angles_along(lines, grid, round(main_direction(image)[0]))

    weights = options.image_weights and options.image_weights.split(",")
    try:
        weights = weights and [float(weight) for weight in weights]
    except ValueError:
        raise refused("image_weights", given=shown(options.image_weights)) from None
    secondary = Secondary(
        active=active,
        probabilities=probabilities or None,
        auxiliary=auxiliary,
        soft_weight=options.soft_weight,
        images=[read_image_option(options, name) for name in options.other_images],
        zones=options.zones and read_values(options.zones, grid),
        weights=weights,
        **{name: field(name) for name in ("angle", "scale", "dip")},
        mirrored=options.mirrored or (),
        facies=options.facies_name,
    )
    return None if secondary.is_empty else secondary.fitted(grid, image)
