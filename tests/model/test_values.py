"""Test values of a continuous variable, in images, hard data and ensembles."""

import pickle
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from ccwsim import (
    CCWSIMError,
    Grid,
    HardData,
    Parameters,
    Secondary,
    TrainingImage,
    concatenate,
    revise,
    simulate,
)
from ccwsim.model.arrays import digest
from ccwsim.model.missing import UNKNOWN

SMALL = Parameters(template_size=16, overlap_size=4, wavelet_level=1)


def hills(shape=(70, 80), seed=0) -> np.ndarray:
    """Return a smooth field with some noise."""
    rng = np.random.default_rng(seed)
    y, x = (rng.uniform(4, 9) * np.linspace(0, n / 30, n) for n in shape)
    return np.add.outer(np.sin(y), np.cos(x)) + 0.1 * rng.standard_normal(shape)


def image_of(values=None, **options) -> TrainingImage:
    values = hills() if values is None else values
    return TrainingImage.from_array(values, continuous=True, variable="porosity", **options)


def data_of(n: int, shape=(50, 60), seed=1) -> HardData:
    rng = np.random.default_rng(seed)
    cells = np.argwhere(np.ones(shape))[rng.permutation(shape[0] * shape[1])[:n]]
    return HardData(cells, values={"porosity": 3 * rng.standard_normal(n)})


def test_classes_have_equal_numbers_of_cells_and_ascend():
    image = image_of(units="%")
    values = image.values["porosity"]
    assert np.ptp(np.bincount(image.indices.ravel())) <= 1
    ends = [(values[image.indices == k].min(), values[image.indices == k].max()) for k in range(8)]
    assert all(high < low for (_, high), (low, _) in pairwise(ends))
    assert (image.n_facies, image.variable, image.units) == (8, "porosity", "%")


def test_ranks_order_values_and_are_equally_common():
    image = image_of()
    values = image.values["porosity"]
    ranks = image.ranks_of(values)
    assert (np.diff(ranks.ravel()[np.argsort(values, axis=None)].astype(int)) >= 0).all()
    assert np.ptp(np.bincount(ranks.ravel(), minlength=255)) <= 2
    assert image.ranks_of(np.array([-99.0, 99.0, np.nan])).tolist() == [0, 254, 0]


@pytest.mark.parametrize(
    "values", [np.ones((9, 9)), np.eye(9), np.arange(81.0).reshape(9, 9) // 30]
)
def test_equal_values_are_in_one_class(values):
    image = image_of(values)
    assert image.n_facies == len(np.unique(values))
    assert np.array_equal(image.class_indices(image.values["porosity"]), image.indices)


def test_gaps_of_any_kind_are_unknown():
    values = hills()
    values[3, 4], values[5, 6] = np.nan, -9999
    image = image_of(np.ma.masked_where(values > 1.9, values))
    unknown = np.isnan(values) | (values == -9999) | (values > 1.9)
    assert np.array_equal(np.isnan(image.values["porosity"]), unknown)
    assert np.array_equal(image.indices == UNKNOWN, unknown)


def test_images_differ_by_values_and_survive_pickling_read_only():
    image, other = image_of(), image_of(np.exp(hills()))
    assert np.array_equal(image.indices, other.indices)
    assert image != other
    copy = pickle.loads(pickle.dumps(image))
    assert copy == image
    assert not copy.values["porosity"].flags.writeable


def test_an_image_of_values_takes_no_threshold_and_no_other_classes():
    with pytest.raises(CCWSIMError, match="leave out threshold"):
        image_of(threshold=0.2)
    image = image_of()
    with pytest.raises(CCWSIMError, match="do not belong to its classes"):
        TrainingImage(image.array, values={"porosity": -image.values["porosity"]})


def test_values_of_data_are_sorted_with_their_cells():
    cells, values = [[5, 1], [0, 2], [0, 1]], [0.3, 0.1, np.nan]
    data = HardData(cells, values={"porosity": values})
    assert data.cells.tolist() == [[0, 1], [0, 2], [5, 1]]
    assert np.array_equal(data.values["porosity"], [np.nan, 0.1, 0.3], equal_nan=True)
    assert data == HardData(cells[::-1], values={"porosity": values[::-1]})
    assert data != HardData(cells, values={"porosity": [0.3, 0.2, np.nan]})
    fitted = data.of_image(image_of())
    assert fitted.cells.tolist() == [[0, 2], [5, 1]]
    assert image_of().class_indices(np.array([0.1, 0.3])).tolist() == fitted.facies.tolist()


def test_data_come_from_pairs_maps_and_tables():
    image, grid = image_of(), Grid(4, 5)
    values = np.full((4, 5), np.nan)
    values[1, 2], values[3, 0] = -1.0, 0.25
    expected = HardData([[1, 2], [3, 0]], values={"porosity": [-1.0, 0.25]}).of_image(image)
    assert HardData.of(values, grid, image) == expected
    assert HardData.of(([[3, 0], [1, 2]], [0.25, -1.0]), grid, image) == expected


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (HardData([[1, 1]], [3]), "hard data have facies, but the training image has porosity"),
        (HardData([[1, 1]], values={"K": [3.0]}), "hard data have K"),
    ],
)
def test_data_of_another_variable_are_refused(data, message):
    with pytest.raises(CCWSIMError, match=message):
        simulate(image_of(), (40, 40), SMALL, data)


def test_data_with_two_values_in_a_cell_or_a_wrong_number_are_refused():
    with pytest.raises(CCWSIMError, match="keep one datum"):
        HardData([[1, 1], [1, 1]], values={"porosity": [0.1, 0.2]})
    with pytest.raises(CCWSIMError, match="one value for each of the 2 cells"):
        HardData([[1, 1], [2, 1]], values={"porosity": [0.1]})
    with pytest.raises(CCWSIMError, match="hard data have porosity"):
        simulate(np.eye(50), (40, 40), SMALL, HardData([[1, 1]], values={"porosity": [0.1]}))


@pytest.mark.parametrize("options", [{}, {"wavelet_level": 0}, {"refine": False}])
def test_without_data_every_value_is_that_of_the_image_at_its_source(options):
    image = image_of()
    e = simulate(image, (50, 60), replace(SMALL, **options), n_realizations=3, keep_sources=True)
    values = e.values["porosity"]
    assert values.dtype == np.float64
    assert np.array_equal(values, image.values["porosity"].ravel()[e.sources])
    assert np.array_equal(image.class_indices(values), e.indices)


@pytest.mark.parametrize("n", [1, 40, 900, 2500])
def test_data_are_honoured_to_the_digit(n):
    data = data_of(n)
    e = simulate(image_of(), (50, 60), SMALL, data, n_realizations=2, seed=3)
    values = e.values["porosity"]
    assert all(np.array_equal(one[tuple(data.cells.T)], data.values["porosity"]) for one in values)
    assert e.n_mismatched.tolist() == [0, 0]
    assert np.array_equal(e.training_image.class_indices(values), e.indices)
    others = np.delete(values.reshape(2, -1), data.cells @ [60, 1], axis=1)
    inside = e.training_image.sorted_values
    assert others.min() >= inside[0]
    assert others.max() <= inside[-1]


def test_statistics_of_values_equal_those_of_numpy():
    active = np.add.outer(np.arange(50), np.arange(60)) > 20
    e = simulate(image_of(), (50, 60), SMALL, data_of(5), 6, secondary=Secondary(active))
    values = e.values["porosity"]
    assert np.isnan(values[:, ~active]).all()
    assert not np.isnan(values[:, active]).any()
    assert np.array_equal(e.mean(), np.mean(values, axis=0), equal_nan=True)
    assert np.array_equal(e.std("porosity"), np.std(values, axis=0), equal_nan=True)
    assert np.array_equal(e.quantile(0.1), np.quantile(values, 0.1, axis=0), equal_nan=True)
    shares = np.where(active, np.mean(values > 0.3, axis=0), np.nan)
    assert np.array_equal(e.exceedance(0.3), shares, equal_nan=True)
    with pytest.raises(CCWSIMError, match=r"no values of 'K'; it has porosity"):
        e.mean("K")
    with pytest.raises(CCWSIMError, match="only facies"):
        simulate(np.eye(50), (40, 40), SMALL).mean()


def test_a_realization_depends_only_on_seed_and_number():
    inputs = image_of(), (50, 60), SMALL, data_of(30)
    e = simulate(*inputs, n_realizations=3, seed=2)
    parts = [simulate(*inputs, seed=2, first_realization=k) for k in range(3)]
    assert np.array_equal(concatenate(parts).values["porosity"], e.values["porosity"])
    assert np.array_equal(e[1:].values["porosity"], e.values["porosity"][1:])


def test_revise_honours_new_data_and_changes_nothing_without_any():
    before = simulate(image_of(), (50, 60), SMALL, data_of(30), 2)
    same = revise(before, before.hard_data)
    assert np.array_equal(same.values["porosity"], before.values["porosity"])
    fewer = revise(before, before.hard_data.part(slice(5)))
    assert np.array_equal(fewer.values["porosity"], before.values["porosity"])
    more = revise(before, data_of(40, seed=5))
    assert more.n_mismatched.tolist() == [0, 0]
    assert np.array_equal(more.training_image.class_indices(more.values["porosity"]), more.indices)
    assert before.n_mismatched.tolist() == [0, 0]


@pytest.mark.parametrize(
    ("parameters", "secondary", "message"),
    [
        (replace(SMALL, method="ms-ccsim"), None, "ms-ccsim"),
        (replace(SMALL, exact_data=False), None, "exact_data=True"),
        (SMALL.as_in("paper"), None, "variant"),
        (SMALL, Secondary(probabilities={1: 0.3}), "probabilities"),
        (SMALL, Secondary(images=[image_of().array]), "further images"),
    ],
)
def test_what_only_facies_can_have_is_refused(parameters, secondary, message):
    with pytest.raises(CCWSIMError, match=message):
        simulate(image_of(), (40, 40), parameters, secondary=secondary)


def test_volumes_of_values_are_refused():
    with pytest.raises(CCWSIMError, match="volumes; simulate a map"):
        simulate(image_of(np.stack([hills()] * 6)), (4, 40, 40), Parameters(4, 2, 0))


def test_turned_and_mirrored_copies_keep_their_values():
    image, turned = image_of(), Secondary(angle=30.0, mirrored="x")
    e = simulate(image, (50, 60), SMALL, secondary=turned, keep_sources=True)
    assert np.array_equal(e.values["porosity"], image.values["porosity"].ravel()[e.sources])


def test_realizations_written_to_disk_have_values(tmp_path):
    inputs = {"grid_shape": (50, 60), "parameters": SMALL, "n_realizations": 3}
    e = simulate(image_of(), **inputs)
    written = simulate(image_of(), **inputs, out=tmp_path / "values.npy")
    assert np.array_equal(np.load(tmp_path / "values.npy"), e.values["porosity"])
    assert np.array_equal(written.values["porosity"], e.values["porosity"])
    assert np.array_equal(written.indices, e.indices)


DIGESTS = {
    0: "5371e2cfab439b2d519bee58",
    40: "bde1b16a930c2f8f9d3d43cc",
    900: "57cc28dcc34015563cb67688",
}
"""Digests of the sources, by the number of data; values with data depend on libraries."""


@pytest.mark.parametrize("n", DIGESTS)
def test_every_source_is_as_it_was(n):
    e = simulate(image_of(), (50, 60), SMALL, data_of(n), 2, seed=9, keep_sources=True)
    assert digest(e.sources) == DIGESTS[n]


def test_an_indicator_is_an_ensemble_of_two_facies():
    image, data = image_of(units="%"), data_of(30)
    e = simulate(image, (50, 60), SMALL, data, 3)
    two = e.indicator(0.25)
    values = e.values_of()
    assert (two.realizations == (values > 0.25)).all()
    assert two.training_image.facies_names == ("porosity ≤ 0.25 %", "porosity > 0.25 %")
    assert (two.hard_data.facies == (data.values["porosity"] > 0.25)).all()
    assert not two.n_mismatched.any()
    assert not two.values
    assert (two.probability(1) == e.exceedance(0.25)).all()


def test_an_indicator_of_active_cells_and_gaps():
    values = hills()
    values[:5, :7] = np.nan
    active = np.ones((40, 50), bool)
    active[:10, :20] = False
    e = simulate(image_of(values), (40, 50), SMALL, secondary=Secondary(active=active))
    two = e.indicator(0.0)
    assert (two.indices[0][~active] == UNKNOWN).all()
    assert np.isin(two.indices[0][active], (0, 1)).all()
    assert (np.isnan(two.training_image.array) == np.isnan(values)).all()


@pytest.mark.parametrize("threshold", [-99.0, 99.0, np.nan, "high"])
def test_a_threshold_divides_the_values_of_the_image(threshold):
    image = image_of()
    with pytest.raises(CCWSIMError, match="threshold"):
        image.indicator(threshold)
    with pytest.raises(CCWSIMError, match="threshold"):
        image.indicator(image.sorted_values[-1])


@pytest.mark.parametrize("values", [hills(), np.eye(30), 1 - np.eye(30)])
def test_the_median_divides_the_values(values):
    image = image_of(values)
    assert image.indicator(image.median).n_facies == 2
    assert image.two_facies.numbering == "values"
    medians = image.class_medians
    assert medians == sorted(medians)


def test_classes_are_named_after_their_limits():
    image = image_of(np.arange(64.0).reshape(8, 8) - 8, units="m")
    names = image.facies_names
    assert (names[0], names[1], names[-1]) == ("below 0 m", "0 to 8 m", "48 m and more")
    assert image_of(np.ones((8, 8))).facies_names == ("all values",)


def test_facies_have_no_indicator():
    e = simulate(np.tile([[0], [0], [1], [1]], (16, 64)), (40, 50), SMALL)
    with pytest.raises(CCWSIMError, match="only facies"):
        e.indicator(0.5)


def test_equal_values_are_equal_data_whatever_their_classes():
    cells, values = [[3, 4], [5, 6]], {"porosity": [-1.0, 1.0]}
    data = HardData(cells, values=values)
    assert data == data.of_image(image_of())
    assert data != HardData(cells, values={"porosity": [-1.0, 1.5]})
    assert data != HardData(cells, values={"K": [-1.0, 1.0]})
    assert HardData() == HardData([], values={"porosity": []})
