"""Test that written realizations are read back as the same ensemble."""

from __future__ import annotations

from dataclasses import fields
from io import BytesIO

import numpy as np
import pytest

import ccwsim
from ccwsim import (
    Auxiliary,
    CCWSIMError,
    Ensemble,
    Grid,
    Parameters,
    Secondary,
    TrainingImage,
    simulate,
)
from ccwsim.io import read_realizations, realizations_as_bytes
from ccwsim.model.study import Study
from tests.io import sample_files as sample


def npz_of(drop: tuple[str, ...] = (), **changes) -> BytesIO:
    """Return the npz file of the sample with members changed or left out."""
    with np.load(BytesIO(sample.realizations("npz"))) as saved:
        members = {key: saved[key] for key in saved.files if key not in drop}
    return BytesIO(sample.npz(**{**members, **changes}))


def test_an_npz_is_read_as_the_ensemble_that_was_written(tmp_path):
    e = sample.ensemble()
    ccwsim.write_realizations(tmp_path / "out.npz", e)
    back = ccwsim.read_realizations(tmp_path / "out.npz")
    assert back.digest == e.digest
    assert back.training_image.digest == e.training_image.digest
    assert back.training_image.facies_names == ("mud", "sand", "lime")
    assert back.training_image.name == "sample"
    assert back.hard_data.triples == e.hard_data.triples
    for name in ("grid", "parameters", "seed", "wall_seconds", "revised", "sources"):
        assert getattr(back, name) == getattr(e, name)
    for name in ("indices", "cpu_seconds", "data_status", "numbers"):
        np.testing.assert_array_equal(getattr(back, name), getattr(e, name))
        assert not getattr(back, name).flags.writeable
    assert realizations_as_bytes(back, "npz") == realizations_as_bytes(e, "npz")


def test_every_field_of_an_ensemble_is_written_or_named_here():
    inputs = ["training_image", "grid", "parameters", "hard_data", "seed", "secondary"]
    assert {f.name for f in fields(Study)} - {*inputs} == {"checked", "inactive_data"}
    known = [
        "study",
        "indices",
        "cpu_seconds",
        "wall_seconds",
        "data_status",
        "numbers",
        "revised",
        "values",
    ]
    assert {f.name for f in fields(Ensemble)} - {*known} == {"sources"}


def with_secondary():
    active = np.ones((40, 50), bool)
    active[:9] = False
    trend = np.tile(np.linspace(0, 1, 64)[:, None], (1, 64))
    auxiliary = Auxiliary(trend, trend[:40, :50], 0.5)
    secondary = Secondary(active, {1: 0.4}, [auxiliary], soft_weight=0.5)
    stripes = np.tile([[0], [0], [1], [1]], (16, 64))
    return simulate(stripes, (40, 50), Parameters(16, 4, 1), None, 2, secondary=secondary)


def test_secondary_information_is_read_back():
    e = with_secondary()
    back = read_realizations(BytesIO(realizations_as_bytes(e, "npz")))
    assert back.digest == e.digest
    assert back.secondary.digest == e.secondary.digest


@pytest.mark.parametrize("kind", ["gslib", "sgems", "dat", "grdecl", "vti", "tif", "nc"])
def test_inactive_cells_are_read_back_from_every_format(kind):
    pytest.importorskip({"tif": "rasterio", "nc": "xarray"}.get(kind, "numpy"))
    e = with_secondary()
    back = read_realizations(BytesIO(realizations_as_bytes(e, kind)), e.training_image)
    assert np.array_equal(back.active, e.active)
    assert np.array_equal(back.realizations, e.realizations, equal_nan=True)


def test_a_file_of_an_older_version_is_read_with_its_codes_alone_or_an_image():
    new = ("training_image", "image_name", "facies_names", "wall_seconds")
    back = read_realizations(npz_of(new))
    np.testing.assert_array_equal(back.realizations, sample.ensemble().realizations)
    assert back.training_image.array.tolist() == [[0, 1, 2]]
    assert (back.seed, back.hard_data.n, back.revised) == (42, 4, False)
    image = sample.ensemble().training_image
    assert read_realizations(npz_of(new), image).training_image is image


@pytest.mark.parametrize("kind", ["gslib", "sgems", "dat"])
def test_columns_of_a_text_grid_are_realizations(kind):
    e = sample.ensemble()
    back = read_realizations(BytesIO(sample.realizations(kind)), e.training_image)
    assert back.digest == e.digest
    assert back.grid == e.grid
    assert back.revised
    assert np.isnan(back.cpu_seconds).all()


def test_an_array_that_was_streamed_is_read_with_row_0_at_the_south():
    stack = sample.ensemble().realizations * 7
    back = read_realizations(BytesIO(sample.npy(stack)))
    np.testing.assert_array_equal(back.realizations, stack)
    assert back.training_image.codes.tolist() == [0, 7, 14]
    assert back.grid == Grid(3, 4)


def test_rows_of_a_grid_from_the_north_are_turned():
    back = read_realizations(BytesIO(sample.esri()))
    assert back.realizations.tolist() == [sample.FACIES.tolist()]


@pytest.mark.parametrize(
    ("file", "said"),
    [
        (npz_of(("realizations",)), "no realizations"),
        (npz_of(realizations=np.zeros((3, 4), int)), "no realizations"),
        (npz_of(realizations=np.full((2, 3, 4), 0.5)), "0.5 is not a whole number"),
        (npz_of(cpu_seconds=np.zeros(3)), r"cpu_seconds has shape \(3,\), not \(2,\)"),
        (npz_of(met_by=np.zeros((2, 1), np.int16)), "met_by has shape"),
        (npz_of(numbers=np.array([-1, 0])), "numbers: -1 is too small"),
        (npz_of(seed=np.array([1, 2])), "seed must be one value"),
        (npz_of(seed=np.array(-4)), "seed = -4"),
        (npz_of(cell_size=np.array([0.0, 1.0])), "must be positive"),
        (npz_of(origin=np.array(3.0)), "grid origin"),
        (npz_of(hard_cells=np.array([[9, 9], [1, 1], [2, 0], [2, 3]])), "outside the grid"),
        (npz_of(parameters=np.array("{")), "not JSON"),
        (npz_of(facies_names=np.array("mud")), "facies_names must be a list"),
        (npz_of(facies_names=np.array(["a"])), "1 were given for 3"),
        (
            npz_of(("facies_names",), training_image=np.array([[0, 1]])),
            "facies 2 is not in the training image",
        ),
        (BytesIO(sample.picture()), "not from pictures or tables"),
        (BytesIO(sample.gslib_table()), "not from pictures or tables"),
        (BytesIO(b"2 1 1\n2\na\nb\n0 0\n-999 0\n"), "some cells have no facies"),
        (BytesIO(b"2 1 1\n1\na\n0\n0.5\n"), "not a whole number"),
    ],
)
def test_what_is_no_file_of_realizations_is_refused_in_words(file, said):
    with pytest.raises(CCWSIMError, match=said):
        read_realizations(file)


def test_letters_that_are_none_are_refused():
    name = np.frombuffer(b"\xff" * 4, "<U1")
    with pytest.raises(CCWSIMError, match="broken"):
        read_realizations(npz_of(image_name=name))


def test_an_image_without_a_facies_of_the_file_is_refused():
    with pytest.raises(CCWSIMError, match="give training_image="):
        read_realizations(BytesIO(sample.realizations("gslib")), TrainingImage([[0, 1]]))
