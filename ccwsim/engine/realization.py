"""One realization of a study: the raster pass of Algorithm 1, then local re-simulation."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from math import prod

import numpy as np
from numpy.typing import NDArray

from ccwsim.engine.compilation import SOON, ask_for, await_all
from ccwsim.engine.corrections.cell_repair import repair_cells
from ccwsim.engine.corrections.resimulation import Target, resimulate
from ccwsim.engine.corrections.seam_repair import WINDOWS_A_TILE, WINDOWS_A_TILE_DATA, repair_seams
from ccwsim.engine.prepared_image import PreparedImage
from ccwsim.engine.raster import (
    RASTER_SHARE,
    REPAIR_SHARE,
    draw_template,
    simulate_raster,
    totals_of,
)
from ccwsim.engine.stages.conditioning import data_grid
from ccwsim.engine.stages.path import Triple, in_layers, in_three
from ccwsim.jobs.workers import Watch
from ccwsim.model.ensemble import FORCED, WRONG
from ccwsim.model.grid import Grid
from ccwsim.model.hard_data import HardData
from ccwsim.model.study import Study
from ccwsim.model.training_image import TrainingImage


@dataclass(frozen=True, eq=False)
class Realization:
    """One realization of a study."""

    # shape (ny, nx), or (nz, ny, nx) of a volume: facies indices
    indices: NDArray[np.uint8]
    # the same shape, or empty: as `Ensemble.sources` has it
    sources: NDArray[np.int32]
    data_status: NDArray[np.int16]  # shape (n_data,): as `Ensemble.data_status` has it
    cpu_seconds: float = 0.0  # CPU time of the thread that simulated it


def simulate_realization(
    study: Study, number: int, image: PreparedImage, keep_sources: bool, watch: Watch
) -> Realization:
    """Return realization `number` of a study: raster pass, then local re-simulation.

    Its random numbers depend on the seed and its own number alone.
    """
    before = time.thread_time()
    rng = random_numbers(study.seed, number)
    template = draw_template(study.parameters, study.training_image.shape, rng)
    indices, sources = simulate_raster(study, template, image, keep_sources, rng, watch)
    cells = study.hard_data.cells
    if study.parameters.exact_data and study.hard_data.n:
        target = target_of(study, image, indices, sources)
        data_status = resimulate(
            target,
            in_three(cells),
            template,
            rng,
            image.isolated_datum_thresholds,
            lambda share: watch.report(RASTER_SHARE + (REPAIR_SHARE - RASTER_SHARE) * share),
        )
    else:
        missed = indices[tuple(cells.T)] != study.facies_of_data
        data_status = np.where(missed, WRONG, 0).astype(np.int16)
    if repairs(study):
        target = target_of(study, image, indices, sources)
        repair(study, target, data_status, template, image, rng, watch.report)
    watch.report(1.0)
    return Realization(indices, sources, data_status, time.thread_time() - before)


def repairs(study: Study) -> bool:
    """Say whether seams of a study are repaired."""
    p = study.parameters
    exact = p.exact_data or not study.hard_data.n
    return p.repair_seams and exact and study.training_image.n_facies > 1


def repair(
    study: Study,
    target: Target,
    data_status: NDArray[np.int16],
    template: Triple,
    image: PreparedImage,
    rng: np.random.Generator,
    report: Callable[[float], None] = lambda share: None,
) -> None:
    """Repair the seams of a realization whose data are honoured, in place.

    Single cells are changed after the windows, in walks; where these are many, also before, so that
    no window is spent on what they repair.
    """
    shape, n_data = target.grid.shape, study.hard_data.n
    volume, most = shape[0] > 1, target.grid.size
    if not volume:
        _, overlap, _ = study.parameters.along(study.grid.shape)
        steps = [t - o for t, o in zip(template, overlap, strict=True)]
        n_tiles = prod(-(-n // s) for n, s in zip(shape, steps, strict=True))
        share = WINDOWS_A_TILE_DATA if n_data else WINDOWS_A_TILE
        most = max(round(share * n_tiles), 1)
    forced = in_three(study.hard_data.cells[data_status == FORCED])
    n_facies, own = study.training_image.n_facies, image.repair(template)

    def part(first: float, last: float) -> Callable[[float], None]:
        low = REPAIR_SHARE + (1 - REPAIR_SHARE) * first
        return lambda share: report(low + (1 - REPAIR_SHARE) * (last - first) * share)

    if volume or n_data:
        repair_cells(target, own.side_by_side, rng, False, part(0.0, 0.1))
    repair_seams(target, own, n_facies, most, forced, rng, part(0.1, 0.9))
    repair_cells(target, own.side_by_side, rng, True, part(0.9, 1.0))


def target_of(
    study: Study, image: PreparedImage, indices: NDArray[np.uint8], sources: NDArray[np.int32]
) -> Target:
    """Return what local re-simulation changes: views of a realization and its sources in layers."""
    shape = in_layers(study.grid.shape)
    data = data_grid(in_three(study.hard_data.cells), study.facies_of_data, shape)
    origin = sources.reshape(shape if sources.size else (0, 0, 0))
    by_chance = study.parameters.draws_as_published
    known = image.scaled(), image.bits(), image.square_bits()
    return Target(*known, data, indices.reshape(shape), origin, by_chance)


def random_numbers(seed: int, number: int) -> np.random.Generator:
    """Return the random numbers of a realization."""
    sequence = np.random.SeedSequence(seed, spawn_key=(number,))
    return np.random.Generator(np.random.PCG64(sequence))


_compiled: set[tuple[object, ...]] = set()


def is_compiled(study: Study, image: PreparedImage) -> bool:
    """Say whether this process has run all kernels that a study needs."""
    return _ways(study, image) in _compiled


def is_ready() -> bool:
    """Return whether this process has compiled, or read from disk, the kernels of any study."""
    return bool(_compiled)


def compile_kernels(study: Study, image: PreparedImage, watch: Watch) -> None:
    """Run each kernel of a study once, on next to nothing, before realizations are timed."""
    if is_compiled(study, image):
        return
    await_all(ask_for(lambda: walk_through(study, watch), SOON), watch.check)
    simulate_realization(_tiny(study), 0, image, False, watch)
    _compiled.add(_ways(study, image))


def walk_through(study: Study, watch: Watch) -> None:
    """Simulate next to nothing, which calls all kernels of a study: for `ask_for`.

    From a small image, as what is prepared in a walk is of no use.
    """
    image, template = study.training_image, study.parameters.along(study.grid.shape).template
    shape = [min(n, 2 * t) for n, t in zip(in_layers(image.shape), template, strict=True)]
    cells = np.resize(image.codes, shape[-len(image.shape) :])
    small = replace(study, training_image=TrainingImage(cells))
    simulate_realization(_tiny(small), 0, PreparedImage(small), False, watch)


def _tiny(study: Study) -> Study:
    """Return a study of next to nothing, with data that cannot all be honoured if it has data."""
    shape = (8,) * len(study.grid.shape)
    cells = np.argwhere(np.ones(shape)) if study.hard_data.n else np.empty((0, len(shape)), int)
    codes = study.training_image.codes[[0, -1]][cells.sum(axis=1) % 2]
    grid = Grid.of(shape)
    return Study(study.training_image, grid, study.parameters, HardData(cells, codes), 0)


def _ways(study: Study, image: PreparedImage) -> tuple[object, ...]:
    """Return what decides which kernels are run, and for which types."""
    p = study.parameters
    template = p.along(study.grid.shape).template
    oriented = image.oriented(0, template)
    types = oriented.pyramid.sums.dtype, oriented.squares.dtype, totals_of(image)
    kinds = study.hard_data.n > 0, p.exact_data, p.scale > 0, repairs(study)
    return *types, len(study.grid.shape), *kinds
