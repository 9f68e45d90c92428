"""What a comparison found, drawn: maps side by side, curves, and patterns."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import Any

import numpy as np
import streamlit as st

from ccwsim.experiments.comparison import DIRECTIONS, STATISTICS, Comparison
from ccwsim.figures import (
    DASHES,
    SYMBOLS,
    Bundle,
    Group,
    compared_proportions_chart,
    compared_times_chart,
    curves_chart,
    mds_chart,
    setting_colours,
)
from ccwsim.ui.compare.findings import colour_of, describe_nearest, ratio_table
from ccwsim.ui.compare.run import has_curves, want_curves
from ccwsim.ui.compare.settings import (
    LETTERS,
    Asked,
    Comparing,
    describe_parameters,
    describe_setting,
)
from ccwsim.ui.results.charts import draw_clickable_chart
from ccwsim.ui.results.curves_panel import draw_curve_key
from ccwsim.ui.results.e_type import choose, e_type_field, uncertainty_map
from ccwsim.ui.results.gallery import step_buttons
from ccwsim.ui.results.ghost import ghost_panel
from ccwsim.ui.results.titled_chart import titled_chart
from ccwsim.ui.session.state import State
from ccwsim.ui.widgets.facts import seconds, three_digits
from ccwsim.ui.widgets.fields import button
from ccwsim.ui.widgets.literal import plain
from ccwsim.ui.widgets.maps import draw_map, facies_map, points_of
from ccwsim.ui.widgets.scrolled import scrolled
from ccwsim.ui.widgets.steps import panel_title, step_note
from ccwsim.ui.widgets.theme import chart_theme

MIN_IMAGE_SHARE = 0.8
"""The training image's column is never narrower than this share of a setting's."""
SCALE: dict[str, Any] = {"scale": "compared", "max_height": 460}
TITLES = {"variogram": ("Variogram", "γ"), "connection": ("Connectivity", "τ")}
NO_CURVES = np.empty((0, 0))
SAME_TAU, SAME_GAMMA = 0.01, 0.02
"""Gaps that differ by less are alike: in probability, and as a share of the largest γ."""
BORDERS = dict(zip(DASHES, ("solid", "dashed", "dotted", "dashed"), strict=True))
"""How CSS says a dash; it has no dash-dot."""
GLYPHS = dict(zip(SYMBOLS, "●■▲✚", strict=True))
"""How text says a symbol."""


def draw_name(letter: str, note: str) -> None:
    """Write the letter of a setting in its colour, and what it is."""
    text = escape(note)
    html = f'<b>{letter}</b><span title="{text}">{text}</span>'
    st.html(f'<div class="setting" style="--own: {colour_of(letter)}">{html}</div>')


def draw_maps(state: State, found: Comparison, asked: Asked, colours: Sequence[str]) -> None:
    """Draw one column for the training image and one for each setting, with the E-type below."""
    page_state = state.page(Comparing)
    image, grid, n = found.ensembles[0].training_image, asked.grid, found.ensembles[0].n

    def step(way: int) -> None:
        page_state.shown = (page_state.shown + way) % n

    def write(option: int | str) -> None:
        choose(state, option)
        want_curves(state)

    with st.container(horizontal=True, vertical_alignment="center", gap="small", key="shown_row"):
        panel_title(f"Realization {page_state.shown + 1} of {n}")
        step_buttons("shown", step, disabled=n == 1, note=" of all settings")
        st.html('<div class="panel below">E-type below</div>', width="content")
        e_type_field(state, image.facies_names, write)
    share = min(max(image.shape[1] / grid.nx, MIN_IMAGE_SHARE), 1.0)
    with st.container(key="maps"):
        first, *others = st.columns([share] + [1.0] * len(asked.settings), gap="medium")
    with first:
        panel_title("Training image")
        shown = facies_map(image.indices, image, colours, f"Training image {image.name}")
        draw_map(shown, "map_image", name="training_image", link="image", leads=False, **SCALE)
        _draw_beside(found)
    own = asked.settings[0]
    for k, (column, p) in enumerate(zip(others, asked.settings, strict=True)):
        with column:
            draw_name(LETTERS[k], describe_setting(p, own) if k else describe_parameters(own))
            if k < len(found.ensembles):
                _draw_maps_of(state, found, k, colours)
            else:
                ghost_panel("", f"aspect-ratio: {grid.nx} / {grid.ny}")


def _draw_maps_of(state: State, found: Comparison, k: int, colours: Sequence[str]) -> None:
    ensemble, letter, r = found.ensembles[k], found.names[k], state.page(Comparing).shown
    image = ensemble.training_image
    shown = facies_map(ensemble.indices[r], image, colours, f"{letter}, realization {r + 1}")
    shown.points.extend(points_of(ensemble.hard_data, image, ensemble.realizations[r]))
    name = f"{letter}_realization_{r + 1}"
    draw_map(shown, f"map_{letter}", link="grid", name=name, **SCALE)
    below = uncertainty_map(state, ensemble, colours)
    draw_map(below, f"map_e_type_{letter}", link="grid", name=f"{letter}_e_type", **SCALE)


def _draw_beside(found: Comparison) -> None:
    """Draw CPU times and proportions below the training image."""
    image, theme, names = found.ensembles[0].training_image, chart_theme(), found.names
    each = dict(zip(names, (1000 * e.cpu_seconds for e in found.ensembles), strict=True))
    labels = [seconds(mean) for mean in found.cpu_seconds]
    chart = compared_times_chart(each, 1000 * found.cpu_seconds, labels, theme)
    titled_chart("CPU time", "", chart, "compared_times", "CPU time of a realization by setting")
    shares = dict(zip(names, found.proportions, strict=True))
    chart = compared_proportions_chart(image.facies_names, image.proportions, shares, theme)
    alt = "Facies proportions of the realizations by setting, and of the training image"
    titled_chart("Proportions", "", chart, "compared_proportions", alt)


def draw_curves(state: State, found: Comparison) -> None:
    """Draw four charts of the chosen facies, or say that they are still worked out."""
    facies = state.facies
    name = found.ensembles[0].training_image.facies_names[facies]
    if not has_curves(found, facies):
        if state.page(Comparing).job is None:
            label = f"Work out the curves of {plain(name)}"
            button(label, key="want_curves", on_click=want_curves, args=(state,))
        else:
            st.html('<div class="unseen curves"></div>')
        return
    lines = [("2px solid var(--reference)", "training image")]
    lines += [
        (f"2px {BORDERS[dash]} {colour_of(letter)}", f"{letter}, median and 5–95 %")
        for letter, dash in zip(found.names, DASHES, strict=False)
    ]
    draw_curve_key(lines)
    both = [found.curves[facies, "variogram", way] for way in DIRECTIONS]
    values = [c.reference.max() for c in both] + [b.high.max() for c in both for b in c.bands]
    top = 1.08 * float(np.nanmax(values)) or 0.5  # the same for both directions
    with st.container(key="charts"):
        columns = st.columns(4, gap="medium")
    wanted = [(statistic, way) for statistic in STATISTICS for way in DIRECTIONS]
    for column, (statistic, way) in zip(columns, wanted, strict=True):
        is_variogram = statistic == "variogram"
        y_range, tolerance = ((0, top), SAME_GAMMA * top) if is_variogram else ((0, 1.04), SAME_TAU)
        curves = found.curves[facies, statistic, way]
        title, sign = TITLES[statistic]
        title = f"{title} {way.replace('-', '–')}"
        y_title, lags = f"{sign} of {name}", curves.lags.astype(float)
        bundles = {
            letter: Bundle(lags, curves.reference, NO_CURVES, band.low, band.median, band.high)
            for letter, band in zip(found.names, curves.bands, strict=True)
        }
        chart = curves_chart(bundles, chart_theme(), y_title=y_title, y_range=y_range, height=220)
        note = describe_nearest(curves, found.names, tolerance)
        alt = f"{title} of {name}: training image and the band of each setting"
        with column:
            titled_chart(title, note, chart, f"{statistic}_{way[0]}", alt)


def draw_patterns(state: State, found: Comparison) -> None:
    """Draw MDS plot and ANODI ratios, or say why they are not there."""
    if found.anodi is None:
        if found.problem:
            step_note(f"Patterns are not compared: {found.problem}.")
        elif state.page(Comparing).job is not None:
            st.html('<div class="unseen patterns"></div>')
        else:
            step_note("Patterns are not compared: the comparison was stopped before.")
        return
    left, right = st.columns([1.0, 1.15], gap="large")
    with left:
        _draw_mds(state, found)
    with right:
        panel_title("ANODI ratios", "every setting against each one before it")
        st.html(scrolled(ratio_table(found), "ANODI ratios"))
        weights = ", ".join(three_digits(w) for w in found.anodi.weights)
        size = found.anodi.pattern_size
        step_note(
            "Between: how varied the realizations are; within: how far they are from the training "
            "image; ratio = between / within. Above 1 the first setting is the better one (Tan et "
            f"al. 2014, on exact histograms of all {size} × {size} patterns at full, half and "
            f"third resolution, weighted {weights})."
        )


def _draw_mds(state: State, found: Comparison) -> None:
    assert found.anodi is not None
    assert found.scaling is not None
    page_state, n, names = state.page(Comparing), found.ensembles[0].n, found.names

    def choose(k: int) -> None:
        page_state.shown = min(max(k, 0), n - 1)

    def draw(chart: Any, key: str, alt: str) -> None:
        entries = "".join(
            f'<span><em style="color: {colour_of(letter)}">{GLYPHS[symbol]}</em>{letter}</span>'
            for letter, symbol in zip(names, SYMBOLS, strict=False)
        )
        st.html(f'<div class="curve-key points">{entries}</div>')
        draw_clickable_chart(chart, key, alt, choose, n_series=len(names))

    theme, positions, groups = chart_theme(), found.scaling.positions, []
    for k, name in enumerate(names):
        own, colour = positions[found.anodi.owner == k], setting_colours(theme)[k]
        labels = [f"{name}, realization {r + 1}" for r in range(len(own))]
        groups.append(Group(name, own, colour, SYMBOLS[k], labels, page_state.shown))
    chart = mds_chart(positions[0], groups, found.scaling.explained, theme)
    alt = "MDS plot: realizations of all settings and the training image"
    titled_chart("MDS plot", "click a realization to see it", chart, "compared_mds", alt, draw)
