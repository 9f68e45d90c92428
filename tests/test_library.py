"""Test that the library accepts and returns objects of NumPy, pandas and xarray."""

from __future__ import annotations

import inspect
import re
from io import BytesIO
from pathlib import Path
from typing import get_args, get_type_hints

import gstools
import numpy as np
import pytest

import ccwsim
from ccwsim import CCWSIMError, Ensemble, Grid, HardData, Parameters, TrainingImage, simulate
from ccwsim.io import read_grid, realizations_as_bytes

pd = pytest.importorskip("pandas")
xarray = pytest.importorskip("xarray")

STRIPES = np.tile([[0], [0], [1], [1]], (16, 64))
P = Parameters(template_size=16, overlap_size=4, wavelet_level=1)
GRID = Grid(40, 50, cell_size=(10.0, 20.0), origin=(350000.0, 4505000.0))
CELLS, FACIES = [[5, 7], [30, 41]], [1, 0]


def run(**given) -> Ensemble:
    return simulate(**{"training_image": STRIPES, "grid_shape": GRID, "parameters": P} | given)


def test_an_array_is_taken_for_a_training_image():
    assert run().digest == run(training_image=TrainingImage(STRIPES)).digest
    with pytest.raises(CCWSIMError, match=r"shape \(ny, nx\)"):
        run(training_image=np.zeros(5))


def tables():
    x, y = GRID.centers_of(np.array(CELLS)).T
    yield pd.DataFrame({"X": x, "Y": y, "Facies": FACIES})
    yield pd.DataFrame({"well": ["a", "b"], "facies": FACIES, "row": [5, 30], "col": [7, 41]})
    table = pd.DataFrame({"Easting [m]": x, "Northing [m]": y, "lith": FACIES, "hole": ["a", "b"]})
    yield table
    yield table.to_records(index=False)
    yield {"Rechtswert": x.tolist(), "Hochwert": y.tolist(), "Fazies": ["1", b"0"]}
    yield table.convert_dtypes().astype({"lith": "object"})
    grid = np.full(GRID.shape, np.nan)
    grid[tuple(np.transpose(CELLS))] = FACIES
    yield grid
    yield np.ma.masked_invalid(grid)
    yield np.where(np.isnan(grid), -1, grid).astype(int)
    yield np.where(np.isnan(grid), -9999, grid)
    rows = GRID.axes[1][::-1]
    yield xarray.DataArray(grid[::-1].T, {"y": rows}, ("x", "y"))
    yield CELLS, FACIES
    yield HardData(CELLS, FACIES)


KINDS = (
    *("x, y", "row, col", "guessed", "records", "dict", "nullable"),
    *("gaps", "masked", "-1", "-9999", "DataArray", "pair", "noun"),
)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("data", [*tables()], ids=KINDS)
def test_data_of_every_kind_are_the_same_data(data):
    ensemble = run(hard_data=data, n_realizations=2)
    assert ensemble.hard_data.triples == HardData(CELLS, FACIES).triples
    assert not ensemble.n_mismatched.any()


def test_names_of_facies_stand_for_their_codes():
    image = TrainingImage(STRIPES)
    names = [image.facies_names[list(image.codes).index(code)].upper() for code in FACIES]
    table = pd.DataFrame({"row": [c[0] for c in CELLS], "col": [c[1] for c in CELLS]})
    for data in (table.assign(facies=names), (CELLS, names)):
        found = HardData.of(data, GRID, image)
        assert found.triples == HardData(CELLS, FACIES).triples
        with pytest.raises(CCWSIMError, match=r"names are: none|no facies"):
            HardData.of(data, GRID)
    with pytest.raises(CCWSIMError, match="'clay' is not a facies name"):
        run(hard_data=(CELLS, ["clay", *names[1:]]))


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (pd.DataFrame({"easting": [1.0], "facies": [0]}), "the table needs columns x, y, facies"),
        (pd.DataFrame([[5, 5, 1]], columns=["x", "x", "facies"]), "column 'x' has the shape"),
        (pd.DataFrame({"x": [], "y": [], "facies": []}), "the table has no rows"),
        ({}, "the table has no columns"),
        (np.zeros((3, 3)), "does not have the grid's shape"),
        ("wells.csv", r"ccwsim.read_hard_data\('wells.csv', grid\)"),
        (pd.DataFrame({"x": ["here"], "y": [0], "facies": [0]}), "row 1: 'here' is not a number"),
    ],
)
def test_other_data_are_refused_in_words(data, said):
    with pytest.raises(CCWSIMError, match=said):
        run(hard_data=data)


def test_tables_take_the_options_of_files():
    x, y = GRID.centers_of(np.array(CELLS)).T
    table = pd.DataFrame({"a": x, "b": y, "top": [1, 2], "porosity": [0.3, 0.1]})
    data = ccwsim.read_hard_data(table, GRID, x="a", y="b", facies="porosity", threshold=0.2)
    assert data == HardData(CELLS, FACIES)
    notes = ccwsim.io.import_hard_data(table[["a", "b", "porosity"]], GRID, threshold=0.2).notes
    assert any("a and b are read as x and y" in note for note in notes)


def test_rows_without_a_value_are_left_out_of_tables_as_of_files():
    x, y = GRID.centers_of(np.array(CELLS)).T
    more = {"x": [*x, 1.0], "y": [*y, 1.0]}
    kind = [("x", float), ("y", float), ("facies", int)]
    masked = np.ma.array([*zip(*more.values(), [*FACIES, 5], strict=True)], kind)
    masked.mask[2] = (False, False, True)
    for facies in ([*FACIES, np.nan], [*FACIES, None], ["1", "0", ""], [*FACIES, -9999]):
        with pytest.warns(UserWarning, match="Rows without a value, left out: 1"):
            assert HardData.of(pd.DataFrame({**more, "facies": facies}), GRID).n == 2
    with pytest.warns(UserWarning, match="Rows without a value, left out: 1"):
        assert HardData.of(masked, GRID) == HardData(CELLS, FACIES)
    with pytest.warns(UserWarning, match="a and b are read as x and y"):
        HardData.of({"a": x, "b": y, "c": FACIES}, GRID)


@pytest.mark.parametrize(
    "table",
    [
        {"x": None, "y": None, "facies": None},
        {"x": [[1], [1, 2]], "y": [1, 2], "facies": [1, 2]},
        {"x": [1, 2], "y": [1], "facies": [1, 2]},
        {"x": [1j], "y": [1], "facies": [1]},
        {"x": [1], "y": [1], "facies": [object()]},
        {1: [1], 2: [1]},
        np.zeros(0, [("x", float), ("facies", int)]),
        np.zeros((2, 2), [("x", float), ("facies", int)]),
        xarray.Dataset({"facies": (("y", "x"), np.eye(3))}),
    ],
    ids=["none", "ragged", "lengths", "complex", "object", "numbers", "empty", "axes", "dataset"],
)
def test_a_table_that_is_none_is_said_in_words(table):
    with pytest.raises(CCWSIMError, match="the table"):
        HardData.of(table, GRID, TrainingImage(STRIPES))


def test_a_table_of_cells_may_be_a_training_image():
    row, column = np.indices((4, 5)).reshape(2, -1)
    table = pd.DataFrame({"x": column * 10.0, "y": row * 10.0, "facies": (row + column) % 2})
    image = ccwsim.read_training_image(table.sample(frac=1, random_state=0))
    np.testing.assert_array_equal(np.asarray(image), np.indices((4, 5)).sum(axis=0) % 2)


def test_columns_of_a_volume_have_heights():
    grid = Grid(10, 10, nz=8)
    wells = pd.DataFrame({"X": [2.5, 2.5], "Y": [3.5, 3.5], "Elev": [1.5, 4.5], "Litho": [0, 1]})
    assert HardData.of(wells, grid).triples == ((1, 3, 2, 0), (4, 3, 2, 1))
    with pytest.raises(CCWSIMError, match="no column of heights"):
        HardData.of(wells.drop(columns="Elev"), grid)


def test_a_grid_of_data_may_be_given_by_its_shape_and_minus_one_may_be_a_facies():
    array = np.full((200, 200), -1)
    array[3, 4], array[9, 8] = 1, 0
    assert HardData.of(array, (200, 200)).triples == ((3, 4, 1), (9, 8, 0))
    image = TrainingImage([[-1, 0, 1]])
    assert HardData.of(array, (200, 200), image).n == array.size
    with pytest.raises(CCWSIMError, match=r"does not have the grid's shape \(20, 30\)"):
        HardData.of(array, (20, 30))


def test_names_of_images_and_data_lead_to_the_two_calls_that_read_them():
    for name in ("channels", Path("channels")):
        with pytest.raises(CCWSIMError) as refused:
            run(training_image=name)
        assert "ccwsim.datasets.load('channels')" in str(refused.value)
        assert "ccwsim.read_training_image('channels')" in str(refused.value)
    with pytest.raises(CCWSIMError, match=r"datasets.load_hard_data\('wells'\)"):
        run(hard_data="wells")


def test_a_training_image_is_an_array_and_a_value():
    image, same = TrainingImage(STRIPES), TrainingImage(STRIPES.astype(float))
    np.testing.assert_array_equal(np.asarray(image), STRIPES)
    assert np.asarray(image, dtype=float).dtype == float
    assert np.array(image).flags.writeable
    assert not np.asarray(image).flags.writeable
    assert image == same
    assert len({image, same}) == 1
    assert image != TrainingImage(STRIPES, facies_names=["mud", "sand"])
    assert image != TrainingImage(STRIPES + 1)
    with pytest.raises(TypeError, match=r"np\.asarray"):
        assert image == 3
    assert HardData(CELLS, FACIES) == HardData(CELLS[::-1], FACIES[::-1])
    assert len({HardData(CELLS, FACIES), HardData(CELLS, FACIES), HardData()}) == 2


def test_continuous_arrays_become_images_by_a_threshold_or_classes():
    model = gstools.Exponential(dim=2, var=1, len_scale=4)
    field = gstools.SRF(model, seed=3).structured([range(30), range(20)])  # the first axis is x
    image = TrainingImage.from_array(np.transpose(field), threshold=0.0, name="g")
    assert (image.shape, image.name) == ((20, 30), "g")
    np.testing.assert_array_equal(np.asarray(image), np.transpose(field) >= 0)
    thirds = TrainingImage.from_array(field, classes=3, facies_names=["a", "b", "c"])
    assert thirds.facies_names == ("a", "b", "c")
    assert TrainingImage.from_array(field, classes=[0.0]).n_facies == 2
    assert TrainingImage.from_array(STRIPES) == TrainingImage(STRIPES)
    with pytest.raises(CCWSIMError, match="look continuous; give threshold="):
        TrainingImage.from_array(field)
    with pytest.raises(CCWSIMError, match=r"use TrainingImage\.from_array \(continuous=True"):
        TrainingImage(field)
    with pytest.raises(CCWSIMError, match="not both"):
        TrainingImage.from_array(field, threshold=0, classes=2)


@pytest.mark.parametrize("missing", [np.nan, -9999, -999.25])
def test_unknown_cells_of_an_image_are_known(missing):
    array = STRIPES.astype(float)
    array[3, 4] = missing
    assert np.argwhere(~TrainingImage.from_array(array, threshold=0.5).known).tolist() == [[3, 4]]
    masked = TrainingImage.from_array(np.ma.masked_equal(STRIPES, 1))
    assert np.array_equal(masked.known, STRIPES != 1)
    if missing == -9999:
        assert -9999 in TrainingImage.from_array(array, classes="codes").codes


@pytest.mark.parametrize("axes", [("y", "x"), ("x", "y"), ("northing", "easting"), ("lon", "lat")])
@pytest.mark.parametrize("step", [10.0, -10.0])
def test_axes_of_a_dataarray_are_obeyed(axes, step):
    image = np.random.default_rng(2).integers(0, 2, (6, 9))
    along_x = {"x", "easting", "lon"}
    transposed = axes[0] in along_x
    north = axes[1] if transposed else axes[0]
    values = (
        (image.T if transposed else image)
        if step > 0
        else np.flip(image.T if transposed else image, 1 if transposed else 0)
    )
    array = xarray.DataArray(values, {north: step * np.arange(6)}, axes)
    for taken in (TrainingImage(array), TrainingImage.from_array(array)):
        np.testing.assert_array_equal(np.asarray(taken), image)


@pytest.mark.parametrize("noun", [TrainingImage, HardData, Ensemble, Grid, Parameters])
def test_what_a_noun_returns_has_a_type(noun):
    members = inspect.getmembers(noun, lambda member: isinstance(member, property))
    functions = [(name, member.fget) for name, member in members]
    functions += inspect.getmembers(noun, inspect.isfunction)
    returned = {n: str(inspect.signature(f).return_annotation) for n, f in functions}
    assert [name for name, said in returned.items() if re.search(r"\bAny\b", said)] == []


def test_numbers_for_each_axis_methods_and_directions_have_types():
    hints = get_type_hints(Parameters)
    for name in ("template_size", "overlap_size", "wavelet_level"):
        assert hints[name] == int | tuple[int, int, int]
    assert set(get_args(hints["method"])) == {"ccwsim", "ccsim", "ms-ccsim"}
    assert get_type_hints(Grid.shape.fget)["return"] == tuple[int, ...]
    assert "Literal['E-W', 'N-S'" in str(ccwsim.metrics.Direction)


def test_a_drawn_seed_can_be_given_again():
    one, other = run(seed=None), run(seed=None)
    assert one.seed != other.seed
    assert run(seed=one.seed).digest == one.digest
    assert run(seed=np.int64(3), n_realizations=np.uint8(1)).digest == run(seed=3).digest


def test_an_ensemble_is_a_sequence_of_its_realizations():
    ensemble = run(n_realizations=4, training_image=STRIPES * 7, hard_data=(CELLS, [7, 0]))
    assert len(ensemble) == 4
    assert ensemble.shape == np.shape(ensemble) == (4, 40, 50)
    assert [r.tolist() for r in ensemble] == ensemble.realizations.tolist()
    np.testing.assert_array_equal(np.asarray(ensemble), ensemble.realizations)
    np.testing.assert_array_equal(ensemble[-1], ensemble.realizations[3])
    assert set(np.unique(ensemble[0])) == {0, 7}
    with pytest.raises(IndexError):
        ensemble[4]


@pytest.mark.parametrize("which", [slice(1, 3), [1, 2], np.array([False, True, True, False])])
def test_some_realizations_are_an_ensemble(which):
    ensemble = run(n_realizations=4, hard_data=(CELLS, FACIES), keep_sources=True)
    some = ensemble[which]
    assert some.numbers.tolist() == [1, 2]
    np.testing.assert_array_equal(some.realizations, ensemble.realizations[1:3])
    np.testing.assert_array_equal(some.data_status, ensemble.data_status[1:3])
    assert ensemble.sources is not None
    np.testing.assert_array_equal(some.sources, ensemble.sources[1:3])
    assert not some.realizations.flags.writeable


def test_realizations_on_disk_are_read_a_few_at_a_time(tmp_path):
    ensemble = run(n_realizations=3, out=tmp_path / "all.npy")
    some = ensemble[1:]
    np.testing.assert_array_equal(some[0], np.load(tmp_path / "all.npy")[1])
    assert run(n_realizations=3)[1:].digest == some.digest


def test_hard_data_of_a_file_are_read_for_rows_and_columns():
    file = b"x,y,facies\n10.5,2.5,1\n"
    data = ccwsim.read_hard_data(BytesIO(file), (8, 16))
    assert data.triples == ((2, 10, 1),)
    with pytest.raises(CCWSIMError, match="grid_shape"):
        ccwsim.read_hard_data(BytesIO(file), (8,))


@pytest.mark.parametrize("kind", ["gslib", "sgems", "dat"])
def test_realizations_keep_their_place_in_the_world(kind):
    file = BytesIO(realizations_as_bytes(run(n_realizations=2), kind))
    file.name = f"realizations.{kind}"
    summary = ccwsim.io.inspect(file)
    assert (summary.cell_size, summary.origin) == (GRID.cell_size, GRID.origin)
    file.seek(0)
    back = read_grid(file, variable="realization_2")
    np.testing.assert_array_equal(np.squeeze(back), run(n_realizations=2)[1])


def test_a_grid_of_unit_cells_has_the_header_that_every_program_reads():
    assert realizations_as_bytes(run(grid_shape=(40, 50)), "sgems").startswith(b"50 40 1\n")
