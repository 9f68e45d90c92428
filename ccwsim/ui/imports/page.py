"""The page Import: files of a training image and of hard data, open questions, and advice."""

from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Literal

import numpy as np
import pandas as pd
import streamlit as st

from ccwsim import CCWSIMError, TrainingImage, datasets
from ccwsim.figures import facies_colours, placement_svg
from ccwsim.io import PlacedPoints, PointsPreview
from ccwsim.metrics import diagnose
from ccwsim.model import describe_shape
from ccwsim.sharing.choices import Choices, DataChoice, ImageChoice, WellTables
from ccwsim.sharing.codec import MAX_LETTERS
from ccwsim.ui.frontend.cells import MAX_WELL_NAMES, CellMap, draw_cells, number_map
from ccwsim.ui.results.maps import colours_of, map_of_image, middle_cells
from ccwsim.ui.session import State, cached, error_boundary, resolve
from ccwsim.ui.study import data_step, image_questions, image_step, questions
from ccwsim.ui.study.asking import draw_fitted, keep_button
from ccwsim.ui.study.changes import image_name
from ccwsim.ui.study.diagnosis_panel import draw_advice
from ccwsim.ui.study.questions import answered
from ccwsim.ui.study.run import describe_price, simulate_button
from ccwsim.ui.study.study_column import set_parameters
from ccwsim.ui.widgets import (
    bound_to,
    button,
    field,
    if_possible,
    in_row,
    options_of,
    page_text,
    panel_title,
    plain,
    step_note,
)

TABLE_KINDS = {False: "one table or grid", True: "tables of collars, intervals and surveys"}
SUBJECTS = {"image": "Training image", "data": "Hard data"}


@dataclass
class Imports:
    """The state of the page Import."""

    subject: Literal["image", "data"] = "image"
    draft: DataChoice | None = None  # choice of hard data when the page was last drawn
    tables: bool | None = None  # whether wells are in several tables; None means as in the study


def draw_imports(state: State) -> None:
    """Draw the page."""
    page_state = state.page(Imports)
    if state.data_draft is not page_state.draft:  # data that wait for confirmation are shown first
        page_state.subject = "data" if state.data_draft else page_state.subject
        page_state.draft, page_state.tables = state.data_draft, None
    field(
        st.segmented_control,
        "What to import",
        key="import_subject",
        label_visibility="collapsed",
        **bound_to(page_state, "subject"),
        **options_of(SUBJECTS),
    )
    draw_fitted(state)
    with error_boundary():
        if page_state.subject == "image":
            draw_image_import(state)
        else:
            draw_wells_import(state, _tables(state, page_state))


def _tables(state: State, page_state: Imports) -> bool:
    """For a volume, ask whether wells are in one table or in several, and return the answer."""
    study_tables = (state.data_draft or state.choices.data).tables is not None
    if not state.grid.is_volume and not study_tables:
        return False
    tables = study_tables if page_state.tables is None else page_state.tables
    field(
        st.segmented_control,
        "The data are",
        key="import_tables",
        **bound_to(page_state, "tables", value=tables),
        **options_of(TABLE_KINDS),
    )
    return tables


MAX_NAMED_FACIES = 12  # maximum number of facies that can be named and coloured one by one
NEAREST = "nearest"  # choice of the nearest facies in a menu of the codes of other facies
TURN_LABELS = {"flip_ew": "Flip E–W", "flip_ns": "Flip N–S", "transpose": "Transpose"}
_diagnosed = cached(max_entries=16, show_spinner="Diagnosing the training image …")(diagnose)


def draw_image_import(state: State) -> None:
    """Draw file, image and diagnosis; an image with open questions waits for confirmation."""
    choice = state.image_draft or state.choices.image
    waits = state.image_draft is not None

    def write(new: ImageChoice) -> None:
        if waits:
            state.image_draft = new
        else:
            image_step.use_image(state, new)

    image, problem = None, ""
    try:
        if choice.upload is not None and not choice.answers:
            image_questions.image_of_file(choice.upload)  # the file reader raises a clearer error
        image = resolve.image_of(choice)
    except CCWSIMError as error:
        problem = str(error)
    asked = image_questions.asked_of(choice)
    with st.container(key="imports"):
        left, right = st.columns([1.5, 1.0], gap="large")
    with left:
        _pictures(choice, image, asked)
        if image is not None:
            with st.container(key="import_advice"):
                draw_image_advice(state, choice, image)
    with right:
        panel_title("Training image", image_name(choice))
        take = partial(image_step.import_image, state)
        image_step.image_uploader("A file of yours", "import_image_file", take)
        if problem:
            st.warning(plain(f"{questions.IN_SCRIPTS.sub('', problem)}. {image_step.IMAGE_KEPT}"))
        if state.image_draft is None:
            simulate_button(state, "import_simulate")
        if choice.upload is None:
            st.caption(datasets.describe(choice.bundled))
        if image is not None or asked:
            image_questions.ask_about_image(choice, write)
        if image is not None:
            if waits:
                with in_row(align="top"):
                    button(
                        "Use this image",
                        key="image_take",
                        on_click=image_step.use_image,
                        args=(state, choice),
                        type="primary",
                    )
                    keep_button(state, "image_draft", "image_keep")
            tried = replace(state.choices, data=state.data_draft or state.choices.data)
            points = (
                if_possible(lambda: resolve.points_in_files(tried)) if tried.data.files else None
            )
            if not image.values:
                words = points.words[:MAX_NAMED_FACIES] if points else ()
                draw_facies(choice, image, write, words)

            def turn(**turns: bool) -> None:
                write(replace(choice, **turns))

            with in_row():
                for name, label in TURN_LABELS.items():
                    field(st.checkbox, label, key=f"image_{name}", **bound_to(choice, name, turn))
                button("Rotate 90°", key="image_rotate", on_click=write, args=(choice.rotated,))
        elif waits:
            keep_button(state, "image_draft", "image_keep")


def _pictures(choice: ImageChoice, image: TrainingImage | None, asked: tuple[str, ...]) -> None:
    """Draw the facies and, if values or colours were classified, also the original file."""
    is_cut = "gaps" in asked and "crop" in dict(choice.answers)
    classed = ("values" in asked or is_cut) and choice.upload is not None
    places = st.columns(2, gap="medium") if classed and image is not None else [st.container()]
    if classed:
        with places[0]:
            panel_title("The file")
            _file_map(choice, "part" in asked)
    if image is not None:
        with places[-1]:
            size = describe_shape(image.shape)
            if image.values:
                panel_title("As values", f"{size} cells, {image.variable}")
            else:
                panel_title("As facies", f"{size} cells, {image.n_facies} facies")
            colours = facies_colours(image, dict(choice.colours))
            draw_cells(map_of_image(image, colours), "import", link="import", name="training_image")


def _file_map(choice: ImageChoice, asked_part: bool) -> None:
    """Draw the file: a picture in its original colours, or values on a colour scale."""
    assert choice.upload is not None
    answers = choice.answers if asked_part else answered(choice.answers, crop=None)
    picture = image_questions.picture_of_file(choice.upload, answers)
    if picture is not None:
        indices, colours = picture
        cell_map = CellMap(indices, colours, labels=["" for _ in colours], alt="The picture")
    else:
        values = middle_cells(image_questions.grid_of_file(choice.upload, answers))
        limits, text = (float(np.nanmin(values)), float(np.nanmax(values))), "{:.4g}".format
        cell_map = number_map(values, "", "Values of the file", limits=limits, text=text)
    draw_cells(cell_map, "file", link="import", name="file")


def draw_facies(
    choice: ImageChoice,
    image: TrainingImage,
    write: image_questions.WriteImage,
    words: tuple[str, ...] = (),
) -> None:
    """Draw name, colour and share of each facies; `words` are names in hard data to choose from."""
    colours = facies_colours(image, dict(choice.colours))
    for k, code in enumerate(image.codes[:MAX_NAMED_FACIES].tolist()):
        facies_name = image.facies_names[k]

        def recolour(colour: str, code: int = code) -> None:
            changed = {**dict(choice.colours), code: colour}
            write(replace(choice, colours=tuple(sorted(changed.items()))))

        def rename(name: str, k: int = k) -> None:
            names = list(image.facies_names)
            names[k] = name.strip()[:MAX_LETTERS] or names[k]
            write(replace(choice, names=tuple(names)))

        with in_row(f"facies_row_{code}"):
            field(
                st.color_picker,
                f"Colour of code {code}",
                key=f"image_colour_{code}",
                value=colours[k],
                write=recolour,
                label_visibility="collapsed",
            )
            offered: dict[str, Any] = {"max_chars": MAX_LETTERS}
            if words:
                names = [*dict.fromkeys((facies_name, *words))]
                offered = {"options": names, "accept_new_options": True}
            field(
                st.selectbox if words else st.text_input,
                f"Name of code {code}",
                key=f"image_name_{code}",
                value=facies_name,
                write=rename,
                label_visibility="collapsed",
                **offered,
            )
            st.html(f'<div class="note">{100 * image.proportions[k]:.1f} %</div>')
            if choice.upload is not None and image.n_facies > 2:
                _merge(choice, image, k, write)
    if image.n_facies > MAX_NAMED_FACIES:
        step_note(f"and {image.n_facies - MAX_NAMED_FACIES} more facies")
    if "merge" in dict(choice.answers):
        apart = replace(choice, answers=answered(choice.answers, merge=None), names=())
        button("Undo merging", key="image_apart", on_click=write, args=(apart,))


def _merge(
    choice: ImageChoice, image: TrainingImage, k: int, write: image_questions.WriteImage
) -> None:
    """Draw a menu that merges facies `k` with another facies, or each cell with the nearest."""
    earlier, code = dict(dict(choice.answers).get("merge", ())), int(image.codes[k])

    def merge(to: int | str) -> None:
        new = None if to == NEAREST else to
        merged = {old: new if into == code else into for old, into in earlier.items()}
        merged |= {code: new}
        names = (*image.facies_names[:k], *image.facies_names[k + 1 :])
        answers = answered(choice.answers, merge=tuple(sorted(merged.items())))
        write(replace(choice, answers=answers, names=names))

    labels: dict[Any, str] = {to: f"with {name}" for to, name in image.names_by_code.items()}
    del labels[code]
    field(
        st.selectbox,
        f"Merge code {code}",
        key=f"image_merge_{code}",
        value=None,
        write=merge,
        placeholder="merge",
        label_visibility="collapsed",
        width=104,
        **options_of(labels | {NEAREST: "with the nearest"}),
    )


def draw_image_advice(state: State, choice: ImageChoice, image: TrainingImage) -> None:
    """Draw advice on parameters, with a button that puts image and parameters into the study."""
    try:
        diagnosis = _diagnosed(image)
    except CCWSIMError as error:  # if an image is too small for advice, this is not an error
        st.caption(plain(f"No advice: {error}."))
        return

    def take(**advised: Any) -> None:
        image_step.use_image(state, choice)
        set_parameters(state, **advised)

    price = partial(describe_price, replace(state.choices, image=choice))
    draw_advice(diagnosis, image, state.choices.parameters, take, price)


MAX_DRAWN = 2000  # maximum number of data on the map


def draw_wells_import(state: State, tables: bool = False) -> None:
    """Draw a file of wells, or several `tables`; the study uses it as soon as all data fit."""
    use = partial(data_step.use_data, state)
    choice = state.data_draft or state.choices.data
    if choice.source != "file" or (choice.tables is not None) != tables:
        choice = DataChoice("file", tables=WellTables() if tables else None)
    if tables:
        with in_row("import_well_tables", "top", gap="medium"):
            data_step.draw_table_uploaders("wells", choice, use)
    else:
        data_step.data_uploader("wells_file", lambda file: use(DataChoice("file", upload=file)))
    if not choice.files:
        kind = "tables of wells" if tables else "points"
        st.caption(page_text(f"Import of {kind}"))
        return
    tried = replace(state.choices, data=choice)
    _say_state(state, tried)
    questions.ask_troubles(tried, use, wide=True)
    if tables:
        for table, preview in resolve.previews_of_wells(choice).items():
            if isinstance(preview, PointsPreview):
                _draw_rows(preview)
            questions.ask_columns_of_wells(choice, table, preview, use, wide=True)
    elif questions.summary_of(choice.upload) is None:
        return
    else:
        preview = resolve.preview_of(choice, tried)
        if preview.columns:
            _draw_rows(preview)
    left, right = st.columns([3, 2], gap="large")
    with right:
        questions.ask_data(tried, use, wide=True)
    with left:
        _draw_map(state, tried)
        questions.offer_grids(tried, use)


def _say_state(state: State, tried: Choices) -> None:
    """State whether the study uses the file and, if not, the reason."""
    choice = tried.data
    name = data_step.names_of_files(choice)
    if choice.waits:
        st.info("Collars and intervals are required. Surveys are required only if wells deviate.")
        keep_button(state, "data_draft", "wells_drop")
        return
    try:
        report = resolve.imported_data(tried)
    except CCWSIMError as error:
        questions.say_open(tried, str(error))
    else:
        n = report.hard_data.n
        if state.data_draft is None:
            st.success(plain(f"{n} data of {name} are in the study."))
            simulate_button(state, "wells_simulate")
        else:
            st.info(plain(f"{n} data of {name} fit the grid but are not in the study yet."))
            button("Use them", key="wells_use", on_click=data_step.use_data, args=(state, choice))
        for note in report.notes:
            st.caption(plain(note))
    keep_button(state, "data_draft", "wells_drop")


def _draw_rows(preview: PointsPreview) -> None:
    """Draw the first rows of the file, with the role of each column in the heading."""
    n_listed = min(len(preview.rows), preview.n_rows)
    panel_title("First rows", f"{n_listed} of {preview.n_rows} of {preview.name}")
    roles = {column: questions.role_of(role) for role, column in preview.guess.items()}
    heads = [f"{name} → {roles[name]}" if name in roles else name for name in preview.columns]
    table = pd.DataFrame(
        list(preview.rows), columns=heads, index=[f"line {k}" for k in preview.lines]
    )
    st.dataframe(table, height="content")
    for reason in preview.reasons:
        st.caption(plain(questions.IN_SCRIPTS.sub("", reason)))


def _draw_map(state: State, tried: Choices) -> None:
    """Draw a map of the data, on a larger grid if no datum is inside; rings are unused data."""
    try:
        placed, fitting = (
            resolve.placed_data(tried),
            [*resolve.grids_for_data(tried).values(), None][-2:][0],
        )
        title = "Positions of the data"
        n, n_out = placed.points.n, len(placed.outside)
        if fitting is not None and n_out == n:
            title, tried = "Positions of the data in a larger grid", replace(tried, grid=fitting)
            placed = resolve.placed_data(tried)
    except CCWSIMError:  # the error is reported above
        return
    panel_title(title, f"grid of {resolve.described(tried.grid)}")
    drawn = np.arange(n)
    if dict(tried.data.answers).get("on_outside") == "drop" and n_out < n:
        drawn = np.delete(drawn, placed.outside)  # distant data would make the grid a dot
    drawn = drawn[:: max(1, -(-len(drawn) // MAX_DRAWN))]
    colours = np.array(_colours(state, tried, placed), object)[drawn].tolist()
    above = placed.cells[drawn, -2:]  # the map shows the data of a volume from above
    wells: dict[str, list[int]] = {}
    for k, line in enumerate(placed.points.lines[drawn].tolist()):
        if name := placed.points.wells.get(line):
            wells.setdefault(name, []).append(k)
    wells = wells if len(wells) <= MAX_WELL_NAMES else {}
    svg = placement_svg(above, colours, tried.grid.shape[-2:], wells)
    st.image(svg, alt="Positions of the data in the grid", width=520)
    if fitting is not None and n_out == n:
        st.caption("No datum is in the study's grid. The frame shows a larger grid.")
    elif n_out:
        st.caption(f"The frame shows the study's grid; {n_out} of {n} data are outside.")


def _colours(state: State, tried: Choices, placed: PlacedPoints) -> list[str | None]:
    """Return the colour of each datum, or None for each datum that is not used."""
    image = resolve.image_of(tried.image)
    colour_of = dict(zip(image.codes.tolist(), colours_of(state), strict=False))
    unused = {*placed.outside.tolist(), *placed.unknown.tolist()}
    if placed.match is not None and placed.match.open_labels:  # the facies are not known yet
        unused |= {*range(placed.points.n)}
    codes = placed.facies.tolist()
    return [None if k in unused else colour_of.get(code) for k, code in enumerate(codes)]
