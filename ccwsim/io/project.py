"""A study as one file, `.ccwsim`: a zip of its settings, its training image and its data."""

from __future__ import annotations

import json
import os
import re
import zipfile
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import asdict, dataclass, field, fields
from io import BytesIO
from typing import TYPE_CHECKING, Any

import numpy as np

from ccwsim.io.archive import opened_archive
from ccwsim.io.atomic import write_bytes
from ccwsim.io.data_file import printable
from ccwsim.io.formats.numpy_files import read_npy
from ccwsim.io.opening import PathOrFile, read_bytes
from ccwsim.jobs.workers import Progress
from ccwsim.model.arrays import check_int
from ccwsim.model.choices import Shown
from ccwsim.model.codec import settings_of
from ccwsim.model.ensemble import Ensemble
from ccwsim.model.errors import CCWSIMError, shown
from ccwsim.model.grid import Grid
from ccwsim.model.hard_data import HardData
from ccwsim.model.parameters import Parameters
from ccwsim.model.study import Study
from ccwsim.model.training_image import TrainingImage
from ccwsim.run.simulation import simulate

if TYPE_CHECKING:
    from distributed import Client

FORMAT, VERSION = "CCWSIM project", 1
SETTINGS, IMAGE, DATA = "study.json", "training_image.npy", "hard_data.npy"
MAX_SETTINGS_BYTES = 2**20
MAX_PROJECT_MEMBERS = 16
MAX_LINK_LETTERS = 10_000
"""Of a value of the address that a project keeps; packed hard data are the longest."""
MADE = (2020, 1, 1, 0, 0, 0)
"""The date of every member, so that the same study gives the same file."""


@dataclass(frozen=True, eq=False)
class Project:
    """A study with what is shown of it, as a file keeps it.

    Attributes
    ----------
    study : Study
        Training image, grid, parameters, hard data and seed.
    n_realizations : int
    colours : tuple of (int, str)
        Codes with a colour of the user's own, `#rrggbb`.
    shown : Shown
    link : dict
        The same study as an address has it, as far as it can; empty where there is none.
    versions : dict
        What it was made with.
    digest : str
        The digest of the realizations, where they were known.
    """

    study: Study
    n_realizations: int = 1
    colours: tuple[tuple[int, str], ...] = ()
    shown: Shown = field(default_factory=Shown)
    link: Mapping[str, list[str]] = field(default_factory=dict)
    versions: Mapping[str, str] = field(default_factory=dict)
    digest: str = ""

    def __post_init__(self) -> None:
        n = check_int("n_realizations", self.n_realizations, 1)
        object.__setattr__(self, "n_realizations", n)

    def simulate(
        self,
        n_realizations: int | None = None,
        seed: int | None = None,
        n_workers: int | None = None,
        progress: Progress | None = None,
        cancel: Callable[[], bool] | None = None,
        first_realization: int = 0,
        keep_sources: bool = False,
        executor: Executor | Client | None = None,
        out: str | os.PathLike[str] | None = None,
    ) -> Ensemble:
        """Return the realizations of the study, as `ccwsim.simulate` does.

        Parameters
        ----------
        n_realizations, seed : int, optional
            Those of the project where left out.
        n_workers, progress, cancel, first_realization, keep_sources, executor, out
            As in `ccwsim.simulate`.

        Raises
        ------
        CCWSIMError, Cancelled
            As `ccwsim.simulate`.
        """
        s = self.study
        return simulate(
            *(s.training_image, s.grid, s.parameters, s.hard_data),
            n_realizations=self.n_realizations if n_realizations is None else n_realizations,
            seed=s.seed if seed is None else seed,
            n_workers=n_workers,
            progress=progress,
            cancel=cancel,
            first_realization=first_realization,
            keep_sources=keep_sources,
            executor=executor,
            out=out,
        )


def save_project(path_or_file: Any, project: Project) -> None:
    """Write a project to a path, whole or not at all, or to an open binary file.

    Raises
    ------
    CCWSIMError
        For a place that cannot be written.
    """
    write_bytes(path_or_file, project_as_bytes(project))


def project_as_bytes(project: Project) -> bytes:
    """Return a project as the content of a file, for a download.

    Examples
    --------
    >>> project = Project(Study(TrainingImage(np.eye(40)), Grid(50, 60), seed=7))
    >>> read_project(BytesIO(project_as_bytes(project))).study.seed
    7
    """
    study = project.study
    data = np.column_stack([study.hard_data.cells, study.hard_data.facies])
    content = BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, member in (
            (SETTINGS, json.dumps(_settings(project), indent=1, ensure_ascii=False).encode()),
            (IMAGE, _npy(study.training_image.array)),
            (DATA, _npy(data.astype(np.int64))),
        ):
            info = zipfile.ZipInfo(name, MADE)
            info.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(info, member)
    return content.getvalue()


def read_project(path_or_file: PathOrFile) -> Project:
    """Return the project of a file.

    Parameters
    ----------
    path_or_file : str, Path or binary file

    Raises
    ------
    CCWSIMError
        For a file that is none, is broken, was made by a newer version, or is too large; the
        message says which.
    """
    content, name = read_bytes(path_or_file)
    members = _members(content, name)
    settings = _settings_of(_json(members[SETTINGS], name), name)
    try:
        return _project(settings, members, name)
    except CCWSIMError as error:
        said = str(error)
        raise CCWSIMError(said if said.startswith(name) else f"{name}: {said}") from error


def _project(settings: Settings, members: Mapping[str, bytes], name: str) -> Project:
    grid = Grid(**settings.grid)
    image = _integers(members[IMAGE], f"{name}, {IMAGE}", grid.n_dimensions)
    columns = grid.n_dimensions + 1
    table = (
        _integers(members[DATA], f"{name}, {DATA}", 2)
        if settings.n_data
        else np.empty((0, columns), int)
    )
    if table.shape != (settings.n_data, columns):
        raise CCWSIMError(f"{settings.n_data} hard data are promised; {DATA} has other ones")
    names = settings.facies_names
    study = Study(
        TrainingImage(image, name=settings.image_name, facies_names=names),
        grid,
        Parameters(**settings.parameters),
        HardData(table[:, :-1], table[:, -1]),
        settings.numbers["seed"],
    )
    n = settings.numbers["n_realizations"]
    shown, link = settings.shown, settings.link
    return Project(study, n, settings.colours, shown, link, settings.versions, settings.digest)


def _settings(project: Project) -> dict[str, Any]:
    study = project.study
    return {
        "format": FORMAT,
        "version": VERSION,
        "made_with": dict(project.versions),
        "training_image": {
            "name": study.training_image.name,
            "facies_names": list(study.training_image.facies_names),
            "colours": [[int(code), colour] for code, colour in project.colours],
        },
        "n_hard_data": study.hard_data.n,
        "grid": {key: own for key, own in asdict(study.grid).items() if own is not None},
        "parameters": asdict(study.parameters),
        "n_realizations": project.n_realizations,
        "seed": study.seed,
        "shown": asdict(project.shown),
        "link": {name: list(values) for name, values in project.link.items()},
        "digest": project.digest,
    }


def _npy(array: np.ndarray) -> bytes:
    content = BytesIO()
    np.save(content, array, allow_pickle=False)
    return content.getvalue()


def _integers(content: bytes, name: str, n_dimensions: int) -> np.ndarray:
    array = read_npy(content, name).variables["array"]
    if (n_dimensions == 2 and len(array) != 1) or array.dtype.kind not in "bui":
        raise CCWSIMError(f"{name}: whole numbers in rows and columns are needed")
    return array[0] if n_dimensions == 2 else array


def _members(content: bytes, name: str) -> dict[str, bytes]:
    """The members that a project has, whose sizes are looked at before they are unpacked."""
    if not content.startswith(b"PK"):
        raise CCWSIMError(f"{name} is no project of CCWSIM; choose a file that was saved as one")
    with opened_archive(content, name) as archive:
        wanted = [SETTINGS, IMAGE, DATA]
        missing = [own for own in wanted if own not in archive.infos]
        if missing or archive.n_members > MAX_PROJECT_MEMBERS:
            what = f"{missing[0]} is missing" if missing else "it holds too many files"
            raise CCWSIMError(f"{name} is no project of CCWSIM: {what}")
        archive.check(wanted)
        if archive.infos[SETTINGS].file_size > MAX_SETTINGS_BYTES:
            raise CCWSIMError(f"{name}: {SETTINGS} is too large for the settings of a study")
        return {own: archive.read(own) for own in wanted}


def _json(content: bytes, name: str) -> Any:
    try:
        return json.loads(content.decode())
    except (ValueError, RecursionError) as error:
        reason = " ".join(str(error).split())[:100]
        raise CCWSIMError(f"{name}: {SETTINGS} is no JSON ({reason}); save it again") from error


@dataclass(frozen=True)
class Settings:
    """What the settings of a project say; the nouns check the values themselves."""

    image_name: str
    facies_names: list[str]
    colours: tuple[tuple[int, str], ...]
    n_data: int
    grid: dict[str, Any]
    parameters: dict[str, Any]
    numbers: dict[str, int]
    shown: Shown
    link: dict[str, list[str]]
    versions: dict[str, str]
    digest: str


def _settings_of(given: Any, name: str) -> Settings:
    """Return the settings of the JSON of a project, each of the kind it has to be."""
    if not isinstance(given, dict) or given.get("format") != FORMAT:
        raise CCWSIMError(f"{name} is no project of CCWSIM")
    said = given.get("version")
    if not isinstance(said, int) or said < 1:
        raise CCWSIMError(f"{name}: version {shown(said)} of the file is unknown; save it again")
    if said > VERSION:
        raise CCWSIMError(f"{name} was saved by a newer version of CCWSIM; update this one")
    image = _take(given, "training_image", dict, name)
    return Settings(
        printable(_take(image, "name", str, name)),
        [printable(own) for own in _texts(image, "facies_names", name)],
        _colours(_take(image, "colours", list, name), name),
        check_int(f"{name}: n_hard_data", given.get("n_hard_data"), 0),
        _known(Grid, _take(given, "grid", dict, name), ("ny", "nx"), name),
        _known(Parameters, _take(given, "parameters", dict, name), (), name),
        _checked("study", given, name),
        Shown(**_checked("shown", _take(given, "shown", dict, name), name)),
        _link(_take(given, "link", dict, name), name),
        {
            printable(key): printable(shown(value) if not isinstance(value, str) else value)
            for key, value in _take(given, "made_with", dict, name).items()
        },
        printable(_take(given, "digest", str, name)),
    )


def _take(given: Mapping[str, Any], key: str, kind: type, name: str) -> Any:
    value = given.get(key)
    if not isinstance(value, kind):
        raise CCWSIMError(f"{name}: {key} is missing or broken in its settings; save it again")
    return value


def _texts(given: Mapping[str, Any], key: str, name: str) -> list[str]:
    found = _take(given, key, list, name)
    if not all(isinstance(one, str) for one in found):
        raise CCWSIMError(f"{name}: {key} must be a list of words; save it again")
    return found


def _link(given: dict[str, Any], name: str) -> dict[str, list[str]]:
    return {
        printable(key): [printable(own, MAX_LINK_LETTERS) for own in _texts(given, key, name)]
        for key in given
    }


def _colours(given: list[Any], name: str) -> tuple[tuple[int, str], ...]:
    for pair in given:
        ok = isinstance(pair, list) and len(pair) == 2 and type(pair[0]) is int
        if not ok or not re.fullmatch("#[0-9a-fA-F]{6}", str(pair[1])):
            raise CCWSIMError(f"{name}: {shown(pair)} is no code and colour; save it again")
    return tuple((code, colour) for code, colour in given)


def _known(noun: Any, given: dict[str, Any], needed: Sequence[str], name: str) -> dict[str, Any]:
    """Return the fields of a noun that checks its values itself; none may be unknown."""
    missing = [own for own in needed if own not in given]
    if missing:
        raise CCWSIMError(f"{name}: {missing[0]} is missing in its settings; save it again")
    unknown = sorted(set(given) - {own.name for own in fields(noun)})
    if unknown:
        raise CCWSIMError(
            f"{name}: {shown(unknown[0])} is unknown here; it may be of a newer version"
        )
    return given


def _checked(part: str, given: Mapping[str, Any], name: str) -> dict[str, Any]:
    """Return the fields of a part whose values are checked by the table of settings."""
    found: dict[str, Any] = {}
    for row in settings_of(part):
        (own,) = row.fields
        found[own] = row.check(given.get(own), name)
    return found


MAX_LENGTH = 100_000


def parameters_to_json(parameters: Parameters) -> str:
    """Return parameters as a JSON object of all their names and values.

    Examples
    --------
    >>> parameters_to_json(Parameters(template_size=48))[:23]
    '{"template_size": 48, "'
    """
    return json.dumps(asdict(parameters))


def parameters_from_json(text: str | bytes) -> Parameters:
    """Return the parameters of a JSON object; names that are not in it keep their defaults.

    Raises
    ------
    CCWSIMError
        For what is no JSON object, a name that is no parameter, or a value that is not allowed.

    Examples
    --------
    >>> parameters_from_json('{"template_size": 48}').template_size
    48
    """
    if len(text) > MAX_LENGTH:
        raise CCWSIMError(f"parameters: {len(text)} characters are no list of parameters")
    try:
        given = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise CCWSIMError(f"parameters: this is no JSON ({error}); write them again") from error
    if not isinstance(given, dict):
        raise CCWSIMError('parameters: a JSON object is needed, such as {"template_size": 32}')
    known = [f.name for f in fields(Parameters)]
    unknown = [name for name in given if name not in known]
    if unknown:
        raise CCWSIMError(
            f"parameters: there is no {shown(unknown[0])}; there are {', '.join(known)}"
        )
    return Parameters(**given)
