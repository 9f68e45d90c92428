"""How much of each facies there is, and in how many and how large pieces."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import streamlit as st
from numpy.typing import NDArray

from ccwsim.figures import Strip, proportions_chart, strip_chart
from ccwsim.ui.results.titled_chart import titled_chart
from ccwsim.ui.session.state import State
from ccwsim.ui.validate.panel import panel
from ccwsim.ui.validate.statistics import GeobodiesCompared, bodies, proportions
from ccwsim.ui.widgets.steps import step_note
from ccwsim.ui.widgets.theme import chart_theme

AREA = 10_000
"""Counts are given for so many cells, since grid and training image differ in size."""


def draw_bodies(state: State, colours: Sequence[str]) -> None:
    """Draw proportions at the left and the bodies of the chosen facies at the right."""
    ensemble = state.ensemble
    assert ensemble is not None
    image = ensemble.training_image
    left, right = st.columns([1.0, 2.0], gap="large")

    def draw_shares(each: NDArray[np.float64]) -> None:
        off = 100 * float(np.abs(each.mean(axis=0) - image.proportions).max())
        chart = proportions_chart(
            image.facies_names, image.proportions, each, colours, chart_theme()
        )
        titled_chart(
            "Facies proportions", f"mean within {off:.1f} %", chart, "proportions",
            "Facies proportions of each realization and of the training image",
        )  # fmt: skip

    with left:
        panel(state, "proportions", proportions(ensemble), draw_shares)
    with right:
        panel(
            state, "bodies", bodies(ensemble, state.facies),
            lambda found: _draw_strips(found, image.facies_names[state.facies],
                                       colours[state.facies]),
        )  # fmt: skip


def strips_of(found: GeobodiesCompared) -> list[tuple[str, str, Strip]]:
    """Return the strips with their titles and words: Γ, bodies, Euler number, largest body."""
    each, image = found.each, found.reference
    per, per_image = AREA / found.n_cells, AREA / found.n_cells_reference
    shares = np.array([sizes[0] / sizes.sum() if len(sizes) else np.nan for sizes in each.sizes])
    own = image.sizes[0]
    pieces, holes = each.n_bodies.astype(np.float64), each.euler_number.astype(np.float64)
    return [
        ("Γ", "gamma", Strip("two random cells are connected", each.gamma, float(image.gamma[0]))),
        ("Bodies", "n_bodies", Strip(
            f"per {AREA:,} cells", pieces * per, float(image.n_bodies[0]) * per_image)),
        ("Euler number", "euler", Strip(
            f"bodies less holes, per {AREA:,} cells", holes * per,
            float(image.euler_number[0]) * per_image)),
        ("Largest body", "largest", Strip(
            "share of the facies", shares, float(own[0] / own.sum()) if len(own) else np.nan)),
    ]  # fmt: skip


def _draw_strips(found: GeobodiesCompared, name: str, colour: str) -> None:
    places = st.columns(2, gap="large") + st.columns(2, gap="large")
    for place, (title, word, strip) in zip(places, strips_of(found), strict=True):
        with place:
            chart = strip_chart(strip, chart_theme(), colour=colour)
            titled_chart(title, f"of {name}", chart, word, f"{title} of {name}: {strip.title}")
    step_note(said_percolation(found, name))


def said_percolation(found: GeobodiesCompared, name: str) -> str:
    """Say in how many realizations a body goes from edge to edge."""
    each, image, n = found.each, found.reference, len(found.each.n_bodies)
    ew, ns = int(each.percolates_ew.sum()), int(each.percolates_ns.sum())
    also = [
        way
        for way, does in (("E–W", image.percolates_ew[0]), ("N–S", image.percolates_ns[0]))
        if does
    ]
    own = f"in the training image {' and '.join(also)}" if also else "not in the training image"
    return (
        f"A body of {name} goes from edge to edge E–W in {ew} and N–S in {ns} of {n} "
        f"realizations, {own}. Cells that touch at sides or corners are connected. Edges cut "
        "bodies, more so in a smaller image."
    )
