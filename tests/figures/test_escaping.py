"""Test that charts show names literally: tags, entities and placeholders have no effect."""

from __future__ import annotations

import re

import numpy as np
import pytest

from ccwsim import Grid, HardData, TrainingImage, figures
from ccwsim.figures import LIGHT, Bundle, Group, Line, Strip, TimeSeries, notebook
from ccwsim.figures.style import figure_json
from ccwsim.model.ensemble import Ensemble
from ccwsim.model.study import Study
from tests.some import annotations_of

EVIL = '<a href="//e.vil">b</a> &lt; %{x}'
SHOWN = "&lt;a href="
ONE = np.ones(3)
CURVES = Bundle(np.arange(3.0), ONE, np.ones((2, 3)), ONE, ONE, ONE)
SERIES = TimeSeries(EVIL, 1, np.array([1e4, 1e6]), np.array([0.01, 1.0]))
IMAGE = TrainingImage([[0, 1], [1, 1]], name=EVIL, facies_names=(EVIL, f"{EVIL}2"))
TITLES = {"x_title": EVIL, "y_title": EVIL}


def ensemble() -> Ensemble:
    stack, data = np.zeros((1, 2, 2), np.uint8), HardData([[0, 0]], [0])
    status = np.zeros((1, 1), np.int16)
    study = Study(IMAGE, Grid(2, 2), hard_data=data, seed=1, checked=False)
    return Ensemble(study, stack, ONE[:1], 0.5, status, np.array([0]))


CHARTS = {
    "compared_proportions_chart": lambda draw: draw(
        IMAGE.facies_names, ONE[:2], {EVIL: np.ones((1, 2))}, LIGHT
    ),
    "compared_times_chart": lambda draw: draw({EVIL: ONE}, ONE[:1], [EVIL], LIGHT),
    "conductivity_chart": lambda draw: draw(
        ONE, {EVIL: (1.0, "#000")}, LIGHT, unit=EVIL, height=90
    ),
    "curves_chart": lambda draw: draw({EVIL: CURVES}, LIGHT, **TITLES),
    "data_status_chart": lambda draw: draw([EVIL, "b"], np.ones((1, 2)), LIGHT),
    "geobody_sizes_chart": lambda draw: draw(CURVES, LIGHT, y_title=EVIL),
    "lag_map_chart": lambda draw: draw(
        np.arange(-1, 2), np.ones((3, 3)), LIGHT, name=EVIL, largest=2.0
    ),
    "lines_chart": lambda draw: draw([Line(EVIL, ONE, ONE, "#000")], LIGHT, **TITLES),
    "mds_chart": lambda draw: draw(
        np.zeros(2), [Group(EVIL, np.ones((2, 2)), "#000", labels=[EVIL] * 2)], LIGHT
    ),
    "proportions_chart": lambda draw: draw(
        IMAGE.facies_names, ONE[:2], np.ones((1, 2)), ["#000"] * 2, LIGHT
    ),
    "repetition_chart": lambda draw: draw(np.arange(3), ONE, ONE, {EVIL: 2}, LIGHT),
    "strip_chart": lambda draw: draw(Strip(EVIL, ONE, 1.0), LIGHT, colour="#000"),
    "sweep_chart": lambda draw: draw(
        ONE[:1], ONE[:1], [EVIL], LIGHT, front=[0], selected=0, recommended=0, y_title=EVIL
    ),
    "timings_chart": lambda draw: draw(
        [SERIES], [SERIES], {10**4: EVIL, 10**6: "b"}, LIGHT, x_title=EVIL
    ),
    "transiogram_chart": lambda draw: draw({(0, 1): CURVES}, [0], [1], IMAGE.facies_names, LIGHT),
    "vertical_proportions_chart": lambda draw: draw(CURVES, LIGHT, **TITLES),
    "image_chart": lambda draw: draw(IMAGE),
    "ensemble_chart": lambda draw: draw(ensemble()),
}
"""A call of every chart that accepts texts."""
NO_TEXTS = ("blank_chart", "breakthrough_chart")
"""Charts whose only text is a colour."""
TEXTS = ("str", "Line", "TimeSeries", "Group", "Strip", "Image", "Ensemble")


def chart_functions() -> dict:
    return {
        name: function
        for module in (figures, notebook)
        for name, function in vars(module).items()
        if name.endswith("_chart") and name not in NO_TEXTS
    }


def test_every_chart_that_takes_texts_is_tried():
    takes = {
        name
        for name, function in chart_functions().items()
        if any(
            text in annotation for annotation in annotations_of(function).values() for text in TEXTS
        )
    }
    assert takes == set(CHARTS)


@pytest.mark.parametrize("name", CHARTS)
def test_no_chart_takes_a_name_for_markup(name):
    figure = CHARTS[name](chart_functions()[name])
    spec = figure_json(figure).replace("\\u003c", "<")
    assert "<a" not in spec
    assert "b</a>" not in spec
    assert "%{x}" not in re.sub(r"%\{x\}( E)?, (y )?%\{y\}", "", spec)
    assert SHOWN in spec
