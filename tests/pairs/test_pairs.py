"""Test studies that combine each pair of features, and everything derived from them."""

from __future__ import annotations

import itertools
import os
import re
import subprocess
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import fields
from multiprocessing import get_context
from pathlib import Path

import pytest

from ccwsim import CCWSIMError, TrainingImage
from ccwsim.model.arrays import digest
from ccwsim.model.study import Study
from tests.pairs.consumers import CONSUMERS, WITHOUT_STUDIES, Case, public_functions
from tests.pairs.studies import (
    FEATURES,
    Row,
    check_rows,
    faults_of,
    is_possible,
    make_study,
    pairs,
    published_rows,
    run_study,
)

ROOT = Path(__file__).parents[2]
ROWS = [*pairs(), *published_rows()]
FAST = 6  # the last of each six rows is tested by the fast tests
REFUSALS: dict[str, Callable[[Row, Study], bool]] = {
    "pattern size|coarsening factor|max_lag|reduce the largest lag": lambda row, study: (
        row["sides"] != "usual"
    ),
    "at least 2 × 2 cells": lambda row, study: row["sides"] != "usual" or study.grid.nz is not None,
    "need maps": lambda row, study: study.grid.nz is not None,
    "need volumes|need a volume": lambda row, study: study.grid.nz is None,
    "no hard data|hard data are too few|cannot be left out|at least one image and 3 data": (
        lambda row, study: study.hard_data.n < 6
    ),
    "needs angles": lambda row, study: row["turn"] not in ("angle", "angles", "fan"),
    "without probabilities": lambda row, study: row["probabilities"] == "none",
    "nothing can flow|no head is fixed": lambda row, study: row["active"] != "all",
    "positions in a training image": lambda row, study: len(images_of(study)) > 1,
}
"""Sentences with which a function may refuse a study, and whether they hold for the study."""


def images_of(study: Study) -> tuple[TrainingImage, ...]:
    """Return all training images of a study."""
    return study.training_image, *(study.secondary.images if study.secondary else ())


def test_rows_contain_each_possible_pair_of_features():
    assert len(ROWS) <= 66
    assert all(is_possible(row) for row in ROWS)
    for a, b in itertools.combinations(FEATURES, 2):
        for x, y in itertools.product(FEATURES[a], FEATURES[b]):
            if is_possible({a: x, b: y}):
                assert any(row[a] == x and row[b] == y for row in ROWS), (a, x, b, y)


@pytest.mark.parametrize("part", ["parameters", "secondary", "grid"])
def test_each_field_of_a_study_has_several_values(part):
    """A new field, for example a parameter or a kind of guide, needs a feature."""
    parts = [getattr(make_study(row, k), part) for k, row in enumerate(ROWS)]
    parts = [each for each in parts if each is not None]
    names = [f.name for f in fields(parts[0]) if f.init and f.name != "is_fitted"]
    for name in names:
        values = {digest(repr(getattr(each, name))) for each in parts}
        assert len(values) > 1, f"all {part} have the same {name}"


def test_each_public_function_takes_the_studies_or_none():
    named = {f"{folder}.{name}" for folder, names in WITHOUT_STUDIES.items() for name in names}
    called = {name for name in CONSUMERS if not name.startswith("others.")}
    assert called | named == public_functions()
    assert not called & named


@pytest.mark.parametrize(
    "number",
    [
        pytest.param(number, marks=[] if number % FAST == FAST - 1 else [pytest.mark.slow])
        for number in range(len(ROWS))
    ],
)
def test_a_study_with_pairs_of_features(number):
    assert faults_of(make_study(ROWS[number], number)) == []


OF_IMAGE_AND_DATA = "metrics.fit_data", "metrics.rank_images", "metrics.rank_variants"
"""Slow functions, which read only the image, the data and the grid of a study."""


def enough_rows(names: Sequence[str]) -> set[int]:
    """Return the numbers of rows that contain each pair of levels of these features."""
    rows = [set(itertools.combinations([(name, row[name]) for name in names], 2)) for row in ROWS]
    left, chosen = set().union(*rows), set()
    while left:
        number = max(range(len(rows)), key=lambda k: len(rows[k] & left))
        chosen.add(number)
        left -= rows[number]
    return chosen


OF_INPUTS = enough_rows(("dimension", "sides", "facies", "codes", "gaps", "data"))
"""Rows with the slow functions; the others differ in features that these functions do not read."""


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*have no value")
@pytest.mark.parametrize("number", range(len(ROWS)))
def test_each_function_takes_a_study_with_pairs_of_features(number, tmp_path):
    row = ROWS[number]
    study = make_study(row, number)
    case, failed = Case(study, run_study(study), tmp_path), {}
    for name, function in CONSUMERS.items():
        if name in OF_IMAGE_AND_DATA and number not in OF_INPUTS:
            continue
        try:
            function(case)
        except CCWSIMError as error:
            reasons = [holds for text, holds in REFUSALS.items() if re.search(text, str(error))]
            if not any(holds(row, study) for holds in reasons):
                failed[name] = str(error)
        except Exception as error:
            failed[name] = repr(error)
    assert failed == {}


KINDS = {
    "plain": {},
    "active": {"active": "most"},
    "probabilities": {"probabilities": "map"},
    "auxiliary": {"images": "auxiliary"},
    "images": {"images": "several"},
    "zones": {"images": "zones"},
    "weights": {"images": "weights"},
    "mirrored": {"mirrored": "all"},
    "angle": {"turn": "angle"},
    "fan": {"turn": "fan"},
    "scale": {"turn": "scale"},
    "gaps": {"gaps": "scattered"},
}
"""Features of which each needs other kernels, or other arrays in the same kernels."""


@pytest.mark.slow
def test_each_kind_of_study_is_simulated_by_a_new_process(tmp_path):
    """Kernels are compiled, and read from disk, before a process runs its first study.

    Each kind of maps and of volumes has a process, whose first study is of other sides and data
    than that of the process before.
    """
    usual = {name: levels[0] for name, levels in FEATURES.items()}
    sizes = [*itertools.product(FEATURES["sides"], ("none", "few"))]
    context = get_context("forkserver")
    context.set_forkserver_preload(["tests.pairs.studies"])

    def ended(number: int, kind: str, dimension: str) -> tuple[int | None, str]:
        """Return the exit code and the last lines of a process that checks a kind of study."""
        first = number % len(sizes)
        rows = [
            {**usual, **KINDS[kind], "dimension": dimension, "sides": sides, "data": data}
            for sides, data in sizes[first:] + sizes[:first]
        ]
        file = tmp_path / f"{kind} {dimension}"
        process = context.Process(target=check_rows, args=(rows, file))
        process.start()
        process.join(300)
        process.kill()
        process.join()
        last = file.read_text().splitlines()[-3:] if file.exists() else []
        return process.exitcode, "\n".join([file.name, *last])

    kinds = itertools.product(KINDS, FEATURES["dimension"])
    with ThreadPoolExecutor(2) as pool:
        tasks = [pool.submit(ended, k, *kind) for k, kind in enumerate(kinds)]
    results = [task.result() for task in tasks]
    assert [lines for code, lines in results if code != 0] == []


@pytest.mark.slow
def test_kernels_stay_within_their_arrays(tmp_path):
    environment = {**os.environ, "NUMBA_BOUNDSCHECK": "1", "XDG_CACHE_HOME": str(tmp_path)}
    command = [sys.executable, "-m", "tests.pairs.studies", "--number", "60"]
    ended = subprocess.run(command, env=environment, capture_output=True, text=True, cwd=ROOT)
    assert "60 studies with bounds checks: 0 with faults" in ended.stdout, ended.stderr[-2000:]
    assert ended.returncode == 0


@pytest.mark.slow
def test_kernels_with_bounds_checks_find_an_index_beyond_an_array(tmp_path):
    code = (
        "import numpy as np\n"
        "from ccwsim.engine.kernel_cache import KERNEL_FOLDER_NAME\n"
        "from tests.pairs.beyond import read_beyond\n"
        "assert KERNEL_FOLDER_NAME.endswith('-checked')\n"
        "try: read_beyond(np.zeros(3))\n"
        "except IndexError: print('found')\n"
    )
    environment = {**os.environ, "NUMBA_BOUNDSCHECK": "1", "XDG_CACHE_HOME": str(tmp_path)}
    command = [sys.executable, "-c", code]
    ended = subprocess.run(command, env=environment, capture_output=True, text=True, cwd=ROOT)
    assert ended.stdout == "found\n", ended.stderr
