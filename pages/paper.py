"""The paper's experiments, run again, and one report of them."""

from __future__ import annotations

from ccwsim.ui.page import show_page
from ccwsim.ui.paper.page import draw_paper

if __name__ == "__main__":
    show_page("Paper", draw_paper)
