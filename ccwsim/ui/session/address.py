"""The address (URL) of a page describes the study, and is updated with every change."""

from contextlib import suppress
from dataclasses import replace
from itertools import islice
from secrets import randbelow
from urllib.parse import urlencode

import streamlit as st
from streamlit.errors import StreamlitAPIException

from ccwsim import Parameters
from ccwsim.model import MAX_LINK_VALUES, MAX_SEED, describe_shape
from ccwsim.sharing.choices import Choices, DataChoice, GuideChoice, ImageChoice, Shown
from ccwsim.sharing.link import first_values, link_of, meant, missing_parts, read_link
from ccwsim.ui.session.kept import drafts_for_reload, keep_for_reload, kept_for_reload
from ccwsim.ui.session.resolve import data_of, fitted_to_image, image_of, secondary_of
from ccwsim.ui.session.state import State
from ccwsim.ui.widgets import page_text, problem_in

CLASS = "class"  # key in the query of a link that gives each reader of the link a different seed
MIN_OWN_SEED = 1000  # minimum random seed for a reader; seeds typed by people are usually smaller


def take_address(state: State) -> None:
    """Start the study described by the address of the page, and note parts that cannot be used."""
    query, available = _query(), kept_for_reload()
    choices, shown, notes = read_link(query, available)
    choices, changes = made_consistent(own_seed(state, choices))
    state.choices, state.notes = choices, (*notes, *changes)
    state.missing = missing_parts(query, available)
    state.needs_confirmation = True
    show(state, shown)
    image_draft, data_draft = drafts_for_reload(choices)
    state.image_draft = image_draft if isinstance(image_draft, ImageChoice) else None
    state.data_draft = data_draft if isinstance(data_draft, DataChoice) else None


def own_seed(state: State, choices: Choices) -> Choices:
    """Return the study; if the address has the key `CLASS`, the reader gets a random seed."""
    if st.query_params.get(CLASS) != "1":
        return choices
    del st.query_params[CLASS]
    state.own_seed = MIN_OWN_SEED + randbelow(MAX_SEED - MIN_OWN_SEED)
    return replace(choices, seed=state.own_seed)


def made_consistent(choices: Choices) -> tuple[Choices, tuple[str, ...]]:
    """Return choices changed so that their parts fit together, and notes about the changes."""
    notes = []
    fitting = fitted_to_image(choices, image_of(choices.image))
    if fitting.grid != choices.grid and choices.grid != Choices().grid:
        before, after = describe_shape(choices.grid.shape), describe_shape(fitting.grid.shape)
        notes.append(page_text("Grid of a link", before=before, after=after))
    linked, fitted = choices.parameters, fitting.parameters
    if linked != fitted and linked != Parameters():
        notes.append(page_text("Sizes of a link", own=linked, other=fitted))
    if problem := problem_in(lambda: data_of(fitting)):
        notes.append(f"The hard data are ignored. {problem[:1].upper()}{problem[1:]}.")
        fitting = replace(fitting, data=DataChoice())
    if problem := problem_in(lambda: secondary_of(fitting)):
        notes.append(f"The guides are ignored. {problem[:1].upper()}{problem[1:]}.")
        fitting = replace(fitting, guides=GuideChoice())
    return fitting, tuple(notes)


def show(state: State, shown: Shown) -> None:
    """Show the parts of the results that the link selects."""
    image, state.facies_image = state.image, ""
    state.shown, state.e_type = shown.realization, shown.e_type
    state.threshold = shown.threshold
    state.flow, state.compare, state.sweep = shown.flow, shown.compare, shown.sweep
    state.choose_facies(image)
    if shown.facies is not None:
        state.facies = min(shown.facies, image.n_facies - 1)


def shown_of(state: State) -> Shown:
    """Return the parts of the results that are on the page; the usual facies is left out."""
    image = state.image
    is_usual = state.facies_image != image.digest or state.facies == image.facies_of_interest
    return Shown(
        realization=state.shown,
        facies=None if is_usual else state.facies,
        e_type=state.e_type,
        threshold=state.threshold,
        flow=state.flow,
        compare=state.compare,
        sweep=state.sweep,
    )


def follow_study(state: State) -> None:
    """Write the study into the query of the address, without redrawing the page."""
    keep_for_reload(state.choices, state.image_draft, state.data_draft)
    query = first_values(_query().items())
    unrelated = {name: values for name, values in query.items() if not meant(name)}
    new_query = {**unrelated, **link_of(state.choices, shown_of(state))}
    new_query |= {key: [text] for key, text in state.missing.items()}
    text = urlencode(new_query, doseq=True)
    # the browser may report an older address than the address sent last
    if text != state.address or new_query != query:
        st.query_params.from_dict(new_query)
        state.address = text


def page_link_of(choices: Choices, shown: Shown) -> str:
    """Return the complete address that opens a study on this page."""
    text = urlencode(link_of(choices, shown), doseq=True)
    page = (st.context.url or "").split("?")[0]
    return f"{page}?{text}" if text else page or "?"


def _query() -> dict[str, list[str]]:
    """Return the query of the address without the names after the first name that is too many."""
    names = islice(st.query_params, MAX_LINK_VALUES + 1)
    return {name: st.query_params.get_all(name) for name in names}


def page_link(page: str, label: str) -> None:
    """Draw a link to another page, if the pages run together as an app."""
    with suppress(StreamlitAPIException, KeyError):
        st.page_link(page, label=label)


def go_to(page: str, instead: str = "") -> None:
    """Open another page or, if this page runs without the app, show the text `instead`."""
    with suppress(StreamlitAPIException, KeyError):
        st.switch_page(page)
        return
    if instead:
        st.info(instead)
