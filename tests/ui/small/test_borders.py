"""Test the lines between areas of a map against all pairs of neighbours."""

from __future__ import annotations

import numpy as np
import pytest

from ccwsim.ui.results.maps import borders


def edges_of(lines: list) -> set:
    """Return the unit edges (row, column, is vertical) of straight lines."""
    edges = set()
    for (row, column, _), (end_row, end_column, _) in lines:
        assert (row == end_row) != (column == end_column)
        edges |= {(row, k, False) for k in range(column, end_column)}
        edges |= {(k, column, True) for k in range(row, end_row)}
    return edges


@pytest.mark.parametrize("seed", range(6))
def test_lines_are_the_edges_between_different_cells(seed):
    rng = np.random.default_rng(seed)
    areas = rng.integers(0, 3, (5 + seed, 9))
    expected = {
        (row + 1, column, False)
        for row, column in np.ndindex(areas.shape)
        if row + 1 < len(areas) and areas[row, column] != areas[row + 1, column]
    }
    expected |= {
        (row, column + 1, True)
        for row, column in np.ndindex(areas.shape)
        if column + 1 < areas.shape[1] and areas[row, column] != areas[row, column + 1]
    }
    assert edges_of(borders(areas)) == expected


def test_a_straight_border_is_one_line():
    areas = np.repeat([[0, 1]], 40, axis=0)
    assert borders(areas) == [[[0, 1, 0], [40, 1, 0]]]
    assert borders(np.zeros((4, 4), int)) == []
