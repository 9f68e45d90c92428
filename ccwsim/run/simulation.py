"""`simulate`: simulation of many realizations on any executor, in memory or on disk."""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from concurrent.futures import Executor
from secrets import randbelow
from typing import TYPE_CHECKING, Any, SupportsIndex

import numpy as np
from numpy.typing import ArrayLike

from ccwsim import Cancelled, CCWSIMError, Ensemble, Grid, Parameters, Secondary, TrainingImage
from ccwsim.engine.realization import Realization
from ccwsim.model import (
    MAX_INT,
    MAX_SEED,
    UNKNOWN,
    Array,
    Cancel,
    FaciesNames,
    Integers,
    Progress,
    Shape,
    Study,
    Watch,
    check_callable,
    check_int,
)
from ccwsim.run.executors import Work, runner_of
from ccwsim.run.output import store_of

if TYPE_CHECKING:
    from distributed import Client


def simulate(
    training_image: TrainingImage | ArrayLike,
    grid_shape: Sequence[int] | Integers | Grid = (256, 256),
    parameters: Parameters | None = None,
    hard_data: Any = None,
    n_realizations: SupportsIndex = 1,
    seed: SupportsIndex | np.random.Generator | np.random.SeedSequence | None = 0,
    n_workers: SupportsIndex | None = None,
    progress: Progress | bool | None = None,
    cancel: Cancel | None = None,
    first_realization: SupportsIndex = 0,
    keep_sources: bool = False,
    executor: Executor | Client | None = None,
    out: str | os.PathLike[str] | None = None,
    secondary: Secondary | None = None,
    facies: FaciesNames | None = None,
) -> Ensemble:
    """Simulate realizations of a training image that honour hard data (Algorithm 1).

    Parameters
    ----------
    training_image : TrainingImage or array_like of shape (ny, nx) or (nz, ny, nx)
        An array contains facies codes, with row 0 in the south and layer 0 at the bottom.
    grid_shape : pair or triple of int, or Grid
        Numbers of rows and columns of a map, or numbers of layers, rows and columns of a volume.
    parameters : Parameters, optional
    hard_data : HardData, pair, table or array_like, optional
        Any form that `HardData.of` accepts: (cells, facies), a table with x, y and facies, or an
        array with the shape of the grid and NaN in cells without a datum.
    n_realizations : int
    seed : int, numpy.random.Generator or SeedSequence, optional
        If None, a random seed is chosen; of a generator, one integer is drawn. `Ensemble.seed` is
        the integer. A seed gives the same realizations for any number of workers; realization r
        does not depend on `n_realizations`.
    n_workers : int, optional
        Number of threads; by default one per core.
    progress : callable or True, optional
        Called as progress(fraction, n_done) about 20 times a second; True shows a bar.
    cancel : callable, optional
        Called as cancel() about 20 times a second; returns True to stop the run.
    first_realization : int
        Number of the first realization; two runs of 0 … 9 and 10 … 19 equal one run of 0 … 19.
    keep_sources : bool
        Whether to record the cell of the TI from which each cell was copied (4 bytes per cell).
    executor : concurrent.futures.Executor or distributed.Client, optional
        Simulate on the threads or processes of this executor, or on the workers of a Dask cluster,
        which need ccwsim. The executor stays open. `n_workers` applies only if the executor does
        not report its number of workers. A call on a thread of this executor simulates on other
        threads, because the thread would wait for itself.
    out : path, optional
        An npy file. Realizations are written to the file as facies codes, and the ensemble reads
        from the file. An existing file is replaced at the end.
    secondary : Secondary, optional
        Probabilities of facies, auxiliary variables, and active cells. Hard data in inactive cells
        are left out.
    facies : mapping or pairs, optional
        Facies of the training image, by code or name, for codes or names of the hard data, such as
        {0: "sand", 1: "mud"}. Without it, a warning names the facies that are matched by number
        although the image has no codes of its own, as in a picture.

    Returns
    -------
    Ensemble

    Raises
    ------
    CCWSIMError
        If inputs do not fit together; the message suggests a fix.
    Cancelled
        If `cancel` returned True; the exception's `ensemble` has the finished realizations.

    Examples
    --------
    >>> stripes = TrainingImage(np.tile([[0], [0], [1], [1]], (16, 64)))
    >>> p = Parameters(template_size=16, overlap_size=4, wavelet_level=1)
    >>> simulate(stripes, (40, 50), p, n_realizations=2).realizations.shape
    (2, 40, 50)
    """
    return simulate_study(
        Study.of(
            training_image,
            grid_shape,
            parameters,
            hard_data,
            seed=randbelow(MAX_SEED + 1) if seed is None else seed,
            secondary=secondary,
            facies=facies,
        ),
        n_realizations=n_realizations,
        n_workers=n_workers,
        progress=progress,
        cancel=cancel,
        first_realization=first_realization,
        keep_sources=keep_sources,
        executor=executor,
        out=out,
    )


def simulate_study(
    study: Study,
    n_realizations: SupportsIndex = 1,
    n_workers: SupportsIndex | None = None,
    progress: Progress | bool | None = None,
    cancel: Cancel | None = None,
    first_realization: SupportsIndex = 0,
    keep_sources: bool = False,
    executor: Executor | Client | None = None,
    out: str | os.PathLike[str] | None = None,
) -> Ensemble:
    """Simulate realizations of a study, with the options and errors of `simulate`."""
    study = study.fitting()
    n = check_int("n_realizations", n_realizations, 1)
    first = check_int("first_realization", first_realization, 0, MAX_INT - n)
    check_callable("progress", progress)
    check_callable("cancel", cancel)
    watch = Watch(progress, cancel)
    active_study, part = study.around_active()
    runner = runner_of(Work(active_study, first, n, keep_sources), executor, n_workers)
    try:
        data_status, seconds = np.zeros((n, study.hard_data.n), np.int16), np.zeros(n)
    except (MemoryError, ValueError):
        raise CCWSIMError(f"{n} realizations do not fit into memory; simulate fewer") from None
    with store_of(study, n, keep_sources, out) as store:

        def take(k: int, r: Realization) -> None:
            filled = (r.indices, UNKNOWN), (r.sources, -1), (r.values, np.nan)
            store.put(k, *(expanded(each, part, study.grid.shape, fill) for each, fill in filled))
            data_status[k], seconds[k] = r.data_status, r.cpu_seconds

        is_prepared = runner.prepare(watch)
        start = time.perf_counter()
        finished = runner.run(take, watch) if is_prepared else []
        indices, sources, values = store.finish(finished)
    ensemble = Ensemble(
        study=study,
        indices=indices,
        cpu_seconds=seconds[finished],
        wall_seconds=time.perf_counter() - start,
        data_status=data_status[finished],
        numbers=first + np.array(finished, int),
        sources=sources,
        values={} if values is None else {study.training_image.variable: values},
    )
    if len(finished) < n:
        raise Cancelled(
            f"stopped after {len(finished)} of {n} realizations", ensemble if finished else None
        )
    return ensemble


def expanded(array: Array, part: tuple[slice, ...], shape: Shape, fill: float) -> Array:
    """Return an array of a part of the grid in the whole grid; an empty array stays empty."""
    if array.shape == shape or not array.size:
        return array
    whole = np.full(shape, fill, array.dtype)
    whole[part] = array
    return whole
