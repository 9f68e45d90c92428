"""The page The paper's and ours: steps, additions with gain and cost, and the paper in code."""

import re
from html import escape

import streamlit as st

from ccwsim.ui.session import State
from ccwsim.ui.widgets import (
    documents,
    download,
    draw_style,
    numbers_table,
    on_a_page,
    scrolled,
    step_note,
)

TITLE = "The paper's and ours"
PAPER_PROGRAM = "the_paper.py"
"""File of the documentation with the method of the paper, written without this program."""


def draw_method(state: State) -> None:
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
        for number, section in enumerate(sections):
            heading, _, text = section.partition("\n")
            with st.expander(heading, expanded=number < 2):
                _draw_text(on_a_page(text.strip()), heading)
        program = (docs / PAPER_PROGRAM).read_text("utf-8")
        with st.expander(f"The paper in {len(program.splitlines())} lines of Python"):
            download(
                "Download the_paper.py", program.encode(), PAPER_PROGRAM, key="download_program"
            )
            st.code(program, "python")


def _draw_text(text: str, heading: str) -> None:
    """Draw Markdown; tables become HTML in frames that scroll sideways, also by keyboard."""
    for block in text.split("\n\n"):
        if not block.startswith("|"):
            st.markdown(block)
            continue
        lines = [line.strip()[1:-1].split("|") for line in block.splitlines()]
        head, _, *rows = ([_cell(text) for text in line] for line in lines)
        st.html(scrolled(numbers_table(rows, head), heading))


def _cell(text: str) -> str:
    """Return the text of a cell as HTML, with words between backticks as code."""
    return re.sub("`([^`]+)`", r"<code>\1</code>", escape(text.strip()))
