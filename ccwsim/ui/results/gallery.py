"""Choose the large realization: by step, or from a contact sheet of all, small."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable, Sequence

import streamlit as st

from ccwsim.figures import contact_sheet, tile_size
from ccwsim.model.ensemble import Ensemble
from ccwsim.ui.widgets.fields import button
from ccwsim.ui.widgets.maps import canvas_component

ROOM = 1040
"""Pixels that one row of tiles may take on a wide screen."""


def draw_gallery(
    ensemble: Ensemble, colours: Sequence[str], shown: int, choose: Callable[[int], None]
) -> None:
    """Draw all realizations; `choose` is called with the number of the one that is clicked."""
    longest = min(96, max(48, ROOM // ensemble.n - 8))
    width, height = tile_size(ensemble.grid.shape, longest)
    png, columns = _sheet(ensemble.digest, tuple(colours), 2 * longest, ensemble)
    key = "gallery"

    def chosen() -> None:
        number = st.session_state[key].chosen
        if number is not None:
            choose(int(number))

    data = {
        "png": png,
        "n": ensemble.n,
        "columns": columns,
        "width": width,
        "height": height,
        "shown": shown,
    }
    canvas_component("sheet")(key=key, data=data, on_chosen_change=chosen)


@st.cache_data(max_entries=16, show_spinner=False)
def _sheet(
    digest: str, colours: tuple[str, ...], longest: int, _ensemble: Ensemble
) -> tuple[str, int]:
    png, columns = contact_sheet(_ensemble.indices, colours, longest=longest)
    return b64encode(png).decode(), columns


def step_buttons(key: str, step: Callable[[int], None], *, disabled: bool, note: str = "") -> None:
    """Draw two arrows; `step` is called with -1 or 1."""
    for way, sign, name in ((-1, "‹", "previous"), (1, "›", "next")):
        options: dict = {"disabled": disabled, "help": f"The {name} realization{note}"}
        button(sign, key=f"{key}_{name}", on_click=step, args=(way,), **options)
