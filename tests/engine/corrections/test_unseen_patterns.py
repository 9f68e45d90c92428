"""Test that patches are tried on a copy of the grid, and that thin facies are recognized."""

from __future__ import annotations

import numpy as np
import pytest

from ccwsim.engine.corrections.unseen_patterns import (
    box_within_reach,
    known_patterns,
    make_trial,
    mean_thickness,
    n_unseen_around,
    n_unseen_with,
    simulated_within_reach,
)
from ccwsim.engine.prepared_image import PreparedImage
from ccwsim.engine.raster import N_DRAWN, N_DRAWN_THIN, make_plan
from ccwsim.engine.stages.path import LEFT, TOP, Box
from ccwsim.model.grid import Grid
from ccwsim.model.parameters import Parameters
from ccwsim.model.study import Study
from ccwsim.model.training_image import TrainingImage
from tests.small_images import blobs


@pytest.mark.parametrize("corner", [(0, 0), (10, 14), (28, 0), (28, 26)])
def test_a_tried_patch_is_counted_as_if_it_were_pasted(corner):
    image, grid = blobs((1, 60, 70), 3), blobs((1, 40, 38), 3, 5)
    patterns, keep = known_patterns(image), np.random.default_rng(0).random((1, 12, 12)) < 0.3
    y, x = corner
    box, place = Box(0, y, x, 1, 12, 12, TOP | LEFT, 0, 4, 4), (0, 17, 23)
    around = box_within_reach(box, patterns, grid.shape)
    trial, before = make_trial((1, 12, 12), patterns, 3), grid.copy()
    found = n_unseen_with(image, place, box, around, keep, grid, patterns, 1 << 30, trial)
    np.testing.assert_array_equal(grid, before)
    pasted = grid.copy()
    new = np.where(keep, grid[:, y : y + 12, x : x + 12], image[:, 17:29, 23:35])
    pasted[:, y : y + 12, x : x + 12] = new
    added = np.bincount(pasted.ravel(), minlength=3) - np.bincount(grid.ravel(), minlength=3)
    np.testing.assert_array_equal(trial.counts, added)
    assert found == n_unseen_around(pasted, around, patterns, trial)
    earlier = simulated_within_reach(box, patterns)
    assert (earlier.y0, earlier.x0) == (around.y0, around.x0)
    assert (earlier.y0 + earlier.ny, earlier.x0 + earlier.nx) == (y + 12, x + 12)


def test_thickness_is_the_number_of_cells_across_a_band():
    image = np.zeros((1, 90, 90), np.uint8)
    image[0, 10:13] = 1
    image[0, 40:50] = 2
    thickness = mean_thickness(image)
    assert thickness[1:].tolist() == [3, 10]
    cube = np.zeros((30, 40, 40), np.uint8)
    cube[10:14] = 1
    assert mean_thickness(cube)[1] == 4


@pytest.mark.parametrize(("template", "drawn"), [(32, N_DRAWN), (64, N_DRAWN_THIN)])
@pytest.mark.parametrize("thickness", [2, 8])
def test_large_patches_of_thin_facies_are_tried(template, drawn, thickness):
    array = np.zeros((120, 120), int)
    array[np.arange(120) % 24 < thickness] = 1
    study = Study(TrainingImage(array), Grid(120, 120), Parameters(template, template // 4, 1))
    size = 1, template, template
    search = make_plan(PreparedImage(study), size, np.random.default_rng(0)).inputs.search
    tried = template == 64 and thickness == 2
    assert search.by_unseen == tried
    assert search.n_drawn == (drawn if tried else N_DRAWN)
