"""Page that repeats the experiments of the paper and writes one report."""

from __future__ import annotations

from ccwsim.ui.page import show_page
from ccwsim.ui.paper.page import draw_paper

if __name__ == "__main__":
    show_page("Paper", draw_paper)
