"""Test the command line in a shell: completion, JSON, standard input and output, option names."""

from __future__ import annotations

import csv
import json
import re
import shutil
import subprocess
import sys
from io import BytesIO, StringIO, TextIOWrapper

import click
import numpy as np
import pytest
from click.shell_completion import ShellComplete

import ccwsim
from ccwsim import datasets, read_realizations, write_realizations
from ccwsim.cli import inputs
from ccwsim.cli.inputs import OPTION_KINDS, _standard_input
from ccwsim.cli.program import main, program
from tests.flow.test_flow import ensemble

SMALL = ["--grid", "60x40", "--template", "16", "--overlap", "4", "--level", "1"]


def completed(*words: str, incomplete: str = "") -> list[tuple[str, str]]:
    """Return kinds and values that Tab offers after some words."""
    complete = ShellComplete(program, {}, "ccwsim", "_CCWSIM_COMPLETE")
    return [(item.type, item.value) for item in complete.get_completions([*words], incomplete)]


def test_bundled_names_and_files_are_completed(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "channels.tif").touch()
    assert completed("simulate", incomplete="my") == [("file", "my")]
    offered = {value for _, value in completed("simulate", incomplete="chan")}
    assert {"channels", "channels.tif"} <= offered
    everything = {value for _, value in completed("simulate")}
    assert {*datasets.BUNDLED_IMAGES, "channels.tif"} <= everything
    data = {value for _, value in completed("simulate", "channels", "--hard-data")}
    assert {*datasets.BUNDLED_DATA} <= data
    assert "channels" not in data
    assert completed("flow", incomplete="o") == [("file", "o")]


def file_options() -> list[tuple[str, str]]:
    """Return the commands and options whose value is a file, by their metavar."""
    pairs = []
    for name in program.list_commands(click.Context(program)):
        command = program.get_command(click.Context(program), name)
        assert command is not None
        for option in command.params:
            words = {*re.findall("[A-Z]+", option.metavar or "")}
            if isinstance(option, click.Option) and words & {"FILE", "FOLDER", "DIR", "TI", "F"}:
                pairs.append((name, option.opts[-1]))
    return pairs


@pytest.mark.parametrize(("command", "option"), file_options())
def test_every_option_of_a_file_is_completed(command, option, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert ("file", "zz") in completed(command, option, incomplete="zz")


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash")
def test_bash_completes_files_after_activation(tmp_path):
    (tmp_path / "my_image.png").touch()
    (tmp_path / "ccwsim").write_text(
        f"#!{sys.executable}\nimport sys\nfrom ccwsim.cli.program import program\n"
        "program(prog_name='ccwsim')\n"
    )
    (tmp_path / "ccwsim").chmod(0o755)
    script = f"""
export PATH={tmp_path}:$PATH
eval "$(_CCWSIM_COMPLETE=bash_source ccwsim)"
compopt() {{ echo "compopt $*"; }}
COMP_WORDS=(ccwsim simulate my_); COMP_CWORD=2; COMPREPLY=()
_ccwsim_completion ccwsim; echo "${{COMPREPLY[@]}}"
COMP_WORDS=(ccwsim simulate channe); COMPREPLY=()
_ccwsim_completion ccwsim; echo "${{COMPREPLY[@]}}"
"""
    environment = {"PYTHONPATH": str(ccwsim.__path__[0]) + "/..", "PATH": "/usr/bin:/bin"}
    done = subprocess.run(
        ["bash", "-c", script], cwd=tmp_path, env=environment, capture_output=True, text=True,
        check=True,
    )  # fmt: skip
    assert done.stdout.split()[:3] == ["compopt", "-o", "default"]
    assert "channels" in done.stdout


class Streams:
    """Standard input and output in the memory."""

    def __init__(self, monkeypatch, content: bytes = b"") -> None:
        self.output = BytesIO()
        monkeypatch.setattr(sys, "stdin", TextIOWrapper(BytesIO(content)))
        monkeypatch.setattr(sys, "stdout", TextIOWrapper(self.output, write_through=True))
        _standard_input.cache_clear()


def test_standard_input_and_output_carry_files(tmp_path, monkeypatch, capsys):
    image = StringIO()
    np.savetxt(image, datasets.load("channels").array, fmt="%d", delimiter=",")
    streams = Streams(monkeypatch, image.getvalue().encode())
    assert main(["simulate", "-", *SMALL, "--seed", "3", "--no-up", "-o", "-"]) == 0
    e = read_realizations(BytesIO(streams.output.getvalue()))
    assert e.grid.shape == (40, 60)
    assert e.seed == 3
    values = [f"-k{code}=1e-{code + 4}" for code in e.training_image.codes]
    streams = Streams(monkeypatch, streams.output.getvalue())
    assert main(["flow", "-", *values, "-o", "-"]) == 0
    head, *lines = csv.reader(streams.output.getvalue().decode().splitlines())
    assert head[:2] == ["realization", "effective_k"]
    assert len(lines) == 2
    assert "50 % below" in capsys.readouterr().err


def test_hard_data_are_read_from_standard_input(tmp_path, monkeypatch):
    Streams(monkeypatch, b"x,y,facies\n2.5,3.5,1\n")
    out = tmp_path / "e.npz"
    assert main(["simulate", "channels", *SMALL, "--hard-data", "-", "-q", "-o", str(out)]) == 0
    assert read_realizations(out).hard_data.triples == ((3, 2, 1),)


def test_results_are_printed_as_json(tmp_path, capsys):
    out = tmp_path / "e.npz"
    line = ["simulate", "channels", *SMALL, "--realizations", "2", "--seed", "5", "-o", str(out)]
    assert main([*line, "--json"]) == 0
    results = json.loads(capsys.readouterr().out)
    e = read_realizations(out)
    assert results["seed"] == 5
    assert results["not_honoured"] == [0, 0]
    assert results["proportions"]["sand"] == e.proportions[:, 1].tolist()


def test_conductivities_are_printed_as_json(tmp_path, capsys):
    write_realizations(tmp_path / "e.npz", ensemble(3))
    line = ["flow", str(tmp_path / "e.npz"), "-k", "sand=1e-4", "-k", "mud=1e-8"]
    assert main([*line, "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)
    assert [row["realization"] for row in rows] == [1, 2, 3, "training_image"]
    assert all(1e-8 < row["effective_k"] < 1e-4 for row in rows)


@pytest.mark.parametrize(
    ("data", "options", "names"),
    [
        ("x,y,facies\n999,1,0\n", [], ["--on-outside 'drop'"]),
        ("x,y,facies\n2,1,8\n", [], ["--on-unknown 'drop'"]),
        ("x,y,facies\n2,1,salt\n", [], ["--facies-name ", "--on-unknown 'drop'"]),
        ("x,y,facies\n2.1,1.1,0\n2.2,1.2,1\n", [], ["--on-collision 'drop'"]),
    ],
)
def test_errors_name_the_option(data, options, names, tmp_path, capsys):
    file = tmp_path / "data.csv"
    file.write_text(data)
    line = ["simulate", "channels", *SMALL, "--hard-data", str(file), *options]
    assert main([*line, "-o", str(tmp_path / "e.npz")]) == 2
    message = capsys.readouterr().err
    assert all(name in message for name in names), message


def test_errors_on_images_name_the_option(tmp_path, capsys):
    np.save(tmp_path / "grey.npy", np.random.default_rng(0).random((40, 50)))
    line = ["simulate", str(tmp_path / "grey.npy"), *SMALL, "-o", str(tmp_path / "e.npz")]
    assert main(line) == 2
    assert "--classes" in capsys.readouterr().err


def test_kinds_of_options_are_used():
    kinds = {row.kind for row in inputs._TABLE} | {row.kind for row in inputs._parameter_rows()}
    assert {kind for kind in kinds if "|" not in kind} == OPTION_KINDS.keys()
