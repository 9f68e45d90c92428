"""The conductor: the raster of Algorithm 1, then mending, for each realization of a study."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ccwsim.arrays import frozen_view
from ccwsim.ensemble import WRONG, Ensemble
from ccwsim.errors import Cancelled, CCWSIMError
from ccwsim.grid import Grid
from ccwsim.hard_data import HardData
from ccwsim.parameters import Parameters
from ccwsim.prepared_image import PreparedImage
from ccwsim.raster import draw_template, simulate_raster
from ccwsim.stages.conditioning import data_grid
from ccwsim.stages.mending import mend
from ccwsim.study import Study, counted
from ccwsim.training_image import TrainingImage
from ccwsim.workers import Progress, Watch, n_cores, run_all


@dataclass(frozen=True, eq=False)
class Realization:
    """One realization of a study.

    Attributes
    ----------
    indices : ndarray of uint8, shape (ny, nx)
        Facies indices.
    sources : ndarray of int32, shape (ny, nx) or (0, 0)
        As `Ensemble.sources` has it.
    met_by : ndarray of int16, shape (n_data,)
        As `Ensemble.met_by` has it.
    """

    indices: NDArray[np.uint8]
    sources: NDArray[np.int32]
    met_by: NDArray[np.int16]


def simulate_realization(
    study: Study, number: int, image: PreparedImage, keep_sources: bool, watch: Watch
) -> Realization:
    """Return realization `number` of a study: the raster first, then its data mended.

    Its random numbers depend on the seed and its own number alone.
    """
    rng = random_numbers(study.seed, number)
    template = draw_template(study.parameters, study.training_image.shape, rng)
    indices, sources = simulate_raster(study, template, image, keep_sources, rng, watch)
    cells = study.hard_data.cells
    if not study.parameters.exact_data:
        watch.report(1.0)
        missed = indices[cells[:, 0], cells[:, 1]] != study.facies_of_data
        return Realization(indices, sources, np.where(missed, WRONG, 0).astype(np.int16))
    data = data_grid(cells, study.facies_of_data, indices.shape)
    rare = image.rare_counts if study.hard_data.n else None
    ti = study.training_image.indices
    met_by = mend(ti, data, cells, template, rng, indices, sources, rare, watch.check)
    watch.report(1.0)
    return Realization(indices, sources, met_by)


def random_numbers(seed: int, number: int) -> np.random.Generator:
    """Return the random numbers of a realization.

    Examples
    --------
    >>> random_numbers(0, 3).random() == random_numbers(0, 3).random()
    True
    """
    sequence = np.random.SeedSequence(seed, spawn_key=(number,))
    return np.random.Generator(np.random.PCG64(sequence))


def simulate(
    training_image: TrainingImage,
    grid_shape: tuple[int, int] | Grid = (256, 256),
    parameters: Parameters | None = None,
    hard_data: HardData | None = None,
    n_realizations: int = 1,
    seed: int = 0,
    n_workers: int | None = None,
    progress: Progress | None = None,
    cancel: Callable[[], bool] | None = None,
    first_realization: int = 0,
    keep_sources: bool = False,
) -> Ensemble:
    """Simulate realizations of a training image that honour hard data (Algorithm 1).

    Parameters
    ----------
    training_image : TrainingImage
    grid_shape : pair of int or Grid
        Rows and columns of the simulation grid.
    parameters : Parameters, optional
    hard_data : HardData, optional
    n_realizations : int
    seed : int
        The same seed gives the same realizations for any number of workers, and realization r does
        not depend on how many are asked for.
    n_workers : int, optional
        Threads; as many as there are cores where not given.
    progress : callable, optional
        Called as progress(fraction, n_done) about 20 times a second.
    cancel : callable, optional
        Asked as often; returns True to stop.
    first_realization : int
        Number of the first one: two calls for 0 … 9 and 10 … 19 give what one for 0 … 19 gives.
    keep_sources : bool
        Keep where in the TI each cell came from, at four bytes a cell.

    Returns
    -------
    Ensemble

    Raises
    ------
    CCWSIMError
        For inputs that do not fit together; the message says what would.
    Cancelled
        Where `cancel` returned True; its `ensemble` has the realizations that were finished.

    Examples
    --------
    >>> stripes = TrainingImage(np.tile([[0], [0], [1], [1]], (16, 64)))
    >>> p = Parameters(template_size=16, overlap_size=4, wavelet_level=1)
    >>> simulate(stripes, (40, 50), p, n_realizations=2).realizations.shape
    (2, 40, 50)
    """
    study = Study(
        training_image,
        Grid.of(grid_shape),
        Parameters() if parameters is None else parameters,
        HardData() if hard_data is None else hard_data,
        seed,
    )
    n = counted("n_realizations", n_realizations, least=1)
    workers = n_cores() if n_workers is None else counted("n_workers", n_workers, least=1)
    first = counted("first_realization", first_realization, least=0)
    image = PreparedImage(study)
    _compile(study, image, progress)
    start = time.perf_counter()
    indices = _room((n, *study.grid.shape), np.uint8)
    sources = _room((n, *study.grid.shape) if keep_sources else (n, 0, 0), np.int32)
    met_by = np.zeros((n, study.hard_data.n), np.int16)
    seconds = np.zeros(n)

    def task(number: int, watch: Watch) -> None:
        before = time.thread_time()
        r = simulate_realization(study, first + number, image, keep_sources, watch)
        indices[number], sources[number], met_by[number] = r.indices, r.sources, r.met_by
        seconds[number] = time.thread_time() - before

    finished = run_all(task, n, workers, progress, cancel)
    if len(finished) < n:
        indices, sources = indices[finished], sources[finished]
        met_by, seconds = met_by[finished], seconds[finished]
    wall = time.perf_counter() - start
    ensemble = Ensemble(
        study.training_image, study.grid, study.parameters, study.hard_data, study.seed,
        frozen_view(indices), frozen_view(seconds), wall, frozen_view(met_by),
        frozen_view(first + np.array(finished, int)),
        frozen_view(sources) if keep_sources else None,
    )  # fmt: skip
    if len(finished) < n:
        raise Cancelled(
            f"stopped after {len(finished)} of {n} realizations", ensemble if finished else None
        )
    return ensemble


_compiled: set[tuple[object, ...]] = set()


def _compile(study: Study, image: PreparedImage, progress: Progress | None) -> None:
    """Run each kernel once, on next to nothing, before the clock of the realizations starts."""
    template, p = study.parameters.template_size, study.parameters
    turned = image.turned(0, template)
    with_data = study.hard_data.n > 0
    ways = with_data, p.exact_data, p.scale > 0
    types = turned.pyramid.sums.dtype, turned.energies.dtype, *ways
    if types in _compiled:
        return
    cells = np.argwhere(np.ones((8, 8))) if with_data else np.empty((0, 2), int)
    codes = study.training_image.codes[[0, -1]][cells.sum(axis=1) % 2]  # none can be met at once
    tiny = Study(study.training_image, Grid(8, 8), p, HardData(cells, codes), 0)

    def task(_: int, watch: Watch) -> None:
        simulate_realization(tiny, 0, image, False, watch)

    run_all(task, 1, 1, (lambda *_: progress(0.0, 0)) if progress else None)
    _compiled.add(types)


def _room(shape: tuple[int, ...], kind: type[np.integer]) -> NDArray:
    try:
        return np.empty(shape, kind)
    except (MemoryError, ValueError):
        n, ny, nx = shape
        raise CCWSIMError(
            f"{n} realizations of {nx} × {ny} cells do not fit into memory; "
            "ask for fewer, or for a smaller grid"
        ) from None
