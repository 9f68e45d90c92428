"""Hard data placed by hand, with realizations that answer every edit at once."""

from __future__ import annotations

from ccwsim.ui.hard_data.page import draw_editor
from ccwsim.ui.hard_data.volume import draw_volume_editor
from ccwsim.ui.page import show_page
from ccwsim.ui.session.state import State


def data_page(state: State) -> None:
    """Draw the editor of maps, or that of volumes."""
    (draw_editor if state.choices.grid.nz is None else draw_volume_editor)(state)


if __name__ == "__main__":
    show_page("Hard data", data_page)
