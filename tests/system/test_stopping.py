"""Test that work stops on request, also during a realization or a statistic."""

from __future__ import annotations

import numpy as np
import pytest

from ccwsim import Cancelled, Grid, HardData, datasets
from ccwsim.engine import raster as raster_of_tiles, realization
from ccwsim.engine.corrections import resimulation
from ccwsim.engine.prepared_image import PreparedImage
from ccwsim.engine.realization import random_numbers
from ccwsim.jobs.job import Job
from ccwsim.jobs.workers import check_stop, run_all, stoppable
from ccwsim.metrics import connectivity, pattern_codes, stack, variogram
from ccwsim.metrics.patterns import pattern_histogram
from ccwsim.model.study import Study
from ccwsim.model.watch import Watch

CHANNELS = datasets.load("channels")
RNG = np.random.default_rng(0)
IMAGE = RNG.integers(0, 3, (40, 50)).astype(np.uint8)


class After:
    """Function that returns True, to stop the work, after a number of calls."""

    def __init__(self, n: int) -> None:
        self.left = n

    def __call__(self) -> bool:
        self.left -= 1
        return self.left < 0


def test_the_raster_looks_up_again_and_again(monkeypatch):
    monkeypatch.setattr(raster_of_tiles, "TERMS_PER_CALL", 1)  # many calls, as in large grids
    study = Study(CHANNELS, Grid(200, 200))
    counting = After(10**9)
    arguments = PreparedImage(study), (1, 32, 32), False
    realization.simulate_raster(*arguments, random_numbers(0, 0), Watch(cancel=counting))
    looks = 10**9 - counting.left
    assert looks > 50
    for n in (0, 1, looks // 2, looks - 1):
        with pytest.raises(Cancelled):
            realization.simulate_raster(*arguments, random_numbers(0, 0), Watch(cancel=After(n)))


def test_local_resimulation_looks_up_again_and_again(monkeypatch):
    monkeypatch.setattr(resimulation, "LOCATIONS_PER_CALL", 1)
    blank = np.zeros((100, 100), np.uint8), np.zeros((0, 0), np.int32)
    monkeypatch.setattr(realization, "simulate_raster", lambda *_: blank)
    cells = np.unique(RNG.integers(0, 100, (60, 2)), axis=0)
    data = HardData(cells, np.full(len(cells), CHANNELS.codes[1]))
    study = Study(CHANNELS, Grid(100, 100), hard_data=data)
    with pytest.raises(Cancelled):
        realization.simulate_realization(PreparedImage(study), 0, False, Watch(cancel=After(20)))


STATISTICS = {
    "variogram": lambda: variogram(IMAGE, 1, "N-S", 20).gamma,
    "connection": lambda: connectivity(IMAGE, 1, "E-W", 20).tau,
    "patterns": lambda: pattern_histogram(IMAGE, range(3), 3).frequencies,
    "hashed patterns": lambda: pattern_histogram(IMAGE, range(3), 8).frequencies,
    "codes": lambda: pattern_histogram(IMAGE, range(3), 8).codes,
}


@pytest.fixture
def small_pieces(monkeypatch):
    monkeypatch.setattr(stack, "CELLS_A_PIECE", 3 * IMAGE.size)
    monkeypatch.setattr(pattern_codes, "CELLS_OF_STRIP", 4 * IMAGE.shape[1])


@pytest.mark.parametrize("name", STATISTICS)
def test_a_statistic_in_pieces_is_the_same(name, request):
    whole = STATISTICS[name]()
    request.getfixturevalue("small_pieces")
    assert np.array_equal(STATISTICS[name](), whole, equal_nan=True)


@pytest.mark.parametrize("name", STATISTICS)
def test_a_statistic_stops_between_two_pieces(name, small_pieces):
    for n in (0, 3):
        with pytest.raises(Cancelled), stoppable(After(n)):
            STATISTICS[name]()


def test_tasks_on_other_threads_stop_with_the_work_that_runs_them():
    def task(number, watch):
        check_stop()

    with pytest.raises(Cancelled), stoppable(lambda: True):
        run_all(task, 3, 2)
    assert run_all(task, 3, 2) == [0, 1, 2]


def test_a_job_stops_in_the_midst_of_a_statistic(small_pieces):
    def work(job):
        while True:
            STATISTICS["variogram"]()

    job = Job(work)
    job.cancel()
    assert job.wait(60)
    assert isinstance(job.error, Cancelled)
