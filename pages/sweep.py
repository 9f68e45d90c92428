"""Try many settings of the study, see what each costs and gives, and take one."""

from __future__ import annotations

from ccwsim.ui.page import show_page
from ccwsim.ui.sweep.page import draw_page

if __name__ == "__main__":
    show_page("Sweep", draw_page)
