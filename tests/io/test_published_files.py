"""Test files of other programs and of the paper, if the folder of data is available."""

from __future__ import annotations

import re
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest

import ccwsim.io as cio
from ccwsim import CCWSIMError, Grid, TrainingImage


@pytest.mark.parametrize(
    ("name", "shape", "codes"),
    [
        ("A_WLreferenceCAT.sgems", (300, 260), [0, 1, 2]),
        ("dunes_3facies.SGEMS", (114, 114), [0, 1, 2]),
        ("ti_strebelle_250_250_1.dat", (250, 250), [0, 1]),
    ],
)
def test_grids_of_other_tools(data_dir: Path, name, shape, codes):
    path = data_dir / "formats" / name
    ti = cio.read_training_image(path)
    assert ti.shape == shape
    assert ti.codes.tolist() == codes
    plain = np.array(path.read_text().split("\n")[3:-1], dtype=float).reshape(shape)
    assert (ti.array == plain).all(), "x fastest, from the south-west"


@pytest.mark.parametrize(
    ("name", "shape", "n_facies"),
    [("ti_maules_creek_340x200x80", (80, 200, 340), 2), ("ti_alluvial_ti1_78x59x116", None, 4)],
)
def test_volumes(data_dir: Path, name, shape, n_facies):
    path = data_dir / "volumes" / f"{name}.npz"
    if not path.is_file():
        pytest.skip(f"no {path.name}")
    ti = cio.read_training_image(path, volume=True)
    assert ti.shape == (shape or (116, 59, 78))
    assert ti.n_facies == n_facies
    with np.load(path) as saved:
        assert (ti.array == saved["ti"]).all()
    piece = TrainingImage(ti.array[:9, :40, :50])
    written = BytesIO(cio.training_image_as_bytes(piece, "sgems"))
    assert cio.read_training_image(written, volume=True).digest == piece.digest


def test_grey_values_ask_for_classes(data_dir: Path):
    path = data_dir / "formats" / "ti_stonewall.sgems"
    assert cio.inspect(path).variables[0].continuous
    with pytest.raises(CCWSIMError, match="look continuous"):
        cio.read_training_image(path)
    grey = cio.read_grid(path)
    assert grey[0, :3].tolist() == [181, 164, 152]
    assert (cio.read_training_image(path, threshold=128).array == (grey >= 128)).all()
    shares = cio.read_training_image(path, classes=3).proportions
    assert np.abs(shares - 1 / 3).max() < 0.01


def test_geo_eas_points_of_other_tools(data_dir: Path):
    wells = cio.import_hard_data(data_dir / "formats" / "B_WLCATsamples.sgems", Grid(300, 260))
    assert wells.n_read == wells.hard_data.n == 100
    reference = cio.read_training_image(data_dir / "formats" / "A_WLreferenceCAT.sgems")
    rows, columns = wells.hard_data.cells.T
    agreeing = {
        (dy, dx): np.mean(
            np.roll(reference.array, (dy, dx), (0, 1))[rows, columns] == wells.hard_data.facies
        )
        for dy in (-1, 0, 1)
        for dx in (-1, 0, 1)
    }
    assert max(agreeing, key=agreeing.get) == (0, 0), "neither shifted nor turned"
    assert agreeing[0, 0] > 0.8
    written = cio.read_points(data_dir / "formats" / "mps_2d_hard_data.dat")
    assert written.places[0].tolist() == [10, 35]
    assert written.lines[0] == 7
    assert "read as x and y" in written.notes[0]


def test_data_of_the_paper(data_dir: Path):
    files = sorted((data_dir / "paper").glob("hd_*.csv"))
    assert files
    for path in files:
        ny, nx = map(int, re.findall(r"grid(\d+)x(\d+)", path.name)[0])
        data = cio.read_hard_data(path, Grid(ny, nx))
        plain = np.loadtxt(path, delimiter=",", skiprows=1, dtype=int)
        assert data.n == len(plain)
        assert np.column_stack([data.cells, data.facies]).tolist() == sorted(plain.tolist())


def test_training_images_of_the_paper(data_dir: Path):
    files = sorted((data_dir / "paper").glob("ti_*.npy"))
    assert files
    for path in files:
        assert (cio.read_training_image(path).array == np.load(path)).all()
