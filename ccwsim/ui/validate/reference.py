"""Scores against the field that the hard data were sampled from."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import streamlit as st

from ccwsim.figures import calibration_chart
from ccwsim.metrics import Calibration, ReferenceScores
from ccwsim.model.ensemble import Ensemble
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.training_image import TrainingImage
from ccwsim.ui.results.titled_chart import titled_chart
from ccwsim.ui.session.state import State
from ccwsim.ui.validate.panel import panel
from ccwsim.ui.validate.statistics import truth
from ccwsim.ui.widgets.facts import three_digits
from ccwsim.ui.widgets.maps import CellMap, draw_map, facies_map, points_of
from ccwsim.ui.widgets.steps import panel_title, step_note
from ccwsim.ui.widgets.theme import chart_theme

MAP_HEIGHT = 320
RIGHT, WRONG = "#D9D6CF", "#A63A26"


def draw_reference(state: State, colours: Sequence[str]) -> None:
    """Draw scores, calibration, and where the most likely facies is wrong."""
    ensemble, reference = state.ensemble, state.reference
    assert ensemble is not None
    if reference is None:
        step_note(
            "There is no hidden truth for these data. Sample them from a realization or from an "
            "image of yours on the page Hard data: the field stays hidden, and realizations are "
            "scored against it here."
        )
        return
    problem = problem_of(reference, ensemble)
    if problem:
        raise CCWSIMError(problem)

    def draw(found: tuple[ReferenceScores, Calibration]) -> None:
        _draw(*found, ensemble=ensemble, reference=reference, colours=colours)

    panel(state, "truth", truth(ensemble, reference), draw)


def problem_of(reference: TrainingImage, ensemble: Ensemble) -> str:
    """Return why realizations cannot be scored against a field, or an empty text."""
    if reference.shape != ensemble.grid.shape:
        return (
            f"The hidden truth has {reference.shape[1]} × {reference.shape[0]} cells and the grid "
            f"{ensemble.grid.nx} × {ensemble.grid.ny}; sample the data again."
        )
    unknown = np.setdiff1d(reference.codes, ensemble.training_image.codes)
    if len(unknown):
        return (
            f"The hidden truth has facies {unknown[0]}, which the training image does not have; "
            "sample the data again."
        )
    return ""


def _draw(
    scores: ReferenceScores,
    table: Calibration,
    *,
    ensemble: Ensemble,
    reference: TrainingImage,
    colours: Sequence[str],
) -> None:
    image = ensemble.training_image
    st.html(f'<p class="facts">{said_scores(scores, table)}</p>')
    places = st.columns([1.0, 1.0, 1.2], gap="medium")
    points = points_of(ensemble.hard_data, image)
    true = np.searchsorted(image.codes, reference.array).astype(np.uint8)
    maps = (
        ("Hidden truth", "map_truth", facies_map(true, image, colours, "The hidden truth")),
        ("Most likely facies is wrong", "map_wrong", wrong_map(scores, colours)),
    )
    for place, (title, key, shown) in zip(places[:2], maps, strict=True):
        with place:
            panel_title(title)
            shown.points.extend(points)
            draw_map(
                shown, key, link="grid", scale="truth", name=key[4:], max_height=MAP_HEIGHT
            )  # fmt: skip
    with places[2]:
        titled_chart(
            "Calibration", f"off by {100 * table.error:.1f} % on average",
            calibration_chart(table.forecast, table.observed, table.count, chart_theme()),
            "calibration", "How often facies of each probability are the true one",
        )  # fmt: skip


def said_scores(scores: ReferenceScores, table: Calibration) -> str:
    """Say the scores in words; cells with data are left out."""
    return (
        f"{100 * scores.accuracy:.1f} % of {scores.n_cells:,} cells without data foreseen "
        f'<span class="dot">·</span> Brier score {three_digits(scores.brier)} of 2, 0 is best '
        f'<span class="dot">·</span> log score {three_digits(scores.log_score)}, 0 is best'
    )


def wrong_map(scores: ReferenceScores, colours: Sequence[str]) -> CellMap:
    """Return where the most likely facies is the true one and where not."""
    return CellMap(
        (~scores.right).astype(np.uint8), [RIGHT, WRONG], ["right", "wrong"],
        "Where the most likely facies is not the true one",
        keys=[("right", RIGHT), ("wrong", WRONG)], point_colours=colours,
    )  # fmt: skip
