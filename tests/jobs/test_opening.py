"""Test the benchmark of sessions that open the page at the same time."""

from __future__ import annotations

import pytest

from benchmarks.opening import as_if_asked_regularly, main


def test_a_long_answer_counts_for_every_check_that_would_have_been_sent_meanwhile():
    assert as_if_asked_regularly([0.01, 0.12]) == pytest.approx([0.01, 0.12, 0.07, 0.02])


@pytest.mark.slow
def test_each_number_of_sessions_has_a_row(capsys):
    main(["--sessions", "1", "2", "--rounds", "1"])
    rows = [line.strip("| ").split(" | ") for line in capsys.readouterr().out.splitlines()[2:]]
    assert [row[:2] for row in rows] == [["1", "this"], ["2", "this"]]
    assert all(float(cell) >= 0 for row in rows for cell in row[2:])
