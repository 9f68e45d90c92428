"""Page that reads a training image and hard data from files, and asks about unclear content."""

from __future__ import annotations

from ccwsim.ui.imports.page import draw_imports
from ccwsim.ui.page import show_page

if __name__ == "__main__":
    show_page("Import", draw_imports)
