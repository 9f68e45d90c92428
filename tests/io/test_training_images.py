"""Test that every format gives the same training image, with row 0 in the south."""

from __future__ import annotations

from io import BytesIO

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from PIL import Image

import ccwsim.io as cio
from ccwsim import CCWSIMError, TrainingImage
from tests.io import sample_files as sample
from tests.io.sample_files import FACIES

SAMPLES = sample.training_images()

SHAPES = array_shapes(min_dims=2, max_dims=2, max_side=9)
small_codes = arrays(np.uint8, SHAPES, elements=st.integers(0, 15))
any_codes = arrays(np.int64, SHAPES, elements=st.sampled_from([-5, 0, 1, 2, 77, 300, 10**12]))


def read(content: bytes, **choices) -> np.ndarray:
    return cio.read_training_image(BytesIO(content), **choices).array


@pytest.mark.parametrize("name", SAMPLES)
def test_every_format_reads_alike(name):
    assert read(SAMPLES[name]).tolist() == FACIES.tolist()


@pytest.mark.parametrize(
    "name", ["sgems", "geone", "sized gslib", "esri", "matrix", "comma matrix"]
)
def test_texts_with_crlf_and_byte_order_mark_read_alike(name):
    content = sample.crlf(SAMPLES[name])
    assert read(content).tolist() == FACIES.tolist()
    assert read(b"\xef\xbb\xbf" + content).tolist() == FACIES.tolist()
    assert read(content.decode().encode("utf-16")).tolist() == FACIES.tolist()
    assert read(content.replace(b"\r\n", b"\r")).tolist() == FACIES.tolist()


@pytest.mark.parametrize("name", SAMPLES)
def test_up_names_the_end_of_the_first_row(name):
    south = read(SAMPLES[name], up=True)
    north = read(SAMPLES[name], up=False)
    assert south.tolist() == north[::-1].tolist()
    assert FACIES.tolist() in (south.tolist(), north.tolist())


def test_transpose():
    assert read(SAMPLES["npy"], transpose=True).tolist() == FACIES.T.tolist()


@given(any_codes)
def test_round_trip_of_any_codes(codes):
    ti = TrainingImage(codes)
    for format in ("npy", "sgems", "gslib", "dat"):
        back = read(cio.training_image_as_bytes(ti, format))
        assert back.dtype == ti.array.dtype
        assert (back == ti.array).all()


@given(small_codes)
def test_round_trip_of_a_png(codes):
    ti = TrainingImage(codes)
    assert (read(cio.training_image_as_bytes(ti, "png")) == ti.array).all()


def test_png_of_codes_that_are_no_bytes_keeps_the_facies_apart():
    ti = TrainingImage(FACIES * 1000 - 7)
    assert read(cio.training_image_as_bytes(ti, "png")).tolist() == FACIES.tolist()


def test_png_of_many_facies_comes_back():
    ti = TrainingImage(np.arange(200).reshape(20, 10))
    assert (read(cio.training_image_as_bytes(ti, "png")) == ti.array).all()


def test_palettes_and_greys_can_be_codes():
    mask = Image.fromarray(np.array([[5, 2], [2, 9]], np.uint8))
    for image in (mask, mask.copy()):
        if image is not mask:
            image.putpalette([255 - k // 3 for k in range(768)])
        content = BytesIO()
        image.save(content, "PNG")
        assert read(content.getvalue(), classes="codes").tolist() == [[2, 9], [5, 2]]
    assert read(content.getvalue()).tolist() == [[2, 0], [1, 2]], "by default from dark to light"


def test_png_shows_the_north_at_the_top_in_the_colours_given():
    ti = TrainingImage([[0, 0], [3, 3]])
    content = cio.training_image_as_bytes(ti, "png", colours=["#102030", "#fff000"])
    pixels = np.array(Image.open(BytesIO(content)).convert("RGB"))
    assert pixels[0, 0].tolist() == [0xFF, 0xF0, 0x00]
    assert pixels[-1, 0].tolist() == [0x10, 0x20, 0x30]


@given(arrays(np.float64, (4, 5), elements=st.floats(0, 100)), st.floats(1, 99))
def test_threshold_is_the_class_at_or_above(values, threshold):
    assert (read(sample.npy(values), threshold=threshold) == (values >= threshold)).all()
    assert (read(sample.npy(values), classes=[threshold]) == (values >= threshold)).all()


def test_continuous_values_ask_for_classes():
    values = np.linspace(0, 1, 60).reshape(6, 10)
    with pytest.raises(CCWSIMError, match="look continuous; give threshold="):
        read(sample.sgems(values))
    assert np.bincount(read(sample.sgems(values), classes=3).ravel()).tolist() == [20, 20, 20]
    grey = np.arange(60).reshape(6, 10)
    with pytest.raises(CCWSIMError, match="look continuous"):
        read(sample.npy(grey))
    assert (read(sample.npy(grey), classes="codes") == grey).all()


@settings(max_examples=30)
@given(arrays(np.float64, 60, elements=st.floats(-9, 9), unique=True), st.integers(2, 9))
def test_classes_hold_equally_many(values, n):
    counts = np.bincount(cio.classify(values, classes=n), minlength=n)
    assert len(counts) == n
    assert counts.max() - counts.min() <= 1


@pytest.mark.parametrize("classes", [1, 0, -3, 255, [], [2, 1], [1, 1], ["a"], [np.nan], "many"])
def test_impossible_classes_say_so(classes):
    with pytest.raises(CCWSIMError, match=r"classes|threshold"):
        cio.classify(np.linspace(0, 1, 50), classes=classes)


def test_threshold_and_classes_together_say_so():
    with pytest.raises(CCWSIMError, match="either a threshold or classes"):
        cio.classify([0, 1], threshold=1, classes=2)


def test_ties_that_leave_too_few_classes_say_so():
    with pytest.raises(CCWSIMError, match="only 1 classes"):
        cio.classify([0, 0, 0, 1], classes=2)


def test_several_variables_ask_which():
    content = sample.two_variables()
    with pytest.raises(CCWSIMError, match="2 variables: 'porosity', 'facies'; pick one"):
        read(content)
    assert read(content, variable="facies").tolist() == FACIES.tolist()
    assert read(content, variable="FACIES").tolist() == FACIES.tolist()
    assert read(content, variable="porosity", threshold=0.1).max() == 1
    with pytest.raises(CCWSIMError, match="no variable 'clay'"):
        read(content, variable="clay")


@pytest.mark.parametrize("content", [sample.gslib_table(), sample.crlf(sample.gslib_table())])
def test_classic_gslib_asks_for_the_shape(content):
    with pytest.raises(CCWSIMError, match=r"give shape=\(rows, columns\) for its 12 values"):
        read(content)
    assert read(content, shape=(3, 4)).tolist() == FACIES.tolist()
    for shape in ((5, 4), (3, 0), (3, 4, 2), (3.0, 4), (12,)):
        with pytest.raises(CCWSIMError, match=r"shape|fill|empty"):
            read(content, shape=shape)


def test_shape_against_a_header_says_so():
    with pytest.raises(CCWSIMError, match="leave out shape="):
        read(SAMPLES["sgems"], shape=(4, 3))
    assert read(SAMPLES["sgems"], shape=(3, 4)).tolist() == FACIES.tolist()


def test_3d_grids_ask_for_a_slice():
    cube = np.stack([FACIES, FACIES[::-1], 2 - FACIES])
    text = b"4 3 3\n1\nfacies\n" + sample.text_values(cube)
    matlab = sample.mat(ti=np.moveaxis(cube, 0, 2).astype(float))
    table = b"title\n1\nfacies\n" + sample.text_values(cube)
    for content, choices in (
        (text, {}),
        (sample.npy(cube), {}),
        (matlab, {}),
        (table, {"shape": (3, 4)}),
    ):
        with pytest.raises(CCWSIMError, match=r"3-D with 3 slices; choose one: slice_index=0 … 2"):
            read(content, **choices)
        for k in range(3):
            assert read(content, slice_index=k, **choices).tolist() == cube[k].tolist()
        with pytest.raises(CCWSIMError, match="not 3"):
            read(content, slice_index=3, **choices)


def test_a_vertical_section_needs_no_slice():
    section = b"4 1 3\n1\nfacies\n" + sample.text_values(FACIES)
    assert read(section).tolist() == FACIES.tolist()


def test_codes_with_the_noise_of_matlab_are_snapped():
    noisy = FACIES + np.array([1.1e-16, -1e-4, 0, 1e-4])
    assert read(sample.mat(ti=noisy)).tolist() == FACIES.tolist()


def test_matlab_integers_logicals_and_other_variables():
    for kind in (np.int8, np.uint8, np.int16, np.uint16, np.int32, np.uint32, np.int64, np.float32):
        assert read(sample.mat(ti=FACIES.astype(kind))).tolist() == FACIES.tolist()
    assert read(sample.mat(a=FACIES > 0)).tolist() == (FACIES > 0).tolist()
    mixed = sample.mat(compress=True, text="sand", cell={"a": 1}, z=FACIES * 1j, v=FACIES)
    assert read(mixed).tolist() == FACIES.tolist()
    with pytest.raises(CCWSIMError, match="no array of real numbers"):
        read(sample.mat(text="sand"))


@pytest.mark.parametrize("quality", [30, 60, 90])
def test_a_blurred_jpeg_asks_for_classes_and_gets_its_facies_back(quality):
    large = np.kron(FACIES, np.ones((24, 24), int))
    content = sample.picture("JPEG", large, quality=quality)
    with pytest.raises(
        CCWSIMError, match=r"colours, probably from blur or smooth edges; give classes="
    ):
        read(content)
    assert (read(content, classes=3) != large).mean() < 0.01
    assert (read(content, threshold=200) != (large == 2)).mean() < 0.01


def test_grey_pictures_are_counted_from_dark_to_light():
    content = BytesIO()
    Image.fromarray(np.array([[200, 10], [90, 200]], np.uint8)).save(content, "PNG")
    assert read(content.getvalue()).tolist() == [[1, 2], [2, 0]]
    assert read(content.getvalue(), threshold=90).tolist() == [[1, 1], [1, 0]]


def test_transparent_parts_are_unknown():
    rgba = np.zeros((1, 2, 4), np.uint8)
    rgba[0, 0, 3] = 255
    content = BytesIO()
    Image.fromarray(rgba).save(content, "PNG")
    with pytest.warns(UserWarning, match="1 of 2 pixels are transparent"):
        assert np.isnan(read(content.getvalue())).tolist() == [[False, True]]
    assert read(content.getvalue(), crop=(0, 0, 1, 1)).tolist() == [[0]]


@pytest.mark.parametrize("missing", [-99, -999, -997799, -9977799, np.nan])
def test_cells_without_a_value_are_named(missing):
    with pytest.warns(UserWarning, match="8 of 12 cells have no value"):
        assert np.isnan(read(sample.sgems(sample.with_gaps(missing)))).sum() == 8
    grid = cio.read_grid(BytesIO(sample.sgems(sample.with_gaps(missing))))
    assert np.isnan(grid).sum() == 8


def test_customary_codes_are_unknown_in_any_file_and_said():
    with pytest.warns(UserWarning, match=r"1 of 2 cells have no value \(-99 means unknown\)"):
        read(sample.npy(np.array([[-99, 0]])))


def test_the_name_is_the_files_and_a_clients_folders_are_left_out(tmp_path):
    path = tmp_path / "Sand body.npy"
    path.write_bytes(SAMPLES["npy"])
    assert cio.read_training_image(path).name == "Sand body"
    assert cio.read_training_image(str(path), name="mine").name == "mine"
    upload = BytesIO(SAMPLES["npy"])
    upload.name = "..\\..\\etc/pass\x00wd.npy"
    assert cio.read_training_image(upload).name == "passwd"
    assert cio.read_training_image(upload).shape == (3, 4), "read again from the start"


def test_inspect_says_what_is_open():
    summary = cio.inspect(BytesIO(sample.two_variables()))
    assert [v.name for v in summary.variables] == ["porosity", "facies"]
    assert [v.continuous for v in summary.variables] == [True, False]
    assert [v.n_distinct for v in summary.variables] == [3, 3]
    assert not summary.is_table
    assert cio.inspect(BytesIO(sample.gslib_table())).is_table
    assert cio.inspect(BytesIO(SAMPLES["npy"])).asks_up
    assert cio.inspect(BytesIO(sample.npy(np.zeros((5, 3, 4))))).n_slices == 5
    geone = cio.inspect(BytesIO(SAMPLES["geone"]))
    assert (geone.cell_size, geone.origin) == ((2.0, 2.0), (100.0, 200.0))
    assert cio.inspect(BytesIO(SAMPLES["esri"])).origin == (10.0, 20.0)
    jpeg = sample.picture("JPEG", np.kron(FACIES, np.ones((24, 24), int)))
    assert cio.inspect(BytesIO(jpeg)).variables[0].continuous
    assert cio.inspect(BytesIO(SAMPLES["png"])).variables[0].n_distinct == 3
