"""Test that inactive cells change no statistic of the active cells."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, is_dataclass, replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from ccwsim import Ensemble, Grid, HardData, Parameters, Secondary, datasets, metrics, simulate
from ccwsim.metrics.reference_band import pieces_of
from ccwsim.metrics.stack import UNKNOWN
from ccwsim.model.active_cells import (
    active_windows,
    count_in_windows,
    smallest_box,
    widest_window,
    window_shape,
)
from ccwsim.model.study import Study
from tests.pairs.consumers import METRICS, Case

GRID = 150, 170
WINDOW = slice(20, 130), slice(30, 150)
OF_INPUTS = {
    "fit_data", "leave_out", "warn_of_level", "warn_of_probabilities", "crop_shape", "coarsened",
    "vertical_proportions", "pattern_histogram", "js_divergence", "divergences",
}  # fmt: skip
"""Functions whose arguments are not realizations as a whole, or that simulate again."""


def masked(active: np.ndarray, **options: Any) -> Ensemble:
    """Return realizations of channels in the active cells, with data."""
    image, rng = datasets.load("channels"), np.random.default_rng(0)
    cells = np.unique(rng.integers(0, active.shape, (60, 2)), axis=0)
    data = HardData(cells, image.array[tuple(cells.T)])
    secondary = Secondary(active=active, **options)
    return simulate(
        *(image, active.shape, Parameters(24, 8, 1), data),
        n_realizations=4, seed=3, secondary=secondary, keep_sources=True,
    )  # fmt: skip


def cut_out(ensemble: Ensemble, window: tuple[slice, ...]) -> Ensemble:
    """Return an ensemble of only the cells in a window, with the data in the window."""
    study, corner = ensemble.study, [part.start for part in window]
    grid = Grid.of(tuple(part.stop - part.start for part in window))
    data = HardData(study.hard_data.cells - corner, study.hard_data.facies)
    secondary = study.secondary and replace(study.secondary.cropped(window), active=None)
    inputs = study.training_image, grid, study.parameters, data
    assert ensemble.sources is not None
    return replace(
        ensemble,
        study=Study(*inputs, seed=study.seed, secondary=secondary),
        indices=np.asarray(ensemble.indices)[(slice(None), *window)],
        sources=ensemble.sources[(slice(None), *window)],
    )


@cache
def in_a_rectangle(angle: float | None = None) -> Ensemble:
    active, east = np.zeros(GRID, bool), np.tile(np.linspace(0.1, 0.5, GRID[1]), (GRID[0], 1))
    active[WINDOW] = True
    return masked(active, angle=angle, probabilities={1: east})


def numbers_of(result: Any, path: str = "") -> Iterator[tuple[str, np.ndarray]]:
    """Yield all numbers in a result, with the path to them."""
    if is_dataclass(result):
        for field in fields(result):
            yield from numbers_of(getattr(result, field.name), f"{path}.{field.name}")
    elif isinstance(result, (tuple, list)):
        for k, each in enumerate(result):
            yield from numbers_of(each, f"{path}[{k}]")
    elif isinstance(result, (bool, int, float, np.ndarray, np.generic)):
        yield path, np.asarray(result, float)


@pytest.mark.parametrize("name", [name for name in METRICS if name not in OF_INPUTS])
def test_measures_in_a_rectangle_are_those_of_the_cells_cut_out(name, tmp_path):
    """A measure that comes without the rule for inactive cells fails here."""
    whole = in_a_rectangle(20.0 if name == "direction_error" else None)
    result, of_part = (
        METRICS[name](Case(ensemble.study, ensemble, tmp_path))
        for ensemble in (whole, cut_out(whole, WINDOW))
    )
    expected = dict(numbers_of(of_part))
    for path, values in numbers_of(result):
        if values.shape[-2:] == GRID:
            values = values[(..., *WINDOW)]
        if "square_at" in path:
            values = values - WINDOW[int(path[-2])].start
        np.testing.assert_allclose(values, expected.pop(path), err_msg=path, atol=1e-12)
    assert not expected


def with_mask(ensemble: Ensemble, active: np.ndarray) -> Ensemble:
    """Return the same realizations, in which all but the active cells are inactive."""
    indices = np.where(active, ensemble.indices, np.uint8(UNKNOWN))
    study = replace(ensemble.study, secondary=Secondary(active=active))
    return replace(ensemble, study=study, indices=indices)


def _masks() -> dict[str, np.ndarray]:
    rows, columns = np.indices(GRID)
    distance = np.hypot(rows - 75, columns - 85)
    return {
        "all cells": np.ones(GRID, bool),
        "without a corner": rows + columns > 30,
        "disc": distance < 74,
        "ring": (distance < 74) & (distance > 20),
        "two halves": np.abs(columns - 85) > 2,
        "band": np.abs(rows - columns) < 60,
        "scattered holes": np.random.default_rng(0).random(GRID) > 0.0005,
    }


MASKS = _masks()
FAST = "ring", "two halves", "scattered holes"
"""Masks of the fast tests of verdicts: a hole, two parts, and holes everywhere."""


@cache
def everywhere() -> Ensemble:
    return simulate(datasets.load("channels"), GRID, n_realizations=8, seed=1)


def test_all_verdicts_are_good_without_inactive_cells():
    assert [check for check in metrics.check_ensemble(everywhere()) if not check.fit.fits] == []


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=[] if name in FAST else [pytest.mark.slow]) for name in MASKS],
)
def test_inactive_cells_turn_no_verdict(name):
    ensemble = with_mask(everywhere(), MASKS[name])
    checks = metrics.check_ensemble(ensemble)
    assert len(checks) == 13
    assert [check for check in checks if not check.fit.fits] == []
    for facies in (0, 1):
        flow_fit = metrics.fit_flow(ensemble, facies)
        assert flow_fit.fit.fits
        assert flow_fit.each.mean(axis=0)[0] > 0.1 * flow_fit.reference[0]  # E–W


@pytest.mark.parametrize("name", MASKS)
def test_pieces_have_no_inactive_cells_and_do_not_overlap(name):
    ensemble = with_mask(everywhere(), MASKS[name])
    for shape in ((20, 20), (9, 31)):
        used = np.zeros(GRID, int)
        for window in active_windows(ensemble.study.active_mask, shape):
            assert MASKS[name][window].shape == shape
            assert MASKS[name][window].all()
            used[window] += 1
        assert used.max() == 1
        assert (pieces_of(ensemble, shape).indices < 2).all()


def test_a_thin_catchment_is_not_judged():
    rows, columns = np.indices(GRID)
    thin = with_mask(everywhere(), np.abs(rows - columns) < 3)
    assert metrics.check_ensemble(thin) == []
    assert metrics.fit_flow(thin, 1).fit is None
    assert np.isnan(metrics.pattern_distance(thin, thin.training_image, size=6, factors=[1])).all()


@pytest.mark.parametrize("shape", [(7, 9), (3, 6, 5)])
def test_windows_are_those_of_a_search(shape):
    rng = np.random.default_rng(0)
    for share in (0.02, 0.1, 0.5):
        inactive = rng.random(shape) < share
        assert np.array_equal(
            count_in_windows(inactive, (2,) * len(shape)),
            np.lib.stride_tricks.sliding_window_view(inactive, (2,) * len(shape))
            .reshape(*(n - 1 for n in shape), -1).sum(axis=-1),
        )  # fmt: skip
        window = widest_window(~inactive)
        assert not inactive[window].any()
        side, box = max(part.stop - part.start for part in window), smallest_box(~inactive)
        larger = [min(part.stop - part.start, side + 1) for part in box]
        assert larger == list(window_shape(window)) or count_in_windows(inactive[box], larger).all()
        cells = np.argwhere(~inactive)
        low, high = cells.min(axis=0), cells.max(axis=0)
        assert [(k.start, k.stop - 1) for k in box] == [*zip(low, high, strict=True)]
