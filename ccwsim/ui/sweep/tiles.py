"""Small multiples: one realization of each setting, labelled, a click from being the large one."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable, Sequence

import streamlit as st

from ccwsim.experiments.sweep import label
from ccwsim.figures import contact_sheet, tile_size
from ccwsim.model.grid import Grid
from ccwsim.model.parameters import Parameters
from ccwsim.ui.sweep.run import SweepRun
from ccwsim.ui.widgets.facts import seconds, three_digits
from ccwsim.ui.widgets.maps import canvas_component

KEY = "sweep_tiles"
LONGEST = 124
"""Pixels of a tile's longer side."""


def draw_tiles(
    run: SweepRun, names: list[str], shown: int, recommended: int, choose: Callable[[int], None]
) -> None:
    """Draw a tile a setting, and room for those to come.

    Parameters
    ----------
    run : SweepRun
    names : list of str
        The parameters that are said below each.
    shown, recommended : int
        The ones that are marked.
    choose : callable
        Called with the number of the one that is clicked.
    """
    rows = run.found.rows
    while len(run.tiles) < len(rows):
        first = rows[len(run.tiles)].realizations[:1]
        run.tiles.append(contact_sheet(first, run.colours, longest=2 * LONGEST)[0])
    tiles = [
        {
            "png": b64encode(run.tiles[k]).decode(),
            "label": label(row.parameters, names),
            "note": f"{three_digits(row.quality.pattern_distance)} bits · "
            f"{seconds(row.quality.cpu_seconds)}",
            "recommended": k == recommended,
        }
        for k, row in enumerate(rows)
    ]
    if run.going:
        tiles += _to_come(run.settings[len(rows) :], names, "to come")

    def chosen() -> None:
        number = st.session_state[KEY].chosen
        if number is not None:
            choose(int(number))

    data = {"tiles": tiles, "shown": shown, **_size(run.grid)}
    canvas_component("settings")(key=KEY, data=data, on_chosen_change=chosen)


def draw_planned_tiles(settings: Sequence[Parameters], names: list[str], grid: Grid) -> None:
    """Draw room for the settings that are going to be tried."""
    data = {"tiles": _to_come(settings, names, ""), "shown": -1, **_size(grid)}
    canvas_component("settings")(key=KEY, data=data, on_chosen_change=lambda: None)


def _to_come(settings: Sequence[Parameters], names: list[str], note: str) -> list[dict[str, str]]:
    return [{"label": label(p, names), "note": note} for p in settings]


def _size(grid: Grid) -> dict[str, int]:
    width, height = tile_size(grid.shape, LONGEST)
    return {"width": width, "height": height}
