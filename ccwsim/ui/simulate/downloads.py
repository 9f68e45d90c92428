"""Take the results home: realizations, parameters and maps as files."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import streamlit as st

from ccwsim.figures import map_png
from ccwsim.io import parameters_to_json, realizations_as_bytes
from ccwsim.model.ensemble import Ensemble
from ccwsim.ui.results.tables import curves_csv, realizations_csv
from ccwsim.ui.session.state import State
from ccwsim.ui.widgets.fields import field

MIME = {
    "npz": "application/octet-stream",
    "gslib": "text/plain",
    "png": "image/png",
    "json": "application/json",
    "csv": "text/csv",
}


def draw_downloads(state: State, ensemble: Ensemble, colours: Sequence[str]) -> None:
    """Draw a menu of files; each is made when it is asked for."""
    shown = state.shown
    with st.popover("Download", key="downloads"):
        _file(
            "All realizations, NumPy",
            "realizations.npz",
            lambda: realizations_as_bytes(ensemble, "npz"),
        )
        _file(
            "All realizations, GSLIB",
            "realizations.gslib",
            lambda: realizations_as_bytes(ensemble, "gslib"),
        )
        _file(
            "All realizations, one picture", "realizations.png",
            lambda: realizations_as_bytes(ensemble, "png", colours=colours),
        )  # fmt: skip
        _file(
            f"Realization {shown + 1}, PNG", f"realization_{shown + 1}.png",
            lambda: map_png(ensemble.indices[shown], colours, scale=2),
        )  # fmt: skip
        _file(
            "Parameters, JSON", "parameters.json",
            lambda: parameters_to_json(ensemble.parameters).encode(),
        )  # fmt: skip
        _file("Curves, CSV", "curves.csv", lambda: curves_csv(ensemble, state.facies))
        _file("Times and proportions, CSV", "realizations.csv", lambda: realizations_csv(ensemble))
        field(
            st.segmented_control, "The camera on a chart saves", key="chart_format",
            options=["svg", "png"], format_func=str.upper, value=state.chart_format,
            write=lambda kind: setattr(state, "chart_format", kind),
        )  # fmt: skip


def _file(label: str, name: str, content: Callable[[], bytes]) -> None:
    st.download_button(
        label, content, file_name=name, key=f"download_{name.replace('.', '_')}",
        on_click="ignore", width="stretch", mime=MIME[name.rsplit(".", 1)[1]],
    )  # fmt: skip
