"""Test statistics of volumes against loops over cells and against maps."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage
from skimage.measure import euler_number

from ccwsim import HardData, TrainingImage
from ccwsim.metrics import (
    EType,
    calibration,
    connected_geobodies,
    connectivity,
    data_match,
    etype,
    geobody_statistics,
    proportions,
    score_reference,
    transiograms,
    variogram,
    variogram_map,
    vertical_proportions,
)
from ccwsim.metrics.lags import lag_offsets
from ccwsim.metrics.stack import as_image, as_stack
from ccwsim.model.errors import CCWSIMError
from tests.metrics.volumes import a_volume, ensemble_of

STEPS = {
    "E-W": (0, 0, 1),
    "N-S": (0, 1, 0),
    "NE-SW": (0, 1, 1),
    "NW-SE": (0, 1, -1),
    "vertical": (1, 0, 0),
    90.0: (0, 0, 1),
    (1, -1): (0, 1, -1),
    (1, 0, -2): (1, 0, -2),
    (-1, 2, 1): (-1, 2, 1),
}
CODES = ((0, 1), (2, 5, 9), (0, 1, 2, 3))
STRUCTURES = {6: 1, 18: 2, 26: 3}


def pairs(volume, step, lag):
    """Return the values of all pairs of cells at a lag, found by comparing all cells."""
    cells = np.array(list(np.ndindex(volume.shape)))
    others = cells + lag * np.array(step)
    inside = ((others >= 0) & (others < volume.shape)).all(axis=1)
    return volume[tuple(cells[inside].T)], volume[tuple(others[inside].T)]


def test_what_is_taken_as_maps_and_what_as_volumes():
    three = np.zeros((4, 5, 6), int)
    assert as_stack(three).shape == (5, 6)
    assert as_stack(three[None]).shape == as_image(three).shape == (4, 5, 6)
    assert as_image(three[:1]).shape == (5, 6)
    assert as_image(three[:1], n_axes=3).shape == (1, 5, 6)
    image = TrainingImage(a_volume(1))
    assert as_stack(image).shape == as_image(image).shape == (7, 11, 13)
    assert as_stack(ensemble_of(image, a_volume(2)[None])).shape == (7, 11, 13)
    np.testing.assert_array_equal(as_stack(image, [0, 1, 2]).indices[0], image.indices)
    with pytest.raises(CCWSIMError, match="shape"):
        as_stack(np.zeros((1, 1, 1, 2, 2), int))
    with pytest.raises(CCWSIMError, match="not 2 images"):
        as_image(np.zeros((2, 3, 4, 4), int))


@pytest.mark.parametrize("codes", CODES)
def test_shares_and_probabilities_are_those_of_counting(codes):
    volumes = np.array([a_volume(seed, codes=codes) for seed in range(5)])
    shares = np.array([[(v == code).mean() for code in codes] for v in volumes])
    np.testing.assert_allclose(proportions(volumes), shares)
    layers = [[[(z == code).mean() for z in v] for code in codes] for v in volumes]
    np.testing.assert_allclose(vertical_proportions(volumes), layers)
    np.testing.assert_allclose(vertical_proportions(volumes[0], codes)[0], layers[0])
    np.testing.assert_allclose(vertical_proportions(TrainingImage(volumes[0]))[0], layers[0])
    found = etype(volumes)
    each = np.array([(volumes == code).mean(axis=0) for code in codes])
    np.testing.assert_allclose(found.probability, each)
    np.testing.assert_array_equal(found.most_likely, np.array(codes)[each.argmax(axis=0)])
    assert found.entropy.shape == volumes.shape[1:]
    scores = score_reference(found, volumes[0])
    assert scores.accuracy == (found.most_likely == volumes[0]).mean()
    layered = EType(each.reshape(len(codes), 77, 13), 5, found.codes)
    assert scores.brier == score_reference(layered, volumes[0].reshape(77, 13)).brier
    table = calibration(found, TrainingImage(volumes[0]))
    assert table.error == calibration(layered, volumes[0].reshape(77, 13)).error


def test_a_volume_of_one_layer_scores_as_its_map():
    volumes = np.array([a_volume(seed, (1, 9, 8)) for seed in range(3)])
    found = score_reference(etype(volumes), volumes[0])
    assert found.right.shape == (1, 9, 8)
    assert found.brier == score_reference(etype(volumes[:, 0]), volumes[0, 0]).brier
    with pytest.raises(CCWSIMError, match="proportions by layer need volumes"):
        vertical_proportions(volumes[0, 0])
    assert vertical_proportions(volumes[0]).shape == (1, 2, 1)


@pytest.mark.parametrize("direction", STEPS)
@pytest.mark.parametrize("codes", CODES)
def test_curves_are_those_of_pairs_of_cells(direction, codes):
    volume = a_volume(3, (6, 7, 8), codes)
    lags, code = [0, 1, 3], codes[-1]
    gamma = variogram(volume[None], code, direction, lags).gamma[0]
    found = connectivity(volume[None], code, direction, lags)
    moves = transiograms(volume[None], None, direction, lags).probability[0]
    labels = ndimage.label(volume == code, ndimage.generate_binary_structure(3, 3))[0]
    assert found.neighbours == 26
    for k, lag in enumerate(lags):
        tail, head = pairs(volume, STEPS[direction], lag)
        assert gamma[k] == pytest.approx(np.mean((tail == code) != (head == code)) / 2)
        for a, b in np.ndindex(len(codes), len(codes)):
            expected = np.mean(head[tail == codes[a]] == codes[b])
            assert moves[a, b, k] == pytest.approx(expected)
        tail, head = pairs(labels, STEPS[direction], lag)
        joined = (tail > 0) & (tail == head)
        both = ((tail > 0) & (head > 0)).sum()
        np.testing.assert_allclose(found.tau[0, k], joined.sum() / both if both else np.nan)
        assert found.unconditional[0, k] == pytest.approx(joined.mean())


@pytest.mark.parametrize("neighbours", [6, 18, 26])
@pytest.mark.parametrize("shape", [(7, 11, 13), (1, 9, 12), (8, 1, 9), (9, 8, 1), (1, 1, 7)])
def test_geobodies_are_those_of_scipy(neighbours, shape):
    structure = ndimage.generate_binary_structure(3, STRUCTURES[neighbours])
    for seed in range(8):
        rng = np.random.default_rng(seed)
        volume = (rng.random(shape) < rng.uniform(0.1, 0.6)).astype(int)
        volume.flat[:2] = 0, 1
        labels, n = connected_geobodies(volume[None], 1, neighbours)
        expected, n_expected = ndimage.label(volume, structure)
        np.testing.assert_array_equal(labels.reshape(shape), expected)
        found = geobody_statistics(volume[None], 1, neighbours)
        sizes = np.sort(np.bincount(expected.ravel())[1:])[::-1]
        np.testing.assert_array_equal(found.sizes[0], sizes)
        assert n == n_expected == found.n_geobodies[0]
        ends = ((0, found.percolates_vertical), (1, found.percolates_ns), (2, found.percolates_ew))
        for axis, percolates in ends:
            first, last = (set(np.take(expected, k, axis).flat) for k in (0, -1))
            assert percolates[0] == bool((first & last) - {0})
        if neighbours != 18:
            euler = euler_number(np.pad(volume, 1), connectivity=3 if neighbours == 26 else 1)
            assert found.euler_number[0] == euler


def test_two_cells_at_a_corner_are_one_geobody_only_of_26_neighbours():
    volume = np.zeros((2, 2, 2), int)
    volume[0, 0, 0] = volume[1, 1, 1] = 1
    for neighbours, n in ((6, 2), (18, 2), (26, 1)):
        found = geobody_statistics(volume[None], 1, neighbours)
        assert found.n_geobodies[0] == found.euler_number[0] == n
    assert geobody_statistics(volume[None], 1).neighbours == 26


def test_maps_keep_their_neighbours_and_the_labels_of_scipy():
    image = a_volume(5, (40, 50), smooth=0.7)
    for neighbours, structure in ((4, 1), (8, 2), (None, 2)):
        expected = ndimage.label(image, ndimage.generate_binary_structure(2, structure))[0]
        np.testing.assert_array_equal(connected_geobodies(image, 1, neighbours)[0], expected)
    found = geobody_statistics(image, 1)
    assert found.neighbours == 8
    assert found.percolates_vertical is None


def test_data_in_layers_are_compared_with_their_cells():
    volumes = np.array([a_volume(seed) for seed in range(4)])
    cells = np.array([[0, 0, 0], [3, 5, 7], [6, 10, 12]])
    data = HardData(cells, [1, 0, 1])
    match = data_match(volumes, data)
    wrong = volumes[:, cells[:, 0], cells[:, 1], cells[:, 2]] != [1, 0, 1]
    np.testing.assert_array_equal(match.wrong, wrong)
    assert match.map.shape == volumes.shape[1:]
    assert (match.map >= 0).sum() == 3
    np.testing.assert_array_equal(data_match(volumes[0], data).wrong[0], wrong[0])
    with pytest.raises(CCWSIMError, match=r"7 layers, 11 rows and 13 columns: layer 7, row 0"):
        data_match(volumes, HardData([[7, 0, 1]], [1]))
    with pytest.raises(CCWSIMError, match="the grid is a map"):
        data_match(volumes[0, 0], data)
    assert data_match(volumes, HardData(np.empty((0, 2)), [])).wrong.shape == (4, 0)


def test_bad_input_is_explained():
    volume = a_volume(1)
    with pytest.raises(CCWSIMError, match="6, 18 or 26 in volumes"):
        connectivity(volume[None], 1, lags=2, neighbours=8)
    with pytest.raises(CCWSIMError, match="must be 4 or 8"):
        connectivity(volume, 1, lags=2, neighbours=26)
    with pytest.raises(CCWSIMError, match=r"9 layers, 0 rows and 0 columns\) does not fit"):
        variogram(volume[None], 1, "vertical", [9])
    with pytest.raises(CCWSIMError, match="needs volumes"):
        variogram(volume, 1, "vertical", 2)
    with pytest.raises(CCWSIMError, match=r"one of E-W, .*, vertical"):
        variogram(volume[None], 1, "up", 2)
    with pytest.raises(CCWSIMError, match="not all 0"):
        lag_offsets((0, 0, 0), np.array([1]), 3)
    with pytest.raises(CCWSIMError, match="not a volume of 7 layers"):
        variogram_map(volume[None], 1, 3)
