"""Run a part of `python -m tests.fuzz`, and read every hostile file and check its message."""

from __future__ import annotations

import io
import os
import random
import re
from dataclasses import fields
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from benchmarks.safety import BEGIN, END, SAFETY
from ccwsim import CCWSIMError, Parameters, Secondary, TrainingImage
from ccwsim.io import opening
from ccwsim.io.opening import READERS
from tests.fuzz.arguments import LEGAL, secondary
from tests.fuzz.cases import Case, acts_of, content_of
from tests.fuzz.evil import EVIL, EVIL_OF, SPRUNG, WORST
from tests.fuzz.reading import NAMES, WAYS, uploads
from tests.fuzz.seeds import seeds
from tests.fuzz.workers import MEGABYTES, Outcome, measured, outcomes
from tests.io import every_reader

pytestmark = pytest.mark.filterwarnings("ignore")
N_FILES, N_ARGUMENTS, AT_ONCE = 200, 100, 50


def troubles(outcomes: list[Outcome]) -> list[tuple]:
    return [(o.case, *o.faults) for o in outcomes if o.faults]


@pytest.mark.slow
@pytest.mark.parametrize("start", range(0, N_FILES, AT_ONCE))
def test_a_spoilt_file_is_read_or_refused(start):
    first = 2 * len(EVIL) + 100_000 + start  # other numbers than those of the command
    cases = [Case("file", k, 1) for k in range(first, first + AT_ONCE)]
    assert troubles([measured(case, acts_of(case)) for case in cases]) == []


@pytest.mark.parametrize("start", range(0, N_ARGUMENTS, AT_ONCE))
def test_random_arguments_give_a_result_or_are_refused(start):
    cases = [Case("arguments", 100_000 + k, 1) for k in range(start, start + AT_ONCE)]
    assert troubles([measured(case, acts_of(case)) for case in cases]) == []


def test_every_parameter_is_among_the_random_arguments():
    assert LEGAL.keys() == {field.name for field in fields(Parameters)}
    image = TrainingImage(np.eye(12, dtype=int))
    given = secondary(image, (20, 20), random.Random(0))
    assert given.keys() == {field.name for field in fields(Secondary)} - {"is_fitted"}


@pytest.mark.slow
def test_what_is_bad_is_found():
    def broken():
        raise ValueError("a\nb")

    def unfit():
        raise CCWSIMError("a line\n\nafter an empty line")

    kept = []
    acts = [("broken", broken), ("unfit", unfit), ("good", lambda: kept.append(bytearray(2**20)))]
    outcome = measured("a", iter(acts))
    assert (outcome.results, outcome.refusals, outcome.bad) == (1, 1, True)
    assert [fault.split(":")[0] for fault in outcome.faults] == ["broken", "unfit"]
    large = measured("b", iter([("large", lambda: len(b"1" * int((MEGABYTES + 40) * 2**20)))]))
    assert large.faults == []
    assert large.bad == (large.megabytes > 0)  # 0 if the system reports no peak
    assert Outcome("c", seconds=2.1).bad
    assert not measured("d", iter([("quick", lambda: 1)])).bad


def test_processes_are_ended_and_their_case_is_told():
    def acts(case):
        if case == 1:
            yield "ends", lambda: os._exit(3)
        if case == 2:
            yield "leaves", lambda: Path("left").write_text("")
        yield "good", lambda: case

    found = {o.case: o for o in outcomes([0, 1, 2, 3], acts, 2)}
    assert {case for case, o in found.items() if o.bad} >= {1, 2}
    assert found[1].faults == ["the process ended with 3"]
    assert found[2].faults == ["left behind: 'left'"]
    assert (found[0].results, found[0].faults) == (1, [])


def test_a_case_is_known_by_its_number():
    case = Case("file", 2 * len(EVIL) + 7, 3)
    assert content_of(case) == content_of(case)


EXCEEDED = "takes longer than|needs more than"
"""Message for a file that exceeds the time or memory of the process that reads it."""
SAID = {
    "npy of 10^9 cells": "1000000 × 1000 values are more than 4000000",
    "npy of 70 axes": "more than 4000000|is not a grid",
    "npy of digits": "header is broken",
    "npy of brackets": "header is broken",
    "npy of an expression": "header is broken",
    "npy of records": "are not numbers",
    "npy over the limit": "more than 4000000; cut a smaller piece, or read it in a script",
    "pickle": "type object are not numbers",
    "zip bomb": "unpacks to 240 MB, more than 128 MB",
    "overlapping zip": "unpacks to|are more than 1000",
    "zip of a million members": "is a zip archive without an array",
    "zip by lzma": "compression is not supported",
    "locked zip": "compression is not supported",
    "png of 3.6e9 pixels": "more than 178956970 pixels",
    "png over the limit": "2000 × 2001 values are more than 4000000",
    "gif of 4e9 pixels": "more than 178956970 pixels",
    "gif without frames": "the picture cannot be read",
    "mat 4": "ends in the middle of a variable",
    "mat 7.3": "the HDF5 file cannot be read",
    "mat of 10^18 cells": "1073741824 × 1073741824 values are more than 4000000",
    "mat of a million axes": "no array of real numbers",
    "mat of many elements": "variables or columns are more than 1000",
    "nested mat": "no array of real numbers",
    "packed mat that is a bomb": "unpacks to 256 MB, more than 128 MB",
    "packed mat that promises": "are more than 4000000",
    "text of one line": "67108861 bytes exceed the limit of 1048576 bytes per line",
    "text of many numbers": "4000 × 4000 values are more than 4000000",
    "text that is wrong at its end": "line 4000003: 'sand' is not a number",
    "matrix with a word": "remove these",
    "esri of one name": "header exceeds 100 lines",
    "utf-16 of 60 MB": "exceed the limit of 1048576 bytes per line",
    "vti of entities": "DOCTYPE is not allowed",
    "vti of utf-16 entities": "DOCTYPE is not allowed",
    "vti of another encoding": "the XML is broken",
    "vti that unpacks": "more than 4000000 values",
    "shp alone": "not enough without its table",
    "geojson of columns": "columns are more than 1000",
    "billion laughs": "is an SVG drawing",
}
"""Messages for files that are read as a training image."""

USUAL = ("inspect", "image", "points")
"""Ways in which every evil file is read."""

READ = {
    "jpeg of camera data": (1, 3, 4),
    "gif of remarks": (1, 3, 4),
    "gif of frames": (1, 3, 4),
    "npy at the limit": (1, 2000, 2000),
    "png at the limit": (1, 2000, 2000),
    "matrix at the limit": (1, 2000, 2000),
    "text at the limit": (1, 2000, 2000),
    "table of words": (160_000,),
    "table of colliding points": (100_000,),
}
"""Hostile files that are nevertheless read, because they are just within the limits or because only
their unneeded parts are hostile."""


@pytest.mark.parametrize("reader", [*READERS, "project"])
def test_a_reader_has_an_evil_file_and_a_measurement(reader):
    assert EVIL_OF.get(reader), f"add files to tests/fuzz/evil.py that harm the reader {reader}"
    table = SAFETY.read_text("utf-8").split(BEGIN)[1].split(END)[0]
    assert f"\n| {reader} | {WORST[reader]} |" in table, "run python -m benchmarks.safety"


@pytest.mark.parametrize("reader", READERS)
def test_a_reader_has_a_good_file_that_is_changed_at_random(reader):
    package = every_reader.NEEDS.get(reader, "numpy")
    pytest.importorskip(package)
    kinds = {opening.recognized(content, "a")[0] for content in _small_seeds()}
    assert reader in kinds, f"add a file of {reader} to tests/io/every_reader.py"


@cache
def _small_seeds() -> list[bytes]:
    made = {name: content for name, content in seeds().items() if "published" not in name}
    return [*made.values()]


@pytest.mark.slow
@pytest.mark.parametrize(("reader", "name"), [(r, n) for r in EVIL_OF for n in EVIL_OF[r]])
def test_an_evil_file_does_no_harm(reader, name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("CCWSIM_MAX_UPLOAD_SECONDS", "3")
    content = EVIL[name]()
    acts = dict(uploads(content, f"../{name}"))
    if name not in WORST.values():  # `python -m tests.fuzz` reads each file in every way
        acts = {word: act for word, act in acts.items() if word in (*USUAL, reader)}
    outcome = measured(name, iter(acts.items()))
    assert outcome.faults == []
    assert outcome.megabytes < MEGABYTES
    assert list(tmp_path.iterdir()) == [], f"{SPRUNG}: its code was executed"
    if opening.kind_of(content) != "tiff":  # reading the tags of a TIFF would take long here
        kind = opening.recognized(content, name)[0]
        assert kind in (reader, "npz" if reader == "project" else "")
    if reader == "project":
        return
    try:
        first = acts["inspect"]().variables[0]
        acts["image"]()
    except CCWSIMError as error:
        said = str(error)
    else:
        assert name not in SAID
        assert name not in READ or first.shape == READ[name]
        return
    assert re.search(f"{SAID.get(name, '')}|{EXCEEDED}", said)


@pytest.mark.parametrize("name", NAMES)
def test_a_name_is_no_path_and_fits_into_a_message(name):
    file = io.BytesIO(b"\x07\x00\x01\x02")
    file.name = name
    with pytest.raises(CCWSIMError, match="has an unknown format") as told:
        WAYS["image"](file)
    said = str(told.value)
    assert said.isprintable()
    assert len(said) < 300
    assert "/" not in said.split(" is of")[0]
