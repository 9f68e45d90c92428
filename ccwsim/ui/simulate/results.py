"""The results on the page Simulate, their files, and the earlier runs of the session."""

from collections.abc import Sequence
from functools import partial
from typing import Any

import streamlit as st

from ccwsim.figures import Bundle, facies_colours, map_png, tile_size
from ccwsim.figures.proportions import proportions_height
from ccwsim.io import can_write, maps_as_bytes, parameters_to_json, realizations_as_bytes
from ccwsim.io.formats.csv_table import csv_as_bytes
from ccwsim.metrics import VERTICAL, axes_of, etype
from ccwsim.metrics.bands import Statistic
from ccwsim.model.ensemble import Ensemble
from ccwsim.model.numbers import duration
from ccwsim.report.settings import caption_of
from ccwsim.ui.flow.solving import FlowState, model_downloads
from ccwsim.ui.frontend.component import draw_tiles
from ccwsim.ui.results import charts, maps
from ccwsim.ui.results.maps import MAP_WIDTHS, SMALLEST_IMAGE
from ccwsim.ui.session.cached import kept_with
from ccwsim.ui.session.file_names import study_part
from ccwsim.ui.session.fragments import error_boundary
from ccwsim.ui.session.state import PastRun, State
from ccwsim.ui.study.changes import changes_between, study_name
from ccwsim.ui.study.run import is_current, stop_run
from ccwsim.ui.widgets.facts import draw_facts
from ccwsim.ui.widgets.fields import Download
from ccwsim.ui.widgets.text import page_labels, panel_title, plain, step_note

USUAL_WIDTH = 400
PROPORTIONS_TITLE = 40
"""Usual width of a realization, and height of the title of the proportions chart, in pixels."""
OLD_FILES = "Out of date: files contain the realizations on the page and their settings."
MAP_KINDS = page_labels("map_files")
"""File formats of maps; a format is offered if the package for this format is installed."""
MAPS_ALONE = ("tif",)  # file formats that cannot contain a volume


@st.fragment
def draw_results(state: State) -> None:
    """Draw the results of the latest run; the choice of a realization redraws only the results."""
    with error_boundary():
        if state.ensemble is None:
            maps.draw_ghost(state)
        else:
            _results(state, state.ensemble)


def _results(state: State, ensemble: Ensemble) -> None:
    state.shown = min(state.shown, ensemble.n - 1)
    state.facies = min(state.facies, ensemble.training_image.n_facies - 1)
    colours = maps.colours_of_ran(state)
    charts.draw_caption(caption_of(ensemble))
    with st.container(horizontal=True, vertical_alignment="center", key="facts_row"):
        draw_facts(ensemble)
        draw_downloads(state, ensemble, colours)
    volume, shares, after = ensemble.grid.nz is not None, None, []
    probability_map = maps.given_map(ensemble, state.facies)
    with st.container(key="volumes" if volume else "maps"):
        if volume:  # image and realization side by side, with the E-type below
            (left, middle), right = st.columns(2, gap="medium"), None
        else:
            widths = (image_width(ensemble), *MAP_WIDTHS, *[MAP_WIDTHS[1]] * bool(probability_map))
            left, middle, right, *after = maps.map_columns(widths, 1, ensemble.grid)
        beside = left if volume else left.container(key="image_beside")
    gallery = st.container()
    if right is None:
        with st.container(key="volume_below"):
            right, shares = st.columns(2, gap="medium")
    elif room_below_image(ensemble):
        shares = beside
    with middle:  # drawn first, so that the map appears first
        maps.draw_realization(state, ensemble, colours, state.shown, ensemble.grid)
    with right:
        maps.draw_e_type(state, ensemble, colours)
    if probability_map is not None:
        with after[0] if after else right:
            name = ensemble.training_image.facies_names[state.facies]
            maps.draw_given(probability_map, name, scale="maps")
    with gallery:
        maps.draw_gallery(state, ensemble, colours)
    with beside:
        maps.draw_training_image(ensemble.training_image, colours)
    if shares is not None:
        with shares:
            charts.draw_proportions(ensemble, colours)
    charts.draw_curves(ensemble, state.facies, colours if shares is None else None)


def image_width(ensemble: Ensemble) -> float:
    """Return the width of the training image, relative to the width of a realization."""
    secondary = ensemble.secondary
    if secondary is not None and secondary.probabilities is not None:  # a fourth map needs room
        return SMALLEST_IMAGE
    share = ensemble.training_image.shape[1] / ensemble.grid.nx
    return min(max(share, SMALLEST_IMAGE), 1.0)


def room_below_image(ensemble: Ensemble) -> bool:
    """Whether the training image, at the scale of the realizations, leaves room for a chart."""
    image, grid = ensemble.training_image, ensemble.grid
    room = (grid.ny - image.shape[0]) / grid.nx
    if maps.is_wide(grid):
        image_height = image_width(ensemble) * image.shape[0] / image.shape[1]
        room = 2 * sum(MAP_WIDTHS) * grid.ny / grid.nx - image_height
    return room * USUAL_WIDTH > PROPORTIONS_TITLE + proportions_height(image.n_facies)


@st.fragment
def draw_downloads(state: State, ensemble: Ensemble, colours: Sequence[str]) -> None:
    """Draw a menu of files; a file is created when the user chooses it."""
    menu = st.popover("Download", key="downloads", on_change="rerun")
    if not menu.open:
        return
    with error_boundary(), menu:
        if not is_current(state):
            step_note(OLD_FILES)
        groups = download_groups(ensemble, colours, state.shown, state.facies)
        groups |= model_downloads(state.page(FlowState), ensemble, state.shown)
        for title, files in groups.items():
            step_note(title)
            with st.container(horizontal=True, gap="small"):
                for file in files:
                    file.draw(study_part(ensemble))


def download_groups(
    ensemble: Ensemble, colours: Sequence[str], shown: int, facies: int
) -> dict[str, list[Download]]:
    """Return the files that this machine can write for an ensemble, grouped by content."""
    volume = ensemble.grid.nz is not None
    kinds = {kind: label for kind, label in MAP_KINDS.items() if can_write(kind)}
    kinds = {kind: label for kind, label in kinds.items() if not (volume and kind in MAPS_ALONE)}
    sheet = {} if volume else {"png": "PNG"}

    def e_type_as(kind: str) -> bytes:
        return maps_as_bytes(etype(ensemble).maps, ensemble.grid, kind)

    def picture() -> bytes:
        return map_png(maps.middle_layer(ensemble.indices[shown]), colours, scale=2)

    all_as = partial(realizations_as_bytes, ensemble, colours=colours)
    parameters = parameters_to_json(ensemble.parameters).encode
    code, file_part = ensemble.training_image.codes[facies], f"realization_{shown + 1}"
    curves, table = partial(curves_csv, ensemble, facies), partial(realizations_csv, ensemble)
    name = ensemble.training_image.facies_names[facies]
    part = "Middle layer of " if volume else ""
    return {
        "All realizations": [
            Download(label, f"realizations_{kind}", f".{kind}", partial(all_as, kind))
            for kind, label in {**kinds, **sheet}.items()
        ],
        "Probability of facies (E-type), most likely facies, entropy": [
            Download(label, f"etype_{kind}", f"_etype.{kind}", partial(e_type_as, kind))
            for kind, label in kinds.items()
        ],
        "Statistics and settings": [
            Download(plain(f"Curves of {name}, CSV"), "curves_csv", f"_curves_{code}.csv", curves),
            Download("Times and proportions, CSV", "realizations_csv", "_statistics.csv", table),
            Download("Parameters, JSON", "parameters_json", "_parameters.json", parameters),
            Download(
                f"{part}Realization {shown + 1}, PNG",
                f"{file_part}_png",
                f"_{file_part}.png",
                picture,
            ),
        ],
    }


def curves_csv(ensemble: Ensemble, facies: int) -> bytes:
    """Return the curves of a facies with a row per lag and a column per realization.

    A volume also has vertical proportions and a column of layers; the bottom layer is 0.
    Proportions are empty for layers that the training image or the grid does not have.
    """
    directions, is_volume = axes_of(ensemble.grid.shape), ensemble.grid.nz is not None
    names: dict[Statistic, str] = {"variogram": "variogram", "connectivity": "connection"}
    curves = [
        (name, direction, charts.curve_bundle(ensemble, statistic, facies, direction))
        for statistic, name in names.items()
        for direction in directions
    ]
    lines: list[list[object]] = []
    for statistic, direction, bundle in curves:
        positions = [[int(lag), *([""] if is_volume else [])] for lag in bundle.lags]
        lines += _lines([statistic, direction], positions, bundle)
    if is_volume:
        layers = charts.vertical_proportions_bundle(ensemble, facies)
        positions = [["", k] for k in range(max(len(layers.lags), len(layers.reference)))]
        lines += _lines(["proportion", VERTICAL], positions, layers)
    head = ["statistic", "direction", "lag_cells", *(["layer"] if is_volume else [])]
    head += ["training_image", "q05", "median", "q95"]
    n = len(curves[0][2].each)
    return csv_as_bytes([*head, *(f"realization_{r + 1}" for r in range(n))], lines)


def _lines(
    name: Sequence[object], positions: Sequence[Sequence[object]], bundle: Bundle
) -> list[list[object]]:
    curves = (bundle.reference, bundle.low, bundle.median, bundle.high, *bundle.each)
    return [
        [*name, *position, *(f"{curve[k]:.6g}" if k < len(curve) else "" for curve in curves)]
        for k, position in enumerate(positions)
    ]


def realizations_csv(ensemble: Ensemble) -> bytes:
    """Return a table with CPU time, data not honoured and proportions of each realization."""
    head = ["realization", "cpu_seconds", "data_not_honoured"]
    head += [f"proportion_{code}" for code in ensemble.training_image.codes]
    rows = zip(ensemble.cpu_seconds, ensemble.n_mismatched, ensemble.proportions, strict=True)
    lines = [
        [r, f"{took:.6g}", int(wrong), *(f"{share:.6g}" for share in shares)]
        for r, (took, wrong, shares) in enumerate(rows, 1)
    ]
    return csv_as_bytes(head, lines)


LONGEST = 72  # length of the longer side of a picture in pixels


def draw_history(state: State) -> None:
    """Draw the runs, newest first, if there are two or more."""
    runs = state.runs.runs
    if len(runs) < 2:
        return
    panel_title("Runs of this session", "click to restore a run")
    heading = "Runs of this session, newest first; arrow keys move"
    tiles = [entry(runs, k) for k in range(len(runs))]
    draw_tiles(
        "history_strip",
        heading,
        tiles,
        lambda key: go_back(state, str(key)),
        kind="history",
        shown=place_of(state),
        arrows="move",
    )


def go_back(state: State, key: str) -> None:
    """Stop the present run, and restore study and results of a past run that is still stored."""
    run = next((run for run in state.runs.runs if run.key == key), None)
    if run is None:
        return
    stop_run(state)
    state.message = ""
    state.choices = state.ensemble_choices = state.last_attempt = run.choices
    state.image_draft = state.data_draft = None
    state.ensemble, state.reference = run.ensemble, run.reference
    state.shown = min(state.shown, run.ensemble.n - 1)


def place_of(state: State) -> int:
    """Return the index of the run whose results are on the page, or −1 if none is."""
    latest = state.ensemble and state.ensemble.indices  # facies may have been renamed since
    matching = [k for k, run in enumerate(state.runs.runs) if run.ensemble.indices is latest]
    return matching[0] if matching else -1


def entry(runs: list[PastRun], k: int) -> dict[str, Any]:
    """Return the tile of run k: picture, differences, time of day, and duration."""
    run = runs[k]
    ensemble = run.ensemble
    changes = changes_between(runs[k + 1].choices, run.choices) if k + 1 < len(runs) else []
    width, height = tile_size(ensemble.grid.shape[-2:], LONGEST)
    missing = run.choices.n_realizations - ensemble.n
    stopped = f"{ensemble.n} of {run.choices.n_realizations} · " if missing else ""
    label = " · ".join(changes) or study_name(run.choices)
    note = f"{stopped}{run.ended:%H:%M:%S} · {duration(ensemble.wall_seconds)}"
    return {
        "value": run.key,
        "png": _picture(run),
        "width": width,
        "height": height,
        "label": label,
        "note": note,
        "title": label,
        "name": f"Go back to the run: {label}, {note}",
    }


@kept_with
def _picture(run: PastRun) -> str:
    """Return a picture of the first realization of a run, which does not change."""
    colours = facies_colours(run.ensemble.training_image, dict(run.choices.image.colours))
    return maps.sheet(run.ensemble, tuple(colours), 2 * LONGEST, 1)[0]
