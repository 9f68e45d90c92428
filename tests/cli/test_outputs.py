"""Test that what a writer needs is known before a run, and that a late failure loses nothing."""

from __future__ import annotations

import errno
import os
from collections import namedtuple
from importlib import import_module
from io import BytesIO
from pkgutil import walk_packages

import numpy as np
import pytest

import ccwsim
from ccwsim import CCWSIMError, Ensemble, Grid, io as cio, read_realizations
from ccwsim.cli.program import main
from ccwsim.cli.simulate import STREAMED
from ccwsim.io.atomic import PRECONDITIONS, can_write, check_output
from ccwsim.ui.simulate.results import MAP_KINDS, download_groups
from tests.flow.test_flow import ensemble

PACKAGES = {"tif": "rasterio", "nc": "xarray", "flopy": "flopy"}
SMALL = ["--template", "16", "--overlap", "4", "--level", "1", "--grid"]


def formats() -> dict[str, tuple[str, ...]]:
    """Return all lists of formats that a module of the package writes, by their names."""
    modules = [import_module(m.name) for m in walk_packages(cio.__path__, "ccwsim.io.")]
    names = {name: value for module in modules for name, value in vars(module).items()}
    return {n: v for n, v in names.items() if n.endswith("_FORMATS") and not n.startswith("_")}


def test_every_format_states_what_it_needs():
    assert {"REALIZATION_FORMATS", "MAP_FORMATS", "IMAGE_FORMATS"} <= formats().keys()
    written = {kind for kinds in formats().values() for kind in kinds} | {STREAMED, "flopy"}
    assert written == PRECONDITIONS.keys()
    assert {*MAP_KINDS} <= PRECONDITIONS.keys()


@pytest.mark.parametrize("shape", [(5, 6), (3, 5, 6)])
@pytest.mark.parametrize("kind", cio.REALIZATION_FORMATS)
def test_a_format_is_refused_before_if_its_writer_refuses_it(kind, shape):
    if kind in PACKAGES:
        pytest.importorskip(PACKAGES[kind])
    e = ensemble(2, shape)
    try:
        assert cio.realizations_as_bytes(e, kind)
        is_written = True
    except CCWSIMError:
        is_written = False
    assert can_write(kind, e.shape) == is_written
    assert is_written or len(shape) == 3


def test_a_format_is_refused_before_if_its_package_is_missing(monkeypatch, tmp_path):
    monkeypatch.setattr("ccwsim.model.extras.find_spec", lambda package: None)
    for kind in PRECONDITIONS:
        assert can_write(kind) == (kind not in PACKAGES)
        if kind in PACKAGES:
            with pytest.raises(CCWSIMError, match=f"the package {PACKAGES[kind]}"):
                check_output(tmp_path / f"q.{kind}", kind)
    assert not [*tmp_path.iterdir()]


def test_a_sheet_that_is_too_large_is_known_before():
    assert can_write("png", (4, 1000, 1000))
    assert not can_write("png", (400, 1000, 1000))
    e = ensemble(2, (2, 70_000))  # more pixels in a row than a picture may have
    groups = download_groups(e, ["#000000", "#ffffff"], 0, 1).values()
    files = [file.key for group in groups for file in group]
    assert "realizations_png" not in files
    assert "realizations_npz" in files


Usage = namedtuple("Usage", "total used free")


@pytest.mark.parametrize("kind", [k for k, needed in PRECONDITIONS.items() if needed[2]])
def test_space_for_the_whole_file_is_checked(kind, tmp_path, monkeypatch):
    monkeypatch.setattr("shutil.disk_usage", lambda path: Usage(10**9, 10**9, 5000))
    monkeypatch.setattr("ccwsim.model.extras.find_spec", lambda package: True)
    check_output(tmp_path / f"q.{kind}", kind, (2, 30, 40))
    with pytest.raises(CCWSIMError, match="do not fit into"):
        check_output(tmp_path / f"q.{kind}", kind, (200, 30, 40))


@pytest.mark.parametrize("kind", [kind for kind in cio.REALIZATION_FORMATS if kind != "png"])
def test_the_stated_size_is_a_lower_bound(kind):
    e = ensemble(3, (40, 50))
    if kind in PACKAGES:
        pytest.importorskip(PACKAGES[kind])
    size = len(cio.realizations_as_bytes(e, kind))
    assert PRECONDITIONS[kind][2] * e.indices.size <= size


@pytest.fixture
def never_simulated(monkeypatch):
    def simulated(*arguments, **options):
        raise AssertionError("an output that cannot be written was simulated")

    monkeypatch.setattr("ccwsim.run.simulation.simulate", simulated)


@pytest.mark.usefixtures("never_simulated")
@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["60x40", "-o", "q.tif"], "the package rasterio"),
        (["60x40", "-o", "q.nc"], "the package xarray"),
        (["60x40x20", "-o", "q.png"], "a PNG can show maps"),
        (["1000x1000", "-o", "q.png", "--realizations", "400"], "a picture of 400 realizations"),
        (["60x40", "-o", "none/q.npz"], "there is no folder"),
        (["60x40", "-o", "folder.npz"], "not a regular file"),
    ],
)
def test_outputs_are_checked_before_the_run(options, message, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder.npz").mkdir()
    monkeypatch.setattr("ccwsim.model.extras.find_spec", lambda package: None)
    image = tmp_path / "ti.npy"
    np.save(image, ccwsim.datasets.load("channels").array)
    if "x20" in options[0]:
        np.save(image, np.tile(ccwsim.datasets.load("channels").array[:64, :64], (30, 1, 1)))
    assert main(["simulate", str(image), *SMALL, *options]) == 2
    assert message in capsys.readouterr().err


@pytest.mark.usefixtures("never_simulated")
def test_a_full_folder_is_known_before_the_run(tmp_path, monkeypatch, capsys):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    assert main(["simulate", "channels", "-o", str(tmp_path / "q.npz")]) == 2
    assert "No space left" in capsys.readouterr().err


def test_models_of_flow_are_checked_before_the_solution(tmp_path, monkeypatch, capsys):
    def solved(*arguments, **options):
        raise AssertionError("solved")

    monkeypatch.setattr("ccwsim.flow.effective_k", solved)
    grid = Grid(5, 6, (1e-3, 1e-3), (9.0, 40.0), crs="EPSG:4326")
    ccwsim.write_realizations(tmp_path / "e.npz", ensemble(1, (5, 6), grid))
    line = ["flow", str(tmp_path / "e.npz"), "-k", "sand=1e-4", "-k", "mud=1e-8"]
    pytest.importorskip("rasterio")
    assert main([*line, "--grdecl", str(tmp_path / "g.grdecl")]) == 2
    assert "degrees" in capsys.readouterr().err
    assert main([*line, "--grdecl", str(tmp_path / "g.txt")]) == 2
    assert "choose one of grdecl" in capsys.readouterr().err
    monkeypatch.setattr("ccwsim.model.extras.find_spec", lambda package: None)
    assert main([*line, "--modflow", str(tmp_path / "m")]) == 2
    assert "the package flopy" in capsys.readouterr().err
    assert not (tmp_path / "m").exists()


def test_a_late_failure_saves_all_realizations(tmp_path, monkeypatch, capsys):
    write = cio.write_realizations

    def fails_late(path, e: Ensemble, **options) -> None:
        if str(path).endswith("q.sgems"):
            raise RuntimeError("the library broke")
        write(path, e)

    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr("ccwsim.io.write_realizations", fails_late)
    monkeypatch.setattr("ccwsim.cli.simulate.gettempdir", lambda: str(tmp_path / "temporary"))
    line = ["simulate", "channels", *SMALL, "60x40", "--seed", "3"]
    assert main([*line, "-o", str(tmp_path / "q.sgems")]) == 2
    message = capsys.readouterr().err
    (rescue,) = tmp_path.rglob("*_rescue.npz")
    assert "the library broke" in message
    assert str(rescue) in message
    p = ccwsim.Parameters(16, 4, 1)
    wanted = ccwsim.simulate(ccwsim.datasets.load("channels"), (40, 60), p, seed=3)
    assert read_realizations(BytesIO(rescue.read_bytes())).digest == wanted.digest
    rescue.unlink()
    assert main([*line, "-o", str(tmp_path / "q.sgems"), "-o", str(tmp_path / "all.npz")]) == 2
    assert not [*tmp_path.rglob("*_rescue.npz")]  # an npz is written
