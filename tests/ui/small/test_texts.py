"""Test small functions of the pages with one or two values each."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import streamlit as st

from ccwsim import Grid, Parameters, TrainingImage
from ccwsim.io import ImportedPoints, PointsPreview, place_points
from ccwsim.io.hard_data.columns import Assignment
from ccwsim.metrics import default_parameters
from ccwsim.sharing.choices import DataChoice, ImageChoice, Upload
from ccwsim.ui.examples.opened import as_html
from ccwsim.ui.examples.page import cut
from ccwsim.ui.how_it_works.words import format_count
from ccwsim.ui.results import maps
from ccwsim.ui.session.file_names import grid_part, image_part
from ccwsim.ui.session.progress import ordinal
from ccwsim.ui.session.resolve import refitted
from ccwsim.ui.session.uploads import size_of_all
from ccwsim.ui.study import questions
from ccwsim.ui.study.data_step import names_of_files
from ccwsim.ui.validate import slices
from ccwsim.ui.widgets import fields, text
from ccwsim.ui.widgets.errors import problem_in

CELLS = np.arange(12).reshape(2, 3, 2)
CONTENT = bytes(1000)
ROLES = Assignment({"x": "East", "depth_from": "Top"})
OUTSIDE = ImportedPoints(
    np.array([[9.0, 9.0]]), np.ones(1), np.ones(1, int), False, "line", "a", "b"
)
UTM = Grid(512, 256, cell_size=(10.0, 10.0), origin=(436000.0, 4505000.0))


@pytest.mark.parametrize(
    ("found", "expected"),
    [
        (as_html("a < `b`, *c*"), "a &lt; <code>b</code>, <em>c</em>"),
        (cut(CELLS, "layer").tolist(), [[6, 7], [8, 9], [10, 11]]),
        (cut(CELLS, "section").tolist(), [[2, 3], [8, 9]]),
        (cut(CELLS[0], "realization").shape, (3, 2)),
        (format_count(1, "cell"), "1 cell"),
        (format_count(3, "cell"), "3 cells"),
        (format_count(2, "datum", "data"), "2 data"),
        (ImageChoice().rotated.rotated, ImageChoice(flip_ew=True, flip_ns=True)),
        (maps.is_wide(Grid(100, 300)), True),
        (maps.is_wide(Grid(512, 512)), False),
        (maps.middle_cells(np.arange(12).reshape(3, 2, 2)).tolist(), [[4, 5], [6, 7]]),
        (maps.map_name(1, ["mud", "sand"], 2), "probability of sand"),
        (maps.map_name(1, ["mud", "sand"], 1), "sand in the realization"),
        (image_part(TrainingImage([[0, 1]], name="my ../wall")), "my_.._wall"),
        (
            grid_part(TrainingImage([[0, 1]], name="channels"), Grid(100, 200)),
            "channels_200x100",
        ),
        ([ordinal(n) for n in (1, 2, 3, 4)], ["1st", "2nd", "3rd", "4th"]),
        ([ordinal(n) for n in (11, 22)], ["11th", "22nd"]),
        (size_of_all([CONTENT, CONTENT, bytes(10)]), 1010),
        (names_of_files(DataChoice("file", upload=Upload("wells.csv", b""))), "wells.csv"),
        (
            questions.troubles_of(place_points(OUTSIDE, Grid(4, 4))),
            {"on_outside": "1 of 1 data outside the grid"},
        ),
        (questions.answered((("up", True),), classes=3, up=None), (("classes", 3),)),
        (questions.rounded(0.123456), 0.1235),
        (
            questions.taken_as(PointsPreview("a.csv", assignment=ROLES)),
            "East → x, Top → depth from",
        ),
        (questions.role_of("survey_dip"), "dip"),
        (questions.role_of("depth_to"), "depth to"),
        (UTM.describe(), "256 × 512 cells of 10 × 10 from (436000, 4505000)"),
        (str(slices.middle_slice((48, 160, 160))), "layer 24"),
        (str(slices.middle_slice((160, 160))), ""),
        (
            problem_in(lambda: Grid(0, 4)),
            "grid ny = 0 must be a whole number from 1 to 2147483647",
        ),
        (fields.labels_of(fields.options_of({0: "mud", 1: "sand"})), ("mud", "sand")),
        (
            fields.within(20000, {"min_value": 1, "max_value": 10000}),
            {"min_value": 1, "max_value": 20000},
        ),
        (
            fields.starting_at(st.selectbox, "b", {"options": ["a", "b"]}),
            {"options": ["a", "b"], "index": 1},
        ),
        (
            text.numbers_table([["level", "2"]]),
            '<table class="numbers"><tr><th>level</th><td>2</td></tr></table>',
        ),
        (
            text.on_a_page("![It](a.png)\n\n## Run\n[Sweep](sweep.md), [Files](../formats.md)"),
            "### Run\nSweep, Files (docs/formats.md)",
        ),
    ],
)
def test_the_value_is_as_expected(found, expected):
    assert found == expected


def test_a_size_that_did_not_fit_comes_back_with_a_larger_image():
    image, large = (TrainingImage(np.eye(n, dtype=int)) for n in (20, 256))
    small, moved = refitted(Parameters(template_size=40), image, {})
    assert small.template_size == 20
    assert moved["template_size"] == (40, 20)
    assert refitted(small, large, moved)[0].template_size == 40


def test_default_sizes_suit_a_small_image_and_come_back_with_a_larger_one():
    image, large = (TrainingImage(np.eye(n, dtype=int)) for n in (72, 256))
    small, moved = refitted(Parameters(n_candidates=7), image, {})
    assert small == replace(default_parameters(image), n_candidates=7)
    assert small.template_size < 24
    assert refitted(small, image, moved) == (small, moved)
    assert refitted(small, large, moved) == (Parameters(n_candidates=7), {})
    kept = refitted(replace(small, template_size=12), large, moved)[0]
    assert kept.template_size == 12
