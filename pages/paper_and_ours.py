"""Page that sets the steps of the paper beside those of this program."""

from __future__ import annotations

from ccwsim.ui.page import show_page
from ccwsim.ui.paper.method import TITLE, draw_method

if __name__ == "__main__":
    show_page(TITLE, draw_method)
