"""Test writing realizations and parameters to files and reading them back."""

from __future__ import annotations

import json
import os
from io import BytesIO

import numpy as np
import pytest
from hypothesis import given, strategies as st
from hypothesis.extra.numpy import arrays
from PIL import Image

import ccwsim.io as cio
from ccwsim import CCWSIMError, Ensemble, Grid, HardData, Parameters, TrainingImage
from ccwsim.model.study import Study


def ensemble_of(indices: np.ndarray, codes=(0, 5, -3)) -> Ensemble:
    ti = TrainingImage([codes])
    grid = Grid(*indices.shape[1:], cell_size=(2.0, 3.0), origin=(10.0, 20.0))
    data = HardData([[0, 1]], [5])
    data_status = np.zeros((len(indices), 1), np.int16)
    cpu = np.linspace(0.1, 0.2, len(indices))
    numbers = np.arange(len(indices))
    study = Study(ti, grid, Parameters(refine=False), data, 42, checked=False)
    return Ensemble(study, indices, cpu, 0.5, data_status, numbers)


three_maps = arrays(np.uint8, (3, 4, 5), elements=st.integers(0, 2))


@given(three_maps)
def test_npz_round_trip(indices):
    ensemble = ensemble_of(indices)
    with np.load(BytesIO(cio.realizations_as_bytes(ensemble, "npz"))) as saved:
        assert (saved["realizations"] == ensemble.realizations).all()
        assert saved["codes"].tolist() == [-3, 0, 5]
        assert cio.parameters_from_json(str(saved["parameters"])) == ensemble.parameters
        assert int(saved["seed"]) == 42
        assert (saved["cpu_seconds"] == ensemble.cpu_seconds).all()
        assert saved["hard_cells"].tolist() == [[0, 1]]
        assert saved["hard_facies"].tolist() == [5]
        assert saved["cell_size"].tolist() == [2.0, 3.0]
        assert saved["origin"].tolist() == [10.0, 20.0]


@given(three_maps)
def test_gslib_round_trip_by_column(indices):
    ensemble = ensemble_of(indices)
    content = cio.realizations_as_bytes(ensemble, "gslib")
    for k in range(3):
        back = cio.read_grid(BytesIO(content), variable=f"realization_{k + 1}")
        assert (back == ensemble.realizations[k]).all()


def test_gslib_layout():
    ensemble = ensemble_of(np.array([[[0, 1], [2, 2]], [[2, 2], [1, 0]]], np.uint8), (0, 1, 2))
    lines = cio.realizations_as_bytes(ensemble, "sgems").decode().splitlines()
    sizes = "2 2 1 2.0 3.0 1 10.0 20.0 0"  # numbers of cells, cell size, corner of the first cell
    assert lines[:4] == [sizes, "2", "realization_1", "realization_2"]
    assert lines[4:] == ["0 2", "1 2", "2 1", "2 0"]


@given(
    arrays(
        np.uint8, st.tuples(st.integers(1, 7), st.just(4), st.just(6)), elements=st.integers(0, 2)
    )
)
def test_png_holds_every_map_north_up(indices):
    ensemble = ensemble_of(indices)
    colours = ["#000000", "#ff0000", "#00ff00"]
    content = cio.realizations_as_bytes(ensemble, "png", colours=colours)
    sheet = np.array(Image.open(BytesIO(content)).convert("RGB")).astype(int)
    facies = np.select(
        [sheet[..., 2] == 255, sheet[..., 0] == 255, sheet[..., 1] == 255], [9, 1, 2]
    )
    columns = (facies.shape[1] + 4) // 10
    for k, one in enumerate(indices):
        top, left = k // columns * 8, k % columns * 10
        assert facies[top : top + 4, left : left + 6].tolist() == one[::-1].tolist()
    assert (facies != 9).sum() == indices.size


def test_inactive_cells_are_white_in_a_png():
    indices = np.array([[[0, 255], [1, 2]]], np.uint8)
    content = cio.realizations_as_bytes(ensemble_of(indices), "png", colours=["#100000"] * 3)
    with Image.open(BytesIO(content)) as picture:
        pixels = np.array(picture.convert("RGB"))[::-1]
    assert pixels[0, 1].tolist() == [255, 255, 255]
    assert (pixels[[0, 1, 1], [0, 0, 1]] == [16, 0, 0]).all()


@pytest.mark.filterwarnings("ignore:.* transparent")
@pytest.mark.parametrize("codes", [(0, 1), (3, 200), (-5, 7), (0, 254), (100, 900)])
def test_unknown_cells_of_an_image_are_transparent_in_a_png(codes):
    cells = np.array(codes, float)[np.random.default_rng(0).integers(0, 2, (9, 11))]
    cells[2:4, 3:9] = np.nan
    image = TrainingImage(cells)
    back = cio.read_training_image(BytesIO(cio.training_image_as_bytes(image, "png")))
    np.testing.assert_array_equal(back.indices, image.indices)
    renumbered = codes[0] < 0 or codes[1] > 254
    assert back.codes.tolist() == ([0, 1] if renumbered else list(codes))


def test_wrong_colours_and_formats_say_so():
    ensemble = ensemble_of(np.zeros((1, 2, 2), np.uint8))
    with pytest.raises(CCWSIMError, match="write it as #rrggbb"):
        cio.realizations_as_bytes(ensemble, "png", colours=["red"])
    with pytest.raises(
        CCWSIMError, match="choose one of dat, grdecl, gslib, nc, npz, png, sgems, tif, vti"
    ):
        cio.realizations_as_bytes(ensemble, "docx")
    with pytest.raises(CCWSIMError, match="format 'none'"):
        cio.write_realizations(BytesIO(), ensemble)
    with pytest.raises(CCWSIMError, match="no realizations to write"):
        cio.realizations_as_bytes(ensemble_of(np.zeros((0, 2, 2), np.uint8)), "npz")


@pytest.mark.parametrize("ending", cio.REALIZATION_FORMATS)
def test_files_get_the_format_of_their_ending(tmp_path, ending):
    ensemble = ensemble_of(np.zeros((2, 3, 3), np.uint8))
    path = tmp_path / f"out.{ending.upper()}"
    cio.write_realizations(path, ensemble)
    cio.write_realizations(str(path), ensemble)
    assert path.read_bytes() == cio.realizations_as_bytes(ensemble, ending)
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path, monkeypatch):
    path = tmp_path / "out.npz"
    path.write_bytes(b"good")

    def full(_descriptor):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(CCWSIMError, match="No space left"):
        cio.write_realizations(path, ensemble_of(np.zeros((1, 2, 2), np.uint8)))
    assert path.read_bytes() == b"good"
    assert list(tmp_path.iterdir()) == [path]


def test_places_that_cannot_be_written_say_so(tmp_path):
    ensemble = ensemble_of(np.zeros((1, 2, 2), np.uint8))
    for path in (tmp_path / "none" / "out.npz", tmp_path / ("x" * 300 + ".npz")):
        with pytest.raises(CCWSIMError, match="cannot be written"):
            cio.write_realizations(path, ensemble)
    (tmp_path / "folder.npz").mkdir()
    with pytest.raises(CCWSIMError, match="cannot be written"):
        cio.write_realizations(tmp_path / "folder.npz", ensemble)
    assert [p.name for p in tmp_path.iterdir()] == ["folder.npz"]


@given(
    st.builds(
        Parameters,
        template_size=st.sampled_from([16, 32, 48]),
        overlap_size=st.sampled_from([4, 8]),
        n_candidates=st.integers(1, 99),
        search_fraction=st.floats(0.001, 1),
        template_variation=st.floats(0, 0.5),
        random_path=st.booleans(),
        refine=st.booleans(),
    )
)
def test_parameters_round_trip(parameters):
    assert cio.parameters_from_json(cio.parameters_to_json(parameters)) == parameters


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "not JSON"),
        ("[1]", "a JSON object is needed"),
        ("[" * 50_000, "not JSON"),
        ("1" * 5000, "not JSON"),
        (b"\xff\xfe{", "not JSON"),
        ('{"tempate_size": 32}', "'tempate_size' is not a parameter; choose from template_size"),
        ('{"template_size": "32"}', "template_size = '32' must be"),
        ('{"template_size": NaN}', "template_size = nan must be"),
        ('{"refine": [1]}', "refine"),
        (" " * 200_000, "exceed the limit"),
    ],
)
def test_broken_parameters_say_so(text, message):
    with pytest.raises(CCWSIMError, match=message):
        cio.parameters_from_json(text)


def test_parameters_that_are_left_out_keep_their_defaults():
    assert cio.parameters_from_json(json.dumps({"n_candidates": 7})) == Parameters(n_candidates=7)
