"""Open questions about the file of a training image, with guessed answers."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from math import isqrt
from typing import Any

import numpy as np
import streamlit as st

from ccwsim.io import class_edges, guess_answers, read_colours, read_grid
from ccwsim.io.formats.pictures import MAX_COLOURS, PictureFile, few_colours
from ccwsim.io.gridding import FilePart, thinning
from ccwsim.io.limits import TooManyCells
from ccwsim.io.opening import FileSummary, open_file
from ccwsim.io.training_images import QUESTIONS
from ccwsim.model.arrays import Bytes, Floats, describe_shape
from ccwsim.sharing.choices import Answers, ImageChoice, Upload
from ccwsim.ui.frontend.component import draw_component
from ccwsim.ui.session.cached import cached
from ccwsim.ui.session.resolve import opened, read_upload
from ccwsim.ui.study import questions
from ccwsim.ui.widgets.errors import if_possible
from ccwsim.ui.widgets.fields import field, options_of
from ccwsim.ui.widgets.text import page_text, step_note

BINS = 96
VOLUME, LAYER = "the whole volume", "one layer"
ALL, PIECE = "the whole image, thinned", "a piece"
THRESHOLD, CLASSES, COLOURS, CODES = "threshold", "classes", "main colours", "as they are"
Write = Callable[[ImageChoice], None]
Answer = Callable[..., None]
"""A function answer(question, name=value), which writes an answer and guesses later ones."""


def image_of_file(
    upload: Upload, answers: Mapping[str, Any] | None = None, *, volume: bool = True
) -> ImageChoice:
    """Return the choice of an image, with guesses for open questions and the file's colours.

    A file with layers becomes a volume or, if `volume` is false, a map of its middle layer.

    Raises
    ------
    CCWSIMError
        If the file cannot be opened.
    """
    known = dict(answers or {})
    if not volume and "slice_index" not in known:
        known.setdefault("volume", False)
    guessed, _ = _guessed(upload, questions.answered((), **known))
    choice = ImageChoice(upload=upload, answers=questions.answered((), **guessed))
    colours = if_possible(lambda: read_upload(read_colours, upload, **dict(choice.answers)))
    return replace(choice, colours=tuple(sorted((colours or {}).items())))


def asked_of(choice: ImageChoice) -> tuple[str, ...]:
    """Return the questions about an image file, or no questions if the file is broken."""
    if choice.upload is None:
        return ()
    guessed = if_possible(partial(_guessed, choice.upload, choice.answers))
    return guessed[1] if guessed else ()


@cached(show_spinner="Reading the file …")
def _guessed(upload: Upload, answers: Answers) -> tuple[dict[str, Any], tuple[str, ...]]:
    with opened(upload) as file:
        return guess_answers(file, dict(answers))


@cached(max_entries=32)
def _too_large(upload: Upload) -> tuple[tuple[int, ...], int]:
    """Return the shape of a grid with too many cells, and the factor by which it is thinned."""
    with opened(upload) as file:
        try:
            open_file(file)
        except TooManyCells as error:
            shape, copies = error.grid()
            return shape, thinning(shape, copies)
    raise AssertionError("the file is not too large")


@cached(max_entries=8)
def grid_of_file(upload: Upload, answers: Answers) -> Floats:
    """Return the values of a file, row 0 in the south; answers about classes are ignored."""
    with opened(upload) as file:
        kept = {name: value for name, value in answers if name not in QUESTIONS["values"]}
        return read_grid(file, **kept)


@cached(max_entries=8)
def picture_of_file(upload: Upload, answers: Answers) -> tuple[Bytes, list[str]] | None:
    """Return a picture as colour indices, row 0 in the south, and colours; None for other files."""
    known = dict(answers)
    with opened(upload) as file:
        picture = open_file(file, FilePart.answered(known), up=known.get("up"))
    if not isinstance(picture, PictureFile):
        return None
    indices, colours = few_colours(picture)
    return indices if known.get("up") else indices[::-1], colours


def ask_about_image(choice: ImageChoice, write: Write, *, volume: bool = True) -> None:
    """Ask the open questions about a file; `write` is called with the new choice."""
    upload, known = choice.upload, dict(choice.answers)
    if upload is None:
        return

    def answer(question: str, **new: Any) -> None:
        """Keep answers to earlier questions, and guess answers that depend on the new answer."""
        order = list(QUESTIONS)
        later = {name for key in order[order.index(question) :] for name in QUESTIONS[key]}
        kept = {name: value for name, value in known.items() if name not in later}
        write(image_of_file(upload, kept | new, volume=volume))

    asked = asked_of(choice)
    summary = questions.summary_of(upload, FilePart.answered(known) if "part" in asked else None)
    if summary is None:
        return
    if "part" in asked:
        _ask_part(upload, known, answer)
    if "variable" in asked:
        name = known.get("variable")
        questions.ask_variable(summary, name, lambda name: answer("variable", variable=name))
    if "shape" in asked:
        n = summary.variables[0].shape[0]
        small = [k for k in range(1, isqrt(n) + 1) if n % k == 0]
        sizes = sorted({*small, *(n // k for k in small)})
        chosen: dict[str, Any] = options_of({nx: f"{nx} (and {n // nx} N–S)" for nx in sizes})
        chosen["write"] = lambda nx: answer("shape", shape=(n // nx, nx))
        label = f"The file has {n:,} values: how many cells E–W?"
        field(st.selectbox, label, key="ask_columns", value=known["shape"][1], **chosen)
    if "slice" in asked:
        _ask_layers(summary, known, answer)
    if "up" in asked or summary.is_picture or "up" in known:
        questions.ask_way("up", known, partial(answer, "up"))
    if "gaps" in asked:
        _ask_gaps(upload, known, answer)
    if "values" in asked:
        _ask_values(grid_of_file(upload, choice.answers), summary.is_picture, known, answer)


def _ask_part(upload: Upload, known: Mapping[str, Any], answer: Answer) -> None:
    shape, every = _too_large(upload)
    ny, nx = shape[-2:]
    step_note(f"{describe_shape(shape)} cells are more than the dashboard accepts.")

    def choose(way: str) -> None:
        side = min(ny // every, nx // every)
        middle = ((ny - side) // 2, (nx - side) // 2, side, side)
        answer("part", **({"crop": middle} if way == PIECE else {"every": every}))

    way = PIECE if {"crop", "layers"} & set(known) else ALL
    chosen = {"value": way, "write": choose, "options": [ALL, PIECE]}
    field(st.segmented_control, "Take", key="ask_part", **chosen)
    if way == PIECE:
        taken = {name: known[name] for name in ("crop", "layers") if name in known}
        crop = taken.get("crop", (0, 0, ny, nx))
        _crop(crop, shape, lambda crop: answer("part", **taken | {"crop": crop}))
        if len(shape) > 2:
            layers = taken.get("layers", (0, shape[0]))

            def choose_layers(k: int, n: int) -> None:
                answer("part", **taken | {"layers": (k, n)})

            _range("Lowest layer", "Number of layers", layers, shape[0], choose_layers)
    if (k := known.get("every", 1)) > 1:
        step_note(f"Only the middle cell of each {k} × {k} cells is used.")


def _crop(
    crop: tuple[int, int, int, int], shape: tuple[int, ...], write: Callable[[tuple], None]
) -> None:
    """Ask for the south-west cell and the size of a piece of the image."""
    row, column, ny, nx = crop
    _range("West cell", "Cells E–W", (column, nx), shape[-1], lambda c, n: write((row, c, ny, n)))
    _range("South cell", "Cells N–S", (row, ny), shape[-2], lambda r, n: write((r, column, n, nx)))


def _range(
    of_first: str, of_length: str, now: tuple[int, int], n_all: int, write: Callable[..., None]
) -> None:
    """Ask for the first cell and the number of cells along one of `n_all` cells."""
    first, n = now
    fields: dict[str, dict[str, Any]] = {
        of_first: {"value": first, "min_value": 0, "max_value": n_all - 1},
        of_length: {"value": n, "min_value": 1, "max_value": n_all - first},
    }
    fields[of_first]["write"] = lambda first: write(first, min(n, n_all - first))
    fields[of_length]["write"] = lambda n: write(first, n)
    with st.container(horizontal=True, gap="small"):
        for label, number in fields.items():
            key = f"ask_{label.lower().replace(' ', '_').replace('–', '')}"
            field(st.number_input, label, key=key, **number)


def _ask_gaps(upload: Upload, known: Mapping[str, Any], answer: Answer) -> None:
    values = grid_of_file(upload, questions.answered((), **{**known, "crop": None}))
    n = int(np.isnan(values).sum())
    step_note(page_text("Gaps", n=f"{n:,}", cells=f"{values.size:,}"))
    _crop(known["crop"], values.shape[-2:], lambda crop: answer("gaps", crop=crop))


def _ask_layers(summary: FileSummary, known: Mapping[str, Any], answer: Answer) -> None:
    """Ask whether to use the volume or a layer, and whether the first layer is the top."""
    volume, n = bool(known.get("volume")), summary.n_slices
    chosen: dict[str, Any] = {"value": VOLUME if volume else LAYER, "options": [VOLUME, LAYER]}
    chosen["write"] = lambda way: answer("slice", volume=way == VOLUME)
    field(st.segmented_control, f"The file has {n} layers. Use", key="ask_layers", **chosen)
    if volume:
        step_note(f"All {n} layers are used as a volume. For a map, choose “{LAYER}”.")
    else:
        layer = known["slice_index"] + 1
        step_note(f"Layer {layer} of {n} is used as a map. For all layers, choose “{VOLUME}”.")
        questions.ask_slice(
            n, known["slice_index"], lambda k: answer("slice", slice_index=k), slider=True
        )
    if volume and summary.asks_up:
        ends = options_of({True: "the bottom", False: "the top"})
        ends |= {"value": known.get("z_up", True), "key": "ask_z_up"}
        ends["write"] = lambda up: answer("slice", volume=True, z_up=up)
        field(st.selectbox, "The first layer of the file is", **ends)


def _ask_values(values: Floats, is_picture: bool, known: Mapping[str, Any], answer: Answer) -> None:
    """Ask for the limits between classes, on a histogram, or for the number of colour classes."""
    values = values[~np.isnan(values)]
    classes = COLOURS if is_picture else CLASSES
    ways = [THRESHOLD, classes] + ([] if is_picture else [CODES])
    by_edges = isinstance(known.get("classes"), tuple)
    way = CODES if known.get("classes") == "codes" else classes
    way = THRESHOLD if "threshold" in known else CLASSES if by_edges else way
    ways = [CLASSES if by_edges and name == COLOURS else name for name in ways]

    def choose(way: str) -> None:
        start: dict[str, Any] = {classes: {"classes": 2}, CODES: {"classes": "codes"}}
        median = questions.rounded(float(np.median(values)))
        answer("values", **start.get(way, {"threshold": median}))

    label = "Colours become facies by" if is_picture else "Values become facies by"
    chosen = {"value": way, "write": choose, "options": ways}
    chosen["help"] = "Drag a line or type a limit. Values at the limit are in the facies above."
    field(st.segmented_control, label, key="ask_values", **chosen)
    n = known.get("classes")
    if way == classes and isinstance(n, int):
        most = MAX_COLOURS if is_picture else 32
        number: dict[str, Any] = {"value": n, "min_value": 2, "max_value": most}
        number["write"] = lambda n: answer("values", classes=n)
        field(st.number_input, "How many", key="ask_classes", **number)
    if way in (CODES, COLOURS):
        return
    if way == THRESHOLD:
        edges = [float(known["threshold"])]
    else:
        edges = list(known["classes"]) if by_edges else class_edges(values, int(n or 2)).tolist()
    _histogram(values, edges, answer)
    if way == THRESHOLD:
        number = {"value": edges[0], "write": lambda v: answer("values", threshold=v)}
        label = "Threshold: values at or above it are facies 1, values below it facies 0"
        field(st.number_input, label, key="ask_threshold", format="%g", **number)


def _histogram(values: Floats, edges: list[float], answer: Answer) -> None:
    low, high = float(values.min()), float(values.max())
    counts, _ = np.histogram(values, BINS, (low, high))

    def moved(edges: list[float]) -> None:
        one, *others = map(float, edges)
        answer("values", **({"classes": (one, *others)} if others else {"threshold": one}))

    data = {"counts": counts.tolist(), "low": low, "high": high, "label": "Limit between facies"}
    data["edges"] = [questions.rounded(edge) for edge in edges]
    draw_component("histogram", "image_histogram", data, "edges", moved)
