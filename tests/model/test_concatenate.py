"""Test that parts of a run are joined into the result of a complete run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ccwsim import CCWSIMError, HardData, Parameters, TrainingImage, concatenate, simulate
from tests.small_images import noise

IMAGE = TrainingImage(noise((40, 44), 3))
P = Parameters(16, 4, 1)
DATA = HardData([[3, 4], [20, 31], [37, 2]], IMAGE.codes[[0, 1, 2]])


def part(first: int, n: int, **options):
    study = {"hard_data": DATA, "seed": 5, "keep_sources": True, **options}
    return simulate(IMAGE, (40, 50), P, n_realizations=n, first_realization=first, **study)


def test_parts_join_into_one_full_run():
    whole = part(0, 7)
    parts = [part(0, 2), part(2, 4), part(6, 1)]
    found = concatenate(parts)
    assert found.digest == whole.digest
    for name in ("indices", "data_status", "numbers", "sources", "n_mismatched"):
        np.testing.assert_array_equal(getattr(found, name), getattr(whole, name))
    assert (found.seed, found.grid, found.parameters) == (whole.seed, whole.grid, whole.parameters)
    assert len(found.cpu_seconds) == 7
    assert found.wall_seconds == pytest.approx(sum(p.wall_seconds for p in parts))
    assert not found.indices.flags.writeable


def test_a_single_part_is_itself():
    one = part(3, 2)
    assert concatenate([one]).digest == one.digest
    assert concatenate([one]).numbers.tolist() == [3, 4]


def test_sources_are_kept_where_all_have_them():
    assert concatenate([part(0, 1), part(1, 1, keep_sources=False)]).sources is None


@pytest.mark.parametrize("other", [{"seed": 6}, {"hard_data": HardData()}])
def test_parts_of_different_studies_are_refused(other):
    name = {"seed": "seed", "hard_data": "hard data"}[next(iter(other))]
    with pytest.raises(CCWSIMError, match=f"0 and 1 are of different studies.*differ in {name};"):
        concatenate([part(0, 1), part(1, 1, **other)])


def test_mended_realizations_do_not_join_with_simulated_ones():
    with pytest.raises(CCWSIMError, match="different studies"):
        concatenate([part(0, 1), replace(part(1, 1), revised=True)])


def test_a_realization_twice_and_none_at_all_are_refused():
    with pytest.raises(CCWSIMError, match="realization 1 is in two"):
        concatenate([part(0, 2), part(1, 1)])
    with pytest.raises(CCWSIMError, match="needs a list of ensembles"):
        concatenate([])
