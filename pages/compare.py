"""Page that compares two to four settings with the same training image, data and seeds."""

from __future__ import annotations

from ccwsim.ui.compare.page import draw_page
from ccwsim.ui.examples.opened import draw_opened
from ccwsim.ui.page import show_page
from ccwsim.ui.session import State


def compare_page(state: State) -> None:
    """Show the page below the note on the open example."""
    draw_opened(state, compared=True)
    draw_page(state)


if __name__ == "__main__":
    show_page("Compare", compare_page)
