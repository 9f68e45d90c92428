"""Everything a session remembers, in one typed object that survives page changes."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

import streamlit as st

from ccwsim.model.choices import Choices, DataChoice, EMap, ImageChoice
from ccwsim.model.ensemble import Ensemble
from ccwsim.model.training_image import TrainingImage
from ccwsim.ui.jobs.job import Job
from ccwsim.ui.session.past_runs import PastRuns

KEY = "ccwsim"
PageState = TypeVar("PageState")


@dataclass
class State:
    """What a session remembers.

    Attributes
    ----------
    choices : Choices
        The study as it is set up; always one that can be read.
    image_draft, data_draft : optional
        A choice that cannot be used yet, because a file is broken or a question is open.
    live : bool
        Whether every change starts a run.
    job : Job or None
        The simulation that runs now.
    tried : Choices or None
        What a run was started with last, whatever came of it.
    ensemble : Ensemble or None
        The latest results, and the `ran` choices they came from.
    message : str
        What went wrong or was stopped, to be said above the results.
    shown : int
        Which realization is large.
    wanted : int
        Which was large when the latest run started: it is again as soon as the run has it.
    facies : int
        The place of the facies whose curves and probability are shown.
    e_type : str
        What the uncertainty map shows: "probability", "most likely" or "entropy".
    chart_format : str
        How a chart saves itself: "svg" or "png".
    reference : TrainingImage or None
        The hidden truth that the hard data were sampled from, to score realizations against.
    runs : PastRuns
        The runs of this session, to go back to.
    pages : dict
        What single pages remember, by type; see `page`.
    own_seed : int or None
        The seed of this reader where a class shares a study; None outside of one.
    address : str
        What was last written behind the address of the page.
    told : tuple of str
        What of an address or a project could not be taken, to be said until it is read.
    opened : pair of str
        The project file that was opened last, and why it could not be.
    """

    choices: Choices = field(default_factory=Choices)
    image_draft: ImageChoice | None = None
    data_draft: DataChoice | None = None
    live: bool = False
    job: Job[Ensemble] | None = None
    tried: Choices | None = None
    ensemble: Ensemble | None = None
    ran: Choices | None = None
    message: str = ""
    shown: int = 0
    wanted: int = 0
    facies: int = 1
    e_type: EMap = "probability"
    chart_format: str = "svg"
    reference: TrainingImage | None = None
    runs: PastRuns = field(default_factory=PastRuns)
    pages: dict[type, Any] = field(default_factory=dict)
    own_seed: int | None = None
    address: str = ""
    told: tuple[str, ...] = ()
    opened: tuple[str, str] = ("", "")

    def page(self, kind: type[PageState]) -> PageState:
        """Return what a page remembers; `kind` is the type of it, made without arguments."""
        return self.pages.setdefault(kind, kind())

    def change(self, **changes: Any) -> None:
        """Replace some of the choices."""
        self.choices = replace(self.choices, **changes)


def session_state() -> State:
    """Return the state of this session; a new session gets the default study."""
    if KEY not in st.session_state:
        st.session_state[KEY] = State()
    return st.session_state[KEY]
