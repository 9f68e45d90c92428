"""The brush that edits the hard data of a volume, and the table of wells."""

from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import streamlit as st

from ccwsim import Grid, HardData
from ccwsim.model import Ints, digest
from ccwsim.sharing.choices import CellsOfWells, DataChoice
from ccwsim.ui.hard_data.edits import AS_SHOWN, ERASE, Editor, layers_of_wells, take
from ccwsim.ui.session import State, data_of, wells_of
from ccwsim.ui.widgets import bound_to, button, field, in_row, options_of, panel_title


def draw_brush(state: State, nz: int) -> None:
    """Draw controls for the facies to place and the layers of a well."""
    page_state, image = state.page(Editor), state.image
    names = dict(enumerate(image.facies_names)) | {AS_SHOWN: "as shown", ERASE: "erase"}
    low, high = layers_of_wells(page_state, nz)
    with in_row("brush_row", "bottom", gap="medium"):
        tip = "“as shown” places the facies of the realization on the page; “erase” removes data."
        field(
            st.segmented_control,
            "Facies to place",
            key="brush",
            help=tip,
            **bound_to(page_state, "brush"),
            **options_of(names),
        )
        for k, (label, layer) in enumerate((("Wells from layer", low), ("to layer", high))):

            def write(new: int, k: int = k) -> None:
                page_state.layers = (int(new), high) if k == 0 else (low, int(new))

            field(
                st.number_input,
                label,
                key=f"well_layer_{k}",
                value=layer,
                write=write,
                min_value=0 if k == 0 else low,
                max_value=high if k == 0 else nz - 1,
                width=120,
                help="Layer 0 is the bottom layer." if k == 0 else None,
            )


class WellRows(NamedTuple):
    """The wells of a volume: named wells, then columns of cells with data outside named wells."""

    names: tuple[str, ...]  # "" for a column of cells without a name
    data: tuple[Ints, ...]  # indices of the data of each well, from the bottom up


def rows_of_wells(data: HardData, wells: CellsOfWells = ()) -> WellRows:
    """Return the wells of hard data: named wells, and columns of cells with data outside them."""
    index_of = {cell: k for k, cell in enumerate(map(tuple, data.cells.tolist()))} if wells else {}
    names, parts = [], []
    unnamed = np.ones(data.n, bool)
    for name, cells in wells:
        placed = np.array(sorted(index_of[cell] for cell in cells if cell in index_of), np.int64)
        if len(placed):
            names.append(name)
            parts.append(placed)
            unnamed[placed] = False
    remaining = np.flatnonzero(unnamed)
    if len(remaining):
        layer, row, column = data.cells[remaining].T
        order = np.lexsort((layer, column, row))
        new = (np.diff(row[order]) != 0) | (np.diff(column[order]) != 0)
        parts += np.split(remaining[order], np.flatnonzero(new) + 1)
        names += [""] * (len(parts) - len(names))
    return WellRows(tuple(names), tuple(parts))


def table_of_wells(data: HardData, grid: Grid, rows: WellRows) -> pd.DataFrame:
    """Return a table of wells: name, position of the top datum, range of z, number of data."""
    low = data.cells[[indices[0] for indices in rows.data]]
    high = data.cells[[indices[-1] for indices in rows.data]]
    centers = grid.centers_of(high)
    height, base = grid.cell_size[-1], grid.origin[-1]
    columns: dict[str, Any] = {"well": rows.names} if any(rows.names) else {}
    columns |= {"x": centers[:, 0], "y": centers[:, 1]}
    columns |= {"from z": base + height * low[:, 0], "to z": base + height * (high[:, 0] + 1)}
    return pd.DataFrame(columns | {"data": [len(indices) for indices in rows.data]})


def describe_wells(data: HardData, rows: WellRows) -> str:
    """Return the number of named wells and of other columns as text."""
    n = sum(map(bool, rows.names))
    counts = {"well": n, "column": len(rows.names) - n, "cell": data.n}
    phrases = [
        f"{count} {noun}{'' if count == 1 else 's'}" for noun, count in counts.items() if count
    ]
    return ", ".join(phrases)


def draw_wells(state: State, data: HardData) -> None:
    """Draw the wells as a table; chosen wells can be removed."""
    if not data.n:
        panel_title("Wells", "none yet")
        return
    wells = rows_of_wells(data, wells_of(state.choices))
    panel_title("Wells", describe_wells(data, wells))
    chosen = st.dataframe(
        table_of_wells(data, state.grid, wells),
        hide_index=True,
        key=f"wells_{digest(data.digest, wells.names)}",
        on_select="rerun",
        selection_mode="multi-row",
        height=300,
    )
    rows = list(chosen["selection"]["rows"])
    words = f"Remove {len(rows)} wells" if rows else "Choose rows to remove wells"
    button(words, key="remove_wells", on_click=remove_wells, args=(state, rows), disabled=not rows)


def remove_wells(state: State, rows: list[int]) -> None:
    """Remove the wells in `rows`, and their data except in cells of other wells."""
    data, named = data_of(state.choices), wells_of(state.choices)
    wells = rows_of_wells(data, named)
    out = np.zeros(data.n, bool)
    for k in rows:
        out[wells.data[k]] = True
    for k, indices in enumerate(wells.data):
        if k not in rows:
            out[indices] = False
    gone = {wells.names[k] for k in rows}
    remaining = data.part(~out)
    kept = tuple(well for well in named if well[0] not in gone)
    take(state, DataChoice("placed", placed=remaining, wells=kept), state.reference)
