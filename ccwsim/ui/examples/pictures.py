"""The pictures of an example, from real realizations on a small grid, kept by what they show."""

from __future__ import annotations

from base64 import b64encode
from dataclasses import dataclass, replace

import numpy as np
import streamlit as st
from numpy.typing import NDArray

from ccwsim.figures import LIGHT, Dots, Theme, data_map_png, facies_colours, share_png, sparkline
from ccwsim.metrics import variogram
from ccwsim.model.choices import Choices
from ccwsim.model.ensemble import Ensemble
from ccwsim.run.simulation import simulate
from ccwsim.ui.compare.settings import LETTERS, describe_setting
from ccwsim.ui.examples.catalogue import Example, settings_of
from ccwsim.ui.jobs.statistics import LruCache, StatisticsWorker, Task
from ccwsim.ui.session.resolve import data_of, image_of

MAX_SIDE = 300
"""Cells along a side: of a larger study the pictures show its south-west corner."""
N_TOGETHER = 20
"""Realizations of a probability or of curves."""
MAX_DOTS = 1000
MAX_PIXELS = 600
"""Pixels of a picture: twice what it has on the page, for fine screens."""
N_LAGS = 80


@dataclass(frozen=True)
class Picture:
    """One picture of an example: its HTML, and the label below it.

    It has nx × ny cells: pictures beside each other have the same scale.
    """

    content: str
    label: str
    nx: int
    ny: int


@st.cache_resource(show_spinner=False)
def picture_worker() -> StatisticsWorker:
    """Return where pictures are drawn, one after another, and kept for all sessions."""
    return StatisticsWorker(LruCache(most=128))


def small(choices: Choices) -> Choices:
    """Return a study on a grid that is small enough for a picture, with the data that are in it.

    Examples
    --------
    >>> small(Choices()).grid.shape
    (300, 300)
    """
    ny, nx = (min(side, MAX_SIDE) for side in choices.grid.shape)
    data = choices.data
    if data.source == "bundled":
        data = replace(data, answers=(("on_outside", "drop"),))
    return replace(choices, grid=replace(choices.grid, ny=ny, nx=nx), data=data)


def pictures_of(example: Example, theme: Theme) -> Task[tuple[Picture, ...]]:
    """Return the pictures of an example: the training image first."""
    choices = small(example.choices)
    shown = choices.image.digest, repr(choices), repr(example.others), example.shows
    return Task(("example", *shown, theme.each), lambda progress: _drawn(example, choices, theme))


def expected(example: Example) -> list[tuple[str, int, int]]:
    """Return label, columns and rows of each picture, before there are any."""
    ny, nx = image_of(example.choices.image).shape
    grid = small(example.choices).grid
    return [("training image", nx, ny), *((label, grid.nx, grid.ny) for label in labels(example))]


def labels(example: Example) -> list[str]:
    """Return what is said below each picture but that of the training image.

    Examples
    --------
    >>> from ccwsim.ui.examples.catalogue import EXAMPLES
    >>> labels(EXAMPLES[0])
    ['realization 1', 'realization 2']
    """
    settings = settings_of(example)
    if len(settings) == 1:
        return [SHOWN[name] for name in example.shows]
    own = describe_setting(settings[0], settings[1])
    said = [own, *(describe_setting(p, settings[0]) for p in settings[1:])]
    return [f"{letter}: {text}" for letter, text in zip(LETTERS, said, strict=False)]


SHOWN = {
    "realization": "realization 1",
    "second": "realization 2",
    "data": "the data",
    "probability": f"probability, {N_TOGETHER} realizations",
    "variogram": "variogram E–W",
}


def _drawn(example: Example, choices: Choices, theme: Theme) -> tuple[Picture, ...]:
    image, data = image_of(choices.image), data_of(choices)
    colours = facies_colours(image)
    settings = settings_of(example)
    many = {"probability", "variogram"} & set(example.shows) and len(settings) == 1
    ensembles = [
        simulate(image, choices.grid, p, data, N_TOGETHER if many else 2, choices.seed)
        for p in settings
    ]
    own = _img(data_map_png(image.indices, colours, longest=MAX_PIXELS), f"The image {image.name}")
    if len(settings) > 1:
        shown = [_realization(e, 0, colours) for e in ensembles]
    else:
        shown = [_shown(name, ensembles[0], colours, theme) for name in example.shows]
    sizes = expected(example)
    return tuple(Picture(html, *size) for html, size in zip([own, *shown], sizes, strict=True))


def _shown(name: str, e: Ensemble, colours: list[str], theme: Theme) -> str:
    facies = 1
    if name == "probability":
        probability = e.probability(int(e.training_image.codes[facies]))
        alt = f"Probability of {e.training_image.facies_names[facies]}"
        return _img(share_png(probability, longest=MAX_PIXELS), alt)
    if name == "variogram":
        own = variogram(e.indices, facies, lags=N_LAGS).gamma
        reference = variogram(e.training_image.indices[None], facies, lags=N_LAGS).gamma[0]
        return _img(sparkline(own, reference, theme), "Variograms along E–W", "svg+xml")
    if name == "data":
        known = np.full(e.grid.shape, len(colours), np.uint8)
        rows, columns = e.hard_data.cells.T
        known[rows, columns] = _facies_of_data(e)
        ground = [*colours, LIGHT.paper]  # facies are seen on it in either theme
        return _img(data_map_png(known, ground, longest=MAX_PIXELS), f"{e.hard_data.n} hard data")
    return _realization(e, 1 if name == "second" else 0, colours)


def _realization(e: Ensemble, r: int, colours: list[str]) -> str:
    dots = None
    if 0 < e.hard_data.n <= MAX_DOTS:
        facies = _facies_of_data(e)
        rows, columns = e.hard_data.cells.T
        wrong = e.indices[r][rows, columns] != facies
        dots = Dots(e.hard_data.cells, [colours[k] for k in facies], wrong)
    return _img(
        data_map_png(e.indices[r], colours, dots, longest=MAX_PIXELS), f"Realization {r + 1}"
    )


def _facies_of_data(e: Ensemble) -> NDArray[np.integer]:
    return e.training_image.codes.searchsorted(e.hard_data.facies)


def _img(picture: bytes, alt: str, kind: str = "png") -> str:
    coded = b64encode(picture).decode()
    return f'<img src="data:image/{kind};base64,{coded}" alt="{alt}">'
