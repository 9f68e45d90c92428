"""The menu "Share": link, project, report, and the same in Python and on the command line."""

from __future__ import annotations

from dataclasses import replace

import streamlit as st

from ccwsim.figures import facies_colours
from ccwsim.io import project_as_bytes
from ccwsim.model.choices import Choices, Upload
from ccwsim.model.errors import CCWSIMError
from ccwsim.report import report_html
from ccwsim.sharing import REVISED, Recipe, left_out, reproduction_recipe, study_report
from ccwsim.ui.session.address import page_link_of, shown_of
from ccwsim.ui.session.fragments import error_boundary
from ccwsim.ui.session.state import State
from ccwsim.ui.share.projects import file_name, open_project, project_of, study_of
from ccwsim.ui.widgets.facts import facts_of
from ccwsim.ui.widgets.literal import plain
from ccwsim.ui.widgets.steps import step_note


@st.fragment
def draw_share(state: State) -> None:
    """Draw the menu; what is in it is worked out when it is opened."""
    with error_boundary():
        _menu(state)


def _menu(state: State) -> None:
    menu = st.popover("Share", key="share", on_change="rerun")
    if not menu.open:
        return
    with menu, st.container(key="share_body", gap="small"):
        try:
            study = study_of(state.choices)
            how = reproduction_recipe(state.choices, study, file_name(state.choices))
        except CCWSIMError as error:
            st.error(plain(f"{error}. Correct the study before it is shared."))
        else:
            _link(state)
            _files(state)
            _again(how)
        _open(state)


def _link(state: State) -> None:
    _title("Link to this study")
    st.code(page_link_of(state.choices, shown_of(state)), language=None, wrap_lines=False)
    missing = left_out(state.choices)
    if missing:
        step_note(f"The link cannot carry {' and '.join(missing)}. Save the project for that.")
    if state.ensemble is not None and state.ensemble.revised:
        step_note(REVISED)


def _files(state: State) -> None:
    project = project_of(state)
    with st.container(horizontal=True, gap="small"):
        st.download_button(
            "Save project", lambda: project_as_bytes(project), file_name=file_name(state.choices),
            mime="application/octet-stream", key="share_save", on_click="ignore",
        )  # fmt: skip
        st.download_button(
            "Report", report_of(state), file_name="ccwsim-report.html", mime="text/html",
            key="share_report", on_click="ignore", disabled=state.ensemble is None,
            help="One HTML file that opens offline, with all maps and charts",
        )  # fmt: skip
    if state.ensemble is None:
        step_note("The report can be had when there are realizations.")
    elif results_of(state) != state.choices:
        step_note("The report is of the realizations that are shown; the study was changed since.")


def report_of(state: State):
    """Return what makes the report of the latest results, for a download; b"" without any."""
    ensemble = state.ensemble
    if ensemble is None:
        return b""
    choices = results_of(state)
    shown, facts = shown_of(state), facts_of(ensemble)
    colours = facies_colours(ensemble.training_image, dict(choices.image.colours))
    here = page_link_of(choices, shown)

    def made() -> bytes:
        how = reproduction_recipe(choices, study_of(choices), file_name(choices))
        document = study_report(ensemble, choices, shown, colours, facts, here, how)
        return report_html(document).encode()

    return made


def results_of(state: State) -> Choices:
    """Return the choices that the latest results came from."""
    ensemble, ran = state.ensemble, state.ran or state.choices
    if ensemble is None or not ensemble.revised:
        return ran
    # re-simulated realizations answer edits of the data that were made since the run
    return replace(ran, data=state.choices.data)


def _again(how: Recipe) -> None:
    with st.expander("The same in Python"):
        st.code(how.python.rstrip(), language="python")
        if how.python_needs_project:
            step_note("It reads the project file: save it beside the script.")
    with st.expander("The same on the command line"):
        st.code(how.command, language="bash")
        if how.command_needs_project:
            step_note("It reads the project file: save it where the command is given.")


def _open(state: State) -> None:
    _title("Open a project")
    file = st.file_uploader(
        "Open a project", type=["ccwsim"], key="share_open", label_visibility="collapsed"
    )
    if file is None:
        return
    if file.file_id != state.opened[0]:
        state.opened = file.file_id, ""
        try:
            open_project(state, Upload(file.name, file.getvalue()))
        except CCWSIMError as error:
            state.opened = file.file_id, f"{error}. The study stays as it was."
        else:
            st.rerun()
    if state.opened[1]:
        st.error(plain(state.opened[1]))


def _title(words: str) -> None:
    st.html(f'<div class="share-title">{words}</div>')
