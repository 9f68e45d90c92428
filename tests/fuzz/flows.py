"""Random valid and absurd arguments for all functions of flow, and for files of flow models."""

from __future__ import annotations

import contextlib
import random
from collections.abc import Callable, Hashable, Iterator, Sequence
from functools import partial
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from ccwsim import Ensemble, Grid, Secondary, TrainingImage, flow, io
from ccwsim.model.study import Study

FUNCTIONS: tuple[Callable[..., Any], ...] = (
    flow.capture_probability, flow.darcy, flow.effective_k, flow.flow_efficiency, flow.over,
    flow.at_percentiles, flow.starts_at_inflow, flow.tracks, flow.travel_times,
    flow.Capture.brier, io.millidarcy, io.write_grdecl, io.to_flopy, io.grdecl_as_zip,
    io.flopy_as_zip,
)  # fmt: skip
"""All functions of flow that have arguments, and those that write models of flow."""
SHAPES = ((7, 9), (1, 12), (12, 1), (1, 1), (2, 5, 6), (1, 4, 5), (5, 1, 1))
CODES = np.random.default_rng(0).integers(0, 2, 24)  # of the training image


def random_ensemble(source: random.Random, shape: tuple[int, ...]) -> Ensemble:
    """Return realizations of two facies, some with inactive cells, without simulation."""
    rng = np.random.default_rng(source.randrange(2**32))
    size = tuple(source.choice((1.0, 0.5, 20.0)) for _ in shape)
    grid = Grid(*shape[-2:], size, nz=shape[0] if len(shape) == 3 else None)
    indices = (rng.random((3, *shape)) < 0.4).astype(np.uint8)
    active = rng.random(shape) < source.choice((1.0, 0.9, 0.6))
    active.flat[0] = True  # a grid has at least one active cell
    indices[:, ~active] = 255
    image = TrainingImage(CODES.reshape((2, 3, 4)[-len(shape) :] if len(shape) == 3 else (4, 6)))
    secondary = None if active.all() else Secondary(active=active).fitted(grid, image)
    return Ensemble(
        Study(image, grid, secondary=secondary, checked=False),
        indices=indices, cpu_seconds=np.zeros(3), wall_seconds=0.0,
        data_status=np.zeros((3, 0), np.int16), numbers=np.arange(3),
    )  # fmt: skip


def flow_arguments(source: random.Random, spoil: Callable[[Any], Any]) -> list[dict[str, Any]]:
    """Return arguments of each of `FUNCTIONS`; `spoil` returns a value or an absurd one."""
    shape = source.choice(SHAPES)
    rng, ensemble = np.random.default_rng(source.randrange(2**32)), random_ensemble(source, shape)
    cell = tuple(int(rng.integers(n)) for n in shape)

    def pair(numbers: tuple[Any, Any] = (1.0, 0.0)) -> Any:
        return source.choice((None, tuple(map(spoil, source.choice((numbers, (2.0, None)))))))

    def table(good: dict[Any, float]) -> dict[Any, Any]:
        keys = [key if isinstance(key, Hashable) else 0 for key in map(spoil, good)]
        return dict(zip(keys, map(spoil, good.values()), strict=True))

    k = 10.0 ** rng.uniform(-6, 0, shape)
    edge = source.choice((None, None, flow.Edge(), flow.Edge(2.0), flow.Edge((1, 0), "y")))
    thickness = source.choice((1.0, 1.0, 5.0))
    sides = {
        "west_east": pair((rng.random(shape[:-1]), 0.0)), "south_north": pair((np.nan, 1)),
        "wells": table({cell: source.choice((-1e-3, 1.0))}),
    }  # fmt: skip
    with contextlib.suppress(ValueError):  # no path connects the sides
        solved = flow.darcy(k, west_east=(1.0, 0.0), wells={cell: -1e-3})
    values = {"ensemble": ensemble, "values": table({0: 1e-6, 1: 1e-3})}
    run = {"n_workers": 2, "progress": None, "cancel": None, "executor": None}
    along = {"axis": source.choice("xxyz"), "anisotropy": 0.1}
    model = {**values, "unit": source.choice(("m/s", "m/d")), "anisotropy": 0.1,
             "thickness": thickness}  # fmt: skip
    flopy = {**model, **sides, "edge": edge, "realization": 1}
    heads = source.choice((pair(), edge))
    captured = flow.Capture(rng.random((6, 2)), (2, 3), rng.random((3, 6)) < 0.5)
    porosity = source.choice((0.2, table({0: 0.1, 1: 0.3})))
    return [
        {**values, **run, "well": cell, "rate": 1e-3, "west_east": sides["west_east"],
         "south_north": sides["south_north"], "edge": edge, "thickness": thickness,
         "porosity": porosity, "within": 1e9, "step": 2},
        {**sides, "conductivity": k, "grid": ensemble.grid, "bottom_top": pair(),
         "edge": edge, "thickness": thickness, "anisotropy": 0.1,
         "active": rng.random(shape) < 0.9, "tolerance": 1e-6},
        {**values, **run, **along, "heads": heads},
        {"inside": k > 1e-3, "axis": len(shape) - 1, "contrast": 100.0},
        {"ensemble": ensemble, "function": lambda cells: cells.indices.sum(), **run},
        {"each": rng.random(5), "percentiles": (10, 90)},
        {"flow": solved, "n": 5, "axis": along["axis"]},
        {"flow": solved, "starts": ensemble.grid.centers_of(np.array([cell])), "porosity": 0.2,
         "backward": True, "keep_paths": False},
        {**values, **run, "porosity": porosity, "axis": along["axis"], "heads": heads,
         "n_particles": 3},
        {"self": captured, "truth": captured.captured[0]},
        {"conductivity": k, "unit": "mD"},
        {"path": "grid.grdecl", **model},
        {"workspace": "model", **flopy},
        {"name": "grid", **model},
        flopy,
    ]  # fmt: skip


def flow_call(source: random.Random, maybe: Callable[..., Any]) -> Callable[[], object]:
    """Return the call of a function of flow, in a separate folder.

    `maybe(source, value, share)` returns the value, or sometimes an absurd one.
    """

    def spoil(good: Any, share: float = 0.03) -> Any:
        return maybe(source, good, share)

    number = source.randrange(len(FUNCTIONS))
    given = flow_arguments(source, spoil)[number]
    for name, good in given.items():
        bad = spoil(good, 0.08)
        given[name] = good if callable(bad) or name == "self" else bad

    return lambda: _called(FUNCTIONS[number], given)


def spoilt_calls(values: Sequence[Any]) -> Iterator[tuple[str, Callable[[], object]]]:
    """Yield calls with one absurd argument each, and their names: each value of each argument."""
    for k, value in enumerate(values):
        for function, valid in zip(FUNCTIONS, _valid_arguments(k), strict=True):
            for name in valid:
                if name != "self" and not callable(value):
                    call = partial(_called, function, {**valid, name: value})
                    yield f"{function.__name__}, {name}, value {k}", call


def _valid_arguments(seed: int) -> list[dict[str, Any]]:
    return flow_arguments(random.Random(f"valid {seed}"), lambda value: value)


def _called(function: Callable[..., Any], given: dict[str, Any]) -> object:
    """Call a function in a folder of its own."""
    with TemporaryDirectory() as folder, contextlib.chdir(folder):
        return function(**given)
