"""Test the limits of files, which the administrator sets for uploads; scripts have high limits."""

from __future__ import annotations

import io
import tracemalloc
from dataclasses import replace
from threading import Thread

import numpy as np
import pytest
from PIL import Image

import ccwsim.io as cio
from ccwsim import CCWSIMError, Grid, Parameters, TrainingImage, simulate
from ccwsim.datasets.sampling import sample_random
from ccwsim.io.limits import (
    SCRIPT_LIMITS,
    UPLOAD_LIMITS,
    VARIABLES,
    check_cells,
    limited,
    limits,
    upload_limits,
)
from ccwsim.io.opening import kind_of
from ccwsim.sharing.choices import Upload
from tests.fuzz.builders import mat, matrix, png
from tests.fuzz.mutations import zipped
from tests.io import sample_files as sample


def test_an_upload_is_limited_and_a_script_is_not():
    content = sample.npy(np.zeros((2001, 2000), np.uint8))
    assert cio.read_training_image(io.BytesIO(content)).shape == (2001, 2000)
    with limited(UPLOAD_LIMITS), pytest.raises(CCWSIMError, match="more than 4000000"):
        cio.read_training_image(io.BytesIO(content))
    assert limits() is SCRIPT_LIMITS


def test_scripts_may_read_realizations_of_a_hundred_million_cells():
    check_cells("r.npz", (10**4, 10**4))
    check_cells("r.npz", (25, 5000, 5000))


def test_the_owner_of_a_server_sets_limits():
    given = dict(
        zip(VARIABLES.values(), ("1000", "2000", "30", "60", "40", "50", "7e6", "0.5"), strict=True)
    )
    own = upload_limits(given)
    assert (own.bytes, own.unpacked, own.cells, own.points) == (1000, 2000, 30, 40)
    assert (own.whole, own.lines, own.memory, own.seconds) == (60, 50, 7_000_000, 0.5)
    assert upload_limits({"CCWSIM_MAX_UPLOAD_CELLS": "2e6"}).cells == 2_000_000
    assert upload_limits({}) == UPLOAD_LIMITS
    assert upload_limits({"CCWSIM_MAX_UPLOAD_CELLS": " "}) == UPLOAD_LIMITS


@pytest.mark.parametrize("said", ["many", "-1", "0", "nan", "inf", "0.5", "9" * 5000])
def test_a_limit_that_is_no_number_is_said(said):
    with pytest.raises(CCWSIMError, match=r"CCWSIM_MAX_UPLOAD_CELLS = .* above 0"):
        upload_limits({"CCWSIM_MAX_UPLOAD_CELLS": said})


def test_limits_of_one_visitor_are_none_of_anothers():
    seen = []
    with limited(UPLOAD_LIMITS):
        thread = Thread(target=lambda: seen.append(limits()))
        thread.start()
        thread.join()
    assert seen == [SCRIPT_LIMITS]


@pytest.mark.parametrize("limit", ["bytes", "cells", "points", "lines", "fields", "line_bytes"])
def test_each_limit_names_its_value_and_the_mend(limit):
    content = b"x,y,facies,word\n" + b"1,2,3,sand\n" * 60
    with limited(replace(UPLOAD_LIMITS, **{limit: 10})), pytest.raises(CCWSIMError) as told:
        cio.import_hard_data(io.BytesIO(content), facies="facies")
    remedies = "cut", "clean", "split", "without", "remove"
    assert any(word in str(told.value) for word in remedies)


def test_arrays_together_hold_no_more_than_one():
    half = np.zeros((100, 60), np.uint8)
    for content in (sample.npz(a=half, b=half), sample.mat(a=half, b=half)):
        few = limited(replace(UPLOAD_LIMITS, cells=10_000))
        with few, pytest.raises(CCWSIMError, match="12000 values in 2 arrays are more than 10000"):
            cio.inspect(io.BytesIO(content))


def test_an_image_that_packs_well_is_read():
    empty = TrainingImage(np.zeros((2000, 2000), int))
    buffer = io.BytesIO()
    np.savez_compressed(buffer, ti=empty.array)
    with limited(UPLOAD_LIMITS):  # an image of one facies is harmless
        assert cio.read_training_image(buffer).n_facies == 1


def test_an_upload_is_known_without_writing_it_out():
    upload = Upload("a", b"\xff" * 20_000_000)
    tracemalloc.start()
    assert upload.digest != Upload("a", b"\xff" * 20_000_001).digest
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 30e6


def test_no_frame_of_many_is_read_in_silence():
    frames = [Image.new("RGBA", (4, 3), (255, 0, 0, 0)), Image.new("RGBA", (4, 3), "blue")]
    content = io.BytesIO()
    frames[0].save(content, "GIF", save_all=True, append_images=frames[1:])
    with pytest.raises(CCWSIMError, match="has 2 frames; save one frame as PNG"):
        cio.inspect(content)


def test_a_png_written_here_keeps_its_codes():
    image = TrainingImage([[3, 5], [5, 3]])
    content = cio.training_image_as_bytes(image, "png")
    again = cio.read_training_image(io.BytesIO(content))
    assert again.array.tolist() == image.array.tolist()


@pytest.mark.parametrize(
    ("content", "kind"),
    [(png(3, 3), "picture"), (mat(matrix(b"", b"")), "matlab"), (zipped([("a", b"")]), "npz")],
)
def test_a_file_is_known_by_its_content(content, kind):
    assert kind_of(content) == kind


def test_names_in_files_can_be_shown():
    content = zipped([("a\x07\nb" * 100 + ".npy", sample.npy()), ("../x.npy", sample.npy())])
    names = [v.name for v in cio.inspect(io.BytesIO(content)).variables]
    assert names[0].startswith("abab")
    assert all(name.isprintable() and len(name) <= 80 for name in names)
    grid = sample.sgems().replace(b"facies", b"fa\x07cies")
    assert cio.inspect(io.BytesIO(grid)).variables[0].name == "facies"


@pytest.mark.slow
def test_a_packed_variable_is_unpacked_in_parts():
    values = np.random.default_rng(0).integers(0, 3, (900, 1000))
    found = cio.read_training_image(io.BytesIO(sample.mat(compress=True, ti=values)))
    assert np.array_equal(found.array, values)
    content = bytearray(sample.mat(compress=True, ti=values))
    content[-3000] ^= 255
    with pytest.raises(CCWSIMError):
        cio.read_training_image(io.BytesIO(bytes(content)))


LONG = {"large": 10**5000, "small": -(10**5000), "long": "x" * 10**6, "other": {"a": "b" * 500}}


@pytest.mark.parametrize("value", LONG.values(), ids=LONG)
def test_what_is_too_long_to_be_written_is_named_in_a_few_letters(value):
    picture = io.BytesIO(sample.picture())
    points = cio.read_points(io.BytesIO(sample.csv()))
    for act in (
        lambda: Parameters(template_size=value),
        lambda: Grid(value, 3),
        lambda: simulate(TrainingImage(np.eye(40)), (20, 20), seed=value),
        lambda: cio.class_edges([1, 2], value),
        lambda: cio.place_points(points, conversion=cio.Conversion(classes=value)),
        lambda: cio.read_training_image(picture, classes=value),
        lambda: sample_random(np.eye(3, dtype=int), 2, seed=value),
    ):
        with pytest.raises(CCWSIMError) as told:
            act()
        assert len(str(told.value)) < 300
