"""All numbers of a sweep, as a table and as CSV."""

from __future__ import annotations

import csv
from io import StringIO
from typing import Any

import streamlit as st

from ccwsim.experiments.sweep import RANGED, Row, Sweep, pareto_front

HEADS = {
    "pattern_full": "patterns", "pattern_half": "at 1/2", "pattern_third": "at 1/3",
    "tau_error_EW": "τ error E–W", "tau_error_NS": "τ error N–S", "differing": "differing",
    "mended": "mended", "forced": "forced", "not_honoured": "not honoured", "cpu_ms": "CPU ms",
}  # fmt: skip
"""What the numbers are called on the page."""


def csv_button(found: Sweep, recommended: int) -> None:
    """Draw a button that takes all rows home."""
    st.download_button(
        "Table, CSV", lambda: sweep_csv(found, recommended), file_name="sweep.csv",
        mime="text/csv", key="sweep_csv", on_click="ignore",
    )  # fmt: skip


def draw_table(found: Sweep) -> None:
    """Draw all rows."""
    with st.expander("All numbers", key="sweep_table"):
        rows = [numbers_of(row) for row in found.rows]
        table = {
            HEADS.get(name) or RANGED.get(name) or name: [row[name] for row in rows]
            for name in rows[0]
        }
        formats = {
            HEADS[name]: st.column_config.NumberColumn(format="%.4f" if "pa" in name else "%.3g")
            for name in HEADS
        }
        st.dataframe(table, hide_index=True, column_config=formats)


def numbers_of(row: Row) -> dict[str, Any]:
    """Return the setting and all its numbers by name."""
    q = row.quality
    full, half, third = q.pattern_distances
    return {
        **{name: getattr(row.parameters, name) for name in RANGED},
        "wavelet_level": row.parameters.level,
        "pattern_full": full, "pattern_half": half, "pattern_third": third,
        "tau_error_EW": q.tau_errors[0], "tau_error_NS": q.tau_errors[1],
        "differing": q.differing, "mended": q.n_resimulated, "forced": q.n_forced,
        "not_honoured": q.n_mismatched, "cpu_ms": 1000 * q.cpu_seconds,
    }  # fmt: skip


def sweep_csv(found: Sweep, recommended: int) -> bytes:
    """Return one line a setting: its values, its numbers, and how it stands among the others."""
    front = set(pareto_front(found.times, found.errors()).tolist())
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    for k, row in enumerate(found.rows):
        numbers = numbers_of(row)
        if k == 0:
            writer.writerow([*numbers, "on_front", "recommended"])
        said = [f"{v:.6g}" if isinstance(v, float) else v for v in numbers.values()]
        writer.writerow([*said, int(k in front), int(k == recommended)])
    return text.getvalue().encode()
