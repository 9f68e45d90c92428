"""The elements that all pages have: title, style, menu, and the state of the session."""

from collections.abc import Callable
from pathlib import Path

import streamlit as st

from ccwsim.jobs.scheduler import PAGE_TURNS
from ccwsim.sharing.link import link_of
from ccwsim.ui.frontend.component import run_script
from ccwsim.ui.session import (
    KEY,
    State,
    bound_uploads,
    cookies,
    error_boundary,
    is_new,
    page_link,
    session_state,
    settle_server,
    shown_of,
    take_address,
)
from ccwsim.ui.share.menu import draw_open, draw_share
from ccwsim.ui.study.guides_step import GUIDES_PAGE
from ccwsim.ui.study.image_step import IMPORT_PAGE
from ccwsim.ui.study.run import SIMULATE_PAGE
from ccwsim.ui.widgets import button, how_tos, in_row, own_colours, page_text, plain, theme_name

LOGO_FOLDER = Path(__file__).parents[1] / "assets"
STYLE = Path(__file__).with_name("style.css")
MENU_SCRIPT = Path(__file__).with_name("menu.js")
STUDY_WIDTH = 336  # width of the study column in pixels
PAGES = (
    ("Simulate", SIMULATE_PAGE),
    ("Hard data", "pages/data.py"),
    ("Guides", GUIDES_PAGE),
    ("Validate", "pages/validate.py"),
    ("Compare", "pages/compare.py"),
    ("Sweep", "pages/sweep.py"),
    ("Flow", "pages/flow.py"),
    ("Examples", "pages/examples.py"),
    ("How it works", "pages/how_it_works.py"),
    ("The paper's and ours", "pages/paper_and_ours.py"),
    ("Paper", "pages/paper.py"),
    ("Benchmark", "pages/benchmark.py"),
)
"""Names and files of the pages in the menu (`st.navigation` hides names in narrow windows)."""
MENU = {
    "Simulate": PAGES[:1],
    "Data": PAGES[1:3],
    "Check": PAGES[3:6],
    "Use": PAGES[6:7],
    "Learn": PAGES[7:],
    "Menu": PAGES[6:],
}
"""Pages by purpose; on phones, “Menu” replaces the groups after the third."""
OFF_MENU = (("Import", IMPORT_PAGE),)
"""Pages that are not in the menu; steps in the study column link to these pages."""


def show_page(title: str, body: Callable[[State], None]) -> None:
    """Draw a page as soon as it is its turn; `body` is called with the state of the session."""
    st.html(f"<style>{own_colours()}\n{STYLE.read_text('utf-8')}</style>")
    place = st.empty()
    if KEY not in st.session_state:
        place.html(f'<p class="note" role="status">{page_text("Loading", page=title)}</p>')
    with PAGE_TURNS.turn():
        place.empty()
        _draw_page(title, body)


def _draw_page(title: str, body: Callable[[State], None]) -> None:
    """Configure the page, draw the menu, and call `body` with the state of the session."""
    st.set_page_config(
        page_title=f"{title} · CCWSIM",
        page_icon=str(LOGO_FOLDER / "logo-mark.svg"),
        layout="wide",
        initial_sidebar_state=STUDY_WIDTH,
    )
    st.logo(str(LOGO_FOLDER / f"logo-{theme_name()}.svg"), size="large")
    # because the theme is read, Streamlit redraws the page when the user switches the theme
    run_script("theme", "theme", theme=theme_name())
    if title != "Hard data":  # its canvas has its own undo
        run_script("undo", "undo_key", lambda _: session_state().undo())
    settle_server()
    bound_uploads()
    first = KEY not in st.session_state
    state = session_state()
    if first:
        state.welcome = is_new()
        with error_boundary():
            take_address(state)
    if title != PAGES[0][0] or link_of(state.choices, shown_of(state)):
        state.welcome = False
    run_script("cookie", "cookie", cookies=cookies(used=not state.welcome))
    with error_boundary():
        _top(title, state)
    with error_boundary(whole=True):
        body(state)


def _top(title: str, state: State) -> None:
    """Draw the menus (pages, Share, Open, How to) and notes about the page address."""
    with in_row("top"):
        _menu(title)
        draw_share(state)
        draw_open(state)
        _draw_how_to(title)
    if state.notes:
        with in_row("told"):
            st.warning("\n".join(f"- {plain(note)}" for note in state.notes))
            button("Close", key="told_close", on_click=setattr, args=(state, "notes", ()))


def _menu(title: str) -> None:
    """Draw the groups of pages: a group of one page as a link, another group as a menu."""
    with in_row("menu", "top"):
        for name, pages in MENU.items():
            if len(pages) == 1:
                [(label, path)] = pages
                page_link(path, label)
                continue
            is_present = title in dict(pages)
            # with the page in its key, the menu is closed on the next page
            with st.popover(f"**{name}**" if is_present else name, key=f"menu_{name}_{title}"):
                for label, path in pages:
                    page_link(path, label)
        script = MENU_SCRIPT.read_text("utf-8")
        st.html(f"<script>{script}</script>", unsafe_allow_javascript=True)


@st.fragment
def _draw_how_to(title: str) -> None:
    """Draw a menu with the how-to of the page `title`, followed by the how-tos of other pages."""
    with error_boundary():
        titles = list(how_tos())
        if title not in titles:
            return
        menu = st.popover("How to", key="how_to", on_change="rerun", help="How to use this page")
        if not menu.open:
            return
        with menu, st.container(key="how_to_text", gap="small"):
            chosen = st.selectbox(
                "How to use",
                titles,
                titles.index(title),
                key=f"how_to_{title}",
                label_visibility="collapsed",
            )
            st.markdown(how_tos()[chosen])
