"""Test prepared images: a bounded size, and the same cells whether they are kept or not."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from ccwsim import HardData, Parameters, Secondary, TrainingImage, simulate
from ccwsim.engine import prepared_image
from ccwsim.engine.prepared_image import PreparedImage, fresh_images, keep
from ccwsim.engine.realization import simulate_realization
from ccwsim.experiments.trials import Trial
from ccwsim.jobs.memo import Memo, n_bytes
from ccwsim.model.grid import Grid
from ccwsim.model.study import Study
from ccwsim.model.watch import Watch
from ccwsim.run.executors import threads
from tests.small_images import blobs

P = Parameters(template_size=16, overlap_size=4, wavelet_level=1)


@pytest.mark.parametrize("n_workers", [1, 3])
def test_parts_that_are_not_kept_are_made_again_with_the_same_cells(monkeypatch, n_workers):
    image = TrainingImage(blobs((60, 50), 3))
    expected = simulate(image, (40, 45), P, n_realizations=12, n_workers=1).digest
    monkeypatch.setattr(prepared_image, "MAX_PARTS_BYTES", 0)
    with fresh_images():
        found = simulate(image, (40, 45), P, n_realizations=12, n_workers=n_workers).digest
    assert found == expected


def test_the_parts_used_last_are_kept_as_far_as_the_bytes_go(monkeypatch):
    study = Study(TrainingImage(blobs((60, 50), 3)), Grid(40, 45), P)
    one = n_bytes(PreparedImage(study).oriented(0, (1, 16, 16)))
    monkeypatch.setattr(prepared_image, "MAX_PARTS_BYTES", 3 * one)
    image = PreparedImage(study)
    made = [image.oriented(way, (1, 16, 16)) for way in range(8)]
    assert image.oriented(7, (1, 16, 16)) is made[7]
    again = image.oriented(0, (1, 16, 16))
    assert again is not made[0]
    np.testing.assert_array_equal(again.squares, made[0].squares)


def disc(shape=(60, 50)):
    rows, columns = np.indices(shape)
    return np.hypot(rows - shape[0] / 2, columns - shape[1] / 2) < 22


CELLS = [[3, 4], [20, 30], [50, 8], [41, 40], [30, 22]]
BASE: dict[str, Any] = {
    "training_image": TrainingImage(blobs((60, 50), 3)),
    "grid_shape": (60, 50),
    "parameters": P,
    "hard_data": HardData(CELLS, [0, 1, 2, 1, 0]),
    "secondary": Secondary(probabilities={0: 0.2, 1: np.where(disc(), 0.6, 0.2)}),
}
OTHERS: dict[str, dict[str, Any]] = {
    "seed": {"seed": 8},
    "image": {"training_image": TrainingImage(blobs((60, 50), 3)[::-1])},
    "grid": {"grid_shape": (60, 50 + 10), "secondary": None},
    "parameters": {"parameters": replace(P, n_candidates=3)},
    "facies of data": {"hard_data": HardData(CELLS, [2, 0, 1, 1, 2])},
    "cells of data": {"hard_data": HardData(CELLS[::2], [0, 2, 0])},
    "no data": {"hard_data": None},
    "probabilities": {
        "secondary": Secondary(probabilities={0: 0.2, 1: np.where(disc(), 0.2, 0.5)})
    },
    "active cells": {"secondary": Secondary(active=disc())},
    "angles": {"secondary": Secondary(angle=np.where(disc(), 40.0, 0.0))},
    "no secondary": {"secondary": None},
}


def cells_of(seed=7, **study) -> str:
    return simulate(**{**BASE, **study}, seed=seed, n_realizations=3).digest


def counted(monkeypatch) -> list[Memo]:
    """Return a list of the parts of images that runs use from now on."""
    used, original = [], threads.prepared_image

    def count(study: Study) -> PreparedImage:
        image = original(study)
        assert image.study is study
        used.append(image._parts)
        return image

    monkeypatch.setattr(threads, "prepared_image", count)
    return used


@pytest.fixture
def images(monkeypatch):
    """Return the cache of images, which is empty."""
    cache = Memo(prepared_image.MAX_PREPARED, prepared_image.MAX_PREPARED_BYTES, min_values=0)
    monkeypatch.setattr(prepared_image, "_images", cache)
    return cache


@pytest.mark.parametrize("other", OTHERS)
def test_kept_images_change_no_cell_and_only_the_seed_shares_them(images, monkeypatch, other):
    with fresh_images():
        expected = [cells_of(), cells_of(**OTHERS[other])]
    assert expected[0] != expected[1]
    used = counted(monkeypatch)
    for _ in range(2):
        assert [cells_of(), cells_of(**OTHERS[other])] == expected
    assert used[0] is used[2]
    assert used[1] is used[3]
    assert (used[0] is used[1]) == (other == "seed")


def test_runs_in_threads_share_an_image(images, monkeypatch):
    with fresh_images():
        expected = [cells_of(seed) for seed in range(6)]
    used = counted(monkeypatch)
    with ThreadPoolExecutor(6) as pool:
        assert list(pool.map(cells_of, range(6))) == expected
    cells_of(9)
    assert any(used[-1] is parts for parts in used[:-1])


def test_an_image_is_kept_as_far_as_the_bytes_go(monkeypatch):
    shapes = [(60, n) for n in (50, 54, 58, 62)]
    one = PreparedImage(Study(BASE["training_image"], Grid.of(shapes[-1]), P))
    watch = Watch()
    for number in range(3):
        simulate_realization(one, number, False, watch)
    monkeypatch.setattr(prepared_image, "_images", Memo(16, int(2.5 * n_bytes(one)), 0))
    used = counted(monkeypatch)
    plain: dict[str, Any] = {"hard_data": None, "secondary": None}
    for shape in shapes:
        cells_of(grid_shape=shape, **plain)
    kept = list(prepared_image._images._values.values())
    assert 1 <= len(kept) <= 3
    assert [image._parts for image in kept] == used[-len(kept) :]
    assert sum(map(n_bytes, kept)) <= 2.5 * n_bytes(one)
    monkeypatch.setattr(prepared_image, "_images", Memo(16, n_bytes(one) // 2, 0))
    keep(one)
    assert not prepared_image._images._values


def test_measured_times_include_the_preparation(images, monkeypatch):
    used = counted(monkeypatch)
    for _ in range(2):
        Trial.of(BASE["training_image"], (60, 50), P).simulate(1)
    assert used[0] is not used[1]
    assert not images._values
