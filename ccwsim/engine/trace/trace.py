"""Trace a realization by calling the kernels of `realization` once per patch."""

from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ccwsim.engine.corrections.resimulation import first_cell
from ccwsim.engine.prepared_image import PreparedImage
from ccwsim.engine.raster import Plan, draw_template, empty_grid, make_plan, to_grid
from ccwsim.engine.realization import Realization, honour_data, random_numbers, repair, repairs
from ccwsim.engine.stages.conditioning import DENSE_WEIGHTS, SPARSE
from ccwsim.engine.stages.path import FROM_ABOVE, Box, Triple, inside_overlap
from ccwsim.engine.stages.pyramid import block_sums, cells_of_blocks, decompose, reconstruct
from ccwsim.engine.trace.frames import Frame
from ccwsim.engine.trace.patch import Patch, TracedPatch, data_terms, seen_data
from ccwsim.model import (
    Array,
    Bytes,
    CCWSIMError,
    Floats,
    Int16s,
    Int32s,
    Ints,
    Mask,
    Parameters,
    Study,
    refused,
    window_at,
)


class ResimulatedWindow(NamedTuple):
    """A re-simulated window around a datum, or one forced cell, in grid coordinates."""

    datum: int  # number of the datum in the hard data
    size: int  # side in cells
    row: int  # first row
    column: int  # first column
    before: Bytes  # facies indices, shape (size, size)
    after: Bytes
    sources: Int32s  # flat index in the training image; −1 for a single changed cell
    fits: bool  # whether any patch fits and honours all data; otherwise nothing has changed
    isolated: bool  # whether the datum was honoured before, but isolated
    layer: int = 0  # first layer


def resimulated_windows(
    prepared: PreparedImage,
    template: Triple,
    grid: Bytes,
    sources: Int32s,
    rng: np.random.Generator,
) -> tuple[list[ResimulatedWindow], Int16s]:
    """Honour data like `honour_data`; return all tried windows and the data status."""
    study, cells, last = prepared.study, prepared.study.hard_data.cells, grid.copy()
    windows: list[ResimulatedWindow] = []

    def note(datum: int, lengths: Triple, fits: bool) -> None:
        cell, size = tuple(cells[datum].tolist()), lengths[-grid.ndim :]
        axes = zip(cell, size, grid.shape, strict=True)
        first = [int(first_cell(middle, n, length)) for middle, n, length in axes]
        part = window_at(first, size)
        before, after = last[part].copy(), grid[part].copy()
        was_honoured = last[cell] == study.facies_of_data[datum]
        last[part] = after
        if was_honoured and (before == after).all():
            return
        layer, row, column = (0, *first)[-3:]
        windows.append(
            ResimulatedWindow(
                datum=datum,
                size=size[-1],
                row=row,
                column=column,
                before=before,
                after=after,
                sources=sources[part].copy(),
                fits=fits,
                isolated=bool(was_honoured),
                layer=layer,
            )
        )

    return windows, honour_data(prepared, template, grid, sources, rng, on_window=note)


MAX_CHECKPOINTS = 24
"""Maximum number of checkpoints of a trace; a checkpoint is as large as the grid."""
MAX_CHECKPOINT_BYTES = 64_000_000
"""Maximum total size of checkpoints in bytes; a trace has at least 4 checkpoints."""
MIN_INTERVAL = 8  # minimum number of patches between two checkpoints


class PatchStepper:
    """A realization that is simulated patch by patch."""

    def __init__(self, prepared: PreparedImage, plan: Plan, rng: np.random.Generator) -> None:
        self.plan, self.rng = plan, rng
        self.patches = _patches(plan)
        self.work = plan.workspace()
        self.simulated = empty_grid(prepared, plan, 0, keep_sources=True)
        self._next = 0
        n_kept = min(max(MAX_CHECKPOINT_BYTES // self.simulated.grid.size, 4), MAX_CHECKPOINTS)
        self._every = max(-(-len(self.patches) // n_kept), MIN_INTERVAL)
        # grid, counts and state of `rng` before a patch; simulating it again restores sources
        self._checkpoints: dict[int, tuple[Bytes, Ints, Any]] = {}

    @property
    def n_done(self) -> int:
        """Number of patches that have been simulated."""
        return max([self._next, *self._checkpoints])

    def go_to(self, number: int) -> None:
        """Restore or simulate the grid before patch `number`."""
        if not self._next <= number < self._next + self._every:
            latest = max((k for k in self._checkpoints if k <= number), default=-1)
            if latest >= 0 and (self._next > number or latest > self._next):
                self._next = latest
                grid, counts, self.rng.bit_generator.state = self._checkpoints[self._next]
                copies = {"grid": grid.copy(), "counts": counts.copy()}
                self.simulated = self.simulated._replace(**copies)
        while self._next < number:
            self.step()

    def step(self) -> Triple:
        """Simulate the next patch and return its location in the oriented image."""
        k, simulated = self._next, self.simulated
        if k % self._every == 0 and k not in self._checkpoints:
            copies = simulated.grid.copy(), simulated.counts.copy()
            self._checkpoints[k] = *copies, self.rng.bit_generator.state
        self.plan.simulate_patches(k, k + 1, self.work, simulated, self.rng)
        self._next += 1
        z, y, x = simulated.locations[k].tolist()
        return z, y, x


def _patches(plan: Plan) -> tuple[Patch, ...]:
    patches, (_, rows, columns) = [], plan.path.tiles
    for k, numbers in enumerate(plan.inputs.patches.tolist()):
        z0, y0, x0, nz, _, nx, sides, split, tile, part = numbers
        row, column = divmod(tile % (rows * columns), columns)
        patches.append(
            Patch(
                number=k,
                tile=tile,
                part=part,
                row=row,
                column=column,
                parts=int(plan.inputs.oriented.splits[split, 2]),
                split=split,
                y0=y0,
                x0=x0,
                size=nx,
                shape=sides,
                z0=z0,
                layers=nz,
            )
        )
    return tuple(patches)


class Trace:
    """One realization of a study, simulated patch by patch by the kernels of `simulate`.

    Patches are simulated when requested. To return to an earlier patch, the simulation restarts at
    the last checkpoint before the patch, which takes little time. Raises `CCWSIMError` for the
    method "ms-ccsim", which places each patch once per scale.

    Examples
    --------
    >>> from ccwsim import Grid, Parameters, TrainingImage
    >>> stripes = TrainingImage(np.tile([[0], [0], [1], [1]], (16, 64)))
    >>> trace = Trace(Study(stripes, Grid(40, 50), Parameters(16, 4, 1, published_draw=True)))
    >>> len(trace.patches), trace.at(1).n_candidates, trace.realization.indices.shape
    (12, 20, (40, 50))
    """

    def __init__(self, study: Study, number: int = 0) -> None:
        check_traceable(study.parameters, study.hard_data.n)
        self.study, self.number = study, number
        rng = random_numbers(study.seed, number)
        self._template = draw_template(study.parameters, study.training_image.shape, rng)
        self.template = self._template[2]
        self._image = PreparedImage(study)
        plan = make_plan(self._image, self._template, rng)
        self.path, self.oriented, self.search = plan.path, plan.inputs.oriented, plan.inputs.search
        self.data = plan.inputs.data
        self._stepper = PatchStepper(self._image, plan, rng)
        self.patches = self._stepper.patches
        n, orientation = study.grid.n_dimensions, self.path.orientation
        self.grid_frame = Frame(orientation, self.path.shape[-n:], self.path.offset[-n:])
        self.image_frame = Frame(orientation, self.oriented.pyramid.image.shape[-n:])
        self._coefficients: dict[tuple[int, int], list[Any]] = {}

    @property
    def n_done(self) -> int:
        """Number of patches that have been simulated so far."""
        return self._stepper.n_done

    def at(self, number: int) -> TracedPatch:
        """Return how patch `number`, from 0, was chosen, cut and pasted."""
        if not 0 <= number < len(self.patches):
            raise CCWSIMError(f"patch {number} is not one of 0 … {len(self.patches) - 1}")
        self._stepper.go_to(number)
        before = self._stepper.simulated.grid.copy()
        return self._traced(self.patches[number], before, self._stepper.step())

    @cached_property
    def _finished(self) -> tuple[Realization, list[ResimulatedWindow], Bytes]:
        """The realization, the windows of local re-simulation, and the cells before seam repair."""
        stepper = self._stepper
        stepper.go_to(len(self.patches))
        indices, sources = to_grid(self._image, stepper.simulated, self.path)
        indices, sources = indices.copy(), sources.copy()  # the stepper needs unchanged arrays
        rng = random_numbers(0, 0)
        rng.bit_generator.state = stepper.rng.bit_generator.state
        image, template = self._image, self._template
        windows, data_status = resimulated_windows(image, template, indices, sources, rng)
        before = indices.copy()
        repair(image, template, indices, sources, rng, data_status=data_status)
        return Realization(indices, sources, data_status), windows, before

    @property
    def realization(self) -> Realization:
        """The realization; its cells equal those that `simulate` returns."""
        return self._finished[0]

    @property
    def windows(self) -> list[ResimulatedWindow]:
        """The windows of local re-simulation, in the order of the attempts."""
        return self._finished[1]

    @property
    def repairs(self) -> bool:
        """Whether seams are repaired."""
        return repairs(self.study)

    @property
    def before_repair(self) -> Bytes:
        """Facies indices of the realization before seam repair."""
        return self._finished[2]

    def reconstructed(self, step: TracedPatch, facies: int) -> Floats:
        """Return the indicator of a facies in a patch, computed by the inverse DWT.

        This method implements Algorithm 1, line 13, for maps only. The result, shape (n, n), is in
        path coordinates; n is the side of the patch, rounded down to complete blocks.
        """
        key = facies, step.layer
        if key not in self._coefficients:
            image, level = self.oriented.pyramid.image[step.layer], self._image.lengths[0].level
            self._coefficients[key] = decompose(image == facies, level[2])
        row, column = step.places[step.drawn].tolist()
        size = step.cells.shape[0] // step.block_size * step.block_size
        return reconstruct(self._coefficients[key], (row, column), size)

    def patch_of_cell(self, row: int, column: int) -> int:
        """Return the number of the patch that first covers a cell of a map."""
        y, x = self.grid_frame.cell_to_path(row, column)
        return next(
            p.number
            for p in self.patches
            if p.y0 <= y < p.y0 + p.size and p.x0 <= x < p.x0 + p.size
        )

    def _traced(self, p: Patch, before: Bytes, place: Triple) -> TracedPatch:
        """Return the record of a patch from the workspace, after the patch was simulated."""
        work, search, pyramid = self._stepper.work, self.search, self.oriented.pyramid
        n_candidates, n_drawn, drawn = work.choice.tolist()
        inputs = self._stepper.plan.inputs
        z0, y0, x0, nz, ny, nx, sides = inputs.patches[p.number, :7].tolist()
        oz, oy, ox = search.overlap
        box = Box(z0, y0, x0, nz, ny, nx, sides, oz, oy, ox)
        cells = before[z0 : z0 + nz, y0 : y0 + ny, x0 : x0 + nx]
        sums = block_sums(cells_of_blocks(cells, search.block), len(pyramid.sums))
        blocks, ends = sums.astype(np.int64), np.reshape(inside_overlap(box), (3, 2))
        inside = (
            slice(low // b, high // b) for (low, high), b in zip(ends, search.block, strict=True)
        )
        blocks[:, *inside] = 0
        tz, ty, tx = place
        layer, n_layers = inputs.layers[min(p.number, len(inputs.layers) - 1)].tolist()
        volume, data, slack = len(self.study.grid.shape) == 3, None, None
        names = self._image.copies and self._image.copies.names
        totals = work.scores[:n_layers]

        def without_layers(array: Array) -> Array:
            return array if volume else array[..., 0, :, :]

        def of_places(array: Array) -> Array:
            """Return values for all layers of locations; in a map, for the copy of `place`."""
            if not volume:
                return array[tz - layer]
            fill = False if array.dtype == bool else np.iinfo(array.dtype).max
            whole = np.full(self.oriented.places, fill, array.dtype)
            whole[layer : layer + n_layers] = array
            return whole

        if sides and search.slack >= 0:
            slack = int(search.slack)
        scores, copies = self._all_scores(blocks, layer, n_layers)
        illegal = self.oriented.illegal[layer : layer + n_layers]
        if seen_data(self.data, before, box, search.co_template):
            weights, totals = SPARSE if p.split == 0 else DENSE_WEIGHTS, work.totals[:n_layers]
            data = data_terms(
                inputs, layer, before, box, weights, totals=totals, of_places=of_places
            )
            slack = data.slack
        correlation = self.study.parameters.similarity == "correlation"
        places = np.stack(np.unravel_index(work.ranking.places, self.oriented.places), axis=1)
        if not volume:
            in_copy = places[:, 0] == tz
            n_candidates, drawn = int(in_copy[:n_candidates].sum()), int(in_copy[:drawn].sum())
            places = places[in_copy]
        return TracedPatch(
            patch=p,
            box=box,
            before=without_layers(before),
            after=without_layers(self._stepper.simulated.grid).copy(),
            blocks=without_layers(blocks),
            scores=of_places(scores),
            energy=0 if correlation else int(np.square(blocks).sum()),
            block=search.block,
            places=places if volume else places[:, 1:],
            n_candidates=n_candidates,
            n_drawn=n_drawn,
            drawn=drawn,
            place=place if volume else place[1:],
            cells=without_layers(pyramid.image[tz : tz + nz, ty : ty + ny, tx : tx + nx]),
            keep_mask=without_layers(work.placing.cut.keep_mask[:nz, :ny, :nx]).copy(),
            overlap=search.overlap[2],
            correlation=correlation,
            slack=slack,
            copies=of_places(copies),
            steered=inputs.steering.is_on,
            data=data,
            totals=of_places(totals).copy() if data or self.study.is_guided else None,
            illegal=of_places(illegal.astype(bool)) if illegal.size else np.array(False),
            layer=0 if volume else tz,
            source=names[-1 - tz if self.path.orientation & FROM_ABOVE else tz] if names else "",
        )

    def _all_scores(self, blocks: Ints, layer: int, n_layers: int) -> tuple[Array, Mask]:
        """Return the real scores of locations from `layer` on, and which are continuations."""
        work, n = self._stepper.work, n_layers
        scores, energies = work.scores[:n].copy(), work.energies[layer : layer + n]
        copies = np.zeros(scores.shape, bool)
        if self._stepper.plan.inputs.before.shape[1]:
            copies = scores == 2 ** (8 * scores.itemsize - 1) - 1
        if self.study.is_guided:  # without the costs of the guides
            scores = scores - (work.guided[:n].astype(np.int64) - energies)
        sums = self.oriented.pyramid.sums[:, layer:]
        for place in np.argwhere(copies):
            part = window_at(place, blocks.shape[1:])
            product = (sums[:, *part].astype(np.int64) * blocks).sum()
            scores[tuple(place)] = energies[tuple(place)] - 2 * product
        return scores, copies


def check_traceable(parameters: Parameters, n_data: int) -> None:
    """Raise an error if realizations of a study cannot be traced patch by patch."""
    if parameters.scale:
        raise refused("trace_of_ms_ccsim")
    if n_data and parameters.variant != "ours":
        raise refused("trace_of_variant", variant=parameters.variant)
