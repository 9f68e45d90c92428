"""A training image and hard data from files, with the questions that they raise."""

from __future__ import annotations

from ccwsim.ui.imports.page import draw_imports
from ccwsim.ui.page import show_page

if __name__ == "__main__":
    show_page("Import", draw_imports)
