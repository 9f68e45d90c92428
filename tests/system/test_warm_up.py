"""Test that a first run compiles no kernel after a warm-up."""

from __future__ import annotations

import pytest
from numba.core import event

from ccwsim import HardData, Parameters, TrainingImage, datasets, simulate
from ccwsim.cli.program import main
from ccwsim.engine.kernel_cache import KERNEL_FOLDER
from ccwsim.metrics import connectivity, etype, variogram

SETTINGS = [
    *(Parameters(wavelet_level=level) for level in range(4)),
    Parameters(64, 16, 4),
    Parameters(method="ccsim"),
    Parameters(method="ms-ccsim"),
    Parameters(similarity="correlation"),
    Parameters(match_proportions=True),
    Parameters(exact_data=False),
    Parameters(refine=False, location_weight=0.5),
    Parameters(template_variation=0.2),
]


@pytest.fixture(scope="module")
def warm():
    assert main(["warm-up", "--quiet"]) == 0


def test_it_says_what_is_missing_and_how_long_it_took(warm, capsys):
    assert main(["warm-up"]) == 0
    *parts, last = capsys.readouterr().err.splitlines()
    assert [line.split()[0] for line in parts] == ["0"] * 6
    assert last.startswith("0 compiled in ")
    assert last.endswith(KERNEL_FOLDER)


@pytest.mark.parametrize("n_facies", [2, 3])
@pytest.mark.parametrize("parameters", SETTINGS, ids=map(str, range(len(SETTINGS))))
def test_nothing_is_left_to_compile(warm, parameters, n_facies):
    image = datasets.load("channels").array.astype(int)
    image[:40] += n_facies - 2
    ti = TrainingImage(image)
    data = HardData([[3, 4], [50, 60]], ti.codes[[0, -1]])
    with event.install_recorder("numba:compile") as compiled:
        for given in (None, data):
            ensemble = simulate(ti, (90, 80), parameters, given)
        etype(ensemble)
        for images in (ensemble, ti):
            variogram(images, ti.codes[1], "E-W", 20)
            connectivity(images, ti.codes[1], "N-S", 20)
    names = [e.data["dispatcher"].py_func.__name__ for _, e in compiled.buffer]
    assert not names
