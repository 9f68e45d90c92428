"""Page that shows the algorithm patch by patch on the user's image, data and settings."""

from __future__ import annotations

from ccwsim.ui.how_it_works.page import draw_how
from ccwsim.ui.page import show_page

if __name__ == "__main__":
    show_page("How it works", draw_how)
