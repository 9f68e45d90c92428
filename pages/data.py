"""Page to place hard data by hand; realizations are updated after every edit."""

from __future__ import annotations

from ccwsim.ui.hard_data.page import draw_editor
from ccwsim.ui.page import show_page

if __name__ == "__main__":
    show_page("Hard data", draw_editor)
