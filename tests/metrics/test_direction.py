"""Test the local direction of bodies."""

from __future__ import annotations

import numpy as np
import pytest

from ccwsim import CCWSIMError, TrainingImage
from ccwsim.metrics import local_direction, main_direction

STRIPES = np.tile([[0], [0], [0], [1], [1], [1]], (8, 48))


def test_a_volume_with_gaps_has_the_direction_of_its_middle_layer():
    volume = np.stack([STRIPES] * 5).astype(float)
    volume[0, :3, :3] = np.nan  # only in the lowest layer
    assert main_direction(TrainingImage(volume)) == main_direction(STRIPES) == (90.0, 0.0)


@pytest.mark.parametrize("shape", [(1, 30), (30, 1), (3, 20, 20)])
def test_rows_of_cells_and_volumes_have_no_direction(shape):
    with pytest.raises(CCWSIMError, match="at least 2 × 2 cells"):
        local_direction(
            np.resize([0, 1], shape)
            if len(shape) == 2
            else TrainingImage(np.resize([0, 1, 1], shape))
        )
