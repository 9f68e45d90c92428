"""The option `--project`: a whole study from one file instead of from many options."""

from __future__ import annotations

import argparse
from dataclasses import asdict, dataclass, fields

from ccwsim.cli.data_options import READING, grid_of, hard_data_of
from ccwsim.cli.image_options import image_of
from ccwsim.cli.parameter_options import parameters_of
from ccwsim.io import read_project
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.grid import Grid
from ccwsim.model.hard_data import HardData
from ccwsim.model.parameters import Parameters
from ccwsim.model.training_image import TrainingImage

OF_THE_PROJECT = (
    "training_image", "variable", "threshold", "classes", "shape", "slice_index", "first_row",
    "transpose", "grid", "cell_size", "origin", "hard_data", *READING,
)  # fmt: skip
"""What a project says itself, so that it cannot be given beside it."""


@dataclass(frozen=True, eq=False)
class Inputs:
    """What a command line simulates.

    Attributes
    ----------
    notes : tuple of str
        What happened while the data were read.
    """

    training_image: TrainingImage
    grid: Grid
    parameters: Parameters
    hard_data: HardData
    n_realizations: int
    seed: int
    notes: tuple[str, ...] = ()


def add_project_option(parser: argparse.ArgumentParser) -> None:
    """Add `--project`."""
    group = parser.add_argument_group("a whole study")
    group.add_argument(
        "--project", metavar="FILE",
        help="take training image, grid, hard data, parameters, number of realizations and seed "
        "from a project file (.ccwsim), as the dashboard saves it; parameters, --realizations and "
        "--seed given here come first",
    )  # fmt: skip


def inputs_of(options: argparse.Namespace) -> Inputs:
    """Return what a command line says, of a project file or of its options.

    Raises
    ------
    CCWSIMError
        For a project and options that both say it, neither of them, or what cannot be read.
    """
    if options.project is not None:
        return _of_project(options)
    if options.training_image is None:
        raise CCWSIMError("give a training image, or a project file with --project")
    image, grid = image_of(options), grid_of(options)
    data, notes = hard_data_of(options, grid, image)
    n = 1 if options.realizations is None else options.realizations
    seed = options.seed or 0
    return Inputs(image, grid, parameters_of(options), data, n, seed, notes)


def _of_project(options: argparse.Namespace) -> Inputs:
    both = [name for name in OF_THE_PROJECT if getattr(options, name) is not None]
    if both:
        said = both[0].replace("_", " ")
        raise CCWSIMError(f"the project {options.project} has its own {said}; leave it out here")
    project = read_project(options.project)
    study = project.study
    given = {f.name: getattr(options, f.name) for f in fields(Parameters)}
    changed = {name: value for name, value in given.items() if value is not None}
    parameters = Parameters(**{**asdict(study.parameters), **changed})
    if options.parameters is not None:
        parameters = parameters_of(options)
    return Inputs(
        study.training_image, study.grid, parameters, study.hard_data,
        project.n_realizations if options.realizations is None else options.realizations,
        study.seed if options.seed is None else options.seed,
    )  # fmt: skip
