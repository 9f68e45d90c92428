"""Write a study as Python code and as a command that reproduce the realizations exactly."""

import shlex
from dataclasses import dataclass, fields

from ccwsim import Grid, Parameters, datasets
from ccwsim.model import MAX_WRITTEN_DATA, Study
from ccwsim.sharing.choices import Choices
from ccwsim.sharing.codec import fields_of, format_exactly

OUTPUT = "realizations.npz"
VERTICAL_OPTIONS = {"cell": "--cell-height", "origin": "--bottom"}
"""Command line options for the third number (along z) of cell size and origin."""


@dataclass(frozen=True)
class Recipe:
    """Script and command that reproduce the realizations of a study."""

    python: str  # a Python script
    command: str  # one line for a shell
    python_needs_project: bool  # whether the script reads the project file
    command_needs_project: bool


def reproduction_recipe(choices: Choices, study: Study, project: str) -> Recipe:
    """Return the script and the command for a study; `project` is the name of the project file."""
    lines, by_project = _python(choices, study, project)
    words, command_by_project = _command(choices, study, project)
    return Recipe("\n".join(lines), shlex.join(words), by_project, command_by_project)


def _python(choices: Choices, study: Study, project: str) -> tuple[list[str], bool]:
    image_lines, data_lines = _image_lines(choices), _data_lines(choices, study)
    reads = image_lines is None or data_lines is None or study.secondary is not None
    lines = ["import ccwsim"]
    needed = [*(image_lines or ()), *(data_lines or ())]
    if any("datasets." in line for line in needed):
        lines.append("from ccwsim import datasets")
    if any("sample_random" in line for line in needed):
        lines.append("from ccwsim.datasets.sampling import sample_random")
    lines.append("")
    if reads:
        lines.append(f"study = ccwsim.read_project({project!r}).study")
    lines += image_lines or ["ti = study.training_image"]
    sides = ("ny", "nx", "nz") if study.grid.is_volume else ("ny", "nx")
    lines.append(f"grid = {_call(study.grid, _usual(study.grid), sides)}")
    lines.append(f"p = {_call(study.parameters, Parameters())}")
    lines += ["hd = study.hard_data"] if data_lines is None else data_lines
    data_argument = ", hd" if data_lines is None or data_lines else ""
    guided = ", secondary=study.secondary" if study.secondary else ""
    lines.append(
        f"e = ccwsim.simulate(ti, grid, p{data_argument}, n_realizations={choices.n_realizations}, "
        f"seed={study.seed}{guided})"
    )
    lines += [f"ccwsim.write_realizations({OUTPUT!r}, e)", ""]
    return lines, reads


def _image_lines(choices: Choices) -> list[str] | None:
    """Return code that loads and modifies a bundled image; None for an uploaded image."""
    choice = choices.image
    if choice.upload is not None:
        return None
    lines = [f"ti = datasets.load({choice.bundled!r})"]
    turned = ".swapaxes(-1, -2)" if choice.transpose else ""
    if choice.flip_ew or choice.flip_ns:
        rows, columns = ("::-1" if flips else ":" for flips in (choice.flip_ns, choice.flip_ew))
        turned += f"[..., {rows}, {columns}]"
    named = choice.names if len(choice.names) == datasets.load(choice.bundled).n_facies else ()
    if turned or named:
        names = repr(list(named)) if named else "ti.facies_names"
        lines.append(
            f"ti = ccwsim.TrainingImage(ti.array{turned}, name=ti.name, facies_names={names})"
        )
    return lines


def _data_lines(choices: Choices, study: Study) -> list[str] | None:
    """Return code that makes the hard data; None if the code must read the project file."""
    choice, hard_data = choices.data, study.hard_data
    if not hard_data.n:
        return []
    if choice.source == "bundled" and is_bundled(choices, study):
        return [f"hd = datasets.load_hard_data({choice.bundled!r})"]
    if choice.source == "sampled":
        return [
            f"truth = ccwsim.simulate(ti, grid, p, seed={choice.seed_sampled}).realizations[0]",
            f"hd = sample_random(truth, {choice.n_sampled}, seed={choice.seed_sampled})",
        ]
    if hard_data.n > MAX_WRITTEN_DATA or hard_data.values:
        return None
    return [f"hd = ccwsim.HardData({hard_data.cells.tolist()}, {hard_data.facies.tolist()})"]


def is_bundled(choices: Choices, study: Study) -> bool:
    """Return whether a study uses all data of a bundled data set."""
    data = choices.data
    return data.source == "bundled" and (
        datasets.load_hard_data(data.bundled).digest == study.hard_data.digest
    )


def _usual(grid: Grid) -> Grid:
    """Return a grid of equal shape with default world coordinates."""
    return Grid(1, 1, nz=1 if grid.is_volume else None)


def _call(value: Grid | Parameters, usual: Grid | Parameters, always: tuple[str, ...] = ()) -> str:
    """Return Python code for an object, with its changed fields and the fields in `always`."""
    names = [f.name for f in fields(value) if getattr(value, f.name) != getattr(usual, f.name)]
    names = [*always, *(name for name in names if name not in always)]
    parts = [f"{name}={getattr(value, name)!r}" for name in names]
    return f"ccwsim.{type(value).__name__}({', '.join(parts)})"


def _command(choices: Choices, study: Study, project: str) -> tuple[list[str], bool]:
    image = choices.image
    plain = image.upload is None and not (image.flip_ew or image.flip_ns or image.transpose)
    direct = plain and (not study.hard_data.n or is_bundled(choices, study))
    direct = direct and study.secondary is None
    words = ["python", "-m", "ccwsim", "simulate"]
    if not direct:
        return [*words, "--project", project, "--output", OUTPUT], True
    words += [image.bundled, *_options("grid", study.grid, _usual(study.grid))]
    if study.hard_data.n:
        words += ["--hard-data", choices.data.bundled]
    words += _options("parameters", study.parameters, Parameters())
    words += ["--realizations", str(choices.n_realizations), "--seed", str(study.seed)]
    return [*words, "--output", OUTPUT], False


def _options(part: str, settings: Grid | Parameters, defaults: Grid | Parameters) -> list[str]:
    words: list[str] = []
    for row in fields_of(part):
        value = row.value_in({part: settings})
        if value == row.value_in({part: defaults}) and row.kind != "sizes":
            continue
        if row.no_option:
            words.append(row.option if value else row.no_option)
        elif row.kind == "lengths":
            words += [row.option, *map(format_exactly, value[:2])]
            along_z = value[2:]
            if along_z and along_z != row.value_in({part: defaults})[2:]:
                words += [VERTICAL_OPTIONS[row.key], format_exactly(along_z[0])]
        else:
            words += [row.option, row.write(value)]
    return words
