"""Test that integers of NumPy are accepted like those of Python, with the same results."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import astuple, is_dataclass
from io import BytesIO
from typing import Any

import numpy as np
import pytest

from ccwsim import (
    Grid,
    HardData,
    Parameters,
    Project,
    TrainingImage,
    figures,
    io,
    metrics as m,
    revise,
    simulate,
)
from ccwsim.engine.trace import Trace
from ccwsim.experiments.comparison import compare
from ccwsim.experiments.plan import plan_sweep
from ccwsim.experiments.sweep import sweep
from ccwsim.experiments.timing import data_trials, time_trial, time_trials
from ccwsim.experiments.trials import Trial
from ccwsim.model.study import Study
from ccwsim.sharing.project import project_as_bytes, read_project

P = Parameters(template_size=16, overlap_size=4, wavelet_level=1)
IMAGE = TrainingImage(np.tile([[0], [0], [1], [1]], (16, 64)))
TEXT = b"6 4 1\n1\nfacies\n" + b"\n".join(b"%d" % (k % 3) for k in range(24))
SHARES = np.linspace(0, 1, 12).reshape(3, 4)
Whole = Callable[[int], Any]


@pytest.fixture(scope="module")
def ensemble():
    return simulate(IMAGE, (40, 50), P, n_realizations=2)


def grid_of(i: Whole) -> Any:
    grid = Grid(i(40), i(200))
    return grid.shape, Grid.of((i(40), i(200))) == grid, repr(grid)


def parameters(i: Whole) -> Any:
    p = Parameters(i(200), i(40), i(3), n_candidates=i(255))
    return io.parameters_to_json(p), p.digest


def data(i: Whole) -> Any:
    return HardData([[i(3), i(4)]], [i(1)]).triples


def realizations(i: Whole) -> Any:
    counts = {"n_realizations": i(2), "seed": i(3), "n_workers": i(1), "first_realization": i(4)}
    e = simulate(IMAGE, (i(40), i(50)), P, ([[i(3), i(4)]], [i(1)]), **counts)
    later = revise(e, ([[3, 4], [9, 9]], [1, 0]), i(1))
    return e.digest, e.seed, e.numbers, e[i(1)], e.probability(i(1)), later.digest


def project(i: Whole) -> Any:
    made = Project(Study(IMAGE, Grid(i(40), i(50)), P, seed=i(7)), n_realizations=i(2))
    again = read_project(BytesIO(project_as_bytes(made)))
    return again.simulate().digest, made.simulate(i(1), i(9), first_realization=i(1)).digest


def trace(i: Whole) -> Any:
    return Trace(Study(IMAGE, Grid(40, 50), P), i(1)).at(i(2)).after


def files(i: Whole) -> Any:
    read = io.read_training_image(BytesIO(TEXT), slice_index=i(0), classes=i(2)).array
    return read, io.class_edges(SHARES, i(3)), io.read_grid(BytesIO(TEXT), slice_index=i(0))


def curves(i: Whole) -> Any:
    step = i(1), i(2)
    return (
        m.variogram(IMAGE, i(1), step, i(9)),
        m.connectivity(IMAGE, i(1), "N-S", i(9), i(4)),
        m.variogram_map(IMAGE, i(1), i(9)).gamma,
        m.variogram_of_values(TrainingImage.from_array(SHARES, continuous=True), step, i(1)),
        m.transiograms(IMAGE, [i(0), i(1)], "E-W", [i(1), i(5)]),
        m.geobody_statistics(IMAGE, i(1), i(8)),
        m.granulometry(IMAGE, i(1), i(5)),
    )


def patterns(i: Whole) -> Any:
    found = m.anodi(IMAGE, IMAGE, [i(0), i(1)], i(3), [i(1), i(2)])
    return (
        found.divergence,
        m.classical_scaling(np.zeros((3, 3)), i(2)),
        m.coarsened(IMAGE, i(3)),
        m.pattern_histogram(IMAGE, size=i(3)).frequencies,
        m.pattern_distance(IMAGE, IMAGE, None, i(3), (i(1), i(2))),
        m.templates_that_fit((i(200), i(200)), i(16)),
        m.crop_shape((i(200), i(200)), (i(100), i(250))),
        m.copying(np.arange(6).reshape(2, 3), (i(2), i(200))).uses,
    )


def scores(i: Whole) -> Any:
    p, truth = [SHARES, 1 - SHARES], np.array([[0, 1, 1, 0]] * 3)
    return (
        m.score_reference(p, truth, i(4)),
        m.calibration(p, truth, i(1), i(5)),
    )


def experiments(i: Whole) -> Any:
    ranges = {"template_size": [i(16), i(12)], "wavelet_level": [i(1)]}
    tried = plan_sweep(P, ranges).fitting
    swept = sweep(IMAGE, (40, 50), tried, None, i(1), i(3), n_kept=i(1), facies=i(1))
    both = {"a": P, "b": tried[1]}
    found = compare(IMAGE, (i(40), i(50)), both, None, i(2), i(3), facies=i(0))
    timed = time_trial(Trial.of(IMAGE, (i(40), i(50)), P, seed=i(3)), i(1))
    trials = data_trials(IMAGE, (i(20), i(40)), [i(0), i(5)], [P], i(3))
    sizes = [t.trial.grid.shape for t in time_trials(trials, i(1))]
    return (
        [row.realizations for row in swept.rows],
        [row.quality.facies for row in swept.rows],
        list(found.curves),
        [e.digest for e in found.ensembles],
        timed.trial.grid.shape,
        sizes,
    )


def pictures(i: Whole) -> Any:
    indices = np.array([[0, 1, 1], [1, 0, 0]], np.uint8)
    bundle = figures.Bundle(*([np.arange(3.0)] * 2), np.ones((2, 3)), *([np.arange(3.0)] * 3))
    return (
        figures.ramp(["#000000", "#FFFFFF"], i(200)),
        figures.map_png(indices, figures.FACIES, scale=i(100)),
        figures.tile_size((i(100), i(200)), i(96)),
        figures.data_map_png(*figures.steps_of(SHARES), longest=i(100)),
        figures.contact_sheet(indices[None], figures.FACIES, longest=i(100))[0],
        figures.data_png(np.array([[0, 1]]), indices[0, :1], (9, 9), figures.FACIES, longest=i(90)),
        figures.figure_json(
            figures.curves_chart(bundle, figures.LIGHT, y_title="γ", height=i(200))
        ),
    )


CASES = (
    *(grid_of, parameters, data, realizations, project, trace, files),
    *(curves, patterns, scores, experiments, pictures),
)


def plain(value: Any) -> Any:
    """Return results in a form that can be compared: arrays as lists, dataclasses as tuples."""
    if is_dataclass(value) and not isinstance(value, type):
        return plain(astuple(value))
    if isinstance(value, (list, tuple)):
        return [plain(one) for one in value]
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        return str(value.tolist())  # NaN equals itself
    return value


@pytest.mark.parametrize("case", CASES, ids=[case.__name__ for case in CASES])
@pytest.mark.filterwarnings("error:overflow")
@pytest.mark.parametrize("kind", [np.int64, np.uint8, np.int16])
def test_whole_numbers_of_numpy_are_taken(case, kind):
    assert plain(case(kind)) == plain(case(int))
