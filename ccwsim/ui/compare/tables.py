"""The numbers of a comparison: as a table on the page, and as CSV."""

from __future__ import annotations

from dataclasses import fields
from html import escape

import numpy as np
import streamlit as st

from ccwsim.experiments.comparison import Comparison
from ccwsim.model.parameters import Parameters
from ccwsim.ui.compare.name import colour_of
from ccwsim.ui.results.tables import as_csv
from ccwsim.ui.widgets.facts import seconds, three_digits
from ccwsim.ui.widgets.scrolled import scrolled


def draw_figures(found: Comparison) -> None:
    """Draw one line a setting: time, data, and distances of patterns."""
    st.html(scrolled(figures_table(found), "Settings in numbers"))


def figures_table(found: Comparison) -> str:
    """Return the table as HTML."""
    with_data = found.ensembles[0].hard_data.n > 0
    data_heads = ("data wrong", "mended", "forced") if with_data else ()
    heads = ("CPU a realization", f"to {found.names[0]}", *data_heads, "from the image", "variety")
    rows = []
    for k, (name, e) in enumerate(zip(found.names, found.ensembles, strict=True)):
        data = (e.n_mismatched, e.n_resimulated, e.n_forced) if with_data else ()
        cells = [
            seconds(found.cpu_seconds[k]),
            f"{found.cpu_seconds[k] / found.cpu_seconds[0]:.2f} ×",
            *(three_digits(float(n.mean())) for n in data),
            _bits(found.distance[k]),
            _bits(found.variety[k]),
        ]
        rows.append(
            f'<tr><th class="own" style="--own: {colour_of(name)}"><b>{escape(name)}</b></th>'
            + "".join(f"<td>{cell}</td>" for cell in cells)
            + "</tr>"
        )
    head = "".join(f"<th>{text}</th>" for text in ("", *heads))
    return f'<table class="numbers figures"><tr>{head}</tr>{"".join(rows)}</table>'


def _bits(value: float) -> str:
    return "–" if np.isnan(value) else f"{three_digits(value)} bits"


def settings_csv(found: Comparison) -> bytes:
    """Return one line a setting: its parameters and figures, means over its realizations."""
    codes = found.ensembles[0].training_image.codes
    names = [f.name for f in fields(Parameters)]
    head = [
        "setting", *names, "cpu_seconds", "cpu_ratio_to_first", "data_wrong", "data_mended",
        "data_forced", "distance_to_image_bits", "variety_bits",
        *(f"proportion_{code}" for code in codes),
    ]  # fmt: skip
    lines = []
    for k, (name, e) in enumerate(zip(found.names, found.ensembles, strict=True)):
        figures = (
            found.cpu_seconds[k], found.cpu_seconds[k] / found.cpu_seconds[0],
            e.n_mismatched.mean(), e.n_resimulated.mean(), e.n_forced.mean(), found.distance[k],
            found.variety[k], *found.proportions[k].mean(axis=0),
        )  # fmt: skip
        values = [getattr(e.parameters, n) for n in names]
        lines.append([name, *values, *(f"{figure:.6g}" for figure in figures)])
    return as_csv(head, lines)


def realizations_csv(found: Comparison) -> bytes:
    """Return one line a realization of each setting, with its place in the MDS plot."""
    codes = found.ensembles[0].training_image.codes
    head = [
        "setting", "realization", "cpu_seconds", "data_wrong", "data_mended", "data_forced",
        *(f"proportion_{code}" for code in codes), "distance_to_image_bits", "mds_1", "mds_2",
    ]  # fmt: skip
    lines = []
    for k, (name, e) in enumerate(zip(found.names, found.ensembles, strict=True)):
        placed = np.full((e.n, 3), np.nan)
        if found.anodi is not None and found.scaling is not None:
            places = found.scaling.positions[found.anodi.owner == k]
            placed = np.column_stack([found.distances[k], places])
        for r in range(e.n):
            numbers = (*found.proportions[k][r], *placed[r])
            data = (int(each[r]) for each in (e.n_mismatched, e.n_resimulated, e.n_forced))
            own = [name, r + 1, f"{e.cpu_seconds[r]:.6g}", *data]
            lines.append([*own, *(f"{number:.6g}" for number in numbers)])
    return as_csv(head, lines)


def ratios_csv(found: Comparison) -> bytes:
    """Return the table of ANODI ratios."""
    head = ["setting", "to", "between_ratio", "within_ratio", "ratio"]
    return as_csv(
        head,
        [
            [r.name, r.other, *(f"{v:.6g}" for v in (r.between, r.within, r.ratio))]
            for r in found.ratios
        ],
    )
