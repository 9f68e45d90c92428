"""The menus "Share" (link, project, report, script and command of a study) and "Open"."""

from dataclasses import replace
from functools import partial

import streamlit as st

import ccwsim
from ccwsim import CCWSIMError, TrainingImage
from ccwsim.figures import facies_colours
from ccwsim.io import training_image_as_bytes
from ccwsim.model import MAX_CODES, MAX_GRID_SIDE_OFFERED, MAX_REALIZATIONS, MAX_SEED
from ccwsim.report.document import report_html, surroundings
from ccwsim.sharing.choices import (
    Answers,
    Choices,
    DataChoice,
    GuideChoice,
    ImageChoice,
    Shown,
    Upload,
)
from ccwsim.sharing.link import link_settings, parts_left_out, read_link
from ccwsim.sharing.project import Project, project_as_bytes, read_project
from ccwsim.sharing.recipe import Recipe, reproduction_recipe
from ccwsim.sharing.study_report import study_report
from ccwsim.ui.hard_data.edits import Editor, History
from ccwsim.ui.session import (
    State,
    error_boundary,
    image_of,
    image_part,
    opened,
    page_link_of,
    show,
    shown_of,
    start_afresh,
    study_of,
    study_part,
    upload_of,
    wells_of,
)
from ccwsim.ui.study.run import is_current, question_of, start_run, stop_run
from ccwsim.ui.widgets import button, download, facts_of, in_row, page_text, plain, step_note

REPORT_HEIGHT = 720  # height of a report on the page in pixels; longer reports scroll
READING = "report_is_read"


@st.fragment
def draw_share(state: State) -> None:
    """Draw the menu "Share", whose content is computed when the menu is opened."""
    with error_boundary():
        _share(state)


@st.fragment
def draw_open(state: State) -> None:
    """Draw the menu that opens a project."""
    with error_boundary(), st.popover("Open", key="open"):
        _open(state)
        help_ = "Deletes the study and the runs of this session, and opens the default study."
        button("Start afresh", key="afresh", on_click=start_afresh, help=help_)


def _share(state: State) -> None:
    menu = st.popover("Share", key="share", on_change="rerun")
    if st.session_state.pop(READING, False):
        _show_report(state)
    if not menu.open:
        return
    with menu, st.container(key="share_body", gap="small"):
        try:
            study = study_of(state.choices)
            recipe = reproduction_recipe(state.choices, study, file_name(state.choices))
        except CCWSIMError as error:
            st.error(plain(f"{error}. Correct the study before you share it."))
            return
        _title("Link to this study")
        st.code(page_link_of(state.choices, shown_of(state)), language=None, wrap_lines=True)
        if missing := parts_left_out(state.choices):
            step_note(f"The link cannot contain {' and '.join(missing)}. Save a project instead.")
        if state.ensemble is not None and not is_current(state):
            step_note(page_text("Outdated link"))
        _files(state)
        _draw_recipe(recipe)


def _files(state: State) -> None:
    project = project_of(state)
    with in_row(align="top"):
        content = partial(project_as_bytes, project)
        download("Save project", content, file_name(state.choices), key="share_save")
        name = "ccwsim" if state.ensemble is None else study_part(state.ensemble)
        download(
            "Report",
            report_of(state),
            f"{name}_report.html",
            key="share_report",
            disabled=state.ensemble is None,
            help="One HTML file that opens offline, with all maps and charts",
        )
        button(
            "Read it here",
            key="share_read",
            on_click=_read_report,
            disabled=state.ensemble is None,
        )
    if state.ensemble is None:
        step_note("A report needs realizations; simulate some first.")
    elif not is_current(state):
        step_note("The report describes the realizations on the page; the study has changed since.")


def _read_report() -> None:
    """Close the menu, so that closing the report does not need two clicks."""
    st.session_state["share"], st.session_state[READING] = False, True


@st.dialog("Report", width="large")
def _show_report(state: State) -> None:
    """Show the report in a dialog; the report's content policy blocks network access."""
    with error_boundary():
        make_report = report_of(state)
        if make_report:
            st.iframe(
                make_report().decode(), height=REPORT_HEIGHT, alt="The report of the realizations"
            )


def report_of(state: State):
    """Return a function that makes the report of the latest results, or b"" without results."""
    ensemble = state.ensemble
    if ensemble is None:
        return b""
    choices = state.ensemble_choices or state.choices
    shown, facts = shown_of(state), facts_of(ensemble)
    colours = facies_colours(ensemble.training_image, dict(choices.image.colours))
    link = page_link_of(choices, shown)

    def make_report() -> bytes:
        document = study_report(
            ensemble,
            choices,
            shown,
            colours,
            facts=facts,
            link=link,
            recipe=reproduction_recipe(choices, study_of(choices), file_name(choices)),
            wells=wells_of(choices),
        )
        return report_html(document).encode()

    return make_report


def _draw_recipe(recipe: Recipe) -> None:
    with st.expander("This study in Python"):
        st.code(recipe.python.rstrip(), language="python", wrap_lines=True)
        if recipe.python_needs_project:
            step_note("The script reads the project file. Save both in the same folder.")
    with st.expander("This study on the command line"):
        st.code(recipe.command, language="bash", wrap_lines=True)
        if recipe.command_needs_project:
            step_note("The command reads the project file. Save the file in the current folder.")


def _open(state: State) -> None:
    _title("Open a project")
    step_note("A .ccwsim file, saved with “Save project” under Share. It replaces the study.")
    file = st.file_uploader(
        "Open a project", type=["ccwsim"], key="share_open", label_visibility="collapsed"
    )
    if file is None:
        return
    if file.file_id != state.opened[0]:
        state.opened = file.file_id, ""
        try:
            open_project(state, upload_of(file))
        except CCWSIMError as error:
            state.opened = file.file_id, f"{error}. The study is unchanged."
        else:
            st.rerun()
    if state.opened[1]:
        st.error(plain(state.opened[1]))


def _title(text: str) -> None:
    st.html(f'<div class="share-title">{text}</div>')


def file_name(choices: Choices) -> str:
    """Return the name of the project file of a study."""
    return f"{image_part(image_of(choices.image))}.ccwsim"


def project_of(state: State) -> Project:
    """Return the study as a project."""
    choices, shown = state.choices, shown_of(state)
    ensemble = state.ensemble
    digest = ensemble.digest if ensemble is not None and is_current(state) else ""
    return Project(
        study_of(choices),
        choices.n_realizations,
        settings=link_settings(choices, ("shown",), shown),
        versions=dict(surroundings()),
        digest=digest,
        choices=choices,
    )


def open_project(state: State, upload: Upload) -> None:
    """Open a project's study and start a run, or raise an error and change nothing."""
    with opened(upload) as file:
        project = file.read_with(read_project)
    choices, shown = choices_of(project)
    _check(choices)
    study_of(choices)
    state.choices, state.image_draft, state.data_draft = choices, None, None
    state.guides_draft = None
    state.reference, state.page(Editor).history = None, History()
    state.notes = _notes(project, upload.name)
    show(state, shown)
    state.needs_confirmation = True
    if question_of(state):
        stop_run(state)  # the running job belongs to the earlier study
    else:
        start_run(state)


def choices_of(project: Project) -> tuple[Choices, Shown]:
    """Return a project as choices, which a project of a script does not have, and `Shown`."""
    study = project.study
    data = DataChoice("placed", placed=study.hard_data) if study.hard_data.n else DataChoice()
    choices = project.choices or Choices(
        image=_image(study.training_image), data=data, guides=GuideChoice(saved=study.secondary)
    )
    choices = replace(
        choices,
        grid=study.grid,
        parameters=study.parameters,
        n_realizations=project.n_realizations,
        seed=study.seed,
    )
    return choices, read_link(project.settings)[1]


def _image(image: TrainingImage) -> ImageChoice:
    upload = Upload(f"{image.name or 'image'}.npy", training_image_as_bytes(image, "npy"))
    answers: Answers = (("name", image.name),)  # the name of a file is cut at "/"
    answers += (("classes", "codes"),) if image.n_facies > MAX_CODES else ()
    if image.numbering != "codes":
        answers += (("numbering", image.numbering),)
    if image.n_dimensions == 3:
        answers += (("volume", True),)
    return ImageChoice(upload=upload, answers=answers, names=image.facies_names)


def _check(choices: Choices) -> None:
    for name, value, limit in (
        ("realizations", choices.n_realizations, MAX_REALIZATIONS),
        ("cells along a side of the grid", max(choices.grid.shape), MAX_GRID_SIDE_OFFERED),
        ("as seed", choices.seed, MAX_SEED),
    ):
        if value > limit:
            raise CCWSIMError(
                f"{value} {name} are more than the dashboard allows ({limit}); simulate this "
                "project with python -m ccwsim simulate --project"
            )


def _notes(project: Project, name: str) -> tuple[str, ...]:
    present = f"ccwsim {ccwsim.__version__}"
    saved = project.versions.get("Program", present)
    if saved == present:
        return ()
    return (
        f"{name} was saved with {saved}. This is {present}, which may give different realizations.",
    )
