"""The page Examples: example studies in the order of a lecture, a quiz, and a link for a class."""

from __future__ import annotations

import time
from base64 import b64encode
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from html import escape

import numpy as np
import streamlit as st

from ccwsim import Ensemble, simulate
from ccwsim.experiments.two_point import simulate_two_point
from ccwsim.figures import (
    LIGHT,
    Theme,
    data_map_png,
    facies_colours,
    slices_of,
    sparkline,
    steps_of,
)
from ccwsim.flow import darcy
from ccwsim.flow.answers import breakthrough
from ccwsim.jobs.job import FIRST_RESULT_SECONDS
from ccwsim.jobs.memo import Memo
from ccwsim.jobs.statistics import Failure, StatisticsWorker, Task
from ccwsim.metrics import connectivity, variogram
from ccwsim.model import Array, Bytes, Floats
from ccwsim.report.document import report_html
from ccwsim.report.pictures import dots_of
from ccwsim.report.settings import describe_setting
from ccwsim.sharing.choices import Choices
from ccwsim.sharing.link import link_of, parts_left_out
from ccwsim.ui.compare.settings import LETTERS
from ccwsim.ui.examples import opened
from ccwsim.ui.examples.catalogue import (
    LECTURE_PARTS,
    SHORT_LECTURE,
    Example,
    lecture_sheet,
    study_address,
)
from ccwsim.ui.examples.quiz import draw_quiz
from ccwsim.ui.results.maps import middle_cells
from ccwsim.ui.session import CLASS, State, data_of, follow_tasks, go_to, image_of, secondary_of
from ccwsim.ui.widgets import (
    bound_to,
    button,
    chart_theme,
    download,
    draw_style,
    field,
    in_row,
    numbers_table,
    options_of,
    page_labels,
    page_text,
    problem_in,
    scrolled,
    step_note,
)

VIEWS = {
    "studies": "Lecture plan",
    "short": "Lecture in 20 minutes",
    "quiz": "Quiz: which one is the training image?",
}
MAX_PICTURE_SIDE = 300
"""Maximum side of a picture in cells; larger studies show only their south-west corner."""
MAX_VOLUME_SIDE = 80  # maximum number of cells along a horizontal side of a volume in a picture
N_TOGETHER = 20  # number of realizations from which a probability map or curves are computed
MAX_DOTS = 1000
EXAMPLE_PIXELS = 600
"""Width of a picture in pixels, twice the width on the page for high-resolution screens."""
N_LAGS = 80
N_SOLVED, N_EXAMPLE_PARTICLES = (
    5,
    100,
)  # realizations through which flow is solved, and particles in each
SINGLE = {"realization", "second", "data", "layer", "section"}  # pictures of one realization each
OPEN_HELP = "Makes this example the study and runs it."
COMPARE_HELP = "Compares the settings of this example side by side."
SHEET_HELP = "The lecture as an HTML file to print: tasks with links, and then the answers."


def draw_examples(state: State) -> None:
    """Draw the example studies, or the quiz."""
    draw_style("examples/examples.css")
    page_state, page = state.page(opened.Examples), st.context.url or ""
    with in_row("examples_row"):
        field(
            st.segmented_control,
            "Examples",
            key="examples_view",
            label_visibility="collapsed",
            **bound_to(page_state, "view"),
            **options_of(VIEWS),
        )
        with st.popover("Link for a class", key="class_menu"):
            step_note(page_text("Link for a class"))
            st.code(class_link(state.choices, page), language=None, wrap_lines=True)
            if missing := parts_left_out(state.choices):
                step_note(f"The link cannot carry {' and '.join(missing)}.")
        download(
            "Lecture sheet",
            lambda: report_html(lecture_sheet(page)).encode(),
            "ccwsim_lecture.html",
            key="lecture_sheet",
            help=SHEET_HELP,
        )
        if page_state.kept is not None:
            button(
                "Back to my study",
                key="back_to_own",
                on_click=opened.back_to_own,
                args=(state,),
                help=opened.BACK_HELP,
            )
    with st.container(key="results"):
        if page_state.view == "quiz":
            draw_quiz(state)
        elif page_state.view == "short":
            _draw_short_lecture()
        else:
            _draw_plan(state)


def class_link(choices: Choices, page: str) -> str:
    """Return the address that opens a study on Simulate, with a different seed for each user."""
    return study_address(link_of(replace(choices, seed=0)) | {CLASS: ["1"]}, page)


def _draw_short_lecture() -> None:
    """Draw the screens of a short lecture, with links that open in tabs of their own."""
    step_note(page_text("Lecture in 20 minutes"))
    rows = [
        [f'<a href="{escape(address)}" target="_blank">{escape(title)}</a>', str(minutes), *texts]
        for title, (minutes, address, *texts) in SHORT_LECTURE.items()
    ]
    table = numbers_table(rows, ("screen", "minutes", "show", "ask"), "screens")
    st.html(scrolled(table, "Lecture in 20 minutes"))


def _draw_plan(state: State) -> None:
    step_note(page_text("Lecture plan"))
    deadline = time.monotonic() + FIRST_RESULT_SECONDS
    number, waiting = 0, []
    for part in LECTURE_PARTS:
        st.html(f'<h2 class="part">{escape(part.title)}</h2>')
        with st.container(key=f"cards_{part.examples[0].name}"):
            for first in range(0, len(part.examples), 2):
                row = part.examples[first : first + 2]
                for place, example in zip(st.columns(2, gap="large"), row, strict=False):
                    number += 1
                    with place, st.container(key=f"card_{example.name}"):
                        if not _draw_card(state, number, example, deadline):
                            waiting.append(example)
    if waiting:
        tasks = [pictures_of(example, chart_theme()) for example in waiting]
        follow_tasks(picture_worker(), tasks, time.monotonic())


def _draw_card(state: State, number: int, example: Example, deadline: float) -> bool:
    """Draw an example; return whether its pictures are done, with or without an error."""
    worker, task = picture_worker(), pictures_of(example, chart_theme())
    worker.ask(task)
    result = worker.wait_for(task, max(0.0, deadline - time.monotonic()))
    source = f"<span>{escape(example.source)}</span>" if example.source else ""
    st.html(
        f"{pictures_html(example, result)}"
        f'<h3 class="example"><b>{number}</b>{escape(example.title)}{source}</h3>'
        f"{opened.task_html(example)}"
    )
    if isinstance(result, Failure):
        step_note(f"No pictures: {result.reason}.")

    def action(label: str, key: str, act: Callable, note: str) -> bool:
        def clicked() -> None:
            state.message = problem_in(partial(act, state, example)) or state.message

        return button(label, key=key, on_click=clicked, help=note)

    with in_row(f"actions_{example.name}", "top"):
        if action("Open", f"open_{example.name}", opened.open_example, OPEN_HELP):
            go_to(opened.SIMULATE, opened.TAKEN)
        key = f"compare_{example.name}"
        if example.others and action("Compare", key, opened.compare_example, COMPARE_HELP):
            go_to(opened.COMPARE, opened.TAKEN)
    return result is not None


def pictures_html(example: Example, result: tuple[CardPicture, ...] | Failure | None) -> str:
    """Return the pictures of an example, or empty spaces of the same size."""
    pictures = result if isinstance(result, tuple) else expected_pictures(example)
    figures = "".join(
        f'<figure style="--shape: {p.nx} / {p.ny}">{p.content}'
        f"<figcaption>{escape(p.label)}</figcaption></figure>"
        for p in pictures
    )
    busy = "" if result else ' aria-busy="true"'
    row = pictures[: 3 if len(pictures) == 6 else None]  # six pictures are in two rows
    columns = " ".join(f"minmax(0, {p.nx}fr)" for p in row)  # all pictures have the same scale
    return (
        f'<div class="pictures n{len(pictures)}" style="grid-template-columns: {columns}"{busy}>'
        f"{figures}</div>"
    )


@dataclass(frozen=True)
class CardPicture:
    """A picture of nx × ny cells beside others of the same scale: its HTML, label and size."""

    content: str
    label: str
    nx: int
    ny: int


@st.cache_resource(show_spinner=False)
def picture_worker() -> StatisticsWorker:
    """Return the worker that draws pictures one at a time and keeps them for all sessions."""
    return StatisticsWorker(Memo(max_values=128, max_bytes=256 * 10**6))


def small(choices: Choices) -> Choices:
    """Return a study on a grid that is small enough for a picture, with the data in that grid."""
    most = MAX_VOLUME_SIDE if choices.grid.is_volume else MAX_PICTURE_SIDE
    ny, nx = (min(side, most) for side in choices.grid.shape[-2:])
    data = choices.data
    if data.source == "bundled":
        data = replace(data, answers=(("on_outside", "drop"),))
    return replace(choices, grid=replace(choices.grid, ny=ny, nx=nx), data=data)


def pictures_of(example: Example, theme: Theme) -> Task[tuple[CardPicture, ...]]:
    """Return the task that draws the training image and the other pictures of an example."""
    choices = small(example.choices)
    inputs = choices.image.digest, repr(choices), repr(example.others), example.shows
    return Task(("example", *inputs, theme.each), lambda progress: _drawn(example, choices, theme))


def expected_pictures(example: Example) -> list[CardPicture]:
    """Return an empty picture, with its expected label and size, for each picture."""
    image, settings, kinds = image_of(example.choices.image), example.settings, example.shows
    grid, first = small(example.choices).grid, kinds[0]
    named = page_labels("pictures_of_examples")
    labels = [named[kind].format(n=N_TOGETHER) for kind in kinds]
    if example.others:
        beside = settings[1], *[settings[0]] * len(example.others)
        texts = map(describe_setting, settings, beside)
        labels = [f"{letter}: {text}" for letter, text in zip(LETTERS, texts, strict=False)]
        kinds = [first] * len(settings)
    heights = [(grid.nz or 0) if kind == "section" else grid.ny for kind in kinds]
    cut_of_image = f", a {first}" if first in ("layer", "section") else ""
    image_height = image.shape[0] if first == "section" else image.shape[-2]
    blank = "<i></i>"
    return [
        CardPicture(blank, f"training image{cut_of_image}", image.shape[-1], image_height),
        *(
            CardPicture(blank, label, grid.nx, ny)
            for label, ny in zip(labels, heights, strict=True)
        ),
    ]


def cut(values: Array, kind: str) -> Array:
    """Return the middle layer of a volume or the middle section along x; return a map unchanged."""
    if values.ndim == 2:
        return values
    return values[:, values.shape[1] // 2] if kind == "section" else middle_cells(values)


def _drawn(example: Example, choices: Choices, theme: Theme) -> tuple[CardPicture, ...]:
    image, data = image_of(choices.image), data_of(choices)
    colours = facies_colours(image)
    few = set(example.shows) <= SINGLE or example.others
    n, secondary = 2 if few else N_TOGETHER, secondary_of(choices)
    ensembles = [
        simulate(
            image,
            choices.grid,
            p,
            hard_data=data,
            n_realizations=n,
            seed=choices.seed,
            secondary=secondary,
        )
        for p in example.settings
    ]
    first = example.shows[0]
    picture = data_map_png(cut(image.indices, first), colours, longest=EXAMPLE_PIXELS)
    image_tag = _img(picture, f"The image {image.name}")
    if example.others:
        tags = [_realization(e, 0, colours, first) for e in ensembles]
    else:
        sources = {"": ensembles[0]}
        if "two-point realization" in example.shows:
            sources["two-point"] = simulate_two_point(image, choices.grid, N_TOGETHER, choices.seed)
        parts = (name.rpartition(" ") for name in example.shows)
        tags = [_shown(kind, sources[of], colours, theme) for of, _, kind in parts]
    blanks = zip(expected_pictures(example), [image_tag, *tags], strict=True)
    return tuple(replace(blank, content=tag) for blank, tag in blanks)


def _shown(name: str, e: Ensemble, colours: list[str], theme: Theme) -> str:
    code, facies_name = int(e.training_image.codes[1]), e.training_image.facies_names[1]
    if name == "probability":
        indices, steps = steps_of(cut(e.probability(code), name))
        picture = data_map_png(indices, steps, longest=EXAMPLE_PIXELS)
        return _img(picture, f"Probability of {facies_name}")
    if name == "variogram":
        curves = variogram(e, code, lags=N_LAGS).gamma
        reference = variogram(e.training_image, code, lags=N_LAGS).gamma[0]
        return _img(sparkline(curves, reference, theme), "Variograms along E–W", "svg+xml")
    if name == "connectivity":
        curves, (reference,) = (
            connectivity(i, code, "N-S", N_LAGS).tau for i in (e, e.training_image)
        )
        return _img(sparkline(curves, reference, theme), "Connectivity along N–S", "svg+xml")
    if name == "breakthrough":
        *curves, reference = map(arrived, [*e.indices[:N_SOLVED], e.training_image.indices])
        return _img(
            sparkline(curves, reference, theme), "Share of the water that arrived", "svg+xml"
        )
    if name == "data":
        facies_grid = np.full(e.grid.shape, len(colours), np.uint8)
        rows, columns = e.hard_data.cells.T
        facies_grid[rows, columns] = e.study.facies_of_data
        ground = [*colours, LIGHT.paper]  # this grey contrasts with the facies in both themes
        return _img(
            data_map_png(facies_grid, ground, longest=EXAMPLE_PIXELS), f"{e.hard_data.n} hard data"
        )
    return _realization(e, 1 if name == "second" else 0, colours, name)


def arrived(indices: Bytes) -> Floats:
    """Return the share of the water that has flowed from W to E, at times on a logarithmic scale.

    Facies 1 conducts 1000 times as well as the others; the times are 1 to 1000 times the travel
    time through only facies 1.
    """
    flow = darcy(np.where(indices == 1, 1.0, 1e-3), west_east=(indices.shape[1] ** 2, 0))
    times = breakthrough(flow, 1.0, "x", N_EXAMPLE_PARTICLES)
    return times.searchsorted(np.logspace(0, 3, N_LAGS)) / N_EXAMPLE_PARTICLES


def _realization(e: Ensemble, r: int, colours: list[str], kind: str = "realization") -> str:
    indices = e.indices[r]
    dots = dots_of(e.hard_data, e.training_image, indices, colours)
    if e.grid.is_volume:  # only the data in the slice are drawn
        layer, section, _ = slices_of(indices, dots)
        indices, _, dots = section if kind == "section" else layer
    drawn = dots if dots is not None and len(dots.cells) <= MAX_DOTS else None
    picture = data_map_png(indices, colours, drawn, longest=EXAMPLE_PIXELS)
    return _img(picture, f"Realization {r + 1}")


def _img(picture: bytes, alt: str, kind: str = "png") -> str:
    coded = b64encode(picture).decode()
    return f'<img src="data:image/{kind};base64,{coded}" alt="{alt}">'
