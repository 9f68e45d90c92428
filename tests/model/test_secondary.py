"""Test secondary information: accepted forms, and one sentence for each kind of bad input."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given, strategies as st

from ccwsim import (
    Auxiliary,
    CCWSIMError,
    Grid,
    HardData,
    Parameters,
    Secondary,
    TrainingImage as Image,
)
from ccwsim.model.secondary import cells_in_polygon
from ccwsim.model.study import Study
from tests.small_images import blobs

IMAGE = Image(blobs((1, 40, 44), 3)[0], facies_names=["Sand", "Mud", "Clay"])
GRID = Grid(30, 36)
VOLUME = Image(blobs((4, 24, 24), 2, 2), facies_names=["Sand", "Mud"])
P = Parameters(8, 2, 1)


def fitted(secondary, grid=GRID, image=IMAGE):
    p = P if image.n_dimensions == 2 else Parameters((2, 8, 8), (1, 2, 2), (0, 1, 1))
    return Study(image, grid, p, secondary=secondary).secondary


@pytest.mark.parametrize("mask", [np.ones, np.zeros])
def test_a_mask_may_be_numbers_booleans_or_nan(mask):
    active = np.tile(np.arange(36) < 20, (30, 1))
    for form in (active, active.astype(int), np.where(active, 3.0, np.nan)):
        np.testing.assert_array_equal(fitted(Secondary(active=form)).active, active)
    several = np.where(active, 2, -9999)
    np.testing.assert_array_equal(fitted(Secondary(active=several)).active, active)


def test_polygons_are_in_world_coordinates():
    grid = Grid(30, 36, (10.0, 10.0), (1000.0, 500.0))
    corners = [[1000, 500], [1100, 500], [1100, 600], [1000, 600]]
    active = fitted(Secondary(active=corners), grid).active
    expected = np.zeros((30, 36), bool)
    expected[:10, :10] = True
    np.testing.assert_array_equal(active, expected)
    two = [corners, np.array(corners) + 200]
    assert fitted(Secondary(active=two), grid).active.sum() == 200


def test_cells_in_a_polygon_are_those_whose_centre_an_odd_number_of_edges_has_in_the_west():
    source = np.random.default_rng(1)
    for _ in range(50):
        grid = Grid(9, 12, (2.0, 0.5), (-3.0, 4.0))
        corners = source.integers(-8, 20, (source.integers(3, 9), 2)) / 2.0
        inside = np.zeros(grid.shape, bool)
        for (row, y), (column, x) in product(enumerate(grid.axes[1]), enumerate(grid.axes[0])):
            for (x0, y0), (x1, y1) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
                if min(y0, y1) <= y < max(y0, y1):
                    inside[row, column] ^= x < x0 + (y - y0) * (x1 - x0) / (y1 - y0)
        np.testing.assert_array_equal(cells_in_polygon(corners, grid), inside)


def test_probabilities_by_name_code_number_or_vertical_curve():
    sand = np.full((30, 36), 0.2)
    soft = fitted(Secondary(probabilities={"sand": sand, 1: 0.3})).probabilities
    np.testing.assert_allclose(soft[:, 0, 0], [0.2, 0.3, 0.5])
    curve = Secondary(probabilities={"mud": [0.1, 0.5, 0.9]})
    soft = fitted(curve, Grid(20, 20, nz=3), VOLUME).probabilities
    np.testing.assert_allclose(soft[1, :, 5, 7], [0.1, 0.5, 0.9])


def test_nothing_is_known_where_one_map_has_no_value():
    sand = np.full((30, 36), 0.2)
    sand[0] = np.nan
    soft = fitted(Secondary(probabilities={"Sand": sand, "Mud": 0.3})).probabilities
    assert np.isnan(soft[:, 0]).all()
    assert not np.isnan(soft[:, 1:]).any()


def test_a_study_sets_data_in_inactive_cells_aside():
    active = np.zeros((30, 36), bool)
    active[:, :10] = True
    data = HardData([[0, 5], [0, 20]], [0, 1])
    study = Study(IMAGE, GRID, P, data, secondary=Secondary(active=active))
    assert study.hard_data.cells.tolist() == [[0, 5]]
    assert study.inactive_data.cells.tolist() == [[0, 20]]


FLAT = np.zeros((30, 36))
BAD = {
    "another shape": (Secondary(active=np.ones((5, 6))), "6 × 5 cells, but the grid has 36 × 30"),
    "no active cell": (Secondary(active=FLAT), "no cell of the grid is active"),
    "a polygon elsewhere": (Secondary(active=[[90, 90], [95, 90], [95, 99]]), "no centre"),
    "an unknown facies": (Secondary(probabilities={"salt": 0.5}), "must be one of Sand, Mud"),
    "no map": (Secondary(probabilities={}), "there is no map"),
    "two maps": (Secondary(probabilities={"sand": 0.5, 0: 0.5}), "two maps are of one facies"),
    "percent": (Secondary(probabilities={"sand": 40, "mud": 0.1}), "40 in .* divide percent"),
    "a large sum": (Secondary(probabilities={0: 0.5, 1: 0.9, 2: 0.1}), "sum to 1.5 instead of 1"),
    "a sum over 1": (Secondary(probabilities={0: 0.5, 1: 0.9}), "sum to 1.4 instead of 1"),
    "no value at all": (Secondary(probabilities={0: FLAT * np.nan, 1: 0.3}), "no cell has a value"),
    "maps of another shape": (Secondary(probabilities={0: np.ones((2, 3)), 1: 0.0}), "3 × 2 cells"),
    "another image": (
        Secondary(auxiliary=[Auxiliary(np.ones((3, 4)), FLAT)]),
        "of the image: 4 × 3",
    ),
    "gaps": (
        Secondary(auxiliary=[Auxiliary(np.ones(IMAGE.shape), FLAT * np.nan)]),
        "of the grid: some cells have no finite value",
    ),
    "another grid": (
        Secondary(auxiliary=[Auxiliary(np.ones(IMAGE.shape), np.ones((3, 4)))]),
        "of the grid: 4 × 3",
    ),
}


@pytest.mark.parametrize("kind", BAD)
def test_bad_input_is_refused_in_one_sentence(kind):
    secondary, said = BAD[kind]
    with pytest.raises(CCWSIMError, match=said) as error:
        fitted(secondary)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Secondary(probabilities=FLAT), "a mapping of facies to arrays"),
        (lambda: Secondary(soft_weight=9), "soft_weight = 9 must be a number from 0, up to 5"),
        (lambda: Secondary(auxiliary=[FLAT]), "a list of ccwsim.Auxiliary"),
        (lambda: Auxiliary(FLAT, FLAT, weight=-1), "weight = -1 must be"),
        (lambda: Study(IMAGE, GRID, P, secondary={"active": 1}), "must be of type Secondary"),
    ],
)
def test_wrong_types_are_refused_at_once(make, said):
    with pytest.raises(CCWSIMError, match=said):
        make()


def test_an_image_without_a_complete_patch_is_refused():
    cells = np.where(np.arange(44) % 8 == 0, np.nan, IMAGE.array)
    with pytest.raises(CCWSIMError, match="8 × 8 cells is known completely"):
        Study(Image(cells), GRID, P)


def test_an_image_with_gaps_counts_known_cells_only():
    cells = IMAGE.array.astype(float)
    cells[:20] = np.nan
    masked = np.ma.masked_array(IMAGE.array, np.isnan(cells))
    for form in (cells, masked, np.where(np.isnan(cells), -9999.0, cells)):
        image = Image.from_array(form)
        np.testing.assert_array_equal(image.known, ~np.isnan(cells))
        np.testing.assert_allclose(image.proportions, Image(cells[20:].astype(int)).proportions)
        assert np.isnan(image.array[:20]).all()
    with pytest.raises(CCWSIMError, match="no cell has a value"):
        Image(np.full((5, 5), np.nan))


@pytest.mark.parametrize("kind", [list, tuple, np.array])
def test_weights_are_described_in_any_form(kind):
    assert Secondary(images=[IMAGE], weights=kind([1, 2])).describe() == (
        "2 training images with weights"
    )
    zoned = Secondary(images=[IMAGE], zones=np.ones(GRID.shape, int))
    assert zoned.describe() == "2 training images by zone"


def weights_of(images, weights):
    secondary = fitted(Secondary(images=images, weights=weights))
    assert secondary is not None
    return secondary.weights


@given(st.lists(st.floats(0, 1e300), min_size=1, max_size=5), st.floats(1e-300, 1e6))
def test_fitted_weights_do_not_change_when_they_are_fitted_again(others, first):
    images = [IMAGE] * len(others)
    once = weights_of(images, [first, *others])
    assert np.isclose(sum(once), 1)
    assert weights_of(images, once) == once


@pytest.mark.parametrize("weights", [[np.inf, 1], [1e308, 1e308], [np.nan, 1], [0, 0], [-1, 2], 1])
def test_weights_without_a_finite_sum_are_refused(weights):
    with pytest.raises(CCWSIMError, match="give 2 numbers of at least 0"):
        fitted(Secondary(images=[IMAGE], weights=weights))


def test_a_full_turn_turns_nothing():
    image, grid = Image(np.tile([[0], [1]], (10, 20))), Grid(8, 2)
    whole_turns = np.broadcast_to([0.0, 360.0], grid.shape)
    for angle in (360.0, -360.0, whole_turns):
        assert Secondary(angle=angle).fitted(grid, image).is_empty
