"""The page to import files, with a part for the training image and a part for hard data."""

from dataclasses import dataclass
from typing import Any, Literal

import streamlit as st

from ccwsim.sharing.choices import DataChoice
from ccwsim.ui.imports.image import draw_image_import
from ccwsim.ui.imports.wells import draw_wells_import
from ccwsim.ui.session.fragments import error_boundary
from ccwsim.ui.session.state import State
from ccwsim.ui.widgets.fields import bound_to, field, options_of

KINDS = {False: "one table or grid", True: "tables of collars, intervals and surveys"}
SUBJECTS = {"image": "Training image", "data": "Hard data"}


@dataclass
class Imports:
    """The state of the page Import."""

    subject: Literal["image", "data"] = "image"
    draft: DataChoice | None = None  # choice of hard data when the page was last drawn
    tables: bool | None = None  # whether wells are in several tables; None means as in the study


def draw_imports(state: State) -> None:
    """Draw the page."""
    page_state = state.page(Imports)
    if state.data_draft is not page_state.draft:  # data that wait for confirmation are shown first
        page_state.subject = "data" if state.data_draft else page_state.subject
        page_state.draft, page_state.tables = state.data_draft, None
    subject = bound_to(page_state, "subject") | options_of(SUBJECTS)
    subject["label_visibility"] = "collapsed"
    field(st.segmented_control, "What is brought", key="import_subject", **subject)
    with error_boundary():
        if page_state.subject == "image":
            draw_image_import(state)
        else:
            draw_wells_import(state, _tables(state, page_state))


def _tables(state: State, page_state: Imports) -> bool:
    """For a volume, ask whether wells are in one table or in several, and return the answer."""
    own = (state.data_draft or state.choices.data).tables is not None
    if state.choices.grid.nz is None and not own:
        return False
    tables = own if page_state.tables is None else page_state.tables
    choice: dict[str, Any] = bound_to(page_state, "tables") | options_of(KINDS)
    choice["value"] = tables
    field(st.segmented_control, "The data are", key="import_tables", **choice)
    return tables
