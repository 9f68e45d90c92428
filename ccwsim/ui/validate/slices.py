"""The slice of a volume in the maps of the page: a layer, or a section along x or y."""

from dataclasses import dataclass, replace

import numpy as np
import streamlit as st

from ccwsim import Ensemble, Grid
from ccwsim.model import CELL_AXES, Array, Shape, readonly
from ccwsim.sharing.choices import CellsOfWells
from ccwsim.ui.results.maps import wells_of_data
from ccwsim.ui.session import State
from ccwsim.ui.validate.statistics import Validation
from ccwsim.ui.widgets import bound_to, field, in_row, options_of, step_note

SLICE_KINDS = {0: "Layer", 1: "Section E–W", 2: "Section N–S"}
HOVER = ("column, row", "column, layer", "row, layer")
"""Names of the two cell indices in a map, by axis of the slice."""


@dataclass(frozen=True)
class ShownSlice:
    """A layer (axis 0), row or column of a volume; if `axis` is None, a complete map."""

    axis: int | None = None
    index: int = 0

    def __str__(self) -> str:
        """Return a text such as "layer 24", with layers counted from 0; empty for a map."""
        return "" if self.axis is None else f"{CELL_AXES[self.axis]} {self.index}"

    @property
    def words(self) -> str:
        """Text that is appended to the note of a chart; empty for a map."""
        return "" if self.axis is None else f", {self}"

    def of(self, array: Array) -> Array:
        """Return this slice of an array; the last three axes of the array are z, y and x."""
        if self.axis is None:
            return array
        return np.take(array, self.index, self.axis - len(CELL_AXES))

    def ensemble(self, ensemble: Ensemble) -> Ensemble:
        """Return an ensemble of maps with this slice of the realizations and of the data."""
        if self.axis is None:
            return ensemble
        data, grid, axis = ensemble.hard_data, ensemble.grid, self.axis
        in_slice = np.flatnonzero(data.cells[:, axis] == self.index)
        cells = np.delete(data.cells[in_slice], axis, axis=1)
        rows, columns = np.delete(grid.shape, axis).tolist()
        sizes, origin = (
            tuple(np.delete(values, len(CELL_AXES) - 1 - axis).tolist())
            for values in (grid.cell_size, grid.origin)
        )
        study = replace(
            ensemble.study,
            grid=Grid(rows, columns, sizes, origin),
            hard_data=data.part(in_slice, cells),
            checked=False,
        )
        return replace(
            ensemble,
            study=study,
            indices=readonly(self.of(ensemble.indices)),
            data_status=readonly(ensemble.data_status[:, in_slice]),
            sources=None,
        )

    def wells(self, wells: CellsOfWells) -> CellsOfWells:
        """Return the named wells with cells in this slice, with their cells in its map."""
        if (k := self.axis) is None:
            return wells
        wells_in_slice = [
            (name, tuple((*c[:k], *c[k + 1 :]) for c in path if c[k] == self.index))
            for name, path in wells
        ]
        return tuple((name, path) for name, path in wells_in_slice if path)


def middle_slice(shape: Shape) -> ShownSlice:
    """Return the middle layer of a volume; for a map, return the complete map."""
    return ShownSlice(0, shape[0] // 2) if len(shape) == len(CELL_AXES) else ShownSlice()


def slice_of(state: State, ensemble: Ensemble) -> ShownSlice:
    """Return the chosen slice of volumes; for maps, return the complete map."""
    if not ensemble.grid.is_volume:
        return ShownSlice()
    page_state, shape = state.page(Validation), ensemble.grid.shape
    axis = page_state.slice_axis
    chosen = page_state.slice_at.get(axis, shape[axis] // 2)
    return ShownSlice(axis, min(chosen, shape[axis] - 1))


def wells_on(state: State, ensemble: Ensemble) -> CellsOfWells:
    """Return the named wells on maps of an ensemble, which may be the slice of the study's."""
    whole = state.ensemble
    assert whole is not None
    wells = wells_of_data(state, whole.hard_data)
    return wells if ensemble.grid.nz == whole.grid.nz else slice_of(state, whole).wells(wells)


def draw_slice_fields(state: State, ensemble: Ensemble) -> None:
    """Draw the fields to choose a slice of volumes; draw nothing if realizations are maps."""
    shown = slice_of(state, ensemble)
    if shown.axis is None:
        return
    axis, page_state = shown.axis, state.page(Validation)

    def move(index: int) -> None:
        page_state.slice_at[axis] = int(index)

    with in_row("controls_slice", "bottom", gap="medium"):
        field(
            st.segmented_control,
            "Maps show",
            key="slice",
            **bound_to(page_state, "slice_axis"),
            **options_of(SLICE_KINDS),
        )
        last = ensemble.grid.shape[axis] - 1
        if last:
            side = ("the bottom", "the south", "the west")[axis]
            field(
                st.slider,
                f"{CELL_AXES[axis].capitalize()}, from {side}",
                key=f"slice_{CELL_AXES[axis]}",
                value=shown.index,
                write=move,
                min_value=0,
                max_value=last,
                width=320,
            )
        step_note(f"Maps display the indices ({HOVER[axis]}) of the cell under the pointer.")
