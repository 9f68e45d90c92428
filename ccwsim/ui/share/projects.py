"""A study saved as a project file, and opened from one."""

from __future__ import annotations

import re
from dataclasses import replace

import ccwsim
from ccwsim.io import Project, read_project, training_image_as_bytes
from ccwsim.io.formats.classes import MAX_CODES
from ccwsim.model.bounds import MAX_GRID_SIDE_OFFERED, MAX_REALIZATIONS, MAX_SEED
from ccwsim.model.choices import Choices, DataChoice, ImageChoice, Upload
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.study import Study
from ccwsim.report import surroundings
from ccwsim.sharing import link_of, read_link
from ccwsim.ui.hard_data.edits import Editor, History
from ccwsim.ui.session.address import show, shown_of
from ccwsim.ui.session.resolve import data_of, image_of, opened
from ccwsim.ui.session.state import State
from ccwsim.ui.study.run import start_run


def study_of(choices: Choices) -> Study:
    """Return what a study comes to.

    Raises
    ------
    CCWSIMError
        Where its parts do not fit together.
    """
    image = image_of(choices.image)
    return Study(image, choices.grid, choices.parameters, data_of(choices), choices.seed)


def file_name(choices: Choices) -> str:
    """Return what the project file of a study is called."""
    name = re.sub(r"[^\w.-]+", "_", image_of(choices.image).name, flags=re.ASCII).strip("._")
    return f"{name[:40] or 'study'}.ccwsim"


def project_of(state: State) -> Project:
    """Return the study as a project."""
    choices, shown = state.choices, shown_of(state)
    ensemble = state.ensemble
    known = ensemble is not None and state.ran == choices and not ensemble.revised
    digest = ensemble.digest if ensemble is not None and known else ""
    return Project(
        study_of(choices), choices.n_realizations, choices.image.colours, shown,
        link_of(choices, shown), dict(surroundings()), digest,
    )  # fmt: skip


def open_project(state: State, upload: Upload) -> None:
    """Make the study of a project file the session's, and simulate it.

    Raises
    ------
    CCWSIMError
        For a file that cannot be read, or a study that is too large for a page; the session's
        study then stays as it is.
    """
    with opened(upload) as file:
        project = read_project(file)
    choices = choices_of(project)
    _check(choices)
    study_of(choices)
    state.choices, state.image_draft, state.data_draft = choices, None, None
    state.reference, state.page(Editor).history = None, History()
    state.notes = _notes(project, upload.name)
    show(state, project.shown)
    start_run(state)


def choices_of(project: Project) -> Choices:
    """Return a project as choices: by name what is bundled and the same, else what it brings."""
    study = project.study
    by_link, _, _ = read_link(project.link)
    image = _image(project, by_link.image)
    choices = Choices(
        image, by_link.data, study.grid, study.parameters, project.n_realizations, study.seed
    )
    try:
        same = data_of(choices).digest == study.hard_data.digest
    except CCWSIMError:
        same = False
    if same:
        return choices
    return replace(choices, data=DataChoice("placed", placed=study.hard_data))


def _image(project: Project, by_link: ImageChoice) -> ImageChoice:
    image = project.study.training_image
    its = image_of(by_link)
    if (its.digest, its.name, its.facies_names) == (image.digest, image.name, image.facies_names):
        return replace(by_link, colours=project.colours)
    upload = Upload(f"{image.name or 'image'}.npy", training_image_as_bytes(image, "npy"))
    answers = (("classes", "codes"),) if image.n_facies > MAX_CODES else ()
    return ImageChoice(
        upload=upload, answers=answers, names=image.facies_names, colours=project.colours
    )


def _check(choices: Choices) -> None:
    for name, value, most in (
        ("realizations", choices.n_realizations, MAX_REALIZATIONS),
        ("cells along a side of the grid", max(choices.grid.shape), MAX_GRID_SIDE_OFFERED),
        ("as seed", choices.seed, MAX_SEED),
    ):
        if value > most:
            raise CCWSIMError(
                f"{value} {name} are more than a page takes ({most}); simulate this project with "
                "python -m ccwsim simulate --project"
            )


def _notes(project: Project, name: str) -> tuple[str, ...]:
    own = f"ccwsim {ccwsim.__version__}"
    made = project.versions.get("Program", own)
    if made == own:
        return ()
    return (f"{name} was saved with {made}; this is {own}, which may draw other realizations.",)
