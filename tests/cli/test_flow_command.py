"""Test the command `flow` on a small file of realizations."""

from __future__ import annotations

import numpy as np
import pytest

from ccwsim import write_realizations
from ccwsim.cli.program import main
from ccwsim.flow import FromValues, effective_k
from tests.flow.test_flow import ensemble
from tests.flow.test_values import log_k


@pytest.fixture
def file(tmp_path):
    write_realizations(tmp_path / "out.npz", ensemble(3))
    return str(tmp_path / "out.npz")


def test_a_table_and_a_grid_are_written(file, tmp_path, capsys):
    table, grid = tmp_path / "k.csv", tmp_path / "grid.grdecl"
    values = ["-k", "sand=1e-4", "-k", "0=1e-8"]
    assert main(["flow", file, *values, "-o", str(table), "--grdecl", str(grid)]) == 0
    printed = capsys.readouterr()
    assert "50 % below" in printed.out
    assert "Training image" in printed.out
    assert str(grid) in printed.err
    lines = table.read_text().splitlines()
    assert len(lines) == 1 + 3 + 1
    assert lines[-1].startswith("training_image")
    assert (tmp_path / "grid_3.inc").exists()


def test_a_model_is_written(file, tmp_path):
    pytest.importorskip("flopy")
    values = ["-k", "sand=1e-4", "-k", "mud=1e-8", "--axis", "y"]
    assert main(["flow", file, *values, "-q", "--modflow", str(tmp_path / "model")]) == 0
    assert (tmp_path / "model" / "mfsim.nam").exists()


def test_values_are_conductivities(tmp_path, capsys):
    write_realizations(tmp_path / "k.npz", log_k())
    line = ["flow", str(tmp_path / "k.npz"), "--values-are", "log-K"]
    assert main([*line, "-o", str(tmp_path / "k.csv")]) == 0
    k = np.genfromtxt(tmp_path / "k.csv", delimiter=",", skip_header=1)[:3, 1]
    assert np.allclose(k, effective_k(log_k(), FromValues(logarithmic=True)).each, rtol=1e-6)
    assert main([*line, "-k", "1=1"]) == 2
    assert "give either -k" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["-k", "sand=1e-4"], "mud has no value"),
        ([], "give either -k"),
        (["-k", "sand"], "must be a facies and a number"),
        (["-k", "sand=1", "-k", "mud=1", "--axis", "z"], "axis"),
        (["-k", "sand=1", "-k", "mud=1", "--axis", "z", "--modflow", "m"], "--modflow"),
    ],
)
def test_bad_input_is_one_sentence(file, options, words, capsys):
    assert main(["flow", file, *options]) == 2
    assert words in capsys.readouterr().err
