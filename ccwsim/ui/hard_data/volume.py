"""The hard data of a volume as a table: they are edited in a file."""

from __future__ import annotations

import numpy as np
import pandas as pd
import streamlit as st

from ccwsim.ui.session.resolve import data_of, image_of
from ccwsim.ui.session.state import State
from ccwsim.ui.widgets.text import panel_title, step_note

MAX_ROWS = 10_000
"""More rows than anybody reads make a page slow."""


def draw_volume_data(state: State) -> None:
    """Draw the cells of the hard data, with their centres in world coordinates."""
    choices = state.choices
    data, image = data_of(choices), image_of(choices.image)
    panel_title("Hard data", f"{data.n} cells")
    if not data.n:
        step_note(
            "None. Wells are chosen on Simulate: bundled ones, or a file with x, y, z, facies."
        )
        return
    names = np.asarray(image.facies_names)[np.searchsorted(image.codes, data.facies)]
    places = choices.grid.centers_of(data.cells)[:MAX_ROWS]
    table = pd.DataFrame(places, columns=["x", "y", "z"])
    for k, name in enumerate(("layer", "row", "column")):
        table[name] = data.cells[:MAX_ROWS, k]
    table["facies"] = names[:MAX_ROWS]
    st.dataframe(table, hide_index=True, key="volume_data")
    if data.n > MAX_ROWS:
        step_note(f"The first {MAX_ROWS:,} of {data.n:,}.")
