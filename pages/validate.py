"""Page that compares realizations with the training image, with the data and with each other."""

from __future__ import annotations

from ccwsim.ui.page import show_page
from ccwsim.ui.validate.page import draw_page

if __name__ == "__main__":
    show_page("Validate", draw_page)
