"""A realization that can be looked at patch by patch: the compiled run, one patch a call."""

from __future__ import annotations

from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccwsim.engine.corrections.resimulation import first_cell, resimulate
from ccwsim.engine.prepared_image import PreparedImage
from ccwsim.engine.raster import (
    Plan,
    draw_template,
    empty_grid,
    make_plan,
    to_grid,
)
from ccwsim.engine.realization import Realization, random_numbers, repair, repairs, target_of
from ccwsim.engine.stages.box import Box, inside_overlap
from ccwsim.engine.stages.conditioning import DENSE, SPARSE
from ccwsim.engine.stages.path import Triple, in_three
from ccwsim.engine.stages.pyramid import block_sums, cells_of_blocks, decompose, reconstruct
from ccwsim.engine.tiles import simulate_patches
from ccwsim.engine.trace.frames import Frame
from ccwsim.engine.trace.patch import Patch, TracedPatch, data_terms, seen_data
from ccwsim.model.ensemble import WRONG
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.parameters import Parameters
from ccwsim.model.study import Study


class ResimulatedWindow(NamedTuple):
    """A window around a datum, in grid coordinates; a single cell where it was forced.

    Attributes
    ----------
    datum : int
        Its number in the hard data.
    size, row, column : int
        Side, and first cell.
    before, after : ndarray of uint8, shape (size, size)
    sources : ndarray of int32, shape (size, size)
        Flat index in the training image of each cell after it, −1 where it was set alone.
    fits : bool
        Whether a patch was found that honours all data and fits; else nothing changed.
    isolated : bool
        Whether the datum was right already but isolated.
    layer : int
        First layer; 0 in a map.
    """

    datum: int
    size: int
    row: int
    column: int
    before: NDArray[np.uint8]
    after: NDArray[np.uint8]
    sources: NDArray[np.int32]
    fits: bool
    isolated: bool
    layer: int = 0


def resimulated_windows(
    study: Study,
    template: Triple,
    image: PreparedImage,
    rng: np.random.Generator,
    grid: NDArray[np.uint8],
    sources: NDArray[np.int32],
) -> tuple[list[ResimulatedWindow], NDArray[np.int16]]:
    """Re-simulate `grid` locally, in place; return every window that was tried and the data status.

    Windows around data that another window had honoured already are left out.
    """
    cells = study.hard_data.cells
    target = target_of(study, image, grid, sources)
    last = grid.copy()
    windows: list[ResimulatedWindow] = []

    def note(datum: int, lengths: Triple, fits: bool) -> None:
        cell, own = tuple(cells[datum].tolist()), lengths[-grid.ndim :]
        each = zip(cell, own, grid.shape, strict=True)
        first = [int(first_cell(middle, n, length)) for middle, n, length in each]
        part = tuple(slice(start, start + n) for start, n in zip(first, own, strict=True))
        before, after = last[part].copy(), grid[part].copy()
        right = last[cell] == study.facies_of_data[datum]
        last[part] = after
        if right and (before == after).all():
            return
        came_from = sources[part].copy()
        layer, row, column = (0, *first)[-3:]
        windows.append(
            ResimulatedWindow(
                datum, own[-1], row, column, before, after, came_from, fits, bool(right), layer
            )
        )

    thresholds = image.isolated_datum_thresholds if study.hard_data.n else None
    data_status = resimulate(target, in_three(cells), template, rng, thresholds, on_window=note)
    return windows, data_status


MAX_CHECKPOINTS = 24
"""A trace keeps at most so many states to start again from, each as large as the grid …"""
MAX_CHECKPOINT_BYTES = 64_000_000
"""… and fewer of large grids."""
MIN_INTERVAL = 8
"""Patches between two of them, at least."""


class Checkpoint(NamedTuple):
    """All that a realization goes on from before a patch.

    Sources of cells are left as they are: a patch that is simulated again writes the same ones.
    """

    grid: NDArray[np.uint8]
    counts: NDArray[np.int64]
    rng: Any


class PatchStepper:
    """A realization on its way along the path."""

    def __init__(self, study: Study, plan: Plan, rng: np.random.Generator) -> None:
        self.plan, self.rng = plan, rng
        self.patches = _patches(plan)
        self.work = plan.workspace()
        self.simulated = empty_grid(study, plan, 0, len(self.patches), keep_sources=True)
        self._next = 0
        n_kept = min(max(MAX_CHECKPOINT_BYTES // self.simulated.grid.size, 4), MAX_CHECKPOINTS)
        self._every = max(-(-len(self.patches) // n_kept), MIN_INTERVAL)
        self._checkpoints: dict[int, Checkpoint] = {}

    @property
    def n_done(self) -> int:
        """Up to which patch it is known."""
        return max([self._next, *self._checkpoints])

    def go_to(self, number: int) -> None:
        """Bring the grid to where it is before a patch."""
        if not self._next <= number < self._next + self._every:
            known = [k for k in self._checkpoints if k <= number]
            if known and (self._next > number or max(known) > self._next):
                self._restore(max(known))
        while self._next < number:
            self.step()

    def _restore(self, number: int) -> None:
        kept = self._checkpoints[number]
        self.simulated = self.simulated._replace(grid=kept.grid.copy(), counts=kept.counts.copy())
        self._next, self.rng.bit_generator.state = number, kept.rng

    def step(self) -> Triple:
        """Simulate the next patch and return its location in the oriented image."""
        k, plan, simulated = self._next, self.plan, self.simulated
        if k % self._every == 0 and k not in self._checkpoints:
            state = self.rng.bit_generator.state
            self._checkpoints[k] = Checkpoint(simulated.grid.copy(), simulated.counts.copy(), state)
        fixed = plan.patches, plan.before, plan.oriented, plan.data[0], plan.search, plan.steering
        simulate_patches(k, k + 1, *fixed, self.rng, self.work, simulated)
        self._next += 1
        z, y, x = simulated.locations[k].tolist()
        return z, y, x


def _patches(plan: Plan) -> tuple[Patch, ...]:
    found = []
    for k, (z0, y0, x0, nz, _, nx, sides, split, tile, part) in enumerate(plan.patches.tolist()):
        row, column = divmod(tile % (plan.path.tiles[1] * plan.path.tiles[2]), plan.path.tiles[2])
        parts = int(plan.oriented.splits[split, 2])
        own = Patch(k, tile, part, row, column, parts, split, y0, x0, nx, sides, z0, nz)
        found.append(own)
    return tuple(found)


class Trace:
    """One realization of a study, patch by patch, by the kernels that `simulate` runs.

    Patches are simulated when they are asked for; going back starts from the nearest state that was
    kept, so that any patch is at hand at once.

    Parameters
    ----------
    study : Study
    number : int
        Of the realization.

    Raises
    ------
    CCWSIMError
        For the method "ms-ccsim", which places each patch once a scale.

    Examples
    --------
    >>> from ccwsim import Grid, Parameters, TrainingImage
    >>> stripes = TrainingImage(np.tile([[0], [0], [1], [1]], (16, 64)))
    >>> trace = Trace(Study(stripes, Grid(40, 50), Parameters(16, 4, 1, published_draw=True)))
    >>> len(trace.patches), trace.at(1).n_candidates, trace.realization.indices.shape
    (12, 20, (40, 50))
    """

    def __init__(self, study: Study, number: int = 0) -> None:
        check_traceable(study.parameters)
        self.study, self.number = study, number
        rng = random_numbers(study.seed, number)
        self._template = draw_template(study.parameters, study.training_image.shape, rng)
        self.template = self._template[2]
        self._image = PreparedImage(study)
        plan = make_plan(study, self._template, self._image, rng)
        self.path, self.oriented, self.search = plan.path, plan.oriented, plan.search
        self.data = plan.data[0]
        self._stepper = PatchStepper(study, plan, rng)
        self.patches = self._stepper.patches
        n, way = study.grid.n_dimensions, self.path.orientation
        self.grid_frame = Frame(way, self.path.shape[-n:], self.path.offset[-n:])
        self.image_frame = Frame(way, self.oriented.pyramid.image.shape[-n:])
        self._coefficients: dict[int, list[Any]] = {}

    @property
    def n_done(self) -> int:
        """Up to which patch it is known so far."""
        return self._stepper.n_done

    def at(self, number: int) -> TracedPatch:
        """Return how a patch was chosen, cut and pasted.

        Parameters
        ----------
        number : int
            0 for the first one.

        Raises
        ------
        CCWSIMError
            Where there is no such patch.
        """
        if not 0 <= number < len(self.patches):
            raise CCWSIMError(f"patch {number} is not one of 0 … {len(self.patches) - 1}")
        self._stepper.go_to(number)
        before = self._stepper.simulated.grid.copy()
        place = self._stepper.step()
        return self._traced(self.patches[number], before, place)

    @cached_property
    def _finished(self) -> tuple[Realization, list[ResimulatedWindow], NDArray[np.uint8]]:
        """The realization, the windows of its local re-simulation, and it before seam repair."""
        stepper = self._stepper
        stepper.go_to(len(self.patches))
        cells = self.study.hard_data.cells
        grid, sources = stepper.simulated.grid, stepper.simulated.sources
        indices, sources = to_grid(grid, sources, self.path, self.study)
        windows: list[ResimulatedWindow] = []
        indices, sources = indices.copy(), sources.copy()  # not those that the trace goes on with
        rng = random_numbers(0, 0)
        rng.bit_generator.state = stepper.rng.bit_generator.state
        if self.study.parameters.exact_data:
            windows, data_status = resimulated_windows(
                self.study, self._template, self._image, rng, indices, sources
            )
        else:
            missed = indices[tuple(cells.T)] != self.study.facies_of_data
            data_status = np.where(missed, WRONG, 0).astype(np.int16)
        before = indices.copy()
        if repairs(self.study):
            target = target_of(self.study, self._image, indices, sources)
            repair(self.study, target, data_status, self._template, self._image, rng)
        return Realization(indices, sources, data_status), windows, before

    @property
    def realization(self) -> Realization:
        """The realization: what `simulate` gives, cell by cell."""
        return self._finished[0]

    @property
    def windows(self) -> list[ResimulatedWindow]:
        """The windows of local re-simulation, in their order."""
        return self._finished[1]

    @property
    def repairs(self) -> bool:
        """Whether seams are repaired."""
        return repairs(self.study)

    @property
    def before_repair(self) -> NDArray[np.uint8]:
        """The realization before its seams were repaired, facies indices."""
        return self._finished[2]

    def reconstructed(self, step: TracedPatch, facies: int) -> NDArray[np.float64]:
        """Return the drawn patch of a facies by the inverse DWT (Algorithm 1, line 13).

        Of a map, in path coordinates, shape (n, n) where n are the whole blocks of its side.
        """
        if facies not in self._coefficients:
            image = self.oriented.pyramid.image[0] == facies
            self._coefficients[facies] = decompose(
                image, self.study.parameters.along(self.study.grid.shape).level[2]
            )
        row, column = step.places[step.drawn].tolist()
        size = step.cells.shape[0] // step.block_size * step.block_size
        return reconstruct(self._coefficients[facies], (row, column), size)

    def patch_of_cell(self, row: int, column: int) -> int:
        """Return the number of the patch that first covers a cell of a map."""
        y, x = self.grid_frame.cell_to_path(row, column)
        return next(
            p.number
            for p in self.patches
            if p.y0 <= y < p.y0 + p.size and p.x0 <= x < p.x0 + p.size
        )

    def _traced(self, p: Patch, before: NDArray[np.uint8], place: Triple) -> TracedPatch:
        """Return what the latest call left in the workspace."""
        work, search, pyramid = self._stepper.work, self.search, self.oriented.pyramid
        n_candidates, n_drawn, drawn = work.choice.tolist()
        z0, y0, x0, nz, ny, nx, sides = self._stepper.plan.patches[p.number, :7].tolist()
        box = Box(z0, y0, x0, nz, ny, nx, sides, *search.overlap)
        cells = before[z0 : z0 + nz, y0 : y0 + ny, x0 : x0 + nx]
        sums = block_sums(cells_of_blocks(cells, search.block), len(pyramid.sums))
        blocks, ends = sums.astype(np.int64), np.reshape(inside_overlap(box), (3, 2))
        inside = (slice(*n // b) for n, b in zip(ends, search.block, strict=True))
        blocks[:, *inside] = 0
        totals, data, slack = work.totals.copy(), None, None
        if sides and search.slack >= 0:
            slack = int(search.slack)
        scores, copies = self._all_scores(blocks)
        if seen_data(self.data, before, box, search.co_template):
            weights = SPARSE if p.split == 0 else DENSE
            slack = int(weights.slack * search.slack_cost)
            times = search.co_template
            phases = pyramid.phases
            data = data_terms(phases, before, self.data, box, times, weights, slack, totals)
        tz, ty, tx = place
        correlation = self.study.parameters.similarity == "correlation"
        volume = len(self.study.grid.shape) == 3

        def own(array: NDArray) -> NDArray:
            return array if volume else array[..., 0, :, :]

        if data is not None and not volume:
            data = data.without_layer()
        places = np.stack(np.unravel_index(work.places, work.scores.shape), axis=1)
        return TracedPatch(
            patch=p,
            box=box,
            before=own(before),
            after=own(self._stepper.simulated.grid).copy(),
            blocks=own(blocks),
            scores=own(scores),
            energy=0 if correlation else int(np.square(blocks).sum()),
            block=search.block,
            places=places if volume else places[:, 1:],
            n_candidates=n_candidates,
            n_drawn=n_drawn,
            drawn=drawn,
            place=place if volume else place[1:],
            cells=own(pyramid.image[tz : tz + nz, ty : ty + ny, tx : tx + nx]),
            keep_mask=own(work.cut.keep_mask[:nz, :ny, :nx]).copy(),
            overlap=search.overlap[2],
            correlation=correlation,
            slack=slack,
            copies=own(copies),
            steered=self._stepper.plan.steering.gain > 0,
            data=data,
            totals=own(totals) if data is not None or search.location_cost > 0 else None,
        )

    def _all_scores(
        self, blocks: NDArray[np.int64]
    ) -> tuple[NDArray[np.number[Any]], NDArray[np.bool_]]:
        """Return the scores of all locations, and which were left out as continuations.

        These have the worst score in the workspace; here they get the one they would have had.
        """
        scores, plan = self._stepper.work.scores.copy(), self._stepper.plan
        copies = np.zeros(scores.shape, bool)
        if not plan.before.shape[1]:
            return scores, copies
        copies = scores == 2 ** (8 * scores.itemsize - 1) - 1
        sums, energies = self.oriented.pyramid.sums, self._stepper.work.energies
        for place in np.argwhere(copies):
            part = tuple(slice(k, k + n) for k, n in zip(place, blocks.shape[1:], strict=True))
            both = (sums[:, *part].astype(np.int64) * blocks).sum()
            scores[tuple(place)] = energies[tuple(place)] - 2 * both
        return scores, copies


def check_traceable(parameters: Parameters) -> None:
    """Raise where realizations of these parameters cannot be followed patch by patch."""
    if parameters.scale:
        raise CCWSIMError(
            'the method "ms-ccsim" places every patch once a scale and is not followed here: '
            'choose "ccwsim", or "ccsim"'
        )
