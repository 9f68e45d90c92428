"""Hard data placed by hand, with realizations that answer every edit at once."""

from __future__ import annotations

from ccwsim.ui.hard_data.page import draw_editor
from ccwsim.ui.hard_data.volume import draw_volume_data
from ccwsim.ui.page import draw_maps_only, has_volume, show_page
from ccwsim.ui.session.state import State


def data_page(state: State) -> None:
    """Draw the editor of maps; of a volume, its data as a table."""
    if not has_volume(state):
        draw_editor(state)
        return
    draw_maps_only("The editor of hard data")
    if state.choices.grid.nz is not None:
        draw_volume_data(state)


if __name__ == "__main__":
    show_page("Hard data", data_page)
