"""Maps of results: facies colours, E-type, gallery, and empty outlines before a run."""

from base64 import b64encode
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from html import escape
from typing import Any

import numpy as np
import streamlit as st
from numpy.typing import NDArray
from streamlit.delta_generator import DeltaGenerator

from ccwsim import Ensemble, Grid, HardData, TrainingImage, datasets
from ccwsim.figures import ENTROPY, contact_sheet, facies_colours, tile_size
from ccwsim.sharing.choices import CellsOfWells
from ccwsim.ui.frontend.cells import CellMap, draw_cells, facies_map, points_of, share_map
from ccwsim.ui.frontend.component import draw_tiles
from ccwsim.ui.results.charts import e_type_of
from ccwsim.ui.session.cached import cached
from ccwsim.ui.session.resolve import data_of, image_of, study_of, wells_of
from ccwsim.ui.session.state import State
from ccwsim.ui.widgets.errors import if_possible
from ccwsim.ui.widgets.fields import button, field, options_of
from ccwsim.ui.widgets.text import panel_title, step_note

MAP_WIDTHS = (1.08, 1.0)
"""Relative widths of the columns of a realization (with coordinates) and of the E-type."""
WIDE = 2.0  # minimum ratio of width to height of a grid whose maps are placed below each other
OTHERS = ("most likely", "entropy")
ROW_WIDTH = 1040  # maximum width in pixels of a row of tiles on a wide screen
NARROW_TILE = 64  # minimum width in pixels of a tile with numbers of the usual size
SMALLEST_IMAGE = 0.5  # minimum width of the training image as a share of the width of a realization


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


def middle_layer(array: NDArray[Any]) -> NDArray[Any]:
    """Return the middle layer of a volume; return a map unchanged."""
    return array[len(array) // 2] if array.ndim == 3 else array


def middle_layers(stack: NDArray[Any]) -> NDArray[Any]:
    """Return the middle layer of each volume in a stack; return maps unchanged."""
    return stack[:, stack.shape[1] // 2] if stack.ndim == 4 else stack


def colours_of(state: State) -> list[str]:
    """Return the colours of the facies, including colours chosen by the user."""
    choice = state.choices.image
    return facies_colours(image_of(choice), dict(choice.colours))


def pretty(name: str) -> str:
    """Return the name of a bundled data set in words; return the name of a file unchanged."""
    bundled = {*datasets.IMAGES, *datasets.HARD_DATA}
    return name.replace("_", " ") if name in bundled else name or "unnamed"


def colours_of_ran(state: State) -> list[str]:
    """Return the facies colours of the results, whose image may differ from the study's image."""
    assert state.ensemble is not None
    image = state.ensemble.training_image
    chosen = dict(state.choices.image.colours) if state.ensemble_choices else {}
    return facies_colours(image, chosen)


def with_data(
    state: State,
    cell_map: CellMap,
    data: HardData,
    image: TrainingImage,
    realization: NDArray[np.integer] | None = None,
    wells: CellsOfWells | None = None,
) -> CellMap:
    """Return a map with hard data and the names of their wells on top.

    By default, the wells are those of `wells_of_data`. Data that differ from `realization`, an
    array of facies codes, are marked as wrong.
    """
    wells = wells_of_data(state, data) if wells is None else wells
    return replace(cell_map, points=points_of(data, image, realization), wells=wells)


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
    names = ensemble.training_image.facies_names
    with st.container(horizontal=True, vertical_alignment="center", gap="small", key="e_type_row"):
        panel_title("E-type")
        e_type_field(state, names, lambda option: choose(state, option), ensemble.n)
    cell_map = uncertainty_map(state, ensemble, colours)
    cell_map = with_data(state, cell_map, ensemble.hard_data, ensemble.training_image, wells=wells)
    name = f"{state.e_type}_{names[state.facies]}".replace(" ", "_")
    # a map below a realization also has coordinates, so that the edges of the maps are aligned
    has_axes = ensemble.grid.nz is not None or is_wide(ensemble.grid)
    draw_cells(
        cell_map,
        "e_type",
        grid=ensemble.grid if has_axes else None,
        answer=_answer(state),
        link="grid",
        scale="maps",
        name=name,
    )


def _answer(state: State) -> int:
    """Return a number that changes with the study of the results; see `draw_cells`."""
    choices = state.ensemble_choices or state.choices
    return hash((choices.n_realizations, study_of(choices, checked=False).key()))


def e_type_field(
    state: State, names: Sequence[str], write: Callable[[int | str], None], n: int
) -> None:
    """Draw the field that chooses the statistic of the uncertainty map of `n` realizations."""
    chosen = state.facies if state.e_type == "probability" else state.e_type
    options: list[int | str] = [*range(len(names)), *OTHERS]
    field(
        st.selectbox,
        "What the uncertainty map shows",
        key="e_type",
        value=chosen,
        write=write,
        label_visibility="collapsed",
        width=220,
        **options_of({option: map_name(option, names, n) for option in options}),
    )


def map_name(option: int | str, names: Sequence[str], n: int) -> str:
    """Return the name of a statistic of `n` realizations; one realization has no probability."""
    if isinstance(option, int) and n == 1:
        return f"{names[option]} in the realization"
    if isinstance(option, int):
        return f"probability of {names[option]}"
    return "most likely facies" if option == "most likely" else option


def choose(state: State, option: int | str) -> None:
    """Store the statistic of the uncertainty map; a chosen facies is also that of the curves."""
    if isinstance(option, int):
        state.facies, state.e_type = option, "probability"
    else:
        state.e_type = "most likely" if option == "most likely" else "entropy"


def uncertainty_map(state: State, ensemble: Ensemble, colours: Sequence[str]) -> CellMap:
    """Return the chosen uncertainty map."""
    image, e_type = ensemble.training_image, e_type_of(ensemble)
    if state.e_type == "most likely":
        return facies_map(e_type.most_likely_indices, image, colours, "Most likely facies")
    if state.e_type == "entropy":
        return share_map(
            e_type.entropy, "entropy", "Entropy", colours=ENTROPY, point_colours=colours
        )
    name, shares = image.facies_names[state.facies], e_type.probability[state.facies]
    alt = f"Probability of {name}" if ensemble.n > 1 else f"Occurrence of {name}"
    word = f"P({name}) =" if ensemble.n > 1 else f"{name}:"
    return share_map(shares, word, alt, point_colours=colours)


def given_map(ensemble: Ensemble, facies: int) -> CellMap | None:
    """Return the probability of a facies that guides a study; None without such a guide."""
    if ensemble.secondary is None or ensemble.secondary.probabilities is None:
        return None
    probability = ensemble.secondary.probabilities[facies]
    if ensemble.active is not None:
        probability = np.where(ensemble.active, probability, np.nan)
    word = f"given P({ensemble.training_image.facies_names[facies]}) ="
    return share_map(probability, word, "Given probability")


def draw_given(cell_map: CellMap, name: str, **options: Any) -> None:
    """Draw the given probability of the facies `name`."""
    panel_title(f"Given probability of {name}")
    draw_cells(cell_map, "given", link="grid", name="given_probability", **options)


def draw_training_image(image: TrainingImage, colours: Sequence[str]) -> None:
    """Draw the training image with its name; volumes share the cursor of the results."""
    panel_title("Training image", pretty(image.name))
    cell_map = facies_map(image.indices, image, colours, f"Training image {image.name}")
    link = "grid" if image.n_dimensions == 3 else "image"
    draw_cells(cell_map, "image", name="training_image", link=link, scale="maps", leads=False)


def realization_map(
    state: State,
    ensemble: Ensemble,
    colours: Sequence[str],
    r: int,
    alt: str,
    wells: CellsOfWells | None = None,
) -> CellMap:
    """Return realization `r` with the data, and the names of their wells, on top."""
    image = ensemble.training_image
    cell_map = facies_map(ensemble.indices[r], image, colours, alt)
    return with_data(
        state,
        cell_map,
        ensemble.hard_data,
        image,
        realization=ensemble.realizations[r],
        wells=wells,
    )


def draw_realization(
    state: State, ensemble: Ensemble, colours: Sequence[str], r: int, grid: Grid | None = None
) -> None:
    """Draw realization `r` with the data on top and the coordinates of `grid` along the edges."""
    title = f"Realization {r + 1}"
    panel_title(f"{title} of {ensemble.n}")
    draw_cells(
        realization_map(state, ensemble, colours, r, title),
        "realization",
        grid=grid,
        answer=_answer(state),
        link="grid",
        scale="maps",
        name=f"realization_{r + 1}",
    )


def draw_gallery(state: State, ensemble: Ensemble, colours: Sequence[str]) -> None:
    """Draw small maps of all realizations; a click shows a realization large."""
    longest = min(96, max(48, ROW_WIDTH // ensemble.n - 8))
    width, height = tile_size(ensemble.grid.shape[-2:], longest)
    if ensemble.grid.nz is not None:
        step_note(f"Layer {ensemble.grid.nz // 2} of each realization; 0 is the bottom")
    png, columns = sheet(ensemble, tuple(colours), 2 * longest, ensemble.n)
    tiles = [{"name": f"Realization {r}", "badge": r} for r in range(1, ensemble.n + 1)]
    draw_tiles(
        "gallery",
        "Realizations; arrow keys choose",
        tiles,
        lambda r: setattr(state, "shown", int(r)),
        kind="sheet small" if width < NARROW_TILE else "sheet",
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
    png, columns = contact_sheet(middle_layers(ensemble.indices[:n]), colours, longest=longest)
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


def draw_ghost(state: State) -> None:
    """Draw outlines in place of results before the first run."""
    image, grid = image_of(state.choices.image), state.choices.grid
    with st.container(key="maps"):
        left, middle, right = map_columns((SMALLEST_IMAGE, *MAP_WIDTHS), 1, grid)
    with left, st.container(key="image_beside"):
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
