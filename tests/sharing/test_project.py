"""Test that a project file gives the same realizations, and that invalid files are refused."""

from __future__ import annotations

import json
import zipfile
from contextlib import suppress
from dataclasses import replace
from io import BytesIO

import numpy as np
import pytest
from hypothesis import given, strategies as st

from ccwsim import (
    CCWSIMError,
    Grid,
    HardData,
    Parameters,
    Project,
    TrainingImage,
    read_project,
    save_project,
)
from ccwsim.cli.program import main
from ccwsim.io.data_file import printable
from ccwsim.io.limits import UPLOAD_LIMITS, limited
from ccwsim.model.study import Study
from ccwsim.sharing.project import VERSION, project_as_bytes

PARAMETERS = Parameters(template_size=8, overlap_size=4, wavelet_level=1)


def a_project(**changes) -> Project:
    array = np.kron(np.random.default_rng(1).integers(0, 3, (10, 12)), np.ones((3, 3), int)) * 7 - 7
    image = TrainingImage(array, name="the wall", facies_names=["<mud>", "sand", "Kies & Löss"])
    data = HardData([[3, 4], [20, 30], [0, 0]], [0, 7, -7])
    study = Study(image, Grid(24, 40, (5.0, 2.5), (-10.0, 1e-7)), PARAMETERS, data, seed=11)
    own = {"ti": ["own"], "colour": ["-7-112233"], "facies": ["2"], "map": ["entropy"]}
    return Project(study, 3, **{"settings": own, "versions": {"Program": "x"}, **changes})


def changed(**members) -> BytesIO:
    """Return a project file with some members replaced, or removed if they are None."""
    content = BytesIO(project_as_bytes(a_project()))
    written = BytesIO()
    with zipfile.ZipFile(content) as old, zipfile.ZipFile(written, "w") as new:
        for name in old.namelist():
            own = members.get(name.split(".")[0], old.read(name))
            if own is not None:
                new.writestr(name, own)
    return BytesIO(written.getvalue())


def stored() -> dict:
    with zipfile.ZipFile(BytesIO(project_as_bytes(a_project()))) as archive:
        return json.loads(archive.read("study.json"))


def study_json(**changes) -> bytes:
    return json.dumps({**stored(), **changes}).encode()


def settings(**changes) -> bytes:
    """Return the JSON of a project in which some settings are changed."""
    given = {name: [value] for name, value in changes.items()}
    return study_json(settings={**stored()["settings"], **given})


def npy(array) -> bytes:
    content = BytesIO()
    np.save(content, array)
    return content.getvalue()


def test_a_project_gives_the_same_realizations_again(tmp_path):
    project, path = a_project(), tmp_path / "wall.ccwsim"
    save_project(path, project)
    again = read_project(path)
    assert again.simulate().digest == project.simulate().digest
    assert again.study.training_image.facies_names == project.study.training_image.facies_names
    assert again.study.hard_data.digest == project.study.hard_data.digest
    assert (again.n_realizations, again.versions) == (project.n_realizations, project.versions)
    assert again.settings.items() >= project.settings.items()
    assert (again.study.grid, again.study.seed) == (project.study.grid, project.study.seed)
    assert project_as_bytes(again) == path.read_bytes()


def test_the_command_line_gives_the_same_from_a_project(tmp_path):
    path, out = tmp_path / "wall.ccwsim", tmp_path / "out.npz"
    save_project(path, a_project())
    assert main(["simulate", "--project", str(path), "-q", "--output", str(out)]) == 0
    with np.load(out) as saved:
        np.testing.assert_array_equal(saved["realizations"], a_project().simulate().realizations)
    changes = ["--seed", "12", "--realizations", "1", "--candidates", "3"]
    assert main(["simulate", "--project", str(path), "-q", *changes, "--output", str(out)]) == 0
    with np.load(out) as saved:
        assert (int(saved["seed"]), len(saved["realizations"])) == (12, 1)
        assert json.loads(str(saved["parameters"]))["n_candidates"] == 3


@pytest.mark.parametrize(
    "line", [["channels", "--project", "a"], ["--project", "a", "--grid", "8x8"], []]
)
def test_a_project_and_its_parts_are_not_given_together(line, capsys):
    assert main(["simulate", "-o", "out.npz", *line]) == 2
    said = capsys.readouterr().err
    assert "leave this input out" in said or "give a training image (TI)" in said


CLASHING = np.array([[1, 1], [1, 1]])
NO_FILE = {"image": {"upload": {"name": "a.npy", "content": 3}}}
BROKEN = {
    "no zip": (lambda: BytesIO(b"hello"), "is not a project"),
    "cut": (lambda: BytesIO(project_as_bytes(a_project())[:200]), "broken"),
    "no settings": (lambda: changed(study=None), "study.json is missing"),
    "no image": (lambda: changed(training_image=None), "training_image.npy is missing"),
    "no json": (lambda: changed(study=b"{"), "not valid JSON"),
    "no object": (lambda: changed(study=b"[1]"), "is not a project"),
    "other": (lambda: changed(study=study_json(format="A")), "is not a project"),
    "newer": (lambda: changed(study=study_json(version=VERSION + 1)), "newer version"),
    "version": (lambda: changed(study=study_json(version="a")), "unknown"),
    "seed": (lambda: changed(study=settings(seed="-1")), "seed = -1 is not"),
    "many": (lambda: changed(study=settings(realizations="1000000000")), "from 1 to 1000000"),
    "grid": (lambda: changed(study=settings(grid="0x3")), "grid = 0x3 is not two"),
    "grid kind": (lambda: changed(study=settings(grid=3)), "grid must be a list of words"),
    "crs": (lambda: changed(study=settings(crs="x" * 9000)), "letters"),
    "no crs": (lambda: changed(study=settings(crs="UTM")), "EPSG:32632"),
    "no grid": (lambda: changed(study=study_json(settings={})), "grid is missing"),
    "cells": (lambda: changed(study=settings(cell="0x1")), "cell = 0x1 is not two"),
    "template": (lambda: changed(study=settings(template="9")), "Template 9"),
    "unknown": (lambda: changed(study=settings(magic="9")), "'magic' is unknown"),
    "settings": (lambda: changed(study=study_json(settings=[3])), "settings is missing or broken"),
    "choices": (
        lambda: changed(study=study_json(choices={"image": 7})),
        "is changed; save or copy it again",
    ),
    "file": (
        lambda: changed(study=study_json(choices=NO_FILE)),
        "is changed; save or copy it again",
    ),
    "guides": (lambda: changed(study=study_json(choices={"guides": {"scale": 0}})), "scale of"),
    "no data": (lambda: changed(hard_facies=None), "hard_facies.npy is missing"),
    "clash": (lambda: changed(hard_cells=npy(CLASHING), hard_facies=npy([0, 7])), "two facies"),
    "pickle": (lambda: changed(training_image=npy(np.array([[{}]], object))), "of type object"),
    "floats": (lambda: changed(training_image=npy(np.full((40, 40), 0.5))), "not a whole number"),
    "short": (lambda: changed(training_image=npy(np.zeros((40, 40), np.uint8))[:-9]), "ends"),
}


def test_a_project_with_an_image_with_gaps_is_read_back():
    array = np.arange(1600).reshape(40, 40) % 2 * 1.0
    array[:9, :9] = np.nan
    study = Study(TrainingImage(array), Grid(30, 30), Parameters(16, 4, 1))
    back = read_project(BytesIO(project_as_bytes(Project(study)))).study
    assert back.training_image == study.training_image


@pytest.mark.parametrize("what", BROKEN)
def test_a_broken_project_is_said_in_words(what):
    make, said = BROKEN[what]
    with pytest.raises(CCWSIMError, match=said):
        read_project(make())


def test_a_project_that_unpacks_to_too_much_is_not_unpacked():
    bomb = BytesIO(project_as_bytes(a_project()))
    assert len(bomb.getvalue()) < 4000
    study = a_project().study
    big = Study(TrainingImage(np.zeros((99, 99))), study.grid, study.parameters)
    small = limited(replace(UPLOAD_LIMITS, bytes=4000, unpacked=4000))
    with small, pytest.raises(CCWSIMError, match="more than"):
        read_project(BytesIO(project_as_bytes(Project(big))))


@given(st.data())
def test_a_project_with_a_changed_byte_is_read_or_refused(data):
    content = bytearray(project_as_bytes(a_project()))
    content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    with suppress(CCWSIMError):
        assert read_project(BytesIO(content)).n_realizations >= 1


@pytest.mark.parametrize("layers", [1, 6])
def test_a_project_keeps_a_volume(layers):
    image = TrainingImage(np.random.default_rng(1).integers(0, 3, (layers, 20, 24)))
    grid = Grid(24, 40, (5.0, 2.5, 0.5), (0.0, 0.0, -7.0), nz=9)
    p = Parameters((layers, 8, 8), (min(layers, 2) - 1, 4, 4), (0, 1, 1))
    for data in (HardData(), HardData([[3, 4, 5], [8, 0, 0]], [1, 2])):
        project = Project(Study(image, grid, p, data))
        again = read_project(BytesIO(project_as_bytes(project))).study
        assert (again.grid, again.parameters) == (grid, p)
        assert again.training_image.digest == image.digest
        assert again.hard_data.triples == data.triples


def test_the_file_of_a_map_says_nothing_of_layers():
    assert stored()["settings"]["grid"] == ["40x24"]
    with pytest.raises(CCWSIMError, match="is a map, but the grid is a volume"):
        read_project(changed(study=settings(grid="40x24x2", cell="5x2.5x1", origin="0x0x0")))


def test_a_project_keeps_what_is_printable_of_names():
    names = ("=1+1\n9 9\n\"'`<b onload=x>,;\t", "-5 /\n/\x1a**b** $x$ \\input{x}", "]]>&lt;%n{x}")
    project = a_project()
    image = TrainingImage(project.study.training_image.array, name="../x\n=1", facies_names=names)
    study = replace(project.study, training_image=image)
    again = read_project(BytesIO(project_as_bytes(replace(project, study=study))))
    assert again.study.training_image.facies_names == tuple(printable(name) for name in names)
    assert again.study.training_image.name == "../x=1"
    assert again.simulate().digest == project.simulate().digest
