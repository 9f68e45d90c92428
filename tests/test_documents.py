"""The scripts in the documents run as they stand, one after another."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).parents[1]


def names_of(document: str) -> dict[str, Any]:
    """Run all scripts of a document in one namespace, and return what they named."""
    names: dict[str, Any] = {}
    for script in re.findall(
        r"```python\n(.*?)```", (ROOT / document).read_text("utf-8"), re.DOTALL
    ):
        exec(script, names)
    return names


def test_the_scripts_of_the_readme_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = names_of("README.md")
    assert names["e"].n_mismatched.tolist() == [0] * 10
    with np.load(tmp_path / "out.npz") as written:
        assert written["realizations"].shape == (10, 512, 512)
    assert names["gamma"].shape == (10, 61)
    assert names["later"].n_mismatched.tolist() == [0] * 10
    assert names["next_ten"].numbers.tolist() == list(range(10, 20))


def test_the_scripts_of_volumes_run():
    names = names_of("docs/volumes.md")
    assert names["e"].n_mismatched.tolist() == [0, 0]
    assert names["data"].n == 7 + 21 + 12
    assert names["few"].n_mismatched.tolist() == [0]


def test_the_scripts_of_the_library_run(capsys):
    names = names_of("docs/library.md")
    assert names["gamma"].shape == (6, 41)
    assert 0 < names["changed"] < 0.05
    assert len(names["many"]) <= 20
    assert {key[0] for key in names["found"].curves} == {names["sand"]}
    assert len(names["swept"].rows) == len(names["tried"].fitting) == 4
    assert "finished" in capsys.readouterr().out
