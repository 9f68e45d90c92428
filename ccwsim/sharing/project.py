"""Project files (`.ccwsim`): a zip archive of a study's JSON, training image and hard data."""

import json
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from io import BytesIO
from typing import Any

import numpy as np

from ccwsim import CCWSIMError, Ensemble, Grid, HardData, Parameters, TrainingImage, simulate
from ccwsim.io.archive import opened_archive
from ccwsim.io.atomic import write_bytes
from ccwsim.io.data_file import printable
from ccwsim.io.formats.numpy_files import npz_arrays, read_npy
from ccwsim.io.opening import PathOrFile, read_bytes
from ccwsim.io.secondary import KINDS_OF_ARRAYS, arrays_of_secondary, secondary_of_arrays
from ccwsim.model.arrays import check_int
from ccwsim.model.errors import refused, shown
from ccwsim.model.study import Study
from ccwsim.sharing.choices import Choices
from ccwsim.sharing.link import KEYS, StudyReader, settings_of

FORMAT, VERSION = "CCWSIM project", 1
STUDY, IMAGE, DATA = "study.json", "training_image.npy", "hard_data.npy"
SECONDARY = "secondary.npz"
MAX_STUDY_BYTES = 2**20
MAX_PROJECT_MEMBERS = 16
MAX_LINK_LETTERS = 10_000  # letters of a link's value; packed hard data are the longest values
REQUIRED = ("grid", "realizations", "seed")  # other settings have default values
MADE = (2020, 1, 1, 0, 0, 0)  # fixed date of all members: files of equal studies are equal


@dataclass(frozen=True, eq=False)
class Project:
    """A study, and the choices that led to it, as stored in a project file."""

    study: Study
    n_realizations: int = 1
    settings: Mapping[str, Sequence[str]] = field(default_factory=dict)
    """Names and values as in a link; those of grid, parameters and seed are taken from `study`."""
    versions: Mapping[str, str] = field(default_factory=dict)  # versions of software
    digest: str = ""  # digest of the realizations, if they were simulated

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
            *(s.training_image, s.grid, s.parameters, s.hard_data),
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
    study = project.study
    data = np.column_stack([study.hard_data.cells, study.hard_data.facies])
    content = BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, member in (
            (STUDY, json.dumps(_as_json(project), indent=1, ensure_ascii=False).encode()),
            (IMAGE, _npy(study.training_image.array)),
            (DATA, _npy(data.astype(np.int64))),
            *([(SECONDARY, _npz(arrays_of_secondary(study.secondary)))] if study.secondary else []),
        ):
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
    members = _members(content, name)
    try:
        study = json.loads(members[STUDY].decode())
    except (ValueError, RecursionError) as error:
        reason = " ".join(str(error).split())[:100]
        raise CCWSIMError(f"{name}: {STUDY} is not valid JSON ({reason}); save it again") from error
    _check_version(study, name)
    try:
        return _project(study, members, name)
    except CCWSIMError as error:
        said = str(error)
        raise CCWSIMError(said if said.startswith(name) else f"{name}: {said}") from error


def _check_version(given: Any, name: str) -> None:
    if not isinstance(given, dict) or given.get("format") != FORMAT:
        raise CCWSIMError(f"{name} is not a project of CCWSIM")
    version = given.get("version")
    if not isinstance(version, int) or version < 1:
        raise CCWSIMError(f"{name}: version {shown(version)} of the file is unknown; save it again")
    if version > VERSION:
        raise CCWSIMError(f"{name} was saved by a newer version of CCWSIM; update this version")


def _project(given: dict[str, Any], members: Mapping[str, bytes], name: str) -> Project:
    """Build a project from JSON and arrays; most classes check their values themselves."""
    image = _take(given, "training_image", dict)
    facies_names = [printable(text) for text in _texts(image, "facies_names")]
    texts = _take(given, "settings", dict)
    settings = {printable(key): _texts(texts, key) for key in texts}
    reader = StudyReader(settings, project=True)
    for key in REQUIRED:
        if not settings.get(key):
            raise CCWSIMError(f"{key} is missing in its settings; save it again")
    unknown = sorted(settings.keys() - KEYS)
    if unknown:
        raise refused("unknown_entry", unknown=shown(unknown[0]))
    grid, parameters = reader.part("grid", Grid(1, 1)), reader.part("parameters", Parameters())
    numbers = reader.part("study", Choices())
    n_data, columns = check_int("n_hard_data", given.get("n_hard_data"), 0), grid.n_dimensions + 1
    table = np.empty((0, columns), int)
    if n_data:
        table = _integers(members[DATA], f"{name}, {DATA}", 2)
    array = _integers(members[IMAGE], f"{name}, {IMAGE}", grid.n_dimensions, may_have_gaps=True)
    if table.shape != (n_data, columns):
        raise refused("number_of_data", n=n_data, file=DATA)
    image_name = printable(_take(image, "name", str))
    training_image = TrainingImage(array, name=image_name, facies_names=facies_names)
    arrays = {}
    if SECONDARY in members:
        arrays = npz_arrays(members[SECONDARY], f"{name}, {SECONDARY}", KINDS_OF_ARRAYS)
    study = Study(
        training_image,
        grid,
        parameters,
        HardData(table[:, :-1], table[:, -1]),
        numbers.seed,
        secondary_of_arrays(arrays, grid, training_image),
    )
    versions = {
        printable(key): printable(shown(value) if not isinstance(value, str) else value)
        for key, value in _take(given, "made_with", dict).items()
    }
    digest = printable(_take(given, "digest", str))
    return Project(study, numbers.n_realizations, settings, versions, digest)


def _as_json(project: Project) -> dict[str, Any]:
    study = project.study
    choices = Choices(
        grid=study.grid,
        parameters=study.parameters,
        n_realizations=project.n_realizations,
        seed=study.seed,
    )
    own = settings_of(choices, ("grid", "parameters", "study"))
    return {
        "format": FORMAT,
        "version": VERSION,
        "made_with": dict(project.versions),
        "training_image": {
            "name": study.training_image.name,
            "facies_names": list(study.training_image.facies_names),
        },
        "n_hard_data": study.hard_data.n,
        "settings": {**project.settings, **own},
        "digest": project.digest,
    }


def _npy(array: np.ndarray) -> bytes:
    content = BytesIO()
    np.save(content, array, allow_pickle=False)
    return content.getvalue()


def _npz(arrays: Mapping[str, np.ndarray]) -> bytes:
    content = BytesIO()
    np.savez_compressed(content, allow_pickle=False, **arrays)
    return content.getvalue()


def _integers(
    content: bytes, name: str, n_dimensions: int, may_have_gaps: bool = False
) -> np.ndarray:
    """Return integers, with NaN in the gaps of an image."""
    array = read_npy(content, name).variables["array"]
    gaps = may_have_gaps and array.dtype.kind == "f" and np.isnan(array).any()
    if (n_dimensions == 2 and len(array) != 1) or not (gaps or array.dtype.kind in "bui"):
        raise CCWSIMError(f"{name}: the array must have whole numbers in rows and columns")
    return array[0] if n_dimensions == 2 else array


def _members(content: bytes, name: str) -> dict[str, bytes]:
    """Return the members of a project file, after checking the sizes of all members."""
    if not content.startswith(b"PK"):
        raise CCWSIMError(f"{name} is not a project of CCWSIM; choose a saved project")
    with opened_archive(content, name) as archive:
        wanted = [STUDY, IMAGE, DATA]
        missing = [own for own in wanted if own not in archive.infos]
        wanted += [own for own in archive.infos if own == SECONDARY]
        if missing or archive.n_members > MAX_PROJECT_MEMBERS:
            what = f"{missing[0]} is missing" if missing else "it contains too many files"
            raise CCWSIMError(f"{name} is not a project of CCWSIM: {what}")
        archive.check(wanted)
        if archive.infos[STUDY].file_size > MAX_STUDY_BYTES:
            raise CCWSIMError(f"{name}: {STUDY} is too large for a study")
        return {own: archive.read(own) for own in wanted}


def _take(given: Mapping[str, Any], key: str, kind: type) -> Any:
    value = given.get(key)
    if not isinstance(value, kind):
        raise CCWSIMError(f"{key} is missing or broken in its settings; save it again")
    return value


def _texts(given: Mapping[str, Any], key: str) -> list[str]:
    texts = _take(given, key, list)
    if not all(isinstance(text, str) for text in texts):
        raise CCWSIMError(f"{key} must be a list of words; save it again")
    return [printable(text, MAX_LINK_LETTERS) for text in texts]
