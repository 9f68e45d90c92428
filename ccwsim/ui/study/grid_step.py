"""Step 3: the simulation grid."""

from __future__ import annotations

from dataclasses import replace

import streamlit as st

from ccwsim.model.bounds import MAX_GRID_SIDE_OFFERED
from ccwsim.model.grid import Grid
from ccwsim.ui.session.state import State
from ccwsim.ui.widgets.fields import field
from ccwsim.ui.widgets.steps import pair, step_title


def grid_step(state: State) -> None:
    """Draw the step: cells along x and y; cell size and origin behind a menu."""
    step_title(3, "Grid")
    grid = state.choices.grid
    for place, name, label in zip(pair(), ("nx", "ny"), ("E–W", "N–S"), strict=True):
        with place:
            field(
                st.number_input, f"Cells {label}", key=f"grid_{name}", value=getattr(grid, name),
                min_value=1, max_value=MAX_GRID_SIDE_OFFERED, step=32,
                help=f"Cells of the simulation grid {label}. Time grows with the cells.",
                write=lambda n, name=name: change_grid(state, **{name: int(n)}),
            )  # fmt: skip
    with st.popover("World coordinates", key="grid_menu"):
        _world(state, grid)


def change_grid(state: State, **changes: object) -> None:
    """Replace parts of the grid."""
    state.change(grid=replace(state.choices.grid, **changes))


def _world(state: State, grid: Grid) -> None:
    st.caption("Used for data in world units, for the axes of maps and in exported files.")
    for name, label, least in (
        ("cell_size", "Cell size", 1e-9),
        ("origin", "Origin, the outer corner of the first cell,", None),
    ):
        for k, axis in enumerate("xy"):
            field(
                st.number_input, f"{label} along {axis} (world units)", key=f"grid_{name}_{axis}",
                value=getattr(grid, name)[k], min_value=least, format="%g",
                write=lambda v, name=name, k=k: _change_pair(state, name, k, v),
            )  # fmt: skip


def _change_pair(state: State, name: str, place: int, value: float) -> None:
    pair = list(getattr(state.choices.grid, name))
    pair[place] = float(value)
    change_grid(state, **{name: tuple(pair)})
