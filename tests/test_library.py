"""The library takes and gives what NumPy and pandas do."""

from __future__ import annotations

from io import BytesIO

import numpy as np
import pytest

import ccwsim
from ccwsim import CCWSIMError, Ensemble, Grid, HardData, Parameters, TrainingImage, simulate
from ccwsim.io import read_grid, realizations_as_bytes

pd = pytest.importorskip("pandas")

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
    grid = np.full(GRID.shape, np.nan)
    grid[tuple(np.transpose(CELLS))] = FACIES
    yield grid
    yield CELLS, FACIES
    yield HardData(CELLS, FACIES)


@pytest.mark.parametrize("data", [*tables()], ids=["x, y", "row, col", "gaps", "pair", "noun"])
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
        with pytest.raises(CCWSIMError, match="names are: none"):
            HardData.of(data, GRID)
    with pytest.raises(CCWSIMError, match="'clay' is not a facies name"):
        run(hard_data=(CELLS, ["clay", *names[1:]]))


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (pd.DataFrame({"easting": [1.0], "facies": [0]}), "easting, facies: rename"),
        (np.zeros((3, 3)), "does not have the grid's shape"),
        ("wells.csv", "not an array of real numbers"),
        (pd.DataFrame({"x": ["here"], "y": [0], "facies": [0]}), "x of points"),
    ],
)
def test_other_data_are_refused_in_words(data, said):
    with pytest.raises(CCWSIMError, match=said):
        run(hard_data=data)


def test_a_drawn_seed_can_be_given_again():
    one, other = run(seed=None), run(seed=None)
    assert one.seed != other.seed
    assert run(seed=one.seed).digest == one.digest
    assert run(seed=np.int64(3), n_realizations=np.uint8(1)).digest == run(seed=3).digest


def test_an_ensemble_is_a_sequence_of_its_realizations():
    ensemble = run(n_realizations=4, training_image=STRIPES * 7, hard_data=(CELLS, [7, 0]))
    assert len(ensemble) == 4
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
