"""Test that unclear properties of a file are guessed, and that each guess raises a question."""

from __future__ import annotations

from dataclasses import replace
from io import BytesIO

import numpy as np
import pytest
from hypothesis import given, strategies as st
from hypothesis.extra.numpy import arrays
from PIL import Image, ImageFilter

import ccwsim.io as cio
from ccwsim import CCWSIMError, Grid
from ccwsim.io.gridding import FilePart, largest_without_gaps
from ccwsim.io.limits import UPLOAD_LIMITS, limited
from tests.io import every_reader, sample_files as sample
from tests.io.sample_files import FACIES

GAPS = np.where(FACIES == 2, np.nan, FACIES)


def saved(array: np.ndarray) -> bytes:
    file = BytesIO()
    np.save(file, array)
    return file.getvalue()


def picture(rgb: np.ndarray, kind: str = "PNG") -> bytes:
    file = BytesIO()
    Image.fromarray(rgb.astype(np.uint8)).save(file, kind)
    return file.getvalue()


def blurred(colours: list[tuple[int, int, int]], size: int = 96) -> bytes:
    """Return stripes of the given colours with soft edges, which have many further colours."""
    stripes = np.repeat(np.array(colours), size // len(colours), axis=0)
    image = Image.fromarray(np.tile(stripes, (size, 1, 1)).astype(np.uint8))
    file = BytesIO()
    image.filter(ImageFilter.GaussianBlur(4)).save(file, "PNG")
    return file.getvalue()


def test_a_file_that_leaves_nothing_open_asks_nothing():
    for name in ("sgems", "png", "esri"):
        assert cio.guess_answers(BytesIO(sample.training_images()[name])) == ({}, ())


VOLUME = np.stack([FACIES] * 5)
OPEN = {
    "two variables": (sample.two_variables(), ("variable",), {"variable": "facies"}),
    "a table": (sample.gslib_table(), ("shape",), {"shape": (3, 4)}),
    "a volume": (saved(VOLUME), ("slice", "up"), {"volume": True}),
    "gaps": (saved(GAPS), ("up", "gaps"), {}),
    "grey values": (saved(FACIES * 0.1 + 0.05), ("up", "values"), {"threshold": 0.1}),
}


@pytest.mark.parametrize("what", OPEN)
def test_each_question_has_a_guess_with_which_the_file_is_read(what):
    content, asked, guess = OPEN[what]
    found, questions = cio.guess_answers(BytesIO(content))
    assert questions == asked
    assert guess == {name: found[name] for name in guess} or what == "grey values"
    assert set(found) == set(guess)
    assert cio.read_training_image(BytesIO(content), **found).n_facies > 1


def test_layers_are_a_volume_unless_one_is_wanted():
    content = saved(VOLUME)
    assert cio.guess_answers(BytesIO(content), {"slice_index": 1})[0] == {"slice_index": 1}
    one, asked = cio.guess_answers(BytesIO(content), {"volume": False})
    assert (one, asked) == ({"volume": False, "slice_index": len(VOLUME) // 2}, ("slice", "up"))
    layer = cio.read_training_image(BytesIO(content), **one).array
    assert layer.tolist() == VOLUME[len(VOLUME) // 2].tolist()
    flat = saved(FACIES)
    assert "volume" not in cio.guess_answers(BytesIO(flat))[0]
    own = cio.guess_answers(BytesIO(flat), {"volume": False})[0]
    assert cio.read_training_image(BytesIO(flat), **own).array.shape == FACIES.shape
    section = saved(VOLUME[:, :1])
    assert "slice" not in cio.guess_answers(BytesIO(section))[1]


def test_an_answer_is_kept_and_the_rest_is_guessed_with_it():
    content = sample.two_variables()
    found, asked = cio.guess_answers(BytesIO(content), {"variable": "porosity"})
    assert asked == ("variable", "values")
    assert found["variable"] == "porosity"
    assert 0 < found["threshold"] < 0.2


@pytest.mark.parametrize("n", [2, 3, 4])
def test_a_soft_picture_is_read_in_as_many_colours_as_it_has(n):
    colours = [(20, 40, 160), (240, 180, 40), (30, 160, 70), (200, 30, 30)][:n]
    content = blurred(colours)
    found, asked = cio.guess_answers(BytesIO(content))
    assert asked == ("values",)
    assert found == {"classes": n}
    own = cio.read_colours(BytesIO(content), **found)
    for colour in colours:
        near = [[int(c[k : k + 2], 16) for k in (1, 3, 5)] for c in own.values()]
        assert np.abs(np.array(near) - colour).max(axis=1).min() < 40


def test_a_grey_picture_is_cut_between_its_greys():
    content = blurred([(30,) * 3, (200,) * 3])
    found, _ = cio.guess_answers(BytesIO(content))
    assert 60 < found["threshold"] < 170
    assert cio.read_colours(BytesIO(content), **found) == {}
    facies = cio.read_training_image(BytesIO(content), **found).array
    assert set(facies[:, 0].tolist()) == {0}
    assert set(facies[:, -1].tolist()) == {1}


def test_colours_of_facies_are_those_of_the_picture():
    rgb = np.array([[[255, 0, 0], [0, 0, 255]]])
    assert cio.read_colours(BytesIO(picture(rgb))) == {0: "#0000ff", 1: "#ff0000"}


@pytest.mark.parametrize("kind", ["png", "npy"])
def test_what_is_too_large_is_thinned_or_cut(kind):
    rng = np.random.default_rng(3)
    codes = np.kron(rng.integers(0, 2, (12, 18)), np.ones((5, 5), int))
    content = saved(codes) if kind == "npy" else picture(codes[::-1] * 255)
    with limited(replace(UPLOAD_LIMITS, cells=1000)):
        with pytest.raises(CCWSIMError, match="60 × 90 values are more than 1000"):
            cio.read_training_image(BytesIO(content))
        found, asked = cio.guess_answers(BytesIO(content))
        assert asked[0] == "part"
        assert found == {"every": 3}
        thin = cio.read_training_image(BytesIO(content), **found)
        assert thin.array.tolist() == codes[1::3, 1::3].tolist()
        piece = cio.read_training_image(BytesIO(content), crop=(10, 20, 25, 40))
        assert piece.array.tolist() == codes[10:35, 20:60].tolist()
        both = cio.read_training_image(BytesIO(content), crop=(10, 20, 26, 41), every=5)
        assert both.array.tolist() == codes[12:35:5, 22:60:5].tolist()
    with limited(replace(UPLOAD_LIMITS, cells=1000, whole=2000)), pytest.raises(CCWSIMError):
        cio.guess_answers(BytesIO(content))


@pytest.mark.parametrize("make", [dict, tuple])
def test_facies_are_merged_with_another_or_with_the_nearest(make):
    cells = np.repeat([4, 7, 2, 7, 9, 9], 3)[None].repeat(3, axis=0)
    merge = make([(7, 4), (9, None)])
    image = cio.read_training_image(BytesIO(sample.npy(cells)), merge=merge)
    assert image.array[0].tolist() == [4] * 6 + [2] * 3 + [4] * 9
    both = cio.read_training_image(BytesIO(sample.npy(cells)), merge={7: None, 9: 2})
    assert both.array[0].tolist() == [4] * 5 + [2] * 13
    for wrong, said in (
        ({5: 4}, "5 does not occur"),
        ("a", "must map"),
        (dict.fromkeys([2, 4, 7, 9]), "leaves no"),
    ):
        with pytest.raises(CCWSIMError, match=said):
            cio.read_training_image(BytesIO(sample.npy(cells)), merge=wrong)


OF_POINTS = ("excel", "geopackage", "shapefile", "geojson", "table")


@pytest.mark.parametrize("kind", sorted({*every_reader.FILES} - {*OF_POINTS}))
def test_every_reader_of_grids_takes_a_part_of_what_is_too_large(kind):
    content = every_reader.files().get(kind)
    if content is None:
        pytest.skip(f"reading {kind} needs {every_reader.NEEDS[kind]}")
    cells = every_reader.CELLS
    up = {"up": True} if kind == "npy" else {}
    with limited(replace(UPLOAD_LIMITS, cells=20)):
        found, asked = cio.guess_answers(BytesIO(content), up)
        assert asked[0] == "part"
        assert found["every"] == 2
        thin = cio.read_training_image(BytesIO(content), **found)
        assert ranks(thin.array) == ranks(cells[::2, 1::2])
        found, _ = cio.guess_answers(BytesIO(content), {"crop": (1, 2, 4, 5), **up})
        piece = cio.read_training_image(BytesIO(content), **found)
        assert ranks(piece.array) == ranks(cells[1:5, 2:7])
        large, _ = cio.guess_answers(BytesIO(content), {"crop": (0, 1, 6, 7), **up})
        assert large["every"] == 2  # a piece that is too large is thinned


@pytest.mark.parametrize("shape", [(10**4, 10**4), (2**40, 2**40), (2,) * 40])
def test_what_is_too_large_even_for_a_part_is_refused(shape):
    header = BytesIO()
    said = {"descr": "<f8", "fortran_order": False, "shape": shape}
    np.lib.format.write_array_header_1_0(header, said)
    with limited(UPLOAD_LIMITS), pytest.raises(CCWSIMError):
        cio.guess_answers(BytesIO(header.getvalue()))


def ranks(codes: np.ndarray) -> list[list[int]]:
    """Return codes numbered from 0, because a picture has other codes."""
    return np.unique(codes, return_inverse=True)[1].reshape(codes.shape).tolist()


@pytest.mark.parametrize("kind", ["npy", "npz", "sgems", "mat", "vti"])
def test_layers_of_a_volume_that_is_too_large(kind):
    cells = np.arange(6 * 10 * 14).reshape(6, 10, 14) % 7 % 3
    grid = Grid(10, 14, nz=6, cell_size=(10.0, 20.0, 0.5), origin=(500.0, 700.0, -30.0))
    content = {
        "npy": lambda: sample.npy(cells),
        "npz": lambda: sample.npz(ti=cells),
        "sgems": lambda: b"14 10 6 10 20 .5 500 700 -30\n1\nv\n" + sample.text_values(cells),
        "mat": lambda: sample.mat(ti=np.moveaxis(cells, 0, 2)),
        "vti": lambda: cio.maps_as_bytes({"facies": cells}, grid, "vti"),
    }[kind]()
    with limited(replace(UPLOAD_LIMITS, cells=300)):
        found, asked = cio.guess_answers(BytesIO(content))
        assert asked[:2] == ("part", "slice")
        assert found == {"every": 2, "volume": True}
        thin = cio.read_training_image(BytesIO(content), **found)
        assert thin.array.tolist() == cells[:, ::2, 1::2].tolist()
        part = {"crop": (1, 2, 5, 9), "layers": (1, 3)}
        found, _ = cio.guess_answers(BytesIO(content), part)
        piece = cio.read_training_image(BytesIO(content), **found)
        assert piece.array.tolist() == cells[1:4, 1:6, 2:11].tolist()
        turned = cio.read_training_image(BytesIO(content), **found, z_up=False, up=False)
        assert turned.array.tolist() == cells[::-1, ::-1][1:4, 1:6, 2:11].tolist()
        if kind in ("sgems", "vti"):
            place = cio.read_geometry(BytesIO(content), **found)
            assert place == replace(grid, ny=5, nx=9, nz=3, origin=(520.0, 720.0, -29.5))
        one, _ = cio.guess_answers(BytesIO(content), part | {"layers": (2, 1)})
        layer = cio.read_training_image(BytesIO(content), **one)
        assert layer.array.tolist() == cells[2, 1:6, 2:11].tolist()
        with pytest.raises(CCWSIMError, match=r"layers = \(4, 3\)"):
            cio.read_training_image(BytesIO(content), **part | {"layers": (4, 3)})


@pytest.mark.parametrize("crop", [(0, 0, 4, 4), (-1, 0, 2, 2), (0, 3, 1, 2), "all", (1, 2)])
def test_a_piece_outside_is_refused_in_words(crop):
    with pytest.raises(CCWSIMError, match="crop"):
        cio.read_training_image(BytesIO(saved(FACIES)), crop=crop)


@given(arrays(bool, st.tuples(st.integers(1, 7), st.integers(1, 7))))
def test_the_largest_piece_without_gaps_against_all_pieces(known):
    ny, nx = known.shape
    areas = [
        height * width
        for row in range(ny)
        for column in range(nx)
        for height in range(1, ny - row + 1)
        for width in range(1, nx - column + 1)
        if known[row : row + height, column : column + width].all()
    ]
    row, column, height, width = largest_without_gaps(known)
    assert height * width == max(areas, default=0)
    assert known[row : row + height, column : column + width].all()


@given(st.integers(1, 4), arrays(np.uint8, st.tuples(st.integers(4, 12), st.integers(4, 12))))
def test_a_thinned_grid_has_cells_of_the_middle_of_each_square(every, grid):
    thin = FilePart(every=every).of("a", grid)
    ny, nx = grid.shape
    assert thin.shape == (ny // every, nx // every)
    rows = np.arange(ny // every) * every + (every - 1) // 2
    columns = np.arange(nx // every) * every + every // 2
    assert (thin == grid[np.ix_(rows, columns)]).all()


def test_a_file_without_any_value_is_refused_in_words():
    with pytest.raises(CCWSIMError, match="no cell has a value"):
        cio.guess_answers(BytesIO(saved(np.full((3, 4), np.nan))))
