"""The page The paper's and ours: steps, additions with gain and cost, and the paper in code."""

import re

import streamlit as st

from ccwsim.ui.session.state import State
from ccwsim.ui.widgets.fields import download
from ccwsim.ui.widgets.text import documents, on_a_page, step_note
from ccwsim.ui.widgets.theme import draw_style

TITLE = "The paper's and ours"
PROGRAM = "the_paper.py"
"""File of the documentation with the method of the paper, written without this program."""


def draw_method(_: State) -> None:
    """Draw the document about the method, and the program that is the paper's method."""
    draw_style("paper/paper.css")
    docs = documents()
    if docs is None:
        step_note("The documentation is not installed with this program.")
        return
    title, *sections = re.split(r"(?m)^## ", (docs / "method.md").read_text("utf-8"))
    st.html(f'<h2 class="part">{TITLE}</h2>')
    with st.container(key="method_text"):
        st.markdown(on_a_page(title.partition("\n")[2].strip()))
        for section in sections:
            heading, _, text = section.partition("\n")
            with st.expander(heading, expanded=section is sections[0] or section is sections[1]):
                st.markdown(on_a_page(text.strip()))
        program = (docs / PROGRAM).read_text("utf-8")
        with st.expander(f"The paper in {len(program.splitlines())} lines of Python"):
            download(f"Download {PROGRAM}", program.encode(), PROGRAM, key="download_program")
            st.code(program, "python")
