"""Test the pictures and charts of training images, data and ensembles in a notebook."""

from __future__ import annotations

import re
from base64 import b64decode
from io import BytesIO

import numpy as np
import pytest
from PIL import Image

from ccwsim import Grid, HardData, Parameters, Secondary, TrainingImage, simulate

xarray = pytest.importorskip("xarray")

IMAGE = TrainingImage(
    np.tile([[3], [3], [8], [8]], (16, 64)), name="<b>", facies_names=["mud", "fine sand"]
)
GRID = Grid(40, 50, cell_size=(10.0, 20.0), origin=(350000.0, 4505000.0))
P = Parameters(template_size=16, overlap_size=4, wavelet_level=1)


@pytest.fixture(scope="module")
def ensemble():
    data = HardData([[5, 7], [30, 41]], [8, 3])
    return simulate(IMAGE, GRID, P, data, n_realizations=14, seed=2)


def picture(html: str) -> Image.Image:
    (content,) = re.findall(r"base64,([^\"]+)", html)
    return Image.open(BytesIO(b64decode(content)))


def test_an_image_shows_itself_and_says_what_it_is():
    html = IMAGE._repr_html_()
    assert picture(html).size == (240, 240)
    assert "64 × 64 cells, mud 50.0 %, fine sand 50.0 %" in html
    assert "<b>" not in html


def test_an_ensemble_shows_its_first_realizations(ensemble):
    html = ensemble._repr_html_()
    assert picture(html).size == (12 * 120, 96)
    assert "14 realizations of 50 × 40 cells, the first 12 shown, 2 hard data, seed 2" in html


def test_data_show_where_they_lie():
    html = HardData([[5, 7], [30, 41]], [8, 3])._repr_html_()
    assert "rows 5 to 30, columns 7 to 41: 1 of facies 3, 1 of facies 8" in html
    assert picture(html).size == (240, 178)
    assert HardData()._repr_html_() == "<figure><figcaption>no hard data</figcaption></figure>"


def test_a_chart_of_an_ensemble_lies_in_the_world(ensemble):
    chart = ensemble.plot()
    maps = [trace for trace in chart.data if trace.type == "heatmap"]
    assert len(maps) == 3
    np.testing.assert_array_equal(maps[1].z, ensemble.indices[1])
    assert (maps[0].x0, maps[0].dx, maps[0].y0, maps[0].dy) == (350005, 10, 4505010, 20)
    assert maps[0].customdata[5, 7] == "fine sand"
    (points, *_) = (trace for trace in chart.data if trace.type == "scatter")
    assert (points.x[0], points.y[0]) == (350075, 4505110)
    titles = [note.text for note in ensemble.plot([4]).layout.annotations]
    assert titles == ["Realization 5"]


def test_colours_of_a_chart_are_those_of_the_facies():
    (trace,) = IMAGE.plot().data
    assert [step[1] for step in trace.colorscale] == ["#173F6B"] * 2 + ["#F0AD2E"] * 2
    assert trace.colorbar.ticktext == ("mud", "fine sand")
    assert len(HardData([[5, 7], [30, 41]], [8, 3]).plot().data) == 2
    assert not HardData().plot().data


@pytest.mark.parametrize("nz", [None, 3])
def test_charts_leave_unknown_and_inactive_cells_blank(nz):
    cells = np.tile([[0.0], [1.0], [1.0], [np.nan]], (1, 5))
    cells = cells if nz is None else np.stack([cells] * nz)
    image = TrainingImage(cells, facies_names=["mud", "sand"])
    heatmap = image.plot().data[0]
    np.testing.assert_array_equal(heatmap.z, cells if nz is None else cells[1])
    assert heatmap.hoverongaps is False
    assert np.asarray(heatmap.customdata)[:, 0].tolist() == ["mud", "sand", "sand", ""]
    image, active = TrainingImage(np.eye(24)), np.ones((20, 30), bool)
    active[4:9, 3:] = False
    e = simulate(image, (20, 30), Parameters(8, 2, 1), secondary=Secondary(active=active))
    np.testing.assert_array_equal(e.plot().data[0].z, e.realizations[0])


def test_an_array_with_coordinates_goes_to_netcdf_and_back(ensemble, tmp_path):
    array = ensemble.to_xarray()
    assert array.dims == ("realization", "y", "x")
    assert array.sel(x=350071.0, y=4505111.0, method="nearest").values.tolist() == [8] * 14
    array.to_netcdf(tmp_path / "facies.nc")
    with xarray.open_dataarray(tmp_path / "facies.nc") as back:
        np.testing.assert_array_equal(back.values, ensemble.realizations)
        assert back.attrs["flag_meanings"] == "mud fine_sand"
        assert back.attrs["flag_values"].tolist() == [3, 8]
        np.testing.assert_array_equal(back["x"], array["x"])


def test_without_xarray_it_is_said_what_to_install(ensemble, monkeypatch):
    import sys

    from ccwsim import CCWSIMError

    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(CCWSIMError, match=r"xarray; install it: pip install .*\[files\]"):
        ensemble.to_xarray()


def test_no_data_in_a_volume_are_an_empty_chart():
    assert len(HardData(np.empty((0, 3)), ()).plot().data) == 0
