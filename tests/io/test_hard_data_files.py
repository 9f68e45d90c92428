"""Test that hard data written and read again are the same, for any position of the grid."""

from __future__ import annotations

from io import BytesIO

import numpy as np
import pytest
from hypothesis import given, strategies as st

from ccwsim import CCWSIMError, Grid, HardData, read_hard_data
from ccwsim.io.hard_data.files import hard_data_as_bytes, write_hard_data

SIZES = st.floats(0.01, 500.0)
ORIGINS = st.floats(-1e6, 1e6)
SEEDS, NUMBERS = st.integers(0, 999), st.integers(1, 30)
KINDS = st.sampled_from(["csv", "gslib", "dat"])


@given(SEEDS, NUMBERS, st.tuples(SIZES, SIZES), st.tuples(ORIGINS, ORIGINS), KINDS)
def test_what_is_written_is_read_again(seed, n, cell_size, origin, kind):
    rng = np.random.default_rng(seed)
    grid = Grid(1000, 80, cell_size=cell_size, origin=origin)
    cells = rng.choice(1000 * 80, n, replace=False)
    data = HardData(np.column_stack(np.divmod(cells, 80)), rng.integers(0, 9, n))
    file = BytesIO(hard_data_as_bytes(data, kind, grid))
    file.name = f"data.{kind}"
    assert read_hard_data(file, grid).digest == data.digest


def test_a_path_gives_the_format(tmp_path):
    data = HardData([[3, 4], [0, 0]], [1, 250])
    for ending in ("csv", "dat"):
        write_hard_data(tmp_path / f"wells.{ending}", data)
        again = read_hard_data(tmp_path / f"wells.{ending}", Grid(8, 8))
        assert again.digest == data.digest
    assert (tmp_path / "wells.dat").read_text().splitlines()[1] == "4"


def test_nothing_to_write_and_unknown_formats_are_said(tmp_path):
    with pytest.raises(CCWSIMError, match="no hard data"):
        write_hard_data(tmp_path / "none.csv", HardData())
    assert not (tmp_path / "none.csv").exists()
    with pytest.raises(CCWSIMError, match="csv"):
        hard_data_as_bytes(HardData([[0, 0]], [1]), "xlsx")
