"""Small multiples: one realization of each setting, labelled, a click from being the large one."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable

import streamlit as st

from ccwsim.figures import contact_sheet, tile_size
from ccwsim.sweep import label
from ccwsim.ui.facts import seconds, three_digits
from ccwsim.ui.maps import canvas_component
from ccwsim.ui.sweep_run import SweepRun

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
    key = "sweep_tiles"
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
        tiles += [{"label": label(p, names), "note": "to come"} for p in run.settings[len(rows) :]]
    width, height = tile_size(run.grid.shape, LONGEST)

    def chosen() -> None:
        number = st.session_state[key].chosen
        if number is not None:
            choose(int(number))

    data = {"tiles": tiles, "width": width, "height": height, "shown": shown}
    canvas_component("settings")(key=key, data=data, on_chosen_change=chosen)
