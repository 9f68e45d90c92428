"""Simulate one realization of a study by Algorithm 1, then apply corrections."""

import time
from dataclasses import dataclass
from functools import partial
from math import prod

import numpy as np
from numpy.typing import NDArray

from ccwsim.engine import raster
from ccwsim.engine.compilation import SOON, ask_for, await_all
from ccwsim.engine.corrections.cell_repair import repair_cells
from ccwsim.engine.corrections.resimulation import OnWindow, Target, resimulate
from ccwsim.engine.corrections.seam_repair import WINDOWS_A_TILE, WINDOWS_A_TILE_DATA, repair_seams
from ccwsim.engine.multiscale import place_at_finer_scales
from ccwsim.engine.prepared_image import PreparedImage, largest_code
from ccwsim.engine.stages.conditioning import data_grid
from ccwsim.engine.stages.path import UNKNOWN, Triple, in_layers, in_three
from ccwsim.engine.stages.pyramid import block_sum_type
from ccwsim.engine.stages.similarity import score_type
from ccwsim.model.ensemble import FORCED, WRONG
from ccwsim.model.grid import Grid
from ccwsim.model.hard_data import HardData
from ccwsim.model.study import Study
from ccwsim.model.training_image import TrainingImage
from ccwsim.model.watch import UNWATCHED, Watch

TRIALS_A_CELL, TRIALS_A_CELL_DATA = 40, 400
"""Maximum number of changes of single cells that are tried per cell in a pass of seam repair,
without and with data. Seams need fewer changes. Images without structure would need hundreds of
changes, so some unseen patterns remain in such images."""
WINDOWS_A_CELL = 0.02
"""Maximum number of repaired windows per cell of a volume; images without structure would need
more."""
NO_KINDS = np.zeros((0, 2), np.int64), np.zeros((0, 0, 0), np.uint8)
"""Layers and kinds of `Target` without copies of the training image."""


@dataclass(frozen=True, eq=False)
class Realization:
    """One realization of a study."""

    indices: NDArray[np.uint8]  # facies indices, shape of the grid; UNKNOWN in inactive cells
    sources: NDArray[np.int32]  # shape of the grid, or empty: see `Ensemble.sources`
    data_status: NDArray[np.int16]  # shape (n_data,): see `Ensemble.data_status`
    cpu_seconds: float = 0.0  # CPU time of the simulating thread


def simulate_realization(
    image: PreparedImage, number: int, keep_sources: bool, watch: Watch
) -> Realization:
    """Return realization `number` of a study: raster pass, local re-simulation, seam repair.

    The random numbers depend only on the seed of the study and on `number`.
    """
    before, study = time.thread_time(), image.study
    rng = random_numbers(study.seed, number)
    template = raster.draw_template(study.parameters, study.training_image.shape, rng)
    indices, sources = simulate_raster(image, template, keep_sources, rng, watch)
    changed = image, template, indices, sources, rng
    data_status = honour_data(*changed, watch)
    repair(*changed, data_status, watch)
    sources = finish(image, indices, sources)
    watch.tell(1.0)
    return Realization(indices, sources, data_status, time.thread_time() - before)


def finish(
    image: PreparedImage, indices: NDArray[np.uint8], sources: NDArray[np.int32]
) -> NDArray[np.int32]:
    """Make inactive cells unknown, in place; return sources as cells of the training images.

    `sources` are cells of the image or stack of copies that was searched; negative values stay.
    """
    if image.copies and sources.size:
        sources = np.where(sources < 0, sources, image.copies.origins.ravel()[sources])
    active = image.study.active
    if active is not None:
        indices[~active] = UNKNOWN
        if sources.size:
            sources[~active] = -1
    return sources


def simulate_raster(
    image: PreparedImage,
    template: Triple,
    keep_sources: bool,
    rng: np.random.Generator,
    watch: Watch,
) -> tuple[NDArray[np.uint8], NDArray[np.int32]]:
    """Return a realization after the raster pass, and the sources of its cells."""
    plan = raster.make_plan(image, template, rng)
    simulated = raster.simulate_tiles(image, plan, keep_sources, rng, watch)
    simulated = place_at_finer_scales(image, plan, simulated, keep_sources, watch)
    return raster.to_grid(image, simulated, plan.path)


def honour_data(
    image: PreparedImage,
    template: Triple,
    indices: NDArray[np.uint8],
    sources: NDArray[np.int32],
    rng: np.random.Generator,
    watch: Watch = UNWATCHED,
    on_window: OnWindow | None = None,
) -> NDArray[np.int16]:
    """Re-simulate around data that a realization does not honour, in place; return the data status.

    If `exact_data` is off, wrong data are only marked. `resimulate` calls `on_window`.
    """
    study, cells = image.study, image.study.hard_data.cells
    if not (study.parameters.exact_data and study.hard_data.n):
        missed = indices[tuple(cells.T)] != study.facies_of_data
        return np.where(missed, WRONG, 0).astype(np.int16)
    part = watch.part(raster.RASTER_SHARE, raster.REPAIR_SHARE)
    target, thresholds = target_of(image, indices, sources), image.isolated_datum_thresholds
    return resimulate(target, in_three(cells), template, rng, thresholds, part, on_window)


def repairs(study: Study) -> bool:
    """Return whether seams are repaired in the realizations of a study."""
    p = study.parameters
    exact = p.exact_data or not study.hard_data.n
    return p.repair_seams and exact and study.training_image.n_facies > 1


def repair(
    image: PreparedImage,
    template: Triple,
    indices: NDArray[np.uint8],
    sources: NDArray[np.int32],
    rng: np.random.Generator,
    data_status: NDArray[np.int16],
    watch: Watch = UNWATCHED,
) -> None:
    """If `repairs(study)`, repair the seams of a realization whose data are honoured, in place.

    First, windows are re-simulated. Second, tabu searches change single cells. Volumes and studies
    with data have many unseen patterns; in these studies, single cells are also changed before the
    first step, so that fewer windows are re-simulated.
    """
    study = image.study
    if not repairs(study):
        return
    target = target_of(image, indices, sources)
    shape, n_data = target.grid.shape, study.hard_data.n
    volume, most = shape[0] > 1, max(round(WINDOWS_A_CELL * target.grid.size), 1)
    if not volume:
        _, overlap, _ = study.parameters.along(study.grid.shape)
        steps = [t - o for t, o in zip(template, overlap, strict=True)]
        n_tiles = prod(-(-n // s) for n, s in zip(shape, steps, strict=True))
        share = WINDOWS_A_TILE_DATA if n_data else WINDOWS_A_TILE
        most = max(round(share * n_tiles), 1)
    if study.active is not None:
        most = max(round(most * (np.count_nonzero(study.active) / study.active.size)), 1)
    forced = in_three(study.hard_data.cells[data_status == FORCED])
    active = None if study.active is None else study.active.reshape(shape)
    inputs, whole = image.repair(template), watch.part(raster.REPAIR_SHARE, 1.0)
    cells = target, inputs.side_by_side, rng
    n_trials = TRIALS_A_CELL_DATA if n_data else TRIALS_A_CELL
    if volume or n_data:
        repair_cells(*cells, False, whole.part(0.0, 0.1), n_trials, active)
    repair_seams(target, inputs, most, forced, rng, whole.part(0.1, 0.9), active)
    repair_cells(*cells, True, whole.part(0.9, 1.0), n_trials, active)


def target_of(
    image: PreparedImage, indices: NDArray[np.uint8], sources: NDArray[np.int32]
) -> Target:
    """Return the target of corrections, with views of a realization and its sources as volumes."""
    study, shape = image.study, in_layers(image.study.grid.shape)
    data = data_grid(in_three(study.hard_data.cells), study.facies_of_data, shape)
    sources = sources.reshape(shape if sources.size else (0, 0, 0))
    by_chance = study.parameters.published_draw
    known = image.scaled(), image.bits(), image.square_bits()
    balance = np.zeros(study.training_image.n_facies, np.int64)
    cells, volume = (data, indices.reshape(shape), sources, balance), len(image.base) > 1
    kinds = NO_KINDS
    if copies := image.copies:
        kinds = image.part(("layers around",), copies.around), copies.kinds
    return Target(*known, *cells, by_chance, image.unknown(), *kinds, volume)


def random_numbers(seed: int, number: int) -> np.random.Generator:
    """Return the random number generator of a realization."""
    sequence = np.random.SeedSequence(seed, spawn_key=(number,))
    return np.random.Generator(np.random.PCG64(sequence))


_compiled: set[tuple[object, ...]] = set()


def is_compiled(image: PreparedImage) -> bool:
    """Return whether this process has run all kernels that a study needs."""
    return _specialization(image) in _compiled


def is_ready() -> bool:
    """Return whether this process has run the kernels of at least one study."""
    return bool(_compiled)


def compile_kernels(image: PreparedImage, watch: Watch, load: bool = True) -> None:
    """Run all kernels of a study on a tiny grid, so that measured times exclude compilation.

    If not `load`, they are only compiled, for other processes.
    """
    if is_compiled(image):
        return
    work = partial(walk_through, image, watch)
    await_all(ask_for(work, SOON), watch.check)
    if load:
        work()
    _compiled.add(_specialization(image))


def walk_through(image: PreparedImage, watch: Watch) -> None:
    """Simulate a tiny study that calls all kernels of a study, with arguments of the same types.

    The tiny study shares no array with the study: kernels do not check the bounds of arrays. Only
    the integer type of scores depends on sizes; it is that of the study.
    """
    tiny, totals = PreparedImage(tiny_study(image.study)), raster.totals_of(image)
    tiny.part(("totals",), lambda: totals)
    simulate_realization(tiny, 0, False, watch)


def tiny_study(study: Study) -> Study:
    """Return a study of the same kind with a grid of 8 cells a side and a small image.

    If `study` has data, those of the tiny study fill the grid and contradict each other.
    """
    p, n_axes = study.parameters, len(study.grid.shape)
    template, _, level = p.along(study.grid.shape)
    largest = [round(t * (1 + p.template_variation)) for t in template]
    # some patches do not contain the unknown cell in the corner, wherever refinement shifts them
    shape = [max(2 * t, t + 2 * 2**j) for t, j in zip(largest, level, strict=True)][-n_axes:]
    codes = np.resize(study.training_image.codes, shape)
    if study.training_image.known is not None or (study.secondary and study.secondary.has_copies):
        codes = codes.astype(float)
        codes[(-1,) * n_axes] = np.nan
    image, grid = TrainingImage(codes), Grid.of((8,) * n_axes)
    cells = np.argwhere(np.ones(grid.shape)) if study.hard_data.n else np.empty((0, n_axes), int)
    data = HardData(cells, image.codes[[0, -1]][cells.sum(axis=1) % 2])
    secondary = study.secondary and study.secondary.resized(grid.shape, image)
    return Study(image, grid, p, data, 0, secondary)


def _specialization(image: PreparedImage) -> tuple[object, ...]:
    """Return the properties of a study that determine which kernels are run with which types."""
    study, p, coarse = image.study, image.study.parameters, image.lengths[-1]
    sizes = coarse.level, coarse.template, coarse.overlap
    scores = score_type(*sizes, p.similarity == "correlation", largest_code=largest_code(study))
    types = block_sum_type(coarse.block), scores, raster.totals_of(image)
    has_copies = study.secondary is not None and study.secondary.has_copies
    has_gaps = study.training_image.known is not None or has_copies
    kinds = study.hard_data.n > 0, p.exact_data, p.scale > 0, repairs(study), has_gaps, p.variant
    return *types, len(study.grid.shape), study.is_guided, *kinds
