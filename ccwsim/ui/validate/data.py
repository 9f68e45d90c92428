"""Whether the realizations honour the hard data, and how each datum was met."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import streamlit as st
from numpy.typing import NDArray

from ccwsim.figures import ENTROPY, data_status_chart, ramp
from ccwsim.metrics import data_match
from ccwsim.model.ensemble import FORCED, WRONG, Ensemble
from ccwsim.ui.results.titled_chart import titled_chart
from ccwsim.ui.session.state import State
from ccwsim.ui.widgets.facts import three_digits
from ccwsim.ui.widgets.maps import CellMap, draw_map, points_of
from ccwsim.ui.widgets.steps import panel_title, step_note
from ccwsim.ui.widgets.theme import chart_theme

MAP_HEIGHT = 360


def draw_data(state: State, colours: Sequence[str]) -> None:
    """Draw how the data were met, and where that was hard."""
    ensemble = state.ensemble
    assert ensemble is not None
    if not ensemble.hard_data.n:
        step_note("This study has no hard data; place or load some on the page Hard data.")
        return
    left, right = st.columns([1.6, 1.0], gap="large")
    names, shares = ways_of(ensemble)
    with left:
        titled_chart(
            "How the data were met", said_match(ensemble),
            data_status_chart(names, shares, chart_theme(), height=96 + 32 * len(names)),
            "data_status",
            "Share of the data met by the raster, by mending windows, and by force",
        )  # fmt: skip
        step_note(
            "Raster: a patch with the right facies was found on the way. Mended: a window of that "
            "size around the datum was simulated again. Forced: no window fitted, so the cell "
            "alone was set, which may leave a speck."
            if ensemble.parameters.exact_data
            else "Exact data is off: data steered the search on the coarse grid only. Raster: a "
            "patch with the right facies was found. Wrong: the cell has another facies."
        )
    with right:
        _where(ensemble, colours)


def ways_of(ensemble: Ensemble) -> tuple[list[str], NDArray[np.float64]]:
    """Return the ways a datum came out and their shares, shape (n_realizations, n_ways)."""
    sizes = sorted({int(size) for size in np.unique(ensemble.data_status) if size > 0})
    codes = [0, *sizes, FORCED]
    names = ["raster", *(f"mended, {size} × {size} cells" for size in sizes), "forced"]
    if not ensemble.parameters.exact_data:
        codes, names = [0, WRONG], ["raster", "wrong"]
    shares = np.stack([(ensemble.data_status == code).mean(axis=1) for code in codes], axis=1)
    return names, shares


def said_match(ensemble: Ensemble) -> str:
    """Say whether all data are honoured."""
    match = data_match(ensemble.realizations, ensemble.hard_data)
    n = ensemble.hard_data.n
    if not match.n_wrong.any():
        return f"all {n} honoured in all {ensemble.n} realizations"
    share = 100 * match.wrong.mean()
    return (
        f"{three_digits(share)} % not honoured, up to {int(match.n_wrong.max())} of {n} in a "
        "realization"
    )


def _where(ensemble: Ensemble, colours: Sequence[str]) -> None:
    panel_title("Where it took mending", "each datum as a square")
    shown = resimulation_map(ensemble, chart_theme().hairline)
    shown = replace(shown, points=wrong_points(ensemble), point_colours=colours)
    draw_map(shown, "map_mended", link="grid", name="mended", max_height=MAP_HEIGHT)


def resimulation_map(ensemble: Ensemble, ground: str) -> CellMap:
    """Return a map of the share of realizations in which each datum was mended or forced.

    A datum is drawn as a square that can be seen; index 0 is where there is none.
    """
    mended = (ensemble.data_status != 0) & (ensemble.data_status != WRONG)
    shares = np.rint(100 * mended.mean(axis=0)).astype(np.uint8)
    ny, nx = ensemble.grid.shape
    indices = np.zeros((ny, nx), np.uint8)
    side = max(ny, nx) // 100
    order = np.argsort(shares)
    for (row, column), share in zip(ensemble.hard_data.cells[order], shares[order], strict=True):
        south, west = max(row - side, 0), max(column - side, 0)
        indices[south : row + side + 1, west : column + side + 1] = 1 + share
    labels = ["no datum", *(f"mended in {k} % of the realizations" for k in range(101))]
    strip = {"colours": list(ENTROPY), "low": "never", "high": "always"}
    alt = "Share of the realizations in which each datum took mending"
    return CellMap(indices, [ground, *ramp(ENTROPY, 101)], labels, alt, strip=strip)


def wrong_points(ensemble: Ensemble) -> list[list[int]]:
    """Return the data that some realization does not honour, as points of a map."""
    match = data_match(ensemble.realizations, ensemble.hard_data)
    points = points_of(ensemble.hard_data, ensemble.training_image)
    return [[*points[k][:3], 1] for k in np.flatnonzero(match.times_wrong)]
