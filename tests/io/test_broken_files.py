"""Test that broken and hostile files quickly raise a CCWSIMError, with little memory."""

from __future__ import annotations

import io
import os
import random
import tracemalloc
import zipfile
import zlib
from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings, strategies as st
from PIL import Image

import ccwsim.io as cio
from ccwsim import CCWSIMError, Grid, TrainingImage
from ccwsim.io.limits import SCRIPT_LIMITS, UPLOAD_LIMITS, limited
from tests.io import sample_files as sample

pytestmark = pytest.mark.filterwarnings("ignore::UserWarning:PIL")

SAMPLES = {
    **sample.training_images(),
    **{f"hard {k}": v for k, v in sample.hard_data().items()},
    "two variables": sample.two_variables(),
    "table": sample.gslib_table(),
    "jpeg": sample.picture("JPEG"),
    "realizations npz": sample.realizations("npz"),
    "realizations gslib": sample.realizations("gslib"),
    "probabilities": sample.probabilities(),
    "vertical curves": sample.vertical_curves(),
    "polygons": sample.polygons(),
}
TI = TrainingImage(sample.FACIES)
NUMBERS = b"-1 0 99999999999999999999 nan inf 1e308 1e999 1_0 \xc2\xb2".split()
WORDS = (*NUMBERS, b"\n", b"\x00", b",", b";", b"\t", b"\xff\xff\xff\xff", b"")


@pytest.fixture
def _small_limit():
    """Set a low limit of cells, so that large sizes in damaged files are refused quickly."""
    with limited(replace(UPLOAD_LIMITS, cells=100_000)):
        yield


def read_every_way(content: bytes) -> int:
    """Read a file as every kind of data; count the successes, and ignore each CCWSIMError."""
    n = 0
    for call in (
        lambda file: cio.inspect(file),
        lambda file: cio.read_training_image(file, shape=(3, 4)),
        lambda file: cio.read_training_image(file, threshold=1),
        lambda file: cio.read_grid(file, slice_index=0),
        lambda file: cio.read_realizations(file),
        lambda file: cio.read_realizations(file, TI),
        lambda file: cio.import_hard_data(file),
        lambda file: cio.import_hard_data(
            file, Grid(3, 4), TI, on_collision="majority", on_outside="drop", on_unknown="drop"
        ),
        lambda file: cio.read_probabilities(file, Grid(3, 4)),
        lambda file: cio.read_probabilities(file, Grid(3, 4, nz=5), 1),
        lambda file: cio.read_values(file, Grid(3, 4)),
        lambda file: cio.read_active(file, Grid(3, 4)),
    ):
        with suppress(CCWSIMError):
            call(io.BytesIO(content))
            n += 1
    return n


def changed(content: bytes, source: random.Random) -> bytes:
    data = bytearray(content)
    way = source.randrange(5)
    if way == 0:
        return bytes(data[: source.randrange(len(data))])
    for _ in range(source.randint(1, 4)):
        at = source.randrange(len(data) + 1)
        if way == 1:
            data[at : at + 1] = bytes([source.choice([0, 1, 127, 128, 255, source.randrange(256)])])
        elif way == 2:
            data[at : at + source.randint(0, 4)] = source.choice(WORDS)
        elif way == 3:
            start = source.randrange(len(data) + 1)
            data[at:at] = data[start : start + 20]
        else:
            del data[at : at + source.randint(1, 10)]
    return bytes(data)


@pytest.mark.filterwarnings("ignore:.*have no value:UserWarning")
@pytest.mark.filterwarnings("error")
@pytest.mark.usefixtures("_small_limit")
@pytest.mark.parametrize("name", SAMPLES)
def test_changed_files(name):
    assert read_every_way(SAMPLES[name]) > 0, "the sample itself is good"
    source = random.Random(name)
    for _ in range(25):
        read_every_way(changed(SAMPLES[name], source))


@pytest.mark.usefixtures("_small_limit")
@pytest.mark.parametrize("name", ["npy", "npz", "mat", "packed mat", "png", "gif", "tiff"])
def test_files_cut_at_any_byte_are_never_read_as_something_else(name):
    content = SAMPLES[name]
    for end in range(0, len(content), 7):
        with suppress(CCWSIMError):
            ti = cio.read_training_image(io.BytesIO(content[:end]))
            assert ti.array.tolist() == sample.FACIES.tolist()


@pytest.mark.parametrize("name", ["sgems", "geone", "esri"])
def test_texts_that_end_early_say_so(name):
    content = SAMPLES[name].rstrip().rsplit(None, 1)[0]
    with pytest.raises(CCWSIMError, match="states"):
        cio.read_training_image(io.BytesIO(content))


ARRAYS = (b"\x93NUMPY\x01\x00", b"PK\x03\x04", b"MATLAB 5.0 MAT-file".ljust(126) + b"IM")
PICTURES = (b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff", b"GIF89a", b"II*\x00")
TEXTS = (b"3 3 1\n1\na\n", b"ncols ", b"t\n2\n", b"\xff\xfe", b"x,y,facies\n")
starts = st.sampled_from((b"", *ARRAYS, *PICTURES, *TEXTS))


@settings(max_examples=150)
@given(starts, st.binary(max_size=200))
def test_random_bytes(start, rest):
    read_every_way(start + rest)


@settings(max_examples=100)
@example(';\n0"')  # a line with nothing but its number
@given(st.text(alphabet='0123456789.-+eEnaN,; \t\n"#xyfacies', max_size=120))
def test_random_texts(text):
    read_every_way(text.encode())


def header_only_npy(shape: str) -> bytes:
    header = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}".encode()
    header = header.ljust(117) + b"\n"
    return b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header


def promising_mat() -> bytes:
    content = bytearray(sample.mat(ti=np.zeros((5, 6))))
    at = content.index(np.array([5, 6], "<i4").tobytes())
    content[at : at + 8] = np.array([2**30, 2**30], "<i4").tobytes()
    return bytes(content)


def bomb_mat() -> bytes:
    """Return a packed variable of few cells that states 2 GB of values and unpacks to 200 MB."""
    words = np.array([14, 2**31, 6, 8, 6, 0, 5, 8, 3, 3, 1, 2, 0x6974, 0, 9, 2**31 - 99], "<u4")
    packed = zlib.compress(words.tobytes() + bytes(200 * 2**20), 1)
    header = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"
    return header + np.array([15, len(packed)], "<u4").tobytes() + packed


def bomb_npz() -> bytes:
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for k in range(3):
            archive.writestr(f"{k}.npy", header_only_npy("(2000, 2000)") + bytes(40 * 2**20))
    return content.getvalue()


def large_png() -> bytes:
    content = bytearray(sample.picture())
    content[16:24] = (60_000).to_bytes(4, "big") * 2
    content[29:33] = zlib.crc32(content[12:29]).to_bytes(4, "big")
    return bytes(content)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (header_only_npy("(100000, 100000)"), "are more than"),
        (header_only_npy("(-1, 5)"), "empty"),
        (header_only_npy("(1000, 1000)"), "ends before the 1000000 values"),
        (header_only_npy("(" * 80), "NumPy header is broken"),
        (promising_mat(), "are more than"),
        (b"100000 100000 100\n1\nfacies\n0\n", "are more than"),
        (b"100000 100 0\n1\nfacies\n0\n", "is empty or"),
        (b"4 4 1\n99999999999\nfacies\n0\n", "variables or columns are more than 1000"),
        (b"ncols 99999999\nnrows 99999999\n0 0\n", "are more than"),
        (b"ncols 1e999\nnrows 2\n0 0\n", "must be a whole number"),
        (large_png(), "more than 178956970 pixels"),
    ],
)
def test_absurd_promises_take_no_memory(content, message):
    tracemalloc.start()
    try:
        with pytest.raises(CCWSIMError, match=message):
            cio.read_training_image(io.BytesIO(content))
        assert tracemalloc.get_traced_memory()[1] < 5e6
    finally:
        tracemalloc.stop()


@pytest.mark.slow
@pytest.mark.parametrize("make", [bomb_mat, bomb_npz])
def test_packed_files_unpack_to_no_more_than_the_limit(make):
    content = make()
    tracemalloc.start()
    try:
        small = limited(replace(SCRIPT_LIMITS, unpacked=10 * 2**20))
        with (
            small,
            pytest.raises(CCWSIMError, match="unpacks to"),
        ):
            cio.read_training_image(io.BytesIO(content))
        assert tracemalloc.get_traced_memory()[1] < 40e6
    finally:
        tracemalloc.stop()


def test_large_files_are_refused_before_they_are_read(tmp_path):
    path = tmp_path / "large.dat"
    path.write_bytes(b"0 1\n" * 1000)
    for file in (path, io.BytesIO(path.read_bytes())):
        small = limited(replace(UPLOAD_LIMITS, bytes=1000))
        with small, pytest.raises(CCWSIMError, match=r"MB, more than 0.000954 MB"):
            cio.read_training_image(file)


def test_pickles_are_never_loaded(tmp_path):
    class Trap:
        def __reduce__(self):
            return os.mkdir, (str(tmp_path / "sprung"),)

    for save in (np.save, np.savez):
        content = io.BytesIO()
        save(content, np.array([[Trap()]], dtype=object))
        with pytest.raises(CCWSIMError, match="are not numbers; save real numbers"):
            cio.read_training_image(io.BytesIO(content.getvalue()))
    assert not (tmp_path / "sprung").exists()


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "is empty"),
        (b" \r\n\x00", "is empty"),
        (b"\x07\x00\x01\x02", "has an unknown format"),
        (b"MATLAB 7.3 MAT-file", "the HDF5 file cannot be read"),
        (b"\x89HDF\r\n\x1a\n", "the HDF5 file cannot be read"),
        (b"PK\x05\x06" + bytes(18), "is a zip archive without an array; unpack it"),
        (b"# only a remark\n", "contains no values"),
        (b"Dear Sir or Madam\n", "contains no numbers"),
        (b"3 2 1\n1\nfacies\n0\n0\n1_0\n1\n1\n0\n", "line 6: '1_0' is not a number"),
        (b"3 2 1\n1\nfacies\n0\n0\nsand\n1\n1\n0\n", "line 6: 'sand' is not a number"),
        (b"3 2 1\n1\nfacies\n0\n0\n1\n1\n1\n0\n7\n", "6 values, but 7 follow"),
        (b"3 2 1\n3\nfacies\n", "ends before the 3 variable names"),
        (b"0 1 1\n0 1\n", "line 2: 2 fields, but 3 are needed"),
        (b"0 1 1\n0 1 sand\n0 1 2\n", "'sand' is not a number"),
        (sample.npy(np.array([["a"]])), "are not numbers"),
        (sample.npy(np.array([[1j]])), "are not numbers"),
        (sample.npy(np.arange(3)), r"shape \(3,\) is not a grid"),
        (sample.npz(a=np.arange(3)), "no array of the file has rows and columns"),
        (sample.npy(np.array([[0, np.inf]])), "inf is not finite"),
        (sample.npy(np.zeros((0, 4))), "is empty"),
        (sample.picture()[:60], "picture"),
    ],
)
def test_errors_name_the_trouble(content, message):
    with pytest.raises(CCWSIMError, match=message):
        cio.read_training_image(io.BytesIO(content))


def test_paths_that_are_no_files(tmp_path):
    for path in (tmp_path, tmp_path / "none", "a\x00b", tmp_path / ("x" * 300), os.devnull):
        with pytest.raises(CCWSIMError):
            cio.read_training_image(path)
    for thing in (None, 5, b"0 1", io.StringIO("0 1")):
        with pytest.raises(CCWSIMError, match="binary"):
            cio.read_training_image(thing)
    closed = io.BytesIO(b"0 1")
    closed.close()
    with pytest.raises(CCWSIMError, match="cannot be read"):
        cio.read_training_image(closed)


def test_sixteen_bit_pictures_are_numbers():
    content = io.BytesIO()
    Image.fromarray(np.array([[1000, 7], [7, 7]], np.uint16)).save(content, "PNG")
    assert cio.read_training_image(content).array.tolist() == [[7, 7], [1000, 7]]
