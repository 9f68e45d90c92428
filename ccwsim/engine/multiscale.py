"""MS-CCSIM: search at the coarsest scale, then place the same patches at each finer scale.

The paper compares its method with this method of Tahmasebi, Sahimi and Caers (2014) in section 5.4.
Images are up-gridded instead of transformed by wavelets. The search fills the coarsest grid. Each
finer scale places the same patches near the locations chosen at the next coarser scale.
"""

from math import prod
from typing import NamedTuple

import numpy as np

from ccwsim.engine.corrections.refinement import data_at_stake, refine_place
from ccwsim.engine.kernels import kernel
from ccwsim.engine.prepared_image import PreparedImage
from ccwsim.engine.published import place_near
from ccwsim.engine.raster import MAX_PATCHES_PER_CALL, Plan, empty_grid, reported_calls
from ccwsim.engine.stages.bits import take_strips
from ccwsim.engine.stages.conditioning import PlacedData
from ccwsim.engine.stages.path import Triple
from ccwsim.engine.tiles import Simulated, cut_and_paste, make_placing, patch_box
from ccwsim.jobs.workers import Watch
from ccwsim.model import Bytes, Ints, UInt64s

CELLS_PER_CALL = 100_000_000  # number of cells compared between two reports of progress


class ScaleInputs(NamedTuple):
    """Inputs to place patches at one scale."""

    patches: Ints  # shape (n, 10): made by `make_patches`, in cells of this scale
    image: Bytes  # shape (nz, ny, nx)
    square_bits: UInt64s  # shape (n_planes, nz, ny, n_words)
    data: PlacedData
    overlap: Triple
    block: Triple  # cells of this scale in a cell of the coarser scale, along each axis
    missed: int  # cost of a datum not honoured, in wrong cells
    refine: bool


def place_at_finer_scales(
    prepared: PreparedImage,
    plan: Plan,
    simulated: Simulated,
    keep_sources: bool,
    watch: Watch,
) -> Simulated:
    """Place patches at each finer scale; return the grid of the finest scale."""
    study, orientation, patches = prepared.study, plan.path.orientation, plan.inputs.patches
    p, n = study.parameters, len(patches)
    at_once = min(max(CELLS_PER_CALL // prod(plan.lengths[0].template), 1), MAX_PATCHES_PER_CALL)
    for scale in range(p.scale - 1, -1, -1):
        lengths, coarser = plan.lengths[scale], plan.lengths[scale + 1]
        block = lengths.cells_of(coarser)
        patches = patches * np.array([*block, *block, 1, 1, 1, 1])
        bits, data = prepared.square_bits(orientation, scale), plan.data[scale]
        inputs = ScaleInputs(
            patches=patches,
            image=prepared.scaled(orientation, scale),
            square_bits=bits,
            data=data,
            overlap=lengths.overlap,
            block=block,
            missed=plan.inputs.search.missed,
            refine=p.refine,
        )
        placing = make_placing(bits, lengths.template, lengths.overlap, data)
        locations = simulated.locations
        simulated = empty_grid(prepared, plan, scale, keep_sources)._replace(locations=locations)
        for first in reported_calls(study, p.scale - scale, n, at_once, watch):
            last = min(first + at_once, n)
            if plan.published is None:
                refine_patches(first, last, inputs, placing, simulated)
            else:
                place_near(first, last, plan.published.rules, inputs, placing, simulated)
    return simulated


@kernel
def refine_patches(first, last, inputs, placing, simulated):
    """Place patches `first` to `last` − 1 near their locations at the coarser scale.

    `simulated.locations`, shape (n, 3), contains the locations at the coarser scale and is updated.
    If `inputs.refine` is false, patches stay at the locations of the coarser scale.
    """
    image, square_bits, data, block = inputs.image, inputs.square_bits, inputs.data, inputs.block
    grid, locations = simulated.grid, simulated.locations
    strips, at_stake, cut = placing
    for number in range(first, last):
        box = patch_box(inputs.patches[number], inputs.overlap)
        place = (
            block[0] * np.int64(locations[number, 0]),
            block[1] * np.int64(locations[number, 1]),
            block[2] * np.int64(locations[number, 2]),
        )
        if inputs.refine:
            take_strips(grid, box, square_bits, strips)
            lost, missed = at_stake[: data_at_stake(grid, data, box, at_stake)], inputs.missed
            _, z, y, x = refine_place(image, square_bits, box, block, place, strips, lost, missed)
            place = z, y, x
        cut_and_paste(number, box, place, image, data, cut, simulated)
