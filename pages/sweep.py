"""Page that tries many settings of a study, shows the time and errors of each, and applies one."""

from __future__ import annotations

from ccwsim.ui.page import show_page
from ccwsim.ui.sweep.page import draw_page

if __name__ == "__main__":
    show_page("Sweep", draw_page)
