"""Test that the example notebook runs, and that its files have correct world coordinates."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

NOTEBOOK = Path(__file__).parents[1] / "examples" / "results.ipynb"


@pytest.fixture
def run(tmp_path, monkeypatch) -> dict[str, Any]:
    """Return the variables after running all cells in order in an empty folder."""
    for package in ("pandas", "rasterio", "xarray"):
        pytest.importorskip(package)
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    for cell in json.loads(NOTEBOOK.read_text("utf-8"))["cells"]:
        if cell["cell_type"] == "code":
            exec(compile("".join(cell["source"]), str(NOTEBOOK), "exec"), names)
    return names


def test_the_notebook_runs_and_its_files_are_where_they_belong(run):
    import rasterio
    import xarray

    e, wells = run["e"], run["wells"]
    assert not e.n_mismatched.any()
    assert (run["at_wells"] == wells.facies.to_numpy()).all()
    assert len(e.plot().data) > 0
    with rasterio.open("facies.tif") as file:
        assert tuple(file.bounds) == (350000, 4505000, 350800, 4506200)
        assert file.res == (10, 20)
        np.testing.assert_array_equal(file.read()[:, ::-1], e.realizations)
        sampled = [v.tolist() for v in file.sample(wells[["x", "y"]].to_numpy())]
    assert sampled == [[facies] * 4 for facies in wells.facies]
    with xarray.open_dataarray("facies.nc") as array:
        np.testing.assert_array_equal(array.values, e.realizations)
    np.testing.assert_allclose(run["probability"], e.probability(1), atol=1e-6)
    image = ElementTree.parse("facies.vti").getroot()[0]
    assert image.attrib["WholeExtent"] == "0 80 0 60 0 1"
    assert [float(v) for v in image.attrib["Origin"].split()] == [350000, 4505000, 0]
    again = run["again"]
    assert (again.digest, again.hard_data.triples) == (e.digest, e.hard_data.triples)


def test_pyvista_reads_the_grid_of_the_notebook(run):
    pyvista = pytest.importorskip("pyvista")
    mesh = pyvista.read("facies.vti")
    assert mesh.bounds[:4] == (350000, 350800, 4505000, 4506200)
    np.testing.assert_array_equal(mesh.cell_data["realization_1"].reshape(60, 80), run["e"][0])
