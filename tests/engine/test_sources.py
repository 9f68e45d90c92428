"""Test the sources: the locations in the training image from which cells were copied."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ccwsim import HardData, Parameters, datasets, revise, simulate

DATA = HardData([[10, 10], [40, 70], [41, 71], [60, 5]], [1, 0, 1, 1])


@pytest.mark.slow
@pytest.mark.parametrize("data", [None, DATA], ids=["free", "conditional"])
@pytest.mark.parametrize("level", [0, 1, 3])
def test_the_facies_of_a_cell_is_that_of_its_source(data, level):
    ti = datasets.load("lenses")
    codes = ti.array.ravel()
    p = Parameters(wavelet_level=level)
    ensemble = simulate(ti, (90, 120), p, data, n_realizations=6, seed=2, keep_sources=True)
    sources = ensemble.sources
    assert sources is not None
    assert sources.shape == ensemble.indices.shape
    taken = sources >= 0
    assert (codes[sources[taken]] == ensemble.realizations[taken]).all()
    alone = np.count_nonzero(~taken) - ensemble.n_forced.sum()
    assert 0 <= alone < 0.01 * taken.size  # seam repair changes single cells
    plain = simulate(ti, (90, 120), replace(p, repair_seams=False), data, 6, keep_sources=True)
    assert plain.sources is not None
    assert np.count_nonzero(plain.sources < 0) == plain.n_forced.sum()


def test_sources_are_left_out_unless_they_are_asked_for():
    assert simulate(datasets.load("channels"), (50, 50)).sources is None


def test_keeping_sources_does_not_change_the_realizations():
    ti = datasets.load("channels")
    assert (
        simulate(ti, (80, 80), hard_data=DATA, keep_sources=True).digest
        == simulate(ti, (80, 80), hard_data=DATA).digest
    )


def test_a_revision_keeps_the_sources_up_to_date():
    ti = datasets.load("channels")
    before = simulate(ti, (90, 90), n_realizations=4, keep_sources=True)
    after = revise(before, DATA)
    assert after.sources is not None
    taken = after.sources >= 0
    assert (ti.array.ravel()[after.sources[taken]] == after.realizations[taken]).all()


def test_realizations_can_be_asked_for_in_batches():
    ti = datasets.load("channels")
    whole = simulate(ti, (70, 60), n_realizations=5, seed=9)
    tail = simulate(ti, (70, 60), n_realizations=3, seed=9, first_realization=2)
    assert np.array_equal(whole.indices[2:], tail.indices)
    assert tail.numbers.tolist() == [2, 3, 4]
