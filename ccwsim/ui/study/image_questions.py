"""Open questions about the file of a training image, with guessed answers."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from math import isqrt
from typing import Any

import numpy as np
import streamlit as st

from ccwsim.io import class_edges, guess_answers, read_colours, read_grid
from ccwsim.io.formats.pictures import MAX_COLOURS, PictureFile, few_colours
from ccwsim.io.gridding import FilePart, largest_without_gaps, thinning
from ccwsim.io.limits import TooManyCells
from ccwsim.io.opening import FileSummary, open_file
from ccwsim.io.training_images import QUESTIONS
from ccwsim.model import Bytes, Floats, Shape, describe_shape
from ccwsim.sharing.choices import Answers, ImageChoice, Upload
from ccwsim.ui.frontend.component import draw_component
from ccwsim.ui.session import cached, opened, read_upload
from ccwsim.ui.study import questions
from ccwsim.ui.study.asking import FormItem, Question, ask, same, tabs
from ccwsim.ui.study.questions import way, which_variable
from ccwsim.ui.widgets import if_possible, page_text

BINS = 96
WHOLE_VOLUME, ONE_LAYER = "the whole volume", "one layer"
WITH_GAPS = "the whole image"
WHOLE_IMAGE, ONE_PIECE = "the whole image, thinned", "a piece"
THRESHOLD, CLASSES, MAIN_COLOURS = "threshold", "classes", "main colours"
CODES, KEEP_VALUES = "as they are", "keep values"
WriteImage = Callable[[ImageChoice], None]
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
    user_answers = dict(answers or {})
    if not volume and "slice_index" not in user_answers:
        user_answers.setdefault("volume", False)
    guessed, _ = _guessed(upload, questions.answered((), **user_answers))
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
        arguments = {name: value for name, value in answers if name not in QUESTIONS["values"]}
        return read_grid(file, **arguments)


@cached(max_entries=8)
def picture_of_file(upload: Upload, answers: Answers) -> tuple[Bytes, list[str]] | None:
    """Return a picture as colour indices, row 0 in the south, and colours; None for other files."""
    file_answers = dict(answers)
    with opened(upload) as file:
        picture = open_file(file, FilePart.answered(file_answers), up=file_answers.get("up"))
    if not isinstance(picture, PictureFile):
        return None
    indices, colours = few_colours(picture)
    return indices if file_answers.get("up") else indices[::-1], colours


def ask_about_image(
    choice: ImageChoice, write: WriteImage, *, volume: bool = True, part: str = ""
) -> None:
    """Ask the open questions about a file; `write` is called with the new choice."""
    upload, answers = choice.upload, dict(choice.answers)
    if upload is None:
        return

    def answer(question: str, **new: Any) -> None:
        """Keep answers to earlier questions, and guess answers that depend on the new answer."""
        order = list(QUESTIONS)
        later = {name for key in order[order.index(question) :] for name in QUESTIONS[key]}
        earlier = {name: value for name, value in answers.items() if name not in later}
        write(image_of_file(upload, earlier | new, volume=volume))

    asked = asked_of(choice)
    summary = questions.summary_of(upload, FilePart.answered(answers) if "part" in asked else None)
    if summary is None:
        return
    items: dict[str, Callable[[], list[FormItem]]] = {
        "part": lambda: _part(upload, answers),
        "variable": lambda: [which_variable(summary, answers.get("variable"), "variable")],
        "shape": lambda: [_shape(summary.variables[0].shape[0], answers)],
        "slice": lambda: _layers(summary, answers),
        "up": lambda: [way("up", answers)],
        "gaps": lambda: _gaps(upload, answers),
        "values": lambda: _values(
            grid_of_file(upload, choice.answers), summary.is_picture, answers, part
        ),
    }
    may_turn = summary.is_picture or "up" in answers
    for question in QUESTIONS:
        if question in asked or (question == "up" and may_turn):
            ask(items[question](), partial(answer, question), part)


def _shape(n: int, answers: Mapping[str, Any]) -> Question:
    small = [k for k in range(1, isqrt(n) + 1) if n % k == 0]
    sizes = sorted({*small, *(n // k for k in small)})
    text = f"The file has {n:,} values: how many cells E–W?"
    labels = {nx: f"{nx} (and {n // nx} N–S)" for nx in sizes}
    return Question(
        "columns", text, answers["shape"][1], labels, lambda nx: {"shape": (n // nx, nx)}
    )


def _part(upload: Upload, answers: Mapping[str, Any]) -> list[FormItem]:
    """Ask whether to thin an image that is too large, or to cut a piece, and which piece."""
    shape, every = _too_large(upload)
    ny, nx = shape[-2:]
    side = min(ny // every, nx // every)
    start = {
        WHOLE_IMAGE: {"every": every},
        ONE_PIECE: {"crop": ((ny - side) // 2, (nx - side) // 2, side, side)},
    }
    piece = {name: answers[name] for name in ("crop", "layers") if name in answers}
    items: list[FormItem] = [
        f"{describe_shape(shape)} cells are more than the dashboard accepts.",
        tabs("part", "Take", ONE_PIECE if piece else WHOLE_IMAGE, same(start), start.__getitem__),
    ]
    if piece:
        items += _crop(piece.get("crop", (0, 0, ny, nx)), shape, piece)
    if piece and len(shape) > 2:
        first, n = piece.get("layers", (0, shape[0]))
        names = {"lowest_layer": "Lowest layer", "number_of_layers": "Number of layers"}
        items.append(_range(names, first, n, shape[0], lambda k, n: {**piece, "layers": (k, n)}))
    if (k := answers.get("every", 1)) > 1:
        items.append(f"Only the middle cell of each {k} × {k} cells is used.")
    return items


def _crop(
    crop: tuple[int, int, int, int], shape: Shape, other_answers: Mapping[str, Any]
) -> list[FormItem]:
    """Ask for the south-west cell and the size of a piece of the image."""
    row, column, ny, nx = crop
    along_x = {"west_cell": "West cell", "cells_ew": "Cells E–W"}
    along_y = {"south_cell": "South cell", "cells_ns": "Cells N–S"}
    return [
        _range(
            along_x, column, nx, shape[-1], lambda k, n: {**other_answers, "crop": (row, k, ny, n)}
        ),
        _range(
            along_y, row, ny, shape[-2], lambda k, n: {**other_answers, "crop": (k, column, n, nx)}
        ),
    ]


def _range(
    names: Mapping[str, str], first: int, n: int, n_all: int, answers: Callable[[int, int], Any]
) -> tuple[FormItem, ...]:
    """Ask for the first cell and the number of cells along an axis of `n_all` cells."""
    (key, text), (key_of_length, length) = names.items()
    starts, sizes = (
        {"min_value": low, "max_value": high} for low, high in ((0, n_all - 1), (1, n_all - first))
    )
    return (
        Question(key, text, first, answers=lambda k: answers(k, min(n, n_all - k)), look=starts),
        Question(key_of_length, length, n, answers=lambda size: answers(first, size), look=sizes),
    )


def _gaps(upload: Upload, answers: Mapping[str, Any]) -> list[FormItem]:
    """Ask whether to use an image with its gaps or a piece without gaps, and which piece."""
    values = grid_of_file(upload, questions.answered(tuple(answers.items()), crop=None))
    known, crop = ~np.isnan(values), answers.get("crop")
    piece = largest_without_gaps(np.atleast_2d(known.all(axis=0)) if known.ndim == 3 else known)
    start = {WITH_GAPS: {"crop": None}} | ({ONE_PIECE: {"crop": piece}} if all(piece[2:]) else {})
    note = page_text("Gaps", n=f"{known.size - known.sum():,}", cells=f"{known.size:,}")
    method = ONE_PIECE if crop else WITH_GAPS
    items: list[FormItem] = [note, tabs("gaps", "Take", method, same(start), start.__getitem__)]
    return items + (_crop(crop, values.shape, {}) if crop else [])


def _layers(summary: FileSummary, answers: Mapping[str, Any]) -> list[FormItem]:
    """Ask whether to use the volume or a layer, and whether the first layer is the top."""
    volume, n = bool(answers.get("volume")), summary.n_slices
    labels, text = {True: WHOLE_VOLUME, False: ONE_LAYER}, f"The file has {n} layers. Use"
    use = tabs("layers", text, volume, labels, lambda volume: {"volume": volume})
    if not volume:
        layer = answers["slice_index"]
        note = (
            f"Layer {layer + 1} of {n} is used as a map. For all layers, choose “{WHOLE_VOLUME}”."
        )
        return [use, note, questions.which_slice(n, layer, slider=True)]
    note = f"All {n} layers are used as a volume. For a map, choose “{ONE_LAYER}”."
    ends, text = {True: "the bottom", False: "the top"}, "The first layer of the file is"
    up = answers.get("z_up", summary.bottom_first)
    lowest = Question("z_up", text, up, ends, lambda up: {"volume": True, "z_up": up})
    return [use, note, lowest] if summary.asks_up or not summary.bottom_first else [use, note]


def _values(
    values: Floats, is_picture: bool, answers: Mapping[str, Any], part: str
) -> list[FormItem]:
    """Ask for the limits between classes, on a histogram, or for the number of colour classes."""
    values = values[~np.isnan(values)]
    n, threshold = answers.get("classes"), answers.get("threshold")
    classes = MAIN_COLOURS if is_picture and not isinstance(n, tuple) else CLASSES
    start: dict[str, Mapping[str, Any]] = {
        THRESHOLD: {"threshold": questions.rounded(float(np.median(values)))},
        classes: {"classes": 2},
    }
    if not is_picture:
        start |= {CODES: {"classes": "codes"}, KEEP_VALUES: {"continuous": True}}
    method = THRESHOLD if threshold is not None else CODES if n == "codes" else classes
    method = KEEP_VALUES if answers.get("continuous") else method
    text = f"{'Colours' if is_picture else 'Values'} become facies by"
    tip = "Drag a line or type a limit. Values at the limit are in the facies above."
    items: list[FormItem] = [tabs("values", text, method, same(start), start.__getitem__, help=tip)]
    if method == classes and isinstance(n, int):
        bounds = {"min_value": 2, "max_value": MAX_COLOURS if is_picture else 32}
        items.append(Question("classes", "How many", n, look=bounds))
    if method == KEEP_VALUES:
        units = str(answers.get("units", ""))
        items.append(
            Question(
                "units",
                "Units, such as m or %",
                units,
                answers=lambda text: {"continuous": True, "units": text.strip()},
                widget=st.text_input,
                look={"max_chars": 20},
            )
        )
    if method in (CODES, MAIN_COLOURS, KEEP_VALUES):
        return items
    if threshold is None:
        edges = n if isinstance(n, tuple) else class_edges(values, int(n or 2)).tolist()
        return [*items, partial(_histogram, values, edges, part)]
    text = "Threshold: values at or above it are facies 1, values below it facies 0"
    limit = Question("threshold", text, float(threshold), look={"format": "%g"})
    return [*items, partial(_histogram, values, [limit.value], part), limit]


def _histogram(values: Floats, edges: Sequence[float], part: str, write: Answer) -> None:
    low, high = float(values.min()), float(values.max())
    counts, _ = np.histogram(values, BINS, (low, high))

    def moved(edges: list[float]) -> None:
        limits = list(map(float, edges))
        if len(limits) > 1:
            write(classes=tuple(limits))
        else:
            write(threshold=limits[0])

    content = {
        "counts": counts.tolist(),
        "low": low,
        "high": high,
        "label": "Limit between facies",
        "edges": [questions.rounded(edge) for edge in edges],
    }
    draw_component("histogram", f"{part}image_histogram", content, "edges", moved)
