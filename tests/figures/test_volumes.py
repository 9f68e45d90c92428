"""Test figures of volumes: elevation axis, slices with their cells, sizes of geobodies."""

from __future__ import annotations

from io import BytesIO

import numpy as np
import pytest
from PIL import Image

from ccwsim import CCWSIMError, Grid, HardData, Parameters, TrainingImage, simulate
from ccwsim.figures import (
    DARK,
    FACIES,
    LIGHT,
    Bundle,
    Dots,
    LayerData,
    geobody_sizes_chart,
    slices_of,
    slices_png,
    vertical_proportions_chart,
)
from ccwsim.figures.maps import LABEL_HEIGHT, SLICE_GAP, WRONG_COLOUR
from ccwsim.figures.style import bytes_of
from ccwsim.metrics import etype, vertical_proportions
from ccwsim.report.pictures import layers_bundle, layers_chart, map_picture, share_picture

SIDES = 6, 40, 50


@pytest.fixture
def volume() -> np.ndarray:
    return np.random.default_rng(2).integers(0, 3, SIDES).astype(np.uint8)


def pixels(png: bytes) -> np.ndarray:
    return np.asarray(Image.open(BytesIO(png)).convert("RGBA"))


def bundle() -> Bundle:
    each = np.array([[0.1, 0.2, 0.6], [0.3, 0.4, 0.2]])
    lags = np.array([100.5, 101.5, 102.5])
    return Bundle(lags, each[1], each, each[0], each.mean(axis=0), each[1])


@pytest.mark.parametrize("theme", [LIGHT, DARK])
def test_layers_go_upwards_and_shares_are_percent(theme):
    data = LayerData(np.array([101.5]), np.array([0.25]), np.array([4]))
    chart = vertical_proportions_chart(bundle(), theme, x_title="sand (%)", data=data)
    traces = {trace.name: trace for trace in chart.data}
    low, high = chart.layout.yaxis.range
    assert (low, high) == (100.0, 103.0)
    assert chart.layout.xaxis.title.text == "sand (%)"
    assert chart.layout.yaxis.title.text == "elevation"
    assert traces["median"].x == pytest.approx([20, 30, 40])
    assert traces["median"].y.tolist() == [100.5, 101.5, 102.5]
    assert traces["training image"].x == pytest.approx([30, 40, 20])
    assert traces["training image"].line.color == theme.reference
    known = ~np.isnan(np.asarray(traces["realizations"].y, float))
    assert np.asarray(traces["realizations"].x, float)[known] == pytest.approx(
        [10, 20, 60, 30, 40, 20]
    )
    assert traces["hard data"].x == pytest.approx([25])
    assert traces["hard data"].customdata.tolist() == [4]
    assert 60 <= chart.layout.xaxis.range[1] <= 100


def test_the_image_has_its_own_layers():
    own = Bundle(*[getattr(bundle(), n) for n in ("lags", "reference", "each")], *np.ones((3, 3)))
    at = np.array([100.75, 102.25])
    short = Bundle(own.lags, np.array([0.5, 0.7]), own.each, own.low, own.median, own.high)
    chart = vertical_proportions_chart(short, LIGHT, x_title="sand (%)", reference_at=at)
    image = next(trace for trace in chart.data if trace.name == "training image")
    assert image.y.tolist() == at.tolist()
    assert image.x == pytest.approx([50, 70])


def test_sizes_are_on_a_log_axis_with_their_shares():
    own = bundle()
    sized = Bundle(np.array([1.0, 10.0, 1000.0]), *[own.reference, own.each], *own.each, own.high)
    chart = geobody_sizes_chart(sized, LIGHT, y_title="share of sand")
    assert chart.layout.xaxis.type == "log"
    assert chart.layout.xaxis.range[1] == pytest.approx(3)
    assert chart.layout.xaxis.title.text == "cells or more"
    image = next(trace for trace in chart.data if trace.name == "training image")
    assert image.y == pytest.approx(own.reference)


def test_slices_show_the_cells_with_north_and_up_at_the_top(volume):
    picture = pixels(slices_png(volume, FACIES, longest=2 * SLICE_GAP + 140))
    wanted = [volume[3], volume[:, 20], volume[:, :, 25]]
    # one pixel per cell: only these letters make a label wider than its slice
    scale, left = 1, 0
    colours = np.array(bytes_of(FACIES), np.uint8)
    for shown, (label, width) in zip(wanted, placed(volume), strict=True):
        height = shown.shape[0] * scale
        cut = picture[
            LABEL_HEIGHT : LABEL_HEIGHT + height, left : left + shown.shape[1] * scale, :3
        ]
        assert np.array_equal(cut, colours[shown[::-1]]), label
        left += width + SLICE_GAP


def placed(volume):
    """Return labels, and the larger number of pixels along the two axes of each slice."""
    from PIL import ImageFont

    from ccwsim.figures.maps import LETTER_SIZE

    font = ImageFont.load_default(LETTER_SIZE)
    for one in slices_of(volume):
        yield one.label, max(one.indices.shape[1], int(font.getlength(one.label)) + 1)


def test_slices_are_named_by_layer_row_and_column(volume):
    labels = [one.label for one in slices_of(volume)]
    assert labels == ["layer 3 (0 to 5)", "row 20 (0 to 39)", "column 25 (0 to 49)"]


def test_data_stand_in_the_slices_that_they_lie_in(volume):
    cells = np.array([[3, 0, 0], [3, 20, 25], [1, 20, 5]])
    dots = Dots(cells, ["#010203", "#040506", "#070809"], np.array([False, True, False]))
    layer, row, column = slices_of(volume, dots=dots)
    assert layer.dots.cells.tolist() == [[0, 0], [20, 25]]
    assert row.dots.cells.tolist() == [[3, 25], [1, 5]]
    assert row.dots.colours == ["#040506", "#070809"]
    assert column.dots.wrong.tolist() == [True]
    picture = pixels(slices_png(volume, FACIES, dots=dots))[..., :3].reshape(-1, 3)
    red = bytes_of([WRONG_COLOUR])[0]
    plain = pixels(slices_png(volume, FACIES))[..., :3].reshape(-1, 3)
    assert (picture == red).all(axis=1).any()
    assert not (plain == red).all(axis=1).any()


def test_what_is_no_volume_has_no_slices(volume):
    with pytest.raises(CCWSIMError, match="need a volume"):
        slices_of(volume[0])


def test_a_report_shows_slices_of_volumes_and_counts_wrong_data():
    image = TrainingImage(np.random.default_rng(0).integers(0, 2, (4, 24, 24)))
    p = Parameters(template_size=(2, 8, 8), overlap_size=(1, 4, 4), wavelet_level=(0, 1, 1))
    data = HardData([[2, 8, 8], [0, 3, 3]], [1, 0])
    grid = Grid(16, 16, nz=4)
    ensemble = simulate(image, grid, p, data, n_realizations=3)
    shown = ensemble.indices[0].copy()
    shown[2, 8, 8] = 0
    picture = map_picture(shown, image, FACIES, "Realization 1", data)
    assert picture.caption.startswith("Realization 1; 1 of 2 data not honoured (red rings); slices")
    assert picture.alt.startswith("Slices of a volume")
    assert pixels(picture.png).shape[1] > 3 * 16
    probability = etype(ensemble).probability[1]
    assert "slices through the middle" in share_picture(probability, "Probability").caption
    own = layers_bundle(ensemble, 1)
    chart = layers_chart(ensemble, 1, own, LIGHT)
    assert own.each == pytest.approx(vertical_proportions(ensemble)[:, 1])
    marks = next(trace for trace in chart.data if trace.name == "hard data")
    assert marks.y.tolist() == [0.5, 2.5]
    assert marks.x.tolist() == [0, 100]
