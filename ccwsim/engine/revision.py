"""Revise an ensemble after an edit of hard data, by local re-simulation (not in the paper)."""

import time
from dataclasses import replace
from typing import Any

import numpy as np

from ccwsim.engine.corrections.resimulation import resimulate
from ccwsim.engine.prepared_image import PreparedImage
from ccwsim.engine.realization import finish, honour_values, target_of
from ccwsim.engine.stages.path import in_three
from ccwsim.jobs.workers import run_all
from ccwsim.model import FORCED, WRONG, Ensemble, HardData, Int16s, Watch, check_int, readonly
from ccwsim.system.machine import n_cores

UNCHANGED = -2  # source of a cell that no window has changed


def revise(ensemble: Ensemble, hard_data: Any, n_workers: int | None = None) -> Ensemble:
    """Return an ensemble that honours edited data by local re-simulation around these data.

    Realizations change only in windows around data that they do not honour; a window is at most as
    large as the template. Values of a continuous variable change around such data by kriging.
    Removing a datum changes no cell. Use `simulate` to condition
    realizations on all data from the beginning. If `Parameters.exact_data` is off, no window is
    re-simulated; data that are not honoured are only marked as wrong. Raises `CCWSIMError` if data
    are outside the grid or of an unknown facies.

    Parameters
    ----------
    ensemble : Ensemble
    hard_data : HardData, pair, table or array_like
        All data, old and new, in any form that `HardData.of` accepts.
    n_workers : int, optional
        Number of threads; by default the number of cores.

    Returns
    -------
    Ensemble
        Ensemble with unchanged seed and parameters; `cpu_seconds` includes only the re-simulation.

    Examples
    --------
    >>> from ccwsim import Parameters, TrainingImage, simulate
    >>> image = TrainingImage(np.tile([[0], [0], [1], [1]], (16, 64)))
    >>> p = Parameters(template_size=16, overlap_size=4, wavelet_level=1)
    >>> before = simulate(image, (40, 50), p, n_realizations=3)
    >>> after = revise(before, ([[20, 20], [30, 10]], [1, 0]))
    >>> after.n_mismatched.tolist()
    [0, 0, 0]
    """
    hard_data = HardData.of(hard_data, ensemble.grid, ensemble.training_image)
    study = replace(ensemble.study, hard_data=hard_data, checked=True)
    p, hard_data = study.parameters, study.hard_data
    workers = n_cores() if n_workers is None else check_int("n_workers", n_workers, 1)
    start = time.perf_counter()
    indices = ensemble.indices.copy()
    sources = None if ensemble.sources is None else ensemble.sources.copy()
    values = {name: array.copy() for name, array in ensemble.values.items()}
    data_status = _status_before(ensemble, hard_data)
    seconds = np.zeros(ensemble.n)
    prepared = PreparedImage(study)
    template = p.along(study.grid.shape).template
    cells, places = in_three(hard_data.cells), tuple(hard_data.cells.T)

    def task(number: int, watch: Watch) -> None:
        before = time.thread_time()
        for of_variable in values.values():
            honour_values(prepared, indices[number], of_variable[number])
        key = int(ensemble.numbers[number]), 1
        rng = np.random.default_rng(np.random.SeedSequence(study.seed, spawn_key=key))
        wrong = indices[number][places] != study.facies_of_data
        if not p.exact_data:
            data_status[number, wrong] = WRONG
            return
        forced = data_status[number] == FORCED
        needs_changes = forced.any() or sources is not None
        changed = np.full(study.grid.shape if needs_changes else (0, 0), UNCHANGED, np.int32)
        status = resimulate(
            target_of(prepared, indices[number], changed),
            cells[wrong],
            template,
            rng,
            isolated_below=prepared.isolated_datum_thresholds,
            watch=watch,
        )
        data_status[number, wrong] = status
        if forced.any():  # windows that replace forced cells honour their data
            data_status[number, forced & (changed[places] >= 0)] = status.max(initial=0)
        changed = finish(prepared, indices[number], changed)
        if sources is not None:
            sources[number] = np.where(changed == UNCHANGED, sources[number], changed)
        seconds[number] = time.thread_time() - before
        watch.tell(1.0)

    run_all(task, ensemble.n, workers)
    return replace(
        ensemble,
        study=study,
        indices=readonly(indices),
        data_status=readonly(data_status),
        sources=sources,
        values=values,
        revised=True,
        cpu_seconds=readonly(seconds),
        wall_seconds=time.perf_counter() - start,
    )


def _status_before(ensemble: Ensemble, hard_data: HardData) -> Int16s:
    """Return the status of each datum in the ensemble before the edit; 0 for new data."""
    before = {datum: k for k, datum in enumerate(ensemble.hard_data.triples)}
    data_status = np.zeros((ensemble.n, hard_data.n), np.int16)
    for k, datum in enumerate(hard_data.triples):
        if datum in before:
            data_status[:, k] = ensemble.data_status[:, before[datum]]
    return data_status
