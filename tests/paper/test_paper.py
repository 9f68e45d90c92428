"""Test the paper's experiments at a small size: each reports, and none stops the others."""

from __future__ import annotations

import re
import signal
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ccwsim import CCWSIMError, HardData, Parameters, TrainingImage
from ccwsim.cli.program import main
from ccwsim.paper.experiment import (
    FULL,
    QUICK,
    Experiment,
    Outcome,
    PaperInputs,
    inputs_in,
    inside,
)
from ccwsim.paper.methods import COLUMNS, paper_parameters, wrong_share
from ccwsim.paper.published_times import TABLE_1
from ccwsim.paper.reproduction import (
    EXPERIMENTS,
    Finished,
    document_of,
    reproduce,
    reproduction_summary,
    usual_seconds,
    verdict_of,
    with_largest_grid,
)
from ccwsim.paper.times import level_change
from ccwsim.paper.verdicts import (
    by_claim,
    judge_both,
    judge_data,
    judge_levels,
    judge_ratio,
    judge_ratios,
    judge_time,
    judged,
    order_of,
)
from ccwsim.report.document import (
    Chart,
    Judgement,
    PictureRow,
    Table,
    Text,
    packed_plotly,
    report_html,
)


def experiment_of(figure: str) -> Experiment:
    """Return the experiment that repeats a figure or table of the paper."""
    return next(e for e in EXPERIMENTS if figure in e.place.split(", "))


UNCONDITIONAL, GRID_SIZE, LIMITS = map(experiment_of, ("Fig. 6", "Fig. 13", "Fig. 17"))
TINY = replace(QUICK, n_many=3, n_few=2, n_anodi=2, timed_sides=(64, 96), largest_side=96)
OUTSIDE = re.compile(r"""(?:src|href)\s*=\s*["'](?!data:|#)|@import|url\((?!data:)""", re.I)
ODD = "</script><b>&\"'"


def nothing(run) -> Outcome:
    run.step()
    return Outcome((Text("words"),), (Judgement("claim", "found", "agrees", "good"),))


def failing(run) -> Outcome:
    raise ZeroDivisionError(ODD)


def refusing(run) -> Outcome:
    raise CCWSIMError("the grid is too small")


def made(name: str, run=nothing) -> Experiment:
    return Experiment(f"{name} {ODD}", "Section 0", f"shows {ODD}", run)


@pytest.fixture(scope="module")
def small():
    """Return the report of all experiments at the smallest possible size."""
    return reproduce(extent=TINY, seed=3)


@pytest.mark.slow
def test_a_quick_run_reports_every_experiment(small):
    assert [f.experiment for f in small.finished] == list(EXPERIMENTS)
    assert [f.problem for f in small.finished] == [""] * len(EXPERIMENTS)
    assert all(f.outcome.judgements for f in small.finished)
    page = report_html(document_of(small))
    for k, experiment in enumerate(EXPERIMENTS, start=1):
        assert f'<section id="section-{k}"><h2>{k}. {experiment.title}</h2>' in page
    for stated in ("26.78", "6.52 s", "2.42 s", "3.50 s", "1.06 s", "Seed", "numba", "quick"):
        assert stated in page
    assert not OUTSIDE.findall(page.replace(packed_plotly(), ""))
    assert page.count(packed_plotly()) == 1


def test_every_row_of_charts_has_a_caption_with_data_and_seed(small):
    blocks = [block for f in small.finished for block in f.outcome.blocks]
    assert not any(isinstance(block, Chart) for block in blocks)
    rows = [b for b in blocks if isinstance(b, PictureRow) and isinstance(b.items[0], Chart)]
    assert len(rows) >= 4
    for row in rows:
        assert "no hard data" in row.caption or re.search(r"\d hard data", row.caption)
        assert "seed 3" in row.caption


def test_small_grids_are_not_set_against_the_papers_seconds(small):
    for finished in small.finished:
        for judgement in finished.outcome.judgements:
            assert judgement.word not in ("less time", "more time", "like time")


def test_the_same_seed_gives_the_same_words():
    chosen = (UNCONDITIONAL, LIMITS)
    a, b = (reproduce(extent=TINY, seed=5, experiments=chosen) for _ in range(2))
    for one, other in zip(a.finished, b.finished, strict=True):
        first, second = (
            [j.finding for j in f.outcome.judgements if " ms" not in j.finding]
            for f in (one, other)
        )
        assert first == second


def test_a_failing_experiment_is_told_and_the_others_go_on():
    chosen = (made("first"), made("broken", failing), made("small", refusing), made("last"))
    told = []
    found = reproduce(experiments=chosen, on_finished=told.append)
    assert [f.outcome is None for f in found.finished] == [False, True, True, False]
    assert told == list(found.finished)
    assert verdict_of(found.finished[2]) == "failed: the grid is too small"
    assert "4 experiments were run, 2 of them failed" in reproduction_summary(found)
    page = report_html(document_of(found))
    assert "ZeroDivisionError: &lt;/script&gt;&lt;b&gt;" in page
    assert ODD not in page


def test_cancel_keeps_what_was_finished():
    done = []
    four = [made(str(k)) for k in range(4)]
    found = reproduce(experiments=four, cancel=lambda: len(done) == 2, on_finished=done.append)
    assert found.stopped
    assert len(found.finished) == 2
    assert "The run was stopped" in report_html(document_of(found))


def test_cancel_inside_a_simulation_stops_it():
    asked = []
    found = reproduce(
        extent=TINY, experiments=[UNCONDITIONAL], cancel=lambda: asked.append(1) or len(asked) > 3
    )
    assert found.stopped
    assert found.finished == ()


def test_progress_never_falls_and_ends_at_one():
    seen = []
    three = [made("a"), made("b", failing), made("c")]
    reproduce(experiments=three, progress=lambda share, n: seen.append((share, n)))
    assert seen == sorted(seen)
    assert seen[-1] == (1.0, 3)


def test_words_follow_the_numbers():
    times = [judge_time("x", s, 2.0, "Fig.").word for s in (0.1, 1.9, 9.0)]
    assert times == ["less time", "like time", "more time"]
    assert "no speed-up of the method" in judge_time("x", 0.1, 2.0, "Fig.").finding
    beside_code = [judge_data(w, 100, t, "Ours").word for w, t in ((0, 0.1), (0, 0), (0.2, 0.1))]
    assert beside_code == ["better", "agrees", "behind"]
    assert [judge_data(w, 100, None, "Ours").word for w in (0.0, 0.1)] == ["agrees", "differs"]


@pytest.mark.parametrize(
    ("ours", "theirs", "word"),
    [
        (0.82, 1.33, "differs"),  # less here, more there
        (0.83, 1.03, "differs"),  # less here, alike there
        (1.30, 1.33, "agrees"),
        (3.4, 4.0, "agrees"),
        (3.3, 4.0, "same order"),
        (2.0, 4.2, "same order"),
        (0.9, 0.4, "same order"),
        (1.0, 4.0, "differs"),
        (2.0, 0.4, "differs"),
        (0.95, 1.04, "agrees"),
        (1.07, 1.13, "agrees"),  # nearly equal, although one is within the noise of 1
        (0.92, 0.85, "agrees"),
        (0.92, 1.19, "differs"),
    ],
)
def test_ratios_agree_where_order_and_size_do(ours, theirs, word):
    assert judge_ratio("claim", "found", ours, theirs).word == word


def test_levels_take_less_time_only_where_each_does():
    told = judge_levels({1: 0.0101, 2: 0.00434, 3: 0.00522}, "Ours")
    assert told.word == "differs"
    assert "level 1 10.1 ms, level 2 4.34 ms, level 3 5.22 ms" in told.finding
    assert "level 2 takes less than level 1, level 3 takes more than level 2" in told.finding
    assert judge_levels({1: 56.0, 2: 32.0, 3: 20.0}, "Ours").word == "agrees"
    assert judge_levels({1: 56.0, 2: 32.0, 3: 31.0}, "Ours").word == "differs"
    ends = judge_levels({1: 10.0, 2: 12.0, 3: 5.0}, "Ours")  # not in the middle
    assert ends.word == "differs"


def test_the_change_from_level_to_level_is_set_beside_the_papers():
    taken = {1: [0.002, 0.0101], 2: [0.0009, 0.00434], 3: [0.0008, 0.00522]}
    first, second = (level_change(taken, a, a + 1, "Ours") for a in (1, 2))
    assert "−54.8 %" in first.claim
    assert (first.word, second.word) == ("agrees", "differs")
    assert "−56.0 %" in first.finding
    assert "−17.4 %" in second.claim
    assert "+4.6 %" in second.finding


def test_two_measures_bear_a_claim_out_only_where_both_do():
    assert judge_both(1, 1) == "agrees"
    assert {judge_both(1, 0), judge_both(0, 1), judge_both(1, -1)} == {"in part"}
    assert {judge_both(0, 0), judge_both(-1, 0), judge_both(-1, -1)} == {"differs"}


def test_table_1_is_set_beside_what_is_found(small):
    outcome = next(f for f in small.finished if f.experiment is experiment_of("Table 1")).outcome
    page = report_html(document_of(small))
    assert "0.95 0.92 1.02" in page
    assert "0.78 0.77 0.99" in page
    claims = [j.claim for j in outcome.judgements]
    assert "Table 1: r of CCWSIM relative to MS-CCSIM, stone wall and channel image." in claims
    assert len(claims) == len(set(claims))  # one line per claim
    weights = np.array([4, 2, 1]) / 7  # weights of the resolutions, as in the definition of r
    for paper in TABLE_1.values():
        r = float(weights @ np.divide(paper.between, paper.within))
        assert r == pytest.approx(paper.ratio, abs=0.03)


def tables_of(finished: Finished) -> list[Table]:
    return [block for block in finished.outcome.blocks if isinstance(block, Table)]


def test_each_figure_and_table_is_repeated():
    places = {part for e in EXPERIMENTS for part in e.place.split(", ")}
    assert {f"Fig. {k}" for k in range(6, 18)} | {"Table 1", "Table 2"} <= places
    assert [e.place for e in EXPERIMENTS] == sorted(
        (e.place for e in EXPERIMENTS), key=lambda place: place.split(",")[0]
    )


def test_the_paper_the_published_method_and_ours_stand_side_by_side(small):
    for finished in small.finished:
        texts = [
            " ".join((*table.header, *(row[0] for row in table.rows)))
            for table in tables_of(finished)
        ]
        assert any("as published" in text and "ours" in text for text in texts)
        if finished.experiment not in map(experiment_of, ("Fig. 10", "Fig. 11")):
            assert any("the paper" in text for text in texts)  # these have no numbers


@pytest.mark.parametrize("method", ["ccwsim", "ms-ccsim"])
def test_as_published_is_the_method_of_the_paper_to_the_letter(method):
    level = 2 if method == "ms-ccsim" else 3  # MS-CCSIM counts levels from 1
    as_published, ours = (paper_parameters(method, 3, variant) for variant in ("paper", "ours"))
    assert as_published == Parameters.published(
        "paper", template_size=32, overlap_size=8, wavelet_level=level, method=method
    )
    assert ours == Parameters(32, 8, level, method=method)


def test_verdicts_name_the_column_that_they_judge(small):
    titles = [COLUMNS[column].capitalize() for column in ("paper", "ours")]
    for figure in ("Fig. 6", "Fig. 7", "Fig. 13", "Fig. 14", "Fig. 17", "Table 2"):
        outcome = next(f for f in small.finished if f.experiment is experiment_of(figure)).outcome
        text = " ".join(judgement.finding for judgement in outcome.judgements)
        assert all(title in text for title in titles)


def test_what_the_paper_gives_is_not_said_to_be_missing(small):
    page = report_html(document_of(small))
    for number in ("−54.8 %", "−17.4 %", "7.7 s", "14.53 s", "28.18 s", "1.19", "1.01"):
        assert number in page
    assert "Table 1 are not available" not in page
    assert "authors' page" not in page


@pytest.mark.slow
def test_the_larger_grid_is_what_was_asked_for():
    assert with_largest_grid(FULL, None) is FULL
    assert with_largest_grid(FULL, 5000).timed_sides[-1] == 5000
    with pytest.raises(CCWSIMError, match="63"):
        with_largest_grid(FULL, 63)
    found = reproduce(extent=replace(TINY, timed_sides=(32, 64)), experiments=[GRID_SIZE])
    assert "64 × 64" in report_html(document_of(found))


def test_a_folder_without_the_authors_files_is_refused(tmp_path):
    for folder in (tmp_path, tmp_path / "none"):
        with pytest.raises(CCWSIMError, match="bundled"):
            inputs_in(folder)


def test_the_authors_files_are_used_and_the_rest_is_ours(tmp_path):
    (tmp_path / "paper").mkdir()
    rng = np.random.default_rng(0)
    own = rng.integers(0, 2, (80, 70))
    np.save(tmp_path / "paper" / "ti_channel_256x256.npy", own)
    (tmp_path / "paper" / "hd_channel_100_grid512x512.csv").write_text(
        "row,col,facies\n0,1,1\n300,2,0\n"
    )
    for folder in (tmp_path, tmp_path / "paper"):
        found = inputs_in(folder)
        np.testing.assert_array_equal(found.image("channel").array, own)
        assert found.describe("channel").startswith("the authors'")
        assert found.image("stone wall").name == "stone_wall"
        assert found.data("channel", 100, (512, 512)).n == 2
        assert found.data("channel", 100, (96, 96)).cells.tolist() == [[0, 1]]
        assert found.data("stone wall", 300, (512, 512)) is None


def test_published_realizations_are_read_and_broken_ones_named(tmp_path):
    image = TrainingImage([[0, 7], [7, 0]])
    (tmp_path / "reference").mkdir()
    file = tmp_path / "reference" / "x.npz"
    np.savez(file, r=np.array([[[0, 7]]], np.int8))
    assert PaperInputs(tmp_path).published("x", image).tolist() == [[[0, 1]]]
    assert PaperInputs(tmp_path).published("y", image) is None
    np.savez(file, r=np.array([[[0, 3]]], np.int8))
    with pytest.raises(CCWSIMError, match=r"x\.npz"):
        PaperInputs(tmp_path).published("x", image)
    file.write_bytes(b"nothing")
    with pytest.raises(CCWSIMError, match=r"x\.npz"):
        PaperInputs(tmp_path).published("x", image)


def test_wrong_data_are_counted_in_the_images_own_codes():
    image = TrainingImage([[0, 7]])
    data = HardData([[0, 0], [0, 1]], [7, 7])
    assert wrong_share(np.array([[[1, 1]], [[0, 0]]]), image, data) == 0.5
    assert inside(data, (1, 1)).n == 1


def test_the_published_data_are_found(data_dir):
    found = inputs_in(data_dir / "paper")
    assert all(found.is_own(name) for name in ("channel", "stone wall", "three facies"))
    assert found.data("channel", 1000, (512, 512)).n == 1000
    dense = "channel", 4000, (256, 256)
    assert found.data(*dense).n_mismatched(found.reference(*dense)) == 0
    image = found.image("channel")
    assert found.published("CCWSIM_channel512_hd400_L2", image).shape[1:] == (512, 512)


@pytest.fixture
def few(monkeypatch):
    """Return the command with three very short experiments."""
    import ccwsim.paper.reproduction as package

    chosen = (made("first"), made("broken", failing), made("last"))
    monkeypatch.setattr(package, "EXPERIMENTS", chosen)
    monkeypatch.setattr(
        package, "reproduce", lambda *a, **k: reproduce(*a, **k, experiments=chosen)
    )
    return package


def test_the_command_writes_a_report(few, tmp_path, capsys):
    out = tmp_path / "report.html"
    assert main(["paper", "--quick", "-o", str(out), "--seed", "4"]) == 0
    said = capsys.readouterr().err
    assert re.search(r"^3 experiments, about .+ on this machine$", said, re.MULTILINE)
    assert "3 experiments were run, 1 of them failed" in said
    assert f"Written: {out}" in said
    assert "<dt>Seed</dt><dd>4</dd>" in out.read_text("utf-8")
    assert [p.name for p in tmp_path.iterdir()] == ["report.html"]
    assert main(["paper", "-q", "--quick", "-o", str(out)]) == 0
    assert capsys.readouterr().err == ""


def test_the_command_reads_the_folder_of_the_environment(few, tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("CCWSIM_DATA", str(tmp_path / "none"))
    assert main(["paper", "--quick", "-o", str(tmp_path / "report.html")]) == 2
    assert "none: no such folder" in capsys.readouterr().err


def test_a_larger_grid_is_expected_to_take_longer():
    usual = [usual_seconds(with_largest_grid(FULL, side)) for side in (None, 2500, 5000)]
    assert usual[0] == usual[1] < usual[2]
    assert usual_seconds(QUICK) < usual[0]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["-o", "report.pdf"], "HTML"),
        (["-o", "none/report.html"], "no folder"),
        (["-o", "report.html", "--data", "none"], "no such folder"),
        (["-o", "report.html", "--largest-grid", "5"], "from 64"),
    ],
)
def test_bad_input_is_said_before_anything_runs(arguments, said, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["paper", *arguments]) == 2
    assert said in capsys.readouterr().err
    assert list(Path(tmp_path).iterdir()) == []


def test_ctrl_c_keeps_the_experiments_that_were_finished(few, tmp_path, capsys, monkeypatch):
    def interrupted(run) -> Outcome:
        signal.raise_signal(signal.SIGINT)
        run.step()
        raise AssertionError("it went on")

    chosen = (made("first"), made("second", interrupted), made("third"))
    monkeypatch.setattr(few, "reproduce", lambda *a, **k: reproduce(*a, **k, experiments=chosen))
    out = tmp_path / "report.html"
    assert main(["paper", "-o", str(out)]) == 130
    assert "stopped after 1 of 3 experiments" in capsys.readouterr().err
    assert "The run was stopped" in out.read_text("utf-8")


def test_verdicts_of_several_cases_are_one_verdict():
    one = judged("r > 1.", "Level 1: 1.2.", "agrees")
    other = judged("r > 1.", "2: .9.", "differs")
    words = [by_claim(pair)[0].word for pair in ([one, other], [one, one])]
    assert words == ["in part", "agrees"]
    assert [order_of(ratio) for ratio in (0.82, 1.05, 1.33)] == [-1, 0, 1]


def test_runs_without_experiments_are_summarized():
    none = reproduce(experiments=())
    assert not none.stopped
    assert reproduction_summary(none) == "0 experiments were run. Verdicts: none."
    assert verdict_of(Finished(EXPERIMENTS[0], None, "no memory", 1.0)) == "failed: no memory"
    assert with_largest_grid(FULL, 5000).timed_sides == (1000, 2000, 3000, 4000, 5000)
    assert inputs_in(None).image("channel").name == "channels"


def test_several_ratios_are_one_sentence_and_one_verdict():
    alike, apart = ("level 1", 0.5, 0.52), ("level 3", 2.0, 0.5)
    one = judge_ratios("claim", "Ours", [alike, alike])
    assert one.word == "agrees"
    both = judge_ratios("claim", "Ours", [alike, apart])
    assert both.word == "in part"
    assert both.finding == "Ours: level 1 0.50 (0.52), level 3 2.00 (0.50)."
