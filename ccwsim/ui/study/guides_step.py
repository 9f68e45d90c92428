"""The guides of a study in words, and why guides do not fit; the page Guides changes them."""

from dataclasses import replace

import streamlit as st

from ccwsim.sharing.choices import Choices, GuideChoice
from ccwsim.ui.session import CHOOSE, NO_FILE_YET, State, fitting_grids, page_link, secondary_of
from ccwsim.ui.study.asking import draw_fits, keep_button
from ccwsim.ui.study.questions import IN_SCRIPTS
from ccwsim.ui.widgets import button, if_possible, in_row, plain, problem_in, step_note

GUIDES_PAGE = "pages/guides.py"


def guides_step(state: State) -> None:
    """Draw a link to the page of guides, the guides in words, and why they do not fit."""
    problem = settle_guides(state)
    with in_row("guides"):
        page_link(GUIDES_PAGE, "Guides")
        draw_guides_in_use(state)
    if problem:
        draw_problem_of_guides(state, problem)


def draw_guides_in_use(state: State) -> None:
    """Describe the guides of the study, and draw a button that removes all guides."""
    guides = state.choices.guides
    secondary = if_possible(lambda: secondary_of(state.choices))
    words = secondary.describe() or "nothing drawn yet" if secondary else "none in use"
    step_note(f"From the project: {words}" if guides.saved else words)
    if state.guides_draft is not None or not guides.is_empty:
        button("No guides", key="guides_none", on_click=use_guides, args=(state, GuideChoice()))


def draw_problem_of_guides(state: State, problem: str) -> None:
    """Show why guides do not fit, or which file is needed, with a button that discards a draft."""
    if problem.endswith(NO_FILE_YET) or CHOOSE in problem:
        step_note(f"{problem[:1].upper()}{problem[1:]}.")
    else:
        st.error(plain(problem))
        guides = state.guides_draft or state.choices.guides
        grids, names = fitting_grids(state.choices, guides), [file.name for file in guides.files]
        of_files = {k: g for k, g in grids.items() if k in names and g != state.grid}
        draw_fits(state, of_files, "guides_to_")
    keep_button(state, "guides_draft", "guides_keep")


def use_guides(state: State, choice: GuideChoice) -> None:
    """Use a choice of guides in the study if it fits the study; otherwise keep it as a draft."""
    changed = replace(state.choices, guides=choice)
    fits = not problem_of_guides(changed)
    state.guides_draft = None if fits else choice
    if fits:
        state.choices = changed


def problem_of_guides(choices: Choices) -> str:
    """Return the reason why the guides of a study cannot be used, or an empty text."""
    return IN_SCRIPTS.sub("", problem_in(lambda: secondary_of(choices)))


def settle_guides(state: State) -> str:
    """Use a draft if it fits the study by now; otherwise return why the latest guides do not."""
    guides = state.guides_draft or state.choices.guides
    problem = problem_of_guides(replace(state.choices, guides=guides))
    if not problem and state.guides_draft is not None:
        use_guides(state, guides)
    return problem
