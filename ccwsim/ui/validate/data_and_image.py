"""Section of the page Validate that tests the training image and the ensemble by the hard data."""

from base64 import b64encode
from collections.abc import Callable, Sequence
from html import escape
from math import isfinite
from typing import TypeVar

import streamlit as st

from ccwsim import Ensemble, HardData, TrainingImage, datasets
from ccwsim.figures import calibration_chart, facies_colours
from ccwsim.jobs.statistics import Fraction, Task
from ccwsim.metrics import DataFit, ImageRank, LeaveOut, leave_out, rank_images
from ccwsim.metrics.data_fit import MIN_PLACES, winner
from ccwsim.model.study import Study
from ccwsim.ui.results.charts import titled_chart
from ccwsim.ui.results.maps import pretty
from ccwsim.ui.session.cached import as_task
from ccwsim.ui.session.state import State
from ccwsim.ui.study.data_fit import data_fit, minus, numbers, verdict
from ccwsim.ui.study.image_step import thumbnail
from ccwsim.ui.validate.statistics import Validation, panel
from ccwsim.ui.widgets.fields import button
from ccwsim.ui.widgets.text import numbers_table, page_text, panel_title, step_note
from ccwsim.ui.widgets.theme import chart_theme

PICTURE = 48
"""Side of a picture in the table of images, in pixels."""
Value = TypeVar("Value")


@as_task
def ranks(progress: Fraction, data: HardData, image: TrainingImage) -> tuple[ImageRank, ...]:
    """Rank the bundled images and the image of the study by the hard data."""
    bundled = [datasets.load(name) for name in datasets.all_image_names()]
    others = [one for one in bundled if one.n_dimensions == image.n_dimensions]
    return rank_images(
        [image, *(one for one in others if one.digest != image.digest)], data, progress
    )


@as_task
def left_out(progress: Fraction, ensemble: Ensemble, by_well: bool) -> LeaveOut:
    """Predict each fifth of the hard data, or of the wells, from the other data."""
    e = ensemble
    study = Study(e.training_image, e.grid, e.parameters, e.hard_data, e.seed)
    return leave_out(study, by="well" if by_well else "datum", progress=progress)


def draw_data_and_image(state: State, ensemble: Ensemble, colours: Sequence[str]) -> None:
    """Draw whether the data contradict the image, the ranking of images, and left-out data."""
    data, image = ensemble.hard_data, ensemble.training_image
    if data.n < MIN_PLACES:
        step_note(f"Fewer than {MIN_PLACES} hard data say nothing about a training image.")
        return
    left, middle, right = st.columns([1.2, 1.2, 1.0], gap="large")
    with left:
        panel_title("Fit", "of the data to this image")
        panel(state, "data_fit", data_fit(image, data, ensemble.grid), _draw_fit)
    with middle:
        panel_title("Best image", "among the bundled images and yours")
        tip = "Nothing is simulated: each datum is predicted from its neighbours by each image."
        _draw_on_demand(state, "Rank images", ranks(data, image), _draw_ranks, tip)
    with right:
        panel_title("Left-out data", "are probabilities reliable?")
        tip = "Simulates five times 24 realizations without a fifth of the data."
        task = left_out(ensemble, ensemble.grid.nz is not None)
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


def _draw_fit(fit: DataFit) -> None:
    st.html(verdict(fit))
    families = sorted(fit.families.items(), key=lambda item: -item[1])
    rows = [(escape(name), f"{value:.1f}") for name, value in families]
    st.html(numbers_table([("largest difference", "standard deviations"), *rows]))
    step_note(numbers(fit))


def _draw_ranks(found: Sequence[ImageRank]) -> None:
    best = winner(found)
    if best is None:
        st.html('<p class="note">· Data cannot tell these images apart</p>')
    else:
        name = escape(_name(best))
        st.html(f'<p class="note">✓ {name} predicts your data best</p>')
    rows = "<tr><th></th><th></th><td>log score</td><td>behind, in standard errors</td></tr>"
    for number, rank in enumerate(found):
        picture = b64encode(thumbnail(rank.image, facies_colours(rank.image), 2 * PICTURE)).decode()
        alt = escape(f"Training image {_name(rank.image)}", quote=True)
        source = f"data:image/png;base64,{picture}"
        score = minus(f"{rank.score:.3f}") if isfinite(rank.score) else "lacks a facies"
        behind = f"{rank.z:.1f}" if number and isfinite(rank.z) else ""
        rows += (
            f'<tr><td><img src="{source}" width="{PICTURE}" alt="{alt}"></td>'
            f"<th>{escape(_name(rank.image))}</th><td>{score}</td><td>{behind}</td></tr>"
        )
    st.html(f'<table class="numbers">{rows}</table>')
    step_note(page_text("Log score"))


def _name(image: TrainingImage) -> str:
    return pretty(image.name or "your image")


def _draw_left_out(found: LeaveOut) -> None:
    step_note(f"{found.words}.")
    table = found.reliability
    chart = calibration_chart(table.forecast, table.observed, table.count, chart_theme())
    note = minus(f"slope {found.slope:.2f}; skill {100 * found.skill:.0f} %")
    alt = "Share of left-out data with the facies, for each predicted probability"
    titled_chart("Reliability", note, chart, "reliability", alt)
    step_note(page_text("Skill and slope", z=minus(f"{found.z:.1f}")))
