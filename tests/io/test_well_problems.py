"""Test that all problems in tables of wells are reported at once, each with a choice."""

from __future__ import annotations

from io import BytesIO

import numpy as np
import pytest

from ccwsim import CCWSIMError, Grid, TrainingImage
from ccwsim.cli.program import main
from ccwsim.io import (
    Conversion,
    import_wells,
    place_points,
    preview_wells,
    read_well_points,
    resolve_points,
)
from ccwsim.io.hard_data.placing import CONVERSION_CHOICES, ROW_CHOICES

GRID = Grid(8, 8, nz=30)
IMAGE = TrainingImage(np.array([[0, 1]]), facies_names=("mud", "sand"))
COLLARS = b"well,x,y,z,td\nA,1.5,1.5,30,20\nB,5.5,5.5,30,\n"
BAD_COLLARS = COLLARS + b"A,2,2,2,2\nC,,1,2,3\n,1,1,1,1\n"
BAD_LOG = (
    b"well,top,base,lith\nA,0,8,mud\nA,6,14,sand\nB,9,6,mud\nB,-1,1,mud\n,1,2,mud\nZ,1,2,mud\n"
    b"B,,,mud\nA,14,25,mud\nC,0,1,sand\nZ,2,3,mud\n"
)
BAD_SURVEY = b"well,depth,azimuth,inclination\nB,0,0,190\nB,0,400,5\nB,-1,0,5\nY,0,0,0\nB,,0,0\n"
DROP = {"on_overlap": "upper", "on_no_collar": "drop", "on_bad_row": "drop"}


def imported(log: bytes, collars: bytes = COLLARS, surveys: bytes | None = None, **options):
    surveys_file = None if surveys is None else BytesIO(surveys)
    return import_wells(
        BytesIO(collars), BytesIO(log), GRID, IMAGE, surveys=surveys_file, **options
    )


def column_of(log: bytes, well: str = "A", **options) -> str:
    """Return the facies of a vertical well from the top down, one letter per cell."""
    report = imported(b"well,from,to,facies\n" + log, **options)
    here = report.hard_data.cells[:, 1] == (1 if well == "A" else 5)
    cells, facies = report.hard_data.cells[here], report.hard_data.facies[here]
    known = dict(zip((29 - cells[:, 0]).tolist(), facies.tolist(), strict=True))
    return "".join("ms"[known[k]] if k in known else "." for k in range(max(known, default=-1) + 1))


def test_all_problems_of_three_tables_are_said_at_once():
    with pytest.raises(CCWSIMError) as error:
        imported(BAD_LOG, BAD_COLLARS, BAD_SURVEY)
    said = str(error.value)
    for words in (
        "lines 2 and 4: the well 'A' has two collars", "line 5: x is missing; add it",
        "line 6: the name of the well is missing", "azimuth 400 is not from -180 to 360",
        "inclination 190 is not from 0 to 180", "a station at depth -1 is above the collar",
        "no collar of the well 'Y'",
    ):  # fmt: skip
        assert words in said or "more of this kind" in said
    with pytest.raises(CCWSIMError) as error:
        imported(BAD_LOG)
    said = str(error.value)
    for words in (
        "lines 2 and 3: two intervals of 'A' overlap below the depth 6; correct one of them, or "
        "choose what to do (on_overlap='upper' or 'lower' or 'drop')",
        "lines 7 and 11: there is no collar of the well 'Z'; add it to the collars",
        "line 10: there is no collar of the well 'C'", "line 8: the depth is missing",
        "line 4: the upper depth 9 is below the lower depth 6", "line 5: the depth -1 is above",
        "line 6: the name of the well is missing", "line 9: the depth 25 is below the end of 'A'",
    ):  # fmt: skip
        assert words in said
    assert len(said.splitlines()) == 8


def test_every_problem_may_be_answered():
    report = imported(BAD_LOG, BAD_COLLARS, BAD_SURVEY, **DROP)
    assert set(report.hard_data.facies.tolist()) == {0, 1}
    notes = "\n".join(report.notes)
    assert "Pairs of intervals that overlap: 1 (file, lines 2 and 3); the lower one" in notes
    assert "Wells without a collar: 3 (" in notes
    assert "Rows that cannot be used: 12 (" in notes


def test_of_two_overlapping_intervals_one_is_kept_whole():
    log = b"A,0,6,mud\nA,4,8,sand\nA,8,9,mud\n"
    assert column_of(log, on_overlap="upper") == "mmmmmmssm"
    assert column_of(log, on_overlap="lower") == "mmmmssssm"
    assert column_of(log, on_overlap="drop") == "........m"
    inside = b"A,0,8,mud\nA,2,3,sand\nA,5,6,sand\n"
    assert column_of(inside, on_overlap="upper") == "mmmmmmmm"
    assert column_of(inside, on_overlap="lower") == "mms..s"


@pytest.mark.parametrize(
    ("log", "whole"),
    [
        (b"A,,3,mud\nA,,5,sand\nA,,6,mud\n", "mmmssm"),  # only bases: the first begins at 0
        (b"A,0,,mud\nA,17,,sand\n", 17 * "m" + "sss"),  # only tops: the last ends with the well
        (b"A,2,,sand\nA,,2,mud\nA,4,6,mud\n", "mmssmm"),  # in any order
    ],
)
def test_a_missing_depth_is_that_of_the_neighbouring_row(log, whole):
    assert column_of(log) == whole
    report = imported(b"well,from,to,facies\n" + log)
    assert any(note.startswith("Intervals with only one depth: ") for note in report.notes)
    with pytest.raises(CCWSIMError, match="depth is missing; add it"):
        column_of(log, on_one_depth="error")
    assert len(column_of(log, on_one_depth="drop")) in (0, 6)


def test_a_table_may_have_only_tops_or_only_bases():
    tops = imported(b"well,top,lith\nA,0,mud\nA,5,sand\n").hard_data
    bases = imported(b"well,base,lith\nA,5,mud\nA,20,sand\n").hard_data
    assert tops.n == 20
    assert tops.digest == bases.digest
    with pytest.raises(CCWSIMError, match="line 2: the lower depth is missing, and no other row"):
        imported(b"well,top,lith\nB,0,mud\n")  # the length of the well is unknown
    assert imported(b"well,top,lith\nB,0,mud\nA,0,mud\n", on_bad_row="drop").hard_data.n == 20


def test_an_interval_without_facies_is_left_out_or_that_of_the_interval_above():
    log = b"A,2,3,\nA,3,4,sand\nA,0,2,mud\nB,0,1,\n"
    assert column_of(log) == "mm.s"
    assert column_of(log, on_no_facies="above") == "mmms"
    assert imported(b"well,from,to,facies\n" + log).n_missing == 2
    with pytest.raises(CCWSIMError, match=r"line 2: an interval of 'A' has no facies"):
        column_of(log, on_no_facies="error")


def test_points_know_their_problems_with_and_without_an_answer():
    for answers in ({}, DROP):
        conversion = Conversion(**answers)
        files = BytesIO(COLLARS), BytesIO(BAD_LOG)
        points = read_well_points(*files, GRID, conversion=conversion)
        assert {problem.option for problem in points.problems} == {*DROP}
        placed = place_points(points, GRID, IMAGE)
        if answers:
            assert resolve_points(placed, conversion).hard_data.n > 0
        else:
            with pytest.raises(CCWSIMError, match="on_bad_row"):
                resolve_points(placed, conversion)


def test_the_wells_of_the_cases_say_both_problems_and_take_both_answers(data_dir):
    folder = data_dir.parent / "cases"
    if not folder.exists():
        pytest.skip("no folder of cases")
    tables = [folder / f"{name}.csv" for name in ("collars", "intervals")]
    grid = Grid(100, 200, nz=40)
    with pytest.raises(CCWSIMError) as error:
        import_wells(*tables, grid, IMAGE, surveys=folder / "survey.csv")
    assert "lines 9 and 10: two intervals of 'W3' overlap" in str(error.value)
    assert "line 12: there is no collar of the well 'W5'" in str(error.value)
    answers = {"on_overlap": "lower", "on_no_collar": "drop", "on_outside": "drop"}
    report = import_wells(*tables, grid, IMAGE, surveys=folder / "survey.csv", **answers)
    assert [*report.wells] == ["W1", "W2", "W3", "W4"]


@pytest.mark.parametrize("option", CONVERSION_CHOICES)
def test_an_unknown_choice_is_said_with_those_there_are(option):
    with pytest.raises(
        CCWSIMError, match=f"{option} = 'maybe' must be one of {CONVERSION_CHOICES[option][0]}"
    ):
        Conversion(**{option: "maybe"})


def test_the_command_line_has_each_choice(tmp_path, capsys):
    (tmp_path / "c.csv").write_bytes(COLLARS)
    (tmp_path / "l.csv").write_bytes(BAD_LOG)
    np.save(tmp_path / "ti.npy", np.indices((10, 12, 12)).sum(0) // 5 % 2)
    line = (
        f"simulate {tmp_path}/ti.npy --grid 8x8x30 --template 8x8x4 --overlap 2x2x2 --level 1 "
        f"--hard-data {tmp_path}/l.csv --collars {tmp_path}/c.csv --output {tmp_path}/out.npz "
        "--facies-name mud=0 --facies-name sand=1"
    )
    assert main(line.split()) != 0
    assert "--on-no-collar" in capsys.readouterr().err
    answers = " ".join(f"--{name.replace('_', '-')} {way}" for name, way in DROP.items())
    assert main(f"{line} {answers}".split()) == 0
    for option, choices in ROW_CHOICES.items():
        assert main([*line.split(), f"--{option.replace('_', '-')}", "maybe"]) != 0
        said = capsys.readouterr().err
        assert all(f"'{choice}'" in said for choice in choices)


def test_a_german_height_of_the_collar_is_one():
    for name in ("Ansatzhöhe", "Ansatzhoehe [m NN]"):
        collars = f"Bohrung;Rechtswert;Hochwert;{name};Endteufe\nA;1,5;1,5;30;20\n"
        guess = preview_wells(BytesIO(collars.encode()), "collars").guess
        assert (guess["z"], guess["collar_length"]) == (name, "Endteufe")


def test_well_tops_of_petrel_are_tops_of_intervals():
    heads = ["X", "Y", "Z", "MD", "Type", "Surface", "Well"]
    rows = '1.5 1.5 30 0 Horizon "mud" "A"', '1.5 1.5 25 5 Horizon "sand" "A"'
    tops = "\n".join(["# Petrel well tops", "BEGIN HEADER", *heads, "END HEADER", *rows, ""])
    report = imported(tops.encode())
    assert report.hard_data.n == 20
    assert sorted(report.hard_data.facies.tolist()) == [0] * 5 + [1] * 15
