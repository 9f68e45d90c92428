"""Judge realizations against the training image, the data and each other, on one page."""

from __future__ import annotations

from ccwsim.ui.page import show_page
from ccwsim.ui.validate.page import draw_page

if __name__ == "__main__":
    show_page("Validate", draw_page)
