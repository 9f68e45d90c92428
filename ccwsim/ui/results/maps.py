"""Maps of results: facies colours, E-type, gallery, and empty outlines before a run."""

from base64 import b64encode
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from html import escape
from typing import Any

import numpy as np
import streamlit as st
from streamlit.delta_generator import DeltaGenerator

from ccwsim import Ensemble, Grid, HardData, TrainingImage, datasets
from ccwsim.figures import ENTROPY, contact_sheet, facies_colours, tile_size
from ccwsim.figures.style import value_steps
from ccwsim.model import Array, Floats, Integers, minus, three_digits
from ccwsim.sharing.choices import CellsOfWells, EMap
from ccwsim.ui.frontend.cells import (
    CellMap,
    draw_cells,
    editor_points,
    facies_map,
    map_of_values,
    number_map,
)
from ccwsim.ui.frontend.component import draw_tiles
from ccwsim.ui.results.charts import e_type_of, indicator_of
from ccwsim.ui.session import State, cached, data_of, image_of, kept_with, study_of, wells_of
from ccwsim.ui.widgets import (
    bound_to,
    button,
    field,
    if_possible,
    in_row,
    options_of,
    panel_title,
    step_note,
)

WIDE = 2.0  # minimum ratio of width to height of a grid whose maps are placed below each other
BORDER = "#14181d"  # colour of the borders of zones and of active cells
MAPS_OF_FACIES = {"most likely": "most likely facies", "entropy": "entropy"}
MAPS_OF_VALUES = {
    "probability": "probability above the threshold",
    "mean": "mean",
    "deviation": "standard deviation",
    "P10": "P10 (10 % are lower)",
    "P50": "P50 (median)",
    "P90": "P90 (10 % are higher)",
}
"""Names of the statistics of the uncertainty map, beside the probability of each facies."""
N_THRESHOLDS = 200  # number of steps of the slider of a threshold
THUMBNAIL = 56  # length in pixels of the longer side of a realization's thumbnail
FLAT_TILE = 14  # below this height in pixels, a tile has its number below it


def map_columns(widths: Sequence[float], first: int, grid: Grid) -> list[DeltaGenerator]:
    """Return columns; for a wide grid, the columns `first` and `first + 1` are one column."""
    if not is_wide(grid):
        return list(st.columns(widths, gap="medium"))
    after = first + 2
    merged = [*widths[:first], sum(widths[first:after]), *widths[after:]]
    places = list(st.columns(merged, gap="medium"))
    return [*places[: first + 1], *places[first:]]


def is_wide(grid: Grid) -> bool:
    """Whether the maps of a grid are larger below each other than side by side."""
    return grid.nx >= WIDE * grid.ny


def middle_cells(array: Array) -> Array:
    """Return the middle layer of a volume; return a map unchanged."""
    return array[len(array) // 2] if array.ndim == 3 else array


def middle_layers(stack: Array) -> Array:
    """Return the middle layer of each volume in a stack; return maps unchanged."""
    return stack[:, stack.shape[1] // 2] if stack.ndim == 4 else stack


def colours_of(state: State) -> list[str]:
    """Return the colours of the facies, including colours chosen by the user."""
    choice = state.choices.image
    return facies_colours(image_of(choice), dict(choice.colours))


def pretty(name: str) -> str:
    """Return the name of a bundled data set in words; return the name of a file unchanged."""
    bundled = {*datasets.BUNDLED_IMAGES, *datasets.BUNDLED_DATA}
    return name.replace("_", " ") if name in bundled else name or "unnamed"


def colours_of_ran(state: State) -> list[str]:
    """Return the facies colours of the results, whose image may differ from the study's image."""
    assert state.ensemble is not None
    chosen = dict(state.choices.image.colours) if state.ensemble_choices else {}
    return facies_colours(state.ensemble.training_image, chosen)


def with_data(
    state: State,
    cell_map: CellMap,
    data: HardData,
    image: TrainingImage,
    realization: Array | None = None,
    wells: CellsOfWells | None = None,
) -> CellMap:
    """Return a map with hard data and the names of their wells on top.

    By default, the wells are those of `wells_of_data`. Data that differ from `realization`, an
    array of facies codes or values, are marked as wrong.
    """
    wells = wells_of_data(state, data) if wells is None else wells
    colours = facies_colours(image) if image.values else cell_map.point_colours
    points = editor_points(data, image, realization)
    return replace(cell_map, points=points, point_colours=colours, wells=wells)


def wells_of_data(state: State, data: HardData) -> CellsOfWells:
    """Return the named wells of hard data, if the study or its results have the same data."""
    for choices in filter(None, (state.ensemble_choices, state.choices)):
        study_data = if_possible(partial(data_of, choices))
        if study_data is not None and study_data.digest == data.digest:
            return wells_of(choices)
    return ()


def draw_e_type(
    state: State, ensemble: Ensemble, colours: Sequence[str], wells: CellsOfWells | None = None
) -> None:
    """Draw the uncertainty map or volume, and the field that chooses its statistic."""
    image = ensemble.training_image
    with in_row("e_type_row"):
        panel_title("E-type")
        e_type_field(state, image, partial(choose_statistic, state), ensemble.n)
    cell_map = uncertainty_map(state, ensemble, colours)
    cell_map = with_data(state, cell_map, ensemble.hard_data, image, wells=wells)
    subject = image.variable or image.facies_names[state.facies]
    draw_cells(
        with_borders(cell_map, ensemble),
        "e_type",
        grid=ensemble.grid,
        # a map below a realization also has coordinates, so that the edges of the maps are aligned
        axes=ensemble.grid.is_volume or is_wide(ensemble.grid),
        answer=_answer(state),
        link="grid",
        scale="maps",
        name=f"{state.e_type}_{subject}".replace(" ", "_"),
        fits=True,
    )


def _answer(state: State) -> int:
    """Return a number that changes with the study of the results; see `draw_cells`."""
    choices = state.ensemble_choices or state.choices
    return hash((choices.n_realizations, study_of(choices, checked=False).key()))


def e_type_field(state: State, image: TrainingImage, write: Callable[[Any], None], n: int) -> None:
    """Draw the field that chooses the statistic of the uncertainty map of `n` realizations."""
    options: dict[Any, str] = {
        k: map_name(k, image.facies_names, n) for k in range(image.n_facies)
    } | MAPS_OF_FACIES
    value: Any = state.e_type if state.e_type in MAPS_OF_FACIES else state.facies
    if image.values:
        options, value = (
            MAPS_OF_VALUES,
            state.e_type if state.e_type in MAPS_OF_VALUES else "probability",
        )
    field(
        st.selectbox,
        "What the uncertainty map shows",
        key="e_type",
        value=value,
        write=write,
        label_visibility="collapsed",
        width=220,
        **options_of(options),
    )


def map_name(facies: int, names: Sequence[str], n: int) -> str:
    """Return the name of the map of a facies; one realization has no probability."""
    return f"{names[facies]} in the realization" if n == 1 else f"probability of {names[facies]}"


def choose_statistic(state: State, option: int | EMap) -> None:
    """Store the statistic of the uncertainty map; a chosen facies is also that of the curves."""
    if isinstance(option, int):
        state.facies, state.e_type = option, "probability"
    else:
        state.e_type = option


def uncertainty_map(state: State, ensemble: Ensemble, colours: Sequence[str]) -> CellMap:
    """Return the chosen uncertainty map."""
    image = ensemble.training_image
    if ensemble.values:
        return _uncertainty_of_values(state, ensemble)
    e_type = e_type_of(ensemble)
    if state.e_type == "most likely":
        return facies_map(e_type.most_likely_indices, image, colours, "Most likely facies")
    if state.e_type == "entropy":
        return number_map(
            e_type.entropy, "entropy", "Entropy", colours=ENTROPY, point_colours=colours
        )
    name, shares = image.facies_names[state.facies], e_type.probability[state.facies]
    alt = f"Probability of {name}" if ensemble.n > 1 else f"Occurrence of {name}"
    word = f"P({name}) =" if ensemble.n > 1 else f"{name}:"
    return number_map(shares, word, alt, point_colours=colours)


def threshold_of(state: State, image: TrainingImage) -> float:
    """Return the chosen threshold of a continuous variable, by default the median of the image."""
    low, high = image.sorted_values[[0, -1]]
    chosen = state.threshold
    return chosen if chosen is not None and low <= chosen < high else image.median


def as_facies(state: State, ensemble: Ensemble) -> Ensemble:
    """Return realizations of facies, or the indicator of the threshold of values."""
    if not ensemble.values:
        return ensemble
    return indicator_of(ensemble, threshold_of(state, ensemble.training_image))


def draw_threshold_field(state: State, image: TrainingImage) -> None:
    """Draw the slider of the threshold of probability map and connectivity."""
    low, high = image.sorted_values[[0, -1]].tolist()
    step = (high - low) / N_THRESHOLDS
    with in_row("threshold_row"):
        step_note("Threshold")
        field(
            st.slider,
            f"Threshold of {image.variable}",
            key="threshold",
            min_value=low,
            max_value=high - step,
            step=step,
            width=200,
            label_visibility="collapsed",
            format="%.4g",
            **bound_to(state, "threshold", value=threshold_of(state, image)),
        )


@cached(max_entries=16)
def statistic_of_values(ensemble: Ensemble, statistic: EMap) -> Floats:
    """Return the mean, the standard deviation or a quantile of values in each cell."""
    if statistic == "mean":
        return ensemble.mean()
    if statistic == "deviation":
        return ensemble.std()
    return ensemble.quantile(float(statistic.removeprefix("P")) / 100)


def statistics_of_values(ensemble: Ensemble, threshold: float) -> dict[str, Floats]:
    """Return all statistics of values in each cell, by the names of maps in files."""
    named: tuple[EMap, ...] = ("mean", "deviation", "P10", "P50", "P90")
    statistics = {name: statistic_of_values(ensemble, name) for name in named}
    return statistics | {f"P_above_{threshold:.6g}": ensemble.exceedance(threshold)}


def _uncertainty_of_values(state: State, ensemble: Ensemble) -> CellMap:
    """Return the chosen uncertainty map of a continuous variable."""
    image, statistic = ensemble.training_image, state.e_type
    if statistic not in MAPS_OF_VALUES or statistic == "probability":
        limit = three_digits(threshold_of(state, image))
        words = minus(f"{image.variable} > {limit} {image.units}".rstrip())
        shares = ensemble.exceedance(threshold_of(state, image))
        return number_map(shares, f"P({words}) =", f"Probability of {words}")
    name = f"{MAPS_OF_VALUES[statistic].split(' (')[0]} of {image.variable}"
    numbers = statistic_of_values(ensemble, statistic)
    if statistic != "deviation":
        return map_of_values(numbers, image, ensemble.hard_data, name, name)
    units, limits = f" {image.units}".rstrip(), (0.0, float(np.nanmax(numbers)))
    return number_map(
        numbers, name, name, limits=limits, text=three_digits, units=units, colours=ENTROPY
    )


def given_map(ensemble: Ensemble, facies: int) -> CellMap | None:
    """Return the probability of a facies that guides a study; None without such a guide."""
    if ensemble.secondary is None or ensemble.secondary.probabilities is None:
        return None
    shares = ensemble.secondary.probabilities[facies]
    probability = np.where(ensemble.study.active_mask, shares, np.nan)
    word = f"given P({ensemble.training_image.facies_names[facies]}) ="
    return number_map(probability, word, "Given probability")


def with_borders(cell_map: CellMap, ensemble: Ensemble) -> CellMap:
    """Return a map with the borders of zones and of active cells; return a volume unchanged."""
    if cell_map.indices.ndim == 3 or not (lines := _borders_of(ensemble)):
        return cell_map
    return replace(cell_map, lines=lines, line_colours=(BORDER,))


@kept_with
def _borders_of(ensemble: Ensemble) -> list[list[list[float]]]:
    """Return the borders that all maps of an ensemble have."""
    zones = ensemble.secondary.zones if ensemble.secondary else None
    if zones is None and ensemble.active is None:
        return []
    areas = np.zeros(ensemble.grid.shape, int) if zones is None else zones + 1
    return borders(np.where(ensemble.study.active_mask, areas, -1))


def borders(areas: Integers) -> list[list[list[float]]]:
    """Return the straight lines (row, column, colour index) between areas of a map.

    Examples
    --------
    >>> borders(np.array([[0, 0], [0, 1]]))
    [[[1, 1, 0], [1, 2, 0]], [[1, 1, 0], [2, 1, 0]]]
    """
    lines = []
    for turned in (False, True):
        cells = areas.T if turned else areas
        differs = np.pad(cells[1:] != cells[:-1], ((0, 0), (1, 1))).astype(np.int8)
        at, position = np.nonzero(np.diff(differs))  # ends of lines in each row of edges
        ends = np.column_stack([at + 1, position])[:, :: -1 if turned else 1]
        lines += np.pad(ends, ((0, 0), (0, 1))).reshape(-1, 2, 3).tolist()
    return lines


def draw_given(cell_map: CellMap, name: str, **options: Any) -> None:
    """Draw the given probability of the facies `name`."""
    panel_title(f"Given probability of {name}")
    draw_cells(cell_map, "given", link="grid", name="given_probability", **options)


def draw_training_image(image: TrainingImage, colours: Sequence[str]) -> None:
    """Draw the training image with its name; volumes share the cursor of the results."""
    panel_title("Training image", pretty(image.name))
    cell_map = map_of_image(image, colours)
    link = "grid" if image.n_dimensions == 3 else "image"
    draw_cells(cell_map, "image", name="training_image", link=link, scale="maps", leads=False)


def map_of_image(image: TrainingImage, colours: Sequence[str]) -> CellMap:
    """Return a training image in the colours of its facies, or of values."""
    alt = f"Training image {image.name}"
    if image.values:
        return map_of_values(image.values[image.variable], image, HardData(), alt)
    return facies_map(image.indices, image, colours, alt)


def map_of(ensemble: Ensemble, r: int, colours: Sequence[str], alt: str) -> CellMap:
    """Return realization `r` in the colours of its facies, or of values."""
    image = ensemble.training_image
    if ensemble.values:
        return map_of_values(ensemble.values_of()[r], image, ensemble.hard_data, alt)
    return facies_map(ensemble.indices[r], image, colours, alt)


def realization_map(
    state: State,
    ensemble: Ensemble,
    colours: Sequence[str],
    r: int,
    alt: str,
    wells: CellsOfWells | None = None,
) -> CellMap:
    """Return realization `r` with the data, and the names of their wells, on top."""
    image, data = ensemble.training_image, ensemble.hard_data
    realization = ensemble.values_of()[r] if ensemble.values else ensemble.realizations[r]
    cell_map = map_of(ensemble, r, colours, alt)
    return with_data(state, cell_map, data, image, realization=realization, wells=wells)


def draw_realization(
    state: State, ensemble: Ensemble, colours: Sequence[str], r: int, grid: Grid | None = None
) -> None:
    """Draw realization `r` with the data on top and the coordinates of `grid` along the edges."""
    title = f"Realization {r + 1}"
    panel_title(f"{title} of {ensemble.n}")
    draw_cells(
        with_borders(realization_map(state, ensemble, colours, r, title), ensemble),
        "realization",
        grid=grid,
        answer=_answer(state),
        link="grid",
        scale="maps",
        name=f"realization_{r + 1}",
        fits=True,
    )


def draw_gallery(state: State, ensemble: Ensemble, colours: Sequence[str]) -> None:
    """Draw small maps of all realizations; a click shows a realization large."""
    width, height = tile_size(ensemble.grid.shape[-2:], THUMBNAIL)
    if ensemble.grid.nz is not None:
        step_note(f"Layer {ensemble.grid.nz // 2} of each realization; 0 is the bottom")
    png, columns = sheet(ensemble, tuple(colours), 2 * THUMBNAIL, ensemble.n)
    draw_tiles(
        "gallery",
        "Realizations; arrow keys choose",
        [{"name": f"Realization {r}", "badge": r} for r in range(1, ensemble.n + 1)],
        lambda r: setattr(state, "shown", int(r)),
        kind="sheet small flat" if height < FLAT_TILE else "sheet small",
        arrows="choose",
        shown=state.shown,
        png=png,
        columns=columns,
        width=width,
        height=height,
    )


@cached(max_entries=80)
def sheet(ensemble: Ensemble, colours: tuple[str, ...], longest: int, n: int) -> tuple[str, int]:
    """Return a picture of the first `n` realizations as Base64 text, and its number of columns."""
    indices, tile_colours = ensemble.indices[:n], list(colours)
    if ensemble.values:
        image, data = ensemble.training_image, ensemble.hard_data
        indices, tile_colours = value_steps(ensemble.values_of()[:n], image, data)
    png, columns = contact_sheet(middle_layers(indices), tile_colours, longest=longest)
    return b64encode(png).decode(), columns


def step_buttons(key: str, page_state: Any, n: int, note: str = "") -> None:
    """Draw two arrows that change `page_state.shown`, the index of one of `n` realizations."""

    def step(change: int) -> None:
        page_state.shown = (page_state.shown + change) % n

    for change, sign, name in ((-1, "‹", "previous"), (1, "›", "next")):
        button(
            sign,
            key=f"{key}_{name}",
            on_click=step,
            args=(change,),
            disabled=n == 1,
            help=f"The {name} realization{note}",
        )


def draw_ghost(state: State, places: Sequence[DeltaGenerator]) -> None:
    """Draw outlines in place of results before the first run.

    `places` are those of the training image, of a realization and of the E-type.
    """
    image, grid = state.image, state.grid
    left, middle, right = places
    with left:
        draw_training_image(image, colours_of(state))
    css_size = f"aspect-ratio: {grid.nx} / {grid.ny}"
    with middle:
        text = "A field that has the patterns of the training image and honours the data"
        ghost_panel(text, css_size, "Realization", "ghost large")
    with right:
        text = "The probability of a facies: the share of realizations with this facies in a cell"
        ghost_panel(text, css_size, "E-type")


def ghost_panel(text: str, css_size: str, title: str = "", kind: str = "ghost") -> None:
    """Draw the outline of a future result; `css_size` is the size of the outline in CSS."""
    if title:
        panel_title(title)
    st.html(f'<div class="{kind}" style="{css_size}">{escape(text)}</div>')
