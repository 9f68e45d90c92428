"""The results on the page Simulate, their files, and the earlier runs of the session."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from typing import Any

import streamlit as st
from streamlit.delta_generator import DeltaGenerator

from ccwsim import Ensemble, Grid, TrainingImage
from ccwsim.figures import Bundle, facies_colours, map_png, tile_size
from ccwsim.io import can_write, maps_as_bytes, parameters_to_json, realizations_as_bytes
from ccwsim.io.formats.csv_table import csv_as_bytes
from ccwsim.metrics import VERTICAL, Direction, axes_of, etype
from ccwsim.metrics.bands import Statistic
from ccwsim.model import duration
from ccwsim.report import verdicts
from ccwsim.report.settings import caption_of
from ccwsim.ui.flow.solving import model_downloads
from ccwsim.ui.frontend.component import draw_tiles
from ccwsim.ui.results import charts, maps
from ccwsim.ui.session import PastRun, State, error_boundary, kept_with, study_part
from ccwsim.ui.study.changes import changes_between, study_name
from ccwsim.ui.study.run import is_current, stop_run
from ccwsim.ui.widgets import (
    Download,
    bound_to,
    draw_facts,
    field,
    in_row,
    options_of,
    page_labels,
    page_text,
    panel_title,
    plain,
    step_note,
)

MAP_AREAS = ("image", "realization", "e_type", "given", "gallery")
TALL = 1.5  # minimum ratio of height to width of a grid whose charts are beside the maps
SMALLEST_IMAGE, LARGEST_IMAGE = 0.5, 0.75
"""Limits of the width of the training image as a share of the width of a realization."""
LOWEST_MAP, PROPORTIONS_AXIS, PROPORTIONS_ROW = 250, 74, 17
"""Heights in pixels: the smallest map; in a chart of proportions, title and axis, and a facies."""
KEY_MARK = 4  # width of the mark of a key in the legend, in letters
OLD_FILES = "Out of date: files contain the realizations on the page and their settings."
MAP_KINDS = page_labels("map_files")
"""File formats of maps; a format is offered if the package for this format is installed."""


@st.fragment
def draw_results(state: State) -> None:
    """Draw the results of the latest run; the choice of a realization redraws only the results."""
    with error_boundary():
        if state.ensemble is None:
            image, grid = state.image, state.grid
            with figures(grid, image):
                places = [area(name) for name in MAP_AREAS[:3]]
            maps.draw_ghost(state, places)
        else:
            _results(state, state.ensemble)


def _results(state: State, ensemble: Ensemble) -> None:
    state.fit_shown(ensemble)
    colours, grid = maps.colours_of_ran(state), ensemble.grid
    charts.draw_caption(caption_of(ensemble))
    with in_row("facts_row"):
        draw_facts(ensemble)
        draw_downloads(state, ensemble, colours)
    volume, given = grid.is_volume, maps.given_map(ensemble, state.facies)
    n_maps = 2 if given is None else 3
    with figures(grid, ensemble.training_image, n_maps):
        beside, middle, right, after, gallery = map(area, MAP_AREAS)
        curve_key, curves, below = area("key"), st.container(key="charts"), area("below")
    with middle:  # drawn first, so that the map appears first
        maps.draw_realization(state, ensemble, colours, state.shown, grid)
    with right:
        maps.draw_e_type(state, ensemble, colours)
    if given is not None:
        with after:
            name = ensemble.training_image.facies_names[state.facies]
            given = maps.with_borders(given, ensemble)
            maps.draw_given(given, name, scale="maps", grid=grid, axes=False)
    with gallery:
        maps.draw_gallery(state, ensemble, colours)
    with below if volume else beside:
        maps.draw_training_image(ensemble.training_image, colours)
    with curve_key:
        charts.draw_band_key(ensemble)
        if volume:
            draw_axis_field(state, ensemble)
        if ensemble.values:
            maps.draw_threshold_field(state, ensemble.training_image)
    with curves:
        if ensemble.values:
            indicator = maps.as_facies(state, ensemble)
            charts.draw_facies_charts(indicator, 1, state.axis, of_values=ensemble)
        else:
            charts.draw_facies_charts(ensemble, state.facies, state.axis)
    with beside if room_below_image(ensemble, n_maps) else below:
        if ensemble.values:
            charts.draw_histogram(ensemble)
        else:
            charts.draw_proportions(ensemble, colours)
    with below:
        step_note(verdicts.HOW_JUDGED)
        if any(charts.directions_of_curves(ensemble, state.facies).values()):
            step_note(page_text("Directions of curves"))


def draw_axis_field(state: State, ensemble: Ensemble) -> None:
    """Draw the choice of the direction of the curves of a volume."""
    field(
        st.segmented_control,
        "Direction of the curves",
        key="axis_of_curves",
        label_visibility="collapsed",
        **bound_to(state, "axis"),
        **options_of({way: verdicts.way_name(way) for way in axes_of(ensemble.grid.shape)}),
    )


def area(name: str) -> DeltaGenerator:
    """Return a place of the results, which the style moves according to the layout."""
    return st.container(key=f"area_{name}")


@contextmanager
def figures(grid: Grid, image: TrainingImage, n_maps: int = 2) -> Iterator[None]:
    """Draw figures in the layout for the shape of a grid.

    The style sheet computes the size of a cell from the size of the window and these numbers.
    """
    width, (image_ny, image_nx) = image_width(grid, image, n_maps), image.shape[-2:]
    sizes = {"nx": grid.nx, "ny": grid.ny, "image-nx": width, "maps": n_maps}
    sizes["image-ny"] = width * image_ny / image_nx
    names = (image.variable,) if image.values else image.facies_names
    sizes["keys"] = sum(len(key) + KEY_MARK for key in (*names, "4000 data"))
    sizes["digits"] = max(len(f"{end:.0f}") for axis in grid.axes[:2] for end in axis[[0, -1]])
    numbers = " ".join(f"--{name}: {size:g};" for name, size in sizes.items())
    st.html(f"<style>.stApp {{ {numbers} }}</style>")
    with st.container(key=f"figures_{layout_of(grid, n_maps)}"):
        yield


def layout_of(grid: Grid, n_maps: int) -> str:
    """Return the name, in the style sheet, of the layout for a grid and a number of maps."""
    if grid.is_volume:
        return "volume"
    if maps.is_wide(grid):
        return "wide"
    if grid.ny >= TALL * grid.nx:
        return "tall"
    return "strip" if n_maps == 2 else "three"


def image_width(grid: Grid, image: TrainingImage, n_maps: int) -> float:
    """Return the width of the training image in cells of the grid, smaller than a realization.

    Beside three maps (with a given probability), the training image is as small as allowed.
    """
    ny, nx = image.shape[-2:]
    widest = LARGEST_IMAGE if n_maps == 2 else SMALLEST_IMAGE
    width = min(max(nx, SMALLEST_IMAGE * grid.nx), widest * grid.nx)
    return min(width, grid.ny * nx / ny)


def room_below_image(ensemble: Ensemble, n_maps: int) -> bool:
    """Whether the training image leaves room for the chart of proportions below it."""
    image, grid = ensemble.training_image, ensemble.grid
    layout = layout_of(grid, n_maps)
    if layout not in ("strip", "three"):
        return layout != "volume"
    high = image_width(grid, image, n_maps) * image.shape[0] / image.shape[1]
    room = (1 - high / grid.ny) * LOWEST_MAP
    return room >= PROPORTIONS_AXIS + PROPORTIONS_ROW * (1 if image.values else image.n_facies)


@st.fragment
def draw_downloads(state: State, ensemble: Ensemble, colours: Sequence[str]) -> None:
    """Draw a menu of files; a file is created when the user chooses it."""
    menu = st.popover("Download", key="downloads", on_change="rerun")
    if not menu.open:
        return
    with error_boundary(), menu:
        if not is_current(state):
            step_note(OLD_FILES)
        threshold = maps.threshold_of(state, ensemble.training_image) if ensemble.values else 0.0
        groups = download_groups(ensemble, colours, state.shown, state.facies, threshold)
        groups |= model_downloads(state.flow, ensemble, state.shown)
        for title, files in groups.items():
            step_note(title)
            with in_row(align="top"):
                for file in files:
                    file.draw(study_part(ensemble))


def download_groups(
    ensemble: Ensemble, colours: Sequence[str], shown: int, facies: int, threshold: float = 0.0
) -> dict[str, list[Download]]:
    """Return the files that this machine can write for an ensemble, grouped by content.

    Of a continuous variable, probabilities and curves are those of values above the threshold.
    """
    volume, judged = ensemble.grid.is_volume, ensemble
    of_values = bool(ensemble.values)
    if of_values:
        judged, facies = charts.indicator_of(ensemble, threshold), 1
    shape = ensemble.shape
    kinds = {kind: label for kind, label in MAP_KINDS.items() if can_write(kind, shape)}
    statistics_title = page_text("Statistics of facies")
    if of_values:
        statistics_title = page_text("Statistics of values")
    realization_kinds = {
        kind: label
        for kind, label in {**kinds, "png": "PNG"}.items()
        if can_write(kind, shape, of_values)
    }

    def e_type_as(kind: str) -> bytes:
        if of_values:
            statistics = maps.statistics_of_values(ensemble, threshold)
        else:
            statistics = etype(ensemble).maps
        return maps_as_bytes(statistics, ensemble.grid, kind)

    def picture() -> bytes:
        drawn = maps.map_of(ensemble, shown, colours, "")
        return map_png(maps.middle_cells(drawn.indices), drawn.colours, scale=2)

    all_as = partial(realizations_as_bytes, ensemble, colours=colours)
    parameters = parameters_to_json(ensemble.parameters).encode
    code, file_part = judged.training_image.codes[facies], f"realization_{shown + 1}"
    curves, table = partial(curves_csv, judged, facies), partial(realizations_csv, ensemble)
    name = judged.training_image.facies_names[facies]
    part = "Middle layer of " if volume else ""
    one_as_tif = partial(realizations_as_bytes, ensemble[[shown]], "tif", colours=colours)
    tif = Download(
        f"Realization {shown + 1}, GeoTIFF{'' if of_values else ' with colours and names'}",
        f"{file_part}_tif",
        f"_{file_part}.tif",
        one_as_tif,
    )
    return {
        "All realizations": [
            Download(label, f"realizations_{kind}", f".{kind}", partial(all_as, kind))
            for kind, label in realization_kinds.items()
        ],
        statistics_title: [
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
            *([tif] if "tif" in kinds else []),
        ],
    }


def curves_csv(ensemble: Ensemble, facies: int) -> bytes:
    """Return the curves of a facies with a row per lag and a column per realization.

    Curves are along the axes and in the directions that the page shows. A volume also has vertical
    proportions and a column of layers; the bottom layer is 0. Proportions are empty for layers that
    the training image or the grid does not have.
    """
    is_volume = ensemble.grid.is_volume
    directions: list[Direction] = [
        *axes_of(ensemble.grid.shape),
        *charts.directions_of_curves(ensemble, facies),
    ]
    names: dict[Statistic, str] = {"variogram": "variogram", "connectivity": "connection"}
    curves = [
        (name, direction, charts.curve_bundle(ensemble, statistic, facies, direction))
        for statistic, name in names.items()
        for direction in dict.fromkeys(directions)
    ]
    lines: list[list[object]] = []
    for statistic, direction, bundle in curves:
        way = direction if isinstance(direction, str) else f"azimuth {direction:g}"
        positions = [[f"{lag:.6g}", *([""] if is_volume else [])] for lag in bundle.lags]
        lines += _lines([statistic, way], positions, bundle)
    if is_volume:
        layers = charts.vertical_proportions_bundle(ensemble, facies)
        positions = [["", k] for k in range(max(len(layers.lags), len(layers.reference)))]
        lines += _lines(["proportion", VERTICAL], positions, layers)
    head = [
        *("statistic", "direction", "lag_cells", *(["layer"] if is_volume else [])),
        *("training_image", "q05", "median", "q95"),
        *(f"realization_{r + 1}" for r in range(len(curves[0][2].each))),
    ]
    return csv_as_bytes(head, lines)


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


HISTORY_PIXELS = 72  # length of the longer side of a picture in pixels


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
        shown=shown_run_index(state),
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


def shown_run_index(state: State) -> int:
    """Return the index of the run whose results are on the page, or −1 if none is."""
    latest = state.ensemble and state.ensemble.indices  # facies may have been renamed since
    matching = [k for k, run in enumerate(state.runs.runs) if run.ensemble.indices is latest]
    return matching[0] if matching else -1


def entry(runs: list[PastRun], k: int) -> dict[str, Any]:
    """Return the tile of run k: picture, differences, time of day, and duration."""
    run = runs[k]
    ensemble = run.ensemble
    changes = changes_between(runs[k + 1].choices, run.choices) if k + 1 < len(runs) else []
    width, height = tile_size(ensemble.grid.shape[-2:], HISTORY_PIXELS)
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
    return maps.sheet(run.ensemble, tuple(colours), 2 * HISTORY_PIXELS, 1)[0]
