"""Test the command line: files, exit codes, messages, Ctrl-C."""

from __future__ import annotations

import json
import os
import re
import shlex
import signal
import subprocess
import sys
import threading
import time
from dataclasses import fields, replace
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import ccwsim
from ccwsim import HardData, Parameters, TrainingImage, datasets, read_training_image
from ccwsim.cli import inputs
from ccwsim.cli.dashboard import app_file, command_line
from ccwsim.cli.options import EPILOGS, classes, sizes
from ccwsim.cli.program import COMMANDS, main
from ccwsim.cli.progress import SIGNALS, STARTING, ProgressLine, stop_on_signals
from ccwsim.cli.simulate import command, ensemble_summary
from ccwsim.io import parameters_to_json, realizations, write_training_image
from ccwsim.model.parameters import PARAMETER_CHOICES, PER_AXIS
from ccwsim.sharing.codec import fields_of

ROOT = Path(__file__).parents[2]
SMALL = ["--template", "16", "--overlap", "4", "--level", "1"]
PARAMETERS = Parameters(template_size=16, overlap_size=4, wavelet_level=1)


def run(*arguments: object) -> int:
    """Run a command line in this process."""
    return main([str(argument) for argument in arguments])


def loaded(path: Path) -> dict[str, np.ndarray]:
    with np.load(path) as saved:
        return {key: saved[key] for key in saved.files}


def test_a_command_line_gives_what_the_same_call_gives(tmp_path):
    out = tmp_path / "out.npz"
    line = ["simulate", "channels", "--grid", "60x40", *SMALL, "--candidates", 5]
    assert run(*line, "--realizations", 3, "--seed", 7, "--workers", 2, "-o", out) == 0
    p = Parameters(template_size=16, overlap_size=4, wavelet_level=1, n_candidates=5)
    e = ccwsim.simulate(datasets.load("channels"), (40, 60), p, n_realizations=3, seed=7)
    saved = loaded(out)
    np.testing.assert_array_equal(saved["realizations"], e.realizations)
    assert json.loads(str(saved["parameters"])) == json.loads(parameters_to_json(p))


def test_a_small_image_has_the_sizes_that_are_advised_unless_one_is_given(tmp_path):
    file, out = tmp_path / "small.npy", tmp_path / "out.npz"
    small = ccwsim.TrainingImage(ccwsim.datasets.load("channels").array[:72, :96])
    np.save(file, small.array)
    usual = ccwsim.metrics.default_parameters(small)
    for given, p in ((), usual), (("--level", 2), ccwsim.Parameters()):
        assert run("simulate", file, "--grid", "40x40", "--seed", 7, "-q", *given, "-o", out) == 0
        wanted = ccwsim.simulate(small, (40, 40), p, seed=7)
        np.testing.assert_array_equal(loaded(out)["realizations"], wanted.realizations)


def test_the_advice_is_printed_with_its_reason_unless_sizes_are_given(tmp_path, capsys):
    line = ["simulate", "fractures", "--grid", "40x40", "-o", tmp_path / "out.npz"]
    assert run(*line) == 0
    advice = "Advised: T 18 · OR 4 · level 1. The thinnest facies is 2 cells thick"
    assert advice in capsys.readouterr().err
    assert run(*line, "--template", 32) == 0
    assert "Advised" not in capsys.readouterr().err


def test_every_parameter_has_its_option_and_its_help(capsys):
    assert run("simulate", "--help") == 0
    shown = "".join(capsys.readouterr().out.split())
    table = [row for row in inputs._TABLE if row.group not in ("flow", "paper")]
    rows = [*table, *inputs._parameter_rows()]
    assert {spec.fields[0] for spec in fields_of("parameters")} < {row.argument for row in rows}
    for row in rows:
        assert row.option.split()[-1].split("/")[0] in shown
        assert "".join(row.help.split()) in shown


def test_the_help_is_true(capsys):
    assert run("simulate", "--help") == 0
    shown = " ".join(capsys.readouterr().out.split())
    output = shown[shown.index("-o, --output") :]
    formats = (*realizations.REALIZATION_FORMATS, "npy")
    assert [kind for kind in formats if not re.search(rf"\b{kind}\b", output)] == []
    assert shown.count("order x, y, z") == 1
    examples = {}
    specs = {spec.fields[0]: spec for spec in fields_of("parameters")}
    for row in inputs._parameter_rows():
        if example := re.search(r"one number or three, such as ([\dx.]+)", row.help):
            examples[row.argument] = specs[row.argument].read(example[1])
            assert example[0] in shown
    assert examples.keys() == {*PER_AXIS, "location_weight"}
    assert Parameters(**examples).wavelet_level == (1, 2, 2)
    assert all("|".join(words) in shown for words in PARAMETER_CHOICES.values())


@pytest.mark.parametrize(
    ("line", "said"),
    [
        (["simulat", "channels"], "Did you mean simulate?"),
        (["warmup"], "Did you mean warm-up?"),
        (["run"], "No such command 'run'. Choose one of simulate, flow, dashboard, datasets"),
        (["simulate", "channels", "--lvel", "2"], "--level"),
        (["--versoin"], "--version"),
        (["simulate", "chanels", "-o", "a.npz"], "Did you mean channels?"),
        (["simulate", "channels", "-o", "a.npz", "--hard-data", "channels_60_well"], "60_wells?"),
        (["datasets", "Dune"], "Did you mean dunes?"),
    ],
)
def test_an_unknown_word_has_a_suggestion(line, said, capsys):
    assert run(*line) == 2
    assert said in " ".join(capsys.readouterr().err.split())


@pytest.mark.parametrize("field", fields(Parameters), ids=lambda f: f.name)
def test_every_option_reaches_its_parameter(tmp_path, field):
    others = {"template_size": 24, "overlap_size": 12, "wavelet_level": 1, "n_candidates": 3}
    others |= {"method": "ccsim", "similarity": "correlation", "search_fraction": 0.5}
    others |= {"co_template": 1, "template_variation": 0.25}
    if field.name not in others and not isinstance(field.default, bool):
        pytest.skip(f"no second value of {field.name} is known to this test")
    row = next(row for row in fields_of("parameters") if row.fields == (field.name,))
    if isinstance(field.default, bool):
        wanted = not field.default
        given = [row.option if wanted else row.no_option]
    else:
        wanted = others[field.name]
        given = [row.option, wanted]
    out = tmp_path / "out.npz"
    assert run("simulate", "stone_wall", "--grid", "40x40", "-q", "-o", out, *given) == 0
    assert json.loads(str(loaded(out)["parameters"]))[field.name] == wanted


@pytest.mark.parametrize("variant", ["paper", "code"])
def test_one_option_chooses_the_method_of_the_paper_or_of_its_authors(tmp_path, variant):
    out = tmp_path / "out.npz"
    given = ["simulate", "channels", "--grid", "40x40", "-q", "-o", out, "--as", variant]
    assert run(*given, "--template", 16, "--overlap", 4) == 0
    known = json.loads(str(loaded(out)["parameters"]))
    wanted = Parameters.published(variant, template_size=16, overlap_size=4)
    assert Parameters(**known) == wanted


def test_an_addition_to_the_paper_is_refused_beside_it(tmp_path, capsys):
    out = tmp_path / "out.npz"
    given = ["simulate", "channels", "--grid", "40x40", "-o", out, "--as", "paper", "--refine"]
    assert run(*given) == 2
    assert "--refine True is not allowed with variant = paper" in capsys.readouterr().err


def test_options_come_before_a_file_of_parameters(tmp_path):
    file, out = tmp_path / "p.json", tmp_path / "out.npz"
    file.write_text(parameters_to_json(PARAMETERS))
    line = ["simulate", "dunes", "--grid", "40x40", "--parameters", file, "--overlap", 8, "-o", out]
    assert run(*line) == 0
    saved = json.loads(str(loaded(out)["parameters"]))
    assert (saved["template_size"], saved["overlap_size"]) == (16, 8)


@pytest.fixture
def layers(tmp_path):
    """Return the file of a volume of three facies, whose layers are thicker than wide."""
    array = np.indices((14, 30, 34)).sum(axis=0) // 5 % 3
    np.save(tmp_path / "layers.npy", array.astype(np.uint8))
    return tmp_path / "layers.npy"


def test_a_volume_is_simulated_with_lengths_along_each_axis(tmp_path, layers, capsys):
    wells, out = tmp_path / "wells.csv", tmp_path / "out.npz"
    wells.write_text("x,y,z,facies\n1015,15,5.25,1\n1295,15,6.75,0\n1005,195,5.25,2\n")
    line = ["simulate", layers, "--grid", "30x20x9", "--template", "16x16x6", "--overlap", "4x4x2"]
    line += ["--level", "1x1x0", "--cell-size", 10, 10, "--origin", 1000, 0, "--cell-height", 0.5]
    line += ["--location-weight", "0x0x1"]
    line += ["--bottom", 5, "--hard-data", wells, "--realizations", 2, "-o", out]
    assert run(*line) == 0
    saved = loaded(out)
    realizations = saved["realizations"]
    assert realizations.shape == (2, 9, 20, 30)
    assert (realizations[:, 0, 1, 1] == 1).all()
    assert (realizations[:, 3, 1, 29] == 0).all()
    assert (realizations[:, 0, 19, 0] == 2).all()
    parameters = json.loads(str(saved["parameters"]))
    assert parameters["template_size"] == [6, 16, 16]
    assert parameters["wavelet_level"] == [0, 1, 1]
    assert parameters["location_weight"] == [1, 0, 0]
    said = capsys.readouterr().err
    assert "2 realizations of 30 × 20 × 9 cells" in said
    assert "3 of 3 honoured in every realization" in said


def test_the_top_layer_may_come_first(tmp_path, layers):
    out, turned = tmp_path / "out.npz", tmp_path / "turned.npz"
    line = ["simulate", layers, "--grid", "20x20x8", "--template", 8, "--overlap", 2, "--level", 1]
    assert run(*line, "-o", out) == 0
    np.save(layers, np.load(layers)[::-1])
    assert run(*line, "--no-z-up", "-o", turned) == 0
    np.testing.assert_array_equal(loaded(out)["realizations"], loaded(turned)["realizations"])


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--slice", 3, "--grid", "20x20", "--cell-height", 2], "give --grid three numbers"),
        (
            ["--slice", 3, "--grid", "20x20", "--template", "8x8x4"],
            "the grid is a map: give one number",
        ),
        (["--grid", "20x20x8", "--template", "8x8"], "written XxYxZ"),
        (["--grid", "20x20x8", "--location-weight", "0x2"], "such as 0x0x2"),
        (["--grid", "20x20x8", "--template", "32x32x16"], "larger than the training image"),
        (["--grid", "20x20x8", "--template", "8x8x5"], "along z"),
    ],
)
def test_lengths_of_volumes_that_cannot_be_are_refused(tmp_path, layers, capsys, options, said):
    usual = ["--overlap", 2, "--level", 1, "-o", tmp_path / "out.npz"]
    assert run("simulate", layers, *usual, *options) != 0
    assert said in capsys.readouterr().err


def test_data_in_world_coordinates_are_honoured_on_a_grid_that_is_no_square(tmp_path, capsys):
    wells, out = tmp_path / "wells.csv", tmp_path / "out.npz"
    wells.write_text("x,y,facies\n1015,15,1\n1295,15,0\n1005,195,1\n")
    line = ["simulate", "channels", "--grid", "30x20", *SMALL, "--cell-size", 10, 10]
    line += ["--origin", 1000, 0, "--hard-data", wells, "--realizations", 4, "-o", out]
    assert run(*line) == 0
    saved = loaded(out)
    realizations = saved["realizations"]
    assert realizations.shape == (4, 20, 30)
    assert (realizations[:, 1, 1] == 1).all()
    assert (realizations[:, 1, 29] == 0).all()
    assert (realizations[:, 19, 0] == 1).all()
    assert saved["origin"].tolist() == [1000, 0]
    assert saved["cell_size"].tolist() == [10, 10]
    assert "3 of 3 honoured in every realization" in capsys.readouterr().err


def test_bundled_data_bring_their_grid(tmp_path):
    out = tmp_path / "out.npz"
    assert run("simulate", "barchans", "--hard-data", "barchans_200_data", "-o", out) == 0
    saved, data = loaded(out), datasets.load_hard_data("barchans_200_data")
    assert saved["realizations"].shape[1:] == datasets.hard_data_grid_shape("barchans_200_data")
    assert data.n_mismatched(saved["realizations"][0]) == 0


def test_columns_names_and_a_piece_are_chosen_by_options(tmp_path):
    wells, out, ti = tmp_path / "wells.csv", tmp_path / "out.npz", tmp_path / "ti.npy"
    wells.write_text("a,b,top,kind\n3.5,4.5,10,Sand\n20.5,30.5,11,Clay\n")
    image = np.kron(np.indices((32, 32)).sum(axis=0) // 4 % 2, np.ones((2, 2), int))
    np.save(ti, np.pad(image, ((3, 0), (5, 0)), constant_values=9))
    line = ["simulate", ti, "--crop", 5, 3, 64, 64, "--every", 2, "--grid", "40x40", *SMALL]
    line += ["--hard-data", wells, "--hard-x", "a", "--hard-y", "b", "--hard-facies", "kind"]
    assert run(*line, "-o", out, "--facies-name", "sand=1", "--facies-name", "Clay=0") == 0
    found = loaded(out)["realizations"][0]
    assert found[4, 3] == 1
    assert found[30, 20] == 0
    assert set(np.unique(found)) == {0, 1}


def test_layers_and_merged_facies_are_chosen_by_options(tmp_path):
    ti, out = tmp_path / "ti.npy", tmp_path / "out.npz"
    layers = np.arange(9)[:, None, None] // 3
    np.save(ti, np.broadcast_to(layers, (9, 24, 24)).astype(np.uint8))
    line = [
        "simulate",
        ti,
        "--layers",
        2,
        6,
        "--merge",
        "2=none",
        "--merge",
        "1=5",
        "--grid",
        "24x24x6",
        "--template",
        4,
        "--overlap",
        1,
    ]
    assert run(*line, "--level", 0, "--realizations", 1, "-o", out) == 0
    assert set(np.unique(loaded(out)["realizations"])) == {0, 5}


@pytest.mark.parametrize("text", ["Sand", "=1", "Sand="])
def test_a_name_without_a_code_is_told(tmp_path, capsys, text):
    line = ["simulate", "channels", "--hard-data", "wells.csv", "--facies-name", text]
    assert run(*line, "-o", tmp_path / "out.npz") == 2
    assert "such as Sand=1" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("rows", "option", "n_left"),
    [
        ("0,0,1\n50,0,1\n", "--on-outside=drop", 1),
        ("0,0,1\n1,0,9\n", "--on-unknown=drop", 1),
        ("0,0,1\n0,0,0\n2,2,0\n", "--on-collision=drop", 1),
        ("0,0,1\n0,0,0\n0,0,0\n", "--on-collision=majority", 1),
    ],
)
def test_troubles_with_data_stop_unless_an_option_settles_them(
    tmp_path, capsys, rows, option, n_left
):
    wells, out = tmp_path / "wells.csv", tmp_path / "out.npz"
    wells.write_text("row,col,facies\n" + rows)
    line = ["simulate", "channels", "--grid", "40x40", *SMALL, "--hard-data", wells, "-o", out]
    assert run(*line) == 2
    assert "wells.csv" in capsys.readouterr().err
    assert not out.exists()
    assert run(*line, option) == 0
    assert len(loaded(out)["hard_facies"]) == n_left
    assert "left out" in capsys.readouterr().err


def test_a_grey_picture_needs_a_threshold_and_is_turned_as_asked(tmp_path, capsys):
    grey = np.add.outer(np.arange(48) * 3, np.arange(64)).astype(np.uint8)
    picture, out = tmp_path / "ti.png", tmp_path / "out.npz"
    Image.fromarray(grey).save(picture)
    line = ["simulate", picture, "--grid", "40x40", *SMALL, "-o", out]
    assert run(*line) == 2
    assert "threshold" in capsys.readouterr().err
    for extra, up in (([], None), (["--up"], True), (["--no-up"], False)):
        assert run(*line, "--threshold", 100, *extra) == 0
        ti = read_training_image(picture, threshold=100, up=up)
        e = ccwsim.simulate(ti, (40, 40), PARAMETERS)
        np.testing.assert_array_equal(loaded(out)["realizations"], e.realizations)


def test_a_classic_gslib_grid_is_read_with_shape_variable_and_classes(tmp_path):
    ny, nx = 40, 50
    values = np.random.default_rng(1).random((ny, nx))
    rows = "\n".join(f"7 {value:.6f}" for value in values.ravel())
    file, out = tmp_path / "ti.gslib", tmp_path / "out.npz"
    file.write_text(f"a title\n2\nnothing\nporosity\n{rows}\n")
    line = ["simulate", file, "--shape", f"{nx}x{ny}", "--variable", "porosity"]
    line += ["--classes", "0.3,0.6", "--grid", "40x40", *SMALL, "--transpose", "-o", out]
    assert run(*line) == 0
    ti = TrainingImage(np.digitize(np.round(values, 6), [0.3, 0.6]).T)
    e = ccwsim.simulate(ti, (40, 40), PARAMETERS)
    np.testing.assert_array_equal(loaded(out)["realizations"], e.realizations)


def test_continuous_data_take_the_class_edges_of_the_image(tmp_path):
    wells, out = tmp_path / "wells.csv", tmp_path / "out.npz"
    wells.write_text("row,col,porosity\n3,4,0.31\n9,4,0.05\n")
    line = ["simulate", "channels", "--grid", "40x40", *SMALL, "--hard-data", wells, "-o", out]
    assert run(*line) == 2
    assert run(*line, "--hard-threshold", 0.2) == 0
    assert loaded(out)["hard_facies"].tolist() == [1, 0]
    assert run(*line, "--hard-classes", 0.2) == 0
    assert loaded(out)["hard_facies"].tolist() == [1, 0]


def test_all_formats_hold_the_same_realizations(tmp_path):
    files = [tmp_path / f"out.{ending}" for ending in ("npz", "sgems", "gslib", "png")]
    outputs = [part for file in files for part in ("-o", file)]
    line = ["simulate", "levees", "--grid", "50x30", *SMALL, "--realizations", 2, *outputs]
    assert run(*line) == 0
    kept = loaded(files[0])["realizations"]
    for file in files[1:3]:
        second = read_training_image(file, variable="realization_2", classes="codes")
        np.testing.assert_array_equal(second.array, kept[1])
    with Image.open(files[3]) as sheet:
        assert sheet.size[0] * sheet.size[1] >= 2 * 50 * 30
    assert not [path for path in tmp_path.iterdir() if path not in files]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["no_such_image"], "channels"),
        (["channels", "--template", "31"], "try 28 or 32"),
        (["channels", "--template", "512"], "larger than the training image"),
        (["channels", "--method", "magic"], "ccwsim, ccsim"),
        (["channels", "--realizations", "0"], "at least 1"),
        (["channels", "--workers", "0"], "at least 1"),
        (["channels", "--seed", "-1"], "at least 0"),
        (["channels", "--grid", "0x5"], "from 1 to"),
        (["channels", "--cell-size", "0", "1"], "positive"),
        (["channels", "--threshold", "3"], "./channels"),
        (["channels", "--hard-data", "no_such_file.csv"], "channels_60_wells"),
        (["channels", "--on-outside", "drop"], "--hard-data"),
        (["channels", "--parameters", "no_such_file.json"], "no_such_file.json"),
        (["channels", "--output", "out.bmp"], "npz"),
        (["channels", "--output", "no_such_folder/out.npz"], "no_such_folder"),
        (["channels", "--grid", "512"], "640x480"),
        (["channels", "--grid", "4x4x4"], "give a volume as training image"),
        (["channels", "--levels", "2"], "--levels"),
        (["channels", "--classes", "a,b"], "codes"),
    ],
)
def test_bad_input_is_said_in_a_sentence_and_exits_with_2(capsys, arguments, said):
    assert run("simulate", "-o", "out.npz", *arguments) == 2
    heard = capsys.readouterr()
    assert said in heard.err
    assert "Traceback" not in heard.err
    assert heard.out == ""


def test_what_could_not_be_written_is_said_before_the_run(tmp_path, monkeypatch):
    monkeypatch.setattr("ccwsim.run.simulation.simulate", lambda *_, **__: pytest.fail("it ran"))
    assert run("simulate", "channels", "-o", tmp_path) == 2
    assert run("simulate", "channels", "-o", tmp_path / "none" / "out.npz") == 2


def test_without_an_output_the_option_is_named_before_anything_runs(monkeypatch, capsys):
    monkeypatch.setattr("ccwsim.run.simulation.simulate", lambda *_, **__: pytest.fail("it ran"))
    assert run("simulate", "channels") == 2
    assert "'--output'" in capsys.readouterr().err


def test_quiet_says_nothing(tmp_path, capsys):
    line = ["simulate", "channels", "--grid", "40x40", "-o", tmp_path / "out.npz"]
    assert run(*line) == 0
    assert "Proportions" in capsys.readouterr().err
    assert run(*line, "--quiet") == 0
    heard = capsys.readouterr()
    assert heard.out + heard.err == ""


def test_no_command_and_version(capsys):
    assert run() == 2
    assert "COMMAND" in capsys.readouterr().err
    assert run("--version") == 0
    assert ccwsim.__version__ in capsys.readouterr().out


class Terminal(StringIO):
    """A stream that can pretend to be a terminal, and keeps all written text."""

    def __init__(self, is_terminal: bool) -> None:
        super().__init__()
        self.is_terminal = is_terminal

    def isatty(self) -> bool:
        return self.is_terminal


@pytest.mark.slow
def test_a_terminal_has_a_bar_that_goes_away():
    stream = Terminal(True)
    line = ProgressLine(10, stream)
    line(0.0, 0)
    assert stream.getvalue().endswith(STARTING)
    for fraction in (0.05, 0.25, 1.0):
        time.sleep(0.11)
        line(fraction, int(10 * fraction))
    assert "2 of 10 realizations" in stream.getvalue()
    line.write("first")
    line.clear()
    assert "\r" in stream.getvalue()
    assert stream.getvalue().count("\n") == 1


def test_elsewhere_a_line_is_written_every_few_seconds(monkeypatch):
    clock = iter([0.0, 100.0, 103.0, 110.0])
    monkeypatch.setattr(time, "monotonic", lambda: next(clock))
    stream = Terminal(False)
    line = ProgressLine(4, stream)
    line(0.0, 0)
    line(0.2, 0)
    line(0.3, 1)
    line(0.4, 1)  # 0.2 of the work took 10 s, 0.6 are left
    line.clear()
    assert stream.getvalue() == "20 %, 0 of 4 realizations\n40 %, 1 of 4 realizations, 30 s left\n"


def test_sizes_in_words():
    assert (sizes("640x480"), sizes("3×2x4")) == ((480, 640), (4, 2, 3))
    assert [classes(text) for text in ("3", "0.1,0.25", "codes")] == [3, [0.1, 0.25], "codes"]


@pytest.mark.parametrize("name", SIGNALS)
def test_a_signal_is_caught_once_and_only_inside(name, monkeypatch):
    number = getattr(signal, name)
    monkeypatch.setattr("ccwsim.cli.progress.os.dup2", lambda *_: None)  # stays open in tests
    before = signal.signal(number, signal.SIG_DFL)  # known state for the test
    try:
        with stop_on_signals() as stopped:
            assert not stopped()
            signal.raise_signal(number)
            assert stopped()
            assert stopped.exit_code == 128 + number
        assert signal.getsignal(number) == signal.SIG_DFL
    finally:
        signal.signal(number, before)


def test_a_signal_that_is_ignored_stays_so():
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)  # as under nohup
    try:
        with stop_on_signals() as stopped:
            signal.raise_signal(signal.SIGHUP)
            assert not stopped()
    finally:
        signal.signal(signal.SIGHUP, before)


AT_THE_END = """
import atexit, sys
def wait():
    print("waiting", file=sys.stderr, flush=True)
    sys.stdin.read()
atexit.register(wait)
from ccwsim.cli.program import main
sys.exit(main())
"""


@pytest.mark.slow
@pytest.mark.parametrize("name", SIGNALS)
def test_a_signal_after_the_output_is_written_does_not_fail_the_program(name, tmp_path):
    line = [sys.executable, "-c", AT_THE_END, "simulate", "channels", "--grid", "64x64"]
    line += ["--output", str(tmp_path / "out.npy")]
    pipes = {"stdin": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen(line, cwd=ROOT, **pipes) as process:
        lines = iter(process.stderr.readline, b"waiting\n")  # type: ignore[union-attr]
        assert any(b"Written" in line for line in lines)
        while process.stderr.readline() not in (b"waiting\n", b""):  # type: ignore[union-attr]
            pass
        process.send_signal(getattr(signal, name))
        process.stdin.close()  # type: ignore[union-attr]
        assert process.wait(120) == 0


@pytest.mark.slow
@pytest.mark.parametrize("name", ["SIGTERM", "SIGHUP"])
def test_a_batch_system_or_a_closed_terminal_keeps_what_is_finished(name, tmp_path):
    out = tmp_path / "out.npy"
    line = [sys.executable, "-m", "ccwsim", "simulate", "channels", "--grid", "256x256"]
    line += ["--realizations", "5000", "--workers", "1", "--output", str(out)]
    heard = {"preexec_fn": lambda: signal.signal(signal.SIGHUP, signal.SIG_DFL)}
    process = subprocess.Popen(line, cwd=ROOT, stderr=subprocess.PIPE, **heard)
    try:
        while b" of 5000 " not in process.stderr.readline():  # type: ignore[union-attr]
            assert process.poll() is None
        process.send_signal(getattr(signal, name))
        if name == "SIGHUP":
            process.stderr.close()  # type: ignore[union-attr]
        assert process.wait(120) == SIGNALS[name]
    finally:
        process.kill()
    assert [path.name for path in tmp_path.iterdir()] == ["out.npy"]
    assert 1 <= len(np.load(out)) < 5000


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="there are no pseudo terminals")
def test_ctrl_c_keeps_what_is_finished(tmp_path):
    import pty

    out, (ours, theirs) = tmp_path / "out.npz", pty.openpty()
    line = [sys.executable, "-m", "ccwsim", "simulate", "channels", "--grid", "256x256"]
    line += ["--realizations", "5000", "--workers", "1", "--output", str(out)]
    process = subprocess.Popen(line, cwd=ROOT, stderr=theirs, stdout=subprocess.DEVNULL)
    os.close(theirs)
    deadline = threading.Timer(240, process.kill)
    deadline.start()
    try:
        seen = b""
        while not re.search(rb" [1-9]\d* of 5000 ", seen):
            seen += os.read(ours, 4096)
        process.send_signal(signal.SIGINT)
        while process.poll() is None:
            try:
                seen += os.read(ours, 4096)
            except OSError:  # the other end is closed
                break
        assert process.wait() == 130
    finally:
        deadline.cancel()
        process.kill()
        os.close(ours)
    assert b"stopped after" in seen
    kept = loaded(out)["realizations"]
    assert 1 <= len(kept) < 5000
    alone = ccwsim.simulate(datasets.load("channels"), (256, 256), n_realizations=2)
    n = min(2, len(kept))
    np.testing.assert_array_equal(kept[:n], alone.realizations[:n])


def test_summary_owns_up_to_data_that_are_not_honoured():
    data = HardData([[0, 0], [1, 1]], [1, 1])
    e = ccwsim.simulate(datasets.load("channels"), (40, 40), PARAMETERS, data)
    assert "2 of 2 honoured" in ensemble_summary(e)
    assert f"({100 * e.training_image.proportions[1]:.1f} %)." in ensemble_summary(e)
    assert "2.0 of 2 NOT honoured" in ensemble_summary(replace(e, indices=np.zeros_like(e.indices)))


def test_the_images_of_a_file_and_of_the_bundle_do_not_mix(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    other = TrainingImage(np.tile([[0, 5], [5, 5]], (20, 20)))
    write_training_image("channels", other, format="npy")
    for name, codes in (("channels", {0, 1}), ("./channels", {0, 5})):
        assert run("simulate", name, "--grid", "40x40", *SMALL, "-q", "-o", "out.npz") == 0
        assert set(np.unique(loaded(Path("out.npz"))["realizations"])) == codes


def commands() -> list[str]:
    """Return the commands in the documents and in the help."""
    documents = ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))
    text = "\n".join(document.read_text("utf-8") for document in documents)
    shown = "\n".join(re.findall(r"```sh\n(.*?)```", text, re.DOTALL))
    return re.findall(r"ccwsim (simulate .*)", shown + EPILOGS["simulate"].replace("\\\n", " "))


def test_the_command_lines_of_documents_and_of_the_help_are_understood():
    lines = commands()
    assert len(lines) >= 12
    for line in lines:
        _, *arguments = shlex.split(line.partition(" | ")[0])
        assert command.make_context("simulate", arguments).params["output"]


def test_the_version_is_said_without_loading_the_kernels():
    code = "import sys; from ccwsim.cli.program import main; main(['--version']); "
    code += "assert not {'numpy', 'numba'} & sys.modules.keys()"
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True)


@pytest.mark.parametrize("name", COMMANDS)
def test_help_writes_nothing(tmp_path, monkeypatch, capsys, name):
    monkeypatch.chdir(tmp_path)
    assert run(name, "--help") == 0
    assert "Usage: ccwsim" in capsys.readouterr().out
    assert not list(tmp_path.iterdir())


def test_datasets_are_listed_and_written(tmp_path, capsys):
    assert run("datasets") == 0
    listed = capsys.readouterr().out
    volumes = (*datasets.volume_names(), *datasets.BUNDLED_WELLS)
    assert all(n in listed for n in (*datasets.names(), *datasets.hard_data_names(), *volumes))
    volume = tmp_path / "volume.sgems"
    assert run("datasets", "folded_layers", "--output", volume) == 0
    np.testing.assert_array_equal(
        read_training_image(volume, volume=True).array, datasets.load("folded_layers").array
    )
    image, data = tmp_path / "ti.png", tmp_path / "wells.csv"
    assert run("datasets", "levees", "--output", image) == 0
    assert run("datasets", "channels_60_wells", "--output", data) == 0
    np.testing.assert_array_equal(read_training_image(image).array, datasets.load("levees").array)
    shape = datasets.hard_data_grid_shape("channels_60_wells")
    kept = ccwsim.read_hard_data(data, ccwsim.Grid.of(shape))
    assert kept.digest == datasets.load_hard_data("channels_60_wells").digest
    for wrong in (["mars"], ["-o", image], ["levees", "-o", tmp_path / "none" / "ti.png"]):
        assert run("datasets", *wrong) == 2


def test_the_dashboard_is_found_and_its_options_are_passed_on(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert app_file().is_file()
    assert (app_file().parent / ".streamlit" / "config.toml").is_file()
    line = command_line(app_file(), 8600, ("--server.headless=true",))
    options = ["showEmailPrompt=false", "port=8600", "headless=true"]
    assert line[-3:] == [f"--server.{option}" for option in options]
    assert "--server.fileWatcherType=none" in line
    monkeypatch.setattr(ccwsim, "__file__", str(tmp_path / "ccwsim" / "__init__.py"))
    with pytest.raises(ccwsim.CCWSIMError, match="no dashboard"):
        app_file()


@pytest.mark.slow
def test_secondary_information_in_files_gives_what_the_same_call_gives(tmp_path):
    rng = np.random.default_rng(3)
    active, soft = np.ones((40, 48)), rng.random((40, 48))
    active[:, :12] = 0
    wide, ramp = datasets.load("channels").shape, np.linspace(0, 1, 48) + np.zeros((40, 1))
    own = np.linspace(0, 1, wide[1]) + np.zeros((wide[0], 1))
    arrays = {"active": active, "soft=1": soft, "own": own, "ramp": ramp}
    files = {name: tmp_path / f"{name}.npy" for name in arrays}
    for name, values in arrays.items():
        np.save(files[name], values)
    out = tmp_path / "out.npz"
    line = ["simulate", "channels", "--grid", "48x40", *SMALL, "--seed", 5, "-o", out]
    line += ["--active", files["active"], "--auxiliary", files["own"], files["ramp"]]
    line += ["--auxiliary-weight", 2, "--soft-weight", 0.5]
    for text in (f"1={files['soft=1']}", f"sand={files['soft=1']}"):
        assert run(*line, "--probability", text) == 0
        given = ccwsim.Secondary(
            active=active,
            probabilities={1: soft},
            auxiliary=[ccwsim.Auxiliary(own, ramp, weight=2)],
            soft_weight=0.5,
        )
        image = datasets.load("channels")
        e = ccwsim.simulate(image, (40, 48), PARAMETERS, seed=5, secondary=given)
        saved = ccwsim.read_realizations(out)
        np.testing.assert_array_equal(saved.indices, e.indices)
        assert saved.secondary.digest == e.secondary.digest


def test_turned_and_further_images_give_what_the_same_call_gives(tmp_path):
    east = np.linspace(0, 60, 48) + np.zeros((40, 1))
    np.save(tmp_path / "angle.npy", east)
    np.save(tmp_path / "zones.npy", (east > 30).astype(int))
    out = tmp_path / "out.npz"
    line = ["simulate", "channels", "--grid", "48x40", *SMALL, "--seed", 5, "-o", out]
    line += ["--other-image", "stone_wall", "--zones", tmp_path / "zones.npy", "--scale", 1.2]
    assert run(*line, "--angle", tmp_path / "angle.npy", "--mirrored", "x") == 0
    image, other = datasets.load("channels"), datasets.load("stone_wall")
    given = ccwsim.Secondary(
        images=[other], zones=(east > 30).astype(int), angle=east, scale=1.2, mirrored="x"
    )
    e = ccwsim.simulate(image, (40, 48), PARAMETERS, seed=5, secondary=given)
    saved = ccwsim.read_realizations(out)
    np.testing.assert_array_equal(saved.indices, e.indices)
    assert saved.secondary.digest == e.secondary.digest


def test_angles_may_follow_lines(tmp_path):
    way = [[0, 5], [24, 30], [48, 35]]
    lines = tmp_path / "valley.geojson"
    lines.write_text(json.dumps({"type": "LineString", "coordinates": way}), "utf-8")
    out, small = tmp_path / "out.npz", ["--grid", "48x40", *SMALL, "--seed", 5]
    assert run("simulate", "channels", *small, "--angle", lines, "-o", out) == 0
    image, grid = datasets.load("channels"), ccwsim.Grid(40, 48)
    azimuth = round(ccwsim.metrics.main_direction(image)[0])
    angle = ccwsim.io.angles_along([way], grid, azimuth)
    assert np.ptp(angle) > 20
    given = ccwsim.Secondary(angle=angle)
    e = ccwsim.simulate(image, grid, PARAMETERS, seed=5, secondary=given)
    saved = ccwsim.read_realizations(out)
    np.testing.assert_array_equal(saved.indices, e.indices)
    assert saved.secondary.digest == e.secondary.digest


def test_active_values_of_a_mask_are_an_option_and_their_cells_are_counted(tmp_path, capsys):
    basins = np.arange(48) // 12 + np.zeros((40, 1), int)
    np.save(tmp_path / "basins.npy", basins)
    out = tmp_path / "out.npz"
    line = ["simulate", "channels", "--grid", "48x40", *SMALL, "-o", out]
    line += ["--active", tmp_path / "basins.npy"]
    assert run(*line) == 2
    message = capsys.readouterr().err
    assert "the values 0, 1, 2, 3 do not say which cells are inactive" in message
    assert "--active-codes" in message
    assert run(*line, "--active-codes", "0,3") == 0
    assert "960 of 1920 cells are active" in capsys.readouterr().err
    active = ccwsim.read_realizations(out).secondary.active
    np.testing.assert_array_equal(active, np.isin(basins, [0, 3]))


def test_secondary_information_that_does_not_fit_is_refused(tmp_path, capsys):
    np.save(tmp_path / "small.npy", np.ones((3, 3)))
    line = ["simulate", "channels", "--grid", "48x40", "-o", tmp_path / "out.npz"]
    assert run(*line, "--active", tmp_path / "small.npy") == 2
    assert "3 × 3" in capsys.readouterr().err
    assert run(*line, "--probability", f"rock={tmp_path / 'none.npy'}") == 2
    assert "none.npy" in capsys.readouterr().err
    assert run(*line, "--other-image", "stone_wall", "--image-weights", "3,x") == 2
    assert "give numbers, such as 3,1" in capsys.readouterr().err
    assert run(*line, "--scale", 9) == 2
    assert "between 0.2 and 5" in capsys.readouterr().err
