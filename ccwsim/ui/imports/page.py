"""The page that takes files: a training image here, hard data there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import streamlit as st

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


def draw_imports(state: State) -> None:
    """Draw the page."""
    page_state = state.page(Imports)
    subject = bound_to(page_state, "subject") | options_of(SUBJECTS)
    subject["label_visibility"] = "collapsed"
    field(st.segmented_control, "What is brought", key="import_subject", **subject)
    draw = draw_image_import if page_state.subject == "image" else draw_wells_import
    with error_boundary():
        draw(state)
