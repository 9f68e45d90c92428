"""Page that solves steady flow through the realizations, and shows the results."""

from __future__ import annotations

from ccwsim.ui.flow.page import draw_page
from ccwsim.ui.page import show_page

if __name__ == "__main__":
    show_page("Flow", draw_page)
