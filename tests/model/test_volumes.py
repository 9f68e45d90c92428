"""Test training image, grid, hard data, study and ensemble of volumes, and mixing with maps."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st
from hypothesis.extra import numpy as hnp

from ccwsim import CCWSIMError, Ensemble, Grid, HardData, Parameters, TrainingImage
from ccwsim.model.study import Study
from tests.small_images import noise

CODES = np.array([-4, 9, 100])
IMAGE = TrainingImage(CODES[noise((12, 20, 30), 3)], name="sand body")
P = Parameters((4, 8, 8), (1, 2, 2), (0, 1, 1))
volumes = hnp.arrays(
    np.int64,
    hnp.array_shapes(min_dims=3, max_dims=3, max_side=5),
    elements=st.integers(-(2**62), 2**62),
)
sides = st.integers(1, 9)


def ensemble_of(n: int = 4, shape: tuple[int, ...] = (5, 6, 7), **nouns) -> Ensemble:
    """Return an ensemble of independent random cells, which is faster than a simulation."""
    indices = noise((n, *shape), 3, seed=3)
    own = {
        "training_image": IMAGE,
        "grid": Grid(*shape[1:], (10.0, 10.0, 0.5), (100.0, 0.0, -8.0), nz=shape[0]),
        "parameters": P,
        "hard_data": HardData([[2, 3, 4]], [9]),
    }
    return Ensemble(
        study=Study(**{**own, **nouns}, checked=False),
        indices=indices,
        cpu_seconds=np.zeros(n),
        wall_seconds=0.0,
        data_status=np.zeros((n, 1), np.int16),
        numbers=np.arange(n),
    )


class TestTrainingImage:
    @given(volumes)
    def test_codes_and_indices_give_the_array_back(self, array):
        ti = TrainingImage(array)
        np.testing.assert_array_equal(ti.codes[ti.indices], array)
        assert ti.array.shape == ti.indices.shape == ti.shape == array.shape
        assert ti.indices.dtype == np.uint8
        for code, share in zip(ti.codes, ti.proportions, strict=True):
            assert share == np.mean(array == code)

    def test_it_says_how_many_cells_along_x_y_and_z(self):
        assert repr(IMAGE) == "TrainingImage('sand body', 30 × 20 × 12, 3 facies)"

    def test_one_layer_stays_a_volume(self):
        one, flat = TrainingImage(IMAGE.array[:1]), TrainingImage(IMAGE.array[0])
        assert (one.shape, one.n_dimensions) == ((1, 20, 30), 3)
        assert (flat.shape, flat.n_dimensions) == ((20, 30), 2)
        assert one.digest != flat.digest


class TestGrid:
    @given(
        *(sides, sides, sides),
        st.tuples(*[st.floats(0.01, 100)] * 3),
        st.tuples(*[st.floats(-1e4, 1e4)] * 3),
    )
    def test_centres_lie_in_their_own_cells(self, nz, ny, nx, cell_size, origin):
        grid = Grid(ny, nx, cell_size, origin, nz)
        assert (grid.shape, grid.n_cells) == ((nz, ny, nx), nz * ny * nx)
        cells = np.argwhere(np.ones(grid.shape))
        points = grid.centers_of(cells)
        np.testing.assert_array_equal(grid.cells_of(*points.T), cells)
        assert grid.holds(cells).all()
        for axis, along in enumerate(grid.axes):
            np.testing.assert_allclose(along[cells[:, 2 - axis]], points[:, axis])

    def test_the_far_edge_belongs_to_the_last_cell_and_the_rest_is_outside(self):
        grid = Grid(2, 3, (10.0, 5.0, 2.0), (0.0, 0.0, -10.0), nz=4)
        cells = grid.cells_of([30, 0, 0, 5], [10, 0, 0, 5], [-2, -10.1, -1.9, -10])
        assert cells.tolist() == [[3, 1, 2], [-1, 0, 0], [4, 0, 0], [0, 1, 0]]
        assert grid.holds(cells).tolist() == [True, False, False, True]

    def test_a_pair_leaves_z_at_one_from_zero(self):
        grid = Grid(2, 3, (10.0, 5.0), (7.0, 8.0), nz=4)
        assert (grid.cell_size, grid.origin) == ((10.0, 5.0, 1.0), (7.0, 8.0, 0.0))

    def test_it_is_written_as_it_can_be_made_again(self):
        for grid in (Grid(2, 3), Grid(2, 3, (1.0, 2.0, 3.0), nz=1)):
            assert eval(repr(grid)) == grid
        assert repr(Grid(2, 3)) == "Grid(ny=2, nx=3, cell_size=(1.0, 1.0), origin=(0.0, 0.0))"
        assert Grid(2, 3) != Grid(2, 3, nz=1)

    def test_three_numbers_are_a_grid(self):
        for shape in ((4, 7, 9), [4, 7, 9], np.array([4, 7, 9]), Grid(7, 9, nz=4)):
            assert Grid.of(shape) == Grid(7, 9, nz=4)

    @pytest.mark.parametrize("size", [0, -1, 2.5, "3", True, 2**31])
    def test_layers_must_be_a_count(self, size):
        with pytest.raises(CCWSIMError, match="nz"):
            Grid(3, 4, nz=size)

    @pytest.mark.parametrize("name", ["cell_size", "origin"])
    def test_three_numbers_belong_to_a_volume(self, name):
        with pytest.raises(CCWSIMError, match=rf"{name} .* along x and y; a third one needs nz"):
            Grid(3, 4, **{name: (1.0, 1.0, 1.0)})
        with pytest.raises(CCWSIMError, match=rf"{name} .* along x, y and z"):
            Grid(3, 4, **{name: (1.0, 1.0, 1.0, 1.0)}, nz=2)

    def test_points_must_have_as_many_coordinates_as_the_grid(self):
        with pytest.raises(CCWSIMError, match="4 layers: z of points"):
            Grid(3, 4, nz=4).cells_of([1], [1])
        with pytest.raises(CCWSIMError, match="a map: leave out z"):
            Grid(3, 4).cells_of([1], [1], [1])
        with pytest.raises(CCWSIMError, match="x, y and z of points must be lists"):
            Grid(3, 4, nz=4).cells_of([1], [1], [1, 2])
        with pytest.raises(CCWSIMError, match=r"\(1, 2\) do not suit a grid of 4 × 3 × 4.*layer"):
            Grid(3, 4, nz=4).holds(np.zeros((1, 2), int))
        with pytest.raises(CCWSIMError, match="row and column"):
            Grid(3, 4).centers_of(np.zeros((1, 3), int))

    @given(hnp.arrays(float, (5, 3), elements=st.floats(-1e6, 1e6)))
    def test_a_fitted_grid_holds_the_points(self, points):
        grid = Grid.fit(points)
        assert grid.holds(grid.cells_of(*points.T)).all()
        assert grid.cell_size[0] == grid.cell_size[1]
        assert max(grid.shape) <= 400

    def test_a_fitted_grid_has_the_layers_and_the_cell_that_are_asked_for(self):
        points = np.array([[0.0, 0, -30], [1000, 500, -10]])
        assert Grid.fit(points, shape=(20, 50, 100)).shape == (20, 50, 100)
        assert Grid.fit(points, cell_size=(10, 10, 2)).cell_size == (10.0, 10.0, 2.0)
        assert 10 <= Grid.fit(points).nz <= 60
        with pytest.raises(CCWSIMError, match="layers, rows and columns"):
            Grid.fit(points, shape=(50, 100))
        with pytest.raises(CCWSIMError, match="does not suit points of x and y"):
            Grid.fit(points[:, :2], shape=(20, 50, 100))


class TestHardData:
    @given(st.dictionaries(st.tuples(sides, sides, sides), st.integers(-3, 3), min_size=1))
    def test_data_are_sorted_by_layer_row_and_column(self, known):
        data = HardData(list(known), list(known.values()))
        assert data.n_dimensions == 3
        assert data.triples == tuple((*cell, known[cell]) for cell in sorted(known))

    def test_a_clash_says_the_layer(self):
        with pytest.raises(CCWSIMError, match=r"layer 3, row 1, column 2 \(no. 1 says 0, no. 2"):
            HardData([[3, 1, 2], [3, 1, 2], [4, 1, 2]], [0, 5, 5])

    def test_mismatches_are_counted_cell_by_cell(self):
        volume = noise((3, 4, 5), 3)
        cells = np.argwhere(np.ones(volume.shape))[::7]
        data = HardData(cells, np.ones(len(cells), int))
        assert data.n_mismatched(volume) == sum(volume[tuple(cell)] != 1 for cell in cells)
        assert HardData().n_mismatched(volume) == 0

    def test_an_array_and_a_table_give_the_same_data(self):
        pandas = pytest.importorskip("pandas")
        grid = Grid(4, 5, (10.0, 20.0, 0.5), (100.0, 200.0, -3.0), nz=6)
        known = np.full(grid.shape, np.nan)
        known[2, 3, 4], known[5, 0, 1] = 7, 3
        cells = np.argwhere(~np.isnan(known))
        x, y, z = grid.centers_of(cells).T
        layer, row, column = cells.T
        wanted = ((2, 3, 4, 7), (5, 0, 1, 3))
        world = pandas.DataFrame({"Z": z, "X": x, "Y": y, "Facies": [7, 3]})
        own = pandas.DataFrame({"layer": layer, "row": row, "col": column, "facies": [7, 3]})
        for given_as in (known, world, own, (cells, [7, 3])):
            assert HardData.of(given_as, grid).triples == wanted
        with pytest.raises(CCWSIMError, match="the table has no column of heights"):
            HardData.of(world.drop(columns="Z"), grid)

    def test_a_table_with_z_serves_a_map_too(self):
        pandas = pytest.importorskip("pandas")
        table = pandas.DataFrame({"x": [1.5], "y": [0.5], "z": [9.0], "facies": [1]})
        assert HardData.of(table, Grid(2, 3)).triples == ((0, 1, 1),)

    def test_data_outside_are_named_with_their_layer(self):
        data = HardData([[0, 0, 0], [6, 1, 2]], [-4, 9])
        with pytest.raises(CCWSIMError, match=r"6 layers, 4 rows and 5 columns: layer 6, row 1"):
            data.check(Grid(4, 5, nz=6), IMAGE)

    def test_data_of_a_map_and_of_a_volume_are_told_apart(self):
        with pytest.raises(CCWSIMError, match="volume of 6 layers: give layer, row and column"):
            HardData([[0, 0]], [9]).check(Grid(4, 5, nz=6), IMAGE)
        with pytest.raises(CCWSIMError, match="the grid is a map: give the grid nz"):
            HardData([[0, 0, 0]], [9]).check(Grid(4, 5), IMAGE)

    def test_no_data_go_with_both(self):
        for grid in (Grid(4, 5), Grid(4, 5, nz=6)):
            HardData().check(grid, IMAGE)
            HardData(np.empty((0, 3)), []).check(grid, IMAGE)
            assert HardData.of(np.full(grid.shape, np.nan), grid).n == 0
        assert HardData(np.empty((0, 3)), []).digest == HardData().digest


class TestStudy:
    grid = Grid(25, 35, nz=14)

    def test_what_fits_together_is_a_study(self):
        data = HardData([[13, 24, 34], [0, 0, 0]], [100, -4])
        study = Study(IMAGE, self.grid, P, data)
        assert study.facies_of_data.tolist() == [0, 2]

    def test_no_data_have_as_many_numbers_as_the_grid(self):
        flat, shape = TrainingImage(IMAGE.array[0]), (0, 3)
        assert Study(IMAGE, self.grid, P).hard_data.cells.shape == shape
        study = Study(flat, Grid(25, 35), Parameters(8, 2, 1), HardData(np.empty(shape), []))
        assert study.hard_data.cells.shape == (0, 2)

    def test_a_map_with_a_volume_says_which_is_which_and_what_to_do(self):
        flat = TrainingImage(IMAGE.array[0])
        with pytest.raises(CCWSIMError, match=r"image of 30 × 20 cells is a map.*35 × 25 × 14"):
            Study(flat, self.grid, P)
        said = r"volume of 30 × 20 × 12 .*35 × 25 is a map: give the grid nz, or .*ti.array\[k\]"
        with pytest.raises(CCWSIMError, match=said):
            Study(IMAGE, Grid(25, 35), P)

    def test_sizes_along_three_axes_need_a_volume(self):
        with pytest.raises(CCWSIMError, match=r"template_size = \(4, 8, 8\) .* a map: .* as 8"):
            Study(TrainingImage(IMAGE.array[0]), Grid(25, 35), P)

    @pytest.mark.parametrize(
        ("p", "axis"),
        [
            (Parameters(template_size=32), "z"),
            (Parameters((8, 24, 24), 4), "y"),
            (Parameters((8, 16, 40), (4, 8, 8)), "x"),
            (Parameters((14, 8, 8), (2, 2, 2), (1, 1, 1)), "z"),
            (Parameters(64, 16, 4), "z"),
            (Parameters(13, 6, 2, method="ccsim"), "z"),
        ],
    )
    def test_a_template_larger_than_the_image_names_the_axis_and_sizes_that_fit(self, p, axis):
        with pytest.raises(CCWSIMError, match=f"along {axis} is larger") as refused:
            Study(IMAGE, self.grid, p)
        sizes = dict(re.findall(r"(\w+)=(\([\d, ]+\))", str(refused.value)))
        assert sizes
        fitting = replace(p, **{name: eval(value) for name, value in sizes.items()})
        template = Study(IMAGE, self.grid, fitting).parameters.along(IMAGE.shape).template
        assert all(size <= n for size, n in zip(template, IMAGE.shape, strict=True))

    @given(st.integers(1, 12), st.sampled_from([8, 16, 32]), st.integers(0, 3))
    def test_the_sizes_proposed_for_thin_images_are_accepted(self, nz, template, level):
        image = TrainingImage(IMAGE.array[:nz])
        p = Parameters(template, template // 2, min(level, template.bit_length() - 2))
        for _ in range(2):
            try:
                Study(image, self.grid, p)
                return
            except CCWSIMError as refused:
                sizes = re.findall(r"(\w+)=(\([\d, ]+\))", str(refused))
                p = replace(p, **{name: eval(value) for name, value in sizes})
        pytest.fail(f"the sizes proposed are refused: {p}")


class TestEnsemble:
    def test_realizations_are_volumes_of_codes(self):
        ensemble = ensemble_of()
        np.testing.assert_array_equal(ensemble.realizations, CODES[ensemble.indices])
        assert ensemble[1].shape == (5, 6, 7)
        assert ensemble[1:3].indices.shape == (2, 5, 6, 7)
        assert repr(ensemble) == "Ensemble(4 realizations of 7 × 6 × 5)"
        assert repr(ensemble[:1]) == "Ensemble(1 realization of 7 × 6 × 5)"

    def test_shares_are_counted_in_each_realization_and_each_cell(self):
        ensemble = ensemble_of()
        for k, code in enumerate(CODES):
            own = ensemble.realizations == code
            np.testing.assert_allclose(ensemble.probability(code), own.mean(axis=0))
            np.testing.assert_allclose(ensemble.proportions[:, k], own.mean(axis=(1, 2, 3)))
        wrong = [r[2, 3, 4] != 9 for r in ensemble.realizations]
        np.testing.assert_array_equal(ensemble.n_mismatched, wrong)

    def test_an_array_of_xarray_has_z_in_world_units(self):
        pytest.importorskip("xarray")
        ensemble = ensemble_of()
        array = ensemble.to_xarray()
        assert array.dims == ("realization", "z", "y", "x")
        np.testing.assert_allclose(array.z, [-7.75, -7.25, -6.75, -6.25, -5.75])
        found = array.sel(x=145, y=35, z=-6.75).values
        np.testing.assert_array_equal(found, ensemble.realizations[:, 2, 3, 4])

    def test_pictures_show_the_middle_layer_and_say_so(self):
        ensemble = ensemble_of()
        assert "7 × 6 × 5 cells, layer 2 (of 0 to 4)" in ensemble._repr_html_()
        chart = ensemble.plot([1])
        assert chart.layout.annotations[0].text == "Realization 2, layer 2 (of 0 to 4)"
        np.testing.assert_array_equal(chart.data[0].z, ensemble.indices[1, 2])
        assert (chart.data[1].x, chart.data[1].y) == ((145.0,), (35.0,))
        off = ensemble_of(hard_data=HardData([[0, 3, 4]], [9]))
        assert len(off.plot([0]).data) == 1

    def test_pictures_of_image_and_data_too(self):
        assert "30 × 20 × 12 cells, layer 6 (of 0 to 11)" in IMAGE._repr_html_()
        np.testing.assert_array_equal(IMAGE.plot().data[0].z, IMAGE.indices[6])
        data = HardData([[0, 1, 1], [4, 2, 2], [4, 3, 5], [9, 0, 0]], [9, 9, 100, 9])
        assert "layers 0 to 9 (layer 4 drawn), rows 0 to 3" in data._repr_html_()
        chart = data.plot()
        assert chart.layout.title.text == "Hard data (layer 4 drawn)"
        assert [(*d.x, *d.y) for d in chart.data] == [(2, 2), (5, 3)]
