"""Test volumes in all ways of running: threads, processes, to a file, stopped and revised."""

from __future__ import annotations

import time
import tracemalloc

import numpy as np
import pytest

from ccwsim import (
    Cancelled,
    Ensemble,
    Grid,
    HardData,
    Parameters,
    TrainingImage,
    revise,
    simulate,
)
from ccwsim.model.study import Study
from ccwsim.run.footprint import footprint
from tests.processes import process_pool
from tests.small_images import blobs

P = Parameters((4, 16, 16), (2, 4, 4), (0, 1, 1), n_candidates=5)
IMAGE = TrainingImage(3 * blobs((9, 45, 61), 3).astype(int) - 1)
SHAPE = (7, 40, 50)
CELLS = [(z, y, x) for z in range(7) for y, x in ((3, 4), (20, 30), (39, 49))]
DATA = HardData(CELLS, IMAGE.codes[np.arange(21) // 4 % 3])


def study(n: int = 5, **options) -> Ensemble:
    return simulate(IMAGE, SHAPE, P, DATA, n, seed=3, **options)


def same(one: Ensemble, other: Ensemble) -> bool:
    return one.digest == other.digest and np.array_equal(one.data_status, other.data_status)


@pytest.mark.slow
def test_the_number_of_workers_and_processes_make_no_difference():
    wanted = study(n_workers=1)
    assert wanted.indices.shape == (5, *SHAPE)
    assert wanted.n_mismatched.sum() == 0
    assert same(study(n_workers=2), wanted)
    with process_pool(2) as pool:
        assert same(study(executor=pool), wanted)


@pytest.mark.slow
def test_realizations_of_a_file_are_those_of_memory(tmp_path):
    found, wanted = study(out=tmp_path / "out.npy"), study()
    np.testing.assert_array_equal(np.load(tmp_path / "out.npy"), wanted.realizations)
    assert found.digest == wanted.digest
    np.testing.assert_array_equal(found.indices[2, 3], wanted.indices[2, 3])


@pytest.mark.slow
def test_a_large_volume_is_stopped_between_its_patches():
    study(1)  # compiled
    start = time.monotonic()
    with pytest.raises(Cancelled, match="0 of 1"):
        simulate(
            IMAGE, (200, 900, 900), P, n_workers=1, cancel=lambda: time.monotonic() > start + 0.3
        )


@pytest.mark.slow
def test_a_revision_changes_only_what_is_around_the_edited_data():
    before = study()
    cell = (3, 25, 12)
    code = IMAGE.codes[(before.indices[0][cell] + 1) % 3]
    after = revise(before, HardData([*CELLS, cell], [*DATA.facies, code]))
    assert after.n_mismatched.sum() == 0
    assert (after.realizations[:, *cell] == code).all()
    changed = np.argwhere(after.indices != before.indices)[:, 1:]
    assert len(changed)
    assert (np.abs(changed - cell) <= P.along(SHAPE).template).all()


@pytest.mark.slow
def test_the_estimate_of_memory_is_not_below_what_a_run_takes():
    image = TrainingImage(blobs((24, 70, 80), 3))
    data = HardData(CELLS, np.arange(21) // 4 % 3)
    whole = Study(image, Grid.of((40, 90, 90)), P, data, 3)
    simulate(image, whole.grid, P, data, 1, n_workers=1)  # compiled
    tracemalloc.start()
    simulate(image, whole.grid, P, data, 2, n_workers=1)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < footprint(whole, 2, n_workers=1) < 4 * peak
