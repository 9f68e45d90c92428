"""Whether the hard data of the study contradict its training image, computed in the background."""

import time
from dataclasses import dataclass, field
from html import escape

import streamlit as st

from ccwsim import Grid, HardData, TrainingImage
from ccwsim.jobs.statistics import Failure, Fraction, StatisticsWorker
from ccwsim.metrics import DataFit, fit_data
from ccwsim.metrics.data_fit import MIN_PLACES
from ccwsim.ui.session.cached import as_task, shared_values
from ccwsim.ui.session.fragments import follow_tasks
from ccwsim.ui.session.resolve import data_of, image_of
from ccwsim.ui.session.state import State

MAX_CELLS = 1_000_000
"""Maximum number of cells of a grid that is checked automatically, in about a second."""


@as_task
def data_fit(progress: Fraction, image: TrainingImage, data: HardData, grid: Grid) -> DataFit:
    """Return whether hard data contradict a training image."""
    return fit_data(image, data, grid, progress=progress)


@dataclass
class DataFitState:
    """The worker that compares hard data with training images for one session."""

    worker: StatisticsWorker = field(default_factory=lambda: StatisticsWorker(shared_values()))


def is_judged(data: HardData, grid: Grid) -> bool:
    """Return whether data are compared with the image automatically."""
    return data.n >= MIN_PLACES and grid.n_cells <= MAX_CELLS


def flagged(fit: DataFit) -> bool:
    """Return whether the verdict warns of a disagreement between the data and the image."""
    return fit.contradicts or fit.words.startswith("Your data")


def minus(number: str) -> str:
    """Return a number with a true minus sign."""
    return number.replace("-", "−")


def verdict(fit: DataFit) -> str:
    """Return the verdict as HTML: a flag or a tick, the words, and numbers on hover."""
    bad = flagged(fit)
    mark = "⚑" if bad else "✓" if fit.words.startswith("Data do") else "·"
    css = "odd" if bad else "note"
    return f'<p class="{css}" title="{escape(numbers(fit))}">{mark} {escape(fit.words)}</p>'


def numbers(fit: DataFit) -> str:
    """Return the numbers behind a verdict in one sentence."""
    return minus(
        f"p = {fit.p:.2g} against unconditional realizations of this image; largest difference: "
        f"{fit.family}, {fit.families[fit.family]:.1f} standard deviations. Log score per datum: "
        f"image {fit.score:.2f}, smoothed data {fit.smoothing:.2f}."
    )


def draw_data_fit(state: State) -> None:
    """Draw the verdict in the study column if no run is in progress and the verdict is known."""
    data, grid = data_of(state.choices), state.choices.grid
    image = image_of(state.choices.image)
    if state.job is not None or not is_judged(data, grid):
        return
    worker = state.page(DataFitState).worker
    task = data_fit(image, data, grid)
    worker.forget()
    worker.ask(task)
    fit = worker.cache.get(task.key)
    if fit is None:
        follow_tasks(worker, [task], time.monotonic())
    elif not isinstance(fit, Failure):
        st.html(verdict(fit))
