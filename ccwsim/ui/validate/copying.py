"""What a realization copied from the training image, and what the training image is like."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import streamlit as st

from ccwsim.figures import CIVIDIS, ramp
from ccwsim.metrics import Copying, Diagnosis
from ccwsim.model.ensemble import Ensemble
from ccwsim.ui.results.tables import numbers_table
from ccwsim.ui.session.state import State
from ccwsim.ui.study.diagnosis_panel import draw_diagnosis
from ccwsim.ui.study.image_step import use_advice
from ccwsim.ui.validate import statistics
from ccwsim.ui.validate.panel import panel
from ccwsim.ui.widgets.facts import three_digits
from ccwsim.ui.widgets.maps import CellMap, draw_map
from ccwsim.ui.widgets.steps import panel_title, step_note
from ccwsim.ui.widgets.theme import chart_theme

MAP_HEIGHT = 420
MAX_USES = 100
"""Locations used more often than this are drawn alike."""


def draw_copying(state: State, ensemble: Ensemble, colours: Sequence[str]) -> None:
    """Draw seams, uses of the training image and numbers of the realization that is shown."""
    r = state.shown

    def draw(found: Copying) -> None:
        left, middle, right = st.columns([1.0, 1.0, 0.8], gap="medium")
        with left:
            share = three_digits(100 * found.seams.mean())
            panel_title("Seams", f"{share} % of the cells are at one")
            shown = seam_map(found, ensemble, r, colours, chart_theme().reference)
            draw_map(shown, "map_seams", link="grid", name="seams", max_height=MAP_HEIGHT)
        with middle:
            panel_title("Where it came from", "uses of each cell of the training image")
            draw_map(use_map(found), "map_uses", name="uses", max_height=MAP_HEIGHT)
        with right:
            panel_title("Copy meter", f"realization {ensemble.numbers[r] + 1}")
            st.html(numbers_table(meter_of(found)))
            step_note(
                "Neighbours kept: pairs of touching cells that touch in the same way in the "
                "training image. All kept would be a copy; few kept would be noise. A piece is "
                "what holds together without a seam."
            )

    panel(state, "reuse", statistics.copied(ensemble, r), draw)


def draw_image(state: State, ensemble: Ensemble, colours: Sequence[str]) -> None:
    """Draw what the training image of the realizations is like."""
    image = ensemble.training_image

    def draw(found: Diagnosis) -> None:
        parameters = state.choices.parameters
        draw_diagnosis(found, image, parameters, colours, lambda new: use_advice(state, new))

    panel(state, "diagnosis", statistics.diagnosis(image), draw)


def meter_of(found: Copying) -> list[tuple[str, str]]:
    """Return the copy meter: what is measured, and how much it is."""
    side = found.largest_square
    return [
        ("neighbours kept", f"{100 * found.copied:.1f} %"),
        ("largest square copied", f"{side} × {side} cells"),
        ("largest piece copied", f"{found.largest_block:,} cells"),
        ("training image used", f"{100 * found.used:.0f} %"),
        ("forced", f"{found.n_unknown:,} cells"),
    ]


def seam_map(
    found: Copying, ensemble: Ensemble, r: int, colours: Sequence[str], line: str
) -> CellMap:
    """Return a realization with its seams drawn over it; the hover still says the facies."""
    names = ensemble.training_image.facies_names
    n = len(names)
    seams = found.seams if n <= 128 else np.zeros_like(found.seams)
    return CellMap(
        indices=(ensemble.indices[r] + n * seams).astype(np.uint8),
        colours=[*colours, *[line] * n],
        labels=[*names, *(f"{name}, at a seam" for name in names)],
        alt=f"Seams between pieces of the training image in realization {r + 1}",
        keys=[*zip(names, colours, strict=True), ("seam", line)][-8:],
    )


def use_map(found: Copying) -> CellMap:
    """Return how often each cell of the training image was used."""
    most = max(int(found.uses.max()), 1)
    n = min(most, MAX_USES)
    labels = [f"used {k} times" for k in range(n + 1)]
    if most > n:
        labels[-1] = f"used {n} times or more"
    return CellMap(
        indices=np.minimum(found.uses, n).astype(np.uint8),
        colours=ramp(CIVIDIS, n + 1),
        labels=labels,
        alt="How often each cell of the training image was used",
        strip={"colours": list(CIVIDIS), "low": "0", "high": f"{n} uses"},
    )
