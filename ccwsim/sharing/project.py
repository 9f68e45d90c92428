"""Project files (`.ccwsim`): a zip archive of a study's JSON, training image and hard data."""

import json
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from io import BytesIO
from typing import Any

import numpy as np

from ccwsim import CCWSIMError, Ensemble, Grid, Parameters, TrainingImage, simulate
from ccwsim.io.archive import opened_archive
from ccwsim.io.atomic import write_bytes
from ccwsim.io.data_file import printable
from ccwsim.io.formats.numpy_files import npz_arrays
from ccwsim.io.opening import PathOrFile, read_bytes
from ccwsim.io.realizations import (
    KINDS_OF_VALUES,
    arrays_of_values,
    data_of_arrays,
    values_of_image,
)
from ccwsim.io.secondary import KINDS_OF_ARRAYS, arrays_of_secondary, secondary_of_arrays
from ccwsim.model import Study, check_int, refused, shown
from ccwsim.sharing.choices import Choices, GuideChoice
from ccwsim.sharing.link import KEYS, StudyReader, link_settings
from ccwsim.sharing.parts import as_json, from_json

FORMAT, VERSION = "CCWSIM project", 2
STUDY = "study.json"
ARRAYS = {"training_image": "buif", "hard_cells": "ui", "hard_facies": "ui"}
"""Arrays that every project has, and the NumPy kinds allowed for each."""
FILE = "files/{}"  # member with the content of a file of the user
MAX_STUDY_BYTES = 2**24
MAX_VALUE_LETTERS = 10_000  # letters of a link's value; packed hard data are the longest values
REQUIRED = ("grid", "realizations", "seed")  # other settings have default values
MADE = (2020, 1, 1, 0, 0, 0)  # fixed date of all members: files of equal studies are equal


@dataclass(frozen=True, eq=False)
class Project:
    """A study, and the choices that led to it, as stored in a project file."""

    study: Study
    n_realizations: int = 1
    settings: Mapping[str, Sequence[str]] = field(default_factory=dict)
    """Names and values as in a link; `study` overrides those of grid, parameters and seed."""
    versions: Mapping[str, str] = field(default_factory=dict)  # versions of software
    digest: str = ""  # digest of the realizations, if they were simulated
    choices: Choices | None = None  # from which the dashboard made the study

    def __post_init__(self) -> None:
        n = check_int("n_realizations", self.n_realizations, 1)
        object.__setattr__(self, "n_realizations", n)

    def simulate(
        self, n_realizations: int | None = None, seed: int | None = None, **options: Any
    ) -> Ensemble:
        """Return realizations of the study, with the options and errors of `ccwsim.simulate`.

        By default, `n_realizations` and `seed` have the values of the project.
        """
        s = self.study
        return simulate(
            s.training_image,
            s.grid,
            s.parameters,
            s.hard_data,
            n_realizations=self.n_realizations if n_realizations is None else n_realizations,
            seed=s.seed if seed is None else seed,
            **{"secondary": s.secondary, **options},
        )


def save_project(path_or_file: Any, project: Project) -> None:
    """Write a project to a path (completely or not at all) or to an open binary file.

    Raises `CCWSIMError` for a path that cannot be written.
    """
    write_bytes(path_or_file, project_as_bytes(project))


def project_as_bytes(project: Project) -> bytes:
    """Return the bytes of a project file, for a download."""
    study, hard_data = project.study, project.study.hard_data
    arrays = {"training_image": study.training_image.array}
    arrays |= {"hard_cells": hard_data.cells, "hard_facies": hard_data.facies}
    arrays |= arrays_of_secondary(study.secondary) | arrays_of_values(study)
    files: list[bytes] = []
    text = json.dumps(_as_json(project, files), indent=1, ensure_ascii=False)
    members = {STUDY: text.encode()} | {
        f"{name}.npy": _npy(array) for name, array in arrays.items()
    }
    members |= {FILE.format(k): file for k, file in enumerate(files)}
    content = BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, member in members.items():
            info = zipfile.ZipInfo(name, MADE)
            info.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(info, member)
    return content.getvalue()


def read_project(path_or_file: PathOrFile) -> Project:
    """Read a project from a file.

    Raises `CCWSIMError` if the file is not a project, is broken or too large, or was written by a
    newer version.
    """
    content, name = read_bytes(path_or_file)
    text, files = _study_and_files(content, name)
    try:
        entries = json.loads(text.decode())
    except (ValueError, RecursionError) as error:
        reason = " ".join(str(error).split())[:100]
        raise CCWSIMError(f"{name}: {STUDY} is not valid JSON ({reason}); save it again") from error
    _check_version(entries, name)
    arrays = npz_arrays(content, name, ARRAYS | KINDS_OF_ARRAYS | KINDS_OF_VALUES)
    if missing := next((key for key in ARRAYS if key not in arrays), None):
        raise CCWSIMError(f"{name} is not a project of CCWSIM: {missing}.npy is missing")
    try:
        project = _project(entries, arrays)
        entry = entries.get("choices")
        choices = None if entry is None else from_json(entry, Choices, files)
    except CCWSIMError as error:
        raise CCWSIMError(f"{name}: {error}") from error
    if choices is not None and choices.guides.is_empty:
        choices = replace(choices, guides=GuideChoice(saved=project.study.secondary))
    return replace(project, choices=choices)


def _check_version(entries: Any, name: str) -> None:
    if not isinstance(entries, dict) or entries.get("format") != FORMAT:
        raise CCWSIMError(f"{name} is not a project of CCWSIM")
    version = entries.get("version")
    if not isinstance(version, int) or version < 1:
        raise CCWSIMError(f"{name}: version {shown(version)} of the file is unknown; save it again")
    if version > VERSION:
        raise CCWSIMError(f"{name} was saved by a newer version of CCWSIM; update this version")


def _project(entries: dict[str, Any], arrays: Mapping[str, np.ndarray]) -> Project:
    """Build a project from JSON and arrays; most classes check their values themselves."""
    image_entry = _take(entries, "training_image", dict)
    facies_names = [printable(text) for text in _texts(image_entry, "facies_names")]
    texts = _take(entries, "settings", dict)
    settings = {printable(key): _texts(texts, key) for key in texts}
    reader = StudyReader(settings, project=True)
    for key in REQUIRED:
        if not settings.get(key):
            raise CCWSIMError(f"{key} is missing in its settings; save it again")
    unknown = sorted(settings.keys() - KEYS)
    if unknown:
        raise refused("unknown_entry", unknown=shown(unknown[0]))
    grid, parameters = reader.part("grid", Grid(1, 1)), reader.part("parameters", Parameters())
    choices = reader.part("study", Choices())
    image_name = printable(_take(image_entry, "name", str))
    training_image = TrainingImage(
        arrays["training_image"],
        name=image_name,
        facies_names=facies_names,
        numbering=printable(str(image_entry.get("numbering", "codes"))),
        **values_of_image(arrays),
    )
    hard_data = data_of_arrays(arrays)
    hard_data.numbering = training_image.numbering_of_data
    study = Study(
        training_image,
        grid,
        parameters,
        hard_data,
        seed=choices.seed,
        secondary=secondary_of_arrays(arrays, grid, training_image),
    )
    versions = {
        printable(key): printable(shown(value) if not isinstance(value, str) else value)
        for key, value in _take(entries, "made_with", dict).items()
    }
    digest = printable(_take(entries, "digest", str))
    return Project(study, choices.n_realizations, settings, versions, digest)


def _as_json(project: Project, files: list[bytes]) -> dict[str, Any]:
    study = project.study
    choices = Choices(
        grid=study.grid,
        parameters=study.parameters,
        n_realizations=project.n_realizations,
        seed=study.seed,
    )
    current = link_settings(choices, ("grid", "parameters", "study"))
    return {
        "format": FORMAT,
        "version": VERSION if study.training_image.values else 1,
        "made_with": dict(project.versions),
        "training_image": {
            "name": study.training_image.name,
            "facies_names": list(study.training_image.facies_names),
            "numbering": study.training_image.numbering,
        },
        "settings": {**project.settings, **current},
        "choices": as_json(project.choices, files),
        "digest": project.digest,
    }


def _npy(array: np.ndarray) -> bytes:
    content = BytesIO()
    np.save(content, array, allow_pickle=False)
    return content.getvalue()


def _study_and_files(content: bytes, name: str) -> tuple[bytes, list[bytes]]:
    """Return the text of a study and the files in a project file, after checking their sizes."""
    if not content.startswith(b"PK"):
        raise CCWSIMError(f"{name} is not a project of CCWSIM; choose a saved project")
    with opened_archive(content, name) as archive:
        if STUDY not in archive.infos:
            raise CCWSIMError(f"{name} is not a project of CCWSIM: {STUDY} is missing")
        files = [FILE.format(k) for k in range(len(archive.infos))]
        files = [file for file in files if file in archive.infos]
        archive.check([STUDY, *files])
        if archive.infos[STUDY].file_size > MAX_STUDY_BYTES:
            raise CCWSIMError(f"{name}: {STUDY} is too large for a study")
        return archive.read(STUDY), [archive.read(file) for file in files]


def _take(entries: Mapping[str, Any], key: str, kind: type) -> Any:
    value = entries.get(key)
    if not isinstance(value, kind):
        raise CCWSIMError(f"{key} is missing or broken in its settings; save it again")
    return value


def _texts(entries: Mapping[str, Any], key: str) -> list[str]:
    texts = _take(entries, key, list)
    if not all(isinstance(text, str) for text in texts):
        raise CCWSIMError(f"{key} must be a list of words; save it again")
    return [printable(text, MAX_VALUE_LETTERS) for text in texts]
