"""Test training image, grid, hard data, study and ensemble: contents and refused arguments."""

import copy
import pickle
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from hypothesis.extra import numpy as hnp

from ccwsim import CCWSIMError, Ensemble, Grid, HardData, Parameters, TrainingImage, simulate
from ccwsim.model.arrays import as_integers, digest, smallest_integers
from ccwsim.model.secondary import Auxiliary, Secondary
from ccwsim.model.study import Study
from tests.small_images import blobs, noise

SMALL = Parameters(template_size=8, overlap_size=2, wavelet_level=1)

anything = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.floats(),
    st.complex_numbers(),
    st.text(max_size=3),
    st.binary(max_size=3),
    st.lists(st.one_of(st.integers(), st.floats(), st.text(max_size=2)), max_size=4),
    hnp.arrays(
        st.sampled_from([bool, np.int8, np.uint64, float, complex, "U2", object]),
        hnp.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=3),
    ),
)
codes = st.integers(-(2**62), 2**62)
images = hnp.arrays(np.int64, hnp.array_shapes(min_dims=2, max_dims=2, max_side=7), elements=codes)


class TestTrainingImage:
    @given(images)
    def test_codes_and_indices_give_the_array_back(self, array):
        ti = TrainingImage(array)
        np.testing.assert_array_equal(ti.codes[ti.indices], array)
        np.testing.assert_array_equal(ti.array, array)
        np.testing.assert_array_equal(ti.codes, np.unique(array))

    @given(images)
    def test_proportions_are_counted_cells(self, array):
        ti = TrainingImage(array)
        for code, share in zip(ti.codes, ti.proportions, strict=True):
            assert share == np.mean(array == code)

    def test_it_does_not_follow_changes_of_the_array_it_was_made_from(self):
        array = np.zeros((3, 4), int)
        ti = TrainingImage(array)
        array[0, 0] = 9
        assert ti.array.max() == 0

    @pytest.mark.parametrize("name", ["array", "codes", "indices"])
    def test_its_arrays_cannot_be_written(self, name):
        array = getattr(TrainingImage([[0, 1], [1, 0]]), name)
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1

    def test_nearly_whole_numbers_of_matlab_count_as_whole(self):
        assert TrainingImage([[1.1e-16, 0.9999], [1.0, 2.0]]).codes.tolist() == [0, 1, 2]

    @pytest.mark.parametrize(
        ("array", "said"),
        [
            ([0, 1], r"\(2,\)"),
            (np.zeros((2, 2, 2, 2)), r"\(nz, ny, nx\)"),
            (np.zeros((0, 3)), r"\(0, 3\)"),
            ([[0.5, 1.0]], r"0\.5"),
            ([[np.inf, 1.0]], "inf"),
            ([[1e30, 0.0]], "too large"),
            ([["a", "b"]], "whole numbers"),
            (np.arange(300).reshape(15, 20), "300"),
        ],
    )
    def test_what_is_no_picture_of_facies_is_refused_by_its_value(self, array, said):
        with pytest.raises(CCWSIMError, match=said):
            TrainingImage(array)

    def test_254_facies_are_allowed(self):
        assert TrainingImage(np.arange(254).reshape(2, 127)).n_facies == 254

    @given(anything)
    def test_any_value_gives_an_image_or_our_own_error(self, value):
        with suppress(CCWSIMError):
            assert TrainingImage(value).n_facies >= 1

    def test_rows_of_different_length_are_refused(self):
        with pytest.raises(CCWSIMError):
            TrainingImage([[0, 1], [1]])

    def test_facies_names_must_be_as_many_as_facies(self):
        assert TrainingImage([[0, 5]], facies_names=["mud", "sand"]).facies_names[1] == "sand"
        with pytest.raises(CCWSIMError, match="3 were given for 2"):
            TrainingImage([[0, 5]], facies_names=["a", "b", "c"])

    def test_index_of_an_unknown_facies_names_the_known_ones(self):
        ti = TrainingImage([[3, 7]])
        assert ti.index_of(7) == 1
        with pytest.raises(CCWSIMError, match="3, 7"):
            ti.index_of(0)

    def test_the_digest_tells_content_and_shape_apart(self):
        a = TrainingImage([[0, 1, 1, 0]])
        assert a.digest == TrainingImage(np.array([[0, 1, 1, 0]], float)).digest
        others = [[[0, 1], [1, 0]], [[0, 2, 2, 0]], [[1, 0, 0, 1]]]
        assert len({a.digest, *(TrainingImage(o).digest for o in others)}) == 4


class TestHardData:
    @given(st.lists(st.tuples(st.integers(0, 5), st.integers(0, 5), codes), max_size=12))
    def test_order_and_repetition_do_not_matter_and_clashes_are_refused(self, data):
        cells, facies = [d[:2] for d in data], [d[2] for d in data]
        if len(set(cells)) < len(set(data)):
            with pytest.raises(CCWSIMError, match="two facies in the cell"):
                HardData(cells, facies)
            return
        once = HardData(cells, facies)
        again = HardData(cells[::-1] + cells, facies[::-1] + facies)
        assert once.digest == again.digest
        kept = zip(once.cells.tolist(), once.facies.tolist(), strict=True)
        assert [(*cell, code) for cell, code in kept] == sorted(set(data))

    def test_a_clash_says_which_data_and_where(self):
        with pytest.raises(CCWSIMError, match=r"row 1, column 2 \(no. 1 says 0, no. 3 says 5\)"):
            HardData([[1, 2], [0, 0], [1, 2]], [0, 0, 5])

    @pytest.mark.parametrize(
        ("cells", "facies"),
        [
            ([[0, 1]], []),
            ([[0, 1], [0, 2]], [1]),
            ([0, 1], [1]),
            ([[0, 1, 2, 3]], [1]),
            ([[0.5, 1]], [1]),
            ([[0, 1]], [np.nan]),
            ([["a", "b"]], [1]),
            (None, [1]),
        ],
    )
    def test_shapes_and_values_that_do_not_fit_are_refused(self, cells, facies):
        with pytest.raises(CCWSIMError):
            HardData(cells, facies)

    @given(anything, anything)
    def test_any_value_gives_data_or_our_own_error(self, cells, facies):
        with suppress(CCWSIMError):
            assert HardData(cells, facies).n >= 0

    def test_lists_of_different_length_are_refused(self):
        with pytest.raises(CCWSIMError):
            HardData([[0, 1], [2]], [0, 1])

    def test_mismatches_are_counted_cell_by_cell(self):
        data = HardData([[0, 0], [0, 2], [1, 1]], [5, -3, 5])
        assert data.n_mismatched(np.array([[5, 0, 5], [0, 0, 0]])) == 2
        assert HardData().n_mismatched(np.zeros((2, 2))) == 0


class TestGrid:
    @given(
        st.integers(1, 30),
        st.integers(1, 30),
        st.tuples(st.floats(0.01, 100), st.floats(0.01, 100)),
        st.tuples(st.floats(-1e4, 1e4), st.floats(-1e4, 1e4)),
    )
    def test_centres_lie_in_their_own_cells(self, ny, nx, cell_size, origin):
        grid = Grid(ny, nx, cell_size, origin)
        cells = np.argwhere(np.ones(grid.shape))
        x, y = grid.centers_of(cells).T
        np.testing.assert_array_equal(grid.cells_of(x, y), cells)
        assert grid.holds(cells).all()

    def test_the_far_edge_belongs_to_the_last_cell_and_the_rest_is_outside(self):
        grid = Grid(2, 3, (10.0, 5.0), (100.0, 0.0))
        cells = grid.cells_of([100, 130, 130.1, 99.9], [0, 10, 5, 5])
        assert cells[:2].tolist() == [[0, 0], [1, 2]]
        assert grid.holds(cells).tolist() == [True, True, False, False]

    @pytest.mark.parametrize("size", [0, -1, 2.5, "3", None, True, np.nan])
    def test_sizes_must_be_counts(self, size):
        with pytest.raises(CCWSIMError, match="ny"):
            Grid(size, 4)
        with pytest.raises(CCWSIMError, match="nx"):
            Grid(4, size)

    @pytest.mark.parametrize("pair", [(0.0, 1.0), (1.0, -1.0), (np.nan, 1.0), (np.inf, 1.0), (1,)])
    def test_cells_must_have_two_positive_sides(self, pair):
        with pytest.raises(CCWSIMError, match="cell"):
            Grid(3, 3, cell_size=pair)

    @pytest.mark.parametrize("pair", [1.0, None, ("a", "b"), (None, 1.0), (10**400, 1)])
    def test_what_is_no_pair_of_numbers_is_refused(self, pair):
        with pytest.raises(CCWSIMError):
            Grid(3, 3, cell_size=pair)
        with pytest.raises(CCWSIMError):
            Grid(3, 3, origin=pair)

    @pytest.mark.parametrize("crs", ["", "EPSG:32632", "epsg:4326", "ESRI:102100", "WGS84"])
    def test_a_coordinate_system_is_a_code(self, crs):
        assert Grid(3, 3, crs=crs).crs == crs

    @pytest.mark.parametrize(
        "crs", ["32632", "UTM 32", "EPSG:abc", "EPSG:32632\0", 32632, None, " "]
    )
    def test_what_is_no_coordinate_system_is_refused(self, crs):
        with pytest.raises(CCWSIMError, match="is not a coordinate system; give a code"):
            Grid(3, 3, crs=crs)

    def test_a_pair_of_numbers_is_a_grid(self):
        for shape in ((7, 9), [7, 9], np.array([7, 9]), Grid(7, 9)):
            assert Grid.of(shape) == Grid(7, 9)

    @pytest.mark.parametrize(
        "shape",
        [
            5,
            (5,),
            (1, 2, 3, 4),
            (0, 1, 2),
            "ab",
            None,
            (0, 5),
            (2.5, 5),
            {1: 2, 3: 4},
            np.zeros((2, 2)),
        ],
    )
    def test_what_is_no_shape_is_refused(self, shape):
        with pytest.raises(CCWSIMError, match="grid"):
            Grid.of(shape)

    def test_an_array_without_dimensions_is_no_shape(self):
        with pytest.raises(CCWSIMError, match="grid_shape"):
            Grid.of(np.array(5))


class TestStudy:
    ti = TrainingImage(blobs((20, 30), 2))

    @pytest.mark.parametrize("seed", [-1, 1.0, None, "1", True, 2**63])
    def test_the_seed_must_be_a_whole_number(self, seed):
        with pytest.raises(CCWSIMError, match="seed"):
            Study(self.ti, Grid(9, 9), SMALL, seed=seed)

    @pytest.mark.parametrize("name", ["training_image", "grid", "parameters", "hard_data"])
    def test_other_types_are_refused_by_name(self, name):
        own = {"training_image": self.ti, "grid": Grid(9, 9), "parameters": SMALL}
        with pytest.raises(CCWSIMError, match=rf"{name} = \[1\] must be of type"):
            Study(**{**own, name: [1]})

    def test_data_outside_the_grid_are_named(self):
        data = HardData([[0, 0], [9, 3], [-1, 2]], [0, 1, 0])
        with pytest.raises(CCWSIMError, match=r"2 of 3 .*row -1, column 2, facies 0"):
            Study(self.ti, Grid(9, 9), SMALL, data)

    def test_data_of_an_unknown_facies_are_named(self):
        with pytest.raises(CCWSIMError, match=r"1 of 2 .*its facies are 0, 1\).*facies 7"):
            Study(self.ti, Grid(9, 9), SMALL, HardData([[0, 0], [1, 1]], [0, 7]))

    def test_a_template_larger_than_the_image_says_what_would_fit(self):
        with pytest.raises(CCWSIMError, match="use at most 20"):
            Study(self.ti, Grid(9, 9), Parameters(template_size=32, overlap_size=8))

    def test_facies_of_data_stand_where_the_codes_do(self):
        ti = TrainingImage(np.array([-4, 9, 100])[blobs((20, 20), 3)])
        data = HardData([[0, 0], [0, 1], [0, 2]], [100, -4, 9])
        assert Study(ti, Grid(9, 9), SMALL, data).facies_of_data.tolist() == [2, 0, 1]


@pytest.fixture(scope="module")
def ensemble() -> Ensemble:
    ti = TrainingImage(np.array([-4, 9, 100])[blobs((24, 31), 3)])
    data = HardData([[0, 0], [5, 11], [16, 2]], [100, -4, 9])
    return simulate(ti, (17, 12), SMALL, data, n_realizations=3, seed=4)


class TestEnsemble:
    def test_realizations_are_in_the_codes_of_the_image(self, ensemble):
        codes = ensemble.training_image.codes
        np.testing.assert_array_equal(ensemble.realizations, codes[ensemble.indices])
        assert ensemble.realizations.shape == (ensemble.n, 17, 12) == (3, 17, 12)

    def test_probability_is_the_share_of_realizations(self, ensemble):
        total = np.zeros((17, 12))
        for code in ensemble.training_image.codes:
            p = ensemble.probability(code)
            np.testing.assert_allclose(p, (ensemble.realizations == code).mean(axis=0))
            total += p
        np.testing.assert_allclose(total, 1.0)

    def test_probability_of_an_unknown_facies_is_refused(self, ensemble):
        with pytest.raises(CCWSIMError, match="facies = 3"):
            ensemble.probability(3)

    def test_proportions_are_counted_in_each_realization(self, ensemble):
        for own, realization in zip(ensemble.proportions, ensemble.realizations, strict=True):
            codes = ensemble.training_image.codes
            np.testing.assert_allclose(own, [np.mean(realization == code) for code in codes])

    def test_every_datum_was_met_in_one_of_three_ways(self, ensemble):
        ways = (ensemble.data_status == 0).sum(axis=1) + ensemble.n_resimulated + ensemble.n_forced
        assert (ways == ensemble.hard_data.n).all()
        np.testing.assert_array_equal(ensemble.n_mismatched, 0)

    @pytest.mark.parametrize("name", ["realizations", "indices", "cpu_seconds", "data_status"])
    def test_its_arrays_cannot_be_written(self, ensemble, name):
        with pytest.raises(ValueError, match="read-only"):
            getattr(ensemble, name)[0] = 0

    def test_cpu_time_was_taken_for_each_realization(self, ensemble):
        assert ensemble.cpu_seconds.shape == (3,)
        assert (ensemble.cpu_seconds > 0).all()


class TestArrays:
    @given(images)
    def test_the_smallest_integers_hold_every_value(self, array):
        small = smallest_integers(array)
        np.testing.assert_array_equal(small, array)
        for other in (np.uint8, np.int8, np.uint16, np.int16, np.uint32, np.int32):
            limits = np.iinfo(other)
            if limits.min <= array.min() and array.max() <= limits.max:
                assert small.itemsize <= np.dtype(other).itemsize

    @settings(max_examples=50)
    @given(hnp.arrays(float, 5, elements=st.floats(-1e6, 1e6)))
    def test_numbers_are_rounded_only_where_they_are_nearly_whole(self, values):
        far = np.abs(values - np.rint(values)) > 1e-3
        if far.any():
            with pytest.raises(CCWSIMError, match="whole number"):
                as_integers(values, "codes")
        else:
            np.testing.assert_array_equal(as_integers(values, "codes"), np.rint(values))

    def test_a_digest_depends_on_values_shape_and_type(self):
        a = noise((2, 6), 3)
        assert digest(a) == digest(a.copy(order="F"))
        different = [a, a.reshape(3, 4), a.astype(int), np.roll(a, 1), a.tolist()]
        assert len({digest(d) for d in different}) == len(different)


@pytest.mark.parametrize(
    "copied", [copy.copy, copy.deepcopy, lambda o: pickle.loads(pickle.dumps(o))]
)
def test_arrays_stay_read_only_in_copies(copied):
    image = TrainingImage(blobs((20, 30), 3), name="blobs", facies_names=["a", "b", "c"])
    secondary = Secondary(
        np.arange(600).reshape(20, 30) > 5, auxiliary=[Auxiliary(np.eye(9), np.eye(9))]
    )
    data = HardData([[3, 4], [7, 7]], [0, 2])
    assert copied(image) == image
    assert copied(image).facies_names == ("a", "b", "c")
    assert copied(data) == data
    auxiliary = copied(secondary).auxiliary[0]
    for noun in (copied(image), copied(data), auxiliary):
        arrays = [each for each in vars(noun).values() if isinstance(each, np.ndarray)]
        assert len(arrays) >= 2
        assert not any(array.flags.writeable for array in arrays)
