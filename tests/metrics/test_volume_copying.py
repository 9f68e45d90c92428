"""Test copying and bands of crops in volumes against plain loops."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from ccwsim import TrainingImage
from ccwsim.metrics import copying, crop_shape, fit_curve, fit_geobodies, fit_proportions
from ccwsim.metrics.reference_band import crops_of, largest_crop, pieces_of
from ccwsim.model.errors import CCWSIMError
from tests.metrics.volumes import a_volume, ensemble_of

TI = (6, 9, 11)


def pasted(seed):
    """Return sources pasted box by box, as in a simulation, with one unknown source."""
    rng = np.random.default_rng(seed)
    shape = rng.integers(3, 11, 3)
    flat = np.arange(np.prod(TI)).reshape(TI)
    positions = np.full(shape + 4, -1)
    for corner in np.ndindex(*(-(-shape // 3))):
        z, y, x = 3 * np.array(corner)
        a, b, c = (rng.integers(0, n - 4) for n in TI)
        positions[z : z + 4, y : y + 4, x : x + 4] = flat[a : a + 4, b : b + 4, c : c + 4]
    positions = positions[tuple(slice(n) for n in shape)].copy()
    positions[tuple(rng.integers(0, shape))] = -1
    return positions


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("scattered", [False, True])
def test_what_was_copied_is_that_of_loops(seed, scattered):
    positions = pasted(seed)
    if scattered:
        rng = np.random.default_rng(seed)
        positions = rng.integers(-1, np.prod(TI), positions.shape)
    found = copying(positions, TI)
    at = np.stack(np.unravel_index(np.maximum(positions, 0), TI), axis=-1)
    shift = at - np.stack(np.indices(positions.shape), axis=-1)
    shift[positions < 0] = 10**6
    _, number = np.unique(shift.reshape(-1, 3), axis=0, return_inverse=True)
    number = number.reshape(positions.shape)
    seams, sides, joined = np.zeros(positions.shape, bool), np.zeros(positions.shape, int), []
    for cell in np.ndindex(positions.shape):
        for step, side in zip(np.eye(3, dtype=int), (4, 2, 1), strict=True):
            other = tuple(cell + step)
            if all(a < n for a, n in zip(other, positions.shape, strict=True)):
                same = number[cell] == number[other] and positions[cell] >= 0
                joined.append(same)
                seams[cell] |= not same
                sides[cell] += 0 if same else side
    assert found.copied == pytest.approx(np.mean(joined))
    np.testing.assert_array_equal(found.seams, seams)
    np.testing.assert_array_equal(found.seam_sides, sides)
    for axis, across in enumerate((4, 2, 1)):
        np.testing.assert_array_equal(found.seams_within(axis), (sides & ~across) > 0)
    known = positions[positions >= 0]
    np.testing.assert_array_equal(found.uses.ravel(), np.bincount(known, minlength=np.prod(TI)))
    assert (found.n_unknown, found.uses.shape) == ((positions < 0).sum(), TI)
    blocks = [0]
    for k in np.unique(number[positions >= 0]):
        blocks += np.bincount(ndimage.label(number == k)[0].ravel())[1:].tolist()
    assert found.largest_block == max(blocks)
    cubes = [
        (side, corner)
        for side in range(1, min(positions.shape) + 1)
        for corner in np.ndindex(*(n - side + 1 for n in positions.shape))
        for box in [tuple(slice(a, a + side) for a in corner)]
        if (positions[box] >= 0).all() and (number[box] == number[corner]).all()
    ]
    assert found.largest_square == max(side for side, _ in cubes)
    assert (found.largest_square, found.square_at) in cubes


def test_a_volume_of_one_layer_is_copied_as_its_map():
    rng = np.random.default_rng(1)
    flat = np.arange(99).reshape(9, 11)
    positions = np.vstack([flat[2:7, 1:9], rng.integers(0, 99, (4, 8))])
    one, other = copying(positions[None], (1, 9, 11)), copying(positions, (9, 11))
    assert one.copied == other.copied
    assert one.largest_block == other.largest_block
    np.testing.assert_array_equal(one.seams[0], other.seams)
    with pytest.raises(CCWSIMError, match=r"shape \(nz, ny, nx\)"):
        copying(positions, (1, 9, 11))
    with pytest.raises(CCWSIMError, match="1 × 2 × 3 cells: 94 is too large; give at most 5"):
        copying(positions[None], (1, 2, 3))


def test_crops_have_all_layers_and_pieces_do_not_overlap():
    assert crop_shape((20, 60, 80), (12, 100, 30)) == (12, 30, 30)
    assert crop_shape((20, 60, 80), (40, 20, 30)) == (20, 20, 30)
    assert crop_shape((20, 12, 80), (40, 20, 30)) is None
    assert np.prod(largest_crop((128, 900, 900), (128, 900, 900))) <= 2_000_000
    with pytest.raises(CCWSIMError, match="maps only or volumes only"):
        crop_shape((60, 80), (12, 60, 80))
    volume = np.arange(20 * 60 * 80).reshape(20, 60, 80) % 251
    crops = crops_of(volume, (12, 30, 30))
    assert crops.shape == (2 * 3 * 4, 12, 30, 30)
    np.testing.assert_array_equal(crops[0], volume[:12, :30, :30])
    np.testing.assert_array_equal(crops[-1], volume[-12:, -30:, -30:])
    image = TrainingImage(volume)
    pieces = pieces_of(ensemble_of(image, volume[None]), (10, 20, 20)).indices
    assert pieces.shape == (2 * 3 * 4, 10, 20, 20)
    np.testing.assert_array_equal(np.sort(pieces, axis=None), np.sort(volume, axis=None))


@pytest.mark.parametrize("direction", ["E-W", "N-S", "vertical", 45.0, (1, 0, 1)])
@pytest.mark.parametrize("statistic", ["variogram", "connectivity"])
def test_bands_of_volumes_hold_what_is_alike_and_not_what_is_rough(statistic, direction):
    image = TrainingImage(a_volume(1, (12, 64, 64), smooth=1.5))
    alike = np.array([a_volume(seed, (12, 32, 32), smooth=1.5) for seed in range(2, 8)])
    assert fit_curve(ensemble_of(image, alike), statistic, 1, direction).fits
    rough = np.array([a_volume(seed, (12, 32, 32), smooth=0.4) for seed in range(2, 8)])
    fit = fit_curve(ensemble_of(image, rough), statistic, 1, direction)
    assert fit.crop_shape in ((12, 32, 32),)
    if statistic == "variogram":
        assert not fit.fits


def test_geobodies_and_proportions_of_volumes_are_compared():
    image = TrainingImage(a_volume(1, (12, 64, 64), smooth=1.5))
    alike = np.array([a_volume(seed, (12, 32, 32), smooth=1.5) for seed in range(2, 8)])
    found = fit_geobodies(ensemble_of(image, alike), 1)
    assert found.found.shape == (4,)
    assert found.fits
    assert fit_proportions(ensemble_of(image, alike)).fits
    assert not fit_proportions(ensemble_of(image, np.maximum(alike, alike[::-1]))).fits
