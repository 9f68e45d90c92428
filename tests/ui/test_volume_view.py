"""Test that the browser receives all cells of a volume once, together with its data."""

from __future__ import annotations

import zlib
from base64 import b64decode

import numpy as np
import pytest
from streamlit.testing.v1 import AppTest

from ccwsim import Grid, HardData, TrainingImage
from ccwsim.figures.style import N_STEPS
from ccwsim.ui.frontend.cells import (
    editor_points,
    facies_map,
    map_content,
    number_map,
    volume_content,
)

COLOURS = ["#112233", "#445566", "#778899"]
IMAGE = TrainingImage(
    np.random.default_rng(5).choice([0, 4, 7], (6, 9, 8)), facies_names=("mud", "silt", "sand")
)


def cells_of(content: dict) -> np.ndarray:
    """Return the cells unpacked as in the browser: x fastest, then y, then z from the bottom."""
    nx, ny, nz = content["shape"]
    cells = np.frombuffer(zlib.decompress(b64decode(content["cells"])), np.uint8)
    return cells.reshape(nz, ny, nx)


@pytest.mark.parametrize("order", ["C", "F"])
def test_all_cells_of_a_volume_are_sent(order):
    indices = np.asarray(IMAGE.indices, order=order)
    content = volume_content(facies_map(indices, IMAGE, COLOURS, "An image"), "image")
    np.testing.assert_array_equal(cells_of(content), IMAGE.indices)
    assert content["labels"] == ["mud", "silt", "sand"]
    assert content["lut"] == content["point_lut"] == COLOURS


def test_all_cells_of_a_map_are_sent():
    content = map_content(facies_map(IMAGE.indices[2], IMAGE, COLOURS, "A map"))
    cells = np.frombuffer(zlib.decompress(b64decode(content["cells"])), np.uint8)
    np.testing.assert_array_equal(cells.reshape(content["ny"], content["nx"]), IMAGE.indices[2])


def test_volumes_are_told_apart_by_their_cells_and_shape():
    zeros = np.zeros((2, 3, 4), np.uint8)
    changed = zeros.copy()
    changed[1, 2, 3] = 1
    shown = {}
    for name, indices in {"a": zeros, "b": changed, "c": zeros.reshape(4, 3, 2)}.items():
        shown[name] = volume_content(facies_map(indices, IMAGE, COLOURS, name), "one key")
        np.testing.assert_array_equal(cells_of(shown[name]), indices)
    assert shown["a"]["digest"] != shown["b"]["digest"]
    assert shown["a"]["shape"] == [4, 3, 2]
    assert shown["c"]["shape"] == [2, 3, 4]


def test_a_volume_of_probabilities_is_sent_to_the_nearest_step():
    shares = np.random.default_rng(1).random((4, 5, 6))
    content = volume_content(number_map(shares, "P(sand) =", "Probability"), "probability")
    np.testing.assert_allclose(cells_of(content) / N_STEPS, shares, atol=0.5 / N_STEPS + 1e-12)
    assert content["labels"][100] == "P(sand) = 0.50"
    assert content["strip"]["high"] == "1"


def test_data_of_a_volume_have_their_layer_and_say_what_is_wrong():
    data = HardData([[5, 2, 1], [0, 8, 7]], [7, 4])
    realization = np.zeros((6, 9, 8), int)
    realization[5, 2, 1] = 7
    points = editor_points(data, IMAGE, realization)
    assert points == [[0, 8, 7, 1, 1], [5, 2, 1, 2, 0]]
    shown = facies_map(IMAGE.indices, IMAGE, COLOURS, "A volume")
    shown.points.extend(points)
    assert volume_content(shown, "data")["wrong_label"] == "1 not honoured"
    assert editor_points(HardData(), IMAGE) == []


def test_data_of_a_map_are_as_before():
    image = TrainingImage([[0, 1], [1, 0]])
    points = editor_points(HardData([[1, 0]], [1]), image, np.array([[0, 0], [0, 0]]))
    assert points == [[1, 0, 1, 1]]


def test_coordinates_are_those_of_the_grid():
    shown = facies_map(IMAGE.indices, IMAGE, COLOURS, "A volume")
    grid = Grid(9, 8, (25.0, 20.0, 0.5), (500.0, 600.0, -40.0), nz=6)
    content = volume_content(shown, "a", grid=grid)
    assert content["axes"]
    assert content["cell_size"] == [25.0, 20.0, 0.5]
    assert content["origin"] == [500.0, 600.0, -40.0]
    assert not volume_content(shown, "a")["axes"]


def _page() -> None:
    from ccwsim.ui.frontend.cells import draw_cells, draw_editable
    from tests.ui.test_volume_view import COLOURS, IMAGE, facies_map

    shown = facies_map(IMAGE.indices, IMAGE, COLOURS, "An image")
    draw_editable(shown, lambda edits: None, {}, link="all")
    draw_cells(shown, "slices", link="all", body=False, max_height=200)


def test_a_page_draws_volumes_again_and_again():
    app = AppTest.from_function(_page).run()
    assert not app.exception
    assert not app.run().exception
