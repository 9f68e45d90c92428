"""Sections of the page Validate: honoured data, uncertainty, and scores against a reference."""

from collections.abc import Sequence
from dataclasses import replace
from html import escape
from typing import Any

import numpy as np
import streamlit as st
from numpy.typing import NDArray

from ccwsim import CCWSIMError, Ensemble, TrainingImage
from ccwsim.figures import ENTROPY, calibration_chart, data_status_chart, ramp
from ccwsim.metrics import Calibration, EType, ReferenceScores, data_match
from ccwsim.model.arrays import describe_shape
from ccwsim.model.ensemble import FORCED, WRONG
from ccwsim.model.numbers import three_digits
from ccwsim.ui.frontend.cells import CellMap, draw_cells, facies_map, points_of, share_map
from ccwsim.ui.results.charts import titled_chart
from ccwsim.ui.session.state import State
from ccwsim.ui.validate import statistics
from ccwsim.ui.validate.slices import slice_of
from ccwsim.ui.validate.statistics import panel
from ccwsim.ui.widgets.text import numbers_table, page_text, panel_title, step_note
from ccwsim.ui.widgets.theme import chart_theme

CERTAIN = 0.05
"""Entropy below which a cell counts as certain."""
MAX_LISTED = 100
"""Maximum number of data in the list of missed data of a volume."""
RIGHT_AND_WRONG = ["#D9D6CF", "#A63A26"]


def draw_uncertainty(state: State, ensemble: Ensemble, colours: Sequence[str]) -> None:
    """Draw three maps: probability of the chosen facies, most likely facies, and entropy."""
    task = statistics.e_type(ensemble)
    panel(state, "uncertainty", task, lambda e: draw_e_type_maps(e, state, ensemble, colours))


def draw_e_type_maps(
    found: EType, state: State, ensemble: Ensemble, colours: Sequence[str], prefix: str = ""
) -> None:
    """Draw the three linked maps side by side; their keys start with `prefix`."""
    image, data = ensemble.training_image, ensemble.hard_data
    name, shares = image.facies_names[state.facies], found.probability[state.facies]
    title = f"Probability of {name}"
    n_certain = three_digits(100 * float((found.entropy < CERTAIN).mean()))
    certain = f"{n_certain} % of the cells are certain"
    probability = share_map(shares, f"P({name}) =", title, point_colours=colours)
    most_likely = facies_map(found.most_likely_indices, image, colours, "Most likely facies")
    alt = "Entropy, from 0 (certain) to 1 (all facies equally likely)"
    entropy = share_map(found.entropy, "entropy", alt, colours=ENTROPY, point_colours=colours)
    maps = (
        (title, "E-type", "probability", probability),
        ("Most likely facies", "", "most_likely", most_likely),
        ("Entropy", certain, "entropy", entropy),
    )
    for column, (title, note, key, shown) in zip(st.columns(3, gap="medium"), maps, strict=True):
        with column:
            panel_title(title, note)
            shown.points.extend(points_of(data, image))
            options: dict[str, Any] = {"scale": f"{prefix}three", "body": False, "max_height": 400}
            draw_cells(shown, f"{prefix}{key}", link="grid", name=key, **options)


def draw_data(state: State, ensemble: Ensemble, colours: Sequence[str]) -> None:
    """Draw the shares of data statuses, and a map (for volumes, a list) of local re-simulations."""
    if not ensemble.hard_data.n:
        step_note("This study has no hard data; place or load some on the page Hard data.")
        return
    left, right = st.columns([1.6, 1.0], gap="large")
    names, shares = data_status_shares(ensemble)
    with left:
        chart = data_status_chart(names, shares, chart_theme(), height=96 + 32 * len(names))
        alt = "Share of the data honoured in the raster pass, by local re-simulation, or forced"
        note = describe_match(ensemble)
        titled_chart("Status of the data", note, chart, "data_status", alt)
        step_note(
            page_text("Status of data")
            if ensemble.parameters.exact_data
            else page_text("Status of data that are not honoured exactly")
        )
    with right:
        if ensemble.grid.nz is not None:
            draw_data_list(ensemble)
            return
        panel_title("Data that are re-simulated locally", "squares mark the data")
        shown = resimulation_map(ensemble, chart_theme().hairline)
        shown = replace(shown, points=wrong_points(ensemble), point_colours=colours)
        draw_cells(shown, "mended", link="grid", name="resimulated", max_height=360)


def data_status_shares(ensemble: Ensemble) -> tuple[list[str], NDArray[np.float64]]:
    """Return the names of data statuses and their shares, shape (n_realizations, n_statuses)."""
    sizes = sorted({int(size) for size in np.unique(ensemble.data_status) if size > 0})
    codes = [0, *sizes, FORCED]
    sides = "{0} × {0} cells" if ensemble.grid.nz is None else "{0} cells long"
    windows = (f"re-simulated, {sides.format(size)}" for size in sizes)
    names = ["raster pass", *windows, "forced"]
    if not ensemble.parameters.exact_data:
        codes, names = [0, WRONG], ["raster pass", "wrong"]
    shares = np.stack([(ensemble.data_status == code).mean(axis=1) for code in codes], axis=1)
    return names, shares


def describe_match(ensemble: Ensemble) -> str:
    """Return a text that states whether realizations honour all data."""
    match = data_match(ensemble.realizations, ensemble.hard_data)
    n = ensemble.hard_data.n
    if not match.n_wrong.any():
        return f"all {n} honoured in all {ensemble.n} realizations"
    share = three_digits(100 * match.wrong.mean())
    return f"{share} % not honoured, up to {int(match.n_wrong.max())} of {n} in a realization"


def resimulation_map(ensemble: Ensemble, ground: str) -> CellMap:
    """Return a map of how often each datum (a square) was re-simulated or forced, in %."""
    resimulated = (ensemble.data_status != 0) & (ensemble.data_status != WRONG)
    shares = np.rint(100 * resimulated.mean(axis=0)).astype(np.uint8)
    ny, nx = ensemble.grid.shape
    indices = np.zeros((ny, nx), np.uint8)
    side = max(ny, nx) // 100
    order = np.argsort(shares)
    for (row, column), share in zip(ensemble.hard_data.cells[order], shares[order], strict=True):
        south, west = max(row - side, 0), max(column - side, 0)
        indices[south : row + side + 1, west : column + side + 1] = 1 + share
    labels = ["no datum", *(f"re-simulated in {k} % of the realizations" for k in range(101))]
    strip = {"colours": list(ENTROPY), "low": "never", "high": "always"}
    alt = "Share of the realizations in which each datum is re-simulated locally or forced"
    return CellMap(indices, [ground, *ramp(ENTROPY, 101)], labels, alt, strip=strip)


def draw_data_list(ensemble: Ensemble) -> None:
    """List the data that were not honoured in the raster pass, in order of severity."""
    order, times = troubled_data(ensemble)
    n = len(order)
    if not n:
        panel_title("Data", "all honoured in the raster pass, in all realizations")
        return
    of_all = f"{n} of {ensemble.hard_data.n} not honoured in the raster pass"
    panel_title("Data", f"{of_all}; the first {MAX_LISTED}" if n > MAX_LISTED else of_all)
    image, data, grid = ensemble.training_image, ensemble.hard_data, ensemble.grid
    names = dict(zip(image.codes.tolist(), image.facies_names, strict=True))
    rows = []
    for k in order[:MAX_LISTED].tolist():
        where = ", ".join(f"{place:g}" for place in grid.centers_of(data.cells[k : k + 1])[0])
        counts = (str(count) if count else "" for count in times[:, k].tolist())
        rows.append([where, escape(names[int(data.facies[k])]), *counts])
    with st.container(height=320, border=False, key="data_list"):
        st.html(numbers_table(rows, ("x, y, z", "facies", "wrong", "forced", "re-simulated")))
    step_note(f"Counts are numbers of realizations, out of {ensemble.n}. An empty field means 0.")


def troubled_data(ensemble: Ensemble) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return data not honoured in the raster pass, worst first, and counts of shape (3, n_data)."""
    wrong = data_match(ensemble.realizations, ensemble.hard_data).times_wrong
    forced = (ensemble.data_status == FORCED).sum(axis=0)
    resimulated = (ensemble.data_status > 0).sum(axis=0)
    times = np.stack([wrong, forced, resimulated])
    order = np.lexsort(-times[::-1])
    return order[times[:, order].any(axis=0)], times


def wrong_points(ensemble: Ensemble) -> list[list[int]]:
    """Return the data that are wrong in at least one realization, as points of a map."""
    match = data_match(ensemble.realizations, ensemble.hard_data)
    points = points_of(ensemble.hard_data, ensemble.training_image)
    return [[*points[k][:3], 1] for k in np.flatnonzero(match.times_wrong)]


def draw_reference(state: State, ensemble: Ensemble, colours: Sequence[str]) -> None:
    """Draw scores against the reference field, from which the data were sampled."""
    reference = state.reference
    if reference is None:
        step_note(page_text("No reference field"))
        return
    if problem := problem_of(reference, ensemble):
        raise CCWSIMError(problem)
    image = ensemble.training_image
    here = slice_of(state, ensemble)
    shown = here.ensemble(ensemble)
    field = np.searchsorted(image.codes, here.of(reference.array)).astype(np.uint8)

    def draw(found: tuple[ReferenceScores, Calibration]) -> None:
        scores, table = found
        st.html(f'<p class="facts">{describe_scores(scores)}</p>')
        *places, right = st.columns([1.0, 1.0, 1.2], gap="medium")
        reference_map = facies_map(field, image, colours, "The reference field")
        wrong = wrong_map(replace(scores, right=here.of(scores.right)), colours)
        maps = ("Reference field", reference_map), ("Cells predicted wrongly", wrong)
        for place, key, (title, drawn) in zip(places, ("truth", "wrong"), maps, strict=True):
            with place:
                panel_title(title, str(here))
                drawn.points.extend(points_of(shown.hard_data, image))
                draw_cells(drawn, key, link="grid", scale="truth", name=key, max_height=320)
        with right:
            chart = calibration_chart(table.forecast, table.observed, table.count, chart_theme())
            note = f"off by {100 * table.error:.1f} % on average"
            alt = "Share of cells with the true facies, for each predicted probability"
            titled_chart("Calibration", note, chart, "calibration", alt)

    panel(state, "truth", statistics.reference_scores(ensemble, reference), draw)


def problem_of(reference: TrainingImage, ensemble: Ensemble) -> str:
    """Return the reason why realizations cannot be scored, or an empty text."""
    if reference.shape != ensemble.grid.shape:
        own, grid = describe_shape(reference.shape), describe_shape(ensemble.grid.shape)
        return f"The reference field has {own} cells, the grid {grid}. Sample the data again."
    unknown = np.setdiff1d(reference.codes, ensemble.training_image.codes)
    if len(unknown):
        return (
            f"The reference field has facies {unknown[0]}, which is not in the training image. "
            "Sample the data again."
        )
    return ""


def describe_scores(scores: ReferenceScores) -> str:
    """Return the scores as text; cells with data are excluded from the scores."""
    dot = '<span class="dot">·</span>'
    return (
        f"{100 * scores.accuracy:.1f} % of {scores.n_cells:,} cells without data predicted {dot} "
        f"Brier score {three_digits(scores.brier)} of 2, 0 is best {dot} "
        f"log score {three_digits(scores.log_score)}, 0 is best"
    )


def wrong_map(scores: ReferenceScores, colours: Sequence[str]) -> CellMap:
    """Return a map of the cells whose most likely facies differs from the true facies."""
    labels, alt = ["right", "wrong"], "Cells whose most likely facies differs from the true facies"
    keys = list(zip(labels, RIGHT_AND_WRONG, strict=True))
    indices = (~scores.right).astype(np.uint8)
    return CellMap(indices, RIGHT_AND_WRONG, labels, alt, keys=keys, point_colours=colours)
