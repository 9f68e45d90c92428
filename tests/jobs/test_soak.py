"""Run the soak test of the server briefly, with a few sessions."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import pytest

from benchmarks.soak import Outcome, Tally, main, report, soak
from benchmarks.visitor import choices_of, expected


@pytest.fixture(scope="module")
def outcome() -> Outcome:
    return soak(sessions=4, minutes=0.15, ttl=1, warming=4)


@pytest.mark.slow
def test_no_session_sees_an_error_or_the_picture_of_another(outcome):
    tally = outcome.tally
    assert tally.errors == Counter()
    assert tally.checked >= 4
    assert tally.wrong == 0
    assert (outcome.tracebacks, outcome.troubles) == (0, 0)
    assert tally.tabs >= 4
    assert 0 < outcome.start <= outcome.peak
    assert tally.seconds["unkind link"]
    assert len(outcome.pulse) > 5


@pytest.mark.slow
def test_it_is_told_as_a_table(outcome):
    lines = report(outcome).splitlines()
    assert lines[0].startswith("| request | times | median (s) | 95 % (s) |")
    assert "| **all** |" in "\n".join(lines)
    assert "0 errors seen by users" in lines[-1]
    kept = replace(outcome, start=100.0, end=111.0)
    assert not kept.back
    assert not kept.good
    assert "(+11 %)" in report(kept)


def test_an_error_is_counted_and_told():
    tally = Tally()
    tally.failed("RuntimeError: boom")
    tally.took("seed", 0.5)
    bad = Outcome(tally, 1, 1.0, 100.0, 100.0, 100.0, 1, 1, [0.1])
    assert not bad.good
    assert "1 × RuntimeError: boom" in report(bad)


def test_the_expected_picture_differs_with_the_study():
    one, other = (choices_of(f"grid=48x64&seed={seed}&template=16&overlap=4") for seed in (1, 2))
    assert expected(one) == expected(one)
    assert expected(one) != expected(other)


def test_help_is_at_hand(capsys):
    with pytest.raises(SystemExit):
        main(["--help"])
    assert "--sessions" in capsys.readouterr().out
