"""The parts of validation below the first screen, each worked out when it comes into view."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape

import streamlit as st

from ccwsim.ui.session.guarding import error_boundary
from ccwsim.ui.session.state import State
from ccwsim.ui.validate.copying import draw_reuse
from ccwsim.ui.validate.data import draw_data
from ccwsim.ui.validate.directions import draw_directions, draw_transitions
from ccwsim.ui.validate.geobodies import draw_bodies
from ccwsim.ui.validate.image import draw_image
from ccwsim.ui.validate.large_ensemble import draw_long_run
from ccwsim.ui.validate.patterns import draw_patterns
from ccwsim.ui.validate.reference import draw_reference
from ccwsim.ui.validate.state import Validation
from ccwsim.ui.validate.uncertainty import draw_uncertainty
from ccwsim.ui.widgets.maps import canvas_component

Draw = Callable[[State, Sequence[str]], None]


@dataclass(frozen=True)
class Section:
    """A part of the page: its anchor, its title, what it says, and what draws it."""

    name: str
    title: str
    text: str
    draw: Draw


SECTIONS = (
    Section("uncertainty", "Uncertainty", "where the realizations agree", draw_uncertainty),
    Section("bodies", "Proportions and bodies", "how much, in how many pieces", draw_bodies),
    Section("patterns", "Patterns", "how varied, and how like the training image", draw_patterns),
    Section("data", "Hard data", "whether and how they were met", draw_data),
    Section("directions", "Any direction", "variograms over all lags", draw_directions),
    Section("transitions", "Transiograms", "which facies follows which", draw_transitions),
    Section("reuse", "Re-use", "what was copied from the training image", draw_reuse),
    Section("truth", "Hidden truth", "scores where the true field is known", draw_reference),
    Section("image", "Training image", "what it is like, and what suits it", draw_image),
    Section("long", "Long run", "statistics of thousands, none kept", draw_long_run),
)


def draw_links() -> None:
    """Draw links to all sections."""
    links = "".join(f'<a href="#{s.name}" target="_self">{escape(s.title)}</a>' for s in SECTIONS)
    st.html(f'<nav class="sections" aria-label="On this page">{links}</nav>')


def draw_sections(state: State, colours: Sequence[str]) -> None:
    """Draw all sections that came into view, and ghosts of the others."""
    for section in SECTIONS:
        with st.container(key=f"section_{section.name}"):
            _section(state, section, colours)
    _watch(state)


def _section(state: State, section: Section, colours: Sequence[str]) -> None:
    st.html(
        f'<h2 class="section" id="{section.name}">{escape(section.title)}'
        f"<span>{escape(section.text)}</span></h2>"
    )
    if section.name not in state.page(Validation).seen:
        st.html('<div class="unseen"></div>')
        return
    with error_boundary():
        section.draw(state, colours)


def _watch(state: State) -> None:
    page_state = state.page(Validation)
    unseen = [section.name for section in SECTIONS if section.name not in page_state.seen]

    def seen() -> None:
        page_state.seen |= set(st.session_state["seen"].seen or ()) & set(unseen)

    if unseen:
        canvas_component("seen")(key="seen", data={"unseen": unseen}, on_seen_change=seen)
