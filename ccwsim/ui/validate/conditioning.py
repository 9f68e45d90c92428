"""Sections of the page Validate on hard data, uncertainty, and a reference field."""

from base64 import b64encode
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from html import escape
from math import isfinite
from typing import TypeVar

import numpy as np
import streamlit as st

from ccwsim import CCWSIMError, Ensemble, HardData, TrainingImage, datasets, metrics
from ccwsim.figures import ENTROPY, calibration_chart, data_status_chart, facies_colours, ramp
from ccwsim.jobs.statistics import Task
from ccwsim.metrics.data_fit import MIN_PLACES, winner
from ccwsim.model import (
    FORCED,
    WRONG,
    Floats,
    Fraction,
    Ints,
    coordinate,
    describe_shape,
    minus,
    three_digits,
)
from ccwsim.report.verdicts import Verdict
from ccwsim.ui.frontend.cells import CellMap, draw_cells, editor_points, facies_map, number_map
from ccwsim.ui.results.charts import titled_chart
from ccwsim.ui.results.maps import draw_given, given_map, pretty, with_data
from ccwsim.ui.session import State, as_task
from ccwsim.ui.study.data_step import data_fit, draw_variant, numbers, variant_tasks, verdict
from ccwsim.ui.study.image_step import image_thumbnail
from ccwsim.ui.validate import statistics
from ccwsim.ui.validate.slices import slice_of, wells_on
from ccwsim.ui.validate.statistics import Validation, ZoneFit, panel
from ccwsim.ui.widgets import (
    button,
    chart_theme,
    numbers_table,
    page_text,
    panel_title,
    scrolled,
    step_note,
)

CERTAIN_ENTROPY = 0.05  # entropy below which a cell counts as certain
MAX_MISSED_LISTED = 100  # maximum number of data in the list of missed data of a volume
RIGHT_AND_WRONG = ["#D9D6CF", "#A63A26"]


def draw_uncertainty(state: State, ensemble: Ensemble, colours: Sequence[str]) -> None:
    """Draw three maps: probability of the chosen facies, most likely facies, and entropy."""
    task = statistics.e_type(ensemble)
    panel(state, "uncertainty", task, lambda e: draw_e_type_maps(e, state, ensemble, colours))
    if (guide_map := given_map(ensemble, state.facies)) is not None:
        _draw_reliability(state, ensemble, guide_map)
    if (secondary := ensemble.secondary) is None:
        return
    if secondary.angle is not None and not ensemble.grid.is_volume:
        task = statistics.compute_direction_error(ensemble, state.facies)
        panel(state, "directions", task, lambda off: _draw_directions(off, ensemble, state.facies))
    if secondary.zones is not None:
        task = statistics.zones(ensemble)
        panel(state, "zones", task, lambda fits: _draw_zones(fits, ensemble, state.facies))


def _draw_directions(off: Floats, ensemble: Ensemble, facies: int) -> None:
    """Draw the differences between directions and the given angles."""
    size, name = np.abs(off), ensemble.training_image.facies_names[facies]
    if ensemble.secondary is not None and ensemble.secondary.zones is not None:
        size[ensemble.secondary.zones > 0] = np.nan  # other images have other directions
    most = float(np.nanquantile(size, 0.9))
    note = f"{np.nanmean(size):.1f}° on average, at most {most:.1f}° in 90 % of the cells"
    panel_title("Difference from the given angles", note)
    cell_map = number_map(size / 90, "difference / 90° =", f"Directions of {name}", colours=ENTROPY)
    draw_cells(cell_map, "directions", link="grid", name="directions", body=False, max_height=400)


def _draw_zones(fits: Sequence[ZoneFit], ensemble: Ensemble, facies: int) -> None:
    """Draw a table that compares each zone with its own image and with the nearest other image."""
    rows, names = [], names_of_zones(ensemble)
    for k, size, each, of_image, far in fits:
        shares, image_share = each[:, facies], of_image[facies]
        other = min(set(range(len(names))) - {k}, key=lambda other: far[other])
        apart = round(100 * (shares.mean() - image_share), 1) + 0
        difference = f"{apart:+}\u00a0±\u00a0{100 * shares.std():.1f}"
        percent = [f"{100 * share:.1f}\u00a0%" for share in (size, shares.mean(), image_share)]
        row = [f"{k} {names[k]}", *percent, difference]
        if isfinite(far[k]):  # otherwise, the zone is smaller than a pattern
            sign = "✓ " if far[k] < far[other] else "⚑ "
            row += [f"{sign}{far[k]:.3f}", f"{far[other]:.3f} ({names[other]})"]
        rows.append([escape(minus(cell)) for cell in row])
    name = ensemble.training_image.facies_names[facies]
    head = "zone", "cells", escape(name), "its image", "difference", "patterns", "nearest other"
    panel_title("Zones", "each compared with its own training image")
    st.html(scrolled(numbers_table(rows, head), "Zones"))
    step_note(page_text("Zones"))


def names_of_zones(ensemble: Ensemble) -> list[str]:
    """Return the names of the images of an ensemble with zones; empty without zones."""
    secondary = ensemble.secondary
    if secondary is None or secondary.zones is None:
        return []
    return [_name(image) for image in (ensemble.training_image, *secondary.images)]


def describe_zones(fits: Sequence[ZoneFit], names: Sequence[str]) -> list[Verdict]:
    """Return findings on whether each zone's patterns are nearest to those of its own image."""
    nearest = {k: int(np.argmin(far)) for k, *_, far in fits if isfinite(far[k])}
    off = [(k, names[other]) for k, other in nearest.items() if other != k]
    sentences = [f"zone {k}: patterns are nearer to {name}" for k, name in off]
    if nearest and not off:
        sentences = [f"patterns of all {len(nearest)} zones are nearest to their own images"]
    return [Verdict(words, good=not off) for words in sentences]


def _draw_reliability(state: State, ensemble: Ensemble, guide_map: CellMap) -> None:
    """Draw the given probabilities below the E-type, and the reliability of the realizations."""
    image, name = ensemble.training_image, ensemble.training_image.facies_names[state.facies]
    left, right = st.columns([1.0, 2.0], gap="medium")
    with left:
        draw_given(guide_map, name, scale="three", body=False, max_height=400)
    with right:
        table = metrics.reliability(ensemble, int(image.codes[state.facies]))
        chart = calibration_chart(
            table.forecast, table.observed, table.count, chart_theme(), guided=True
        )
        alt = f"Share of {name} in the realizations, for each given probability"
        titled_chart("Reliability", f"share of {name} given and simulated", chart, "given", alt)
        if note := metrics.warn_of_reliability(table, name):
            step_note(f"{note[:1].upper()}{note[1:]}. A smaller template follows the map better.")


def draw_e_type_maps(
    e_type: metrics.EType,
    state: State,
    ensemble: Ensemble,
    colours: Sequence[str],
) -> None:
    """Draw the three linked maps side by side."""
    image, data = ensemble.training_image, ensemble.hard_data
    name, shares = image.facies_names[state.facies], e_type.probability[state.facies]
    title = f"Probability of {name}"
    entropies = e_type.entropy[~np.isnan(e_type.entropy)]  # without inactive cells
    share = float((entropies < CERTAIN_ENTROPY).mean())
    certain = f"{three_digits(100 * share)} % of the cells are certain"
    probability = number_map(shares, f"P({name}) =", title, point_colours=colours)
    most_likely = facies_map(e_type.most_likely_indices, image, colours, "Most likely facies")
    alt = "Entropy, from 0 (certain) to 1 (all facies equally likely)"
    entropy = number_map(e_type.entropy, "entropy", alt, colours=ENTROPY, point_colours=colours)
    maps = (
        (title, "E-type", "probability", probability),
        ("Most likely facies", "", "most_likely", most_likely),
        ("Entropy", certain, "entropy", entropy),
    )
    for column, (title, note, key, cell_map) in zip(st.columns(3, gap="medium"), maps, strict=True):
        with column:
            panel_title(title, note)
            cell_map = with_data(state, cell_map, data, image, wells=wells_on(state, ensemble))
            draw_cells(
                cell_map,
                key,
                link="grid",
                name=key,
                scale="three",
                body=False,
                max_height=400,
            )


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
        if ensemble.grid.is_volume:
            draw_data_list(ensemble)
            return
        panel_title("Data that are re-simulated locally", "squares mark the data")
        cell_map = resimulation_map(ensemble, chart_theme().hairline)
        cell_map = replace(cell_map, points=wrong_points(ensemble), point_colours=colours)
        draw_cells(cell_map, "mended", link="grid", name="resimulated", max_height=360)


def data_status_shares(ensemble: Ensemble) -> tuple[list[str], Floats]:
    """Return the names of data statuses and their shares, shape (n_realizations, n_statuses)."""
    sizes = sorted({int(size) for size in np.unique(ensemble.data_status) if size > 0})
    codes = [0, *sizes, FORCED]
    sides = "{0} cells long" if ensemble.grid.is_volume else "{0} × {0} cells"
    windows = (f"re-simulated, {sides.format(size)}" for size in sizes)
    names = ["raster pass", *windows, "forced"]
    if not ensemble.parameters.exact_data:
        codes, names = [0, WRONG], ["raster pass", "wrong"]
    shares = np.stack([(ensemble.data_status == code).mean(axis=1) for code in codes], axis=1)
    return names, shares


def describe_match(ensemble: Ensemble) -> str:
    """Return a text that states whether realizations honour all data."""
    match = metrics.data_match(ensemble.realizations, ensemble.hard_data)
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
    panel_title(
        "Data", f"{of_all}; the first {MAX_MISSED_LISTED}" if n > MAX_MISSED_LISTED else of_all
    )
    image, data, grid = ensemble.training_image, ensemble.hard_data, ensemble.grid
    rows = []
    for k in order[:MAX_MISSED_LISTED].tolist():
        position = ", ".join(map(coordinate, grid.centers_of(data.cells[k : k + 1])[0]))
        counts = (str(count) if count else "" for count in times[:, k].tolist())
        rows.append([position, escape(image.names_by_code[int(data.facies[k])]), *counts])
    with st.container(height=320, border=False, key="data_list"):
        st.html(numbers_table(rows, ("x, y, z", "facies", "wrong", "forced", "re-simulated")))
    step_note(f"Counts are numbers of realizations, out of {ensemble.n}. An empty field means 0.")


def troubled_data(ensemble: Ensemble) -> tuple[Ints, Ints]:
    """Return data not honoured in the raster pass, worst first, and counts of shape (3, n_data)."""
    wrong = metrics.data_match(ensemble.realizations, ensemble.hard_data).times_wrong
    forced = (ensemble.data_status == FORCED).sum(axis=0)
    resimulated = (ensemble.data_status > 0).sum(axis=0)
    times = np.stack([wrong, forced, resimulated])
    order = np.lexsort(-times[::-1])
    return order[times[:, order].any(axis=0)], times


def wrong_points(ensemble: Ensemble) -> list[list[int]]:
    """Return the data that are wrong in at least one realization, as points of a map."""
    match = metrics.data_match(ensemble.realizations, ensemble.hard_data)
    points = editor_points(ensemble.hard_data, ensemble.training_image)
    return [[*points[k][:3], 1] for k in np.flatnonzero(match.times_wrong)]


def draw_reference(state: State, ensemble: Ensemble, colours: Sequence[str]) -> None:
    """Draw scores against the reference field, from which the data were sampled."""
    reference = state.reference
    if reference is None:
        step_note(page_text("No reference field"))
        return
    if problem := scoring_problem(reference, ensemble):
        raise CCWSIMError(problem)
    image = ensemble.training_image
    shown_slice = slice_of(state, ensemble)
    slice_ensemble = shown_slice.ensemble(ensemble)
    facies_grid = np.searchsorted(image.codes, shown_slice.of(reference.array)).astype(np.uint8)

    def draw(scored: tuple[metrics.ReferenceScores, metrics.Calibration]) -> None:
        scores, table = scored
        st.html(f'<p class="facts">{describe_reference_scores(scores)}</p>')
        *places, right = st.columns([1.0, 1.0, 1.2], gap="medium")
        reference_map = facies_map(facies_grid, image, colours, "The reference field")
        wrong = wrong_map(replace(scores, right=shown_slice.of(scores.right)), colours)
        maps = ("Reference field", reference_map), ("Cells predicted wrongly", wrong)
        for place, key, (title, cell_map) in zip(places, ("truth", "wrong"), maps, strict=True):
            with place:
                panel_title(title, str(shown_slice))
                wells = wells_on(state, slice_ensemble)
                cell_map = with_data(state, cell_map, slice_ensemble.hard_data, image, wells=wells)
                draw_cells(cell_map, key, link="grid", scale="truth", name=key, max_height=320)
        with right:
            chart = calibration_chart(table.forecast, table.observed, table.count, chart_theme())
            note = f"off by {100 * table.error:.1f} % on average"
            alt = "Share of cells with the true facies, for each predicted probability"
            titled_chart("Calibration", note, chart, "calibration", alt)

    panel(state, "truth", statistics.reference_scores(ensemble, reference), draw)


def scoring_problem(reference: TrainingImage, ensemble: Ensemble) -> str:
    """Return the reason why realizations cannot be scored, or an empty text."""
    if reference.shape != ensemble.grid.shape:
        size, grid = describe_shape(reference.shape), describe_shape(ensemble.grid.shape)
        return f"The reference field has {size} cells, the grid {grid}. Sample the data again."
    unknown = np.setdiff1d(reference.codes, ensemble.training_image.codes)
    if len(unknown):
        return page_text("Facies that only the reference field has", facies=unknown[0])
    return ""


def describe_reference_scores(scores: metrics.ReferenceScores) -> str:
    """Return the scores as text; cells with data are excluded from the scores."""
    brier, log_score = three_digits(scores.brier), three_digits(scores.log_score)
    return page_text(
        "Scores of a reference field",
        brier=brier,
        log_score=log_score,
        share=100 * scores.accuracy,
        n=scores.n_cells,
    )


def wrong_map(scores: metrics.ReferenceScores, colours: Sequence[str]) -> CellMap:
    """Return a map of the cells whose most likely facies differs from the true facies."""
    labels, alt = ["right", "wrong"], "Cells whose most likely facies differs from the true facies"
    keys = list(zip(labels, RIGHT_AND_WRONG, strict=True))
    indices = (~scores.right).astype(np.uint8)
    return CellMap(indices, RIGHT_AND_WRONG, labels, alt, keys=keys, point_colours=colours)


PICTURE_SIDE = 48  # side of a picture in the table of images, in pixels
Value = TypeVar("Value")


@as_task
def ranks(
    progress: Fraction, data: HardData, image: TrainingImage
) -> tuple[metrics.ImageRank, ...]:
    """Rank the bundled images and the image of the study by the hard data."""
    bundled = [datasets.load(name) for name in datasets.BUNDLED_IMAGES]
    candidates = [
        candidate
        for candidate in bundled
        if candidate.n_dimensions == image.n_dimensions and candidate.variable == image.variable
    ]
    return metrics.rank_images(
        [image, *(candidate for candidate in candidates if candidate.digest != image.digest)],
        data,
        progress,
    )


@as_task
def predict_left_out(progress: Fraction, ensemble: Ensemble, by_well: bool) -> metrics.LeaveOut:
    """Predict each fifth of the hard data, or of the wells, from the other data."""
    study = replace(ensemble.study, checked=True)
    return metrics.leave_out(study, by="well" if by_well else "datum", progress=progress)


def draw_data_and_image(state: State, ensemble: Ensemble, colours: Sequence[str]) -> None:
    """Draw whether the data contradict the image, the ranking of images, and left-out data."""
    data, image = ensemble.hard_data, ensemble.training_image
    if data.n < MIN_PLACES:
        step_note(f"Fewer than {MIN_PLACES} hard data say nothing about a training image.")
        return
    left, middle, right = st.columns([1.2, 1.2, 1.0], gap="large")
    with left:
        panel_title("Fit", "of the data to this image")
        if ensemble.is_of_other_images:
            step_note(page_text("Other images"))
        else:
            panel(state, "data_fit", data_fit(image, data, ensemble.grid), _draw_fit)
            for task in variant_tasks(image, data):
                panel(state, "variant", task, partial(draw_variant, state, "turn_validated"))
    with middle:
        panel_title("Best image", "among the bundled images and yours")
        tip = "Nothing is simulated: each datum is predicted from its neighbours by each image."
        _draw_on_demand(state, "Rank images", ranks(data, image), _draw_ranks, tip)
    with right:
        panel_title("Left-out data", "are probabilities reliable?")
        tip = "Simulates five times 24 realizations without a fifth of the data."
        task = predict_left_out(ensemble, ensemble.grid.is_volume)
        _draw_on_demand(state, "Leave data out", task, _draw_left_out, tip)


def _draw_on_demand(
    state: State, label: str, task: Task[Value], draw: Callable[[Value], None], tip: str
) -> None:
    """Draw a button that starts a task; after it was pressed, draw the value of the task."""
    asked, name = state.page(Validation).asked, label.lower().replace(" ", "_")
    if task.key in asked:
        panel(state, name, task, draw)
    else:
        button(label, key=f"ask_{name}", on_click=asked.add, args=(task.key,), help=tip)


def _draw_fit(fit: metrics.DataFit) -> None:
    st.html(verdict(fit))
    families = sorted(fit.families.items(), key=lambda item: -item[1])
    rows = [(escape(name), f"{value:.1f}") for name, value in families]
    st.html(numbers_table([("largest difference", "standard deviations"), *rows]))
    step_note(numbers(fit))


def _draw_ranks(ranking: Sequence[metrics.ImageRank]) -> None:
    best = winner(ranking)
    if best is None:
        st.html('<p class="note">· Data cannot tell these images apart</p>')
    else:
        name = escape(_name(best))
        st.html(f'<p class="note">✓ {name} predicts your data best</p>')
    rows = "<tr><th></th><th></th><td>log score</td><td>behind, in standard errors</td></tr>"
    for number, rank in enumerate(ranking):
        picture = b64encode(
            image_thumbnail(rank.image, facies_colours(rank.image), 2 * PICTURE_SIDE)
        ).decode()
        alt = escape(f"Training image {_name(rank.image)}", quote=True)
        source = f"data:image/png;base64,{picture}"
        score = minus(f"{rank.score:.3f}") if isfinite(rank.score) else "lacks a facies"
        behind = f"{rank.z:.1f}" if number and isfinite(rank.z) else ""
        rows += (
            f'<tr><td><img src="{source}" width="{PICTURE_SIDE}" alt="{alt}"></td>'
            f"<th>{escape(_name(rank.image))}</th><td>{score}</td><td>{behind}</td></tr>"
        )
    st.html(f'<table class="numbers">{rows}</table>')
    step_note(page_text("Log score"))


def _name(image: TrainingImage) -> str:
    return pretty(image.name or "your image")


def _draw_left_out(leave_out: metrics.LeaveOut) -> None:
    step_note(f"{leave_out.words}.")
    table = leave_out.reliability
    chart = calibration_chart(table.forecast, table.observed, table.count, chart_theme())
    note = minus(f"slope {leave_out.slope:.2f}")
    alt = "Share of left-out data with the facies, for each predicted probability"
    titled_chart("Reliability", note, chart, "reliability", alt)
    errors = {name: minus(f"{getattr(leave_out, name):.1f}") for name in ("z", "z_smoothing")}
    step_note(page_text("Skill and slope", **errors))
