"""The page that takes files: a training image here, hard data there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import streamlit as st

from ccwsim.model.choices import DataChoice
from ccwsim.ui.imports.image import draw_image_import
from ccwsim.ui.imports.wells import draw_wells_import
from ccwsim.ui.session.fragments import error_boundary
from ccwsim.ui.session.state import State
from ccwsim.ui.widgets.fields import bound_to, field, options_of

SUBJECTS = {"image": "Training image", "data": "Hard data"}


@dataclass
class Imports:
    """What this page remembers."""

    subject: Literal["image", "data"] = "image"
    draft: DataChoice | None = None  # of hard data, as it was when the page was drawn last


def draw_imports(state: State) -> None:
    """Draw the page."""
    page_state = state.page(Imports)
    if state.data_draft is not page_state.draft:  # data that wait are what a reader comes for
        page_state.subject = "data" if state.data_draft else page_state.subject
        page_state.draft = state.data_draft
    subject = bound_to(page_state, "subject") | options_of(SUBJECTS)
    subject["label_visibility"] = "collapsed"
    field(st.segmented_control, "What is brought", key="import_subject", **subject)
    draw = draw_image_import if page_state.subject == "image" else draw_wells_import
    with error_boundary():
        draw(state)
