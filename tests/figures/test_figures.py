"""Test that figures show their values, and that everybody can distinguish their colours."""

from __future__ import annotations

from io import BytesIO
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, strategies as st
from hypothesis.extra.numpy import arrays
from PIL import Image

from ccwsim import CCWSIMError, TrainingImage
from ccwsim.figures import (
    DARK,
    FACIES,
    LIGHT,
    Bundle,
    Dots,
    contact_sheet,
    curves_chart,
    data_map_png,
    data_png,
    facies_colours,
    map_png,
    mds_title,
    mixed,
    placement_svg,
    proportions_chart,
    ramp,
    sparkline,
    steps_of,
    style,
    tile_size,
    times_chart,
)
from ccwsim.figures.notebook import image_chart
from ccwsim.figures.style import bytes_of
from ccwsim.figures.validation import label_side
from ccwsim.model.missing import UNKNOWN

# Machado, Oliveira & Fernandes 2009, severity 1: linear RGB as a reader with the deficiency sees it
BLINDNESS = {
    "none": np.eye(3),
    "protanopia": [
        [0.152286, 1.052583, -0.204868],
        [0.114503, 0.786281, 0.099216],
        [-0.003882, -0.048116, 1.051998],
    ],
    "deuteranopia": [
        [0.367322, 0.860646, -0.227968],
        [0.280085, 0.672501, 0.047413],
        [-0.011820, 0.042940, 0.968881],
    ],
    "tritanopia": [
        [1.255528, -0.076749, -0.178779],
        [-0.078411, 0.930809, 0.147602],
        [0.004733, 0.691367, 0.303900],
    ],
}

indices = arrays(
    np.uint8, st.tuples(st.integers(1, 9), st.integers(1, 9)), elements=st.integers(0, 5)
)


def opened(png: bytes) -> Image.Image:
    return Image.open(BytesIO(png))


def lab(colours, matrix) -> np.ndarray:
    """Return the CIE L*a*b* (D65) values of sRGB colours."""
    s = np.array(bytes_of(colours)) / 255
    linear = np.where(s <= 0.04045, s / 12.92, ((s + 0.055) / 1.055) ** 2.4)
    seen = np.clip(linear @ np.array(matrix).T, 0, 1)
    xyz = (
        seen
        @ np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]).T
    )
    t = xyz / np.array([0.9505, 1.0, 1.089])
    f = np.where(t > 0.008856, np.cbrt(t), 7.787 * t + 16 / 116)
    x, y, z = f.T
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=1)


@pytest.mark.parametrize("blindness", BLINDNESS)
def test_facies_colours_can_be_told_apart(blindness):
    seen = lab(FACIES, BLINDNESS[blindness])
    nearest = min(np.linalg.norm(a - b) for a, b in combinations(seen, 2))
    assert nearest > 25


def test_the_first_three_facies_differ_in_grey_scale_print():
    lightness = lab(FACIES[:3], np.eye(3))[:, 0]
    assert min(abs(a - b) for a, b in combinations(lightness, 2)) > 12


def test_many_facies_all_have_their_own_colour():
    image = TrainingImage(np.arange(40)[None])
    assert len(set(facies_colours(image))) == 40


def test_a_facies_keeps_the_colour_that_the_user_gave_it():
    image = TrainingImage([[3, 5, 9]])
    assert facies_colours(image, {5: "#123456"}) == [FACIES[0], "#123456", FACIES[2]]


def test_a_colour_that_is_none_is_said():
    with pytest.raises(CCWSIMError, match="must be written as #rrggbb"):
        facies_colours(TrainingImage([[0]]), {0: "red;}</style>"})


def test_a_ramp_ends_where_its_steps_end():
    colours = ramp(["#00224e", "#fee838"], 7)
    assert len(colours) == 7
    assert (colours[0].lower(), colours[-1].lower()) == ("#00224e", "#fee838")


@given(indices, st.integers(1, 3))
def test_a_map_has_the_colour_of_each_cell_in_whole_pixels(cells, scale):
    picture = np.asarray(opened(map_png(cells, FACIES, scale=scale)).convert("RGB"))
    wanted = np.array(bytes_of(FACIES), np.uint8)[cells[::-1]]
    assert np.array_equal(picture, wanted.repeat(scale, 0).repeat(scale, 1))


@pytest.mark.parametrize("colours", [FACIES[:2], steps_of(np.zeros(1))[1]])
def test_unknown_cells_are_transparent_in_maps_of_any_colours(colours):
    cells = np.array([[0, 1, UNKNOWN]], np.uint8)
    picture = np.asarray(opened(map_png(cells, colours)).convert("RGBA"))[0]
    assert picture[:2, :3].tolist() == [list(rgb) for rgb in bytes_of(colours[:2])]
    assert picture[:, 3].tolist() == [255, 255, 0]
    dots = Dots(np.array([[0, 0]]), [colours[0]], np.array([False]))
    with_data = np.asarray(opened(data_map_png(cells, colours, dots, longest=300)).convert("RGB"))
    assert with_data[50, 250].tolist() == [255, 255, 255]


def test_shares_that_are_missing_have_no_colour():
    assert steps_of(np.array([0.0, 1.0, np.nan]))[0].tolist() == [0, 200, UNKNOWN]


def test_a_contact_sheet_shows_each_realization_once_in_order():
    cells = np.arange(6, dtype=np.uint8)[:, None, None] * np.ones((1, 4, 8), np.uint8)
    png, columns = contact_sheet(cells, FACIES, longest=16)
    picture = np.asarray(opened(png))
    assert columns == 6
    assert picture.shape == (8, 96, 3)
    for r, colour in enumerate(bytes_of(FACIES)):
        assert (picture[:, 16 * r : 16 * (r + 1)] == colour).all()


def test_a_contact_sheet_of_many_goes_on_in_a_second_row():
    cells = np.zeros((300, 8, 8), np.uint8)
    png, columns = contact_sheet(cells, FACIES, longest=96)
    width, height = opened(png).size
    assert width == 96 * columns <= 8192
    assert height == 96 * -(-300 // columns)


def test_data_are_drawn_where_they_lie():
    png = data_png(np.array([[9, 0], [0, 9]]), np.array([0, 1]), (10, 10), FACIES, longest=100)
    picture = np.asarray(opened(png).convert("RGBA"))
    north_west, south_east = picture[5, 5], picture[95, 95]
    assert tuple(north_west[:3]) == bytes_of(FACIES)[0]
    assert tuple(south_east[:3]) == bytes_of(FACIES)[1]
    assert picture[50, 50, 3] == 0


def bundle(n: int = 7, m: int = 12) -> Bundle:
    each = np.random.default_rng(3).random((n, m))
    low, median, high = np.quantile(each, [0.05, 0.5, 0.95], axis=0)
    return Bundle(np.arange(m, dtype=float), each[0], each, low, median, high)


@pytest.mark.parametrize("theme", [LIGHT, DARK])
def test_curves_show_every_realization_and_the_image_on_top(theme):
    curves = bundle()
    chart = curves_chart(curves, theme, y_title="γ", y_range=(0, 1))
    traces = {trace.name: trace for trace in chart.data}
    assert chart.data[-1].name == "training image"
    assert traces["training image"].line.color == theme.reference
    drawn = np.asarray(traces["realizations"].y).reshape(7, 13)
    assert np.array_equal(drawn[:, :-1], curves.each)
    assert np.isnan(drawn[:, -1]).all()
    assert np.array_equal(traces["median"].y, curves.median)
    assert tuple(chart.layout.yaxis.range) == (0, 1)
    assert chart.layout.yaxis.title.text == "γ"


def test_times_show_each_realization_and_start_at_zero():
    chart = times_chart(np.array([10.0, 30.0]), 20.0, LIGHT)
    mean, dots = chart.data
    assert list(dots.x) == [1, 2]
    assert list(dots.y) == [10.0, 30.0]
    assert set(mean.y) == {20.0}
    assert chart.layout.yaxis.range[0] == 0
    assert chart.layout.yaxis.range[1] > 30


def test_proportions_are_percent_and_the_image_is_marked():
    each = np.array([[0.7, 0.3], [0.6, 0.4]])
    chart = proportions_chart(["mud", "sand"], np.array([0.65, 0.35]), each, FACIES, LIGHT)
    assert list(chart.data[1].x) == pytest.approx([30, 40])
    assert list(chart.data[-1].x) == pytest.approx([65, 35])
    assert list(chart.layout.yaxis.ticktext) == ["mud", "sand"]


def test_a_well_is_one_line_with_its_name_as_it_is_written():
    path = np.array([[1, 1], [1, 2], [2, 3]])
    cells, colours = np.vstack([path, [[8, 8]]]), ["#173F6B", None, "#173F6B", "#F0AD2E"]
    svg = placement_svg(cells, colours, (10, 20), {"<b>W&1": [0, 1, 2], "W2": [3]})
    assert [svg.count(f"<{tag} ") for tag in ("circle", "polyline", "text")] == [4, 2, 2]
    assert "&lt;b&gt;W&amp;1</text>" in svg
    assert len(svg.split('<polyline points="')[1].split('"')[0].split()) == 3
    assert "<polyline" not in placement_svg(cells, colours, (10, 20))


def test_small_functions_of_charts():
    dots = Dots(np.array([[0, 1]]), ["#173F6B"], np.array([True]))
    map_ = data_map_png(np.eye(2, dtype=np.uint8), ["#173F6B", "#F0AD2E"], dots, longest=100)
    assert opened(map_).size == (100, 100)
    assert sparkline([[0, 1], [0, 2]], [0, 1.5], LIGHT).count(b"<polyline") == 3
    assert tile_size((100, 200), 96) == (96, 48)
    assert style.with_opacity("#0072B2", 0.2) == "rgba(0, 114, 178, 0.2)"
    assert style.as_written(["<b>mud", "%{x}"]) == ["&lt;b&gt;mud", "%&#123;x}"]
    assert mixed("#000000", "#FFFFFF", 0.5) == "#808080"
    alone, above = np.empty((0, 2)), np.array([[0.5, -0.1], [-0.9, 0.9]])
    assert label_side(np.array([0.9, -0.2]), alone) == "top left"
    assert label_side(np.array([0.9, -0.2]), above) == "bottom left"
    assert label_side(np.array([0.0, 0.5]), alone) == "bottom center"
    assert mds_title(0.104) == "MDS plot: stress 0.10"
    assert image_chart(TrainingImage([[0, 1], [1, 1]])).data[0].z.tolist() == [[0, 1], [1, 1]]
