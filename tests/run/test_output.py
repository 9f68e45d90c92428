"""Test realizations written to disk: same cells, complete or no file, read only when needed."""

from __future__ import annotations

import tracemalloc
from types import SimpleNamespace

import numpy as np
import pytest

from ccwsim import (
    Cancelled,
    CCWSIMError,
    Ensemble,
    HardData,
    Parameters,
    Secondary,
    TrainingImage,
    simulate,
)
from ccwsim.cli.program import main
from tests.small_images import blobs

P = Parameters(16, 4, 1, n_candidates=5)
PLAIN = TrainingImage(blobs((45, 61), 2))
CODED = TrainingImage(300 * blobs((45, 61), 3).astype(int) - 5)


def study(image: TrainingImage, n: int = 6, **options) -> Ensemble:
    data = HardData([[3, 4], [20, 30]], image.codes[[0, 1]])
    return simulate(image, (60, 50), P, data, n, seed=3, **options)


@pytest.mark.parametrize("image", [PLAIN, CODED])
def test_the_file_and_the_ensemble_are_those_of_memory(tmp_path, image):
    out = tmp_path / "out.npy"
    found, wanted = study(image, out=out), study(image)
    np.testing.assert_array_equal(np.load(out), wanted.realizations)
    assert np.load(out).dtype == wanted.realizations.dtype
    assert isinstance(found.realizations, np.memmap)
    np.testing.assert_array_equal(found.indices, wanted.indices)
    np.testing.assert_array_equal(found.indices[2], wanted.indices[2])
    np.testing.assert_array_equal(found.indices[1:4, 3], wanted.indices[1:4, 3])
    assert found.digest == wanted.digest
    assert (found.indices.shape, found.n) == (wanted.indices.shape, wanted.n)
    code = int(image.codes[1])
    np.testing.assert_array_equal(found.probability(code), wanted.probability(code))
    np.testing.assert_array_equal(found.proportions, wanted.proportions)
    assert found.n_mismatched.tolist() == [0] * 6
    assert [path.name for path in tmp_path.iterdir()] == ["out.npy"]


@pytest.mark.parametrize("image", [PLAIN, CODED])
def test_inactive_cells_are_nan_in_the_file(tmp_path, image):
    active = np.ones((60, 50), bool)
    active[10:30, 5:40] = False
    secondary = Secondary(active=active)
    found, wanted = (study(image, out=o, secondary=secondary) for o in (tmp_path / "a.npy", None))
    np.testing.assert_array_equal(np.load(tmp_path / "a.npy"), wanted.realizations)
    assert np.isnan(found.realizations[:, ~active]).all()
    np.testing.assert_array_equal(found.indices, wanted.indices)
    np.testing.assert_array_equal(found.proportions, wanted.proportions)
    assert found.digest == wanted.digest
    assert found.n_mismatched.tolist() == [0] * 6


@pytest.mark.slow
def test_memory_does_not_grow_with_the_number_of_realizations(tmp_path):
    n, shape = 300, (200, 250)
    study(CODED)  # compiled
    tracemalloc.start()
    found = simulate(CODED, shape, P, n_realizations=n, out=tmp_path / "out.npy", n_workers=1)
    assert 0 <= found.probability(int(CODED.codes[0])).min() <= 1
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < n * shape[0] * shape[1] / 2


class TestCancel:
    @pytest.mark.slow
    def test_what_is_finished_is_a_whole_file(self, tmp_path):
        out, done = tmp_path / "out.npy", [0]
        with pytest.raises(Cancelled) as stopped:
            study(
                CODED,
                5000,
                out=out,
                progress=lambda _, n: done.append(n),
                cancel=lambda: done[-1] >= 3,
            )
        ensemble = stopped.value.ensemble
        assert ensemble is not None
        saved = np.load(out)
        assert 3 <= len(saved) == ensemble.n < 5000
        wanted = study(CODED, int(ensemble.numbers.max()) + 1).realizations
        np.testing.assert_array_equal(saved, wanted[ensemble.numbers])
        assert len(list(tmp_path.iterdir())) == 1

    def test_a_file_is_kept_where_nothing_was_finished(self, tmp_path):
        out = tmp_path / "out.npy"
        out.write_bytes(b"something good")
        with pytest.raises(Cancelled):
            simulate(PLAIN, (3000, 3000), P, out=out, cancel=lambda: True)
        assert out.read_bytes() == b"something good"
        assert len(list(tmp_path.iterdir())) == 1


class TestErrors:
    def test_a_file_is_kept_where_the_run_fails(self, tmp_path):
        out = tmp_path / "out.npy"
        out.write_bytes(b"something good")

        def broken(fraction: float, n_done: int) -> None:
            raise RuntimeError("the page was closed")

        with pytest.raises(RuntimeError):
            study(PLAIN, out=out, progress=broken)
        assert out.read_bytes() == b"something good"
        assert len(list(tmp_path.iterdir())) == 1

    def test_a_folder_that_is_not_there_is_named(self, tmp_path):
        with pytest.raises(CCWSIMError, match="nowhere"):
            study(PLAIN, out=tmp_path / "nowhere" / "out.npy")

    @pytest.mark.parametrize("name", ["out.npz", "out", ""])
    def test_only_npy_is_written_so(self, tmp_path, name):
        with pytest.raises(CCWSIMError, match="npy"):
            study(PLAIN, out=tmp_path / name)

    def test_sources_stay_in_memory(self, tmp_path):
        with pytest.raises(CCWSIMError, match="keep_sources"):
            study(PLAIN, out=tmp_path / "out.npy", keep_sources=True)

    @pytest.mark.parametrize(
        ("shape", "said"),
        [((10**8, 10**8), "do not fit"), ((10**30, 10), "must be a whole")],
    )
    def test_more_than_the_disk_holds_is_refused(self, tmp_path, shape, said):
        with pytest.raises(CCWSIMError, match=said):
            simulate(PLAIN, shape, P, out=tmp_path / "out.npy")
        assert not list(tmp_path.iterdir())


def test_the_command_line_streams_npy(tmp_path):
    line = ["simulate", "channels", "--grid", "60x40", "--template", "16", "--overlap", "4"]
    line += ["--level", "1", "--realizations", "3", "--quiet"]
    assert main([*line, "-o", str(tmp_path / "a.npy"), "-o", str(tmp_path / "a.npz")]) == 0
    with np.load(tmp_path / "a.npz") as saved:
        np.testing.assert_array_equal(np.load(tmp_path / "a.npy"), saved["realizations"])
    twice = ["-o", str(tmp_path / "b.npy"), "-o", str(tmp_path / "c.npy")]
    assert main([*line, *twice]) == 2


def test_arguments_that_cannot_be_used_are_said():
    bad = {"progress": 5, "cancel": "now", "out": 5, "seed": 2**64, "n_realizations": 2**70}
    for name, value in bad.items():
        with pytest.raises(CCWSIMError, match=f"{name} = ") as caught:
            simulate(PLAIN, (16, 16), P, **{name: value})
        if name in ("seed", "n_realizations"):
            assert f"to {2**63 - 1}" in str(caught.value)


def test_a_full_disk_is_said_in_a_unit_that_suits(monkeypatch, tmp_path):
    free = SimpleNamespace(free=12_000_000)
    monkeypatch.setattr("shutil.disk_usage", lambda folder: free)
    with pytest.raises(CCWSIMError, match=r": 40 MB do not fit .* has 12 MB free"):
        simulate(PLAIN, (2000, 2000), P, n_realizations=10, out=tmp_path / "out.npy")
