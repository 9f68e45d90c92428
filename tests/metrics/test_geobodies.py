"""Test geobodies, Γ, percolation, Euler number and joins against scikit-image and plain sums."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.ndimage import gaussian_filter
from skimage.measure import euler_number, label

from ccwsim import Parameters, TrainingImage, simulate
from ccwsim.metrics import Fit, fit_joins, geobody_statistics
from ccwsim.metrics.joins import JOINS_MARGIN, JOINS_SIDE, joins_per_square
from ccwsim.report.verdicts import describe_joins
from tests.small_images import blobs

N = JOINS_SIDE
SMALL = Parameters((8, 16, 16), (4, 4, 4), (1, 1, 1))


@settings(deadline=None, max_examples=40)
@given(
    seed=st.integers(0, 10**6),
    ny=st.integers(1, 15),
    nx=st.integers(1, 15),
    share=st.floats(0, 1),
    neighbours=st.sampled_from([4, 8]),
)
def test_bodies_are_those_of_scikit_image(seed, ny, nx, share, neighbours):
    image = np.random.default_rng(seed).random((ny, nx)) < share
    connectivity = 2 if neighbours == 8 else 1
    labels = label(image, connectivity=connectivity)
    sizes = sorted(np.bincount(labels.ravel())[1:].tolist(), reverse=True)
    found = geobody_statistics(image, 1, neighbours)
    assert found.sizes[0].tolist() == sizes
    assert found.n_geobodies[0] == len(sizes)
    assert found.euler_number[0] == euler_number(image, connectivity=connectivity)
    west_east = (set(labels[:, 0]) & set(labels[:, -1])) - {0}
    south_north = (set(labels[0]) & set(labels[-1])) - {0}
    assert found.percolates_ew[0] == bool(west_east)
    assert found.percolates_ns[0] == bool(south_north)


def test_gamma_is_the_share_of_connected_pairs():
    image = np.random.default_rng(3).integers(0, 2, (9, 9))
    geobodies = label(image, connectivity=2).ravel()
    inside = geobodies[geobodies > 0]
    expected = np.mean(inside[:, None] == inside[None, :])
    assert geobody_statistics(image, 1).gamma[0] == pytest.approx(expected)


def test_a_facies_that_is_absent_has_no_bodies():
    found = geobody_statistics(np.zeros((2, 5, 5), bool), 1)
    assert found.n_geobodies.tolist() == [0, 0]
    assert np.isnan(found.gamma).all()
    assert not found.percolates_ew.any()


def test_a_river_percolates_along_itself_only():
    image = np.zeros((9, 9), int)
    image[4] = 3
    found = geobody_statistics(image, 3)
    assert found.percolates_ew[0]
    assert not found.percolates_ns[0]


def strands(*parts: tuple[slice | int, slice | int], side: int = 2 * N) -> np.ndarray:
    """Return a map with cells of the facies in some rows and columns."""
    inside = np.zeros((side, side), bool)
    for part in parts:
        inside[part] = True
    return inside


def per_map(inside: np.ndarray) -> list[float]:
    """Return the numbers of unions, loops and ends of a map of whole squares."""
    return (np.array(joins_per_square(inside)) * (inside.size / N**2)).tolist()


def test_two_strands_that_meet_in_a_later_square_are_one_union():
    feet = (slice(0, 40), 10), (slice(0, 40), 40)
    assert per_map(strands(*feet)) == [0, 0, 2]
    assert per_map(strands(*feet, (40, slice(10, 41)))) == [1, 0, 0]


def test_a_ring_over_four_squares_is_one_loop():
    rows, columns = (10, slice(10, 41)), (slice(10, 41), 10)
    far = (40, slice(10, 41)), (slice(10, 41), 40)
    assert per_map(strands(rows, columns, *far)) == [0, 1, 0]
    open_ring = strands(rows, columns, *far)
    open_ring[10, 20:34] = False
    assert per_map(open_ring)[:2] == [1, 0]  # its two feet start in different squares


def test_a_hole_inside_a_square_is_no_loop_and_a_full_map_joins_nothing():
    inside = strands((slice(0, 2 * N), slice(0, 2 * N)))
    assert per_map(inside) == [0, 0, 0]
    inside[5:9, 5:9] = False
    assert per_map(inside) == [0, 0, 0]


def test_an_end_reaches_the_middle_of_a_square_and_leaves_it_once():
    for last, n_ends in ((JOINS_MARGIN, 0), (JOINS_MARGIN + 1, 1), (N, 0)):
        assert per_map(strands((14, slice(0, last)), side=N)) == [0, 0, n_ends]
    assert per_map(strands((14, slice(12, 16)), side=N)) == [0, 0, 0]  # does not cross the border


def counted_one_by_one(inside: np.ndarray) -> tuple[int, int]:
    """Return the unions and loops, counted while squares are added one after another."""
    unions = loops = 0
    before = np.zeros_like(inside)
    for y in range(0, inside.shape[0], N):
        for x in range(0, inside.shape[1], N):
            square, after = np.zeros_like(inside), before.copy()
            square[y : y + N, x : x + N] = inside[y : y + N, x : x + N]
            after |= square
            labels, n_after = label(after, return_num=True)
            n_before = label(before).max()
            starts = len(np.setdiff1d(labels[square], labels[before & (labels > 0)]))
            unions += n_before + starts - n_after
            loops += holes(after) - holes(before) - holes(square)
            before = after
    return unions, loops


def holes(inside: np.ndarray) -> int:
    """Return the number of holes, which do not touch the border of the map."""
    return int(label(~np.pad(inside, 1), connectivity=1).max()) - 1


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**16), st.sampled_from((0.0, 0.7, 2.0, 4.0)), st.floats(-0.1, 0.1))
def test_joins_are_what_adding_squares_one_by_one_counts(seed, smooth, level):
    rng = np.random.default_rng(seed)
    noise = gaussian_filter(rng.standard_normal((3 * N, 2 * N)), smooth)
    inside = noise > level * noise.std()
    assert per_map(inside)[:2] == pytest.approx(counted_one_by_one(inside))


def test_a_map_smaller_than_a_square_has_no_joins():
    assert np.isnan(joins_per_square(np.ones((N - 1, 2 * N), bool))).all()


def test_fits_compare_maps_with_crops_and_leave_volumes_out():
    image = TrainingImage(blobs((120, 120), 2))
    fit = fit_joins(simulate(image, (120, 120), n_realizations=4), 1)
    assert fit is not None
    assert fit.crop_shape == (60, 60)
    (verdict,) = describe_joins(fit, "sand")
    assert verdict.words.startswith("cannot tell (± ")
    assert verdict.good is None
    small = fit_joins(simulate(image, (20, 20)), 1)
    assert describe_joins(small, "sand") == []
    volume = TrainingImage(np.tile(blobs((40, 40), 2), (8, 1, 1)))
    assert fit_joins(simulate(volume, (8, 40, 40), SMALL), 1) is None


@pytest.mark.parametrize(
    ("pieces", "words"),
    [
        ((20.0, 3.0, 1.0), "join as in TI crops"),
        ((20.0, 9.0, 1.0), "rejoin themselves"),
        ((9.0, 3.0, 1.0), "unite too seldom"),
        ((20.0, 3.0, 9.0), "end too often"),
        ((29.0, 0.0, 0.0), "join as in TI crops"),
    ],
)
def test_verdicts_name_the_fault_and_both_numbers(pieces, words):
    crops, tolerance = np.array([20.0, 4.0, 1.0]), np.array([5.0, 2.0, 3.0])
    fit = Fit(np.arange(3.0), np.array(pieces), crops, tolerance, (128, 128))
    (verdict,) = describe_joins(fit, "sand")
    assert verdict.words == f"bodies of sand {words}"
    assert verdict.good == (words == "join as in TI crops")
    assert f"loops {pieces[1]:.1f} (4.0 ± 2.0)" in verdict.numbers
    assert verdict.numbers.endswith("per 100 squares of 28 cells (TI crops of 128 × 128)")
