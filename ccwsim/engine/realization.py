"""Simulate one realization of a study by Algorithm 1, then apply corrections."""

import time
from dataclasses import dataclass, field
from functools import partial
from math import prod

import numpy as np

from ccwsim.engine import raster
from ccwsim.engine.compilation import SOON, ask_for, await_all
from ccwsim.engine.corrections.cell_repair import repair_cells
from ccwsim.engine.corrections.residuals import correct
from ccwsim.engine.corrections.resimulation import OnWindow, Target, resimulate
from ccwsim.engine.corrections.seam_repair import WINDOWS_A_TILE, WINDOWS_A_TILE_DATA, repair_seams
from ccwsim.engine.multiscale import place_at_finer_scales
from ccwsim.engine.prepared_image import PreparedImage, largest_code
from ccwsim.engine.stages.conditioning import data_grid
from ccwsim.engine.stages.path import UNKNOWN, Triple, in_layers, in_three
from ccwsim.engine.stages.pyramid import block_sum_type
from ccwsim.engine.stages.similarity import score_type
from ccwsim.model import (
    FORCED,
    UNWATCHED,
    WRONG,
    Bytes,
    Floats,
    Grid,
    HardData,
    Int16s,
    Int32s,
    Study,
    TrainingImage,
    Watch,
)

TRIALS_A_CELL, TRIALS_A_CELL_DATA = 40, 400
"""Maximum number of changes of single cells that are tried per cell in a pass of seam repair,
without and with data. Seams need fewer changes. Images without structure would need hundreds of
changes, so some unseen patterns remain in such images."""
WINDOWS_A_CELL = 0.02
"""Maximum number of repaired windows per cell of a volume; images without structure would need
more."""


@dataclass(frozen=True, eq=False)
class Realization:
    """One realization of a study."""

    indices: Bytes  # facies indices, shape of the grid; UNKNOWN in inactive cells
    sources: Int32s  # shape of the grid, or empty: see `Ensemble.sources`
    data_status: Int16s  # shape (n_data,): see `Ensemble.data_status`
    cpu_seconds: float = 0.0  # CPU time of the simulating thread
    values: Floats = field(default_factory=partial(np.empty, (0, 0)))
    """Values of a continuous variable, shape of the grid; empty for facies."""


def simulate_realization(
    prepared: PreparedImage, number: int, keep_sources: bool, watch: Watch
) -> Realization:
    """Return realization `number` of a study: raster pass, local re-simulation, seam repair.

    The random numbers depend only on the seed of the study and on `number`.
    """
    before, study = time.thread_time(), prepared.study
    continuous = bool(study.training_image.values)
    rng = random_numbers(study.seed, number)
    template = raster.draw_template(study.parameters, study.training_image.shape, rng)
    keeps = keep_sources or continuous  # values are copied from sources
    indices, sources = simulate_raster(prepared, template, keeps, rng, watch)
    data_status = honour_data(prepared, template, indices, sources, rng, watch=watch)
    repair(prepared, template, indices, sources, rng, data_status=data_status, watch=watch)
    sources = finish(prepared, indices, sources)
    values = values_of(prepared, indices, sources) if continuous else np.empty((0, 0))
    watch.tell(1.0)
    sources = sources if keep_sources else np.empty((0, 0), np.int32)
    return Realization(indices, sources, data_status, time.thread_time() - before, values)


def values_of(prepared: PreparedImage, indices: Bytes, sources: Int32s) -> Floats:
    """Return the values of a finished realization, which honour data; update their classes."""
    image = prepared.study.training_image
    values = image.values[image.variable].ravel()[sources]
    values[sources < 0] = np.nan
    honour_values(prepared, indices, values)
    return values


def honour_values(prepared: PreparedImage, indices: Bytes, values: Floats) -> None:
    """Make the values of a realization honour the data, and update their classes, in place."""
    if prepared.study.hard_data.n:
        correct(values, prepared.residuals())
        indices[...] = prepared.study.training_image.class_indices(values)


def finish(prepared: PreparedImage, indices: Bytes, sources: Int32s) -> Int32s:
    """Make inactive cells unknown, in place; return sources as cells of the training images.

    `sources` are cells of the image or stack of copies that was searched; negative values stay.
    """
    if prepared.copies and sources.size:
        sources = np.where(sources < 0, sources, prepared.copies.origins.ravel()[sources])
    active = prepared.study.active
    if active is not None:
        indices[~active] = UNKNOWN
        if sources.size:
            sources[~active] = -1
    return sources


def simulate_raster(
    prepared: PreparedImage,
    template: Triple,
    keep_sources: bool,
    rng: np.random.Generator,
    watch: Watch,
) -> tuple[Bytes, Int32s]:
    """Return a realization after the raster pass, and the sources of its cells."""
    plan = raster.make_plan(prepared, template, rng)
    simulated = raster.simulate_tiles(prepared, plan, keep_sources, rng, watch)
    simulated = place_at_finer_scales(prepared, plan, simulated, keep_sources, watch)
    return raster.to_grid(prepared, simulated, plan.path)


def honour_data(
    prepared: PreparedImage,
    template: Triple,
    indices: Bytes,
    sources: Int32s,
    rng: np.random.Generator,
    watch: Watch = UNWATCHED,
    on_window: OnWindow | None = None,
) -> Int16s:
    """Re-simulate around data that a realization does not honour, in place; return the data status.

    If `exact_data` is off, wrong data are only marked. `resimulate` calls `on_window`.
    """
    study, cells = prepared.study, prepared.study.hard_data.cells
    if study.training_image.values:
        return np.zeros(len(cells), np.int16)  # `values_of` corrects them
    if not (study.parameters.exact_data and study.hard_data.n):
        missed = indices[tuple(cells.T)] != study.facies_of_data
        return np.where(missed, WRONG, 0).astype(np.int16)
    return resimulate(
        target_of(prepared, indices, sources),
        in_three(cells),
        template,
        rng,
        isolated_below=prepared.isolated_datum_thresholds,
        watch=watch.part(raster.RASTER_SHARE, raster.REPAIR_SHARE),
        on_window=on_window,
    )


def repairs(study: Study) -> bool:
    """Return whether seams are repaired in the realizations of a study."""
    p = study.parameters
    exact = p.exact_data or not study.hard_data.n
    is_facies = study.training_image.n_facies > 1 and not study.training_image.values
    return p.repair_seams and exact and is_facies


def repair(
    prepared: PreparedImage,
    template: Triple,
    indices: Bytes,
    sources: Int32s,
    rng: np.random.Generator,
    data_status: Int16s,
    watch: Watch = UNWATCHED,
) -> None:
    """If `repairs(study)`, repair the seams of a realization whose data are honoured, in place.

    First, windows are re-simulated. Second, tabu searches change single cells. Volumes and studies
    with data have many unseen patterns; in these studies, single cells are also changed before the
    first step, so that fewer windows are re-simulated.
    """
    study = prepared.study
    if not repairs(study):
        return
    target = target_of(prepared, indices, sources)
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
    inputs, whole = prepared.repair(template), watch.part(raster.REPAIR_SHARE, 1.0)
    n_trials = TRIALS_A_CELL_DATA if n_data else TRIALS_A_CELL

    def change_cells(walks: bool, watch: Watch) -> None:
        repair_cells(
            target,
            inputs.side_by_side,
            rng,
            walks,
            watch=watch,
            trials_a_cell=n_trials,
            active=active,
        )

    if volume or n_data:
        change_cells(walks=False, watch=whole.part(0.0, 0.1))
    repair_seams(
        target, inputs, most, forced=forced, rng=rng, watch=whole.part(0.1, 0.9), active=active
    )
    change_cells(walks=True, watch=whole.part(0.9, 1.0))


def target_of(prepared: PreparedImage, indices: Bytes, sources: Int32s) -> Target:
    """Return the target of corrections, with views of a realization and its sources as volumes."""
    study, shape = prepared.study, in_layers(prepared.study.grid.shape)
    target = Target(
        image=prepared.scaled(),
        bits=prepared.bits(),
        square_bits=prepared.square_bits(),
        data=data_grid(in_three(study.hard_data.cells), study.facies_of_data, shape),
        grid=indices.reshape(shape),
        sources=sources.reshape(shape if sources.size else (0, 0, 0)),
        balance=np.zeros(study.training_image.n_facies, np.int64),
        by_chance=study.parameters.published_draw,
        unknown=prepared.unknown(),
        volume=len(prepared.base) > 1,
    )
    if copies := prepared.copies:
        layers = prepared.part(("layers around",), copies.around)
        target = target._replace(layers=layers, kinds=copies.kinds)
    return target


def random_numbers(seed: int, number: int) -> np.random.Generator:
    """Return the random number generator of a realization."""
    sequence = np.random.SeedSequence(seed, spawn_key=(number,))
    return np.random.Generator(np.random.PCG64(sequence))


_compiled_kinds: set[tuple[object, ...]] = set()


def is_compiled(prepared: PreparedImage) -> bool:
    """Return whether this process has run all kernels that a study needs."""
    return _specialization(prepared) in _compiled_kinds


def is_ready() -> bool:
    """Return whether this process has run the kernels of at least one study."""
    return bool(_compiled_kinds)


def compile_kernels(prepared: PreparedImage, watch: Watch, load: bool = True) -> None:
    """Run all kernels of a study on a tiny grid, so that measured times exclude compilation.

    If `load` is false, the kernels are only compiled, for other processes.
    """
    if is_compiled(prepared):
        return
    work = partial(walk_through, prepared, watch)
    await_all(ask_for(work, SOON), watch.check)
    if load:
        work()
    _compiled_kinds.add(_specialization(prepared))


def walk_through(prepared: PreparedImage, watch: Watch) -> None:
    """Simulate a tiny study that calls all kernels of a study, with arguments of the same types.

    The tiny study shares no array with the study: kernels do not check the bounds of arrays. Only
    the integer type of scores depends on sizes; it is that of the study.
    """
    tiny, totals = PreparedImage(tiny_study(prepared.study)), raster.totals_of(prepared)
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
    if study.training_image.known is not None or study.secondary_or_empty.has_copies:
        codes = codes.astype(float)
        codes[(-1,) * n_axes] = np.nan
    image, grid = TrainingImage(codes), Grid.of((8,) * n_axes)
    cells = np.argwhere(np.ones(grid.shape)) if study.hard_data.n else np.empty((0, n_axes), int)
    data = HardData(cells, image.codes[[0, -1]][cells.sum(axis=1) % 2])
    secondary = study.secondary and study.secondary.resized(grid.shape, image)
    return Study(image, grid, p, data, secondary=secondary)


def _specialization(prepared: PreparedImage) -> tuple[object, ...]:
    """Return the properties that determine which kernels a study runs, with which types."""
    study, p, coarse = prepared.study, prepared.study.parameters, prepared.lengths[-1]
    scores = score_type(
        coarse.level,
        coarse.template,
        coarse.overlap,
        correlation=p.similarity == "correlation",
        largest_code=largest_code(study),
    )
    types = block_sum_type(coarse.block), scores, raster.totals_of(prepared)
    has_gaps = study.training_image.known is not None or study.secondary_or_empty.has_copies
    kinds = study.hard_data.n > 0, p.exact_data, p.scale > 0, repairs(study), has_gaps, p.variant
    return *types, len(study.grid.shape), study.is_guided, *kinds
