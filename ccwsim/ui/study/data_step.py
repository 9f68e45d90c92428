"""Step 2, the hard data: their source, and whether they contradict the training image."""

import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from html import escape
from typing import Any

import numpy as np
import streamlit as st

from ccwsim import CCWSIMError, Grid, HardData, Secondary, TrainingImage, datasets
from ccwsim.figures import data_png
from ccwsim.jobs.statistics import StatisticsWorker, Task
from ccwsim.metrics import DataFit, fit_data, rank_variants
from ccwsim.metrics.data_fit import AS_GIVEN, MIN_PLACES, MIN_RANKED, better_variant
from ccwsim.model import MAX_SAMPLED, Fraction, describe_codes, minus, with_power
from ccwsim.sharing.choices import (
    Choices,
    DataChoice,
    DataSource,
    ImageChoice,
    Upload,
    WellTables,
)
from ccwsim.ui.results.maps import colours_of, pretty
from ccwsim.ui.session import (
    State,
    as_task,
    cached,
    file_uploader,
    follow_tasks,
    page_link,
    resolve,
    shared_values,
)
from ccwsim.ui.study.asking import keep_button
from ccwsim.ui.study.image_step import IMPORT_PAGE, THUMBNAIL_PIXELS
from ccwsim.ui.study.questions import ROLES_OF_WELLS, UseData, ask_data, offer_grids, say_open
from ccwsim.ui.widgets import (
    bound_to,
    button,
    field,
    if_possible,
    in_row,
    menu,
    options_of,
    page_labels,
    page_text,
    plain,
    problem_in,
    step_note,
    step_title,
)

DATA_SOURCES = page_labels("sources_of_data")
VOLUME_SOURCES: tuple[DataSource, ...] = ("none", "bundled", "file", "placed")
"""Sources of hard data offered for a volume."""
TABLES = page_labels("tables_of_wells")
OF_FACIES = ("threshold", "facies_names")  # answers about the column of facies


def data_step(state: State) -> None:
    """Draw the number and source of the data, and a menu to choose other data."""
    step_title(2, "Hard data")
    problem = problem_of_data(state.choices)
    with in_row("data_row", "top"):
        if not problem and state.choices.data.source != "none":
            st.image(
                data_thumbnail(state, 2 * THUMBNAIL_PIXELS),
                width=THUMBNAIL_PIXELS,
                alt="Map of the hard data",
            )
        with st.container(gap="small"):
            step_note(_summary(state.choices, problem))
            menu("Change", "data_menu", partial(_data_menu, state))
            volume = state.grid.is_volume
            page_link("pages/data.py", "Edit in the volume" if volume else "Edit on a map")
    if problem:
        st.error(plain(problem))
    elif state.choices.data.source != "none":
        if renamed := resolve.facies_by_code(state.choices):
            st.warning(page_text("Names of facies", taken=plain(renamed)))
        elif answers := dict(state.choices.data.answers).get("facies_names"):
            image = state.image
            step_note(f"Facies: {describe_codes(dict(answers), image)}")
        draw_data_fit(state)
    if state.data_draft is not None:
        _draft(state, state.data_draft)
    offer_grids(
        replace(state.choices, data=state.data_draft or state.choices.data),
        partial(use_data, state),
        "step_",
    )


def _draft(state: State, draft: DataChoice) -> None:
    """State why waiting data are not in the study; if the data fit now, ask whether to use them."""
    tried = replace(state.choices, data=draft)
    problem = problem_of_data(tried)
    if problem and not draft.waits:
        say_open(tried, problem)
    elif not draft.waits:
        n, name = resolve.data_of(tried).n, names_of_files(draft) or "placed by hand"
        step_note(f"Your {n} data ({name}) fit the study but are not in the study yet.")
        with in_row(align="top"):
            button("Use them", key="data_keep", on_click=use_data, args=(state, draft))
            keep_button(state, "data_draft", "data_leave", "Leave them out")


def problem_of_data(choices: Choices) -> str:
    """Return the reason why the hard data of a study cannot be used, or an empty text."""
    return problem_in(lambda: resolve.data_of(choices))


def data_thumbnail(state: State, longest: int) -> bytes:
    """Return the hard data of the study as a small picture."""
    choices = state.choices
    data, image = resolve.data_of(choices), resolve.image_of(choices.image)
    return _thumbnail(data, image, choices.grid, tuple(colours_of(state)), longest)


@cached(max_entries=64)
def _thumbnail(
    data: HardData, image: TrainingImage, grid: Grid, colours: tuple[str, ...], longest: int
) -> bytes:
    indices = np.searchsorted(image.codes, data.facies)
    shape = grid.shape[-2:]  # the picture shows the data of a volume from above
    return data_png(data.cells[:, -2:], indices, shape, colours, longest=longest)


def use_data(state: State, choice: DataChoice, grid: Grid | None = None) -> None:
    """Use a choice of hard data in the study if the data can be read; otherwise keep it as a draft.

    If other bundled data are chosen, the grid grows to contain all data. A `grid` for the choice is
    used at once if the present data fit it, otherwise together with the new data.
    """
    if grid is not None and not problem_of_data(replace(state.choices, grid=grid)):
        state.change(grid=grid)
    changed = replace(state.choices, data=choice, grid=grid or state.grid)
    before = state.choices.data
    is_new = grid is None and choice.source == "file" and choice.files != before.files
    grids = resolve.grids_for_data(changed) if is_new else {}
    is_elsewhere = "fit" in grids and "enlarge" not in grids
    if is_elsewhere and changed.grid.crs:  # data in degrees do not move a grid with a place
        is_elsewhere = (np.abs(grids["fit"].origin[:2]) > (180, 90)).any()
    if is_elsewhere:
        state.fit_grid(f"The grid follows {names_of_files(choice)}.", grids["fit"])
        fits = not problem_of_data(state.choices)
        state.change(data=state.choices.data if fits else DataChoice())
        changed = replace(state.choices, data=choice)
    if choice.source == "bundled" and replace(choice, answers=before.answers) != before:
        survey = Grid.of(
            np.maximum(changed.grid.shape, datasets.hard_data_grid_shape(choice.bundled))
        )
        changed = replace(changed, grid=resolve.with_sides(changed.grid, survey))
    if choice.waits or problem_of_data(changed):
        state.data_draft = choice
        return
    if choice.source == "placed" and "numbering" in dict(choice.answers):
        placed = resolve.data_of(changed)  # with the facies of this image, as the user answered
        changed = replace(changed, data=DataChoice("placed", placed=placed, wells=choice.wells))
    state.data_draft = None
    state.choices = changed


def data_uploader(
    key: str, take: Callable[[Upload], None], label: str = "Points or a grid with gaps"
) -> None:
    """Draw an uploader of hard data."""
    file_uploader(label, key=key, take=take, help=page_text("Formats of hard data"))


def link_to_import(label: str = "All columns, the rows and a map") -> None:
    """Draw a link to the page Import, on which the user can change the roles of columns."""
    page_link(IMPORT_PAGE, label)


def names_of_files(choice: DataChoice) -> str:
    """Return the names of the files of hard data."""
    return ", ".join(file.name for file in choice.files)


def draw_table_uploaders(key: str, choice: DataChoice, use: Callable[[DataChoice], None]) -> None:
    """Draw uploaders of tables of wells; `use` is called with the choice after each change."""
    if choice.tables is None:
        choice = DataChoice("file", tables=WellTables())
    tables = choice.tables or WellTables()
    uploads = {"collars": tables.collars, "intervals": choice.upload, "surveys": tables.surveys}
    for table, (label, tip) in TABLES.items():

        def take(upload: Upload | None, table: str = table) -> None:
            files = {**uploads, table: upload}
            lost = (*ROLES_OF_WELLS[table], *(OF_FACIES if table == "intervals" else ()))
            answers = tuple((name, answer) for name, answer in choice.answers if name not in lost)
            tables = WellTables(collars=files["collars"], surveys=files["surveys"])
            use(replace(choice, upload=files["intervals"], tables=tables, answers=answers))

        with st.container():
            name = f"{key}_{table}"
            file_uploader(label, key=name, take=take, removed=partial(take, None), help=tip)
            file = uploads[table]
            if file is not None and st.session_state.get(name) is None:
                st.caption(plain(f"From your file {file.name}"))


def _summary(choices: Choices, problem: str) -> str:
    choice = choices.data
    if choice.source == "none":
        return "none: unconditional"
    n = "" if problem else f"{resolve.data_of(choices).n} data\n"
    if choice.source == "file":
        return n + names_of_files(choice)
    if choice.source == "bundled":
        return n + pretty(choice.bundled)
    if choice.source == "placed":
        return f"{n}placed by hand"
    return f"{n}sampled, seed {choice.seed_sampled}"


def _data_menu(state: State) -> None:
    current = state.data_draft or state.choices.data

    def change(**changes: Any) -> None:
        use_data(state, replace(current, **changes))

    def switch(source: DataSource) -> None:
        choice = replace(current, source=source)
        if source == "placed" and not problem_of_data(state.choices):
            wells = resolve.wells_of(state.choices)
            choice = replace(choice, placed=resolve.data_of(state.choices), wells=wells)
        if source == "bundled" and choice.bundled not in bundled_data(state):
            choice = replace(choice, bundled=bundled_data(state)[0])
        use_data(state, choice)

    def use_upload(upload: Upload) -> None:
        choice = replace(state.choices.data, source="file", upload=upload, tables=None, answers=())
        use_data(state, choice)

    volume = state.grid.is_volume
    sources = {k: v for k, v in DATA_SOURCES.items() if not volume or k in VOLUME_SOURCES}
    if current.source != "file" and not current.files:
        del sources["file"]  # the uploader below takes a file
    field(
        st.selectbox,
        "Where from",
        key="data_source",
        value=current.source,
        write=switch,
        **options_of(sources),
    )
    if current.source == "bundled":
        field(
            st.selectbox,
            "Survey",
            key="data_bundled",
            **bound_to(current, "bundled", change),
            **options_of({name: pretty(name) for name in bundled_data(state)}),
        )
        st.caption(datasets.describe_hard_data(current.bundled))
    if current.source == "sampled":
        st.caption(page_text("Sampled data"))
        field(
            st.number_input,
            "How many data",
            key="data_n",
            **bound_to(current, "n_sampled", change, min_value=1, max_value=MAX_SAMPLED),
        )
        field(
            st.number_input,
            "Their own seed",
            key="data_seed",
            **bound_to(current, "seed_sampled", change, min_value=0),
        )
    data_uploader("data_file", use_upload, "or a file of yours")
    if current.source == "file" and current.files:
        noun = "files" if len(current.files) > 1 else "file"
        st.caption(plain(f"From your {noun} {names_of_files(current)}"))
    elif volume:
        link_to_import("Wells in tables")
    if current.source != "none" and not current.waits:
        if not problem_of_data(state.choices):
            st.image(data_thumbnail(state, 320), width=320, alt="Preview of the hard data")
        draw_report(state, current, partial(use_data, state), "data_drop")


def bundled_data(state: State) -> tuple[str, ...]:
    """Return bundled hard data that suit the study; for volumes, wells of the image come first."""
    if not state.grid.is_volume:
        return (
            tuple(datasets.BUNDLED_MEASUREMENTS)
            if state.image.values
            else datasets.hard_data_names()
        )
    image_name, wells = state.choices.image.bundled, datasets.BUNDLED_WELLS

    def is_of_other_image(name: str) -> bool:
        return datasets.hard_data_training_image(name) != image_name

    return tuple(sorted(wells, key=is_of_other_image))


def draw_report(state: State, choice: DataChoice, use: UseData, key: str) -> None:
    """Show notes on data or why they do not fit, ask open questions, and link to the page Import.

    `key` is that of the button that discards waiting data.
    """
    tried = replace(state.choices, data=choice)
    try:
        report = resolve.imported_data(tried)
        if state.data_draft is not None:  # the data are for another image, or wait for confirmation
            st.caption(f"{report.hard_data.n} data fit the grid but are not in the study yet.")
        for note in report.notes:
            st.caption(plain(note))
    except CCWSIMError as error:
        say_open(tried, str(error))
    ask_data(tried, use)
    if choice.source == "file":
        link_to_import()
    keep_button(state, "data_draft", key)


MAX_CHECKED_CELLS = 1_000_000
"""Maximum number of cells of a grid that is checked automatically, in about a second."""


@as_task
def data_fit(progress: Fraction, image: TrainingImage, data: HardData, grid: Grid) -> DataFit:
    """Return whether hard data contradict a training image."""
    return fit_data(image, data, grid, progress=progress)


@as_task
def image_variant(progress: Fraction, image: TrainingImage, data: HardData) -> tuple[str, float]:
    """Return the variant of the training image that fits hard data best, and z of the image."""
    return better_variant(rank_variants(image, data, progress))


def variant_tasks(image: TrainingImage, data: HardData) -> list[Task[tuple[str, float]]]:
    """Return the task of `image_variant` if the data of a map are enough for it."""
    is_enough = data.n >= MIN_RANKED and data.n_dimensions == image.n_dimensions == 2
    return [image_variant(image, data)] if is_enough else []


def draw_variant(state: State, key: str, variant: tuple[str, float]) -> None:
    """Say that a variant of the image fits the data better, and offer to turn the image."""
    name, z = variant
    if name == AS_GIVEN:
        return
    words = escape(f"Your data fit the image {name} better (z {z:.1f})")
    st.html(f'<p class="odd" title="{escape(page_text("Variant of the image"))}">⚑ {words}</p>')
    turned = state.choices.image.variant(name)
    if turned != state.choices.image:
        button("Turn it", key=key, on_click=_use_turned, args=(state, turned))


def _use_turned(state: State, turned: ImageChoice) -> None:
    """Use the turned or mirrored image; the grid and the data stay."""
    image = resolve.image_of(turned)
    parameters, state.moved = resolve.refitted(state.choices.parameters, image, state.moved)
    state.change(image=turned, parameters=parameters)


class DataFitState:
    """The worker that compares hard data with training images for one session."""

    def __init__(self) -> None:
        self.worker = StatisticsWorker(shared_values())


def is_judged(data: HardData, grid: Grid, secondary: Secondary | None) -> bool:
    """Return whether the page compares the data with the training image without being asked."""
    uses_other_images = secondary is not None and secondary.is_of_other_images
    return data.n >= MIN_PLACES and grid.n_cells <= MAX_CHECKED_CELLS and not uses_other_images


def flagged(fit: DataFit) -> bool:
    """Return whether the verdict warns of a disagreement between the data and the image."""
    return bool(fit.contradicts or fit.preferred) or fit.words.startswith("Your data")


def verdict(fit: DataFit) -> str:
    """Return the verdict as HTML: a flag or a tick, the words, and numbers on hover."""
    bad = flagged(fit)
    mark = "⚑" if bad else "✓" if fit.words.startswith("Data do") else "·"
    css = "odd" if bad else "note"
    cure = page_text("Wells prefer a facies") if fit.preferred else ""
    tip = f"{numbers(fit)} {cure}".strip()
    return f'<p class="{css}" title="{escape(tip)}">{mark} {escape(fit.words)}</p>'


def numbers(fit: DataFit) -> str:
    """Return the numbers behind a verdict in one sentence."""
    return minus(
        f"p = {with_power(fit.p, 2)} against unconditional realizations of this image; largest "
        f"difference: {fit.family}, {fit.families[fit.family]:.1f} standard deviations. Log "
        f"score per datum: image {fit.score:.2f}, smoothed data {fit.smoothing:.2f}."
    )


def draw_data_fit(state: State) -> None:
    """Draw the verdict in the study column if no run is in progress and the verdict is known."""
    data, grid = resolve.data_of(state.choices), state.grid
    image = state.image
    secondary = if_possible(lambda: resolve.secondary_of(state.choices))
    if state.job is not None or not is_judged(data, grid, secondary):
        return
    worker = state.page(DataFitState).worker
    tasks = [data_fit(image, data, grid), *variant_tasks(image, data)]
    worker.forget()
    for task in tasks:
        worker.ask(task)
    fit, *variants = [worker.memo.get(task.key) for task in tasks]
    if None in (fit, *variants):
        follow_tasks(worker, tasks, time.monotonic())
    if isinstance(fit, DataFit):
        st.html(verdict(fit))
    for variant in variants:
        if isinstance(variant, tuple):
            draw_variant(state, "turn_image", variant)
