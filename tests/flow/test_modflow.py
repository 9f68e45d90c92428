"""Test that flow agrees with MODFLOW 6: with stored numbers, and with a run where it is installed.

`python -m tests.flow.test_modflow` runs the small cases with `mf6` and stores their numbers again.
"""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest

from ccwsim import Ensemble, Grid, Secondary, io
from ccwsim.flow import Flow, darcy
from ccwsim.model.missing import UNKNOWN
from tests.flow.test_flow import ensemble

STORED = Path(__file__).with_name("modflow.json")
VALUES = {"mud": 1e-7, "sand": 1e-4}  # m/s
DAY = 86400.0  # seconds
SIDES = {"west_east": ("west", "east"), "south_north": ("south", "north")}
SMALL = {"map": (5, 6), "volume": (3, 4, 5)}
LARGE = {"map": (60, 80), "volume": (10, 24, 30)}
KINDS = ("plain", "well", "mask", "all heads")
CASES = [(dimension, kind) for dimension in SMALL for kind in KINDS]


def case(dimension: str, kind: str, shapes: dict) -> tuple[Ensemble, dict[str, Any]]:
    """Return an ensemble and the arguments of `darcy` besides the conductivity."""
    shape = shapes[dimension]
    sizes, corner = (10.0, 20.0, 0.5)[: len(shape)], (1000.0, 2000.0, -30.0)[: len(shape)]
    grid = Grid(*shape[-2:], sizes, corner, nz=shape[0] if len(shape) == 3 else None)
    e, options = ensemble(2, shape, grid), {"west_east": (2.0, 1.0)}
    middle = tuple(n // 2 for n in shape)
    if kind in ("well", "mask"):
        options["wells"] = {middle: -2e-5}
    if dimension == "volume":
        options["anisotropy"] = 0.1
    if kind == "mask":
        active = np.ones(shape, bool)
        active[..., shape[-2] // 2 + 1 :, shape[-1] // 2 :] = False
        indices = np.where(active, e.indices, UNKNOWN).astype(np.uint8)
        study = replace(e.study, secondary=Secondary(active=active))
        e = replace(e, indices=indices, study=study)
    if kind == "all heads":
        across = np.linspace(1.5, 0.5, e.indices.shape[-1])
        across = across if dimension == "map" else np.tile(across, (shape[0], 1))
        options["south_north"] = (across, 0.25)
    return e, options


def solved(e: Ensemble, options: dict[str, Any]) -> Flow:
    return darcy(e.property(VALUES)[1], e.grid, **options)


def modflow(e: Ensemble, options: dict[str, Any]) -> tuple[np.ndarray, dict[str, float]]:
    """Return heads and the flow through each side, in m³/s, from a run of MODFLOW 6."""
    with TemporaryDirectory() as folder:
        simulation = io.to_flopy(e, VALUES, folder, realization=1, **options)
        model = simulation.get_model()
        model.ic.strt = 1.0  # MODFLOW finds the heads itself
        simulation.write_simulation(silent=True)
        done, said = simulation.run_simulation(silent=True)
        assert done, said
        heads = model.output.head().get_data()[::-1, ::-1].reshape(e.grid.shape)
        (budget,) = model.output.budget().get_data(text="GHB")
    heads = np.where(np.abs(heads) < 1e20, heads, np.nan)
    rates = iter(budget["q"])  # in the order in which `to_flopy` writes the sides
    through = {}
    for axis, name in ((-1, "west_east"), (-2, "south_north")):
        for end, side in zip((0, -1), SIDES[name], strict=True):
            if name in options:
                n = np.count_nonzero(~np.isnan(heads.take(end, axis)))
                through[side] = float(sum(next(rates) for _ in range(n))) / DAY
    assert next(rates, None) is None
    return heads, through


def assert_same(flow: Flow, heads: np.ndarray, through: dict[str, float]) -> None:
    """Check heads to 1e-6 of the head difference, and flows to 1e-6 of the largest flow."""
    span = np.nanmax(heads) - np.nanmin(heads)
    np.testing.assert_array_equal(np.isnan(flow.heads), np.isnan(heads))
    np.testing.assert_allclose(flow.heads, heads, rtol=0, atol=1e-6 * span)
    largest = max(map(abs, through.values()))
    for side, rate in through.items():
        assert flow.through[side] == pytest.approx(rate, rel=1e-6, abs=1e-7 * largest)


@pytest.mark.parametrize(("dimension", "kind"), CASES)
def test_heads_and_flows_are_those_that_modflow_found(dimension, kind):
    found = json.loads(STORED.read_text())[f"{dimension}, {kind}"]
    flow = solved(*case(dimension, kind, SMALL))
    assert_same(flow, np.array(found["heads"], float), found["through"])


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("mf6") is None, reason="mf6 is not installed")
@pytest.mark.parametrize("shapes", [SMALL, LARGE], ids=["small", "large"])
@pytest.mark.parametrize(("dimension", "kind"), CASES)
def test_a_run_of_modflow_finds_the_same_heads_and_flows(dimension, kind, shapes):
    pytest.importorskip("flopy")
    e, options = case(dimension, kind, shapes)
    assert_same(solved(e, options), *modflow(e, options))


def store() -> None:
    """Store the results of MODFLOW 6 for the small cases."""
    found = {}
    for dimension, kind in CASES:
        heads, through = modflow(*case(dimension, kind, SMALL))
        listed = np.where(np.isnan(heads), None, heads).tolist()
        found[f"{dimension}, {kind}"] = {"heads": listed, "through": through}
    STORED.write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    store()
